"""Outlines that cross themselves: mended, unless they cross more often than anybody draws.

Mending takes time and memory by the number of crossings, which grows with the square of the
vertices: a file of two megabytes could ask for a hundred gigabytes.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from geofield.errors import FormatError

#: Of one outline; a careless digitiser leaves a few. Mending 3000 takes GEOS four seconds, 20 000
#: two minutes.
_MOST_CROSSINGS = 2000
#: So often the same ground may be gone over.
_MOST_TIMES = 20
#: Parts that together have less than this share of the area are lost in a repair.
_SLIVER = 0.01
#: So many pairs of sides are looked at in one go.
_PAIRS = 500_000


def mended(
    polygon: BaseGeometry, method: Literal["linework", "structure"] = "linework"
) -> BaseGeometry:
    """A valid geometry of an outline that crosses or touches itself, in any CRS.

    Perhaps of several parts, none of several again, and of lines where areas collapsed; `method` is
    that of `shapely.make_valid`.

    Raises
    ------
    FormatError
        When it crosses itself too often to be mended.
    """
    if _is_tangle(polygon):
        raise FormatError(
            f"An outline of {shapely.get_num_coordinates(polygon)} vertices crosses itself more "
            f"than {_MOST_CROSSINGS} times, or goes over the same ground more than {_MOST_TIMES}.",
            hint="Its vertices are in disorder: draw it anew, or ask for a sound file.",
        )
    valid = shapely.make_valid(polygon, method=method)
    if isinstance(valid, shapely.GeometryCollection):  # areas and lines, areas as one part
        return shapely.GeometryCollection(shapely.get_parts(shapely.get_parts(valid)).tolist())
    return valid


def largest_part(repaired: BaseGeometry) -> tuple[BaseGeometry, float]:
    """Of a mended outline the part that has nearly all of the area, and the area of the others.

    The outline as it is, and no area, where none has.
    """
    parts = [part for part in shapely.get_parts(repaired) if isinstance(part, Polygon)]
    area = sum(part.area for part in parts)
    largest = max(parts, key=lambda part: part.area, default=repaired)
    kept = largest.area > 0.0 and largest.area >= (1.0 - _SLIVER) * area
    return (largest, area - largest.area) if kept else (repaired, 0.0)


def in_words(kept_m2: float, left_m2: float) -> str:
    """How much of a mended outline is kept, and how much is left out."""

    def size(area_m2: float) -> str:
        return f"{area_m2:.1f} m2" if area_m2 < 100.0 else f"{area_m2 / 10_000.0:.2f} ha"

    return f"{size(kept_m2)} kept, {size(left_m2)} left out"


def _is_tangle(polygon: BaseGeometry) -> bool:
    rings, _ = shapely.get_rings(shapely.get_parts(polygon), return_index=True)
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    follows = ring[1:] == ring[:-1]
    ends = np.stack([xy[:-1][follows], xy[1:][follows]], axis=1)
    sides = np.asarray(shapely.linestrings(ends), dtype=object)
    tree = shapely.STRtree(sides)
    crossed = met = 0
    for some in np.array_split(sides, max(1, len(sides) ** 2 // _PAIRS)):
        one, other = tree.query(some, predicate="intersects")
        crossed += int(shapely.crosses(some[one], sides[other]).sum())
        met += len(one)
        # Found from both sides; each also meets itself and its two neighbours.
        if crossed > 2 * _MOST_CROSSINGS or met > 3 * len(sides) * _MOST_TIMES:
            return True
    return False
