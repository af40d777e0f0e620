"""What the sweep's crossings tell besides the pieces: causes of gaps, and what obstacles cost."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon, STRtree

from geofield.model.track_statistics import ObstacleLoss
from geofield.tracks.clip import TOUCH_M, Crossings, Pieces
from geofield.tracks.frame import FloatArray
from geofield.tracks.shapes import FIELD, IntArray


def gap_causes(pieces: Pieces, crossings: Crossings) -> tuple[IntArray, IntArray]:
    """Name what lies in each gap: the piece before it, and an obstacle, by their indices.

    It lies there along some of the gap, on either side of the track, wherever it begins. The second
    is ``FIELD`` where the gap leaves the field. Pairs are unique and sorted.
    """
    width = int(crossings.owner.max(initial=0)) + 2
    found = np.concatenate([
        piece * width + owner + 1
        for piece, owner in (_along_gaps(pieces, crossings, each) for each in crossings.sweeps)
    ])  # fmt: skip
    pairs = np.unique(found)
    return pairs // width, pairs % width - 1


def _along_gaps(
    pieces: Pieces, crossings: Crossings, sweep: NDArray[np.int8]
) -> tuple[IntArray, IntArray]:
    """What one sweep meets in gaps: the piece before each, and what is there."""
    mine = np.flatnonzero(np.broadcast_to(sweep, crossings.u.shape))
    mine = mine[np.lexsort((crossings.track[mine], crossings.owner[mine]))]
    owner, track = crossings.owner[mine], crossings.track[mine]
    # A ring is left as often as it is entered: each owner begins each track with nothing.
    depth = np.cumsum(crossings.enters[mine], dtype=np.int64)
    stands = np.where(owner == FIELD, depth <= 0, depth > 0)[:-1]
    at = np.flatnonzero(stands & (owner[1:] == owner[:-1]) & (track[1:] == track[:-1]))
    begin, end = mine[at], mine[at + 1]
    # The gaps after the piece that it begins in or behind, up to that after the one it ends so.
    before = np.maximum(crossings.last_kept[crossings.raw_piece[begin]], 0)
    number = crossings.last_kept[crossings.raw_piece[end]] - before + 1
    one = np.repeat(np.arange(len(at)), number)
    piece = before[one] + np.arange(len(one)) - np.repeat(np.cumsum(number) - number, number)
    fits = piece < len(pieces) - 1
    one, piece = one[fits], piece[fits]
    along = np.minimum(crossings.u[end[one]], pieces.start[piece + 1])
    along -= np.maximum(crossings.u[begin[one]], pieces.end[piece])
    fits = (
        (pieces.track[piece] == track[at[one]])
        & (pieces.track[piece + 1] == track[at[one]])
        & (along > TOUCH_M)
    )
    return piece[fits], owner[at[one[fits]]]


def obstacle_losses(crossings: Crossings, obstacle_count: int) -> FloatArray:
    """Length of track lost to each obstacle, metres.

    A stretch inside several obstacles is shared evenly among them, and so is one along which they
    stand on either side: the losses add up to what all obstacles together cost. Owners beyond their
    count are no obstacles: what is barred by one of these is lost to none.
    """
    if not obstacle_count or not len(crossings.u):
        return np.zeros(obstacle_count)
    is_field = crossings.owner == FIELD
    mine = ~is_field & (crossings.owner < obstacle_count)
    each = [crossings.enters.astype(np.int64) * sweep for sweep in crossings.sweeps]
    depths = np.array([np.cumsum(np.where(mine, enters, 0)) for enters in each])
    counted = np.array([
        (np.cumsum(np.where(is_field, enters, 0)) > 0)
        & (np.cumsum(np.where(is_field | mine, 0, enters)) <= 0)
        & (depth > 0)
        & ~crossings.free
        for enters, depth in zip(each, depths, strict=True)
    ])  # fmt: skip
    width = np.diff(crossings.u, append=crossings.u[-1:])
    shares = np.where(counted, width / np.maximum(depths * counted.sum(axis=0), 1), 0.0)
    before = np.cumsum(np.pad(shares[:, :-1], ((0, 0), (1, 0))), axis=1)
    owner = crossings.owner[mine]
    lost = sum(
        np.bincount(owner, -enters[mine] * sums[mine], obstacle_count)
        for enters, sums in zip(each, before, strict=True)
    )
    return np.maximum(lost, 0.0)


def losses_along(legs: Any, outline: Polygon, shapes: Any) -> FloatArray:
    """Length of straight lines lost to each of some shapes within a field, units of their CRS."""
    areas = np.array([outline, *shapes], dtype=object)
    leg, owner = STRtree(areas).query(legs, predicate="intersects")
    parts, at = shapely.get_parts(shapely.intersection(legs[leg], areas[owner]), return_index=True)
    at, parts = at[(long := shapely.length(parts) > 0.0)], parts[long]
    ends = [shapely.line_locate_point(legs[leg[at]], shapely.get_point(parts, k)) for k in (0, -1)]
    track, u = np.repeat(leg[at], 2), np.sort(ends, axis=0).T.ravel()
    order = np.lexsort((u, track))
    none = np.zeros(len(u), np.int64)
    enters = np.tile(np.array([1, -1], np.int8), len(at))
    crossings = Crossings(
        track[order],
        u[order],
        enters[order],
        np.repeat(owner[at] - 1, 2)[order],
        none > 0,
        none,
        none,
        (np.ones(1, np.int8),),
    )
    return obstacle_losses(crossings, len(shapes))


def by_number(numbers: Any, lost_m: FloatArray, driven_m: float) -> tuple[ObstacleLoss, ...]:
    """What each obstacle costs, by its number: its parts share one."""
    whole_m = driven_m + float(lost_m.sum())
    each, row = np.unique(np.asarray(numbers, np.int64), return_inverse=True)
    return tuple(
        ObstacleLoss(int(no), float(m), 100.0 * float(m) / whole_m if whole_m else 0.0)
        for no, m in zip(each.tolist(), np.bincount(row, lost_m, len(each)).tolist(), strict=True)
    )
