"""In which order and direction the segments are driven."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from geofield.tracks.frame import FloatArray
from geofield.tracks.shapes import IntArray

Pattern = Literal["boustrophedon", "skip", "shortest"]
PATTERNS: tuple[str, ...] = get_args(Pattern)


def track_order(tracks: IntArray, skip: int) -> list[int]:
    """Order of the tracks: every (skip + 1)-th, then those between on the way back, and so on.

    With ``skip=1`` from track 1 to 3, as in the study, because a turn to the next track would need
    a smaller radius; with ``skip=0`` one after the other.
    """
    order: list[int] = []
    for begin in range(min(skip + 1, len(tracks))):
        chosen = tracks[begin :: skip + 1].tolist()
        order.extend(chosen if begin % 2 == 0 else chosen[::-1])
    return order


def field_order(
    track_no: IntArray, order: list[int], *, backward_first: bool = False
) -> tuple[IntArray, NDArray[np.bool_]]:
    """Segments of the tracks in order, up one track and down the next.

    `track_no` is the track of each segment; segments of a track follow one another along it.
    Returned are the row of each segment in the order of driving, and whether it is driven against
    its direction, as the first one is if `backward_first`.
    """
    rows: list[IntArray] = []
    flags: list[NDArray[np.bool_]] = []
    first = np.searchsorted(track_no, order, side="left")
    last = np.searchsorted(track_no, order, side="right")
    backward = backward_first
    for begin, end in zip(first.tolist(), last.tolist(), strict=True):
        mine = np.arange(begin, end)
        rows.append(mine[::-1] if backward else mine)
        flags.append(np.full(len(mine), backward))
        backward = not backward
    if not rows:
        return np.empty(0, np.int64), np.empty(0, bool)
    return np.concatenate(rows), np.concatenate(flags)


def nearest_start(
    ends: FloatArray, track_no: IntArray, skip: int, start: FloatArray | None
) -> tuple[IntArray, NDArray[np.bool_]]:
    """Of the four ways to begin (first or last track, either direction) the one near a place."""
    numbers = np.unique(track_no)
    ways = (
        field_order(track_no, track_order(order, skip), backward_first=backward)
        for order in (numbers, numbers[::-1])
        for backward in (False, True)
    )
    if start is None or not len(track_no):
        return next(ways)

    def away(way: tuple[IntArray, NDArray[np.bool_]]) -> float:
        rows, flags = way
        return float(np.hypot(*(ends[rows[0], int(flags[0])] - start)))

    return min(ways, key=away)
