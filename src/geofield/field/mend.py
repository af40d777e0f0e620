"""Mend: outlines changed where a point says that they err, and nowhere else.

A point that belongs and lies outside, or lies inside and does not belong, says that the side
beside it runs elsewhere: farther off, or turned about one of its ends. People click in the middle
of what is wrong, so the border is about as far beyond the point as the side is on this side of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from geofield.errors import FieldError
from geofield.field.frame import Frame
from geofield.field.points import obeying, obeys
from geofield.field.straight import meeting, ring

FloatArray = NDArray[np.float64]
Points = Sequence[tuple[float, float]]

#: Sides beside a point that are moved; by so many times its distance, pixels at least.
_SIDES, _REACHES, _LEAST_PX = 2, (1.5, 2.0, 3.0), 1.0
#: From so many corrections on those this near a border are details: before, a whole side is meant.
_DETAILS_FROM, _DETAIL_PX = 3, 8.0
#: A side is turned about an end that is farther from the point than this share of it.
_LEVER = 0.3


def mended(polygon: Polygon, include: Points, exclude: Points, frame: Frame) -> list[Polygon]:
    """Outlines with a side moved or turned past the first point that the given one disobeys.

    Where a person is at details, and points lie beside the border, one gives way at them alone.

    Parameters
    ----------
    polygon : Polygon
        Pixel coordinates.
    include, exclude : sequence of (float, float)
        Points that belong, the seed first, and that do not.
    frame : Frame
        Where the picture ends.
    """
    wrong = [(point, 1.0) for point in include if not shapely.contains_xy(polygon, *point)]
    wrong += [(point, -1.0) for point in exclude if shapely.intersects_xy(polygon, *point)]
    if not wrong:
        return []
    moved = _beyond(polygon, *wrong[0], frame.shape)
    moved = frame.within(moved[shapely.is_valid(moved)])
    found = list(moved[obeys(moved, include, exclude)])
    if len(include) + len(exclude) - 1 >= _DETAILS_FROM:
        places = shapely.points([point for point, _ in wrong])
        if shapely.distance(polygon.exterior, places).max() <= _DETAIL_PX:
            found += forced(polygon, include, exclude)
    return found


def forced(polygon: Polygon, include: Points, exclude: Points) -> list[Polygon]:
    """An outline that gives way at the points alone, with strips to those that lie far off.

    None where points contradict each other: those that share a pixel of a reduced picture are
    told apart at full size.
    """
    with suppress(FieldError):
        return [obeying(polygon, include, exclude)]
    return []


def _beyond(
    polygon: Polygon, point: tuple[float, float], outwards: float, shape: tuple[int, int]
) -> NDArray[np.object_]:
    """Outlines with one of the sides beside a point moved or turned beyond it; not all valid."""
    vertices, at = ring(polygon), np.array(point)
    along = np.roll(vertices, -1, axis=0) - vertices
    length = np.maximum(np.hypot(*along.T), 1e-9)
    share = np.clip(np.sum((at - vertices) * along, axis=1) / length**2, 0.0, 1.0)
    away = np.hypot(*(at - vertices - share[:, None] * along).T)
    rings = []
    for i in np.argsort(away, kind="stable")[:_SIDES].tolist():
        across = outwards * np.array([along[i, 1], -along[i, 0]]) / length[i]
        # How far its ends go, for the side to pass the point at a distance of one.
        ends = [(1.0, 1.0)]
        if share[i] < 1 - _LEVER:
            ends.append((1 / (1 - share[i]), 0.0))
        if share[i] > _LEVER:
            ends.append((0.0, 1 / share[i]))
        for reach in _REACHES:
            far = reach * max(float(away[i]), _LEAST_PX) * across
            rings += [_moved(vertices, i, one * far, other * far) for one, other in ends]
    limit = np.array([shape[1], shape[0]], float)
    return np.asarray(shapely.polygons(np.clip(np.stack(rings), 0.0, limit)))


def _moved(vertices: FloatArray, i: int, start: FloatArray, end: FloatArray) -> FloatArray:
    """A ring with the ends of a side moved, along the sides beside it where these go that way."""
    h, j, k = i - 1, (i + 1) % len(vertices), (i + 2) % len(vertices)
    a, b = vertices[i] + start, vertices[j] + end
    reach = 3.0 * max(float(np.hypot(*start)), float(np.hypot(*end)))
    changed = vertices.copy()
    for at, place, beside in ((i, a, (h, i)), (j, b, (j, k))):
        one, other = vertices[list(beside)]
        corner = meeting((a, b - a), (one, other - one), place, reach)
        changed[at] = place if corner is None else corner
    return changed
