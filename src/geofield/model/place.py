"""The id of a field: a position inside it, the roundest there is.

Two outlines of one field share nearly all of their ground, and so nearly always the roundest
position in it: whichever picture, year or map zone it was found in, the id is the same. Two fields
that do not overlap share no position: they never have the same id.
"""

from __future__ import annotations

import math

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
        found = _inside(whole, crs, per_degree, box)
        if len(found):
            lat, lon = min(found.tolist(), key=lambda one: (_rank(one[0]), _rank(one[1]), one))
            return position_words(lat / per_degree, lon / per_degree, digits)
    return position_words(lat_0, lon_0, 7)


def _inside(
    whole: Polygon, crs: CRS, per_degree: float, box: tuple[float, float, float, float]
) -> NDArray[np.int64]:
    """Positions of a lattice inside an outline: whole numbers of steps, latitude first."""
    lat = np.arange(math.ceil(box[0] * per_degree), math.floor(box[1] * per_degree) + 1)
    lon = np.arange(math.ceil(box[2] * per_degree), math.floor(box[3] * per_degree) + 1)
    if not len(lat) or not len(lon):
        return np.empty((0, 2), np.int64)
    pairs = np.stack(np.meshgrid(lat, lon, indexing="ij"), axis=-1).reshape(-1, 2)
    x, y = transformer(LONLAT, crs).transform(pairs[:, 1] / per_degree, pairs[:, 0] / per_degree)
    return np.asarray(pairs[shapely.contains_xy(whole, x, y)], np.int64)


def _rank(steps: int) -> int:
    """How far from round a number of steps is: multiples of a high power of two come first."""
    return -(steps & -steps) if steps else -(1 << 62)


def position_words(lat: float, lon: float, digits: int) -> str:
    """A position as part of a name: ``35.075N33.531E`` with three digits."""
    lon = (lon + 180.0) % 360.0 - 180.0
    north, east = ("N" if lat >= 0 else "S"), ("E" if lon >= 0 else "W")
    return f"{abs(lat):.{digits}f}{north}{abs(lon):.{digits}f}{east}"
