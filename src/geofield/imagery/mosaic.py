"""From rows of tiles to a Cloud Optimized GeoTIFF, never holding more than a few rows.

The rows go into a plain tiled GeoTIFF beside the target; GDAL then makes the COG from it
block by block. Both disappear when anything fails.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import rasterio
from numpy.typing import NDArray
from rasterio.enums import Resampling
from rasterio.windows import Window

from geofield.imagery.gdal import gdal_env, to_rasterio
from geofield.imagery.tiling import Block
from geofield.imagery.write import write_cog

#: GDAL's block cache, megabytes.
_CACHE_MB = 96

Rows = Iterator[tuple[int, NDArray[np.uint8], NDArray[np.bool_] | None]]


def stage_rows(path: Path, block: Block, rows: Rows) -> int:
    """Write every row, cut to the wanted window, into a plain GeoTIFF.

    A mask is begun with the first pixel that is missing: most mosaics need none.

    Returns
    -------
    int
        How many pixels no tile has.
    """
    column, first, width, height = block.window
    tile_height = block.level.tile_px[1]
    missing_px = 0
    with (
        gdal_env(GDAL_CACHEMAX=_CACHE_MB, GDAL_TIFF_INTERNAL_MASK=True),
        rasterio.open(
            path,
            "w",
            driver="GTiff",
            width=width,
            height=height,
            count=3,
            dtype="uint8",
            crs=to_rasterio(block.crs),
            transform=block.grid.transform,
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
            there = np.ones(part.shape[:2], bool) if valid is None else valid[inner]
            if valid is not None:
                part = np.where(there[..., None], part, np.uint8(0))
            file.write(np.moveaxis(part, -1, 0), window=window)
            absent_px = int(np.count_nonzero(~there))
            if absent_px and not missing_px:
                file.write_mask(True)  # hides nothing of the rows before
            missing_px += absent_px
            if missing_px:
                file.write_mask(there, window=window)
    return missing_px


def stage_to_cog(staged: Path, target: Path, tags: Mapping[str, str]) -> None:
    """Make the COG, with overviews, mask and tags."""
    with gdal_env(GDAL_CACHEMAX=_CACHE_MB, GDAL_TIFF_INTERNAL_MASK=True):
        with rasterio.open(staged, "r+") as file:
            file.update_tags(**tags)
            # Seven times cheaper here, from plain pixels, than in the COG driver.
            # Until the coarsest one fits one block.
            factors = [2**n for n in range(1, 32) if max(file.shape) > 256 * 2**n]
            file.build_overviews(factors, Resampling.average)
        write_cog(str(staged), target, NUM_THREADS="ALL_CPUS")
