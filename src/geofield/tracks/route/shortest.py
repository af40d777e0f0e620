"""The order of segments with the shortest drive between them.

Every segment is driven once, in either direction: a travelling salesman's tour in which the two
ends of each segment are neighbours for good. It is improved by exchanging links (2-opt, Croes
1958) and moving runs of segments (Or-opt, Or 1976) among near neighbours, then kicked and improved
again a fixed number of times (Lourenco et al. 2003, "Iterated local search"), so that equal
input gives equal output whatever the machine. The cost of a link is the length of its
curve for the turning radius, that of a blocked one a guess. The ways of the order that was found
are then planned, their links cost what these are long, and the search goes on from there: what is
kept is the shortest of the orders whose ways are known, the one to begin with among them.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from geofield.tracks.frame import FloatArray
from geofield.tracks.route.curves import to_unit
from geofield.tracks.route.passage import Passage
from geofield.tracks.route.tour import improve_tour
from geofield.tracks.route.turns import Turn, shortest_words
from geofield.tracks.route.ways import Ways
from geofield.tracks.shapes import IntArray

_NEIGHBOURS = 12
_BLOCKED_FACTOR = 1.5
"""A link that is blocked is priced as this many times its length, until its way is known."""
_CRAMPED_RADII = 12.0
"""And one from or to an end at which no turn can be begun as so many turning radii more,
as one that the machine cannot drive."""
_NO_WAY_M = 1e5
_ROUNDS = 4
"""Orders whose ways are looked up before the shortest of them is taken."""


def shortest_order(
    ends: FloatArray,
    rows: IntArray,
    backward: NDArray[np.bool_],
    ways: Ways,
    *,
    start: FloatArray | None,
) -> tuple[IntArray, NDArray[np.bool_]]:
    """Shorten the drive between segments; the new `rows` and `backward`.

    `ends` are both ends of each segment (segments, 2, 2), metres on the ground, `rows` and
    `backward` the order to begin with, to which no longer one is preferred; `start` is where the
    machine comes from.
    """
    total = 2 * len(ends)
    if total < 4:
        return rows, backward
    places = ends.reshape(-1, 2)
    begin = None if start is None else np.hypot(*(places - start).T).tolist()
    cost = _link_costs(ends, ways)
    best, least, known = (rows, backward), np.inf, set[int]()
    for left in reversed(range(_ROUNDS)):
        price = [_price(turn, ways.radius_m or 0.0) for turn in ways.along(rows, backward)]
        first, last = 2 * rows + backward, 2 * rows + ~backward
        whole = sum(price) + (0.0 if begin is None else begin[first[0]])
        if whole < least:
            best, least = (rows, backward), whole
        links, back = last[:-1] * total + first[1:], first[1:] * total + last[:-1]
        cost.update(zip(back.tolist(), price, strict=True))
        cost.update(zip(links.tolist(), price, strict=True))
        if not left or known.issuperset(links.tolist()):
            break
        known.update(links.tolist())
        tour = improve_tour(
            np.column_stack((2 * best[0] + best[1], 2 * best[0] + ~best[1])).ravel().tolist(),
            places.tolist(),
            _nearest(cost, total),
            cost,
            detour_m=0.0 if ways.radius_m is None else np.pi * ways.radius_m,
            begin=begin,
        )
        entered = np.array(tour[0::2], dtype=np.int64)
        rows, backward = entered // 2, (entered % 2).astype(bool)
    return best


def _price(turn: Turn, radius_m: float) -> float:
    """What a way counts for, metres."""
    if turn.kind == "none":
        return _NO_WAY_M
    return turn.length_m + (0.0 if turn.fits else _CRAMPED_RADII * radius_m)


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


def _link_costs(ends: FloatArray, ways: Ways) -> dict[int, float]:
    """What driving from each end (2 row, 2 row + 1) to its neighbours may cost.

    From ``a * ends + b`` (both ways round) to metres.
    """
    passage, radius_m = ways.passage, ways.radius_m
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
        length = shortest_words(exits, entries, radius_m, ways.curve) * radius_m
        length += _cramped(places, leaving, passage, radius_m)[np.stack((a, b))].any(axis=0) * (
            _CRAMPED_RADII * radius_m * ~_face_to_face(exits, entries)
        )
    lines = np.asarray(shapely.linestrings(np.stack((places[a], places[b]), axis=1)))
    blocked = passage.hits(lines) | ~shapely.covers(passage.open_shell, lines)
    length = np.where(blocked, length * _BLOCKED_FACTOR, length)
    cost = dict(zip((a * total + b).tolist(), length.tolist(), strict=True))
    cost.update(zip((b * total + a).tolist(), length.tolist(), strict=True))
    return cost


def _nearest(cost: dict[int, float], total: int) -> list[list[int]]:
    """The ends that are cheap to drive to from each one, cheapest first."""
    a, b = np.divmod(np.fromiter(cost, np.int64, len(cost)), total)
    order = np.lexsort((b, np.fromiter(cost.values(), np.float64, len(cost)), a))
    a, listed = a[order], b[order].tolist()
    first = np.searchsorted(a, np.arange(total + 1)).tolist()
    return [listed[first[e] : min(first[e + 1], first[e] + _NEIGHBOURS)] for e in range(total)]
