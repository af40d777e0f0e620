"""Scaling 16 bit, signed and floating point pictures to 0..255.

All colour bands share one scaling, so that their proportions (the hue) stay. The ends are
percentiles of the pixels shown, computed from all of them: the same window gives the same
picture every time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geofield.errors import ImageryError, is_number

Limits = tuple[float, float] | None
#: The percentiles that become 0 and 255: sun glint and dead pixels lie outside.
PERCENTILES = (0.5, 99.5)


def scaled_bands(
    values: NDArray[Any],
    roles: Sequence[str],
    valid: NDArray[np.bool_],
    scaling: Limits,
    nir_scaling: Limits,
) -> tuple[NDArray[np.uint8], Limits, Limits, tuple[str, ...]]:
    """Bands in 8 bits, the limits of the colours and of near infrared, and what was done.

    Parameters
    ----------
    values : array (bands, rows, columns)
    roles : sequence of str
        What each band shows.
    valid : bool array (rows, columns)
    scaling, nir_scaling : (float, float) or None
        Limits; percentiles when None.
    """
    colour = [i for i, role in enumerate(roles) if role != "nir"]
    limits = scaling or scale_limits(values[colour or [0]], valid)
    scaled = to_uint8(values, limits)
    low, high = limits or (0.0, 255.0)
    notes = [f"Values {low:.6g} to {high:.6g} ({values.dtype}) became 0 to 255."]
    own: Limits = None
    if "nir" in roles and colour:
        # Plants are several times brighter there: the colours' scaling would saturate.
        near = [roles.index("nir")]
        own = nir_scaling or scale_limits(values[near], valid)
        scaled[near] = to_uint8(values[near], own)
        if own is not None:
            notes.append(f"Near infrared {own[0]:.6g} to {own[1]:.6g} became 0 to 255.")
    return scaled, limits, own, tuple(notes)


def scale_limits(bands: NDArray[Any], valid: NDArray[np.bool_]) -> Limits:
    """The values that become 0 and 255; None for 8 bit bands, which stay as they are.

    `bands` are the colour bands (bands, rows, columns), of any real type.
    """
    if bands.dtype == np.uint8:
        return None
    values = bands[:, valid]
    if values.dtype.kind == "f":
        values = values[np.isfinite(values)]
    if values.size == 0:
        return (0.0, 1.0)
    low, high = (float(each) for each in np.percentile(values, PERCENTILES))
    if not high > low:
        low, high = float(values.min()), float(values.max())
    if not high > low:  # one value everywhere: mid grey would be as good
        high = low + 1.0
    return low, high


def to_uint8(bands: NDArray[Any], limits: Limits) -> NDArray[np.uint8]:
    """Bands with the limits stretched to 0..255 and everything outside cut off."""
    if limits is None:
        return np.asarray(bands, np.uint8)
    low, high = limits
    if not (is_number(low) and is_number(high) and np.isfinite([low, high]).all() and high > low):
        raise ImageryError(
            f"A picture cannot be scaled from {low} .. {high} to 0 .. 255.",
            hint="Give two finite values, the smaller one first.",
        )
    scaled = np.empty(bands.shape, np.uint8)
    for i, band in enumerate(bands):  # band by band: floats of the whole picture are large
        stretched = (band.astype(np.float64) - low) * (255.0 / (high - low))
        np.nan_to_num(stretched, copy=False, nan=0.0, posinf=255.0, neginf=0.0)
        scaled[i] = np.clip(np.rint(stretched), 0, 255)
    return scaled
