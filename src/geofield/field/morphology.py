"""Morphology of masks: holes filled, and their 4-connected parts."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

BoolArray = NDArray[np.bool_]

#: Area of what is no mere line, in squares of its longer side.
_PLUMP = 0.12


def filled(mask: BoolArray) -> BoolArray:
    """A mask with all its holes filled."""
    import cv2

    around = np.pad(~mask, 1, constant_values=True).view(np.uint8)
    cv2.floodFill(around, None, (0, 0), 2)
    return np.asarray(around[1:-1, 1:-1] != 2)


def fill_holes(mask: BoolArray, *, smallest_kept_px: float | None) -> BoolArray:
    """A mask with its holes filled: all of them, or those below a size.

    Parameters
    ----------
    mask : bool array
    smallest_kept_px : float or None
        Pixels from which a hole stays one; None fills every hole.
    """
    whole = filled(mask)
    if smallest_kept_px is None:
        return whole
    labels, count = ndimage.label(whole & ~mask)
    if count == 0:
        return whole
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    kept = sizes >= smallest_kept_px
    kept[0] = False
    partly: BoolArray = whole & ~kept[labels]
    return partly


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


def part_at(mask: BoolArray, x_px: float, y_px: float) -> BoolArray:
    """The 4-connected part of a mask nearest to a pixel position."""
    return part_at_any(mask, ((x_px, y_px),))


def part_at_any(mask: BoolArray, points_px: Iterable[tuple[float, float]]) -> BoolArray:
    """The largest of the 4-connected parts nearest to some pixel positions.

    A strip that joins what a person said may be thinner than pixels.
    """
    import cv2

    count, labels = cv2.connectedComponents(mask.view(np.uint8), connectivity=4)
    if count == 1:
        return mask
    numbers = dict.fromkeys(_number_at(labels, *at) for at in points_px)
    parts: list[BoolArray] = [labels == number for number in numbers]
    return max(parts, key=np.count_nonzero)


def _number_at(labels: NDArray[Any], x_px: float, y_px: float) -> int:
    """The number of the part nearest to a pixel position."""
    y, x = int(y_px), int(x_px)
    if labels[y, x] == 0:
        rows, columns = np.nonzero(labels)
        nearest = int(np.argmin((rows - y) ** 2 + (columns - x) ** 2))
        y, x = rows[nearest], columns[nearest]
    return int(labels[y, x])
