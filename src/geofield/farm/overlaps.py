"""Parcels that overlap: the same ground would be driven twice."""

from __future__ import annotations

import numpy as np
import shapely

from geofield.crs import areas_anywhere_m2
from geofield.farm.places import Places

#: Shared borders are never quite the same: smaller overlaps are none.
_LEAST_M2 = 10.0
#: Parcels that are compared at a time, neighbours along the space-filling curve.
_AT_A_TIME = 100_000


def overlaps(places: Places) -> dict[int, str]:
    """What is to be told of parcels that overlap others, by position.

    More than a hundred thousand are compared in parts.
    """
    if places.outlines is None:
        return {}
    told: dict[int, list[str]] = {}
    order = places.order()
    for begin in range(0, len(order), _AT_A_TIME):
        at = order[begin : begin + _AT_A_TIME]
        shapes = shapely.from_wkb(places.outlines.take(at).to_numpy(zero_copy_only=False))
        valid = np.where(shapely.is_valid(shapes), shapes, None)
        one, other = shapely.STRtree(valid).query(valid, predicate="intersects")
        pairs = one < other
        one, other = one[pairs], other[pairs]
        # Neighbours share borders; only what shares ground costs an intersection.
        ground = ~shapely.touches(valid[one], valid[other])
        one, other = one[ground], other[ground]
        shared = shapely.intersection(valid[one], valid[other])
        for a, b, area in zip(one, other, areas_anywhere_m2(shared, places.crs), strict=True):
            if area > _LEAST_M2:
                for mine, its in ((at[a], at[b]), (at[b], at[a])):
                    words = f"overlaps {places.names[its].as_py()} by {area / 10_000.0:.2f} ha"
                    told.setdefault(int(mine), []).append(words)
    return {at: "; ".join(sorted(words)) for at, words in sorted(told.items())}
