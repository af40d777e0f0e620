"""Holes and parts of a segmentation."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

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
