"""Gradient voting: every edge pixel votes along its gradient for the centre it may belong to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from geofield.errors import ObstacleError
from geofield.obstacles.edges import as_unit, gradient

Polarity = Literal["dark", "bright"]
RADIUS_STEP_PX = 0.5


@dataclass(frozen=True, slots=True)
class EdgePixels:
    """The pixels that vote: where they are, and the unit vector of their gradient.

    Attributes
    ----------
    x_px, y_px : float64 arrays, shape (n,)
    ux, uy : float64 arrays, shape (n,)
        Towards brighter.
    shape : (rows, cols)
    """

    x_px: NDArray[np.float64]
    y_px: NDArray[np.float64]
    ux: NDArray[np.float64]
    uy: NDArray[np.float64]
    shape: tuple[int, int]

    def __len__(self) -> int:
        return int(self.x_px.size)


def gaussian_window(length: int, sigma_px: float) -> NDArray[np.float64]:
    """Return one axis of a truncated, normalised Gaussian window of odd length."""
    offset = np.arange(length) - (length - 1) / 2
    window = np.exp(-(offset**2) / (2 * sigma_px**2))
    return cast("NDArray[np.float64]", window / window.sum())


def smooth(
    image: NDArray[np.float64], length: int, sigma_px: float, border: Literal["nearest", "constant"]
) -> NDArray[np.float64]:
    """Smooth with a truncated Gaussian, the border pixel repeated or followed by zeros."""
    window = gaussian_window(length, sigma_px)
    rows = ndimage.correlate1d(image, window, axis=0, mode=border)
    return cast("NDArray[np.float64]", ndimage.correlate1d(rows, window, axis=1, mode=border))


def otsu_threshold(values: NDArray[np.float64]) -> float:
    """Return Otsu's threshold of values in 0..1, on 256 levels (N. Otsu, 1979).

    Where several levels separate equally well their mean is taken; a picture of one value
    gives 0.
    """
    level = np.clip(np.floor(values * 255 + 0.5), 0, 255).astype(np.intp)
    share = np.bincount(level.ravel(), minlength=256) / max(level.size, 1)
    weight = np.cumsum(share)
    moment = np.cumsum(share * np.arange(1, 257))
    spread = weight * (1 - weight)
    between = np.divide(
        (moment[-1] * weight - moment) ** 2, spread, out=np.zeros(256), where=spread > 1e-12
    )
    top = float(between.max())
    if top <= 0:
        return 0.0
    return float(np.mean(np.flatnonzero(between == top)) / 255)


def voting_pixels(
    image: NDArray[np.generic],
    *,
    edge_threshold: float | None = None,
    region: NDArray[np.bool_] | None = None,
) -> EdgePixels:
    """Return the pixels whose Sobel gradient is strong enough to vote.

    Parameters
    ----------
    image : array, shape (rows, cols)
        Integers are scaled to 0..1. A logical picture is smoothed first (9 x 9 Gaussian,
        sigma 1.5): its own gradient knows eight directions only.
    edge_threshold : float, optional
        Share of the largest gradient magnitude, 0..1; default Otsu's of the magnitudes.
    region : bool array, optional
        Only these pixels vote.

    Raises
    ------
    ObstacleError
        If the threshold is outside 0..1.
    """
    if edge_threshold is not None and not 0 <= edge_threshold <= 1:
        raise ObstacleError(f"The edge threshold {edge_threshold:g} is outside 0 to 1.")
    grey = as_unit(image)
    if image.dtype == np.bool_:
        grey = smooth(grey, 9, 1.5, "nearest")
    gx, gy = gradient(grey, "sobel")
    magnitude = np.hypot(gx, gy)
    if region is not None:
        magnitude = np.where(region, magnitude, 0.0)
    top = float(magnitude.max(initial=0.0))
    # Rounding leaves some 1e-17 of gradient on a constant picture: that is no edge.
    if top <= 1e-12:
        none = np.empty(0)
        return EdgePixels(none, none, none, none, (grey.shape[0], grey.shape[1]))
    tau = otsu_threshold(magnitude / top) if edge_threshold is None else edge_threshold
    rows, cols = np.nonzero(magnitude > tau * top)
    strength = magnitude[rows, cols]
    return EdgePixels(
        cols.astype(np.float64),
        rows.astype(np.float64),
        gx[rows, cols] / strength,
        gy[rows, cols] / strength,
        (grey.shape[0], grey.shape[1]),
    )


def radii_between(low_px: float, high_px: float) -> NDArray[np.float64]:
    """Return the radii that are voted for, half a pixel apart."""
    count = int(np.floor((high_px - low_px) / RADIUS_STEP_PX + 1e-9)) + 1
    return low_px + RADIUS_STEP_PX * np.arange(count, dtype=np.float64)


def spokes(
    edges: EdgePixels, radii_px: NDArray[np.float64], polarity: Polarity
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return where each edge pixel votes: flat pixel index, and index of the radius.

    Votes that leave the picture are dropped.
    """
    sign = _sign(polarity)
    rows, cols = edges.shape
    reach = sign * radii_px[:, None]
    x = np.floor(edges.x_px[None, :] + reach * edges.ux[None, :] + 0.5).astype(np.intp)
    y = np.floor(edges.y_px[None, :] + reach * edges.uy[None, :] + 0.5).astype(np.intp)
    inside = (x >= 0) & (x < cols) & (y >= 0) & (y < rows)
    which = np.broadcast_to(np.arange(radii_px.size)[:, None], x.shape)[inside]
    return (y * cols + x)[inside], which


def _sign(polarity: Polarity) -> float:
    if polarity == "bright":
        return 1.0
    if polarity == "dark":
        return -1.0
    raise ObstacleError(f"Unknown polarity {polarity!r}.", hint="Choose dark or bright.")
