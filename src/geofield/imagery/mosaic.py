"""From rows of tiles to a Cloud Optimized GeoTIFF, never holding more than a few rows.

The rows go into a plain tiled GeoTIFF beside the target; GDAL then makes the COG from it
block by block. Both disappear when anything fails.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
import rasterio.shutil
from numpy.typing import NDArray
from rasterio.enums import Resampling
from rasterio.windows import Window

from geofield.grid import Grid
from geofield.imagery.gdal import gdal_env, to_rasterio
from geofield.imagery.tiling import Block
from geofield.imagery.write import COG_OPTIONS

#: GDAL's block cache, megabytes.
_CACHE_MB = 96

Rows = Iterator[tuple[int, NDArray[np.uint8], NDArray[np.bool_] | None]]


class Staging:
    """The plain GeoTIFF that rows are put into."""

    def __init__(self, path: Path, block: Block) -> None:
        self.path = path
        self.block = block
        self.grid: Grid = block.grid
        #: Pixels that no tile has.
        self.missing_px = 0
        self._masked = False

    def fill(self, rows: Rows) -> None:
        """Write every row, cut to the wanted window.

        A mask is begun with the first pixel that is missing: most mosaics need none.
        """
        column, first, width, height = self.block.window
        tile_height = self.block.level.tile_px[1]
        with (
            gdal_env(GDAL_CACHEMAX=_CACHE_MB, GDAL_TIFF_INTERNAL_MASK=True),
            rasterio.open(
                self.path,
                "w",
                driver="GTiff",
                width=width,
                height=height,
                count=3,
                dtype="uint8",
                crs=to_rasterio(self.grid.crs),
                transform=self.grid.transform,
                photometric="RGB",
                interleave="pixel",
                tiled=True,
                blockxsize=512,
                blockysize=512,
                BIGTIFF="IF_SAFER",
                SPARSE_OK=True,
            ) as file,
        ):
            for row, strip, valid in rows:
                top = row * tile_height - first
                start, stop = max(top, 0), min(top + tile_height, height)
                if stop <= start:
                    continue
                inner = np.s_[start - top : stop - top, column : column + width]
                window = Window(0, start, width, stop - start)
                part = strip[inner]
                if valid is not None:
                    part = np.where(valid[inner][..., None], part, np.uint8(0))
                file.write(np.moveaxis(part, -1, 0), window=window)
                self._mask(file, window, None if valid is None else valid[inner])

    def _mask(self, file: Any, window: Window, valid: NDArray[np.bool_] | None) -> None:
        if valid is not None and valid.all():
            valid = None
        if valid is not None:
            self.missing_px += valid.size - int(np.count_nonzero(valid))
        if valid is not None and not self._masked:
            self._masked = True
            width, top = self.grid.width_px, int(window.row_off)
            for start in range(0, top, 256):
                rows = min(256, top - start)
                above = Window(0, start, width, rows)
                file.write_mask(np.full((rows, width), 255, np.uint8), window=above)
        if self._masked:
            shape = (int(window.height), int(window.width))
            mask = np.full(shape, 255, np.uint8) if valid is None else valid.astype(np.uint8) * 255
            file.write_mask(mask, window=window)


def stage_to_cog(staged: Path, target: Path, tags: Mapping[str, str]) -> None:
    """Make the COG, with overviews, mask and tags."""
    with gdal_env(GDAL_CACHEMAX=_CACHE_MB, GDAL_TIFF_INTERNAL_MASK=True):
        with rasterio.open(staged, "r+") as file:
            file.update_tags(**tags)
            # Seven times cheaper here, from plain pixels, than in the COG driver.
            file.build_overviews(_overviews(max(file.shape)), Resampling.average)
        rasterio.shutil.copy(str(staged), str(target), **COG_OPTIONS, NUM_THREADS="ALL_CPUS")


def _overviews(side_px: int) -> list[int]:
    """Factors of two until the coarsest overview fits one block."""
    return [2**n for n in range(1, 32) if side_px > 256 * 2**n]
