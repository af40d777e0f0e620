"""Radii of labelled crowns, measured on the picture to a fraction of a pixel.

The labels are points. Positions are pixels from the corner of the top-left pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.special import ndtri

from geofield.raster import Image, bilinear, smoothed

FloatArray = NDArray[np.float64]

_DIRECTIONS = 32
_STEP_PX = 0.5
_ROUNDS = 3
_SMOOTHING_PX = 0.7
_EDGE_SIGMA_PX = 1.0
"""How far an edge is blurred in all: by lens, pixel, smoothing and interpolation."""

_NDVI_STEP, _LUMA_STEP = 14.0, 13.0
"""What counts as a clear step in each map."""


@dataclass(frozen=True, slots=True)
class _Fit:
    """One round: radius, shift of the centre, mean step at the radius."""

    radius: FloatArray
    dx: FloatArray
    dy: FloatArray
    step: FloatArray


def fit_circles(
    bands: NDArray[np.uint8], x_px: FloatArray, y_px: FloatArray, largest_px: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Fit a circle around each centre of a picture (red, green, blue, near infrared).

    The radius is where the mean over all directions falls most steeply; the centre is moved
    by the circle through the steepest places of the single directions, where they agree.
    Greenness decides, for shadows do not move its edge; where crowns are no greener than the
    ground, brightness does.

    Returns
    -------
    x, y, radius : float64 arrays, shape (n,)
    """
    if x_px.size == 0:
        return x_px, y_px, np.empty(0)
    red, green, blue, nir = bands.astype(np.float32)
    luma = np.float32(0.298) * red + np.float32(0.587) * green + np.float32(0.114) * blue
    weight = nir + red + 30
    limit = _radius_limit(x_px, y_px, largest_px)
    x, y, fit = _settle(_smooth(255 * (nir - red) / weight), x_px, y_px, limit)
    radius = fit.radius + _mixture_shift(weight, x, y, fit.radius)
    dark_x, dark_y, dark = _settle(_smooth(-luma), x_px, y_px, limit)
    darker = dark.step / _LUMA_STEP > 2 * np.maximum(fit.step, 0) / _NDVI_STEP
    return (
        np.where(darker, dark_x, x),
        np.where(darker, dark_y, y),
        np.where(darker, dark.radius, radius),
    )


def _smooth(image: Image) -> Image:
    return smoothed(image, _SMOOTHING_PX, truncate=4.0)


def _radius_limit(x_px: FloatArray, y_px: FloatArray, largest_px: float) -> FloatArray:
    """Crowns do not reach past their neighbours' centres."""
    if x_px.size < 2:
        return np.full(x_px.size, largest_px)
    points = np.column_stack([x_px, y_px])
    distance = cKDTree(points).query(points, k=2)[0][:, 1]
    return np.asarray(np.clip(0.8 * distance, 3.0, largest_px), dtype=np.float64)


def _mixture_shift(
    weight: Image, x_px: FloatArray, y_px: FloatArray, radius: FloatArray
) -> FloatArray:
    """Return how far an index's edge lies inside the true one.

    In a pixel of two covers a ratio index is pulled towards the brighter one. Its half-way
    point lies where the covers weigh the same, not where they share the pixel equally: at
    the crown's share s_out / (s_in + s_out), s being what the index divides by.
    """
    inner = _ring_mean(weight, x_px, y_px, 0.5 * radius)
    outer = _ring_mean(weight, x_px, y_px, radius + 3.0)
    share = outer / np.maximum(inner + outer, 1.0)
    shift = _EDGE_SIGMA_PX * ndtri(np.clip(share, 0.05, 0.95))
    return np.asarray(np.clip(shift, -0.5, 0.5), dtype=np.float64)


def _ring_mean(image: Image, x_px: FloatArray, y_px: FloatArray, radius: FloatArray) -> FloatArray:
    angle = 2 * np.pi * np.arange(16) / 16
    x = x_px[:, None] + radius[:, None] * np.cos(angle)
    y = y_px[:, None] + radius[:, None] * np.sin(angle)
    return np.asarray(bilinear(image, x, y).mean(axis=1), dtype=np.float64)


def _settle(
    image: Image, x_px: FloatArray, y_px: FloatArray, limit: FloatArray
) -> tuple[FloatArray, FloatArray, _Fit]:
    """Move the centres until the circles fit, a few rounds."""
    x, y = x_px, y_px
    for _ in range(_ROUNDS - 1):
        fit = _fit_once(image, x, y, limit)
        x, y = x + fit.dx, y + fit.dy
    return x, y, _fit_once(image, x, y, limit)


def _fit_once(image: Image, x_px: FloatArray, y_px: FloatArray, limit: FloatArray) -> _Fit:
    radii = np.arange(1.0, float(limit.max()) + 2.01, _STEP_PX)
    angle = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    cos, sin = np.cos(angle), np.sin(angle)
    x = x_px[:, None, None] + radii[:, None] * cos
    y = y_px[:, None, None] + radii[:, None] * sin
    profile = bilinear(image, x, y)
    fall = profile[:, :-2] - profile[:, 2:]
    middle = radii[1:-1]
    mean = fall.mean(axis=2)
    allowed = (middle[None, :] <= limit[:, None]) & (middle[None, :] >= 1.5)
    best = np.where(allowed, mean, -np.inf).argmax(axis=1)
    row = np.arange(best.size)
    radius = middle[best] + _parabola(mean, row, best) * _STEP_PX

    # The steepest place of each direction, near the common radius.
    reach = np.maximum(0.35 * radius, 1.0)
    near = np.abs(middle[None, :, None] - radius[:, None, None]) <= reach[:, None, None]
    steepest = np.where(near, fall, -np.inf).argmax(axis=1)
    place = middle[steepest]
    weight = np.clip(np.take_along_axis(fall, steepest[:, None, :], axis=1)[:, 0], 0, None)
    total = weight.sum(axis=1) + 1e-9
    offset = place - (weight * place).sum(axis=1)[:, None] / total[:, None]
    dx = 2 * (weight * offset * cos).sum(axis=1) / total
    dy = 2 * (weight * offset * sin).sum(axis=1) / total
    length = np.hypot(dx, dy)
    cap = 0.3 * radius
    shrink = np.where(length > cap, cap / np.maximum(length, 1e-9), 1.0)
    return _Fit(radius, dx * shrink, dy * shrink, mean[row, best].astype(np.float64))


def _parabola(
    values: NDArray[np.floating], row: NDArray[np.intp], at: NDArray[np.intp]
) -> FloatArray:
    """Return the offset of a maximum from its two neighbours, in steps."""
    last = values.shape[1] - 1
    left = values[row, np.maximum(at - 1, 0)]
    right = values[row, np.minimum(at + 1, last)]
    curve = left - 2 * values[row, at] + right
    safe = np.where(np.abs(curve) > 1e-9, curve, -1.0)
    offset = np.where(np.abs(curve) > 1e-9, 0.5 * (left - right) / safe, 0.0)
    inner = (at > 0) & (at < last)
    return np.where(inner, np.clip(offset, -0.5, 0.5), 0.0)
