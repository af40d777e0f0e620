"""Shapes of obstacles of which a person typed another size, or drew another shape."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from pyproj import CRS

from geofield.crs import ground_scale_of
from geofield.errors import FormatWarning, ObstacleError
from geofield.model.obstacles import (
    LINE_HALF_WIDTH_M,
    POINT_RADIUS_M,
    QUARTER_SEGMENTS,
    circle_polygons,
    floats,
    grown_by,
    still_round,
)
from geofield.model.written import Record, fitted_circles, same_shapes, shapes_of_plain
from geofield.notes import warn
from geofield.wording import some_of

if TYPE_CHECKING:
    import geopandas as gpd

#: A typed length that differs by more than this from the written one, metres.
_TYPED_M = 1e-4


def differ(one: ArrayLike, other: ArrayLike) -> NDArray[np.bool_]:
    """Whether lengths differ; two missing ones do not."""
    one, other = np.asarray(one, float), np.asarray(other, float)
    same = (np.abs(one - other) <= _TYPED_M) | (np.isnan(one) & np.isnan(other))
    return np.asarray(~same, dtype=bool)


def shape_now(
    shape: shapely.Polygon,
    radius_m: float,
    buffer_m: float,
    was: shapely.Polygon,
    was_buffer_m: float,
    crs: CRS,
    *,
    new_radius: bool,
    new_margin: bool,
) -> tuple[shapely.Polygon, float]:
    """Shape and radius of a row that a person changed: drawn anew, moved, or of another size."""
    centre, start = shapely.centroid(shape), shapely.centroid(was)
    scale = float(ground_scale_of(shape, crs))
    step = np.array([centre.x - start.x, centre.y - start.y])
    as_was = bool(same_shapes([shapely.transform(was, lambda xy: xy + step)], [shape])[0])
    if as_was and not (new_radius or new_margin):
        return shape, radius_m
    if not as_was and still_round(np.array([shape]), np.array([(radius_m + buffer_m) * scale]))[0]:
        return shape, radius_m
    if np.isfinite(radius_m) and (as_was or new_radius):
        return circles(centre.x, centre.y, radius_m + buffer_m, crs)[0], radius_m
    now = grown(shape, buffer_m, was_buffer_m, scale) if new_margin else shape
    if as_was:
        return now, radius_m
    drawn = fitted_circles([now])[:, 2]
    now_round = bool(still_round(np.array([now]), drawn)[0])
    left_m = float(drawn[0]) / scale - buffer_m
    return now, left_m if now_round and left_m > 0 else np.nan


def circles(x: ArrayLike, y: ArrayLike, radius_m: ArrayLike, crs: CRS) -> NDArray[np.object_]:
    """Polygons of obstacles that were typed as round.

    Raises
    ------
    ObstacleError
        When one has no size.
    """
    if not (np.asarray(radius_m) > 0).all():
        raise ObstacleError("An obstacle has no size.", hint="Give it a radius_m above 0.")
    return circle_polygons(x, y, radius_m, crs)


def grown(shape: shapely.Polygon, buffer_m: float, was_m: float, scale: float) -> shapely.Polygon:
    """A shape with another safety margin than it was drawn with."""
    result: shapely.Polygon = grown_by(np.array([shape]), (buffer_m - was_m) * scale)[0]
    if result.is_empty or shapely.get_num_geometries(result) > shapely.get_num_geometries(shape):
        raise ObstacleError(
            f"A safety margin of {buffer_m:g} m leaves nothing whole of an obstacle drawn with one "
            f"of {was_m:g} m.",
            hint="Draw the obstacle anew, or choose another buffer_m.",
        )
    return result


def widened(obstacles: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """A table of which points are circles and lines are strips, as in a file of obstacles.

    A point is as large as `radius_m` and `buffer_m` say. A line reaches `radius_m` to both sides;
    a strip is no circle and has no radius. Those that say no size are told.
    """
    shapes = np.array(obstacles.geometry.array, dtype=object)
    if (shapely.get_type_id(shapes) == shapely.GeometryType.GEOMETRYCOLLECTION).any():
        obstacles = obstacles.explode(ignore_index=True)
        shapes = np.array(obstacles.geometry.array, dtype=object)
    dimension = shapely.get_dimensions(shapes)
    point, line = dimension == 0, dimension == 1
    if not (point | line).any():
        return obstacles
    radius = floats(obstacles, "radius_m").copy()
    margin = np.nan_to_num(floats(obstacles, "buffer_m"))
    unsized = point & ~(radius > 0)
    radius[unsized] = POINT_RADIUS_M
    bare = line & ~(radius > 0) & ~(margin > 0)
    _tell_unsized(int(unsized.sum()), int(bare.sum()))
    # The margin of a line grows it where that of a drawn shape does.
    half_m = np.where(point, radius + margin, np.fmax(radius, LINE_HALF_WIDTH_M))
    thin = point | line
    shapes[thin] = strips(shapes[thin], half_m[thin], CRS(obstacles.crs))
    radius[line] = np.nan
    return obstacles.assign(radius_m=radius).set_geometry(shapes, crs=obstacles.crs)


def as_areas(obstacles: gpd.GeoDataFrame, record: Record) -> gpd.GeoDataFrame:
    """A table in which borders of areas that were written are these areas again, which is told.

    As a strip such a line would leave a way through the middle of the tree.
    """
    shapes = np.array(obstacles.geometry.array, dtype=object)
    lines = np.flatnonzero(shapely.get_dimensions(shapes) == 1)
    if not len(lines):
        return obstacles
    numbers = floats(obstacles, "obstacle_no")
    lines = lines[np.isin(numbers[lines], list(record))]
    known = [record[int(number)] for number in numbers[lines]]
    areas = shapes_of_plain([row.shape for row in known])
    same = same_shapes(shapely.boundary(areas), shapes[lines])
    if not same.any():
        return obstacles
    shapes[lines[same]] = areas[same]
    names = [str(row.obstacle_no) for row, is_one in zip(known, same, strict=True) if is_one]
    warn(
        f"The borders of obstacles became lines ({some_of(names, 20)}): each is the area that it "
        "was.",
        FormatWarning,
    )
    return obstacles.set_geometry(shapes, crs=obstacles.crs)


def strips(lines: NDArray[np.object_], half_m: ArrayLike, crs: CRS) -> NDArray[np.object_]:
    """Points and lines in a CRS as what reaches so many metres to all sides of them."""
    lines = shapely.force_2d(lines)
    wide = np.asarray(half_m) * ground_scale_of(lines, crs)
    return np.asarray(shapely.buffer(lines, wide, quad_segs=QUARTER_SEGMENTS), dtype=object)


def _tell_unsized(points: int, lines: int) -> None:
    for count, what, column, taken in (
        (points, "point", "radius_m", f"circles of {POINT_RADIUS_M:g} m"),
        (lines, "line", "buffer_m", f"strips of {2 * LINE_HALF_WIDTH_M:g} m"),
    ):
        if count:
            many = f"One {what}" if count == 1 else f"{count} {what}s"
            warn(
                f"{many} among the obstacles without {column}: taken for {taken}. Correct the "
                "sizes that are others.",
                FormatWarning,
            )
