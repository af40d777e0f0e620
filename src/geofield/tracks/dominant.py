"""The direction in which most of an outline runs, however many edges its borders are cut into.

The longest single edge depends on where a digitiser, or a detector, happened to set a vertex: of
a meadow photographed in three years one border was straight twice and in six pieces once, and the
tracks turned by 90 degrees. So directions are weighed by the length of all edges that run within
a few degrees of them, and the tracks follow the longest straight run among those.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, Polygon

from geofield.angles import apart_deg
from geofield.tracks.frame import FloatArray
from geofield.tracks.longest_edge import StraightRun, longest_run, own_edges

_SAME_DEG, _OTHER_DEG = 8.0, 16.0
"""Edges count whole within the first angle of a direction, and not at all from the second on."""
_LONGER_COUNTS_MORE = 1.3
"""Power of an edge's length: of two borders as long, the one of fewer pieces is the surer."""
_MOST_DIRECTIONS = 2000
_MOST_CELLS = 100_000
"""Differences of directions that are reckoned at a time."""


def dominant_edge(
    polygon: Polygon, *, tolerance: float = 1.0, outside: Sequence[LineString] = ()
) -> tuple[StraightRun, float]:
    """Find the edge that tracks follow, and what share of the border runs its way.

    Arguments are those of :func:`geofield.tracks.longest_edge.longest_edge`. The share, 0 to 1, is
    that of the field's own border (without the picture's edge) within a few degrees.
    """
    xy, barred = own_edges(polygon, tolerance, outside)
    corner, piece = _pieces(xy, barred, tolerance / 4.0)
    offset = xy[np.roll(corner, -1)] - xy[corner]
    length = np.where(barred[corner], 0.0, np.hypot(offset[:, 0], offset[:, 1]))
    angle = np.degrees(np.arctan2(offset[:, 1], offset[:, 0])) % 180.0
    # The longest pieces are enough to choose among; all are weighed.
    tried = np.argsort(-length, kind="stable")[:_MOST_DIRECTIONS]
    sure = length**_LONGER_COUNTS_MORE
    rows = max(1, _MOST_CELLS // len(corner))
    weight = np.array([
        row @ sure
        for first in range(0, len(tried), rows)
        for row in _alike(angle, angle[tried[first : first + rows], None])
    ])  # fmt: skip
    alike = _alike(angle, angle[tried[int(np.argmax(weight.round(6)))]])
    run = longest_run(xy, tolerance, barred | (alike <= 0.5)[piece])
    return run, float(alike @ length / max(length.sum(), 1e-12))


def _pieces(
    xy: FloatArray, barred: NDArray[np.bool_], tolerance: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The vertices at which a ring turns, and which of the pieces from them each edge is of.

    Vertices on a straight border cut it into nothing, be they a surveyor's or a parcel's.
    """
    ahead = np.roll(xy, -1, axis=0) - xy
    heading = np.arctan2(ahead[:, 1], ahead[:, 0])
    # A ring keeps the vertex that it begins with, so that has to be a corner.
    sharpest = int(np.argmin(np.cos(heading - np.roll(heading, 1))))
    ring = np.roll(xy, -sharpest, axis=0)
    kept = shapely.get_coordinates(LineString([*ring, ring[0]]).simplify(tolerance))
    turns = np.isin(xy @ (1, 1j), kept @ (1, 1j)) | (barred != np.roll(barred, 1))
    corner = np.flatnonzero(turns)
    return corner, (np.cumsum(turns) - 1) % len(corner)


def _alike(angle: FloatArray, other: Any) -> FloatArray:
    """1 for directions that are nearly the same, falling to 0 for those that are not."""
    apart = apart_deg(angle, other)
    return np.asarray(np.clip((_OTHER_DEG - apart) / (_OTHER_DEG - _SAME_DEG), 0.0, 1.0))
