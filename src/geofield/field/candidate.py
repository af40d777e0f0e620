"""Candidate: an outline that may be the field's, with what was measured on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon

from geofield.field.ranking import Figures


@dataclass(frozen=True, eq=False)
class Candidate:
    """A possible outline of the field.

    Attributes
    ----------
    polygon : Polygon
        Pixel coordinates of the searched picture; no holes.
    holes : bool array (rows, columns)
        What was filled in the ground that it began as.
    figures : mapping
        What was measured on it, by name.
    score : float
        Only differences mean something.
    """

    polygon: Polygon
    holes: NDArray[np.bool_]
    figures: Figures
    score: float
