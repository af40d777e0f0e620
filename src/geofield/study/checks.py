"""The study's checks on detections: found once, dark enough."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from geofield.model.circles import Circles, disc_means

GREY_LIMIT = 127.37
"""Mean grey level (0..255) above which the study calls a detection false."""


def first_of_duplicates(circles: Circles, tolerance_px: float = 0.5) -> NDArray[np.bool_]:
    """Return which circles are no repetition of an earlier one with the same centre.

    The study compares centres for equality; found on two maps of one picture they differ by
    rounding, so centres within ``tolerance_px`` count as one.
    """
    keep = np.ones(len(circles), dtype=bool)
    if len(circles) < 2:
        return keep
    centres = np.column_stack([circles.x_px, circles.y_px])
    pairs = cKDTree(centres).query_pairs(tolerance_px, output_type="ndarray")
    for first, second in pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].tolist():
        if keep[first]:
            keep[second] = False
    return keep


def dark_enough(
    grey: NDArray[np.floating],
    circles: Circles,
    limit: float = GREY_LIMIT,
    valid: NDArray[np.bool_] | None = None,
) -> NDArray[np.bool_]:
    """Return which discs pass the grey-level check: mean grey at or below the limit."""
    return disc_means(grey, circles, valid) <= limit


def relative_grey_limit(grey: NDArray[np.floating], region: NDArray[np.bool_]) -> float:
    """Return the mean grey level of the field: the grey check's limit on any scene."""
    return float(grey[region].mean()) if region.any() else GREY_LIMIT
