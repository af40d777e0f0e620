"""Clip parallel tracks against the free area: one sweep over all tracks at once.

Every edge of the field and of the obstacles, and every circle, gives *crossings*: a track, a place
u on it, and whether something is entered or left there. Sorted by track and place, a running count
says what is free. The cost is that of sorting the crossings; nothing loops over tracks in Python.

The free area is taken closed: a track on the border itself, or touching an obstacle, is free. It is
what a sweep just above the track and a sweep just below it have in common with the free area,
joined (de Berg et al., *Computational Geometry*, ch. 2). Both sweeps are made, and only for
those tracks that run exactly through a vertex; elsewhere they are the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geofield.tracks.frame import FloatArray
from geofield.tracks.shapes import FIELD, Discs, Edges, IntArray

SNAP_M = 1e-7
"""A vertex this near to a track lies on it: the last digits of northings, along a fitted edge."""
TOUCH_M = 1e-8
"""Pieces and gaps up to this length are touching points, not pieces and gaps."""

# One running count for both: the field counts 1, an obstacle takes off more than any field has.
_BLOCK = 1 << 24


@dataclass(frozen=True, slots=True)
class Pieces:
    """The drivable pieces of all tracks, by track and then by place."""

    #: Shape (n,): index of the track in the positions given.
    track: IntArray
    #: start, end (n,): place along the track (u of the frame), metres.
    start: FloatArray
    end: FloatArray

    def __len__(self) -> int:
        return len(self.track)


@dataclass(frozen=True, slots=True)
class Crossings:
    """The sorted crossings of a sweep, and which of the raw pieces were kept.

    Kept so that causes of gaps and losses can be read off without sweeping again.
    """

    track: IntArray
    u: FloatArray
    enters: NDArray[np.int8]
    owner: IntArray
    free: NDArray[np.bool_]
    raw_piece: IntArray
    last_kept: IntArray
    sweeps: tuple[NDArray[np.int8], ...]
    """Marks the crossings of each sweep: one for all, or one above the tracks and one below."""


def clip_tracks(
    positions: FloatArray,
    edges: Edges,
    discs: Discs | None = None,
    *,
    min_length_m: float = 0.0,
) -> tuple[Pieces, Crossings]:
    """Find where each track is inside the field and outside every obstacle.

    `positions` are the places v of the tracks in the frame, strictly increasing, metres; `edges`
    those of the field (owner ``FIELD``) and of polygonal obstacles; `discs` are cut as true
    circles. Pieces shorter than `min_length_m` are not driven: they become part of the gap.
    """
    track, u, enters, owner, marks = _all_crossings(positions, edges, discs)
    # Sorting by place and then, stably, by track: a radix sort for 16-bit track numbers.
    by_place = np.argsort(u)
    small = np.int16 if len(positions) < 2**15 else np.int64
    order = by_place[np.argsort(track[by_place].astype(small), kind="stable")]
    track, u, enters, owner = track[order], u[order], enters[order], owner[order]
    weight = np.where(owner == FIELD, enters.astype(np.int64), -_BLOCK * enters.astype(np.int64))
    sweeps = tuple(each[order] for each in marks) or (np.ones(1, np.int8),)
    free = np.logical_or.reduce([np.cumsum(weight * each) > 0 for each in sweeps])
    before = np.empty_like(free)
    before[:1] = False
    before[1:] = free[:-1]
    first = np.flatnonzero(free & ~before)
    last = np.flatnonzero(before & ~free)
    start, end, piece_track = u[first], u[last], track[first]

    keep = end - start > TOUCH_M
    joined = np.zeros(len(start), dtype=bool)
    if not keep.all():
        start, end, piece_track = start[keep], end[keep], piece_track[keep]
        joined = joined[keep]
    group = np.arange(len(start))
    if len(start) > 1:
        joined[1:] = (piece_track[1:] == piece_track[:-1]) & (start[1:] - end[:-1] <= TOUCH_M)
        if joined.any():
            group = np.cumsum(~joined) - 1
            final = np.append(~joined[1:], True)
            start, piece_track, end = start[~joined], piece_track[~joined], end[final]
    if min_length_m > 0.0:
        long = end - start >= min_length_m
        group = (np.cumsum(long) - 1)[group]
        start, end, piece_track = start[long], end[long], piece_track[long]

    last_kept = np.full(len(first) + 1, -1, dtype=np.int64)
    if len(group):
        seen = np.cumsum(keep) - 1
        last_kept[1:] = np.where(seen >= 0, group[seen], -1)
    crossings = Crossings(
        track, u, enters, owner, free, np.cumsum(free & ~before), last_kept, sweeps
    )
    return Pieces(piece_track, start, end), crossings


def _all_crossings(
    positions: FloatArray, edges: Edges, discs: Discs | None
) -> tuple[
    IntArray,
    FloatArray,
    NDArray[np.int8],
    IntArray,
    list[NDArray[np.int8]],
]:
    """Find every crossing, and mark those of the sweep above and of the sweep below, if two."""
    count = len(positions)
    va, vb = edges.va, edges.vb
    # For each vertex: the first track at or above it, and whether it lies on that track.
    ends = np.concatenate((va, vb))
    at = np.searchsorted(positions, ends - SNAP_M)
    nearest = positions[np.minimum(at, count - 1)] if count else np.full(len(ends), np.inf)
    on = (at < count) & (np.abs(nearest - ends) <= SNAP_M)
    n = len(va)
    touched = bool(on.any())
    if touched:
        ends = np.where(on, nearest, ends)
        va, vb = ends[:n], ends[n:]
    track, u, enters, owner = _edge_crossings(
        positions, edges, va=va, vb=vb, at_a=at[:n], at_b=at[n:], upper=False
    )
    parts = [(track, u, enters, owner)]
    marks: list[NDArray[np.int8]] = []
    if touched:
        hit = np.zeros(count, dtype=bool)
        hit[at[on]] = True
        after = at + on
        more = _edge_crossings(
            positions, edges, va=va, vb=vb, at_a=after[:n], at_b=after[n:], upper=True
        )
        wanted = hit[more[0]]
        parts.append((more[0][wanted], more[1][wanted], more[2][wanted], more[3][wanted]))
        others = np.ones(int(wanted.sum()), np.int8)
        marks = [
            np.append(np.ones(len(track), np.int8), 0 * others),
            np.append((~hit[track]).astype(np.int8), others),
        ]
    if discs is not None and len(discs):
        parts.append(_disc_crossings(positions, discs))
        marks = [np.append(each, np.ones(len(parts[-1][0]), np.int8)) for each in marks]
    if len(parts) > 1:
        track, u, enters, owner = (np.concatenate(column) for column in zip(*parts, strict=True))
    return track, u, enters, owner, marks


def _edge_crossings(
    positions: FloatArray,
    edges: Edges,
    *,
    va: FloatArray,
    vb: FloatArray,
    at_a: IntArray,
    at_b: IntArray,
    upper: bool,
) -> tuple[IntArray, FloatArray, NDArray[np.int8], IntArray]:
    """Cross the edges with the tracks between the track indices of their two ends.

    The place is reckoned from the end that the rule includes (the lower one for the sweep above,
    the upper one for the sweep below), so that edges which meet on a track give the same place.
    """
    number = np.abs(at_b - at_a)
    sel = np.flatnonzero(number)
    number = number[sel]
    low = np.minimum(at_a, at_b)[sel]
    va, vb, ua, ub = va[sel], vb[sel], edges.ua[sel], edges.ub[sel]
    rising = vb > va
    slope = (ub - ua) / (vb - va)
    from_a = rising != upper
    u0 = np.where(from_a, ua, ub)
    v0 = np.where(from_a, va, vb)
    turn = edges.turn[sel]
    enters = np.where(rising, -turn, turn).astype(np.int8)
    total = int(number.sum())
    edge = np.repeat(np.arange(len(sel)), number)
    track = np.arange(total) + np.repeat(low - (np.cumsum(number) - number), number)
    u = u0[edge] + (positions[track] - v0[edge]) * slope[edge]
    return track, u, enters[edge], edges.owner[sel][edge]


def _disc_crossings(
    positions: FloatArray, discs: Discs
) -> tuple[IntArray, FloatArray, NDArray[np.int8], IntArray]:
    """Cross the circles with the tracks: two places each; a tangent is no crossing."""
    low = np.searchsorted(positions, discs.v - discs.radius, side="right")
    high = np.searchsorted(positions, discs.v + discs.radius, side="left")
    number = np.maximum(high - low, 0)
    total = int(number.sum())
    disc = np.repeat(np.arange(len(discs)), number)
    track = np.arange(total) + np.repeat(low - (np.cumsum(number) - number), number)
    radius = discs.radius[disc]
    away = np.abs(positions[track] - discs.v[disc])
    # (r - d)(r + d) keeps its digits near the tangent, r^2 - d^2 does not.
    half = np.sqrt(np.maximum((radius - away) * (radius + away), 0.0))
    centre = discs.u[disc]
    owner = discs.owner[disc]
    ones = np.ones(total, dtype=np.int8)
    return (
        np.concatenate((track, track)),
        np.concatenate((centre - half, centre + half)),
        np.concatenate((ones, -ones)),
        np.concatenate((owner, owner)),
    )
