"""Answer: what the network takes for the field, as outlines, and where it is most in doubt."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon

from geofield.errors import FieldError
from geofield.field.morphology import filled, part_at
from geofield.field.outline import straight_outline
from geofield.raster import smoothed

BoolArray = NDArray[np.bool_]

#: From which likelihood on ground is the network's own answer; from which ones it may be the field.
ANSWER = (0.5,)
LEVELS = *ANSWER, 0.3, 0.7, 0.15, 0.85
#: How far its outlines may leave its ground, pixels.
_TOLERANCES_PX = 3.0, 1.5
#: Width of the surroundings in which doubt adds up, pixels.
_AROUND_PX = 12.0


def network_outlines(
    likely: NDArray[np.float32],
    seed_px: tuple[float, float],
    levels: Sequence[float] = LEVELS,
) -> dict[Polygon, BoolArray]:
    """Straight outlines of the ground at the seed, with what was filled in them.

    Parameters
    ----------
    likely : float32 array (rows, columns)
        How likely each pixel belongs to the field.
    seed_px : (float, float)
    levels : sequence of float
        From which likelihoods on.
    """
    found: dict[Polygon, BoolArray] = {}
    for level in levels:
        ground = likely > level
        if not ground.any():
            continue
        part = part_at(ground, *seed_px)
        whole = filled(part)
        for tolerance_px in _TOLERANCES_PX:
            with suppress(FieldError):
                outline = straight_outline(whole, tolerance_px=tolerance_px)
                found.setdefault(Polygon(outline.exterior), whole & ~part)
    return found


def doubtful(
    likely: NDArray[np.float32], ground: BoolArray
) -> list[tuple[tuple[float, float], bool]]:
    """Places where a word would change most: taken, yet it may not belong; not taken, yet it may.

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
