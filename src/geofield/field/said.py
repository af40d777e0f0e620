"""Said: how well outlines go with what the points say, by name.

The points say what the network takes for the field, and where the outline that was taken before
the last of them errs: what they do not correct was right, and they lie well within what was wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from geofield.field.answer import exact_overlaps
from geofield.field.ranking import log_odds

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]
Points = Sequence[tuple[float, float]]

#: From here on a border is clear of the corrections, pixels.
_CLEAR_PX = 12.0


@dataclass(frozen=True, eq=False)
class Said:
    """What points say of the superpixels of a picture.

    Attributes
    ----------
    likely, size_px : float array (superpixels,)
        How likely each belongs to the field; its pixels.
    picture : float32 array (rows, columns)
        How likely each pixel belongs to it.
    corrections : sequence of (float, float)
        The points but the seed, pixel coordinates of the searched picture.
    before : bool array (superpixels,) or None
        Which the outline held that was taken before the last correction.
    """

    likely: FloatArray
    size_px: FloatArray
    picture: NDArray[np.float32]
    corrections: Points = ()
    before: BoolArray | None = None

    def figures(
        self, polygons: Sequence[Polygon], inside: Sequence[BoolArray]
    ) -> list[dict[str, float]]:
        """The figures of outlines.

        Parameters
        ----------
        polygons : sequence of Polygon
            Pixel coordinates of the searched picture; at least one.
        inside : sequence of bool array (superpixels,)
            Which each holds.
        """
        figures = {
            **self._shares(np.array(inside)),
            "network_exact_overlap": log_odds(exact_overlaps(self.picture, polygons)),
            "clearance": self._clearance(polygons),
            "corrections": np.full(len(polygons), float(len(self.corrections))),
        }
        rows = np.column_stack(list(figures.values())).tolist()
        return [dict(zip(figures, row, strict=True)) for row in rows]

    def _shares(self, members: BoolArray) -> dict[str, FloatArray]:
        """Of the ground: what agrees with the network's answer, what is kept of the one before."""
        likely, size_px = self.likely, self.size_px
        sure, field = np.clip(likely, 0.005, 0.995), likely > 0.5
        without = np.log1p(-sure)
        before = np.zeros_like(field) if self.before is None else self.before
        counted = size_px[:, None] * np.column_stack(
            [np.ones_like(likely), likely, field, likely < 0.3, np.log(sure) - without, before]
        )
        area, common, both, unlikely, gain, kept = (members @ counted).T
        everywhere, fields, earlier = (float(size_px @ one) for one in (likely, field, before))
        fit = size_px @ without + gain
        return {
            "network_overlap": log_odds(common / (area + everywhere - common)),
            "network_field_overlap": log_odds(both / (area + fields - both)),
            "network_inside": common / area,
            "network_missed": 1.0 - common / max(everywhere, 1e-9),
            "network_unlikely_share": unlikely / area,
            "network_fit": np.log(0.02 - fit / size_px.sum()),
            "network_fit_of_area": np.log(0.02 - fit / area),
            # Whole where nothing was taken before.
            "kept": np.ones_like(area) if self.before is None else kept / (area + earlier - kept),
        }

    def _clearance(self, polygons: Sequence[Polygon]) -> FloatArray:
        """How far borders keep from the nearest correction, pixels, up to a bound."""
        if not self.corrections:
            return np.full(len(polygons), _CLEAR_PX)
        borders = shapely.boundary(np.array(polygons))
        away = shapely.distance(borders, shapely.multipoints(self.corrections))
        return np.minimum(away, _CLEAR_PX)
