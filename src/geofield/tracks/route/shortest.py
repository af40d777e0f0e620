"""The order of segments with the shortest drive between them.

Every segment is driven once, in either direction: a travelling salesman's tour in which the two
ends of each segment are neighbours for good. It is improved by exchanging links (2-opt, Croes
1958) and moving runs of segments (Or-opt, Or 1976) among near neighbours, then kicked and improved
again a fixed number of times (Lourenco et al. 2003, "Iterated local search"), so that equal
input gives equal output whatever the machine. The cost of a link is the length of its
curve for the turning radius; what stands in between is priced for the nearest neighbours.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from geofield.tracks.frame import FloatArray
from geofield.tracks.route.curves import dubins_words, to_unit
from geofield.tracks.route.passage import Passage
from geofield.tracks.route.tour import improve_tour
from geofield.tracks.shapes import IntArray

_NEIGHBOURS = 12
_BLOCKED_FACTOR = 1.5
"""A link that is blocked is priced as this many times its length, until its way is known."""
_CRAMPED_RADII = 12.0
"""And one from or to an end at which no turn can be begun as so many turning radii more."""


def shortest_order(
    ends: FloatArray,
    rows: IntArray,
    backward: NDArray[np.bool_],
    passage: Passage,
    *,
    radius_m: float | None,
    start: FloatArray | None,
) -> tuple[IntArray, NDArray[np.bool_]]:
    """Shorten the drive between segments; the new `rows` and `backward`.

    `ends` are both ends of each segment (segments, 2, 2), metres on the ground, `rows` and
    `backward` the order to begin with; `radius_m` is for the cost of turning round, `start` where
    the machine comes from.
    """
    count = len(ends)
    if count < 2:
        return rows, backward
    near, cost = _link_costs(ends, passage, radius_m)
    places = ends.reshape(-1, 2)
    begin = None if start is None else np.hypot(*(places - start).T).tolist()
    tour = np.column_stack((2 * rows + backward, 2 * rows + ~backward)).ravel().tolist()
    tour = improve_tour(
        tour,
        places.tolist(),
        near,
        cost,
        detour_m=0.0 if radius_m is None else np.pi * radius_m,
        begin=begin,
    )
    first = np.array(tour[0::2], dtype=np.int64)
    return first // 2, (first % 2).astype(bool)


def _cramped(
    places: FloatArray, leaving: FloatArray, passage: Passage, radius_m: float
) -> NDArray[np.bool_]:
    """Whether an obstacle stands so close before an end that no turn can be begun there."""
    ahead = radius_m * np.column_stack((np.cos(leaving), np.sin(leaving)))
    return passage.hits(np.asarray(shapely.linestrings(np.stack((places, places + ahead), axis=1))))


def _face_to_face(exits: FloatArray, entries: FloatArray) -> NDArray[np.bool_]:
    """Whether one end lies straight ahead of the other: what is between is driven around."""
    along, across, _ = to_unit(exits, entries, 1.0)
    return np.asarray((np.abs(across) < 1e-3) & (along > 0.0))


def _link_costs(
    ends: FloatArray, passage: Passage, radius_m: float | None
) -> tuple[list[list[int]], dict[int, float]]:
    """Near neighbours of each end, and what driving to them costs.

    For every end (2 row, 2 row + 1) the ends that are cheap to drive to, cheapest first; then a
    dictionary from ``a * ends + b`` (both ways round) to metres.
    """
    places = ends.reshape(-1, 2)
    total = len(places)
    k = min(2 * _NEIGHBOURS + 2, total)
    _, found = cKDTree(places).query(places, k=k)
    a = np.repeat(np.arange(total), k)
    b = found.ravel()
    other = (a // 2 != b // 2) & (b < total)
    a, b = a[other], b[other]
    # Each pair once: driving there and back are the same curve.
    pair = np.unique(np.minimum(a, b) * total + np.maximum(a, b))
    a, b = pair // total, pair % total
    if radius_m is None:
        length = np.hypot(*(places[b] - places[a]).T)
    else:
        angle = np.arctan2(*(ends[:, 1] - ends[:, 0]).T[::-1])
        leaving = np.column_stack((angle + np.pi, angle)).ravel()
        exits = np.column_stack((places[a], leaving[a]))
        entries = np.column_stack((places[b], leaving[b] + np.pi))
        length = dubins_words(exits, entries, radius_m).total.min(axis=1) * radius_m
        length += _cramped(places, leaving, passage, radius_m)[np.stack((a, b))].any(axis=0) * (
            _CRAMPED_RADII * radius_m * ~_face_to_face(exits, entries)
        )
    lines = np.asarray(shapely.linestrings(np.stack((places[a], places[b]), axis=1)))
    blocked = passage.hits(lines) | ~shapely.covers(passage.open_shell, lines)
    length = np.where(blocked, length * _BLOCKED_FACTOR, length)
    cost = dict(zip((a * total + b).tolist(), length.tolist(), strict=True))
    cost.update(zip((b * total + a).tolist(), length.tolist(), strict=True))
    both_a, both_b = np.concatenate((a, b)), np.concatenate((b, a))
    order = np.lexsort((np.concatenate((length, length)), both_a))
    both_a, both_b = both_a[order], both_b[order]
    first = np.searchsorted(both_a, np.arange(total + 1)).tolist()
    listed = both_b.tolist()
    near = [listed[first[e] : min(first[e + 1], first[e] + _NEIGHBOURS)] for e in range(total)]
    return near, cost
