"""Doubt: the places where a word would change most what is taken for the field."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from geofield.raster import smoothed

BoolArray = NDArray[np.bool_]
Place = tuple[float, float]

#: Width of the surroundings in which doubt adds up, pixels.
_AROUND_PX = 12.0


def doubtful(likely: NDArray[np.float32], ground: BoolArray) -> list[tuple[Place, bool]]:
    """Where the most of what was taken may not belong, and the most of what was not, may.

    Parameters
    ----------
    likely : float32 array (rows, columns)
        How likely each pixel belongs to the field.
    ground : bool array (rows, columns)
        What was taken for it.

    Returns
    -------
    list of ((float, float), bool)
        Pixel coordinates, and whether the place would newly belong.
    """
    found = []
    for where, wrong, belongs in ((ground, 1.0 - likely, False), (~ground, likely, True)):
        if not where.any():
            continue
        doubt = np.where(where, smoothed(np.where(where, wrong, 0.0), _AROUND_PX), -1.0)
        row, column = np.unravel_index(int(np.argmax(doubt)), doubt.shape)
        found.append(((float(column) + 0.5, float(row) + 0.5), belongs))
    return found
