"""A view of a picture that says of itself what it is taken for."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import rasterio
import rasterio.shutil
from rasterio.enums import ColorInterp
from rasterio.io import MemoryFile
from rasterio.windows import Window

_MASK_BAND = (
    '<MaskBand><VRTRasterBand dataType="Byte"><SimpleSource><SourceFilename>{}</SourceFilename>'
    "<SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></MaskBand></VRTDataset>"
)


@contextmanager
def as_taken(dataset: Any, fill: float | None, *, alpha: bool) -> Iterator[Any]:
    """The dataset; where it says other than what it is taken for, a view that says that.

    GDAL's warper takes every band that is tagged as alpha for a mask, near infrared too; and
    what is read coarser would mix the ground with a fill that no tag names. `alpha` is whether one
    is taken for a mask, `fill` the value of no data.
    """
    tagged = ColorInterp.alpha in dataset.colorinterp and not alpha
    filled = fill is not None and not np.isnan(fill) and dataset.nodata != fill
    if not (tagged or filled):
        yield dataset
        return
    with MemoryFile(ext=".vrt") as view:
        rasterio.shutil.copy(dataset, view.name, driver="VRT")
        with rasterio.open(view.name, "r+") as plain:
            if tagged:
                plain.colorinterp = [
                    ColorInterp.undefined if each is ColorInterp.alpha else each
                    for each in plain.colorinterp
                ]
            if filled:
                plain.nodata = fill
        with rasterio.open(view.name) as plain:
            yield plain


@contextmanager
def masked_by_values(dataset: Any, bands: Sequence[int], window: Window) -> Iterator[Any]:
    """A view of a picture with a mask for what its bands (0-based) say of no data, in a window.

    GDAL's warper knows one value of no data for all bands. Where they name several, as those of a
    VRT may, nothing is seen where each holds its own.
    """
    values = [dataset.nodatavals[band] for band in bands]
    if len({each for each in values if each is not None and not np.isnan(each)}) < 2:
        yield dataset
        return
    shown = dataset.read([band + 1 for band in bands], window=window)
    nothing = [
        np.ones(band.shape, bool) if each is None else band == each
        for band, each in zip(shown, values, strict=True)
    ]
    height, width = dataset.shape
    profile = {"driver": "GTiff", "width": width, "height": height, "count": 1, "dtype": "uint8"}
    profile["transform"] = dataset.transform
    with MemoryFile(ext=".vrt") as view, MemoryFile() as there:
        with there.open(tiled=True, SPARSE_OK=True, **profile) as mask:
            mask.write(np.where(np.all(nothing, axis=0), 0, 255).astype(np.uint8), 1, window=window)
        rasterio.shutil.copy(dataset, view.name, driver="VRT")
        text = re.sub("<NoDataValue>.*?</NoDataValue>", "", view.read().decode())
        text = text.replace("</VRTDataset>", _MASK_BAND.format(there.name))
        with rasterio.open(text) as plain:
            yield plain
