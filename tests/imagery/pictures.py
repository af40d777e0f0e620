"""A zoo of pictures: every unusual kind of raster, of one synthetic piece of ground."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import rasterio
from affine import Affine
from rasterio.enums import ColorInterp

#: A place in UTM zone 36N.
EAST, NORTH, RESOLUTION = 548_000.0, 3_881_000.0, 0.5
UTM: Any = "EPSG:32636"


def ground(rows: int = 96, columns: int = 128, bands: int = 3) -> np.ndarray:
    """A smooth picture (bands, rows, columns), uint8, without the values 0 and 255."""
    y, x = np.mgrid[0:rows, 0:columns]
    layers = [
        120 + 60 * np.sin((x + 17 * b) / 9) * np.cos((y - 11 * b) / 7) + 15 * b
        for b in range(bands)
    ]
    return np.clip(np.stack(layers), 1, 254).astype(np.uint8)


def write(
    path: Path,
    values: np.ndarray,
    *,
    crs: Any = UTM,
    transform: Affine | None = None,
    interpretation: list[ColorInterp] | None = None,
    mask: np.ndarray | None = None,
    descriptions: list[str] | None = None,
    **profile: Any,
) -> str:
    """A GeoTIFF of an array (bands, rows, columns)."""
    transform = transform or Affine(RESOLUTION, 0, EAST, 0, -RESOLUTION, NORTH)
    with (
        rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True),
        rasterio.open(
            path,
            "w",
            driver="GTiff",
            width=values.shape[2],
            height=values.shape[1],
            count=values.shape[0],
            dtype=values.dtype,
            crs=crs,
            transform=transform,
            **profile,
        ) as file,
    ):
        if interpretation:
            file.colorinterp = interpretation
        file.write(values)
        for i, text in enumerate(descriptions or []):
            file.set_band_description(i + 1, text)
        if mask is not None:
            file.write_mask(mask)
    return str(path)
