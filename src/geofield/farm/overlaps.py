"""Parcels that overlap: the same ground would be driven twice."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import shapely
from pyproj import CRS

from geofield.crs import ground_areas_m2, metric_crs
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
        for a, b, area in zip(one, other, _areas_m2(shared, places, at[one]), strict=True):
            if area > _LEAST_M2:
                for mine, its in ((at[a], at[b]), (at[b], at[a])):
                    words = f"overlaps {places.names[its].as_py()} by {area / 10_000.0:.2f} ha"
                    told.setdefault(int(mine), []).append(words)
    return {at: "; ".join(sorted(words)) for at, words in sorted(told.items())}


def _areas_m2(shapes: np.ndarray, places: Places, at: np.ndarray) -> np.ndarray:
    """True areas of shapes in the CRS of the places."""
    if not len(shapes):
        return np.empty(0)
    if not places.crs.is_geographic:
        middle = metric_crs(float(places.lon[at[0]]), float(places.lat[at[0]]), places.crs)
        if middle == places.crs:
            return ground_areas_m2(shapes, middle)
    areas = np.zeros(len(shapes))
    zones = np.array([metric_crs(places.lon[k], places.lat[k]).to_epsg() for k in at])
    for zone in np.unique(zones):
        mine = zones == zone
        here = gpd.GeoSeries(shapes[mine], crs=places.crs).to_crs(int(zone))
        areas[mine] = ground_areas_m2(here.to_numpy(), CRS(int(zone)))
    return areas
