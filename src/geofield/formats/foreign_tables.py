"""Foreign geometries as layers of the schema: names, numbers and radii from usual columns."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import shapely
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT, grid_north_deg, ground_lengths_m, transformer
from geofield.errors import FormatWarning, SeveralFieldsError
from geofield.model import Field
from geofield.model.obstacle_numbers import possible_numbers
from geofield.model.obstacles import (
    LINE_HALF_WIDTH_M,
    POINT_RADIUS_M,
    circle_polygons,
    numbered,
)
from geofield.model.own_values import as_numbers, told_beside
from geofield.model.resized import strips
from geofield.notes import warn
from geofield.wording import cell_text, counted, some_of

if TYPE_CHECKING:
    import geopandas as gpd

#: What others call the columns that say this, the likeliest first.
NAME_COLUMNS = (
    "name",
    "field",
    "fieldname",
    "field_name",
    "designator",
    "label",
    "title",
    "schlag",
)
ID_COLUMNS = ("field_id", "id", "fid", "guid", "uuid", "parcel_id", "ref")
RADIUS_COLUMNS = ("radius_m", "radius")
BUFFER_COLUMNS = ("buffer_m", "buffer")
NUMBER_COLUMNS = ("obstacle_no", "obst_no", "number", "no")
_TRACK = ("track_no", "track", "swath")
_SEGMENT = ("segment_no", "segment")
#: Line strings and rings, as shapely counts types.
_LINES = (1, 2)
#: Words for trees, and the trees that stand in fields most.
_TREE = re.compile(
    r"(?i)\b(?:trees?|\w*b(?:aum|äume|aeume)|arbres?|oaks?|\w*eichen?|ch[eê]nes?|\w*buchen?|birch|"
    r"birken?|pines?|kiefern?|fichten?|spruce|linden?|poplars?|pappeln?|walnut|olives?|oliviers?)\b"
)
#: Other things that people mark by a point and a name.
_NO_TREE = re.compile(
    r"(?i)\b(?:\w*(?:poles?|mast(?:en)?|pylons?|hydrant(?:en)?|pfosten|pfahl|brunnen|schacht|zaun|"
    r"teich|mauer|hütte|stein)|posts?|wells?|manholes?|ponds?|fences?|walls?|rocks?|stones?|tanks?|"
    r"huts?|poteaux?|puits|mares?|clôtures?|murs?|rochers?|fels(?:en)?)\b"
)
#: What columns are called that say how wide something is, but not as a radius in metres.
_SIZE = re.compile("(?i)width|breite|largeur|diam|durchmesser|crown|krone|radius(?!$|_?m$|_px$)")
#: How geofield names lines in formats without numbers.
_OUR_NAME = re.compile(r"Track (\d+)(?:-(\d+))?")
#: Larger numbers are none that anybody counts with, nor exact in all programs.
_LARGEST = 2**53


def column_like(frame: gpd.GeoDataFrame, names: tuple[str, ...]) -> Any:
    """The first column with one of the names, whatever its case; None without one."""
    by_name = {str(column).lower(): column for column in frame.columns}
    for name in names:
        if name in by_name and frame[by_name[name]].notna().any():
            return frame[by_name[name]]
    return None


def numbers_like(frame: gpd.GeoDataFrame, names: tuple[str, ...]) -> np.ndarray:
    """A column's numbers as floats, texts with a decimal comma, too; NaN where there are none."""
    series = column_like(frame, names)
    return np.full(len(frame), np.nan) if series is None else as_numbers(series)


def _sources(frame: gpd.GeoDataFrame, names: Mapping[str, tuple[str, ...]]) -> dict[str, str]:
    """The columns by whose names those of a layer were found, with these."""
    found = {into: column_like(frame, each) for into, each in names.items()}
    return {str(series.name): into for into, series in found.items() if series is not None}


def field_table(frame: gpd.GeoDataFrame, crs: CRS, path: Path) -> gpd.GeoDataFrame:
    """The one outline as layer `field`; several are refused: a dataset is one field."""
    names = column_like(frame, NAME_COLUMNS)
    if len(frame) > 1:
        shown = "" if names is None else f" ({some_of([*map(cell_text, names)], 5)})"
        raise SeveralFieldsError(
            f"{path.name} holds {len(frame)} outlines{shown}; a dataset is one field.",
            hint="Save the one you want as a file of its own. Obstacles are known by the field's "
            "boundary around them, or by their file's or layer's name, such as trees.",
        )
    polygon = shapely.orient_polygons(shapely.force_2d(frame.geometry.iloc[0]))
    ids = column_like(frame, ID_COLUMNS)
    data: dict[str, Any] = {
        column.name: [_value(frame, column)]
        for column in schema.FIELD.columns
        if column.name in frame.columns
    }
    field = Field(polygon, crs)
    data |= {
        "name": [path.stem if names is None else cell_text(names.iloc[0])],
        "field_id": [field.field_id if ids is None else cell_text(ids.iloc[0])],
        "area_ha": [field.area_ha],
        "perimeter_m": [field.perimeter_m],
    }
    if data.get("method", [None]) == [None]:
        data["method"] = ["boundary"]
    table = schema.table(schema.FIELD, data, [polygon], crs)
    rows = frame[schema.of_others(frame.columns)]
    told = _sources(frame, {"name": NAME_COLUMNS, "field_id": ID_COLUMNS})
    return table.assign(**told_beside(schema.FIELD, table, rows, told))


def _value(frame: gpd.GeoDataFrame, column: schema.Column) -> Any:
    """What the first row says in a column of the schema; None for what is not of its type."""
    if column.type == "float":
        return float(numbers_like(frame, (column.name,))[0])
    if frame[column.name].isna().iloc[0]:
        return None
    text = str(frame[column.name].iloc[0])
    if column.type == "date":
        return text[:10] if re.match(r"\d{4}-\d{2}-\d{2}", text) else None
    return text


def obstacle_table(frame: gpd.GeoDataFrame, crs: CRS, path: Path) -> gpd.GeoDataFrame:
    """Points, lines and polygons as layer `obstacles`.

    A point becomes the circle of its radius and safety margin, a line a strip of them. Rows
    without a status were put there by a person: they are `added`. Further columns stay.
    """
    geometry = np.asarray(shapely.force_2d(frame.geometry.to_numpy()), dtype=object)
    count = len(geometry)
    radius, margin = numbers_like(frame, RADIUS_COLUMNS), numbers_like(frame, BUFFER_COLUMNS)
    is_point = shapely.get_type_id(geometry) == shapely.GeometryType.POINT.value
    radius[~(np.isfinite(radius) & (radius > 0))] = np.nan
    _tell_sizes(frame, ~(radius > 0) & (shapely.get_dimensions(geometry) < 2), path)
    unsized = is_point & np.isnan(radius)
    if few := int(unsized.sum()):
        warn(
            f"{path.name}: {counted(few, 'obstacle point has', 'obstacle points have')} no radius; "
            f"{'it is a circle' if few == 1 else 'they are circles'} of "
            f"{POINT_RADIUS_M:g} m now. Correct them if the trees are larger.",
            FormatWarning,
        )
        radius[unsized] = POINT_RADIUS_M
    wrong = (margin < 0) | np.isinf(margin)
    if wrong.any():
        warn(
            f"{path.name}: "
            f"{counted(int(wrong.sum()), 'safety margin is', 'safety margins are')} negative or "
            f"infinite; {'it counts' if wrong.sum() == 1 else 'they count'} as 0 m. Correct them.",
            FormatWarning,
        )
    margin = np.where(wrong | np.isnan(margin), 0.0, margin)
    centre = shapely.centroid(geometry)
    x, y = shapely.get_x(centre), shapely.get_y(centre)
    if is_point.any():
        geometry[is_point] = circle_polygons(
            x[is_point], y[is_point], radius[is_point] + margin[is_point], crs
        )
    is_line = np.isin(shapely.get_type_id(geometry), _LINES)
    half_m = np.fmax(radius, LINE_HALF_WIDTH_M) + margin
    geometry[is_line] = strips(geometry[is_line], half_m[is_line], crs)
    radius[is_line] = np.nan  # a strip is no circle
    lon, lat = transformer(crs, LONLAT).transform(x, y)
    numbers = numbers_like(frame, NUMBER_COLUMNS)
    numbers[pd.Series(numbers).duplicated()] = np.nan
    known = numbered(possible_numbers(frame.assign(obstacle_no=numbers)))
    data: dict[str, Any] = {
        name: numbers_like(frame, (name,)) for name in ("confidence", "x_px", "y_px", "radius_px")
    }
    data |= {
        "obstacle_no": list(known["obstacle_no"]),
        "kind": _one_of(frame, path, "kind", schema.KINDS, _kinds(frame, is_point)),
        "status": _one_of(frame, path, "status", schema.STATUSES, np.full(count, "added")),
        "radius_m": radius,
        "buffer_m": margin,
        "lat": lat,
        "lon": lon,
    }
    table = schema.table(schema.OBSTACLES, data, shapely.orient_polygons(geometry), crs)
    told = _sources(
        frame,
        {"radius_m": RADIUS_COLUMNS, "buffer_m": BUFFER_COLUMNS, "obstacle_no": NUMBER_COLUMNS},
    )
    own = told_beside(schema.OBSTACLES, table, frame, told)
    return schema.conform(schema.OBSTACLES, table.assign(**own), extras=True)


def line_tables(
    frame: gpd.GeoDataFrame, crs: CRS, *, extras: bool = False
) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame]:
    """Lines as layers `tracks` and `segments`, with their further columns where `extras`.

    Lines with the same track number are segments of one track; without numbers each line is
    a track. What says the same of all segments of each track is told of the track, too. Where rows
    say of which of several fields they are, each field has its own tracks.
    """
    owners = column_like(frame, ("field_id",))
    if owners is not None and owners.notna().all() and owners.nunique() > 1:
        rows = frame.drop(columns=str(owners.name)).groupby(owners.to_numpy(), sort=False)
        parts = [(one, line_tables(own, crs, extras=extras)) for one, own in rows]
        tracks, segments = (
            pd.concat([part[at].assign(field_id=one) for one, part in parts], ignore_index=True)
            for at in (0, 1)
        )
        return tracks, segments
    geometry = shapely.force_2d(frame.geometry.to_numpy())
    geometry = np.array([shapely.LineString(line.coords) for line in geometry], dtype=object)
    track, segment = _line_numbers(frame)
    values = {
        "track_no": track,
        "segment_no": segment,
        "length_m": ground_lengths_m(geometry, crs),
    }
    table = schema.table(schema.SEGMENTS, values, geometry, crs)
    if extras:
        told = _sources(frame, {"track_no": _TRACK, "segment_no": _SEGMENT})
        names = column_like(frame, NAME_COLUMNS)
        if names is not None and all(_OUR_NAME.fullmatch(str(name)) for name in names):
            frame = frame.drop(columns=str(names.name))
        table = table.assign(**told_beside(schema.SEGMENTS, table, frame, told))
    segments = schema.conform(schema.SEGMENTS, table, extras=extras)
    each: list[Any] = [part for _, part in segments.groupby("track_no", sort=True)]
    wholes = [shapely.multilinestrings(list(part.geometry)) for part in each]
    data = {
        "track_no": [part["track_no"].iloc[0] for part in each],
        "heading_deg": [heading_deg(whole, crs) for whole in wholes],
        "segment_count": [len(part) for part in each],
        "gap_count": [len(part) - 1 for part in each],
        "length_m": [part["length_m"].sum() for part in each],
    }
    first, of_track = segments.drop_duplicates("track_no"), segments.groupby("track_no")
    same = {
        name: first[name].array
        for name in schema.own_columns(schema.SEGMENTS, segments)
        if str(name).lower() not in schema.TRACKS.column_names
        and (of_track[name].nunique(dropna=False) == 1).all()
    }
    return schema.table(schema.TRACKS, data, wholes, crs).assign(**same), segments


def heading_deg(track: shapely.Geometry, crs: CRS) -> float:
    """From a track's first to its last vertex: degrees clockwise from true north."""
    (x0, y0), *_, (x1, y1) = shapely.get_coordinates(track).tolist()
    grid = np.degrees(np.arctan2(x1 - x0, y1 - y0))
    return float((grid + grid_north_deg(crs, x0, y0)) % 360.0)


def _line_numbers(frame: gpd.GeoDataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Track and segment of each line: by columns, else by names, else 1, 2, ..."""
    track, segment = numbers_like(frame, _TRACK), numbers_like(frame, _SEGMENT)
    if not _countable(track).all():
        track, segment = _numbers_in_names(frame)
    pairs = np.column_stack([track, segment])
    if not _countable(segment).all() or len(np.unique(pairs, axis=0)) < len(pairs):
        segment = pd.Series(track).groupby(track).cumcount().to_numpy() + 1
    return track.astype(np.int64), np.asarray(segment).astype(np.int64)


def _numbers_in_names(frame: gpd.GeoDataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Tracks and segments of names such as ``Track 7-2``, as geofield writes them, in all rows.

    Other names give the tracks' numbers where each has its own, as in ``AB 7``.
    """
    names = column_like(frame, NAME_COLUMNS)
    texts = [""] * len(frame) if names is None else [str(name) for name in names]
    one_each = np.ones(len(frame))
    own = [_OUR_NAME.fullmatch(text) for text in texts]
    if all(own):
        found = [(float(match[1]), float(match[2] or 1)) for match in own if match]
        track, segment = np.array(found).T
        if _countable(track).all():
            return track, segment
    numbers = [re.search(r"\d+", text) for text in texts]
    if all(numbers):
        track = np.array([float(match[0]) for match in numbers if match])
        if _countable(track).all() and len(np.unique(track)) == len(track):
            return track, one_each
    return np.arange(1, len(frame) + 1, dtype=float), one_each


def _countable(values: np.ndarray) -> Any:
    """Which numbers are whole, and not too large to count with."""
    return (values == np.round(values)) & (values >= 0) & (values <= _LARGEST)


def _tell_sizes(frame: gpd.GeoDataFrame, unsized: np.ndarray, path: Path) -> None:
    """Tell of columns that say how wide points and lines are, in words that are not read."""
    there = frame[unsized].dropna(axis="columns", how="all").columns
    sizes = [str(name) for name in there if _SIZE.search(str(name))]
    if sizes:
        warn(
            f"{path.name}: {some_of(sizes, 5)} of obstacles may say how wide they are, and "
            "what is read is radius_m: metres, of a line from its middle.",
            FormatWarning,
        )


def _texts(series: pd.Series) -> list[str]:
    return ["" if pd.isna(value) else str(value).strip() for value in series]


def _kinds(frame: gpd.GeoDataFrame, is_point: np.ndarray) -> np.ndarray:
    """What each is by its own word, or else its name; points that say neither are trees."""
    kinds, names = (column_like(frame, each) for each in (("kind", "natural"), NAME_COLUMNS))
    said, called = ([""] * len(frame) if each is None else _texts(each) for each in (kinds, names))
    found = []
    for kind, name, point in zip(said, called, is_point, strict=True):
        tree = point and (_TREE.search(name) is not None or not _NO_TREE.search(name))
        if re.search(r"[^\W\d_]{2}", kind):
            tree = _TREE.search(kind) is not None
        found.append("tree" if tree else "other")
    return np.array(found, object)


def _one_of(
    frame: gpd.GeoDataFrame, path: Path, name: str, allowed: tuple[str, ...], default: np.ndarray
) -> list[str]:
    """A column's words where they are allowed, whatever their case; of others it is told."""
    series = column_like(frame, (name,))
    if series is None:
        return [str(value) for value in default]
    said = _texts(series)
    taken = [
        word.lower() if word.lower() in allowed else str(other)
        for word, other in zip(said, default, strict=True)
    ]
    unknown = {
        f"{word!r} (now {now})": None
        for word, now in zip(said, taken, strict=True)
        if word and word.lower() != now
    }
    if unknown:
        more = ", ..." if len(unknown) > 5 else ""
        warn(
            f"{path.name}: obstacles have a {name} that is none of {', '.join(allowed)}: "
            f"{', '.join(list(unknown)[:5])}{more}. Correct it in the layer obstacles of the plan.",
            FormatWarning,
        )
    return taken
