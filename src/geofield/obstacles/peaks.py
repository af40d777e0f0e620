"""Peaks that stand out by at least a height: the h-maxima, by their dynamics.

An h-maximum is a plateau: the pixels that can be reached from a peak without going down by
more than h, where no higher peak can be reached that way. Morphological reconstruction finds
them by sweeping the picture many times. Here every pixel climbs to its peak once, and only
the passes between neighbouring peaks are looked at (M. Grimaud, "A new measure of contrast:
the dynamics", 1992).
"""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import NDArray


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
    first, second, passes = _passes(height, basin)
    neighbours: dict[int, list[tuple[int, float]]] = {}
    for a, b, level in zip(first.tolist(), second.tolist(), passes.tolist(), strict=True):
        neighbours.setdefault(a, []).append((b, level))
        neighbours.setdefault(b, []).append((a, level))

    flat_basin = basin.ravel()
    flat_height = height.ravel()
    order = np.argsort(flat_basin, kind="stable")
    starts = np.searchsorted(flat_basin[order], np.arange(tops.size + 1))
    flat_labels = labels.ravel()
    count = 0
    for peak in np.argsort(-tops, kind="stable").tolist():
        top = float(tops[peak])
        if top <= h:
            break
        plateau = _reach(peak, top, h, tops, neighbours)
        if plateau is None:
            continue
        count += 1
        for member in plateau:
            pixels = order[starts[member] : starts[member + 1]]
            flat_labels[pixels[flat_height[pixels] >= top - h]] = count
    return labels, count


def _reach(
    peak: int,
    top: float,
    h: float,
    tops: NDArray[np.float64],
    neighbours: dict[int, list[tuple[int, float]]],
) -> list[int] | None:
    """Return the basins reachable without going down by more than h, or None if one is higher."""
    seen = {peak}
    stack = [peak]
    while stack:
        for other, level in neighbours.get(stack.pop(), ()):
            if level < top - h or other in seen:
                continue
            # Of two equal peaks on one plateau the first stands for both.
            if tops[other] > top or (tops[other] == top and other < peak):
                return None
            seen.add(other)
            stack.append(other)
    return list(seen)


def _basins(height: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Let every pixel climb to its peak; return the peak's number per pixel, and its height."""
    rows, cols = height.shape
    padded = np.full((rows + 2, cols + 2), -np.inf)
    padded[1:-1, 1:-1] = height
    index = np.arange(rows * cols).reshape(rows, cols)
    best = height.copy()
    target = index.copy()
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            if dy == 0 and dx == 0:
                continue
            seen = padded[1 + dy : 1 + dy + rows, 1 + dx : 1 + dx + cols]
            step = index + dy * cols + dx
            # Equal neighbours are climbed towards the smaller index, so that flat ground
            # ends in one place and never runs in a circle.
            better = (seen > best) | ((seen == best) & (step < target) & (step >= 0))
            best = np.where(better, seen, best)
            target = np.where(better, step, target)
    climb = target.ravel()
    while True:
        further = climb[climb]
        if np.array_equal(further, climb):
            break
        climb = further
    peaks, basin = np.unique(climb, return_inverse=True)
    return (
        cast("NDArray[np.intp]", basin.reshape(rows, cols).astype(np.intp)),
        height.ravel()[peaks],
    )


def _passes(
    height: NDArray[np.float64], basin: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """Return pairs of neighbouring basins and the highest pass between them."""
    pairs: list[NDArray[np.intp]] = []
    levels: list[NDArray[np.float64]] = []
    count = int(basin.max()) + 1
    whole = slice(None)
    shifts = [
        ((whole, slice(None, -1)), (whole, slice(1, None))),
        ((slice(None, -1), whole), (slice(1, None), whole)),
        ((slice(None, -1), slice(None, -1)), (slice(1, None), slice(1, None))),
        ((slice(None, -1), slice(1, None)), (slice(1, None), slice(None, -1))),
    ]
    for here, there in shifts:
        a, b = basin[here], basin[there]
        level = np.minimum(height[here], height[there])
        border = (a != b) & (level > 0)
        low, high = np.minimum(a, b)[border], np.maximum(a, b)[border]
        pairs.append(low * count + high)
        levels.append(level[border])
    key, level = np.concatenate(pairs), np.concatenate(levels)
    order = np.lexsort((-level, key))
    key, level = key[order], level[order]
    first = np.ones(key.size, dtype=bool)
    first[1:] = key[1:] != key[:-1]
    key = key[first]
    return key // count, key % count, level[first]
