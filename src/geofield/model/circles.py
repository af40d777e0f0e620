"""Circles in pixel coordinates: the value that every detector returns."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from geofield.errors import ObstacleError, plain_number

FloatArray = NDArray[np.float64]


def _empty() -> FloatArray:
    return np.empty(0, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Circles:
    """Circles found in a picture, strongest first unless said otherwise.

    Attributes
    ----------
    x_px, y_px : float64 arrays, shape (n,)
        Centres, from the corner of the top-left pixel, as in every table.
    radius_px : float64 array, shape (n,)
    strength : float64 array, shape (n,)
        The detector's own measure of support; comparable within one picture only.
    """

    x_px: FloatArray = field(default_factory=_empty)
    y_px: FloatArray = field(default_factory=_empty)
    radius_px: FloatArray = field(default_factory=_empty)
    strength: FloatArray = field(default_factory=_empty)

    def __len__(self) -> int:
        return int(self.x_px.size)

    def take(self, index: NDArray[np.generic]) -> Circles:
        """Return the circles chosen by an integer or boolean index, in its order."""
        return Circles(
            self.x_px[index], self.y_px[index], self.radius_px[index], self.strength[index]
        )

    def joined(self, other: Circles) -> Circles:
        """Return these circles followed by others."""
        return Circles(
            np.concatenate([self.x_px, other.x_px]),
            np.concatenate([self.y_px, other.y_px]),
            np.concatenate([self.radius_px, other.radius_px]),
            np.concatenate([self.strength, other.strength]),
        )

    def scaled(self, factor: float, dx_px: float = 0.0, dy_px: float = 0.0) -> Circles:
        """Return the circles in smaller pixels, moved, as from a window into its picture."""
        x, y = self.x_px * factor + dx_px, self.y_px * factor + dy_px
        return Circles(x, y, self.radius_px * factor, self.strength)


def checked_range(radius_px: tuple[float, float]) -> tuple[float, float]:
    """Return a radius range as two floats.

    Raises
    ------
    ObstacleError
        If the range is empty, inverted, not finite or not above zero.
    """
    try:
        low, high = map(plain_number, radius_px)
    except (TypeError, ValueError):
        raise ObstacleError(
            f"A radius range is two numbers; {radius_px!r} is none.", hint="For example (2, 9)."
        ) from None
    if not (np.isfinite(low) and np.isfinite(high)) or low <= 0.0 or high < low:
        raise ObstacleError(
            f"The radius range {low:g} to {high:g} is empty or impossible.",
            hint="Give the smaller radius first, both above zero, for example (2, 9).",
        )
    return low, high


def inside(circles: Circles, region: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which centres lie on a pixel of the region (rows, cols)."""
    rows, cols = region.shape
    x = np.floor(circles.x_px).astype(np.intp)
    y = np.floor(circles.y_px).astype(np.intp)
    known = (x >= 0) & (x < cols) & (y >= 0) & (y < rows)
    result = np.zeros(len(circles), dtype=bool)
    result[known] = region[y[known], x[known]]
    return result


def disc_means(
    grey: NDArray[np.floating], circles: Circles, valid: NDArray[np.bool_] | None = None
) -> NDArray[np.float64]:
    """Return the mean grey level of each disc, NaN for a disc that shows no picture."""
    rows, cols = grey.shape
    means = np.full(len(circles), np.nan)
    for i in range(len(circles)):
        x, y = circles.x_px[i] - 0.5, circles.y_px[i] - 0.5
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
