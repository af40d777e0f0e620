"""Fields across the 180th meridian, in formats of longitude and latitude.

Formats of single positions (GPX, ISOXML, CSV) give each its longitude between -180 and
180. Formats of shapes cut them at the meridian, as RFC 7946 (section 3.1.9) wants it: a polygon
whose ring jumps from 180 to -180 would go round the earth. Reading joins either again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS

from geofield.crs import LONLAT, PACIFIC
from geofield.errors import FormatError

#: No field is wider: what seems to be, jumps from one side of the map to the other.
_WIDEST_DEG = 180.0
#: What stands in a field or is driven beside it is no farther from it.
_BESIDE_DEG = 1.0
_EAST = shapely.box(0.0, -90.0, 180.0, 90.0)
_WEST = shapely.box(180.0, -90.0, 360.0, 90.0)
#: Cut edges may differ in their last digits, degrees: by a centimetre, as of seven decimals.
_SNAP_DEG = 1.1e-7


def unwrapped(shapes: NDArray[np.object_]) -> NDArray[np.object_]:
    """Shapes in degrees, those that jump at 180 with longitudes from 0 to 360 instead."""
    return _where_jumping(shapes, list)


def split(shapes: NDArray[np.object_]) -> NDArray[np.object_]:
    """Shapes in degrees, those that jump at 180 cut there into multi-part ones."""
    return _where_jumping(shapes, _split)


def joined(shapes: NDArray[np.object_], crs: CRS) -> NDArray[np.object_]:
    """Shapes as one again that jump at 180 or were cut there, in a CRS of degrees.

    Of other CRS they are handed back as they are.
    """
    if not crs.is_geographic:
        return np.asarray(shapes, dtype=object)
    return _where_jumping(shapes, lambda whole: [_as_one(each) for each in whole])


def seamless(shapes: NDArray[np.object_]) -> CRS:
    """The CRS in which shapes of several zones (here in degrees) are one table, none of them cut.

    That is degrees where none is near 180: a layer of polygons takes none in two parts, and a
    person who edits one sees it at both ends of the map.
    """
    bounds = np.abs(shapely.bounds(shapes).reshape(-1, 4)[:, ::2])
    return PACIFIC if (bounds > 180.0 - _BESIDE_DEG).any() else LONLAT


def extent(shapes: NDArray[np.object_]) -> tuple[float, float, float, float]:
    """West, south, east and north of shapes in degrees; west lies beyond east across 180.

    That is RFC 7946, section 5.2. Of the two ways round, the narrower one.
    """
    bounds = shapely.bounds(unwrapped(shapes)).reshape(-1, 4)
    ways = []
    for shift in (0.0, 360.0):
        left = np.where(bounds[:, 0] < 0, bounds[:, 0] + shift, bounds[:, 0])
        ways.append((np.nanmin(left), np.nanmax(left + bounds[:, 2] - bounds[:, 0])))
    west, east = (float(side) for side in min(ways, key=lambda way: way[1] - way[0]))
    south, north = float(np.nanmin(bounds[:, 1])), float(np.nanmax(bounds[:, 3]))
    return west - 360.0 * (west > 180.0), south, east - 360.0 * (east > 180.0), north


def extent_box(west: float, south: float, east: float, north: float) -> Any:
    """An extent as a shape in degrees, cut at 180 where it lies across."""
    if west <= east:
        return shapely.box(west, south, east, north)
    sides = (west, 180.0), (-180.0, east)
    return shapely.multipolygons([shapely.box(left, south, right, north) for left, right in sides])


def _where_jumping(
    shapes: NDArray[np.object_], change: Callable[[NDArray[np.object_]], list[Any]]
) -> NDArray[np.object_]:
    """Shapes, those that jump at 180 changed from what they are with longitudes up to 360."""
    shapes = np.asarray(shapes, dtype=object)
    bounds = shapely.bounds(shapes).reshape(-1, 4)
    with np.errstate(invalid="ignore"):
        jumps = (bounds[:, 2] - bounds[:, 0] > _WIDEST_DEG) & (bounds[:, 0] < 0)
    if jumps.any():
        shapes = shapes.copy()
        shapes[jumps] = change(shapely.transform(shapes[jumps], _positive))
    return shapes


def _split(whole: NDArray[np.object_]) -> list[Any]:
    if not shapely.is_valid(whole).all():
        raise FormatError(
            "A shape that reaches longitude 180 is not valid in degrees; one that goes round a "
            "pole never is.",
            hint="Formats in metres carry it: gpkg, geoparquet, flatgeobuf, dxf.",
        )
    return [_collected(_cut(each)) for each in whole]


def _cut(whole: Any) -> list[Any]:
    """The pieces of a shape on either side; those of lines in the order in which they are driven.

    As sets of places, lines that cross or follow themselves would lose that order.
    """
    if whole.geom_type.endswith("LineString"):
        return [piece for line in shapely.get_parts(whole) for piece in _legs_by_side(line)]
    west = shapely.transform(shapely.intersection(whole, _WEST), lambda xy: xy - (360.0, 0.0))
    return [shapely.intersection(whole, _EAST), west]


def _legs_by_side(line: Any) -> list[Any]:
    lonlat = shapely.get_coordinates(line)
    beyond = lonlat[:, 0] > 180.0
    at = np.flatnonzero(beyond[1:] != beyond[:-1])
    start, end = lonlat[at], lonlat[at + 1]
    share = (180.0 - start[:, 0]) / (end[:, 0] - start[:, 0])
    crossings = np.column_stack(
        [np.full(len(at), 180.0), start[:, 1] + share * (end[:, 1] - start[:, 1])]
    )
    pieces = np.split(
        np.insert(lonlat, np.repeat(at + 1, 2), np.repeat(crossings, 2, axis=0), axis=0),
        at + 2 + 2 * np.arange(len(at)),
    )
    lines: list[Any] = [
        shapely.linestrings(each - (360.0 * (each[:, 0] > 180.0).any(), 0.0)) for each in pieces
    ]
    return [shapely.remove_repeated_points(each) for each in lines if each.length > 0.0]


def _as_one(whole: Any) -> Any:
    parts = shapely.get_parts(whole)
    if len(parts) == 1:
        return whole
    parts = shapely.transform(parts, _on_the_meridian)
    if whole.geom_type != "MultiLineString":
        return shapely.union_all(parts)
    runs = [shapely.get_coordinates(parts[0])]
    for legs in map(shapely.get_coordinates, parts[1:]):
        met = np.abs(legs[0] - runs[-1][-1]).max() < _SNAP_DEG and legs[0, 0] == 180.0
        runs = [*runs[:-1], np.concatenate([runs[-1], legs[1:]])] if met else [*runs, legs]
    # Of other programs, the parts may be in any order.
    lines: list[Any] = [shapely.linestrings(run) for run in runs]
    return shapely.line_merge(shapely.multilinestrings(lines))


def _positive(lonlat: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.column_stack(
        [np.where(lonlat[:, 0] < 0, lonlat[:, 0] + 360, lonlat[:, 0]), lonlat[:, 1]]
    )


def _on_the_meridian(lonlat: NDArray[np.float64]) -> NDArray[np.float64]:
    near = np.abs(lonlat[:, 0] - 180.0) < _SNAP_DEG
    return np.column_stack([np.where(near, 180.0, lonlat[:, 0]), lonlat[:, 1]])


def _collected(pieces: list[Any]) -> Any:
    """The pieces of both sides as one shape; what only touches the meridian has no piece."""
    parts = shapely.get_parts(np.array(pieces))
    dimensions = shapely.get_dimensions(parts)
    parts = parts[dimensions == dimensions.max()]
    if len(parts) == 1:
        return parts[0]
    whole = shapely.multipolygons if dimensions.max() == 2 else shapely.multilinestrings
    return whole(parts)
