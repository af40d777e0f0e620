"""Peaks that stand out by at least a height: the h-maxima, by their dynamics.

An h-maximum is a plateau: the pixels that can be reached from a peak without going down by
more than h, where no higher peak can be reached that way. Morphological reconstruction finds
them by sweeping the picture many times. Here every pixel climbs to its peak once, and only
the passes between neighbouring peaks are looked at (M. Grimaud, "A new measure of contrast:
the dynamics", 1992).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix


def plateau_labels(height: NDArray[np.float64], h: float) -> tuple[NDArray[np.intp], int]:
    """Label the plateaus of the h-maxima of a picture, 8-connected.

    Parameters
    ----------
    height : float64 array, shape (rows, cols)
        Not below 0; 0 counts as ground.
    h : float
        Peaks that rise by less than this above the pass to a higher peak, or above the
        ground, are no maxima.

    Returns
    -------
    labels : intp array, shape (rows, cols)
        0 for no plateau, otherwise 1..count, the highest peak first.
    count : int
    """
    labels = np.zeros(height.shape, dtype=np.intp)
    if height.size == 0 or float(height.max()) <= h:
        return labels, 0
    basin, tops = _basins(height)
    first, second, level = _passes(height, basin)
    both = np.concatenate([first, second]), np.concatenate([second, first])
    passes = csr_matrix((np.concatenate([level, level]), both), shape=(tops.size, tops.size))
    neighbours = passes.indptr.tolist(), passes.indices.tolist(), passes.data.tolist()
    tallest = np.argsort(-tops, kind="stable")
    # A basin belongs to one plateau at most: two that shared it would reach each other.
    label = np.zeros(tops.size, dtype=np.intp)
    floor = np.full(tops.size, np.inf)
    count = 0
    heights = tops.tolist()
    for peak in tallest[: int(np.count_nonzero(tops > h))].tolist():
        plateau = _reach(peak, h, heights, *neighbours)
        if plateau is None:
            continue
        count += 1
        label[plateau] = count
        floor[plateau] = heights[peak] - h
    at = np.flatnonzero(height >= floor[basin])
    labels.ravel()[at] = label[basin.ravel()[at]]
    return labels, count


def _reach(
    peak: int, h: float, tops: list[float], start: list[int], other: list[int], level: list[float]
) -> list[int] | None:
    """Return the basins reachable without going down by more than h, or None if one is higher.

    The passes from basin i are numbered from start[i] on: to which other one, how high.
    """
    top = tops[peak]
    seen = {peak}
    stack = [peak]
    while stack:
        at = stack.pop()
        for k in range(start[at], start[at + 1]):
            there = other[k]
            if level[k] < top - h or there in seen:
                continue
            # Of two equal peaks on one plateau the first stands for both.
            if tops[there] > top or (tops[there] == top and there < peak):
                return None
            seen.add(there)
            stack.append(there)
    return list(seen)


_STEPS = tuple((dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1))
_BLOCK_ROWS = 32
"""Rows that are looked at together: few enough to stay in the processor's cache."""


def _basins(height: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Let every pixel climb to its peak; return the peak's number per pixel, and its height."""
    rows, cols = height.shape
    padded = np.full((rows + 2, cols + 2), -np.inf)
    padded[1:-1, 1:-1] = height
    target = np.arange(rows * cols, dtype=np.intp).reshape(rows, cols)
    offset = np.array([dy * cols + dx for dy, dx in _STEPS], dtype=np.intp)
    for row in range(0, rows, _BLOCK_ROWS):
        part = padded[row : row + _BLOCK_ROWS + 2]
        depth = part.shape[0] - 2
        best = part[:depth, :cols].copy()
        which = np.zeros(best.shape, dtype=np.int8)
        # Of equal neighbours the one of the smallest index is climbed to, so that flat ground
        # ends in one place and never runs in a circle.
        for k, (dy, dx) in enumerate(_STEPS[1:], start=1):
            seen = part[1 + dy : 1 + dy + depth, 1 + dx : 1 + dx + cols]
            np.copyto(which, np.int8(k), where=seen > best)
            np.maximum(best, seen, out=best)
        target[row : row + depth] += offset[which]
    climb = target.ravel()
    while True:
        further = climb[climb]
        if np.array_equal(further, climb):
            break
        climb = further
    peaks = np.flatnonzero(climb == np.arange(climb.size))
    number = np.zeros(climb.size, dtype=np.intp)
    number[peaks] = np.arange(peaks.size)
    return number[climb].reshape(rows, cols), height.ravel()[peaks]


def _passes(
    height: NDArray[np.float64], basin: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """Return pairs of neighbouring basins and the highest pass between them."""
    pairs: list[NDArray[np.intp]] = []
    levels: list[NDArray[np.float64]] = []
    count = int(basin.max()) + 1
    rows, cols = basin.shape
    flat_basin, flat_height = basin.ravel(), height.ravel()
    border = np.empty(basin.shape, dtype=np.bool_)
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        here = (slice(0, rows - dy), slice(max(-dx, 0), cols - max(dx, 0)))
        there = (slice(dy, rows), slice(max(dx, 0), cols - max(-dx, 0)))
        border[:] = False
        np.not_equal(basin[here], basin[there], out=border[here])
        at = np.flatnonzero(border)
        step = at + (dy * cols + dx)
        level = np.minimum(flat_height[at], flat_height[step])
        above = level > 0
        low, high = flat_basin[at[above]], flat_basin[step[above]]
        pairs.append(np.minimum(low, high) * count + np.maximum(low, high))
        levels.append(level[above])
    key, level = np.concatenate(pairs), np.concatenate(levels)
    if key.size == 0:
        return key, key, level
    order = np.argsort(key)
    key = key[order]
    first = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    key = key[first]
    return key // count, key % count, np.maximum.reduceat(level[order], first)
