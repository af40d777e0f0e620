"""The longest straight run of an outline, whatever vertices lie along it.

A digitised edge has vertices that stray from the straight line, and many more than two. A run is
straight when a line through its first vertex passes every vertex within a tolerance: the cone of
directions that still do so is narrowed vertex by vertex (Williams 1978, "An efficient algorithm for
the piecewise linear approximation of planar curves"), from all first vertices at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LinearRing, LineString, Polygon

from geofield.tracks.frame import FloatArray

#: An outline of which less than this is not the picture's edge has no edge of its own.
_REAL_SHARE = 0.15


@dataclass(frozen=True, slots=True)
class StraightRun:
    """A straight run of the outer ring, as the line that fits it best.

    Attributes
    ----------
    x0, y0, x1, y1 : float
        Its ends in the CRS; the field lies to the left of the way from the first to the second.
    """

    x0: float
    y0: float
    x1: float
    y1: float

    @property
    def length(self) -> float:
        """Length in units of the CRS."""
        return float(np.hypot(self.x1 - self.x0, self.y1 - self.y0))


def longest_edge(
    polygon: Polygon, *, tolerance: float = 1.0, outside: Sequence[LineString] = ()
) -> StraightRun:
    """Find the longest straight run of a polygon's outer ring.

    Parameters
    ----------
    polygon : shapely.Polygon
        In a metric CRS.
    tolerance : float
        How far a vertex may lie from the line, in units of the CRS. The default is that of
        outlines digitised from imagery of half a metre per pixel.
    outside : sequence of LineString
        Where the field goes on outside the picture that its outline was found in
        (:func:`geofield.model.frame.along_frame`): that is no edge of the field, and nobody drives
        along it.

    Returns
    -------
    StraightRun
    """
    xy, barred = own_edges(polygon, tolerance, outside)
    return longest_run(xy, tolerance, barred)


def own_edges(
    polygon: Polygon, tolerance: float, outside: Sequence[LineString]
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Vertices of the outer ring, and which edges from them are the picture's."""
    # An edge of no length would run to the east.
    ring = shapely.remove_repeated_points(polygon.exterior)
    ring = shapely.get_exterior_ring(shapely.orient_polygons(Polygon(ring)))
    # Of edges that are as long the first one counts, whichever vertex a file begins with.
    xy = shapely.get_coordinates(ring)[:-1]
    first = int(np.lexsort((xy[:, 1].round(3), -xy[:, 0].round(3)))[0])
    xy = np.roll(xy, -first, axis=0)
    ring = LinearRing(xy)
    if shapely.get_num_coordinates(ring) > 400:
        # Hundreds of stairs of a pixel each say nothing that their corners do not.
        ring = shapely.simplify(ring, tolerance / 4.0)
    xy = shapely.get_coordinates(ring)[:-1]
    barred = np.zeros(len(xy), dtype=bool)
    if outside:
        edges = shapely.linestrings(np.stack([xy, np.roll(xy, -1, axis=0)], axis=1))
        strip = shapely.union_all(shapely.buffer(np.asarray(outside), 2.0 * tolerance))
        barred = np.asarray(shapely.covered_by(edges, strip))
        lengths = np.hypot(*(np.roll(xy, -1, axis=0) - xy).T)
        if lengths[~barred].sum() < _REAL_SHARE * lengths.sum():
            barred[:] = False
    return xy, barred


def longest_run(xy: FloatArray, tolerance: float, barred: NDArray[np.bool_]) -> StraightRun:
    """The longest straight run of a ring that goes over no barred edge, as a fitted line."""
    first, count = _longest_run(xy, tolerance, barred)
    return fit_run(xy[np.arange(first, first + count + 1) % len(xy)])


def fit_run(run: FloatArray) -> StraightRun:
    """Fit a line to a polyline, every metre of it counting alike (total least squares)."""
    start, end = run[0], run[-1]
    if len(run) > 2:
        a, b = run[:-1] - start, run[1:] - start
        weight = np.hypot(*(b - a).T)
        total = weight.sum()
        mean = (weight[:, None] * (a + b)).sum(axis=0) / (2.0 * total)
        a, b = a - mean, b - mean
        # Second moment of a straight piece about the mean: (aa + ab + ba + bb) / 6 per length.
        moment = np.einsum("n,ni,nj->ij", weight, a, a) + np.einsum("n,ni,nj->ij", weight, b, b)
        cross = np.einsum("n,ni,nj->ij", weight, a, b)
        moment = moment / 3.0 + (cross + cross.T) / 6.0
        axis = np.linalg.eigh(moment)[1][:, 1]
        if axis @ (end - start) < 0.0:
            axis = -axis
        centre = start + mean
        start = centre + axis * (axis @ (start - centre))
        end = centre + axis * (axis @ (end - centre))
    return StraightRun(float(start[0]), float(start[1]), float(end[0]), float(end[1]))


def _longest_run(xy: FloatArray, tolerance: float, barred: NDArray[np.bool_]) -> tuple[int, int]:
    """First vertex and number of edges of the longest run of a ring without its closing vertex.

    No run goes over an edge that is barred.
    """
    n = len(xy)
    start = np.arange(n)
    axis = np.zeros(n)
    low, high = np.full(n, -np.inf), np.full(n, np.inf)
    reach = np.zeros(n)
    best_length, best_first, best_count = -1.0, 0, 1
    active = start
    for step in range(1, n):
        active = active[~barred[(active + step - 1) % n]]
        if not len(active):
            break
        offset = xy[(active + step) % n] - xy[active]
        distance = np.hypot(offset[:, 0], offset[:, 1])
        angle = np.arctan2(offset[:, 1], offset[:, 0])
        if step == 1:
            axis[active] = angle
        # Angles are reckoned from the first edge, so that the cut at 180 degrees lies behind.
        turn = (angle - axis[active] + np.pi) % (2.0 * np.pi) - np.pi
        near = distance <= tolerance
        first_far = ~near & np.isinf(low[active])
        axis[active[first_far]] = angle[first_far]
        turn[first_far] = 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            spread = np.where(near, np.inf, np.arcsin(np.minimum(tolerance / distance, 1.0)))
        inside = near | ((turn >= low[active]) & (turn <= high[active]))
        # The outline may not turn back along itself: that is another edge.
        ahead = distance >= reach[active] - tolerance
        good = inside & ahead & ~near
        if good.any():
            lengths = np.where(good, distance, -1.0).round(6)
            top = int(np.argmax(lengths))
            # Of equals the first one, whatever vertices lie along each.
            if (lengths[top], -active[top]) > (best_length, -best_first):
                best_length, best_first, best_count = float(lengths[top]), int(active[top]), step
        reach[active] = np.maximum(reach[active], distance)
        far = active[~near]
        low[far] = np.maximum(low[far], (turn - spread)[~near])
        high[far] = np.minimum(high[far], (turn + spread)[~near])
        active = active[ahead & (low[active] <= high[active])]
    if best_length < 0.0:
        # A field smaller than the tolerance: its longest single edge.
        lengths = np.hypot(*(np.roll(xy, -1, axis=0) - xy).T).round(6)
        return int(np.argmax(np.where(barred, -1.0, lengths))), 1
    return best_first, best_count
