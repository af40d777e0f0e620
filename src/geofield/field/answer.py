"""Answer: what the network takes for the field, as outlines."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon

from geofield.errors import FieldError
from geofield.field.morphology import filled
from geofield.field.outline import straight_outline
from geofield.field.segmentation import part_at

BoolArray = NDArray[np.bool_]

#: From which likelihood on ground is the network's own answer; from which ones it may be the field.
ANSWER = (0.5,)
LEVELS = *ANSWER, 0.3, 0.7, 0.15, 0.85
#: How far its outlines may leave its ground, pixels.
_TOLERANCES_PX = 3.0, 1.5


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
        if not (likely > level).any():
            continue
        part = part_at(likely > level, *seed_px)
        whole = filled(part)
        for tolerance_px in _TOLERANCES_PX:
            with suppress(FieldError):
                outline = straight_outline(whole, tolerance_px=tolerance_px)
                found.setdefault(Polygon(outline.exterior), whole & ~part)
    return found
