"""How far the positions of a CRS may be off for its datum alone, told where it is worth a word.

PROJ says of each way between two datums how exact it is. The best one often needs a grid of
corrections that its installations lack, and then it takes the next best without a word.
"""

from __future__ import annotations

import math
import warnings
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from pyproj import CRS
from pyproj.transformer import AreaOfInterest, TransformerGroup

from geofield.crs import LONLAT, authority_name, transformer

#: As exact as a picture without control points needs it; that of ETRS89 to WGS 84 by PROJ's word.
_GOOD_M = 1.0
#: Degrees; a datum no farther from WGS 84 is taken for it, by PROJ and here.
_SAME_DEG = 1e-7


def datum_notes(crs: CRS, x: ArrayLike, y: ArrayLike) -> tuple[str, ...]:
    """What to say of positions in a CRS, some of which are given; nothing where they are good."""
    lon, lat = np.atleast_1d(*transformer(crs, LONLAT).transform(x, y))
    known = np.flatnonzero(np.isfinite(lon) & np.isfinite(lat))
    if not len(known):
        return ()
    # Near by the same ways are there; PROJ takes some time to list them.
    here = float(lon[known[0]]), float(lat[known[0]])
    return _notes(crs.srs, round(here[0], 1), round(here[1], 1))


@lru_cache(maxsize=256)
def _notes(srs: str, lon: float, lat: float) -> tuple[str, ...]:
    crs = CRS(srs)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # pyproj's own words for a missing grid
        here = AreaOfInterest(lon, lat, lon, lat)
        ways = TransformerGroup(crs, LONLAT, always_xy=True, area_of_interest=here)
    if not ways.transformers:
        return ()
    good_m = ways.transformers[0].accuracy
    if good_m < 0.0:
        # An ellipsoid alone, that of WGS 84, is how many programs write WGS 84.
        if crs.ellipsoid is None or crs.ellipsoid.semi_major_metre == 6378137.0:
            return ()
        how = f"{crs.name} does not say how its datum lies to WGS 84: positions may be 100 m off"
        return (f"{how}. Write its code into the file: gdal_edit.py -a_srs EPSG:31467, say.",)
    if good_m <= _GOOD_M or _is_wgs84(crs, lon, lat):
        return ()
    told = f"Positions in {authority_name(crs)} are good to {good_m:g} m, by PROJ's word"
    for way in ways.unavailable_operations:
        # A way may need two: with one of them it is not there yet.
        lacks = [grid.short_name for grid in way.grids if not grid.available]
        if lacks and 0.0 <= way.accuracy <= good_m / 2.0:  # worth fetching
            fetch = ", then ".join(f"pyproj sync --file {name}" for name in lacks)
            grids = "its grid" if len(lacks) == 1 else f"its {len(lacks)} grids"
            return (f"{told}. With {grids} to {way.accuracy:g} m: {fetch}",)
    return (f"{told}.",)


def _is_wgs84(crs: CRS, lon: float, lat: float) -> bool:
    """Whether PROJ takes a datum for WGS 84, as that of NAD83 (see docs/explanation/geodesy.md)."""
    own = crs.geodetic_crs
    if own is None:
        return True
    x, y = transformer(LONLAT, own).transform(lon, lat)
    return math.hypot(x - lon, y - lat) < _SAME_DEG
