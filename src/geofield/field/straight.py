"""Straight: other outlines that a given one suggests, along its own straight sides.

Fields have long straight sides, and the picture's frame is one more. Where an outline leaves
such a side, round a crown that leans over the border or through a gap in it, the side drawn on
is often the truth: to where it meets the outline again, or to where another long side, drawn
back, meets it.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from geofield.field.frame import Frame

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
#: A point on it and its direction.
Line = tuple[FloatArray, FloatArray]

#: Sides from this length on are drawn on, pixels.
_LONG_PX = 14.0
#: Two sides of nearly one direction (sine) and at most this far apart are one, pixels.
_SAME_DIRECTION, _SAME_LINE_PX = 0.16, 5.0
#: Sides whose directions differ less (sine) have no well-defined meeting point.
_PARALLEL = 0.12
#: How far a side is drawn on: this many pixels at least, or so many times the two sides.
_REACH_PX, _REACH_SHARE = 60.0, 1.8
#: Share of the outline's length that may be replaced.
_REPLACED = 0.65
#: Areas of a new outline, of the old one's.
_AREAS = (0.35, 1.6)


def ring(polygon: Polygon) -> FloatArray:
    """Vertices (n, 2) of a polygon's border, the inside to the left in pixel coordinates."""
    border = polygon.exterior
    vertices = shapely.get_coordinates(border)[:-1]
    return vertices if shapely.is_ccw(border) else vertices[::-1]


def redrawn(polygon: Polygon, seed_px: tuple[float, float], frame: Frame) -> list[Polygon]:
    """Outlines in which a stretch is replaced by its straight neighbours drawn on.

    Parameters
    ----------
    polygon : Polygon
        Pixel coordinates.
    seed_px : (float, float)
        All outlines contain it.
    frame : Frame
        Where the picture ends.
    """
    vertices = ring(polygon)
    sides = _Sides(vertices, frame.shape)
    count, area, length = len(vertices), polygon.area, float(sides.length.sum())
    travelled = np.concatenate([[0.0], np.cumsum(np.tile(sides.length, 2))])
    i, skip = (one.ravel() for one in np.indices((count, count - 1)))
    j = (i + skip) % count
    near = travelled[i + skip] - travelled[i + 1] <= _REPLACED * length
    tried = (skip >= 2) & near & (sides.drawn[i] | sides.drawn[j])
    i, j, skip = i[tried], j[tried], skip[tried]
    onward, met, corner = sides.meeting(i, j)
    rings: list[FloatArray] = []
    for at in np.flatnonzero(onward | met).tolist():
        kept = vertices[(j[at] + 1 + np.arange(count - skip[at])) % count]
        if onward[at] and len(kept) > 2:
            rings.append(kept)
        if met[at]:
            rings.append(np.vstack([kept, corner[at]]))
    if not rings:
        return []
    index = np.repeat(np.arange(len(rings)), [len(one) for one in rings])
    found = np.asarray(shapely.polygons(shapely.linearrings(np.concatenate(rings), indices=index)))
    found = frame.within(found[shapely.is_valid(found)])
    areas = np.asarray(shapely.area(found))
    good = (areas >= _AREAS[0] * area) & (areas <= _AREAS[1] * area)
    good[good] = shapely.contains_xy(found[good], *seed_px)
    found = found[good]
    alike = np.round(np.column_stack([areas[good], shapely.length(found)]), 1)
    _, first = np.unique(alike, axis=0, return_index=True)
    return list(found[np.sort(first)])


class _Sides:
    """An outline's sides: start, end, direction, length, and which can be drawn on."""

    def __init__(self, vertices: FloatArray, shape: tuple[int, int]) -> None:
        self.start, self.end = vertices, np.roll(vertices, -1, axis=0)
        self.length = np.hypot(*(self.end - self.start).T)
        self.direction = (self.end - self.start) / np.maximum(self.length, 1e-9)[:, None]
        self.limit = np.array([shape[1], shape[0]], float)
        on_edge = [
            np.abs(self.start[:, axis] - value) + np.abs(self.end[:, axis] - value) < 1.2
            for axis in (0, 1)
            for value in (0.0, self.limit[axis])
        ]
        self.frame = np.any(on_edge, axis=0)
        self.drawn = (self.length >= _LONG_PX) | self.frame

    def meeting(self, i: IntArray, j: IntArray) -> tuple[BoolArray, BoolArray, FloatArray]:
        """Ways from sides i to sides j: straight on, or by the corner where their lines meet.

        Returns
        -------
        (bool array, bool array, float array (n, 2))
            Where it goes straight on; where there is a corner; the corners.
        """
        u, v = self.direction[i], self.direction[j]
        gap = self.start[j] - self.end[i]
        cross = _cross(u, v)
        across, behind = _cross(gap, v), _cross(gap, u)
        onward = self.drawn[i] & self.drawn[j] & (np.abs(cross) < _SAME_DIRECTION)
        onward &= (np.sum(u * v, axis=1) > 0) & (np.sum(gap * u, axis=1) > 0)
        onward &= np.maximum(np.abs(behind), np.abs(across)) < _SAME_LINE_PX
        met = np.abs(cross) > _PARALLEL
        slope = np.where(met, cross, 1.0)
        ahead, back = across / slope, behind / slope
        corner = self.end[i] + ahead[:, None] * u
        reach = np.maximum(_REACH_PX, _REACH_SHARE * (self.length[i] + self.length[j]))
        met &= np.all((corner > -1) & (corner < self.limit + 1), axis=1)
        met &= np.maximum(np.abs(ahead), np.abs(back)) < reach
        met &= self._open(i, -ahead) & self._open(j, back)
        return onward, met, np.clip(corner, 0, self.limit)

    def _open(self, side: IntArray, within: FloatArray) -> BoolArray:
        """Whether sides may end so far within themselves (below zero: be drawn on so far)."""
        return np.asarray(np.where(within < 0, self.drawn[side], within <= self.length[side]))


def _cross(u: FloatArray, v: FloatArray) -> FloatArray:
    """Cross products of plane vectors (n, 2)."""
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


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
