"""Plausible: whether what was outlined looks like a field at all.

Limits were read off 126 outlines drawn by eye on 0.6 m imagery, lots, meadows and deserts among
them: nine in ten are smoother, all are wider, and all but two in a hundred reflect more near
infrared.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from geofield.model import Scene
from geofield.raster import block_mean

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


@dataclass(frozen=True, eq=False)
class Look:
    """A scene, reduced, as its fields are judged by.

    Attributes
    ----------
    factor : int
        Pixels of the scene along one of these.
    pixel_m : float
        Ground size of a pixel, metres.
    spread : float array (rows, columns)
        Variance of brightness around each pixel, grey levels squared.
    vegetation : float32 array (rows, columns) or None
        The vegetation index, where there is near infrared.
    """

    factor: int
    pixel_m: float
    spread: NDArray[np.float64]
    vegetation: NDArray[np.float32] | None


def look(scene: Scene) -> Look:
    """What `doubts` needs of a scene."""
    factor = max(1, math.ceil(max(scene.grid.shape) / _LOOK_PX))
    grey = block_mean(scene.grey, factor).astype(np.float64)
    mean = ndimage.uniform_filter(grey, _ROUGH_PX)
    spread = ndimage.uniform_filter(grey * grey, _ROUGH_PX) - mean * mean
    red, nir = scene.band("red"), scene.nir
    vegetation = None
    if red is not None and nir is not None:
        red_mean, nir_mean = (block_mean(band, factor) for band in (red, nir))
        vegetation = (nir_mean - red_mean) / (nir_mean + red_mean + 1.0)
    return Look(factor, scene.grid.ground_resolution_m * factor, spread, vegetation)


def doubts(
    seen: Look, mask: NDArray[np.bool_]
) -> tuple[tuple[tuple[str, float], ...], tuple[tuple[str, float], ...]]:
    """What speaks against a field, in words and with what it costs, and the figures behind it.

    Parameters
    ----------
    seen : Look
        Of the scene.
    mask : bool array (rows, columns)
        The outlined pixels of the scene itself, holes filled.
    """
    import cv2

    inside = block_mean(mask, seen.factor) > 0.5
    if not inside.any():
        return (), ()
    roughness = float(np.sqrt(np.median(np.maximum(seen.spread[inside], 0))))
    padded = np.pad(inside, 1, mode="edge").view(np.uint8)
    depth = cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    half_width_m = math.inf if padded.all() else float(depth.max()) * seen.pixel_m
    reasons = []
    figures = [("roughness", roughness)]
    if roughness > _ROUGH:
        reasons.append(("it is rough (shrubs, a wood, buildings?)", _ROUGH_COSTS))
    if math.isfinite(half_width_m):
        figures.append(("half_width_m", half_width_m))
        if half_width_m < _NARROW_M:
            narrow = f"it is only {2 * half_width_m:.0f} m wide (a road, a strip?)"
            reasons.append((narrow, _NARROW_COSTS))
    if seen.vegetation is not None:
        index = float(np.median(seen.vegetation[inside]))
        figures.append(("vegetation_index", index))
        if index < _LIFELESS:
            reasons.append(("nothing grows on it (water, pavement, a roof?)", _LIFELESS_COSTS))
    return tuple(reasons), tuple(figures)
