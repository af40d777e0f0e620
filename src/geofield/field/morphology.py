"""Morphology of field masks: holes filled, tendrils cut, notches closed."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

BoolArray = NDArray[np.bool_]

#: Openings and notches narrower than twice this are no part of an outline, pixels.
_OPEN_PX, _CLOSE_PX = 5, 6
#: Area of what is no mere line, in squares of its longer side.
_PLUMP = 0.12


def tidy(mask: BoolArray, seed_px: tuple[float, float]) -> BoolArray:
    """A mask without tendrils and notches: opened, the part at the seed, closed, filled.

    Parameters
    ----------
    mask : bool array (rows, columns)
    seed_px : (float, float)
        Pixel coordinates of a point in the part to keep; the largest part where it is in none.
    """
    rows, columns = _around(mask)
    result = np.zeros_like(mask)
    part = np.ascontiguousarray(mask[rows, columns])
    x, y = int(seed_px[0]) - columns.start, int(seed_px[1]) - rows.start
    result[rows, columns] = _tidied(part, x, y)
    return result


def _tidied(mask: BoolArray, x: int, y: int) -> BoolArray:
    import cv2

    opened = _grown(_shrunk(mask, _OPEN_PX), _OPEN_PX)
    bytes_ = opened.view(np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(bytes_, connectivity=4)
    if count == 1:
        return mask
    number = labels[y, x] if 0 <= y < mask.shape[0] and 0 <= x < mask.shape[1] else 0
    if number == 0:
        number = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    part = labels == number
    closed = _shrunk(_grown(part, _CLOSE_PX), _CLOSE_PX)
    return filled(closed | part)


def _around(mask: BoolArray) -> tuple[slice, slice]:
    """The rows and columns that a mask and its closing need."""
    margin = _CLOSE_PX + 2

    def span(used: BoolArray) -> slice:
        at = np.flatnonzero(used)
        if not len(at):
            return slice(0, len(used))
        return slice(max(int(at[0]) - margin, 0), min(int(at[-1]) + 1 + margin, len(used)))

    return span(np.any(mask, axis=1)), span(np.any(mask, axis=0))


def filled(mask: BoolArray) -> BoolArray:
    """A mask with all its holes filled."""
    import cv2

    around = np.pad(~mask, 1, constant_values=True).view(np.uint8)
    cv2.floodFill(around, None, (0, 0), 2)
    return np.asarray(around[1:-1, 1:-1] != 2)


def plump(mask: BoolArray) -> BoolArray:
    """The 4-connected parts of a mask that are no mere lines."""
    import cv2

    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8), connectivity=4)
    longer = np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    kept = stats[:, cv2.CC_STAT_AREA] >= _PLUMP * longer * longer
    kept[0] = False
    return np.asarray(kept[labels])


def inner(parts: BoolArray, mask: BoolArray) -> BoolArray:
    """Those 4-connected parts that lie in a mask and touch neither its border nor the picture's."""
    import cv2

    within = parts & mask
    _, labels = cv2.connectedComponents(within.view(np.uint8), connectivity=4)
    outside = np.pad(~mask, 1, constant_values=True).view(np.uint8)
    beside = cv2.dilate(outside, np.ones((3, 3), np.uint8))[1:-1, 1:-1] > 0
    return within & ~np.isin(labels, np.unique(labels[beside & within]))


def _shrunk(mask: BoolArray, radius: int) -> BoolArray:
    """Erosion by a disc; the picture's edge does not erode."""
    import cv2

    return cv2.erode(mask.view(np.uint8), _disc(radius)).view(bool)


def _grown(mask: BoolArray, radius: int) -> BoolArray:
    import cv2

    return cv2.dilate(mask.view(np.uint8), _disc(radius)).view(bool)


@cache
def _disc(radius: int) -> NDArray[np.uint8]:
    at = np.square(np.arange(-radius, radius + 1))
    return (at[:, None] + at <= radius * radius).astype(np.uint8)
