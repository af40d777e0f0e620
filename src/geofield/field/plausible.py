"""Plausible: whether what was outlined looks like a field at all.

Limits were read off 27 fields and 24 places in cities, woods and on roads of 0.6 m imagery:
fields are smoother, wider and reflect at least about as much near infrared as red.
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
#: Grey levels; the 27 fields reach 8.2, cities and woods begin at 9.2.
_ROUGH = 9.0
#: Vegetation index; dry soil and straw reach down to -0.06, pavement up to -0.11.
_LIFELESS = -0.09
#: Half the width of the narrowest field, metres.
_NARROW_M = 7.0


def doubts(
    scene: Scene, mask: NDArray[np.bool_]
) -> tuple[tuple[str, ...], tuple[tuple[str, float], ...]]:
    """What speaks against a field, in words, and the figures behind it.

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
        reasons.append("it is as rough as a wood or a built-up place")
    if math.isfinite(half_width_m):
        figures.append(("half_width_m", half_width_m))
        if half_width_m < _NARROW_M:
            reasons.append(f"it is only {2 * half_width_m:.0f} m wide (a road, a strip?)")
    red, nir = scene.band("red"), scene.nir
    if red is not None and nir is not None:
        red_in, nir_in = (block_mean(band, factor)[inside] for band in (red, nir))
        index = float(np.median((nir_in - red_in) / (nir_in + red_in + 1.0)))
        figures.append(("vegetation_index", index))
        if index < _LIFELESS:
            reasons.append("it reflects light like water, pavement or a roof")
    return tuple(reasons), tuple(figures)
