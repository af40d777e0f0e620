"""Gradient voting: every edge pixel votes along its gradient for the centre it may belong to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from geofield.errors import ObstacleError, refuse_unknown
from geofield.study.edges import as_unit, gradient, separable

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


def smooth(
    image: NDArray[np.float64], length: int, sigma_px: float, border: Literal["nearest", "constant"]
) -> NDArray[np.float64]:
    """Smooth with a Gaussian cut off at an odd length, the border repeated or followed by zeros."""
    offset = np.arange(length) - (length - 1) / 2
    window = np.exp(-(offset**2) / (2 * sigma_px**2))
    window /= window.sum()
    return separable(image, window, window, border)


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


def voting_pixels(image: NDArray[np.generic], edge_threshold: float | None) -> EdgePixels:
    """Return the pixels whose Sobel gradient is strong enough to vote.

    Parameters
    ----------
    image : array, shape (rows, cols)
        Integers are scaled to 0..1. A logical picture is smoothed first (9 x 9 Gaussian,
        sigma 1.5): its own gradient knows eight directions only.
    edge_threshold : float or None
        Share of the largest gradient magnitude, 0..1; None takes Otsu's of the magnitudes.

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
    magnitude = np.sqrt(gx * gx + gy * gy)
    top = float(magnitude.max(initial=0.0))
    # Rounding leaves some 1e-17 of gradient on a constant picture: that is no edge.
    if top <= 1e-12:
        none = np.empty(0)
        return EdgePixels(none, none, none, none, (grey.shape[0], grey.shape[1]))
    tau = otsu_threshold(magnitude / top) if edge_threshold is None else edge_threshold
    at = np.flatnonzero(magnitude > tau * top)
    rows, cols = np.divmod(at, grey.shape[1])
    strength = magnitude.ravel()[at]
    return EdgePixels(
        cols.astype(np.float64),
        rows.astype(np.float64),
        gx.ravel()[at] / strength,
        gy.ravel()[at] / strength,
        (grey.shape[0], grey.shape[1]),
    )


def evenly(start: float, stop: float, step: float) -> NDArray[np.float64]:
    """Return numbers a step apart, both ends included."""
    count = int(np.floor((stop - start) / step + 1e-9)) + 1
    return start + step * np.arange(count, dtype=np.float64)


def accumulate(
    edges: EdgePixels,
    radii_px: NDArray[np.float64],
    polarity: Polarity,
    weights: Sequence[NDArray[np.float64]],
) -> list[NDArray[np.float64]]:
    """Add up the votes of all edge pixels at all radii.

    Parameters
    ----------
    edges : EdgePixels
    radii_px : float64 array, shape (r,)
    polarity : {"dark", "bright"}
    weights : sequence of float64 arrays, shape (r,)
        What a vote of each radius weighs, for every accumulator that is asked for.

    Returns
    -------
    list of float64 arrays, shape (rows, cols)
        One accumulator for each of the weights. Votes that leave the picture are dropped.
    """
    refuse_unknown(ObstacleError, "polarity", polarity, get_args(Polarity))
    sign = 1.0 if polarity == "bright" else -1.0
    rows, cols = edges.shape
    # With a margin as wide as the largest radius no vote needs to be asked where it falls.
    margin = int(np.ceil(radii_px[-1])) + 1
    width, height = cols + 2 * margin, rows + 2 * margin
    where = np.empty((radii_px.size, len(edges)), dtype=np.intp)
    x, y = np.empty(len(edges)), np.empty(len(edges))
    for i, radius in enumerate(radii_px):
        _step(edges.x_px, edges.ux, sign * radius, x)
        _step(edges.y_px, edges.uy, sign * radius, y)
        # Whole numbers far below 2^53: exact as floats.
        y *= width
        y += x
        y += margin * width + margin
        where[i] = y
    flat = where.ravel()
    inner = (slice(margin, margin + rows), slice(margin, margin + cols))
    votes: list[NDArray[np.float64]] = []
    for weight in weights:
        total = np.bincount(flat, np.repeat(weight, len(edges)), minlength=width * height)
        votes.append(total.astype(np.float64, copy=False).reshape(height, width)[inner])
    return votes


def _step(
    start: NDArray[np.float64],
    direction: NDArray[np.float64],
    length: float,
    out: NDArray[np.float64],
) -> None:
    """Write the pixels that a step leads to into an array."""
    np.multiply(direction, length, out=out)
    out += start
    out += 0.5
    np.floor(out, out=out)
