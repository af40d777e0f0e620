"""Said: how well outlines go with what the points say, by name.

The points say what the network takes for the field, and where the outline that was taken before
the last of them errs: what they do not correct was right, and they lie well within what was wrong.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from geofield.field.points import Points
from geofield.field.ranking import log_odds

Mask = NDArray[np.uint8]

#: From here on a border is clear of the corrections, pixels.
_CLEAR_PX = 12.0
#: Likelihoods count up to here.
_SURE = 0.005, 0.995
#: What fits badly, per pixel of an outline, counts from here on: a perfect one has no logarithm.
_FIT = 0.02


@dataclass(frozen=True, eq=False)
class Said:
    """What points say of a picture.

    Attributes
    ----------
    likely : float32 array (rows, columns)
        How likely each pixel belongs to the field.
    corrections : sequence of (float, float)
        The points but the seed, pixel coordinates.
    before : uint8 array (rows, columns) or None
        What the outline held, as ones, that was taken before the last correction.
    """

    likely: NDArray[np.float32]
    corrections: Points = ()
    before: Mask | None = None

    @cached_property
    def _layers(self) -> NDArray[np.float32]:
        """Likelihood, and what is gained by holding a pixel, log odds."""
        sure = np.clip(self.likely, *_SURE)
        return np.dstack([self.likely, np.log(sure) - np.log1p(-sure)]).astype(np.float32)

    @cached_property
    def _of_all(self) -> tuple[float, float]:
        """The whole likelihood, and what it costs to hold nothing, log likelihood."""
        nothing = np.log1p(-np.clip(self.likely, *_SURE))
        return float(self.likely.sum()), float(nothing.sum())

    def figures(self, polygon: Polygon, mask: Mask) -> dict[str, float]:
        """The figures of an outline.

        Parameters
        ----------
        polygon : Polygon
            Pixel coordinates.
        mask : uint8 array (rows, columns)
            Ones where it is.
        """
        import cv2

        area = max(cv2.countNonZero(mask), 1)
        common, gain = (area * each for each in cv2.mean(self._layers, mask)[:2])
        everywhere, nothing = self._of_all
        # All of it was right where nothing was taken before.
        kept = 1.0 if self.before is None else overlap(mask, self.before)
        return {
            "network_overlap": float(log_odds(common / (area + everywhere - common))),
            "network_missed": 1.0 - common / max(everywhere, 1e-9),
            "network_fit_of_area": math.log(_FIT - (nothing + gain) / area),
            "kept": kept,
            "clearance": self._clearance(polygon),
            "corrections": float(len(self.corrections)),
        }

    def _clearance(self, polygon: Polygon) -> float:
        """How far the border keeps from the nearest correction, pixels, up to a bound."""
        if not self.corrections:
            return _CLEAR_PX
        away = shapely.distance(polygon.exterior, shapely.multipoints(self.corrections))
        return min(float(away), _CLEAR_PX)


def overlap(one: Mask, other: Mask) -> float:
    """Common share of two masks of ones."""
    import cv2

    common = cv2.countNonZero(one & other)
    return common / max(cv2.countNonZero(one | other), 1)
