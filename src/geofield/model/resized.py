"""Shapes of obstacles of which a person typed another size, or drew another shape."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from pyproj import CRS

from geofield.crs import ground_scale_of
from geofield.errors import ObstacleError
from geofield.model.obstacles import FloatArray, circle_polygons, still_round
from geofield.model.written import fitted_circles, same_shapes

#: A typed length that differs by more than this from the written one, metres.
_TYPED_M = 1e-4


def differ(one: FloatArray, other: FloatArray) -> NDArray[np.bool_]:
    """Whether lengths differ; two missing ones do not."""
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
    result = shapely.buffer(shape, (buffer_m - was_m) * scale, quad_segs=8)
    if result.is_empty or shapely.get_num_geometries(result) > shapely.get_num_geometries(shape):
        raise ObstacleError(
            f"A safety margin of {buffer_m:g} m leaves nothing whole of an obstacle drawn with one "
            f"of {was_m:g} m.",
            hint="Draw the obstacle anew, or choose another buffer_m.",
        )
    return result
