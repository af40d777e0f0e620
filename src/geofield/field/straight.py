"""Straight: a polygon's vertices in one direction, and where two straight lines meet."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

FloatArray = NDArray[np.float64]
#: A point on it and its direction.
Line = tuple[FloatArray, FloatArray]

#: Lines whose directions differ less (sine) have no well-defined meeting point.
_PARALLEL = 0.12


def ring(polygon: Polygon) -> FloatArray:
    """Vertices (n, 2) of a polygon's border, the inside to the left in pixel coordinates."""
    border = polygon.exterior
    vertices = shapely.get_coordinates(border)[:-1]
    return vertices if shapely.is_ccw(border) else vertices[::-1]


def meeting(one: Line, other: Line, near: FloatArray, reach_px: float) -> FloatArray | None:
    """Where two lines (a point, a direction) meet, if that is within reach of a place."""
    (p, u), (q, v) = one, other
    cross = float(u[0] * v[1] - u[1] * v[0])
    # Also where a side has no length.
    if abs(cross) <= _PARALLEL * float(np.hypot(*u) * np.hypot(*v)):
        return None
    gap = q - p
    found: FloatArray = p + float(gap[0] * v[1] - gap[1] * v[0]) / cross * u
    return found if np.hypot(*(found - near)) <= reach_px else None
