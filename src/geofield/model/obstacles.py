"""Obstacles: a table of what no vehicle may enter, one row each.

The geometry of a row is the *buffer*: the footprint (a circle of `radius_m`, or a polygon)
grown by `buffer_m`. Columns are those of `geofield.schema.OBSTACLES`, in the metric CRS.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT, ground_scale, ground_scale_of, transformer
from geofield.errors import ObstacleError
from geofield.grid import Grid

if TYPE_CHECKING:
    import geopandas as gpd

FloatArray = NDArray[np.float64]

#: Straight pieces per quarter circle in the polygon that stands for a circle.
QUARTER_SEGMENTS = 16
#: Sides of what is grown lie so far within its true corners at most.
_CUT_OFF_M = 1e-3
#: Radius of an obstacle point that has none, metres: the smallest tree of METHOD.md, section 3.
POINT_RADIUS_M = 2.0
#: A fence or wire drawn as a line becomes a strip of this half width, metres.
LINE_HALF_WIDTH_M = 0.05
#: Numbers from here on were typed; a file holds some of them.
_TYPED = 1e9
#: Positions in a picture that differ by less are the same, pixels.
_SAME_PX = 0.01
#: A polygon with a vertex farther than this from its row's circle was redrawn by a person:
#: metres (formats round to about a centimetre) and share of the radius (other UTM zones).
_CIRCLE_TOLERANCE = (0.02, 0.002)


@dataclass(frozen=True, slots=True)
class ObstacleShapes:
    """What tracks are clipped against: true circles and polygons.

    Attributes
    ----------
    circles : float array (n, 3)
        Centre x, centre y, radius, all in units of the metric CRS, as polygons are.
    circle_no : int array (n,)
        The obstacle numbers of the circles.
    polygons : object array (m,)
        Shapely polygons.
    polygon_no : int array (m,)
    """

    circles: FloatArray
    circle_no: NDArray[np.int64]
    polygons: NDArray[np.object_]
    polygon_no: NDArray[np.int64]


def circle_polygons(
    x: ArrayLike, y: ArrayLike, radius_m: ArrayLike, crs: CRS
) -> NDArray[np.object_]:
    """Polygons that stand for circles, 64 vertices each, all on the circle.

    Centres are in the metric CRS, radii metres on the ground.
    """
    return plain_circles(x, y, np.asarray(radius_m, float) * ground_scale(crs, x, y))


def plain_circles(x: ArrayLike, y: ArrayLike, radius: ArrayLike) -> NDArray[np.object_]:
    """The same of circles whose radii are in units of their CRS, too."""
    points = shapely.points(np.asarray(x, float), np.asarray(y, float))
    circles = shapely.buffer(points, np.asarray(radius, float), quad_segs=QUARTER_SEGMENTS)
    # Counter-clockwise, as files hold them: a plan read back is then the same.
    return np.atleast_1d(shapely.orient_polygons(circles))


def polygons_around(circles: FloatArray, quarter: int) -> NDArray[np.object_]:
    """Polygons that hold circles (n, 3: centre, radius), of so many sides to a quarter."""
    # Their corners lie so far out that their sides keep clear of the circles.
    radius = circles[:, 2] / np.cos(np.pi / (4 * quarter))
    places = shapely.points(circles[:, :2])
    return np.asarray(shapely.buffer(places, radius, quad_segs=quarter), dtype=object)


def grown_by(shapes: NDArray[np.object_], reach: ArrayLike) -> NDArray[np.object_]:
    """Shapes grown by so many units of their CRS, round where they have corners.

    Sides cut off at most a millimetre there, and never more than those of a circle of 64.
    """
    widest = max(float(np.max(np.abs(reach), initial=0.0)), _CUT_OFF_M)
    quarter = math.ceil(math.pi / 4 / math.acos(1.0 - _CUT_OFF_M / widest))
    quarter = max(quarter, QUARTER_SEGMENTS)
    wide = np.asarray(reach, float)
    result: NDArray[np.object_] = shapely.buffer(shapes, wide, quad_segs=quarter)
    return result


def from_circles_px(
    x_px: ArrayLike,
    y_px: ArrayLike,
    radius_px: ArrayLike,
    grid: Grid,
    *,
    buffer_m: float,
    confidence: ArrayLike | None = None,
    crs: CRS | None = None,
) -> gpd.GeoDataFrame:
    """Detected circles in a picture as obstacles of kind `tree`, numbered from 1.

    Pixels count from the corner of the top-left pixel; `buffer_m` is the safety margin,
    `confidence` 0 to 1. The metric CRS is the grid's own when none is given.
    """
    x_px, y_px, radius_px = (np.asarray(each, float) for each in (x_px, y_px, radius_px))
    target = grid.metric_crs if crs is None else crs
    x, y = grid.to_crs(x_px, y_px, target)
    lon, lat = grid.to_lonlat(x_px, y_px)
    radius_m = radius_px * grid.resolution_at(x_px, y_px)
    count = len(x_px)
    return schema.table(
        schema.OBSTACLES,
        {
            "obstacle_no": np.arange(1, count + 1),
            "kind": ["tree"] * count,
            "status": ["detected"] * count,
            "radius_m": radius_m,
            "buffer_m": np.full(count, float(buffer_m)),
            "confidence": confidence,
            "x_px": x_px,
            "y_px": y_px,
            "radius_px": radius_px,
            "lat": lat,
            "lon": lon,
        },
        circle_polygons(x, y, radius_m + buffer_m, target) if count else [],
        target,
    )


def from_polygons(
    footprints: ArrayLike,
    crs: CRS,
    *,
    buffer_m: float,
    grid: Grid | None = None,
    confidence: ArrayLike | None = None,
    status: str = "detected",
    first_no: int = 1,
) -> gpd.GeoDataFrame:
    """Footprints that are not round as obstacles of kind `other`.

    `radius_m` is missing; the position columns hold the footprint's centroid.
    """
    shapes = np.asarray(footprints, dtype=object)
    count = len(shapes)
    if not count:
        return schema.empty(schema.OBSTACLES, crs)
    centre = shapely.centroid(shapes)
    x, y = shapely.get_x(centre), shapely.get_y(centre)
    lon, lat = transformer(crs, LONLAT).transform(x, y)
    x_px, y_px = grid.from_crs(x, y, crs) if grid is not None else (None, None)
    grown = shapes
    if buffer_m:
        grown = grown_by(shapes, buffer_m * ground_scale_of(shapes, crs))
    return schema.table(
        schema.OBSTACLES,
        {
            "obstacle_no": np.arange(first_no, first_no + count),
            "kind": ["other"] * count,
            "status": [status] * count,
            "buffer_m": np.full(count, float(buffer_m)),
            "confidence": confidence,
            "x_px": x_px,
            "y_px": y_px,
            "lat": lat,
            "lon": lon,
        },
        shapely.orient_polygons(grown),
        crs,
    )


def on_grid(obstacles: gpd.GeoDataFrame, grid: Grid) -> gpd.GeoDataFrame:
    """The same with pixel positions and radii in the picture of a grid, which may be another."""
    x, y = grid.from_lonlat(floats(obstacles, "lon"), floats(obstacles, "lat"))
    off = np.hypot(x - floats(obstacles, "x_px"), y - floats(obstacles, "y_px"))
    if (off <= _SAME_PX).all():
        return obstacles
    radius_px = floats(obstacles, "radius_m") / grid.resolution_at(x, y)
    return obstacles.assign(x_px=x, y_px=y, radius_px=radius_px)


def active(obstacles: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """The rows that are driven around: neither rejected nor merely possible.

    Of a table without a column `status` all rows are.
    """
    return obstacles[~idle(obstacles)] if "status" in obstacles else obstacles


def idle(obstacles: gpd.GeoDataFrame) -> NDArray[np.bool_]:
    """Which rows are not driven around, by their `status`."""
    status = obstacles["status"].astype("string").str.strip().str.lower()
    return np.asarray(status.isin(schema.NOT_AVOIDED), bool)


def next_number(table: gpd.GeoDataFrame, column: str = "obstacle_no") -> int:
    """The next free number of a table's rows."""
    return last_number(floats(table, column)) + 1


def last_number(numbers: ArrayLike) -> int:
    """The highest number, behind which others follow; 0 of none.

    A huge one that a person typed is not counted on from: what follows would not fit in a file.
    """
    given = np.asarray(numbers, dtype=float)
    return int(np.max(given, where=given < _TYPED, initial=0))


def numbered(table: gpd.GeoDataFrame, column: str = "obstacle_no") -> gpd.GeoDataFrame:
    """The table with the next free numbers in rows without one; 1, 2, ... where all have none."""
    import pandas as pd

    if column not in table.columns:
        return table.assign(**{column: pd.array(range(1, len(table) + 1), dtype="Int64")})
    numbers = floats(table, column).copy()
    missing = np.isnan(numbers)
    if not missing.any():
        return table
    numbers[missing] = next_number(table, column) + np.arange(missing.sum())
    return table.assign(**{column: pd.array(numbers.astype("int64"), dtype="Int64")})


def sizes_of(obstacles: gpd.GeoDataFrame) -> tuple[FloatArray, FloatArray]:
    """Radii, NaN where there is none, and safety margins of obstacles, metres.

    Raises
    ------
    ObstacleError
        When one is negative or infinite.
    """
    radius = floats(obstacles, "radius_m")
    margin = floats(obstacles, "buffer_m")
    margin = np.where(np.isnan(margin), 0.0, margin)
    if np.any(np.isinf(radius) | (radius < 0) | ~np.isfinite(margin) | (margin < 0)):
        raise ObstacleError(
            "An obstacle's radius_m or buffer_m is negative or infinite.",
            hint="Correct the row, or leave radius_m empty to use the polygon as drawn.",
        )
    return radius, margin


def shapes_of(obstacles: gpd.GeoDataFrame) -> ObstacleShapes:
    """The shapes to avoid: the :func:`active` rows, circles as true circles.

    A row is a circle when its polygon still is the circle of `radius_m + buffer_m` (it may
    have been moved); where a person reshaped it, the polygon as drawn counts.

    Raises
    ------
    ObstacleError
        When a radius or safety margin is negative or infinite.
    """
    frame = active(numbered(obstacles))
    geometry = np.asarray(frame.geometry.to_numpy(), dtype=object)
    present = ~(shapely.is_missing(geometry) | shapely.is_empty(geometry))
    frame, geometry = frame[present], geometry[present]
    numbers = frame["obstacle_no"].to_numpy(dtype=np.int64)
    total = np.add(*sizes_of(frame))
    sized = np.isfinite(total)
    total[sized] *= ground_scale_of(geometry[sized], CRS(obstacles.crs))
    is_circle = still_round(geometry, total)
    centre = shapely.centroid(geometry[is_circle])
    return ObstacleShapes(
        np.column_stack([shapely.get_x(centre), shapely.get_y(centre), total[is_circle]]),
        numbers[is_circle],
        geometry[~is_circle],
        numbers[~is_circle],
    )


def still_round(geometry: NDArray[np.object_], radius: FloatArray) -> NDArray[np.bool_]:
    """Whether each geometry is, vertex by vertex, the polygon of a circle of the radius.

    The radius is in units of the geometries' CRS.
    """
    polygon = shapely.get_type_id(geometry) == shapely.GeometryType.POLYGON.value
    candidate = np.flatnonzero(
        polygon
        & np.isfinite(radius)
        & (shapely.get_num_interior_rings(geometry) == 0)
        & (shapely.get_num_coordinates(geometry) >= 2 * QUARTER_SEGMENTS)
    )
    result = np.zeros(len(geometry), dtype=bool)
    if not len(candidate):
        return result
    shapes, total = geometry[candidate], radius[candidate]
    xy, row = shapely.get_coordinates(shapes, return_index=True)
    centre = shapely.get_coordinates(shapely.centroid(shapes))
    off = np.abs(np.hypot(*(xy - centre[row]).T) - total[row])
    first = np.searchsorted(row, np.arange(len(shapes)))
    worst = np.maximum.reduceat(off, first)
    # An arc whose chord cuts a piece off has all its vertices on the circle, but not the area.
    share = shapely.area(shapes) / np.maximum(np.pi * total**2, 1e-12)
    metres, relative = _CIRCLE_TOLERANCE
    result[candidate] = (worst <= metres + relative * total) & (share > 0.98)
    return result


def floats(frame: gpd.GeoDataFrame, column: str) -> FloatArray:
    """A column's numbers; NaN where they are missing, as all are without the column.

    Raises
    ------
    ObstacleError
        Where it holds words.
    """
    if column not in frame.columns:
        return np.full(len(frame), np.nan)
    import pandas as pd

    try:
        return np.asarray(frame[column].to_numpy(dtype="float64", na_value=np.nan))
    except (TypeError, ValueError):
        said = frame[column].dropna()
        words = said[pd.to_numeric(said, errors="coerce").isna()]
        raise ObstacleError(
            f"The column {column} holds words, as {words.iloc[0]!r}.",
            hint="Give numbers, lengths in metres.",
        ) from None
