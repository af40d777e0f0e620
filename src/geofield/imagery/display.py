"""The picture as tiles in the plan's metric CRS.

A north-up picture in that CRS is cut as it is, without resampling; any other is reprojected
tile by tile. Coarse levels come from the file's own overviews, so that a picture of any size
needs the memory of one tile.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from affine import Affine
from numpy.typing import NDArray
from PIL import Image
from pyproj import CRS
from rasterio.enums import Resampling
from rasterio.transform import from_bounds
from rasterio.warp import reproject, transform_bounds

from geofield.errors import ImageryError
from geofield.grid import Grid
from geofield.imagery.gdal import to_rasterio
from geofield.imagery.pictures import open_reader
from geofield.imagery.reader import SceneReader
from geofield.model.scene import Scene

TILE_PX = 512
Bounds = tuple[float, float, float, float]
_Part = tuple[NDArray[np.uint8], Sequence[str], NDArray[np.bool_]]
Show = Literal["colour", "infrared"]


@dataclass(frozen=True)
class TiledPicture:
    """A picture and the levels in which it is shown."""

    reader: SceneReader
    #: Of the tiles: the plan's metric CRS.
    crs: CRS

    @classmethod
    def open(cls, path: Path, crs: CRS, point: tuple[float, float] | None = None) -> TiledPicture:
        """Look at a picture without reading it.

        Of a folder with pictures, or a list of some, those around the `point` (latitude and
        longitude) count.
        """
        lat, lon = point or (None, None)
        return cls(open_reader(str(path), lat=lat, lon=lon), crs)

    @cached_property
    def direct(self) -> bool:
        """Whether tiles are cut from the picture without resampling."""
        return _direct(self.reader.grid, self.crs)

    @cached_property
    def bounds(self) -> Bounds:
        """Left, bottom, right, top in the tiles' CRS, metres."""
        return _bounds(self.reader.grid, self.crs)

    @cached_property
    def resolutions_m(self) -> list[float]:
        """Metres of the CRS per pixel, coarsest first; the last is the picture's own."""
        own = (
            float(self.reader.grid.transform.a)
            if self.direct
            else self.reader.grid.ground_resolution_m
        )
        left, bottom, right, top = self.bounds
        longest = max(right - left, top - bottom) / own
        levels = max(0, math.ceil(math.log2(longest / TILE_PX)))
        return [own * 2.0**level for level in range(levels, -1, -1)]

    @cached_property
    def _limits(self) -> dict[str, tuple[float, float] | None]:
        """File values that become 0 and 255 in every tile: those of the whole picture."""
        whole = self.reader.read(shape_px=self._reduced_px(1024))
        return {"scaling": whole.scaling, "nir_scaling": whole.nir_scaling}

    def _read(self, window: tuple[int, int, int, int] | None, shape_px: tuple[int, int]) -> Scene:
        return self.reader.read(window, shape_px=shape_px, **self._limits)

    @property
    def has_infrared(self) -> bool:
        """Whether the picture has a near infrared band."""
        return "nir" in self.reader.roles.roles

    def has_data(self, bounds: Bounds) -> bool:
        """Whether the picture shows anything at a place of the tiles' CRS."""
        left, bottom, right, top = bounds
        window = self._window((left, top), max(right - left, top - bottom))
        if window is None:
            return False
        shape = (min(window[3], TILE_PX), min(window[2], TILE_PX))
        return bool(self.reader.read(window, shape_px=shape).valid.any())

    def tile(self, level: int, column: int, row: int, show: Show) -> tuple[bytes, str]:
        """One tile as an image file, and its media type; an error where there is none."""
        if not 0 <= level < len(self.resolutions_m):
            raise ImageryError(f"The picture has no level {level}.")
        size_m = self.resolutions_m[level] * TILE_PX
        left, bottom, right, top = self.bounds
        if not (0 <= column < (right - left) / size_m and 0 <= row < (top - bottom) / size_m):
            raise ImageryError(f"The picture has no tile {column}, {row} at level {level}.")
        corner = (left + column * size_m, top - row * size_m)
        bands, roles, valid = (
            self._cut(level, column, row)
            if self.direct
            else self._warped(corner, self.resolutions_m[level])
        )
        return _encoded(_shown(bands, roles, show), valid)

    def reduced(self, long_side_px: int) -> Scene:
        """All of the picture with at most that many pixels on its longer side."""
        return self._read(None, self._reduced_px(long_side_px))

    def _reduced_px(self, long_side_px: int) -> tuple[int, int]:
        shape = self.reader.grid.shape
        coarse = max(1.0, max(shape) / long_side_px)
        return max(1, int(shape[0] / coarse)), max(1, int(shape[1] / coarse))

    def _cut(self, level: int, column: int, row: int) -> _Part:
        step = 2 ** (len(self.resolutions_m) - 1 - level)
        grid = self.reader.grid
        c0, r0 = column * TILE_PX * step, row * TILE_PX * step
        width = min(TILE_PX * step, grid.width_px - c0)
        height = min(TILE_PX * step, grid.height_px - r0)
        shape = (max(1, round(height / step)), max(1, round(width / step)))
        part = self._read((c0, r0, width, height), shape)
        return np.stack([_padded(band) for band in part.bands]), part.roles, _padded(part.valid)

    def _warped(self, corner: tuple[float, float], resolution_m: float) -> _Part:
        target = Affine(resolution_m, 0, corner[0], 0, -resolution_m, corner[1])
        size_m = TILE_PX * resolution_m
        window = self._window(corner, size_m)
        if window is None:
            nothing = np.zeros((1, TILE_PX, TILE_PX), np.uint8)
            return nothing, ("grey",), nothing[0] > 0
        step = max(1.0, resolution_m / self.reader.grid.ground_resolution_m)
        shape = (max(1, round(window[3] / step)), max(1, round(window[2] / step)))
        part = self._read(window, shape)
        bands, valid = _reprojected(part, target, (TILE_PX, TILE_PX), self.crs)
        return bands, part.roles, valid

    def _window(
        self, corner: tuple[float, float], size_m: float
    ) -> tuple[int, int, int, int] | None:
        """The part of the picture below a tile, with a margin for the interpolation."""
        grid = self.reader.grid
        along = np.linspace(0, size_m, 9)
        xx, yy = np.meshgrid(corner[0] + along, corner[1] - along)
        x, y = grid.from_crs(xx.ravel(), yy.ravel(), self.crs)
        margin = 2
        c0, r0 = max(0, int(np.min(x)) - margin), max(0, int(np.min(y)) - margin)
        c1 = min(grid.width_px, int(np.max(x)) + margin)
        r1 = min(grid.height_px, int(np.max(y)) + margin)
        return None if c1 <= c0 or r1 <= r0 else (c0, r0, c1 - c0, r1 - r0)


def shown_scene(scene: Scene, crs: CRS, long_side_px: int) -> tuple[bytes, str, Bounds]:
    """A scene as an image file in a metric CRS, its media type, and where its edges lie."""
    pixels, bounds = shown_pixels(scene, crs, long_side_px)
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "WEBP", quality=85, method=2)
    return buffer.getvalue(), "image/webp", bounds


def shown_pixels(scene: Scene, crs: CRS, long_side_px: int) -> tuple[NDArray[np.uint8], Bounds]:
    """A scene's red, green, blue and opacity (rows, columns, 4) in a metric CRS, north up.

    With it comes where the edges lie. A scene of fewer pixels than `long_side_px` keeps its own.
    """
    bounds = left, bottom, right, top = _bounds(scene.grid, crs)
    longest = max(scene.grid.shape)
    size = min(longest, long_side_px) / max(right - left, top - bottom)
    shape = (max(1, round((top - bottom) * size)), max(1, round((right - left) * size)))
    if _direct(scene.grid, crs) and shape == scene.grid.shape:
        bands, valid = scene.bands, scene.valid
    else:
        target = from_bounds(left, bottom, right, top, shape[1], shape[0])
        bands, valid = _reprojected(scene, target, shape, crs)
    alpha = valid.astype(np.uint8)[..., None] * np.uint8(255)
    return np.concatenate([_shown(bands, scene.roles, "colour"), alpha], axis=-1), bounds


def _direct(grid: Grid, crs: CRS) -> bool:
    """Whether a grid is north-up with square pixels in a CRS."""
    t = grid.transform
    return bool(t.b == 0 and t.d == 0 and 0 < t.a == -t.e and grid.crs == crs)


def _bounds(grid: Grid, crs: CRS) -> Bounds:
    """The extent of a grid in a CRS; a warped one is covered whole."""
    x, y = grid.to_native([0, grid.width_px, grid.width_px, 0], [0, 0, *[grid.height_px] * 2])
    own = (float(np.min(x)), float(np.min(y)), float(np.max(x)), float(np.max(y)))
    if grid.crs == crs:
        return own
    left, bottom, right, top = transform_bounds(to_rasterio(grid.crs), to_rasterio(crs), *own)
    return float(left), float(bottom), float(right), float(top)


def _reprojected(
    part: Scene, target: Affine, shape: tuple[int, int], crs: CRS
) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """A scene's bands on another grid, and where they hold data."""
    source = np.concatenate([part.bands, part.valid[None].astype(np.uint8) * 255])
    made = np.zeros((len(source), *shape), np.uint8)
    reproject(
        source,
        made,
        src_transform=part.grid.transform,
        src_crs=to_rasterio(part.grid.crs),
        dst_transform=target,
        dst_crs=to_rasterio(crs),
        resampling=Resampling.bilinear,
    )
    return made[:-1], made[-1] > 127


def _shown(bands: NDArray[np.uint8], roles: Sequence[str], show: Show) -> NDArray[np.uint8]:
    """Three bands (rows, columns, 3): colour, or near infrared shown as red."""
    by_name = dict(zip(roles, bands, strict=True))
    grey = by_name.get("grey", bands[0])
    colour = [by_name.get(name, grey) for name in ("red", "green", "blue")]
    if show == "infrared" and "nir" in by_name:
        colour = [by_name["nir"], colour[0], colour[1]]
    return np.stack(colour, axis=-1)


def _padded(band: NDArray[Any]) -> NDArray[Any]:
    """A band with the size of a tile; the picture ends where it ends."""
    rows, columns = band.shape
    return np.pad(band, ((0, TILE_PX - rows), (0, TILE_PX - columns)))


def _encoded(pixels: NDArray[np.uint8], valid: NDArray[np.bool_]) -> tuple[bytes, str]:
    buffer = io.BytesIO()
    if valid.all():
        Image.fromarray(pixels).save(buffer, "JPEG", quality=92, subsampling=0)
        return buffer.getvalue(), "image/jpeg"
    alpha = valid.astype(np.uint8)[..., None] * np.uint8(255)
    Image.fromarray(np.concatenate([pixels, alpha], axis=-1)).save(buffer, "PNG", compress_level=1)
    return buffer.getvalue(), "image/png"
