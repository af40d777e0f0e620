"""Mend: outlines changed where a point says that they err, and nowhere else.

A point that belongs and lies outside, or lies inside and does not belong, says that the side
beside it runs elsewhere: farther off, or turned about one of its ends. People click in the middle
of what is wrong, so the border is about as far beyond the point as the side is on this side of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from geofield.errors import FieldError
from geofield.field.outline import rough_outline
from geofield.field.points import obeying, obeys
from geofield.field.straight import meeting, ring

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]
Points = Sequence[tuple[float, float]]

#: How far the outline of a region may leave its border, pixels: less where a point needs it.
_TOLERANCES_PX = (3.0, 1.0)
#: Sides beside a point that are moved; by so many times its distance, pixels at least.
_SIDES, _REACHES, _LEAST_PX = 2, (1.5, 2.0, 3.0), 1.0
#: From so many corrections on they are details: before, a whole side is meant.
_DETAILS_FROM = 3
#: A side is turned about an end that is farther from the point than this share of it.
_LEVER = 0.3


def drawn(mask: BoolArray, include: Points, exclude: Points) -> Polygon:
    """A region's outline, as rough as the points allow; it obeys them, or is empty.

    Parameters
    ----------
    mask : bool array (rows, columns)
    include, exclude : sequence of (float, float)
        Pixel coordinates; the first one is the seed.
    """
    polygon = Polygon()
    for tolerance_px in _TOLERANCES_PX:
        polygon = rough_outline(mask, tolerance_px=tolerance_px)
        if obeys(polygon, include, exclude):
            return polygon
    return Polygon()


def mended(
    polygon: Polygon, include: Points, exclude: Points, shape: tuple[int, int]
) -> list[Polygon]:
    """Outlines with a side moved or turned past the first point that the given one disobeys.

    Where the other points leave no side anywhere to go, and where a person is at details, one
    gives way at the points alone.

    Parameters
    ----------
    polygon : Polygon
        Pixel coordinates.
    include, exclude : sequence of (float, float)
        Points that belong, the seed first, and that do not.
    shape : (int, int)
        Rows and columns of the picture.
    """
    missing = [(point, 1.0) for point in include if not shapely.contains_xy(polygon, *point)]
    missing += [(point, -1.0) for point in exclude if shapely.intersects_xy(polygon, *point)]
    if not missing:
        return []
    moved = [one for one in _beyond(polygon, *missing[0], shape) if obeys(one, include, exclude)]
    if moved and len(include) + len(exclude) - 1 < _DETAILS_FROM:
        return moved
    return [*moved, _cut(polygon, include, exclude)]


def _cut(polygon: Polygon, include: Points, exclude: Points) -> Polygon:
    """An outline cut or grown at the points alone; empty where they are too near to each other.

    In a reduced picture, that is: whether they contradict each other is asked at full size.
    """
    try:
        return obeying(polygon, include, exclude)
    except FieldError:
        return Polygon()


def _beyond(
    polygon: Polygon, point: tuple[float, float], outwards: float, shape: tuple[int, int]
) -> list[Polygon]:
    """Outlines with one of the sides beside a point moved beyond it."""
    vertices, at = ring(polygon), np.array(point)
    along = np.roll(vertices, -1, axis=0) - vertices
    length = np.maximum(np.hypot(*along.T), 1e-9)
    share = np.clip(np.sum((at - vertices) * along, axis=1) / length**2, 0.0, 1.0)
    away = np.hypot(*(at - vertices - share[:, None] * along).T)
    rings = []
    for i in np.argsort(away, kind="stable")[:_SIDES].tolist():
        across = outwards * np.array([along[i, 1], -along[i, 0]]) / length[i]
        for reach in _REACHES:
            far = reach * max(float(away[i]), _LEAST_PX)
            rings.append(_moved(vertices, i, far * across, far * across))
            if share[i] < 1 - _LEVER:
                rings.append(_moved(vertices, i, far / (1 - share[i]) * across, 0.0 * across))
            if share[i] > _LEVER:
                rings.append(_moved(vertices, i, 0.0 * across, far / share[i] * across))
    limit = np.array([shape[1], shape[0]], float)
    outlines = [Polygon(np.clip(one, 0.0, limit)) for one in rings]
    return [one for one in outlines if one.is_valid and one.area > 0.0]


def _moved(vertices: FloatArray, i: int, start: FloatArray, end: FloatArray) -> FloatArray:
    """A ring with the ends of a side moved, along the sides beside it where these go that way."""
    j = (i + 1) % len(vertices)
    side = vertices[i] + start, vertices[j] + end
    reach = 3.0 * max(float(np.hypot(*start)), float(np.hypot(*end)))
    changed = vertices.copy()
    before, after = (vertices[i - 1], vertices[i]), (vertices[j], vertices[(j + 1) % len(vertices)])
    for at, beside, end_px in ((i, before, side[0]), (j, after, side[1])):
        corner = meeting(side, beside, end_px, reach)
        changed[at] = end_px if corner is None else corner
    return changed
