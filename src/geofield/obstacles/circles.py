"""Circles in pixel coordinates: the value that every detector returns."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from geofield.errors import ObstacleError

FloatArray = NDArray[np.float64]


def _empty() -> FloatArray:
    return np.empty(0, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Circles:
    """Circles found in a picture, strongest first unless said otherwise.

    Attributes
    ----------
    x_px, y_px : float64 arrays, shape (n,)
        Centres; the centre of the top-left pixel is (0, 0).
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

    def shifted(self, dx_px: float, dy_px: float) -> Circles:
        """Return the circles moved, for example from a window into its picture."""
        return Circles(self.x_px + dx_px, self.y_px + dy_px, self.radius_px, self.strength)


def checked_range(radius_px: tuple[float, float], *, floor: float = 0.0) -> tuple[float, float]:
    """Return a radius range as two floats.

    Raises
    ------
    ObstacleError
        If the range is empty, inverted, not finite or not above ``floor``.
    """
    low, high = (float(value) for value in radius_px)
    if not (np.isfinite(low) and np.isfinite(high)) or low <= floor or high < low:
        raise ObstacleError(
            f"The radius range {low:g} to {high:g} is empty or impossible.",
            hint="Give the smaller radius first, both above zero, for example (2, 9).",
        )
    return low, high
