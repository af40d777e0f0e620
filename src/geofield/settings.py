"""Settings: one section per stage, from a TOML file, the environment and the command line.

Later sources win: defaults, ``geofield.toml``, ``GEOFIELD_TRACKS__SPACING_M=3`` and the like
in the environment, options of the command line. A section's field names are the keyword
arguments of its stage, so that each figure is described once, here.
"""

from __future__ import annotations

import difflib
import math
import os
import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PositiveFloat,
    SecretStr,
    ValidationError,
)

from geofield.errors import SettingsError

NonNegative = Annotated[float, Field(ge=0)]

#: The formats that can be written; held against the registry of formats by a test.
FormatName = Literal[
    "gpkg",
    "geojson",
    "shapefile",
    "geoparquet",
    "flatgeobuf",
    "kml",
    "gpx",
    "csv",
    "fiboa",
    "dxf",
    "isoxml",
    "isoxml-v3",
    "agopengps",
    "rdf",
    "turtle",
    "jsonld",
    "ntriples",
    "rdf-study",
    "study-xml",
    "scene",
    "map",
    "report",
    "html",
]
DirectionName = Literal["dominant", "longest_edge", "hough", "fewest", "fewest_turns"]


def _direction(value: str) -> str:
    """A way to find the direction, or a heading in degrees."""
    names = get_args(DirectionName)
    try:
        heading = float(value)
    except ValueError:
        if value in names:
            return value
        raise ValueError(f"input should be a heading in degrees or {_listed(names)}") from None
    if not math.isfinite(heading):
        raise ValueError("input should be a finite heading")
    return value


def _lonlat(value: Any) -> Any:
    """Longitude and latitude of a text ``LON,LAT``; what is a pair already stays."""
    if isinstance(value, str):
        value = value.split(",")
    if len(value) != 2:
        raise ValueError("write a position as LON,LAT, for instance 33.531142,35.075373")
    lon, lat = (float(part) for part in value)
    if not (abs(lon) <= 180 and abs(lat) <= 90):
        raise ValueError(f"{lon:g},{lat:g} is no longitude and latitude")
    return lon, lat


LonLat = Annotated[tuple[float, float], BeforeValidator(_lonlat)]
"""Longitude and latitude, degrees."""


class Section(BaseModel):
    """Base of the sections: unknown names are refused, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class SourceSettings(Section):
    """An imagery source of the user's own."""

    url: str = Field(description="Tile address with {z} {x} {y}, WMS or WMTS address, or path.")
    kind: Literal["xyz", "wmts", "wms", "mbtiles", "picture"] = Field(
        "xyz", description="What the address is."
    )
    attribution: str = Field("", description="To be named with every product.")
    licence: str = Field("", description="Of the imagery.")
    terms_url: str = Field("", description="Where the terms can be read.")
    may_cache: bool = Field(False, description="Whether the terms allow keeping tiles.")
    may_derive: bool = Field(False, description="Whether the terms allow deriving geodata.")
    min_zoom: int = Field(0, ge=0, le=30, description="Coarsest zoom.")
    max_zoom: int = Field(22, ge=0, le=30, description="Finest zoom.")
    tile_px: int | None = Field(None, ge=64, le=4096, description="Side of a tile, pixels.")
    subdomains: tuple[str, ...] = Field(("a", "b", "c"), description="What {s} stands for.")
    layer: str = Field("", description="Layer of a WMS or WMTS.")
    key: SecretStr | None = Field(None, description="Key; better kept in the environment.")
    key_parameter: str = Field("", description="Query name of the key (WMS, WMTS).")
    rate_per_s: PositiveFloat | None = Field(None, description="Requests per second at most.")
    date: str | None = Field(None, description="When the imagery was taken.")
    headers: dict[str, SecretStr] = Field({}, description="Sent with each request.")


class ImagerySettings(Section):
    """Stage 1: the picture."""

    size_m: PositiveFloat | None = Field(
        None,
        description="Side of the window read around the point, metres; all of a small picture.",
    )
    bands: tuple[str, ...] | None = Field(
        None,
        description="What the picture's bands show, in order: red, green, blue, nir, grey, other.",
    )
    crs: str | None = Field(
        None, description="CRS of a picture that does not say its own, e.g. EPSG:32633."
    )


class FetchSettings(Section):
    """Getting imagery from servers; it does not change the result, so products do not keep it."""

    threads: int = Field(16, ge=1, le=64, description="Tiles fetched at once.")
    cache_dir: str | None = Field(
        None,
        description="Folder of the tile caches; the user's cache folder by default.",
    )
    cache_max_mb: PositiveFloat = Field(
        2048.0,
        description="Tiles kept per source at most, megabytes.",
    )
    cache_max_days: PositiveFloat = Field(90.0, description="Tiles are fetched anew after, days.")
    allow: tuple[str, ...] = Field(
        (),
        description="Folder or address that a VRT, tile index, STAC file, capabilities document "
        "or redirect may lead to; repeat for several.",
    )
    keys: dict[str, SecretStr] = Field(
        {}, description="Keys by source name; GEOFIELD_KEY_NAME in the environment wins."
    )
    sources: dict[str, SourceSettings] = Field(
        {},
        description="Sources of your own, by name: [fetch.sources.NAME] in the settings file.",
    )


class FieldSettings(Section):
    """Stage 2: the outline."""

    method: Literal["auto", "study"] = Field(
        "auto",
        description="How the outline is found: auto (colour, near infrared, edges) or study "
        "(brightness threshold).",
    )
    holes: Literal["fill", "keep"] | None = Field(
        None,
        description="What becomes of crowns, huts and ponds inside: fill (the way of auto) or "
        "keep as holes (the way of study).",
    )
    min_hole_m2: NonNegative = Field(
        20.0,
        description="Holes below this size are filled, square metres.",
        json_schema_extra={"option": "--min-hole"},
    )
    tolerance_px: NonNegative = Field(
        3.0,
        description="How far the straightened outline may leave the pixels; 0 keeps them all.",
    )
    smooth: Literal["none", "diffusion"] = Field(
        "none", description="Smoothing of the picture first; diffusion is anisotropic."
    )
    include: tuple[LonLat, ...] = Field(
        (),
        description="Further ground that belongs to the field, LON,LAT; repeat for several.",
        json_schema_extra={"option": "--include-lonlat"},
    )
    exclude: tuple[LonLat, ...] = Field(
        (),
        description="Ground that does not belong to the field, LON,LAT; repeat for several.",
        json_schema_extra={"option": "--exclude-lonlat"},
    )


class ObstacleSettings(Section):
    """Stage 3: the obstacles."""

    strategy: Literal[
        "auto",
        "single",
        "t_range",
        "max_of_all",
        "dlc",
        "consensus",
        "study_text",
        "study_listing",
        "study_dlc",
    ] = Field("auto", description="How obstacles are found: auto, or a way of the study.")
    radius_m: tuple[PositiveFloat, PositiveFloat] | None = Field(
        None,
        description="Smallest and largest crown radius, metres; 1 to 15 with auto, 2 to 9 with "
        "the study's strategies by default.",
    )
    buffer_m: NonNegative = Field(1.5, description="Safety margin around each obstacle, metres.")
    cost_missed: PositiveFloat = Field(
        30.0,
        description="auto: what driving into a thing costs, against a look at one place of the "
        "map; it decides what is detected, and what only possible.",
    )
    careful: bool = Field(False, description="auto: drive around what is only possible, too.")
    min_confidence: Annotated[float, Field(ge=0, le=1)] | None = Field(
        None,
        description="auto: confidence from which a thing is driven around, instead of the cost.",
    )
    polarity: Literal["dark", "bright", "both"] = Field(
        "both", description="auto: crowns darker or brighter than what is around them."
    )
    others: bool = Field(
        True, description="auto: find what is not round, too: ponds, huts, clumps."
    )
    edge_method: Literal["sobel", "prewitt", "roberts", "canny"] | None = Field(
        None, description="The study's strategies: edge method."
    )
    threshold: NonNegative | None = Field(None, description="single: edge threshold.")
    circle_method: Literal["phase_code", "two_stage"] = Field(
        "phase_code", description="The study's strategies: circle transform."
    )
    sensitivity: Annotated[float, Field(ge=0, le=1)] = Field(
        0.85, description="The study's strategies: of the circle transform."
    )
    grey_check: Literal["none", "absolute", "relative"] = Field(
        "none",
        description="Drop discs brighter than 127.37 (absolute) or than the field (relative).",
    )


class TrackSettings(Section):
    """Stage 4: the tracks."""

    spacing_m: PositiveFloat = Field(2.0, description="Distance between tracks, metres.")
    step_m: PositiveFloat = Field(1.0, description="Distance between track points, metres.")
    direction: Annotated[str, AfterValidator(_direction)] = Field(
        "dominant",
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
    offset_m: float | None = Field(
        None, description="Of the first track from its edge, metres; half the spacing by default."
    )
    last_strip: Literal["overrun", "leave", "shift", "spread"] = Field(
        "overrun",
        description="The rest at the far side: overrun the border, leave it, shift the last track "
        "back, or spread all tracks evenly.",
    )
    headland_m: NonNegative = Field(
        0.0, description="Width of the headland along the border, metres."
    )
    headland_holes: bool = Field(False, description="A headland around the field's holes too.")
    min_segment_m: NonNegative = Field(0.0, description="Shorter segments are not driven, metres.")
    clearance_m: NonNegative = Field(
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


class ExportSettings(Section):
    """What is written."""

    formats: tuple[FormatName, ...] = Field(
        ("gpkg", "geojson", "shapefile", "rdf"), description="Formats of the products."
    )
    points: bool = Field(False, description="Track points in linked data, too: most of its bytes.")


class Settings(Section):
    """All settings of a run. A plain value: :func:`load_settings` reads file and environment.

    Examples
    --------
    >>> Settings(tracks={"spacing_m": 3}).tracks.spacing_m
    3.0
    """

    imagery: ImagerySettings = ImagerySettings()
    field: FieldSettings = FieldSettings()
    obstacles: ObstacleSettings = ObstacleSettings()
    tracks: TrackSettings = TrackSettings()
    export: ExportSettings = ExportSettings()
    # Keys live here: never written into a product.
    fetch: FetchSettings = Field(FetchSettings(), exclude=True, repr=False)


SECTIONS = ("imagery", "field", "obstacles", "tracks", "export", "fetch")
Stage = Literal["imagery", "field", "obstacles", "tracks", "export", "fetch"]


def load_settings(
    path: str | Path | None = None, overrides: Mapping[str, Mapping[str, Any]] | None = None
) -> Settings:
    """Settings from a TOML file, the environment and explicit values, the last one winning.

    Parameters
    ----------
    path : path, optional
        A TOML file with a table per section. ``geofield.toml`` in the working folder is read
        when it exists and no path is given.
    overrides : mapping of section to mapping, optional
        Values that win over everything else; None values are passed over.

    Raises
    ------
    SettingsError
        Naming the setting, its value and what would be right.
    """
    merged: dict[str, dict[str, Any]] = {section: {} for section in SECTIONS}
    try:
        for source in (_read_toml(path), _from_environment(), overrides or {}):
            for section, settings in source.items():
                if section not in SECTIONS:
                    raise SettingsError(
                        f"Unknown section [{section}] in the settings."
                        + _nearest(section, SECTIONS),
                        hint=f"Sections: {', '.join(SECTIONS)}.",
                    )
                if not isinstance(settings, Mapping):
                    raise SettingsError(
                        f"{section} is a section of the settings, not a value.",
                        hint=f"Write [{section}] and its settings below.",
                    )
                merged[section] |= {k: v for k, v in settings.items() if v is not None}
        return Settings(**merged)
    except ValidationError as error:
        raise SettingsError(_explain(error)) from None


def with_values(settings: Settings | None, **values: Any) -> Settings:
    """Settings with some of them changed, each by its own name.

    Parameters
    ----------
    settings : Settings or None
        The defaults when None.
    **values
        Such as ``spacing_m=6, route="shortest"``.

    Raises
    ------
    SettingsError
        Naming the setting, its value and the nearest name.
    """
    settings = settings or Settings()
    changed: dict[str, dict[str, Any]] = {}
    home = {name: section for section in SECTIONS for name in _names_of(section)}
    for name, value in values.items():
        if name not in home:
            raise SettingsError(f"There is no setting {name!r}.{_nearest(name, home)}")
        changed.setdefault(home[name], {})[name] = value
    try:
        sections = {
            section: type(getattr(settings, section))(
                **{**dict(getattr(settings, section)), **given}
            )
            for section, given in changed.items()
        }
    except ValidationError as error:
        raise SettingsError(_explain(error)) from None
    return settings.model_copy(update=sections)


def _names_of(section: str) -> tuple[str, ...]:
    model: type[Section] = Settings.model_fields[section].annotation  # type: ignore[assignment]
    return tuple(model.model_fields)


def from_mapping(values: Mapping[str, Any]) -> Settings:
    """Settings as a product recorded them; names that are gone since are passed over."""
    known: dict[str, Any] = {}
    for section in SECTIONS[:-1]:  # what may be reached, a product does not say
        recorded = values.get(section, {})
        if not isinstance(recorded, Mapping):
            raise SettingsError(f"The recorded settings are damaged: {section} is no section.")
        fields = _names_of(section)
        known[section] = {name: recorded[name] for name in recorded if name in fields}
    try:
        return Settings(**known)
    except ValidationError as error:
        raise SettingsError(_explain(error)) from None


def _from_environment() -> dict[str, Any]:
    """What variables such as ``GEOFIELD_TRACKS__SPACING_M`` say, by section."""
    if not any(name.upper().startswith("GEOFIELD_") for name in os.environ):
        return {}
    from pydantic_settings import BaseSettings, EnvSettingsSource, SettingsConfigDict

    class Environment(BaseSettings):
        """Names the variables; only its parsing is used."""

        model_config = SettingsConfigDict(env_prefix="GEOFIELD_", env_nested_delimiter="__")

        imagery: ImagerySettings = ImagerySettings()
        field: FieldSettings = FieldSettings()
        obstacles: ObstacleSettings = ObstacleSettings()
        tracks: TrackSettings = TrackSettings()
        export: ExportSettings = ExportSettings()
        fetch: FetchSettings = FetchSettings()

    return EnvSettingsSource(Environment)()


def _read_toml(path: str | Path | None) -> dict[str, Any]:
    file = Path(path) if path is not None else Path("geofield.toml")
    if path is None and not file.is_file():
        return {}
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise SettingsError(f"The settings file {file} cannot be read: {error.strerror}.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise SettingsError(f"The settings file {file} is not valid TOML: {error}.") from None


def _explain(error: ValidationError) -> str:
    lines = []
    for problem in error.errors():
        name = ".".join(str(part) for part in problem["loc"])
        # Sources hold keys; a message must not.
        secret = {"sources", "keys"} & set(problem["loc"])
        given = [] if secret else [f"given: {problem.get('input')!r}"]
        message = problem["msg"].removeprefix("Value error, ")
        near = ""
        if problem["type"] == "extra_forbidden":
            message = "there is no such setting"
            section = str(problem["loc"][0])
            within = _names_of(section) if section in SECTIONS and len(problem["loc"]) == 2 else ()
            near = _nearest(str(problem["loc"][-1]), within)
        elif problem["type"] in ("literal_error", "value_error"):
            choices = re.findall(r"'([^']+)'", message) or get_args(DirectionName)
            near = _nearest(str(problem.get("input")), choices)
        words = "; ".join([*given, *([near.strip()] if near else [])])
        lines.append(
            f"{name}: {message[:1].lower()}{message[1:]}" + (f" ({words})" if words else "")
        )
    return "Settings are not valid: " + "; ".join(lines) + "."


def _nearest(given: str, names: Iterable[str]) -> str:
    """A sentence with the nearest of some names, or nothing."""
    close = difflib.get_close_matches(given.lower(), list(names), n=1, cutoff=0.5)
    return f" Did you mean {close[0]!r}?" if close else ""


def _listed(names: Iterable[str]) -> str:
    return ", ".join(repr(name) for name in names)
