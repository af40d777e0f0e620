"""Plausible: whether what was outlined looks like a field at all.

Limits were read off 126 outlines drawn by eye on 0.6 m imagery, lots, meadows and deserts among
them: nine in ten are smoother, all are wider, and all but two in a hundred reflect more near
infrared.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from geofield.field.evidence import block_mean
from geofield.model import Scene

#: Pixels a side of the picture in which the look is judged.
_LOOK_PX = 400
#: Side of the square in which roughness is measured, pixels.
_ROUGH_PX = 7
#: Grey levels; what speaks against a field that is rougher, as a part of certainty.
_ROUGH, _ROUGH_COSTS = 13.0, 0.3
#: The same of the vegetation index.
_LIFELESS, _LIFELESS_COSTS = -0.13, 0.55
#: Half the width of the narrowest field, metres.
_NARROW_M, _NARROW_COSTS = 7.0, 0.55


def doubts(
    scene: Scene, mask: NDArray[np.bool_]
) -> tuple[tuple[tuple[str, float], ...], tuple[tuple[str, float], ...]]:
    """What speaks against a field, in words and with what it costs, and the figures behind it.

    Parameters
    ----------
    scene : Scene
    mask : bool array (rows, columns)
        The outlined pixels, holes filled.
    """
    factor = max(1, math.ceil(max(scene.grid.shape) / _LOOK_PX))
    inside = block_mean(mask, factor) > 0.5
    if not inside.any():
        return (), ()
    grey = block_mean(scene.grey, factor).astype(np.float64)
    mean = ndimage.uniform_filter(grey, _ROUGH_PX)
    spread = ndimage.uniform_filter(grey * grey, _ROUGH_PX) - mean * mean
    roughness = float(np.sqrt(np.median(np.maximum(spread[inside], 0))))
    padded = np.pad(inside, 1, mode="edge")
    depth_px = float(ndimage.distance_transform_edt(padded).max()) if not padded.all() else math.inf
    half_width_m = depth_px * factor * scene.grid.ground_resolution_m
    reasons = []
    figures = [("roughness", roughness)]
    if roughness > _ROUGH:
        reasons.append(("it is rough (shrubs, a wood, buildings?)", _ROUGH_COSTS))
    if math.isfinite(half_width_m):
        figures.append(("half_width_m", half_width_m))
        if half_width_m < _NARROW_M:
            narrow = f"it is only {2 * half_width_m:.0f} m wide (a road, a strip?)"
            reasons.append((narrow, _NARROW_COSTS))
    red, nir = scene.band("red"), scene.nir
    if red is not None and nir is not None:
        red_in, nir_in = (block_mean(band, factor)[inside] for band in (red, nir))
        index = float(np.median((nir_in - red_in) / (nir_in + red_in + 1.0)))
        figures.append(("vegetation_index", index))
        if index < _LIFELESS:
            reasons.append(("nothing grows on it (water, pavement, a roof?)", _LIFELESS_COSTS))
    return tuple(reasons), tuple(figures)
