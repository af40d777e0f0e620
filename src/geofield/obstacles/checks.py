"""The study's checks on detections: inside the field, found once, dark enough."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from geofield.obstacles.circles import Circles

GREY_LIMIT = 127.37
"""Mean grey level (0..255) above which the study calls a detection false."""


def inside(circles: Circles, region: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which centres lie on a pixel of the region (rows, cols)."""
    rows, cols = region.shape
    x = np.floor(circles.x_px + 0.5).astype(np.intp)
    y = np.floor(circles.y_px + 0.5).astype(np.intp)
    known = (x >= 0) & (x < cols) & (y >= 0) & (y < rows)
    result = np.zeros(len(circles), dtype=bool)
    result[known] = region[y[known], x[known]]
    return result


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


def disc_means(
    grey: NDArray[np.floating], circles: Circles, valid: NDArray[np.bool_] | None = None
) -> NDArray[np.float64]:
    """Return the mean grey level of each disc, NaN for a disc that shows no picture."""
    rows, cols = grey.shape
    means = np.full(len(circles), np.nan)
    for i in range(len(circles)):
        x, y = circles.x_px[i], circles.y_px[i]
        reach = max(float(circles.radius_px[i]), 0.5)
        c0, c1 = max(int(np.floor(x - reach)), 0), min(int(np.ceil(x + reach)) + 1, cols)
        r0, r1 = max(int(np.floor(y - reach)), 0), min(int(np.ceil(y + reach)) + 1, rows)
        if c0 >= c1 or r0 >= r1:
            continue
        yy, xx = np.ogrid[r0:r1, c0:c1]
        disc = (xx - x) ** 2 + (yy - y) ** 2 <= reach**2
        if valid is not None:
            disc &= valid[r0:r1, c0:c1]
        if disc.any():
            means[i] = float(grey[r0:r1, c0:c1][disc].mean())
    return means


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
