"""The id of a field: a position inside it, the roundest there is.

Two outlines of one field share nearly all of their ground, and so nearly always the roundest
position in it: whichever picture, year or map zone it was found in, the id is the same. Two fields
that do not overlap share no position: they never have the same id.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS
from shapely import Polygon

from geofield.crs import LONLAT, refuse_outside, transformer

#: Degrees between round positions, from the roundest on; 5e-7 is five centimetres.
_STEPS = tuple(
    (digits, tenths) for digits in range(8) for tenths in ((1,) if digits == 0 else (5, 2, 1))
)


def place_id(polygon: Polygon, crs: CRS) -> str:
    """The roundest position inside an outline, such as ``35.075N33.531E``.

    Latitude and longitude are multiples of 1 degree, else of 0.5, 0.2, 0.1, 0.05 and so on. Of
    several positions that are equally round, the one with the roundest latitude counts, then the
    one with the roundest longitude. Holes belong to the field here.

    Raises
    ------
    CRSError
        The outline reaches out of the CRS's area.
    """
    whole = Polygon(polygon.exterior)
    shapely.prepare(whole)
    to_lonlat = transformer(crs, LONLAT)
    middle = whole.representative_point()
    lon_0, lat_0 = to_lonlat.transform(middle.x, middle.y)
    west, south, east, north = to_lonlat.transform_bounds(*whole.bounds, densify_pts=7)
    refuse_outside(crs, (west, east), (south, north))
    # Around the field's own longitude, for those that 180 degrees runs through.
    west, east = (lon_0 + (lon - lon_0 + 180.0) % 360.0 - 180.0 for lon in (west, east))
    box = (south, north, west, east)
    for digits, tenths in _STEPS:
        per_degree = 10**digits / tenths
        found = _roundest(whole, crs, per_degree, box)
        if found is not None:
            return position_words(found[0] / per_degree, found[1] / per_degree, digits)
    return position_words(lat_0, lon_0, 7)


def _roundest(
    whole: Polygon, crs: CRS, per_degree: float, box: tuple[float, float, float, float]
) -> tuple[int, int] | None:
    """The roundest position of a lattice inside an outline: numbers of steps, latitude first."""
    south, west = (math.ceil(side * per_degree) for side in box[::2])
    north, east = (math.floor(side * per_degree) for side in box[1::2])
    lonlat = transformer(LONLAT, crs)
    for lats, lons in product(_by_roundness(south, north), _by_roundness(west, east)):
        lat, lon = (each.ravel() for each in np.meshgrid(lats, lons, indexing="ij"))
        inside = shapely.contains_xy(whole, *lonlat.transform(lon / per_degree, lat / per_degree))
        if inside.any():
            first = inside.argmax()
            return int(lat[first]), int(lon[first])
    return None


def _by_roundness(first: int, last: int) -> list[NDArray[np.int64]]:
    """The whole numbers of a range: 0, then the multiples of a high power of two, down to 1."""
    powers = range(max(abs(first), abs(last)).bit_length(), -1, -1)
    odd = [np.arange(-(-first >> power) | 1, (last >> power) + 1, 2) << power for power in powers]
    zero = np.zeros(int(first <= 0 <= last), np.int64)
    return [each for each in (zero, *odd) if len(each)]


def position_words(lat: float, lon: float, digits: int) -> str:
    """A position as part of a name: ``35.075N33.531E`` with three digits."""
    lon = (lon + 180.0) % 360.0 - 180.0
    north, east = ("N" if lat >= 0 else "S"), ("E" if lon >= 0 else "W")
    return f"{abs(lat):.{digits}f}{north}{abs(lon):.{digits}f}{east}"
