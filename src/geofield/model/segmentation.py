"""Segmentation: a field as pixels, what a method of stage 2 hands on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Segmentation:
    """A field as pixels."""

    #: Shape (rows, columns): the field's pixels; what stands in it (crowns, huts, ponds) may be
    #: missing.
    mask: NDArray[np.bool_]
    #: What the method had to tell.
    notes: tuple[str, ...] = ()
    #: Evidence that the method measured itself.
    figures: tuple[tuple[str, float], ...] = ()
    #: Other fields that may be meant, the likeliest first.
    alternatives: tuple[Segmentation, ...] = ()
