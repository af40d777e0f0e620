"""Holes and parts of a segmentation."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from geofield.field.morphology import filled

BoolArray = NDArray[np.bool_]


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


def part_at(mask: BoolArray, x_px: float, y_px: float) -> BoolArray:
    """The 4-connected part of a mask nearest to a pixel position."""
    import cv2

    count, labels = cv2.connectedComponents(mask.view(np.uint8), connectivity=4)
    if count == 1:
        return mask
    y, x = int(y_px), int(x_px)
    number = labels[y, x]
    if number == 0:
        rows, columns = np.nonzero(labels)
        nearest = int(np.argmin((rows - y) ** 2 + (columns - x) ** 2))
        number = labels[rows[nearest], columns[nearest]]
    part: BoolArray = labels == number
    return part


def part_at_any(mask: BoolArray, points_px: Iterable[tuple[float, float]]) -> BoolArray:
    """The largest of the parts nearest to some pixel positions.

    A strip that joins what a person said may be thinner than pixels.
    """
    return max((part_at(mask, *at) for at in points_px), key=np.count_nonzero)
