"""The local plane of AgOpenGPS: metres east and north of a start point.

Lengths of a degree follow from series in the latitude f (degrees here, WGS 84)::

    mLat    = 111132.92 - 559.82 cos 2f0 + 1.175 cos 4f0 - 0.0023 cos 6f0
    mLon(f) = 111412.84 cos f - 93.5 cos 3f + 0.118 cos 5f
    north   = (lat - lat0) mLat(f0)
    east    = (lon - lon0) mLon(lat)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LocalPlane:
    """A plane around a start point.

    Attributes
    ----------
    lat, lon : float
        The start point, degrees.
    """

    lat: float
    lon: float

    def to_plane(self, lon: ArrayLike, lat: ArrayLike) -> FloatArray:
        """Degrees to metres: array (n, 2) of easting and northing."""
        lon, lat = np.asarray(lon, float), np.asarray(lat, float)
        north = (lat - self.lat) * self._metres_per_lat()
        east = ((lon - self.lon + 180.0) % 360.0 - 180.0) * _metres_per_lon(lat)
        return np.column_stack([east, north])

    def to_lonlat(self, east: ArrayLike, north: ArrayLike) -> FloatArray:
        """Metres to degrees: array (n, 2) of longitude, on across 180, and latitude."""
        lat = self.lat + np.asarray(north, float) / self._metres_per_lat()
        lon = self.lon + np.asarray(east, float) / _metres_per_lon(lat)
        return np.column_stack([lon, lat])

    def _metres_per_lat(self) -> float:
        f = np.radians(self.lat)
        return float(
            111132.92 - 559.82 * np.cos(2 * f) + 1.175 * np.cos(4 * f) - 0.0023 * np.cos(6 * f)
        )


def _metres_per_lon(lat: ArrayLike) -> FloatArray:
    f = np.radians(np.asarray(lat, float))
    return np.asarray(111412.84 * np.cos(f) - 93.5 * np.cos(3 * f) + 0.118 * np.cos(5 * f))


def ring_headings(ring: FloatArray) -> FloatArray:
    """The heading at every vertex of an open ring (n, 2): radians clockwise from north.

    From the vertex before to the one after; AgOpenGPS breaks a ring whose headings differ.
    """
    before, after = np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0)
    return np.asarray(
        np.arctan2(after[:, 0] - before[:, 0], after[:, 1] - before[:, 1]) % (2 * np.pi)
    )


def densified(ring: FloatArray, step: float) -> FloatArray:
    """An open ring with vertices at most `step` metres apart; its corners stay."""
    return shapely.get_coordinates(shapely.segmentize(shapely.LinearRing(ring), step))[:-1]
