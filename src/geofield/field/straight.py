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

FloatArray = NDArray[np.float64]

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
    vertices = shapely.get_coordinates(polygon.exterior)[:-1]
    x, y = vertices.T
    turned = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) < 0
    return vertices[::-1] if turned else vertices


def on_frame(points: FloatArray, shape: tuple[int, int], near_px: float) -> NDArray[np.bool_]:
    """Which points lie on the picture's frame."""
    x, y = points.T
    rows, columns = shape
    away = np.minimum(np.minimum(x, columns - x), np.minimum(y, rows - y))
    return np.asarray(away < near_px)


def redrawn(
    polygon: Polygon, seed_px: tuple[float, float], shape: tuple[int, int]
) -> list[Polygon]:
    """Outlines in which a stretch is replaced by its straight neighbours drawn on.

    Parameters
    ----------
    polygon : Polygon
        Pixel coordinates.
    seed_px : (float, float)
        All outlines contain it.
    shape : (int, int)
        Rows and columns of the picture.
    """
    vertices = ring(polygon)
    sides = _Sides(vertices, shape)
    count, area, length = len(vertices), polygon.area, float(sides.length.sum())
    travelled = np.concatenate([[0.0], np.cumsum(np.tile(sides.length, 2))])
    rings: list[FloatArray] = []
    for i in range(count):
        for skip in range(2, count - 1):
            if travelled[i + skip] - travelled[i + 1] > _REPLACED * length:
                break
            j = (i + skip) % count
            if not (sides.drawn[i] or sides.drawn[j]):
                continue
            kept = vertices[(j + 1 + np.arange(count - skip)) % count]
            for corner in sides.meeting(i, j):
                if len(kept) + len(corner) > 2:
                    rings.append(np.vstack([kept, *corner]))
    if not rings:
        return []
    index = np.repeat(np.arange(len(rings)), [len(one) for one in rings])
    found = np.asarray(shapely.polygons(shapely.linearrings(np.concatenate(rings), indices=index)))
    areas = np.asarray(shapely.area(found))
    good = shapely.is_valid(found) & (areas >= _AREAS[0] * area) & (areas <= _AREAS[1] * area)
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

    def meeting(self, i: int, j: int) -> list[list[FloatArray]]:
        """Ways from side i to side j: straight on, or by the corner where their lines meet."""
        ways: list[list[FloatArray]] = []
        u, v = self.direction[i], self.direction[j]
        gap = self.start[j] - self.end[i]
        cross = float(u[0] * v[1] - u[1] * v[0])
        if self.drawn[i] and self.drawn[j] and abs(cross) < _SAME_DIRECTION and u @ v > 0:
            aside = max(abs(u[0] * gap[1] - u[1] * gap[0]), abs(v[0] * gap[1] - v[1] * gap[0]))
            if aside < _SAME_LINE_PX and gap @ u > 0:
                ways.append([])
        if abs(cross) > _PARALLEL:
            onward = float(gap[0] * v[1] - gap[1] * v[0]) / cross
            back = float(gap[0] * u[1] - gap[1] * u[0]) / cross
            corner = self.end[i] + onward * u
            reach = max(_REACH_PX, _REACH_SHARE * float(self.length[i] + self.length[j]))
            inside = np.all((corner > -1) & (corner < self.limit + 1))
            if (
                inside
                and max(abs(onward), abs(back)) < reach
                and self._open(i, -onward)
                and self._open(j, back)
            ):
                ways.append([np.clip(corner, 0, self.limit)])
        return ways

    def _open(self, side: int, within: float) -> bool:
        """Whether a side may end so far within itself (below zero: be drawn on so far)."""
        if within < 0:
            return bool(self.drawn[side])
        return within <= float(self.length[side])
