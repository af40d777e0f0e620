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

    A stretch inside several obstacles is shared evenly among them, so that the losses add up to
    what all obstacles together cost. Owners beyond their count are no obstacles: what is barred
    by one of these is lost to none.
    """
    if not obstacle_count or not len(crossings.u):
        return np.zeros(obstacle_count)
    once = slice(None) if crossings.above is None else np.flatnonzero(crossings.above)
    u, owner = crossings.u[once], crossings.owner[once]
    enters = crossings.enters[once].astype(np.int64)
    is_field = owner == FIELD
    mine = ~is_field & (owner < obstacle_count)
    field_depth = np.cumsum(np.where(is_field, enters, 0))
    depth = np.cumsum(np.where(mine, enters, 0))
    barred = np.cumsum(np.where(is_field | mine, 0, enters)) > 0
    width = np.diff(u, append=u[-1:])
    counted = (field_depth > 0) & (depth > 0) & ~barred
    share = np.where(counted, width / np.maximum(depth, 1), 0.0)
    before = np.concatenate(([0.0], np.cumsum(share)[:-1]))
    lost = np.bincount(owner[mine], -enters[mine] * before[mine], obstacle_count)
    return np.maximum(lost, 0.0)
