"""The study's direction: the longest line of a standard Hough transform of the binary field.

Duda and Hart 1972 ("Use of the Hough transformation to detect lines and curves in pictures"):
theta from -90 to 89 degrees in whole degrees, rho in steps of half a pixel. The peak's angle is
only good to half a degree; as in the study the ends of the line found give its slope.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, Point, Polygon

FloatArray = NDArray[np.float64]

RHO_STEP_PX = 0.5
"""The study's step of rho."""
_RASTER_PX = 640
"""Longer side of the raster, that of the study's pictures."""
_LINE_PX = 1.0
_FILL_GAP_PX = 20.0


def hough_edge(polygon: Polygon) -> LineString:
    """Find the longest straight edge by the Hough transform of the rasterised outline.

    Parameters
    ----------
    polygon : shapely.Polygon
        In a metric CRS. Its outer ring is drawn into a raster of 640 pixels on the longer side.

    Returns
    -------
    LineString
        The edge; the field lies to its left.
    """
    x0, y0, x1, y1 = polygon.bounds
    size_m = max(x1 - x0, y1 - y0) / _RASTER_PX
    ring = shapely.segmentize(shapely.get_exterior_ring(polygon), size_m / 2.0)
    pixels = np.unique(
        np.floor((shapely.get_coordinates(ring) - (x0, y0)) / size_m).astype(np.int64), axis=0
    )
    column, row = pixels.T + 0.5
    theta = np.deg2rad(np.arange(-90.0, 90.0))
    rho = np.outer(np.cos(theta), column) + np.outer(np.sin(theta), row)
    bins = np.rint(rho / RHO_STEP_PX).astype(np.int64)
    lowest = int(bins.min())
    width = int(bins.max()) - lowest + 1
    votes = np.bincount((bins - lowest + width * np.arange(180)[:, None]).ravel())
    peak = int(np.argmax(votes))
    angle, distance = theta[peak // width], (peak % width + lowest) * RHO_STEP_PX
    near = np.abs(column * np.cos(angle) + row * np.sin(angle) - distance) <= _LINE_PX
    start, end = _longest_stretch(column[near], row[near], angle)
    a = np.array([x0, y0]) + start * size_m
    b = np.array([x0, y0]) + end * size_m
    if not _inside_is_left(polygon, a, b, size_m):
        a, b = b, a
    return LineString([a, b])


def _longest_stretch(
    column: NDArray[np.float64], row: NDArray[np.float64], angle: float
) -> tuple[FloatArray, FloatArray]:
    """Ends of the longest stretch of the line's pixels without a wide gap."""
    along = -column * np.sin(angle) + row * np.cos(angle)
    order = np.argsort(along)
    along, places = along[order], np.column_stack((column, row))[order]
    breaks = np.flatnonzero(np.diff(along) > _FILL_GAP_PX)
    first = np.concatenate(([0], breaks + 1))
    last = np.concatenate((breaks, [len(along) - 1]))
    best = int(np.argmax(along[last] - along[first]))
    return places[first[best]], places[last[best]]


def _inside_is_left(polygon: Polygon, a: FloatArray, b: FloatArray, size_m: float) -> bool:
    """On which side of the line more of the field lies, close to it."""
    ux, uy = (b - a) / max(float(np.hypot(*(b - a))), 1e-12)
    for distance in (4.0 * size_m, 16.0 * size_m):
        places = a + np.linspace(0.1, 0.9, 9)[:, None] * (b - a)
        left = shapely.contains_xy(polygon, places + distance * np.array([-uy, ux])).sum()
        right = shapely.contains_xy(polygon, places - distance * np.array([-uy, ux])).sum()
        if left != right:
            return bool(left > right)
    centre: Point = polygon.centroid
    return bool((centre.y - a[1]) * ux - (centre.x - a[0]) * uy > 0.0)
