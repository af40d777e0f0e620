"""The evidence circular Hough transform: how much of each circle's perimeter is really there.

One real accumulator per radius, normalised to the share of the perimeter that voted, so that
a value means the same for small and large circles. It runs on the evidence picture (darkness
and greenness against the local background), not on an edge map, which is what makes it
robust on real scenes and its radii unbiased.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geofield.model.circles import Circles
from geofield.obstacles.channels import Image, is_peak, shrink, smoothed

RADII = 12
VOTE_THRESHOLD = 0.22
"""Gradient of the evidence per pixel, above which pixels vote: about 1.5 times its median."""

_SCALED_FROM_PX = 4.0


@dataclass(frozen=True, slots=True)
class Support:
    """Perimeter support on a stack of radii.

    Attributes
    ----------
    radii_px : float64 array, shape (n,)
    levels : list of (factor, float32 array)
        One picture per radius, shrunk by the factor: large circles need no fine centres.
    """

    radii_px: NDArray[np.float64]
    levels: list[tuple[int, Image]]

    def at(self, x_px: NDArray[np.float64], y_px: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return the support (points, radii) at positions."""
        out = np.empty((x_px.size, self.radii_px.size), dtype=np.float32)
        for i, (factor, image) in enumerate(self.levels):
            cols = np.clip(np.round((x_px + 0.5) / factor - 0.5), 0, image.shape[1] - 1)
            rows = np.clip(np.round((y_px + 0.5) / factor - 0.5), 0, image.shape[0] - 1)
            out[:, i] = image[rows.astype(np.intp), cols.astype(np.intp)]
        return out


def perimeter_support(image: Image, radius_px: tuple[float, float], count: int = RADII) -> Support:
    """Vote for circles that are brighter inside in an evidence picture.

    Parameters
    ----------
    image : float32 array (rows, cols)
        Evidence, high on trees.
    radius_px : (low, high)
    count : int
        Radii, geometrically spaced.
    """
    radii = np.geomspace(radius_px[0], max(radius_px[1], radius_px[0] * 1.01), count)
    levels: list[tuple[int, Image]] = []
    votes: dict[int, _Votes] = {}
    for radius in radii:
        factor = 1 if radius < _SCALED_FROM_PX else 2
        if factor not in votes:
            votes[factor] = _Votes.of(shrink(image, factor))
        levels.append((factor, votes[factor].support(float(radius) / factor)))
    return Support(radii, levels)


@dataclass(frozen=True, slots=True)
class _Votes:
    """The pixels that vote, at one scale."""

    x: NDArray[np.float32]
    y: NDArray[np.float32]
    ux: NDArray[np.float32]
    uy: NDArray[np.float32]
    weight: NDArray[np.float32]
    shape: tuple[int, int]

    @classmethod
    def of(cls, image: Image) -> _Votes:
        smooth = smoothed(image, 1.0)
        gx: Image = np.zeros_like(smooth)
        gy: Image = np.zeros_like(smooth)
        if min(image.shape) > 1:
            gy, gx = (np.asarray(part, dtype=np.float32) for part in np.gradient(smooth))
        magnitude = np.hypot(gx, gy)
        threshold = VOTE_THRESHOLD
        rows, cols = np.nonzero(magnitude > threshold)
        strength = magnitude[rows, cols]
        return cls(
            cols.astype(np.float32),
            rows.astype(np.float32),
            np.asarray(gx[rows, cols] / strength, dtype=np.float32),
            np.asarray(gy[rows, cols] / strength, dtype=np.float32),
            np.minimum(1, strength / (2 * threshold)),
            (image.shape[0], image.shape[1]),
        )

    def support(self, radius: float) -> Image:
        """Return the share of the perimeter of this radius that votes for each centre."""
        rows, cols = self.shape
        x = np.rint(self.x + np.float32(radius) * self.ux).astype(np.int32)
        y = np.rint(self.y + np.float32(radius) * self.uy).astype(np.int32)
        inside = (x >= 0) & (x < cols) & (y >= 0) & (y < rows)
        flat = y[inside] * cols + x[inside]
        votes = np.bincount(flat, weights=self.weight[inside], minlength=rows * cols)
        sigma = max(0.8, 0.22 * radius)
        accumulator = votes.astype(np.float32).reshape(rows, cols)
        smooth = smoothed(accumulator, sigma, 2.5, "zero")
        # An edge is about two pixels wide and its votes spread over 2 pi sigma^2 pixels.
        scale = 2 * np.pi * sigma**2 / (2 * np.pi * radius * 2.0)
        return np.asarray(smooth * np.float32(scale), dtype=np.float32)


def support_peaks(support: Support, threshold: float) -> Circles:
    """Return the local maxima over place and radius above a share of the perimeter."""
    parts: list[Circles] = []
    count = support.radii_px.size
    for i, (factor, image) in enumerate(support.levels):
        around = [
            support.levels[j][1]
            for j in (i - 1, i + 1)
            if 0 <= j < count and support.levels[j][0] == factor
        ]
        peak = (image > threshold) & is_peak(image)
        rows, cols = np.nonzero(peak)
        values = image[rows, cols]
        keep = np.ones(values.size, dtype=bool)
        for other in around:
            keep &= values >= 0.98 * other[rows, cols]
        rows, cols, values = rows[keep], cols[keep], values[keep]
        parts.append(
            Circles(
                cols.astype(np.float64) * factor + (factor - 1) / 2,
                rows.astype(np.float64) * factor + (factor - 1) / 2,
                np.full(values.size, support.radii_px[i]),
                values.astype(np.float64),
            )
        )
    circles = Circles()
    for part in parts:
        circles = circles.joined(part)
    return circles.take(np.argsort(-circles.strength, kind="stable"))
