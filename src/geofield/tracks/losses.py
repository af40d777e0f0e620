"""What the sweep's crossings tell besides the pieces: causes of gaps, and what obstacles cost."""

from __future__ import annotations

import numpy as np

from geofield.tracks.clip import TOUCH_M, Crossings, Pieces
from geofield.tracks.frame import FloatArray
from geofield.tracks.shapes import FIELD, IntArray


def gap_causes(pieces: Pieces, crossings: Crossings) -> tuple[IntArray, IntArray]:
    """Name what lies in each gap: the piece before it, and an obstacle, by their indices.

    The second is ``FIELD`` where the gap leaves the field. Pairs are unique and sorted.
    """
    is_field = crossings.owner == FIELD
    # A cause begins where an obstacle is entered or the field is left.
    begins = (np.where(is_field, -1, 1) * crossings.enters > 0) & ~crossings.free
    at = np.flatnonzero(begins)
    piece = crossings.last_kept[crossings.raw_piece[at]]
    fits = (piece >= 0) & (piece < len(pieces) - 1)
    at, piece = at[fits], piece[fits]
    fits = (
        (pieces.track[piece] == crossings.track[at])
        & (pieces.track[piece + 1] == crossings.track[at])
        & (crossings.u[at] >= pieces.end[piece] - TOUCH_M)
        & (crossings.u[at] < pieces.start[piece + 1] - TOUCH_M)
    )
    at, piece = at[fits], piece[fits]
    owner = crossings.owner[at]
    width = int(crossings.owner.max(initial=0)) + 2
    pairs = np.unique(piece * width + owner + 1)
    return pairs // width, pairs % width - 1


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
