"""The work on one place: what a worker does, wherever it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import shapely

from geofield.crs import LONLAT, metric_crs, parse_crs, reproject, transformer
from geofield.earlier import drew_outline, holds, with_said_tracks
from geofield.errors import (
    FieldError,
    FieldWarning,
    GeofieldWarning,
    ImageryError,
    PointOutsideError,
)
from geofield.farm.place_settings import as_settings
from geofield.farm.places import Place
from geofield.imagery import Imagery
from geofield.known import obstacles_of, with_further
from geofield.model.evidence import Evidence, outline_record
from geofield.model.field import Field
from geofield.model.scene import ImagerySource
from geofield.notes import listening, warn
from geofield.pipeline import run_field, run_obstacles, run_tracks
from geofield.plan import Plan
from geofield.settings import Settings
from geofield.tracks.outline import clean_outline
from geofield.windows import WINDOW_M, open_scene, showing, wider

#: Share of the smaller outline that a place and its reviewed plan have in common at least.
_SHARED = 0.1
#: Share by which they may differ before it is told.
_PARTED = 0.01
#: Outlines that differ by less are the same, metres.
_SAME_M = 0.001
#: What the pictures showed that a plan was made on, in its evidence.
_PICTURES = "pictures"


@dataclass(frozen=True)
class Job:
    """What holds for all places."""

    settings: Settings
    #: None for parcels that are planned as they are.
    imagery: Imagery | None = None
    #: A file of what to avoid.
    obstacles: Path | None = None
    #: Of that file, where it does not say its CRS.
    obstacles_crs: str | None = None

    @property
    def standing(self) -> gpd.GeoDataFrame | None:
        """What stands in that file."""
        return None if self.obstacles is None else obstacles_of(self.obstacles, self.obstacles_crs)


def plan_place(place: Place, job: Job, previous: Plan | None = None) -> Plan:
    """The plan of one place; of a `previous` one what a person said stays.

    It gets the parcel as it is now, unless they drew its outline, what is new in the file of
    obstacles, and what other pictures than its own show.

    Raises
    ------
    GeofieldError
        When it cannot be planned, in words.
    """
    settings = as_settings(job.settings, place.settings)
    if not (np.isfinite(place.lat) and np.isfinite(place.lon)):
        raise FieldError(
            "The row has no position.", hint="Give it a shape, or a latitude and a longitude."
        )
    if previous is not None:
        reviewed, previous = previous, _around(_on_parcel(previous, place), job)
        place = _as_reviewed(place, previous)
        settings, said = with_said_tracks(settings, previous)
        for words in said:
            warn(words, FieldWarning)
        same = previous is reviewed and _same_stages(previous.settings, settings)
        if same and not _shown_anew(previous, place, settings, job.imagery):
            return _named(previous, place)
    boundary = None if place.outline is None or previous is not None else parcel_of(place)
    if job.imagery is not None:
        plan = _on_picture(job.imagery, place, boundary, settings, job, previous)
    elif previous is not None:
        plan = previous
    elif boundary is not None:
        # As it was given: what a person moves of it later is known by that.
        evidence = Evidence(outline=outline_record(boundary.polygon))
        plan = _around(Plan(boundary, evidence=evidence), job)
    else:
        raise FieldError(
            "A point alone has no outline, and there is no picture to find it in.",
            hint="Name the IMAGERY, or give parcels.",
        )
    return _named(run_tracks(plan, settings=settings), place)


def _named(plan: Plan, place: Place) -> Plan:
    """A plan with the names and columns of its place, without its picture."""
    field = replace(plan.field, field_id=place.field_id, name=place.name, own=place.own)
    return replace(plan, field=field, scene=None)


def _as_reviewed(place: Place, previous: Plan) -> Place:
    """A place with the name and columns that a person left, at a point of their outline."""
    field = previous.field
    lon, lat = field.inside_lonlat
    known = {name for name, _ in field.own}
    own = (*field.own, *(each for each in place.own if each[0] not in known))
    return replace(place, lat=lat, lon=lon, name=field.name or place.name, own=own)


def _holds(previous: Plan, place: Place) -> bool:
    """Whether a reviewed plan is of the field at a point, or was looked for there."""
    if holds(previous, lat=place.lat, lon=place.lon):
        return True
    told = previous.evidence.point
    return told is not None and np.allclose(told, (place.lat, place.lon), rtol=0.0, atol=1e-6)


def _on_parcel(previous: Plan, place: Place) -> Plan:
    """A reviewed plan on its parcel as that is now; on its own outline where a person drew that.

    Raises
    ------
    FieldError
        When what they reviewed is another field of that id.

    Warns
    -----
    FieldWarning
        With the area by which a drawn outline differs from the parcel.
    """
    parcel = None if place.outline is None else parcel_of(place)
    if not (_holds(previous, place) if parcel is None else overlap(previous.field, parcel)):
        raise FieldError(
            f"The plan that was reviewed as {place.field_id!r} is of a field elsewhere.",
            hint="Give this place an id of its own, or take that plan out of the farm's reviewed/.",
        )
    if parcel is None:
        return previous
    field = previous.field
    polygon = reproject(parcel.polygon, parcel.crs, field.crs)
    if polygon.equals_exact(field.polygon, _SAME_M):
        return previous
    # Of parcels that were reviewed without a record nobody knows who drew them.
    given = field.method == "boundary" and previous.evidence.outline is not None
    if given and not drew_outline(previous):
        evidence = replace(previous.evidence, outline=outline_record(polygon))
        return replace(previous, field=replace(field, polygon=polygon), evidence=evidence)
    apart = polygon.symmetric_difference(field.polygon).area
    if apart > _PARTED * min(polygon.area, field.polygon.area):
        warn(
            f"The reviewed outline stands; that of the places differs by {apart / 10_000:.2f} ha.",
            FieldWarning,
        )
    return previous


def overlap(field: Field, other: Field) -> bool:
    """Whether two outlines are of one field: they share a part of the smaller one."""
    there = reproject(field.polygon, field.crs, other.crs)
    if not np.isfinite(there.bounds).all():
        return False  # too far away for its metric CRS
    least = min(other.polygon.area, there.area)
    return bool(other.polygon.intersection(there).area >= _SHARED * least)


def is_near(field: Field, lat: float, lon: float) -> bool:
    """Whether a field lies at a point, or no farther from it than it is wide."""
    if not (np.isfinite(lat) and np.isfinite(lon)):
        return True
    point = shapely.Point(transformer(LONLAT, field.crs).transform(lon, lat))
    return bool(field.polygon.distance(point) <= np.sqrt(field.polygon.area))


def _same_stages(one: Settings | None, other: Settings) -> bool:
    """Whether both would have the stages do the same."""
    return one is not None and (one.field, one.obstacles, one.tracks) == (
        other.field, other.obstacles, other.tracks
    )  # fmt: skip


def _on_picture(
    imagery: Imagery,
    place: Place,
    boundary: Field | None,
    settings: Settings,
    job: Job,
    previous: Plan | None,
) -> Plan:
    """Outline, unless it is given, and obstacles."""
    outline = boundary if previous is None else previous.field
    asked = wider(settings, settings.imagery.size_m or WINDOW_M)
    seen = showing(asked, place.lat, place.lon, outline)
    with imagery.at(place.lat, place.lon, seen.imagery) as picture:
        window = open_scene(picture.path, place.lat, place.lon, seen, outline=outline)
        plan = run_field(
            picture.path, lat=place.lat, lon=place.lon, settings=seen, previous=previous,
            boundary=boundary, window=window, fetch_wider=picture.wider,
        )  # fmt: skip
        farm = {} if previous is None else dict(previous.evidence.farm)
        farm.pop(_PICTURES, None)
        if imagery.digest:
            farm[_PICTURES] = imagery.digest
        plan = replace(plan, evidence=replace(plan.evidence, farm=farm))
        plan = run_obstacles(_around(plan, job), plan.scene or window, settings=seen)
        if previous is not None and _is_other(plan.source, imagery, previous):
            before = previous.source.name or "no picture"
            if before == plan.source.name:
                before = "what it showed before"
            warn(
                f"Planned on {plan.source.name}, no longer on {before}: {'; '.join(plan.changes)}.",
                FieldWarning,
            )
        return plan


def _is_other(source: ImagerySource, imagery: Imagery, reviewed: Plan) -> bool:
    """Whether a picture is another one than a plan was made on, whatever it is called."""
    noted = reviewed.evidence.farm.get(_PICTURES)
    shows_other = bool(noted and imagery.digest) and noted != imagery.digest
    return shows_other or not source.is_same_picture(reviewed.source)


def _shown_anew(reviewed: Plan, place: Place, settings: Settings, imagery: Imagery | None) -> bool:
    """Whether the pictures of now are others than a reviewed plan was made on, and show its field.

    Warns
    -----
    FieldWarning
        When they do not show it.
    """
    if imagery is None:
        return False
    if imagery.source is not None:
        return imagery.source.name != reviewed.source.name  # nothing is fetched to ask
    try:
        with listening():  # told where it is planned on
            scene = open_scene(imagery.path, place.lat, place.lon, settings, outline=reviewed.field)
    except (FieldError, ImageryError, PointOutsideError) as error:
        warn(f"It stays as reviewed: {error.message}", FieldWarning)
        return False
    return _is_other(scene.source, imagery, reviewed)


def _around(plan: Plan, job: Job) -> Plan:
    """A plan with the obstacles of the user's file."""
    return plan if job.standing is None else with_further(plan, job.standing)


def parcel_of(place: Place) -> Field:
    """The parcel of a place as a field, in its metric CRS.

    Raises
    ------
    TrackError
        When its outline is no area.
    """
    source = parse_crs(place.crs)
    metric = metric_crs(place.lon, place.lat, source)
    outline = shapely.force_2d(reproject(shapely.from_wkb(place.outline), source, metric))
    polygon, repaired = clean_outline(outline)
    for words in repaired:
        warn(words, FieldWarning)
    return Field(
        polygon, metric, name=place.name, field_id=place.field_id, method="boundary", own=place.own
    )


def told(place: Place, heard: Sequence[GeofieldWarning]) -> str:
    """What the stages had to tell of a place, each thing once."""
    return "; ".join(dict.fromkeys([*place.notes, *(str(each) for each in heard)]))


def in_words(error: BaseException) -> dict[str, Any]:
    """An error as `error` and `hint` of a status row."""
    message = getattr(error, "message", None)
    if message is None:
        message = f"{type(error).__name__}: {error}".strip(": ")
    return {"status": "failed", "error": str(message), "hint": getattr(error, "hint", None) or ""}
