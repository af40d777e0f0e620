"""Layers, columns, types and units: the one place that every reader and writer looks at.

A :class:`Layer` is a table of geometries with named columns. Writers take names, order,
types, units and the short Shapefile names from here; :func:`conform` brings any table
into that shape.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from geofield.errors import FormatError

if TYPE_CHECKING:
    import geopandas as gpd
    from pyproj import CRS

ColumnType = Literal["int", "float", "str", "date"]
GeometryType = Literal["Point", "LineString", "MultiLineString", "Polygon", "MultiPolygon"]

#: What a person or the detector says of an obstacle. `possible`: too uncertain to be driven
#: around, shown so that a person may decide.
STATUSES = ("detected", "possible", "confirmed", "rejected", "added")
#: The statuses that are a person's word and survive every re-run.
REVIEWED = ("confirmed", "rejected", "added")
#: The statuses of what tracks run through.
NOT_AVOIDED = ("rejected", "possible")
KINDS = ("tree", "other")


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a layer.

    Attributes
    ----------
    name : str
        Lower snake case, with the unit where there is one.
    type : {"int", "float", "str", "date"}
        Whole numbers and text may be missing; missing floats are NaN.
    title : str
        What a person reads as the column's heading.
    shapefile : str
        Its name in a Shapefile: at most ten characters, unique in its layer.
    unit : str
        UCUM code (``m``, ``har``, ``deg``), empty where there is none.
    values : tuple of str
        The only values allowed, where there is such a list.
    """

    name: str
    type: ColumnType
    title: str
    shapefile: str
    unit: str = ""
    values: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Layer:
    """A table of one geometry type.

    Attributes
    ----------
    name : str
        As in the GeoPackage.
    geometry : str
        The one geometry type of all rows.
    title, description : str
        For people.
    key : tuple of str
        The columns that together name a row; rows are sorted by them.
    columns : tuple of Column
    optional : bool
        Written only when the plan has it.
    working : bool
        For a person to decide by: only in the plan's own GeoPackage and its QGIS project.
    """

    name: str
    geometry: GeometryType
    title: str
    description: str
    key: tuple[str, ...]
    columns: tuple[Column, ...]
    optional: bool = False
    working: bool = False

    @property
    def column_names(self) -> list[str]:
        """Names in order, without the geometry."""
        return [column.name for column in self.columns]

    def column(self, name: str) -> Column:
        """The column of a name."""
        for column in self.columns:
            if column.name == name:
                return column
        raise FormatError(f"Layer {self.name!r} has no column {name!r}.")


_PIXEL = (
    Column("x_px", "float", "Pixel x", "x_px", "px"),
    Column("y_px", "float", "Pixel y", "y_px", "px"),
)
_LATLON = (
    Column("lat", "float", "Latitude", "lat", "deg"),
    Column("lon", "float", "Longitude", "lon", "deg"),
)
_TRACK_NO = Column("track_no", "int", "Track", "track_no")
_SEGMENT_NO = Column("segment_no", "int", "Segment", "segment_no")
_HEADING = Column("heading_deg", "float", "Heading", "heading", "deg")
_LENGTH = Column("length_m", "float", "Length", "length_m", "m")

FIELD = Layer(
    "field",
    "Polygon",
    "Field",
    "The outline of the target field.",
    ("field_id",),
    (
        Column("field_id", "str", "Field id", "field_id"),
        Column("name", "str", "Name", "name"),
        Column("area_ha", "float", "Area", "area_ha", "har"),
        Column("perimeter_m", "float", "Perimeter", "perim_m", "m"),
        Column("longest_edge_m", "float", "Longest edge", "edge_m", "m"),
        _HEADING,
        Column("method", "str", "Method", "method"),
        Column("imagery", "str", "Imagery", "imagery"),
        Column("imagery_date", "date", "Imagery date", "img_date"),
        Column("licence", "str", "Licence", "licence"),
        # Of the outline: the probability that it is right; what speaks against it, in words.
        Column("certainty", "float", "Certainty", "certainty", "1"),
        Column("doubts", "str", "Doubts", "doubts"),
    ),
)

ALTERNATIVES = Layer(
    "alternatives",
    "Polygon",
    "Alternatives",
    "The most likely different outlines; number 1 is the one that was taken.",
    ("alternative_no",),
    (
        Column("alternative_no", "int", "Alternative", "altern_no"),
        Column("area_ha", "float", "Area", "area_ha", "har"),
        Column("certainty", "float", "Certainty", "certainty", "1"),
    ),
    optional=True,
    working=True,
)

OBSTACLES = Layer(
    "obstacles",
    "Polygon",
    "Obstacles",
    "What no vehicle may enter: each footprint grown by its safety margin.",
    ("obstacle_no",),
    (
        Column("obstacle_no", "int", "Obstacle", "obst_no"),
        Column("kind", "str", "Kind", "kind", values=KINDS),
        Column("status", "str", "Status", "status", values=STATUSES),
        Column("radius_m", "float", "Radius", "radius_m", "m"),
        Column("buffer_m", "float", "Safety margin", "buffer_m", "m"),
        Column("confidence", "float", "Confidence", "confid", "1"),
        *_PIXEL,
        Column("radius_px", "float", "Radius in pixels", "radius_px", "px"),
        *_LATLON,
    ),
)

TRACKS = Layer(
    "tracks",
    "MultiLineString",
    "Tracks",
    "Straight driving lines, numbered from the edge they start at.",
    ("track_no",),
    (
        _TRACK_NO,
        _HEADING,
        Column("segment_count", "int", "Segments", "segments"),
        Column("gap_count", "int", "Gaps", "gaps"),
        Column("point_count", "int", "Points", "points"),
        _LENGTH,
    ),
)

SEGMENTS = Layer(
    "segments",
    "LineString",
    "Segments",
    "The drivable pieces of each track.",
    ("track_no", "segment_no"),
    (_TRACK_NO, _SEGMENT_NO, _LENGTH),
)

GAPS = Layer(
    "gaps",
    "LineString",
    "Gaps",
    "What lies between two segments of a track, and why.",
    ("track_no", "gap_no"),
    (
        _TRACK_NO,
        Column("gap_no", "int", "Gap", "gap_no"),
        _LENGTH,
        # All causes in words ("border", "obstacle 3", "obstacles 3, 7"); obstacle_no is the
        # lowest of the numbers, so that a join works, and missing for the border alone.
        Column("cause", "str", "Cause", "cause"),
        Column("obstacle_no", "int", "Obstacle", "obst_no"),
    ),
)

TRACK_POINTS = Layer(
    "track_points",
    "Point",
    "Track points",
    "Points sampled along each segment, both ends included.",
    ("point_no",),
    (
        Column("point_no", "int", "Point", "point_no"),
        _TRACK_NO,
        _SEGMENT_NO,
        *_PIXEL,
        *_LATLON,
    ),
)

HEADLAND = Layer(
    "headland",
    "MultiPolygon",
    "Headland",
    "The strip along the border that is kept free for turning, and worked last.",
    ("headland_no",),
    (
        Column("headland_no", "int", "Headland", "headl_no"),
        Column("width_m", "float", "Width", "width_m", "m"),
        Column("area_ha", "float", "Area", "area_ha", "har"),
    ),
    optional=True,
)

HEADLAND_TRACKS = Layer(
    "headland_tracks",
    "LineString",
    "Headland tracks",
    "Tracks around the field, parallel to its border, numbered from the border inwards.",
    ("pass_no", "segment_no"),
    (
        Column("pass_no", "int", "Pass", "pass_no"),
        _SEGMENT_NO,
        Column("offset_m", "float", "Distance from the border", "offset_m", "m"),
        _LENGTH,
    ),
    optional=True,
)

ROUTE = Layer(
    "route",
    "LineString",
    "Route",
    "The whole drive in order: work on segments, and the ways between them.",
    ("sequence",),
    (
        Column("sequence", "int", "Sequence", "sequence"),
        Column("kind", "str", "Kind", "kind", values=("work", "turn", "drive")),
        # Of work: with or against the segment's own direction.
        Column("direction", "str", "Direction", "direction", values=("forward", "backward")),
        Column("track_no", "int", "Track", "track_no"),
        Column("segment_no", "int", "Segment", "segment_no"),
        _LENGTH,
        Column("start_m", "float", "Driven before", "start_m", "m"),
    ),
    optional=True,
)

TURNS = Layer(
    "turns",
    "LineString",
    "Turns",
    "The ways from one segment to the next, and whether the machine can drive them.",
    ("turn_no",),
    (
        Column("turn_no", "int", "Turn", "turn_no"),
        Column("sequence", "int", "Sequence", "sequence"),
        Column("from_track", "int", "From track", "from_track"),
        Column("to_track", "int", "To track", "to_track"),
        # drive: a way around what is between, with corners that no radius is kept in.
        Column("kind", "str", "Kind", "kind", values=("dubins", "reeds_shepp", "drive")),
        Column("direction", "str", "Direction", "direction", values=("left", "right", "straight")),
        Column("radius_m", "float", "Turning radius", "radius_m", "m"),
        _LENGTH,
        Column("reverse_m", "float", "Driven backwards", "reverse_m", "m"),
        Column("skipped_m", "float", "Track left out", "skipped_m", "m"),
        Column("outside_m", "float", "Outside the allowed area", "outside_m", "m"),
        Column("fits", "str", "Fits", "fits", values=("yes", "no")),
    ),
    optional=True,
)

LAYERS: tuple[Layer, ...] = (
    FIELD,
    OBSTACLES,
    TRACKS,
    SEGMENTS,
    GAPS,
    TRACK_POINTS,
    HEADLAND,
    HEADLAND_TRACKS,
    ROUTE,
    TURNS,
    ALTERNATIVES,
)


def layer(name: str) -> Layer:
    """The layer of a name.

    Raises
    ------
    FormatError
        When there is none.
    """
    for candidate in LAYERS:
        if candidate.name == name:
            return candidate
    raise FormatError(
        f"There is no layer {name!r}.",
        hint=f"Layers: {', '.join(each.name for each in LAYERS)}.",
    )


def empty(of: Layer, crs: CRS) -> gpd.GeoDataFrame:
    """A table of a layer with all its columns and no rows."""
    return table(of, {column.name: [] for column in of.columns}, [], crs)


def table(
    of: Layer, data: dict[str, Any], geometry: Any, crs: CRS, own: Mapping[str, Any] | None = None
) -> gpd.GeoDataFrame:
    """A table of a layer from columns and geometries, with exact types and order.

    Columns that are missing in `data` are filled with missing values; `own` are the user's.
    """
    import geopandas as gpd
    import numpy as np
    import pandas as pd
    from geopandas.array import from_shapely

    count = len(geometry)
    # Plain arrays: a table made of series costs five times as much.
    columns: dict[str, Any] = {}
    for column in of.columns:
        values = data.get(column.name)
        if values is None:
            values = [np.nan if column.type == "float" else None] * count
        if column.type == "float":
            columns[column.name] = np.array(values, dtype="float64")
        elif column.type != "int":
            columns[column.name] = np.empty(count, dtype=object)
            columns[column.name][:] = list(values)
        elif isinstance(values, np.ndarray) and values.dtype.kind == "i":
            whole = values.astype("int64")
            columns[column.name] = pd.arrays.IntegerArray(whole, np.zeros(count, dtype=bool))
        else:
            columns[column.name] = pd.array(list(values), dtype="Int64")
    columns["geometry"] = from_shapely(geometry, crs=crs)
    # By way of a plain table: geopandas takes twice as long to make one of columns.
    return gpd.GeoDataFrame(
        pd.DataFrame(columns | dict(own or {}), copy=False), geometry="geometry"
    )


def own_columns(of: Layer, frame: gpd.GeoDataFrame) -> list[str]:
    """The columns that the user added to a layer."""
    known = {*of.column_names, frame.geometry.name, "geometry", "fid"}
    return [name for name in frame.columns if name not in known]


def conform(of: Layer, frame: gpd.GeoDataFrame, *, extras: bool = False) -> gpd.GeoDataFrame:
    """Any table in the shape of a layer: its columns, order and types, sorted by its key.

    Rows without a key come last. Further columns are left out, or kept behind the layer's
    own where `extras` is true.
    """
    import numpy as np
    import pandas as pd

    data: dict[str, Any] = {}
    for column in of.columns:
        if column.name not in frame.columns:
            continue
        series = frame[column.name]
        if column.type in ("int", "float"):
            try:
                series = pd.to_numeric(series)
            except (ValueError, TypeError) as error:
                raise FormatError(
                    f"Layer {of.name!r}: column {column.name!r} holds something that is no "
                    f"number ({error}).",
                    hint="Correct the column, or leave the cell empty.",
                ) from error
        if column.type == "int":
            whole = series
            if whole.dtype.kind == "i" and not whole.isna().any():
                data[column.name] = whole.to_numpy(dtype="int64")
            else:
                rounded = whole.round().astype("Int64").to_list()
                data[column.name] = [None if pd.isna(v) else int(v) for v in rounded]
        elif column.type == "float":
            data[column.name] = series.to_numpy(dtype="float64", na_value=np.nan)
        elif column.type == "date":
            data[column.name] = [None if pd.isna(v) else str(v)[:10] for v in series]
        else:
            data[column.name] = [None if pd.isna(v) else str(v) for v in series]
    result = table(of, data, frame.geometry.to_numpy(), frame.crs)
    for name in own_columns(of, frame) if extras else ():
        result[name] = frame[name].array
    result = result.sort_values(list(of.key), kind="stable", na_position="last")
    return result.reset_index(drop=True)
