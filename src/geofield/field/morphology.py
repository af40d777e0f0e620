"""Morphology of masks: holes filled, parts that are no mere lines, parts within others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

BoolArray = NDArray[np.bool_]

#: Area of what is no mere line, in squares of its longer side.
_PLUMP = 0.12


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
