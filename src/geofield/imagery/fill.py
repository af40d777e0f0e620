"""The value that a picture's ground outside the picture was filled with, where no tag says so.

Such a fill lies far from all values of the ground. Taken for ground it becomes one end of the
scaling, and what grows on the field one shade of grey. Pictures of 8 bits are not scaled: their
black or white stays as it is, and a large piece of it is told.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rasterio.windows import Window

from geofield.imagery.facts import opaque, spread

#: What programs fill with, besides the ends of the file's type.
_USUAL = (0, -9999, -10000, -32767, -32768, -99999)
#: So large a part of the picture, at least, can shift the ends of the scaling.
_LEAST_SHARE = 0.005
#: Next to the fill, within this share of the ground's spread, lie hardly any values of the ground.
_GAP_SHARE = 0.02
_MOST_NEAR = 0.05
#: The picture is looked at in so many small windows each way, or as an overview of this side.
_WINDOWS, _WINDOW_PX, _OVERVIEW_PX = 5, 128, 512

#: Shadows are not black, nor roofs at the picture's sides white, over all of a square of this side.
_BLANK_PX = 32


def blank_value(bands: NDArray[np.uint8], valid: NDArray[np.bool_]) -> int | None:
    """What a square of a picture of 8 bits that counts as ground holds alone: 0, 255 or neither.

    White ones count at the picture's sides: within it they are roofs and plastic sheets.
    """
    rows, columns = (side // _BLANK_PX for side in valid.shape)
    for value in (0, 255):
        same = valid & (bands == value).all(axis=0)
        whole = same[: rows * _BLANK_PX, : columns * _BLANK_PX]
        squares = whole.reshape(rows, _BLANK_PX, columns, _BLANK_PX).all(axis=(1, 3))
        if value:
            squares[1:-1, 1:-1] = False
        if squares.any():
            return value
    return None


def undeclared_fill(
    dataset: Any,
    bands: Sequence[int],
    *,
    alpha: int | None = None,
    top: float | None = None,
) -> float | None:
    """The value that bands (0-based) share where a picture of more than 8 bits shows nothing.

    It lies at the picture's frame, or is negative. It is decided from all of the picture, for each
    of its windows alike; what its `alpha` band hides does not count. None where there is no such
    value, or the picture names its own. `top` is what an opaque pixel of alpha holds.
    """
    names = dataset.dtypes
    kind = np.result_type(*(names[band] for band in bands))
    said = dataset.nodata is not None and not np.isnan(dataset.nodata)
    if said or kind == np.uint8:
        return None
    limits = np.iinfo(kind) if kind.kind in "iu" else np.finfo(kind)
    values, at_frame = _looked_at(dataset, bands, alpha, top)
    same = np.all(values == values[:1], axis=0)
    for fill in (*_USUAL, limits.min, limits.max):
        if not limits.min <= fill <= limits.max:
            continue
        filled = same & (values[0] == kind.type(fill))
        # Deep shadow and a roof in the sun may be 0 or the type's end: they lie inside.
        frame = filled[at_frame].any() and filled.mean() > _LEAST_SHARE
        if frame or (fill < 0 and filled.any()):
            ground = values[:, ~filled & np.all(np.isfinite(values), axis=0)]
            if _is_far(float(fill), ground, int(filled.sum())):
                return float(fill)
    return None


def _is_far(fill: float, ground: NDArray[Any], count: int) -> bool:
    """Whether hardly any values of the ground lie next to a fill of so many pixels."""
    if not ground.size:
        return False
    low, high = (float(each) for each in np.percentile(ground, (0.5, 99.5)))
    if not high > low or low <= fill <= high:
        return False
    near = np.abs(ground.astype(np.float64) - fill) <= _GAP_SHARE * (high - low)
    return bool(np.count_nonzero(near) <= _MOST_NEAR * count * len(ground))


def _looked_at(
    dataset: Any, bands: Sequence[int], alpha: int | None, top: float | None
) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Values (bands, pixels) spread over a picture, and which lie at its frame."""
    size = dataset.shape
    overview = bool(dataset.overviews(1))
    most = _OVERVIEW_PX if overview else _WINDOW_PX
    rows, columns = min(size[0], most), min(size[1], most)
    windows = spread(size, most, _WINDOWS)
    if overview:
        windows, size = [Window(0, 0, size[1], size[0])], (rows, columns)

    def read(bands: Sequence[int]) -> NDArray[Any]:
        indexes, shape = [band + 1 for band in bands], (len(bands), rows, columns)
        parts = [dataset.read(indexes, window=each, out_shape=shape) for each in windows]
        return np.concatenate([each.reshape(len(bands), -1) for each in parts], axis=1)

    at_frame = np.concatenate([_frame(each, (rows, columns), size).ravel() for each in windows])
    values = read(bands)
    if alpha is not None and top is not None:
        shown = opaque(read([alpha])[0], top)
        values, at_frame = values[:, shown], at_frame[shown]
    return values, at_frame


def _frame(window: Window, shape: tuple[int, int], whole: tuple[int, int]) -> NDArray[np.bool_]:
    """The pixels (rows, columns) of a window that lie at the frame of the whole."""
    y, x = np.arange(shape[0]) + window.row_off, np.arange(shape[1]) + window.col_off
    rows, columns = (y == 0) | (y == whole[0] - 1), (x == 0) | (x == whole[1] - 1)
    return np.asarray(rows[:, None] | columns[None, :])
