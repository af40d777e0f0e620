"""Candidates: every place that may be a tree, found at a low threshold.

The verifier decides; what is missed here is lost. So besides the peaks of the evidence
transform, the places that stand out at crown size in the maps on their own count too: a
crown inside a closed canopy has no perimeter, but it has a bright top.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from geofield.obstacles.channels import Channels, Image, gaussian, is_peak, shrink
from geofield.obstacles.evidence import Support, support_peaks

SUPPORT_THRESHOLD = 0.25
DARK_SUPPORT_THRESHOLD = 0.5
MIN_DISTANCE_PX = 3.0


def candidate_centres(
    found: Channels, support: Support, dark_support: Support | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return candidate centres in pixel-index coordinates of the working grid."""
    peaks = support_peaks(support, SUPPORT_THRESHOLD)
    xs, ys = [peaks.x_px], [peaks.y_px]
    if dark_support is not None:
        peaks = support_peaks(dark_support, DARK_SUPPORT_THRESHOLD)
        xs.append(peaks.x_px)
        ys.append(peaks.y_px)
    blobs: list[tuple[Image, float, float]] = [(found.evidence, 1.5, 0.03)]
    blobs.append((found.evidence, 2.5, 0.03))
    blobs.append((found.dark, 4.0, 0.05))
    if found.index is not None:
        blobs.append((found.index, 1.5, 1.0))
    if found.variant == "nir":
        blobs.append((found.maps["nir"], 1.5, 1.0))
        blobs.append((found.maps["nir"], 2.5, 0.5))
    else:
        blobs.append((found.maps["luma"], 2.0, 0.5))
    for image, sigma, threshold in blobs:
        y, x = _blobs(image, sigma, threshold)
        xs.append(x)
        ys.append(y)
    x, y = np.concatenate(xs), np.concatenate(ys)
    keep = _spread(x, y, found.dark.shape)
    return x[keep], y[keep]


def _blobs(
    image: Image, sigma: float, threshold: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return rows and columns of what stands out at a size; wide ones on a coarser picture."""
    factor = 1 if sigma < 2 else 2 if sigma < 4 else 4
    if factor > 1:
        image = shrink(image, factor)
        sigma = float(np.sqrt(sigma**2 - (factor**2 - 1) / 6)) / factor
    response = gaussian(image, sigma) - gaussian(image, 1.6 * sigma)
    peak = (response > threshold) & is_peak(response)
    rows, cols = np.nonzero(peak)
    offset = (factor - 1) / 2
    return rows.astype(np.float64) * factor + offset, cols.astype(np.float64) * factor + offset


def _spread(
    x: NDArray[np.float64], y: NDArray[np.float64], shape: tuple[int, ...]
) -> NDArray[np.intp]:
    """Keep one candidate per cell of three pixels, the first one found."""
    cell = (y // MIN_DISTANCE_PX).astype(np.int64) * (shape[1] + 2) + (x // MIN_DISTANCE_PX).astype(
        np.int64
    )
    _, first = np.unique(cell, return_index=True)
    return np.sort(first)
