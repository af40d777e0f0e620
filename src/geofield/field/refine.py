"""Refine: carry a coarse mask to finer pixels, its border onto the strongest edge nearby."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from geofield.field.evidence import gradient

BoolArray = NDArray[np.bool_]

#: Smoothing of the refined mask's border, pixels.
_SMOOTH_PX = 1.5


def enlarge(mask: BoolArray, factor: int, shape: tuple[int, int]) -> BoolArray:
    """A mask repeated ``factor`` times each way, cut to a shape."""
    if factor == 1:
        return mask
    large = np.repeat(np.repeat(mask, factor, axis=0), factor, axis=1)
    return np.ascontiguousarray(large[: shape[0], : shape[1]])


def snap(mask: BoolArray, stack: NDArray[np.float32], reach_px: float) -> BoolArray:
    """Move a mask's border to the strongest gradient within a band around it.

    Parameters
    ----------
    mask : bool array (rows, columns)
    stack : float32 array (channels, rows, columns)
        Whitened channels of the same pixels.
    reach_px : float
        Half the band's width, pixels.
    """
    from skimage.segmentation import watershed

    if mask.all() or not mask.any():
        return mask
    rows, columns = (
        slice(*_range(np.any(mask, axis=a, keepdims=True).ravel(), reach_px)) for a in (1, 0)
    )
    part = mask[rows, columns]
    inner = ndimage.distance_transform_edt(np.pad(part, 1, mode="edge"))[1:-1, 1:-1] > reach_px
    outer = ndimage.distance_transform_edt(~part) > reach_px
    if not inner.any() or not outer.any():
        return mask
    markers = np.where(inner, 1, np.where(outer, 2, 0)).astype(np.int32)
    flooded = watershed(gradient(stack[:, rows, columns]), markers) == 1
    smooth = ndimage.gaussian_filter(flooded.astype(np.float32), _SMOOTH_PX, mode="nearest") > 0.5
    result = np.zeros_like(mask)
    result[rows, columns] = smooth
    return result


def _range(used: BoolArray, margin: float) -> tuple[int, int]:
    at = np.flatnonzero(used)
    extra = int(margin) + 8
    return max(int(at[0]) - extra, 0), min(int(at[-1]) + 1 + extra, len(used))
