"""Coordinate reference systems: lon/lat, the metric CRS of a place, true metres in it.

Positions for people are WGS 84 longitude and latitude in degrees, in this order. Geometry is
stored in the *metric CRS*, the UTM zone of the field. Its unit is not quite a metre on the
ground: a zone is 0.04 % too short along its middle and up to 0.1 % too long at its edges.
Every length, width and area that a person sees or a machine drives is in true ground metres
(on the WGS 84 ellipsoid); :func:`ground_scale` is what lies between the two.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from pyproj import CRS, Geod, Transformer
from pyproj.exceptions import CRSError as ProjCRSError
from pyproj.exceptions import ProjError

from geofield.errors import CRSError

LONLAT = CRS.from_epsg(4326)
WEB_MERCATOR = CRS.from_epsg(3857)
#: One map of all fields (PDC Mercator): its seam runs through the Atlantic, not along 180 degrees.
PACIFIC = CRS.from_epsg(3832)

#: Lengths, directions and areas on the ground.
GEOD = Geod(ellps="WGS84")
#: Metres of a degree on the equator: others are shorter.
DEGREE_M = math.tau * GEOD.a / 360
#: Arms of the cross that the scale is measured with: long against the digits of a coordinate,
#: short against the earth.
_ARM_M = 50.0
#: A CRS may stretch lengths by so much more one way than the other: datums differ by less.
_UNEVEN = 1e-4

#: Latitude at which the Web Mercator square ends, degrees.
WEB_MERCATOR_MAX_LAT = 85.0511287798066


def parse_crs(value: Any) -> CRS:
    """Any CRS description (EPSG code, WKT, PROJ string, CRS object) as a `pyproj.CRS`.

    Raises
    ------
    CRSError
        When there is none, or PROJ does not know it.
    """
    if value is None:
        raise CRSError(
            "There is no coordinate reference system.", hint="Name one, for instance EPSG:32633."
        )
    try:
        # Of numpy's text PROJ makes "EPSG:EPSG:32633".
        return _named(str(value)) if isinstance(value, str) else CRS.from_user_input(value)
    except ProjCRSError as error:
        raise CRSError(
            f"Unknown coordinate reference system {str(value)[:80]!r}.",
            hint="Give an EPSG code such as EPSG:32633, or WKT.",
        ) from error


@lru_cache(maxsize=256)
def _named(text: str) -> CRS:
    """A CRS by its text, made once: that takes longer than to plan a field."""
    return CRS.from_user_input(text)


def utm_crs(lon: float, lat: float) -> CRS:
    """The WGS 84 UTM zone of a place in degrees; the polar stereographic CRS beyond 84 N and 80 S.

    The zone grid has the standard exceptions for south-west Norway (32V) and Svalbard.
    """
    if not (math.isfinite(lon) and math.isfinite(lat) and abs(lat) <= 90 and abs(lon) <= 360):
        raise CRSError(
            f"lon {lon}, lat {lat} is not a place on earth.",
            hint="Longitude is -180 to 180, latitude -90 to 90 degrees.",
        )
    lon = (lon + 180.0) % 360.0 - 180.0
    if lat >= 84.0:
        return _named("EPSG:5041")
    if lat < -80.0:
        return _named("EPSG:5042")
    zone = int((lon + 180.0) // 6.0) + 1
    if 56.0 <= lat < 64.0 and 3.0 <= lon < 12.0:
        zone = 32
    elif lat >= 72.0 and 0.0 <= lon < 42.0:
        zone = 31 + 2 * int((lon + 3.0) // 12.0)
    return _named(f"EPSG:{(32600 if lat >= 0 else 32700) + zone}")


def is_utm(crs: CRS) -> bool:
    """Whether a CRS is a UTM zone in metres, of whatever datum."""
    return crs.utm_zone is not None and is_metric(crs)


def is_metric(crs: CRS) -> bool:
    """Whether a CRS is projected, in metres, and not the length-stretching Web Mercator."""
    return (
        crs.is_projected
        and all(axis.unit_conversion_factor == 1.0 for axis in crs.axis_info[:2])
        and "pseudo" not in crs.name.lower()
        and "web mercator" not in crs.name.lower()
    )


def metre_in(crs: Any) -> float:
    """A metre in the unit of a CRS; about, where that is degrees."""
    return 1.0 / DEGREE_M if CRS(crs).is_geographic else 1.0


def metric_crs(lon: float, lat: float, own: CRS | None = None) -> CRS:
    """The CRS in which lengths at a place (degrees, WGS 84) are measured.

    Where `own`, the CRS of the data, is a UTM zone already (for instance NAD83 or ETRS89) it is
    kept, so that outlines stay exactly on the picture's pixels.
    """
    if own is not None and is_utm(own):
        return own
    return utm_crs(lon, lat)


@lru_cache(maxsize=256)
def _transformer(source: str, target: str) -> Transformer:
    return Transformer.from_crs(CRS(source), CRS(target), always_xy=True)


def transformer(source: CRS, target: CRS) -> Transformer:
    """A transformer between two CRS; always x (easting, longitude) before y.

    Raises
    ------
    CRSError
        PROJ cannot make one, as for a description that a damaged file gave.
    """
    try:
        return _transformer(source.srs, target.srs)
    except ProjError as error:
        raise CRSError(
            f"Coordinates cannot be brought from {source.name[:80]!r} to {target.name[:80]!r}.",
            hint="Is the file whole that says them? Name another system.",
        ) from error


def reproject(geometry: Any, source: CRS, target: CRS) -> Any:
    """A geometry, or an array of them, vertex by vertex from one CRS to another, without heights.

    x (easting, longitude) comes before y, as everywhere in geofield.
    """
    if source is target or source == target:
        return geometry
    project = transformer(source, target)
    return shapely.transform(
        geometry, lambda xy: np.column_stack(project.transform(xy[:, 0], xy[:, 1]))
    )


def authority_name(crs: CRS) -> str:
    """A short name for people and files: ``EPSG:32633``, else the CRS's own name."""
    authority = crs.to_authority(min_confidence=100)
    return ":".join(authority) if authority else str(crs.name)


def northing_first(crs: CRS) -> bool:
    """Whether the authority lists northing (or latitude) before easting.

    WKT literals, WMS 1.3 boxes and WMTS corners follow the authority's order; geofield's arrays
    are always x before y. Both axes of a polar system point the same way, along different
    meridians: there only their names tell (EPSG:5041 is easting first, EPSG:32661 is not).
    """
    axes = crs.axis_info[:2]
    directions = [str(axis.direction).lower() for axis in axes]
    if len(set(directions)) == 1:
        return str(axes[0].name).lower().startswith("northing")
    return directions[:1] == ["north"]


def grid_north_deg(crs: CRS, x: float, y: float) -> float:
    """The true heading of grid north at a place in a projected CRS, degrees clockwise.

    A heading measured in the grid becomes a true heading by adding this angle (the meridian
    convergence; up to about 2 degrees within a UTM zone at mid latitudes).
    """
    lon, lat = transformer(crs, LONLAT).transform([x, x], [y - 50.0, y + 50.0])
    azimuth, _, _ = GEOD.inv(lon[0], lat[0], lon[1], lat[1])
    return float(azimuth)


def ground_scale(crs: CRS, x: ArrayLike, y: ArrayLike) -> Any:
    """How many units of a projected CRS in metres one true metre on the ground is, at places in it.

    The side of the square with a square metre's area, from geodesics of a hundred metres, so that
    the datum counts as well; good to 1e-10. Over a field the scale of its middle is enough: half a
    kilometre from there it differs by less than 5 millionths.

    Raises
    ------
    CRSError
        Places are outside the CRS's area, or no one scale holds there in all directions.
    """
    at_x, at_y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    lon, lat = transformer(crs, LONLAT).transform(
        np.stack([at_x - _ARM_M, at_x + _ARM_M, at_x, at_x]),
        np.stack([at_y, at_y, at_y - _ARM_M, at_y + _ARM_M]),
    )
    refuse_outside(crs, lon, lat)
    along, across, turn = cross(lon, lat)
    # The axes of the ellipse that a circle becomes; a conformal CRS leaves it one.
    apart = np.hypot((along / across - across / along) / 2.0, np.cos(turn))
    middle = (along / across + across / along) / 2.0
    uneven = np.sqrt((middle + apart) / (middle - apart)).max(initial=1.0) - 1.0
    if uneven > _UNEVEN:
        raise CRSError(
            f"{authority_name(crs)} stretches lengths here by {uneven:.2%} more one way than the "
            "other: distances and directions in it are not those on the ground.",
            hint="Reproject to the UTM zone: GeoSeries.to_crs(series.estimate_utm_crs()).",
        )
    scale = 2.0 * _ARM_M / np.sqrt(along * across * np.abs(np.sin(turn)))
    return float(scale) if scale.ndim == 0 else scale


def refuse_outside(crs: CRS, *brought: ArrayLike, what: str = "Coordinates") -> None:
    """Refuse places in a CRS whose coordinates are not finite where they were brought to another.

    `what` says whose they are.

    Raises
    ------
    CRSError
    """
    if not all(np.isfinite(each).all() for each in brought):
        raise CRSError(
            f"{what} are outside the area of {authority_name(crs)}.",
            hint="Check the CRS: the data may be in another one.",
        )


def cross(lon: Any, lat: Any) -> tuple[Any, Any, Any]:
    """The lengths of two geodesics, metres, and the angle between them, radians.

    The ends of the first are in the first two rows, those of the second, across it, in the others.
    """
    azimuth_x, _, along_x = GEOD.inv(lon[0], lat[0], lon[1], lat[1])
    azimuth_y, _, along_y = GEOD.inv(lon[2], lat[2], lon[3], lat[3])
    turn = np.radians(np.subtract(azimuth_y, azimuth_x))
    return np.asarray(along_x), np.asarray(along_y), turn


def ground_scale_of(shapes: Any, crs: CRS) -> Any:
    """The :func:`ground_scale` at the middle (the centroid) of one geometry, or of each of many."""
    middle = shapely.centroid(shapes)
    return ground_scale(crs, shapely.get_x(middle), shapely.get_y(middle))


def ground_areas_m2(shapes: Any, crs: CRS) -> NDArray[np.float64]:
    """True areas of geometries in a metric CRS, square metres on the ground."""
    return _on_the_ground(shapely.area, shapes, crs, 2)


def areas_anywhere_m2(shapes: Any, crs: CRS) -> NDArray[np.float64]:
    """True areas of geometries in any CRS, each measured in the metric CRS of its place."""
    found = np.asarray(shapes, dtype=object)
    areas = np.zeros(len(found))
    some = np.flatnonzero(shapely.area(found) > 0.0)
    # A corner, not the middle: in degrees that is far off where a shape reaches over 180.
    corners, row = shapely.get_coordinates(found[some], return_index=True)
    first = corners[np.searchsorted(row, np.arange(len(some)))]
    lon, lat = transformer(crs, LONLAT).transform(first[:, 0], first[:, 1])
    own = crs if is_utm(crs) else None
    zones = np.array([metric_crs(*place, own).srs for place in zip(lon, lat, strict=True)])
    for zone in np.unique(zones):
        mine, metric = some[zones == zone], parse_crs(str(zone))
        areas[mine] = ground_areas_m2(reproject(found[mine], crs, metric), metric)
    return areas


def ground_lengths_m(shapes: Any, crs: CRS) -> NDArray[np.float64]:
    """True lengths of lines, and of the borders of polygons, metres on the ground."""
    return _on_the_ground(shapely.length, shapes, crs, 1)


def _on_the_ground(measure: Any, shapes: Any, crs: CRS, power: int) -> NDArray[np.float64]:
    found = np.asarray(shapes, dtype=object)
    sizes = np.asarray(measure(found))
    # What has no size (a missing or empty geometry) has no middle either.
    some = sizes > 0.0
    sizes[some] /= ground_scale_of(found[some], crs) ** power
    return sizes
