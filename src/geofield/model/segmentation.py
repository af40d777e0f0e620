"""Segmentation: a field as pixels, what a method of stage 2 hands on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Segmentation:
    """A field as pixels.

    Attributes
    ----------
    mask : bool array (rows, columns)
        The field's pixels; what stands in it (crowns, huts, ponds) may be missing.
    notes : tuple of str
        What the method had to tell.
    figures : tuple of (str, float)
        Evidence that the method measured itself.
    alternatives : tuple of Segmentation
        Other fields that may be meant, the likeliest first.
    """

    mask: NDArray[np.bool_]
    notes: tuple[str, ...] = ()
    figures: tuple[tuple[str, float], ...] = ()
    alternatives: tuple[Segmentation, ...] = ()
