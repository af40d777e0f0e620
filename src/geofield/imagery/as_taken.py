"""A view of a picture that says of itself what it is taken for."""

from __future__ import annotations

import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import rasterio
import rasterio.shutil
from rasterio.enums import ColorInterp


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
    view = f"/vsimem/{uuid.uuid4().hex}.vrt"
    rasterio.shutil.copy(dataset, view, driver="VRT")
    try:
        with rasterio.open(view, "r+") as plain:
            if tagged:
                plain.colorinterp = [
                    ColorInterp.undefined if each is ColorInterp.alpha else each
                    for each in plain.colorinterp
                ]
            if filled:
                plain.nodata = fill
        with rasterio.open(view) as plain:
            yield plain
    finally:
        rasterio.shutil.delete(view)
