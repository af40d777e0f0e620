"""The default detector: evidence transform, many candidates, a fitted verifier."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from geofield.obstacles.candidates import candidate_centres
from geofield.obstacles.channels import Channels, Image, bilinear, channels
from geofield.obstacles.evidence import Support, perimeter_support
from geofield.obstacles.features import FeatureTable, centre_features, ring_features
from geofield.obstacles.verifier import FloatArray, Verifier, strongest

WORKING_RESOLUTION_M = 0.6
"""Ground size of a pixel of the working grid: what the verifier was fitted at."""

WORKING_RADIUS_PX = (2.5, 15.0)
"""Radii of the perimeter support, working pixels: 1.5 to 9 m."""

WINDOW_PX = 75.0


@dataclass(frozen=True, slots=True)
class Measured:
    """Candidates of a picture with all that is measured of them (working grid)."""

    found: Channels
    support: Support
    x_px: FloatArray
    y_px: FloatArray
    table: FeatureTable


@dataclass(frozen=True, slots=True)
class Trees:
    """Detected trees, pixel-index coordinates of the working grid."""

    x_px: FloatArray
    y_px: FloatArray
    radius_px: FloatArray
    confidence: FloatArray
    reach_px: FloatArray

    def __len__(self) -> int:
        return int(self.x_px.size)


def picture_channels(
    luma: Image, rgb: tuple[Image, Image, Image] | None, nir: Image | None
) -> Channels:
    """Return the channels of a picture on the working grid."""
    return channels(luma, rgb, nir, window_px=WINDOW_PX)


def measure(
    found: Channels,
    verifier: Verifier | None,
    region: NDArray[np.bool_] | None = None,
) -> Measured:
    """Find candidates and measure them.

    Parameters
    ----------
    found : Channels
    verifier : Verifier or None
        Its gate spares the full measurement of what is clearly nothing; None for no gate.
    region : bool array (rows, cols), optional
        Candidates elsewhere are dropped.
    """
    support = perimeter_support(found.evidence, WORKING_RADIUS_PX)
    x, y = candidate_centres(found, support)
    if region is not None:
        rows, cols = np.rint(y).astype(np.intp), np.rint(x).astype(np.intp)
        inside = region[
            np.clip(rows, 0, region.shape[0] - 1), np.clip(cols, 0, region.shape[1] - 1)
        ]
        x, y = x[inside], y[inside]
    table = centre_features(found, support, x, y)
    if verifier is not None:
        keep = verifier.gate.passes(table)
        x, y, table = x[keep], y[keep], table.take(keep)
    table = table.beside(ring_features(found, x, y))
    return Measured(found, support, x, y, table)


def decide(measured: Measured, verifier: Verifier, min_confidence: float) -> Trees:
    """Return the candidates that the verifier believes in, each tree once."""
    score = verifier.score.evaluate(measured.table)
    confidence = verifier.confidence(score)
    chosen = np.flatnonzero(confidence >= min_confidence)
    x, y = measured.x_px[chosen], measured.y_px[chosen]
    reach = verifier.reach_px(measured.table.take(chosen))
    keep = strongest(x, y, score[chosen], reach)
    x, y, confidence = x[keep], y[keep], confidence[chosen][keep]
    x, y, radius = fit_circles(measured.found, x, y)
    return Trees(x, y, radius, confidence, reach[keep])


_DIRECTIONS = 32
_STEP_PX = 0.5


def fit_circles(
    found: Channels, x_px: FloatArray, y_px: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Measure centre and radius on the picture itself, to a fraction of a pixel.

    The radius is where the mean over all directions falls most steeply; the centre is moved
    by the circle through the steepest places of the single directions, where they agree.

    Returns
    -------
    x, y, radius : float64 arrays, shape (n,)
    """
    if x_px.size == 0:
        return x_px, y_px, np.empty(0)
    image = found.index if found.index is not None else -found.maps["luma"]
    image = cast("Image", ndimage.gaussian_filter(image, 0.7, mode="nearest", truncate=3.0))
    limit = _radius_limit(x_px, y_px)
    for _ in range(2):
        radius, dx, dy = _fit_once(image, x_px, y_px, limit)
        x_px, y_px = x_px + dx, y_px + dy
    radius, _, _ = _fit_once(image, x_px, y_px, limit)
    return x_px, y_px, radius


def _radius_limit(x_px: FloatArray, y_px: FloatArray) -> FloatArray:
    """Crowns do not reach past their neighbours' centres."""
    if x_px.size < 2:
        return np.full(x_px.size, WORKING_RADIUS_PX[1])
    points = np.column_stack([x_px, y_px])
    distance = cKDTree(points).query(points, k=2)[0][:, 1]
    return np.asarray(np.clip(0.8 * distance, 3.0, WORKING_RADIUS_PX[1]), dtype=np.float64)


def _fit_once(
    image: Image, x_px: FloatArray, y_px: FloatArray, limit: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    radii = np.arange(1.0, WORKING_RADIUS_PX[1] + 2.01, _STEP_PX)
    angle = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    cos, sin = np.cos(angle), np.sin(angle)
    x = x_px[:, None, None] + radii[:, None] * cos
    y = y_px[:, None, None] + radii[:, None] * sin
    rows, cols = image.shape
    profile = bilinear(image, np.clip(x, 0, cols - 1), np.clip(y, 0, rows - 1))
    fall = profile[:, :-2] - profile[:, 2:]
    middle = radii[1:-1]
    mean = fall.mean(axis=2)
    allowed = (middle[None, :] <= limit[:, None]) & (middle[None, :] >= 1.5)
    masked = np.where(allowed, mean, -np.inf)
    best = masked.argmax(axis=1)
    row = np.arange(best.size)
    radius = middle[best] + _parabola(mean, row, best) * _STEP_PX

    # The steepest place of each direction, near the common radius.
    near = (
        np.abs(middle[None, :, None] - radius[:, None, None])
        <= np.maximum(0.35 * radius, 1.0)[:, None, None]
    )
    steepest = np.where(near, fall, -np.inf).argmax(axis=1)
    reach = middle[steepest]
    weight = np.clip(np.take_along_axis(fall, steepest[:, None, :], axis=1)[:, 0], 0, None)
    total = weight.sum(axis=1) + 1e-9
    offset = reach - (weight * reach).sum(axis=1)[:, None] / total[:, None]
    dx = 2 * (weight * offset * cos).sum(axis=1) / total
    dy = 2 * (weight * offset * sin).sum(axis=1) / total
    length = np.hypot(dx, dy)
    cap = 0.3 * radius
    shrink = np.where(length > cap, cap / np.maximum(length, 1e-9), 1.0)
    return radius, dx * shrink, dy * shrink


def _parabola(
    values: NDArray[np.floating], row: NDArray[np.intp], at: NDArray[np.intp]
) -> FloatArray:
    """Return the sub-step offset of a maximum from its two neighbours."""
    last = values.shape[1] - 1
    left = values[row, np.maximum(at - 1, 0)]
    right = values[row, np.minimum(at + 1, last)]
    here = values[row, at]
    curve = left - 2 * here + right
    offset = np.where(
        np.abs(curve) > 1e-9, 0.5 * (left - right) / np.where(curve == 0, 1, curve), 0
    )
    return np.where((at > 0) & (at < last), np.clip(offset, -0.5, 0.5), 0.0)
