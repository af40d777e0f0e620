"""The working grid: every picture at about the resolution the verifier was fitted at."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from geofield.model.scene import Scene
from geofield.obstacles.channels import Image, shrink

_AS_IT_IS = (0.87, 1.15)
"""Between these factors a picture is used as it is."""


@dataclass(frozen=True, slots=True)
class WorkingPicture:
    """A scene's bands on the working grid.

    Attributes
    ----------
    luma, nir : float32 arrays (rows, cols), 0..255
    rgb : three of them, or None
    region : bool array
        Where a centre may lie.
    factor : float
        Pixels of the scene per working pixel.
    """

    luma: Image
    rgb: tuple[Image, Image, Image] | None
    nir: Image | None
    region: NDArray[np.bool_]
    factor: float

    def to_scene_px(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Working pixel-index coordinates to the scene's (origin at the pixel's corner)."""
        return (position + 0.5) * self.factor


def working_factor(resolution_m: float, working_resolution_m: float) -> float:
    """Return the scene's pixels per working pixel, 1 where the picture is near enough."""
    factor = working_resolution_m / resolution_m
    return 1.0 if _AS_IT_IS[0] <= factor <= _AS_IT_IS[1] else factor


def working_picture(scene: Scene, region: NDArray[np.bool_], factor: float) -> WorkingPicture:
    """Bring a scene's bands to the working grid, missing pixels filled with the nearest."""
    nearest = None
    if not scene.valid.all() and scene.valid.any():
        nearest = ndimage.distance_transform_edt(
            ~scene.valid, return_distances=False, return_indices=True
        )

    def band(values: NDArray[np.generic]) -> Image:
        picture = values.astype(np.float32)
        if nearest is not None:
            picture = picture[tuple(nearest)]
        return resample(picture, factor)

    rgb = None
    if scene.is_colour:
        red, green, blue = (
            band(scene.bands[scene.roles.index(r)]) for r in ("red", "green", "blue")
        )
        rgb = (red, green, blue)
    nir = band(scene.nir) if scene.nir is not None and scene.is_colour else None
    luma = band(scene.grey)
    if factor == 1.0:
        where = region
    else:
        rows, cols = (
            _positions(n, m, factor) for n, m in zip(region.shape, luma.shape, strict=True)
        )
        where = region[np.rint(rows).astype(np.intp)][:, np.rint(cols).astype(np.intp)]
    return WorkingPicture(luma, rgb, nir, where, factor)


def resample(image: Image, factor: float) -> Image:
    """Return a picture with pixels ``factor`` times as large, its area averaged or interpolated."""
    if factor == 1.0:
        return image
    whole = round(factor)
    if factor > 1 and abs(factor - whole) < 1e-6:
        return shrink(image, whole)
    if factor > 1:
        # A box of that width has this variance; the picture's own pixel is one already.
        sigma = float(np.sqrt((factor**2 - 1) / 12))
        image = cast("Image", ndimage.gaussian_filter(image, sigma, mode="nearest", truncate=3.0))
    shape = [max(int(np.ceil(n / factor)), 1) for n in image.shape]
    rows, cols = (_positions(n, m, factor) for n, m in zip(image.shape, shape, strict=True))
    r0, c0 = np.floor(rows).astype(np.intp), np.floor(cols).astype(np.intp)
    r1, c1 = np.minimum(r0 + 1, image.shape[0] - 1), np.minimum(c0 + 1, image.shape[1] - 1)
    fr, fc = (rows - r0).astype(np.float32)[:, None], (cols - c0).astype(np.float32)[None, :]
    tall = image[r0] * (1 - fr) + image[r1] * fr
    return cast("Image", tall[:, c0] * (1 - fc) + tall[:, c1] * fc)


def _positions(size: int, count: int, factor: float) -> NDArray[np.float64]:
    """Centres of the working pixels in pixel-index coordinates of the scene."""
    return np.clip((np.arange(count) + 0.5) * factor - 0.5, 0, size - 1)
