"""What the picture says about trees: brightness, greenness, texture, and evidence from both.

All pictures here are float32 (rows, cols) on the working grid (about 0.6 m per pixel).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, cast

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Image = NDArray[np.float32]
Variant = Literal["nir", "rgb", "grey"]
VARIANTS: tuple[Variant, ...] = ("nir", "rgb", "grey")

_Z_LIMIT = 4.0
_MIN_MAD_DARK = 6.0
_MIN_MAD_GREEN = 4.0
_COARSE = 8


@dataclass(frozen=True, slots=True)
class Channels:
    """The pictures that candidates and features are taken from.

    Attributes
    ----------
    variant : {"nir", "rgb", "grey"}
        Which bands there were.
    maps : dict of str to float32 array
        ``luma`` (0..255), ``texture`` (local deviation of luma); with colour ``exg``
        (255 (2G - R - B) / (R + G + B + 30)), ``rg`` and ``gb`` (normalised differences);
        with near infrared ``ndvi`` (255 (N - R) / (N + R + 30)) and ``nir``.
    dark, green : float32 arrays
        Robust z-scores against the local background, clipped to +-4: darkness, and
        greenness by the best index there is (zero without colour).
    evidence : float32 array
        (dark + green) / sqrt 2; darkness alone without colour.
    mixture : float32 array or None
        What the best index divides by: how much each cover weighs in a mixed pixel.
    """

    variant: Variant
    maps: dict[str, Image]
    dark: Image
    green: Image
    evidence: Image
    mixture: Image | None = None

    @property
    def index(self) -> Image | None:
        """The best greenness index there is, None for a grey picture."""
        return self.maps.get("ndvi", self.maps.get("exg"))


def channels(
    luma: Image,
    rgb: tuple[Image, Image, Image] | None,
    nir: Image | None,
    *,
    window_px: float,
) -> Channels:
    """Compute the channels of a picture.

    Parameters
    ----------
    luma : float32 array, 0..255
    rgb : three float32 arrays, 0..255, or None
    nir : float32 array, 0..255, or None
        Only used together with ``rgb``.
    window_px : float
        Side of the window whose median is the background: about five of the largest radii.
    """
    maps: dict[str, Image] = {"luma": luma, "texture": _texture(luma)}
    dark = -background_score(luma, window_px, _MIN_MAD_DARK)
    if rgb is None:
        return Channels("grey", maps, dark, np.zeros_like(dark), dark)
    red, green_band, blue = rgb
    maps["exg"] = 255 * (2 * green_band - red - blue) / (red + green_band + blue + 30)
    maps["rg"] = 255 * (green_band - red) / (green_band + red + 30)
    maps["gb"] = 255 * (green_band - blue) / (green_band + blue + 30)
    variant: Variant = "rgb"
    if nir is not None:
        maps["ndvi"] = 255 * (nir - red) / (nir + red + 30)
        maps["nir"] = nir
        variant = "nir"
    green = background_score(maps["ndvi" if nir is not None else "exg"], window_px, _MIN_MAD_GREEN)
    evidence = (dark + green) / np.float32(np.sqrt(2.0))
    mixture = red + green_band + blue + 30 if nir is None else nir + red + 30
    return Channels(variant, maps, dark, green, evidence, mixture)


def background_score(image: Image, window_px: float, min_mad: float) -> Image:
    """Return (image - local median) / max(local deviation, min_mad), clipped to +-4.

    The medians run on a picture eight times coarser: the background has no detail to lose.
    Both are local, so that a part of a picture gives the same as the whole.
    """
    coarse = shrink(image, _COARSE)
    size = max(round(window_px / _COARSE) | 1, 3)
    background = enlarge(ndimage.median_filter(coarse, size=size), _COARSE, image.shape)
    difference = image - background
    spread = ndimage.median_filter(shrink(np.abs(difference), _COARSE), size=size)
    # The mean absolute deviation of a normal distribution is 0.8 of the standard one.
    spread = enlarge(1.25 * spread, _COARSE, image.shape)
    score = difference / np.maximum(spread, np.float32(min_mad))
    return np.clip(score, -_Z_LIMIT, _Z_LIMIT)


def shrink(image: Image, factor: int) -> Image:
    """Return block means, the last row and column repeated to fill the last blocks."""
    if factor == 1:
        return image
    if factor % 2 == 0 and factor > 2:
        return shrink(shrink(image, 2), factor // 2)
    rows, cols = image.shape
    pad = ((0, -rows % factor), (0, -cols % factor))
    padded = np.pad(image, pad, mode="edge") if any(p[1] for p in pad) else image
    # Strided sums are several times faster than a mean over reshaped blocks.
    tall = padded[::factor].copy()
    for i in range(1, factor):
        tall += padded[i::factor]
    total = tall[:, ::factor].copy()
    for i in range(1, factor):
        total += tall[:, i::factor]
    return total * np.float32(1 / factor**2)


def is_peak(image: Image) -> NDArray[np.bool_]:
    """Return which pixels are not below any of their eight neighbours."""
    padded = np.pad(image, 1, mode="edge")
    rows = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    around = np.maximum(np.maximum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:])
    return image >= around


def enlarge(image: Image, factor: int, shape: tuple[int, ...]) -> Image:
    """Return a shrunk picture at its old size, bilinear between block centres."""
    rows = _bilinear(image.shape[0], factor, shape[0])
    cols = _bilinear(image.shape[1], factor, shape[1])
    tall = image[rows[0]] * (1 - rows[2])[:, None] + image[rows[1]] * rows[2][:, None]
    return cast(
        "Image", tall[:, cols[0]] * (1 - cols[2])[None, :] + tall[:, cols[1]] * cols[2][None, :]
    )


def _bilinear(
    count: int, factor: int, size: int
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float32]]:
    position = np.clip((np.arange(size) + 0.5) / factor - 0.5, 0, count - 1)
    low = np.floor(position).astype(np.intp)
    high = np.minimum(low + 1, count - 1)
    return low, high, (position - low).astype(np.float32)


def gaussian(image: Image, sigma_px: float) -> Image:
    """Smooth by a Gaussian; wide ones on a coarser picture, at a fraction of the time."""
    factor = 1 if sigma_px < 2 else 2 if sigma_px < 5 else 4
    if factor == 1:
        return smoothed(image, sigma_px)
    # Block means have a variance of their own, (f^2 - 1) / 12 of a pixel squared.
    rest = np.sqrt(max(sigma_px**2 - (factor**2 - 1) / 6, 0.25)) / factor
    return enlarge(smoothed(shrink(image, factor), float(rest)), factor, image.shape)


def sample_gaussians(
    image: Image,
    sigmas_px: Sequence[float],
    rows: NDArray[np.intp],
    cols: NDArray[np.intp],
) -> list[NDArray[np.float32]]:
    """Return a picture smoothed at several widths, at some pixels only."""
    levels = {1: image}
    out: list[NDArray[np.float32]] = []
    for sigma in sigmas_px:
        factor = 1 if sigma < 1.2 else 2 if sigma < 4 else 4
        if factor == 1:
            out.append(smoothed(image, sigma)[rows, cols])
            continue
        if factor not in levels:
            half = levels.setdefault(2, shrink(image, 2))
            levels.setdefault(4, shrink(half, 2))
        rest = np.sqrt(max(sigma**2 - (factor**2 - 1) / 6, 0.25)) / factor
        coarse = smoothed(levels[factor], float(rest))
        y = np.clip((rows + 0.5) / factor - 0.5, 0, coarse.shape[0] - 1)
        x = np.clip((cols + 0.5) / factor - 0.5, 0, coarse.shape[1] - 1)
        out.append(bilinear(coarse, x, y))
    return out


_REMAP_WIDTH = 4096


def bilinear(image: Image, x: NDArray[np.floating], y: NDArray[np.floating]) -> NDArray[np.float32]:
    """Sample a picture between its pixels, positions beyond its border at the border."""
    if x.size == 0:
        return np.zeros(x.shape, dtype=np.float32)
    # OpenCV takes maps of limited height: the positions go in long rows.
    width = min(x.size, _REMAP_WIDTH)
    maps = np.zeros((2, -(-x.size // width) * width), dtype=np.float32)
    maps[0, : x.size], maps[1, : x.size] = x.ravel(), y.ravel()
    columns, rows = maps.reshape(2, -1, width)
    values = cv2.remap(image, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(values, dtype=np.float32).ravel()[: x.size].reshape(x.shape)


def smoothed(
    image: Image,
    sigma_px: float,
    truncate: float = 3.0,
    border: Literal["nearest", "zero"] = "nearest",
) -> Image:
    """Smooth by a Gaussian, cut off at so many sigma, the border repeated or followed by zeros."""
    reach = int(truncate * sigma_px + 0.5)
    window = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma_px) ** 2)
    window = (window / window.sum()).astype(np.float32)
    kind = cv2.BORDER_REPLICATE if border == "nearest" else cv2.BORDER_CONSTANT
    return np.asarray(cv2.sepFilter2D(image, -1, window, window, borderType=kind), np.float32)


def box_mean(image: Image, size_px: int) -> Image:
    """Return the mean over a square around each pixel, the border repeated."""
    mean = cv2.blur(image, (size_px, size_px), borderType=cv2.BORDER_REPLICATE)
    return np.asarray(mean, dtype=np.float32)


def _texture(luma: Image) -> Image:
    """Return the standard deviation of luma in 5 x 5 pixels."""
    mean = box_mean(luma, 5)
    return cast("Image", np.sqrt(np.maximum(box_mean(luma * luma, 5) - mean * mean, 0)))
