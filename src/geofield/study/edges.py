"""Edge maps: Sobel, Prewitt, Roberts and Canny, with thresholds and thinning.

The definitions are those of the study's ``edge`` function: gradients by correlation with
the border pixel repeated, one threshold on the gradient magnitude, thinning to ridges.
Thinning does not depend on the threshold, so a scan over hundreds of thresholds computes
the gradients once: :class:`EdgeScan`.

A pixel's centre is its integer index here; circles that are found on an edge map are told from
the corner of the top-left pixel on (:func:`geofield.study.phase_code.find_circles`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from geofield.errors import ObstacleError, refuse_unknown

EdgeMethod = Literal["sobel", "prewitt", "roberts", "canny"]
EDGE_METHODS: tuple[EdgeMethod, ...] = get_args(EdgeMethod)

BoolImage = NDArray[np.bool_]

CANNY_SIGMA_PX = float(np.sqrt(2.0))
CANNY_LOW_SHARE = 0.4
"""The low threshold of Canny's hysteresis, as a share of the high one."""

_EIGHT = np.ones((3, 3), dtype=bool)


def as_unit(image: NDArray[np.generic]) -> NDArray[np.float64]:
    """Return a picture as float64, integers scaled so that their largest value is 1."""
    if image.ndim != 2:
        raise ObstacleError(f"An edge map needs one band (row, col), got shape {image.shape}.")
    grey: NDArray[np.float64] = image.astype(np.float64)
    if np.issubdtype(image.dtype, np.integer):
        grey /= float(np.iinfo(image.dtype.name).max)
    return grey


def gradient(
    image: NDArray[np.generic], method: EdgeMethod = "sobel"
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the gradient (gx, gy) of a picture, a unit step giving 0.5 (Canny: 1 / sqrt(2 pi)).

    Parameters
    ----------
    image : array, shape (rows, cols)
        Integers are scaled to 0..1.
    method : {"sobel", "prewitt", "roberts", "canny"}
        For Roberts the two components are the diagonal differences, anchored at the
        top-left pixel of each 2 x 2 block.

    Returns
    -------
    gx, gy : float64 arrays of the same shape
        Positive where the picture gets brighter to the right and downwards.
    """
    refuse_unknown(ObstacleError, "edge method", method, EDGE_METHODS)
    grey = as_unit(image)
    if method in ("sobel", "prewitt"):
        side = np.array([1.0, 2.0, 1.0]) / 4 if method == "sobel" else np.full(3, 1 / 3)
        step = np.array([-0.5, 0.0, 0.5])
        return separable(grey, side, step), separable(grey, step, side)
    if method == "roberts":
        padded = np.pad(grey, ((0, 1), (0, 1)), mode="edge")
        here, right = padded[:-1, :-1], padded[:-1, 1:]
        below, diagonal = padded[1:, :-1], padded[1:, 1:]
        return (diagonal - here) / 2, (below - right) / 2
    sigma = CANNY_SIGMA_PX
    gx = ndimage.gaussian_filter(grey, sigma, order=(0, 1), mode="nearest")
    gy = ndimage.gaussian_filter(grey, sigma, order=(1, 0), mode="nearest")
    return cast("NDArray[np.float64]", gx), cast("NDArray[np.float64]", gy)


def separable(
    grey: NDArray[np.float64],
    down: NDArray[np.float64],
    across: NDArray[np.float64],
    border: Literal["nearest", "constant"] = "nearest",
) -> NDArray[np.float64]:
    """Correlate with a column and a row, the border pixel repeated or followed by zeros."""
    rows = ndimage.correlate1d(grey, down, axis=0, mode=border)
    return cast("NDArray[np.float64]", ndimage.correlate1d(rows, across, axis=1, mode=border))


@dataclass(frozen=True, slots=True)
class EdgeScan:
    """The part of an edge map that does not depend on the threshold.

    Attributes
    ----------
    method : str
        One of :data:`EDGE_METHODS`.
    strength : float64 array, shape (rows, cols)
        Squared gradient magnitude; for Canny the magnitude divided by its maximum.
    ridge : bool array
        Pixels that survive thinning.
    """

    method: EdgeMethod
    strength: NDArray[np.float64]
    ridge: BoolImage

    @classmethod
    def of(cls, image: NDArray[np.generic], method: EdgeMethod) -> EdgeScan:
        """Compute gradients and thinning of a picture once."""
        gx, gy = gradient(image, method)
        if method == "canny":
            magnitude = np.hypot(gx, gy)
            top = float(magnitude.max(initial=0.0))
            if top > 0:
                magnitude = magnitude / top
            return cls(method, magnitude, _canny_ridge(gx, gy, magnitude))
        squared = gx * gx + gy * gy
        return cls(method, squared, _thinned(squared))

    @property
    def default_threshold(self) -> float:
        """The threshold used when none is given.

        Four (Roberts: six) times the mean squared magnitude; for Canny the high threshold at
        the 70 % point of a 64-bin histogram of the magnitude.
        """
        if self.strength.size == 0:
            return 0.0
        if self.method == "canny":
            counts, _ = np.histogram(self.strength, bins=64, range=(0.0, 1.0))
            reached = np.cumsum(counts) > 0.7 * self.strength.size
            return float((np.argmax(reached) + 1) / 64)
        scale = 6.0 if self.method == "roberts" else 4.0
        return float(np.sqrt(scale * self.strength.mean()))

    def at(self, threshold: float) -> BoolImage:
        """Return the edge map at one threshold.

        Parameters
        ----------
        threshold : float
            Sobel, Prewitt, Roberts: absolute, on the gradient magnitude of a 0..1 picture.
            Canny: the high threshold, relative to the picture's maximum.
        """
        if self.method != "canny":
            return self.ridge & (self.strength > threshold * threshold)
        weak = self.ridge & (self.strength > CANNY_LOW_SHARE * threshold)
        labels, count = ndimage.label(weak, structure=_EIGHT)
        strong = np.zeros(count + 1, dtype=bool)
        strong[labels[weak & (self.strength > threshold)]] = True
        strong[0] = False
        return cast("BoolImage", strong[labels])


def _thinned(squared: NDArray[np.float64]) -> BoolImage:
    """Keep pixels above both horizontal or both vertical neighbours (outside counts as 0)."""
    p = np.pad(squared, 1)
    here = p[1:-1, 1:-1]
    horizontal = (here > p[1:-1, :-2]) & (here > p[1:-1, 2:])
    vertical = (here > p[:-2, 1:-1]) & (here > p[2:, 1:-1])
    return horizontal | vertical


def _canny_ridge(
    gx: NDArray[np.float64], gy: NDArray[np.float64], magnitude: NDArray[np.float64]
) -> BoolImage:
    """Non-maximum suppression along the gradient, neighbours interpolated linearly."""
    p = np.pad(magnitude, 1)
    rows, cols = magnitude.shape

    def shifted(dy: int, dx: int) -> NDArray[np.float64]:
        return p[1 + dy : 1 + dy + rows, 1 + dx : 1 + dx + cols]

    ax, ay = np.abs(gx), np.abs(gy)
    steep = ay > ax
    long, short = np.maximum(ax, ay), np.minimum(ax, ay)
    share = np.divide(short, long, out=np.zeros_like(long), where=long > 0)
    same_sign = (gx >= 0) == (gy >= 0)

    # The neighbour ahead lies between an axial and a diagonal pixel; behind is its mirror.
    ahead_axial = np.where(steep, shifted(1, 0), shifted(0, 1))
    behind_axial = np.where(steep, shifted(-1, 0), shifted(0, -1))
    ahead_diagonal = np.where(
        same_sign, shifted(1, 1), np.where(steep, shifted(1, -1), shifted(-1, 1))
    )
    behind_diagonal = np.where(
        same_sign, shifted(-1, -1), np.where(steep, shifted(-1, 1), shifted(1, -1))
    )
    ahead = ahead_axial + share * (ahead_diagonal - ahead_axial)
    behind = behind_axial + share * (behind_diagonal - behind_axial)
    ridge = (magnitude > ahead) & (magnitude >= behind) & (magnitude > 0)
    ridge[[0, -1], :] = False
    ridge[:, [0, -1]] = False
    return cast("BoolImage", ridge)
