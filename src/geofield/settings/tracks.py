"""Stage 4, the tracks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import (
    AfterValidator,
    Field,
    ModelWrapValidatorHandler,
    PositiveFloat,
    model_validator,
)

from geofield.settings.section import NonNegative, Reach, Section

DirectionName = Literal["dominant", "longest_edge", "hough", "fewest", "fewest_turns"]


#: Ways to say where the tracks lie: what is said later, and what gives way to it.
_PLACED = (
    ("offset_m", "through_lonlat"),
    ("through_lonlat", "offset_m"),
    # An A-B line passes through its A.
    ("ab_lonlat", "offset_m"),
    ("ab_lonlat", "through_lonlat"),
)


def _direction(value: str) -> str:
    """A way to find the direction, or a heading in degrees."""
    names = get_args(DirectionName)
    try:
        heading = float(value)
    except ValueError:
        if value in names:
            return value
        listed = ", ".join(repr(name) for name in names)
        raise ValueError(f"input should be a heading in degrees or {listed}") from None
    if not math.isfinite(heading):
        raise ValueError("input should be a finite heading")
    return value


class TrackSettings(Section):
    """Stage 4: the tracks."""

    machine: str | None = Field(
        None,
        description="Machine of the settings file, [machines.NAME]: its width, turning radius, "
        "overhang and offset.",
    )
    width_m: PositiveFloat | None = Field(
        None, description="Working width, metres; without a spacing, that is this less the overlap."
    )
    overlap_m: float | None = Field(
        None,
        description="How far neighbouring passes overlap, metres; below 0 a gap between them.",
    )
    spacing_m: PositiveFloat = Field(2.0, description="Distance between tracks, metres.")
    step_m: PositiveFloat = Field(1.0, description="Distance between track points, metres.")
    direction: Annotated[str, AfterValidator(_direction)] = Field(
        "dominant",
        coerce_numbers_to_str=True,
        description="Of the tracks: dominant (the way most of the border runs), longest_edge, "
        "hough, fewest, fewest_turns, or a heading in "
        "degrees clockwise from true north.",
    )
    ab_lonlat: tuple[float, float, float, float] | None = Field(
        None, description="A-B line to follow: longitude and latitude of A, then of B."
    )
    through_lonlat: tuple[float, float] | None = Field(
        None, description="Longitude and latitude of a place that a track passes through."
    )
    offset_m: NonNegative | None = Field(
        None,
        description="Of the first track from its edge, metres; half the working width, or half "
        "the spacing, by default.",
    )
    last_strip: Literal["overrun", "leave", "shift", "spread"] = Field(
        "overrun",
        description="The rest at the far side: overrun the border, leave it, shift the last track "
        "back, or spread all tracks evenly.",
    )
    headland_m: NonNegative = Field(
        0.0, description="Width of the headland along the border, metres."
    )
    headland_passes: int | None = Field(
        None, ge=0, description="Width of the headland in passes of one spacing, instead of metres."
    )
    headland_holes: bool = Field(False, description="A headland around the field's holes too.")
    min_segment_m: NonNegative = Field(0.0, description="Shorter segments are not driven, metres.")
    clearance_m: Reach = Field(
        0.0, description="Distance to keep from obstacles, on top of their margin, metres."
    )
    straight_tolerance_m: PositiveFloat = Field(
        1.0, description="How far the vertices of a straight edge may stray, metres."
    )
    route: Literal["none", "boustrophedon", "skip", "shortest"] = Field(
        "none", description="Order of work, with the ways between segments."
    )
    skip: int = Field(1, ge=0, description="Tracks left out at each turn of the route skip.")
    turning_radius_m: PositiveFloat | None = Field(
        None, description="Of the machine, metres: turns become curves."
    )
    curve: Literal["dubins", "reeds_shepp"] = Field(
        "dubins", description="Turns forwards only, or with reversing."
    )
    margin_m: NonNegative = Field(
        0.0, description="How far turns may reach beyond the border, metres."
    )
    start_lonlat: tuple[float, float] | None = Field(
        None, description="Longitude and latitude of the place where the route begins."
    )

    @model_validator(mode="wrap")
    @classmethod
    def _follow(cls, given: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Fill in what follows from the working width and the passes of the headland.

        What follows does not count as set: said with another spacing, it is another.
        """
        if not isinstance(given, Mapping):
            return handler(given)
        filled = cls._filled(given)
        settings = handler(filled)
        settings.model_fields_set.difference_update(filled.keys() - given.keys())
        return settings

    @classmethod
    def _filled(cls, given: Mapping[str, Any]) -> dict[str, Any]:
        """What was given with what follows from it; what contradicts a later word is left out."""
        said = dict(given)
        width_m, overlap_m = _number(said.get("width_m")), _number(said.get("overlap_m"))
        if width_m is not None:
            if overlap_m is not None and overlap_m >= width_m:
                raise ValueError("the overlap is not smaller than the working width")
            follows_m = width_m - (overlap_m or 0.0)
            if _number(said.setdefault("spacing_m", follows_m)) != follows_m:
                said["overlap_m"] = None
        elif overlap_m is not None:
            raise ValueError("an overlap needs the working width (width_m)")
        passes = _number(said.get("headland_passes"))
        spacing_m = _number(said.get("spacing_m", cls.model_fields["spacing_m"].default))
        if passes is not None and spacing_m is not None:
            follows_m = passes * spacing_m
            if _number(said.setdefault("headland_m", follows_m)) != follows_m:
                said["headland_passes"] = None
        return said


def said_over(earlier: Mapping[str, Any], said: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of the tracks with what was said later: what follows from it is left out.

    A spacing that was said before does not stand against a working width that is said now, nor an
    A-B line against a direction, nor an offset or a place to pass through against each other or
    against an A-B line.
    """
    kept = dict(earlier)
    for later, before in (("direction", "ab_lonlat"), *_PLACED):
        if said.get(later) is not None and before not in said:
            kept.pop(before, None)
    if "spacing_m" not in said and not said.keys().isdisjoint(("width_m", "overlap_m")):
        kept.pop("spacing_m", None)
    if "headland_m" not in said and (kept | dict(said)).get("headland_passes") is not None:
        kept.pop("headland_m", None)
    return kept | dict(said)


def _number(value: Any) -> float | None:
    """A number, or None for what is none: its own check says so."""
    try:
        number = math.nan if value is None else float(value)
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None
