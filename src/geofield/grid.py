"""Grid: where a raster lies, as a value without pixels.

Pixel coordinates are continuous, x to the right and y down, with the origin at the
top-left *corner* of the top-left pixel, whose centre is therefore (0.5, 0.5).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from affine import Affine
from numpy.typing import ArrayLike, NDArray
from pyproj import CRS

from geofield.crs import (
    LONLAT,
    WEB_MERCATOR,
    WEB_MERCATOR_MAX_LAT,
    authority_name,
    cross,
    metric_crs,
    parse_crs,
    transformer,
)
from geofield.errors import CRSError, GridError, is_truth, refuse_no_number

#: Radius of the Web Mercator sphere, metres (METHOD.md, section 1).
EARTH_RADIUS_M = 6378137.0
TILE_SIZE_PX = 256
MAX_ZOOM = 22

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class Grid:
    """Shape, affine transform and CRS of a raster.

    >>> grid = gf.read_scene("sample_data/field_1.tif").grid
    >>> grid.width_px, grid.crs.to_epsg()
    (480, 32636)

    Parameters
    ----------
    width_px, height_px : int
        Columns and rows.
    transform : Affine
        From pixel (x, y) to the CRS's (x, y); may be rotated.
    crs : CRS
        Anything `pyproj.CRS` understands.

    Notes
    -----
    What its methods take: `x_px`, `y_px` are pixel coordinates from the corner of the top-left
    pixel, `column`, `row` whole ones, `width_px`, `height_px` counts of pixels; `x`, `y` lie in
    a `crs` (anything `pyproj.CRS` understands), `lon`, `lat` are degrees in WGS 84; numbers or
    arrays. `coordinates` are rows of pixel coordinates, or of the metric CRS.
    """

    width_px: int
    height_px: int
    transform: Affine
    crs: CRS

    if TYPE_CHECKING:  # made from anything that says a CRS, which its own type does not tell

        def __init__(self, width_px: int, height_px: int, transform: Affine, crs: Any) -> None: ...

    def __post_init__(self) -> None:
        sides: dict[str, Any] = {"width_px": self.width_px, "height_px": self.height_px}
        refuse_no_number(GridError, "pixels", whole=True, **sides)
        for name, side in sides.items():
            object.__setattr__(self, name, int(side))
        object.__setattr__(self, "crs", parse_crs(self.crs))
        try:
            numbers = tuple(self.transform)[:6]
            if any(map(is_truth, numbers)):
                raise TypeError("True is no number of a transform")
            object.__setattr__(self, "transform", Affine(*numbers))
        except (TypeError, ValueError):
            raise GridError(
                f"transform is {self.transform!r}; it must be an Affine, or its six numbers."
            ) from None
        if self.width_px < 1 or self.height_px < 1:
            raise GridError(f"A grid of {self.width_px} x {self.height_px} px has no pixels.")
        if not all(map(math.isfinite, self.transform[:6])) or self.transform.determinant == 0:
            raise GridError(
                f"The transform {tuple(self.transform)[:6]} cannot be inverted.",
                hint="Georeference the picture anew (QGIS: Layer > Georeferencer).",
            )

    def __repr__(self) -> str:
        lon, lat = self.centre_lonlat
        return (
            f"<Grid {self.width_px} x {self.height_px} px, {authority_name(self.crs)}\n"
            f"  {self.ground_resolution_m:.3g} m per pixel around lat {lat:.5f}, lon {lon:.5f}>"
        )

    @classmethod
    def web_mercator(
        cls, *, lat: float, lon: float, zoom: int, width_px: int = 640, height_px: int = 640
    ) -> Grid:
        """The grid of a Web Mercator picture with a point exactly at its centre.

        Parameters
        ----------
        lat, lon : float
            The centre, degrees, WGS 84.
        zoom : int
            0 to 22; the world is ``256 * 2**zoom`` pixels wide (METHOD.md, equation 1).
        width_px, height_px : int
            Size of the picture.
        """
        refuse_no_number(GridError, "degrees", lat=lat, lon=lon)
        refuse_no_number(GridError, f"0 to {MAX_ZOOM}", whole=True, zoom=zoom)
        refuse_no_number(GridError, "pixels", whole=True, width_px=width_px, height_px=height_px)
        if not 0 <= zoom <= MAX_ZOOM:
            raise GridError(f"Zoom {zoom} does not exist.", hint=f"Use 0 to {MAX_ZOOM}.")
        if not abs(lat) <= WEB_MERCATOR_MAX_LAT:
            raise GridError(
                f"Latitude {lat} lies outside Web Mercator.",
                hint=f"It ends at {WEB_MERCATOR_MAX_LAT:.4f} degrees.",
            )
        if not abs(lon) <= 180.0:
            raise GridError(f"Longitude {lon} is not between -180 and 180 degrees.")
        resolution = web_mercator_resolution(zoom)
        x, y = transformer(LONLAT, WEB_MERCATOR).transform(lon, lat)
        west, north = x - resolution * width_px / 2, y + resolution * height_px / 2
        return cls(
            width_px, height_px, Affine(resolution, 0, west, 0, -resolution, north), WEB_MERCATOR
        )

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns, the order of arrays."""
        return self.height_px, self.width_px

    def crop(self, column: int, row: int, width_px: int, height_px: int) -> Grid:
        """The part that starts at a column and row (equation 4); it may reach outside."""
        refuse_no_number(GridError, "pixels", column=column, row=row)
        return Grid(width_px, height_px, self.transform @ Affine.translation(column, row), self.crs)

    def resized(self, width_px: int, height_px: int) -> Grid:
        """The same ground cut into another number of pixels."""
        resized = Grid(width_px, height_px, self.transform, self.crs)
        scale = Affine.scale(self.width_px / width_px, self.height_px / height_px)
        return replace(resized, transform=self.transform @ scale)

    # -- pixel <-> ground ------------------------------------------------------------

    def to_native(self, x_px: ArrayLike, y_px: ArrayLike) -> tuple[Any, Any]:
        """Pixel coordinates to the grid's own CRS; scalars or arrays."""
        a, b, c, d, e, f = self.transform[:6]
        x, y = np.asarray(x_px, float), np.asarray(y_px, float)
        return _like(a * x + b * y + c), _like(d * x + e * y + f)

    def from_native(self, x: ArrayLike, y: ArrayLike) -> tuple[Any, Any]:
        """Coordinates in the grid's own CRS to pixel coordinates."""
        a, b, c, d, e, f = self.transform[:6]
        # Subtract the origin first: it is large, and the inverse's own offset would lose digits.
        dx, dy = np.asarray(x, float) - c, np.asarray(y, float) - f
        determinant = a * e - b * d
        return _like((e * dx - b * dy) / determinant), _like((a * dy - d * dx) / determinant)

    def to_crs(self, x_px: ArrayLike, y_px: ArrayLike, crs: Any) -> tuple[Any, Any]:
        """Pixel coordinates to any CRS, x before y."""
        x, y = self.to_native(x_px, y_px)
        target = parse_crs(crs)
        if target == self.crs:
            return x, y
        x, y = transformer(self.crs, target).transform(x, y)
        return _like(np.asarray(x)), _like(np.asarray(y))

    def from_crs(self, x: ArrayLike, y: ArrayLike, crs: Any) -> tuple[Any, Any]:
        """Coordinates in any CRS, x before y, to pixel coordinates."""
        source = parse_crs(crs)
        if source != self.crs:
            x, y = transformer(source, self.crs).transform(np.asarray(x, float), np.asarray(y))
        if self._turn:
            # Across the antimeridian one place has two values of x: take the nearer one.
            middle, _ = self.to_native(self.width_px / 2, self.height_px / 2)
            x = np.asarray(x, float)
            away = (x - middle) / self._turn
            x = x - self._turn * np.round(np.where(np.isfinite(away), away, 0.0))
        return self.from_native(x, y)

    @cached_property
    def _turn(self) -> float:
        """Once around the earth in units of x, where x runs with the longitude; else 0."""
        if self.crs == WEB_MERCATOR:
            return 2.0 * math.pi * EARTH_RADIUS_M
        if self.crs.is_geographic:
            return 2.0 * math.pi / float(self.crs.axis_info[0].unit_conversion_factor)
        return 0.0

    def to_lonlat(self, x_px: ArrayLike, y_px: ArrayLike) -> tuple[Any, Any]:
        """Pixel coordinates to longitude (-180 to 180) and latitude, degrees, WGS 84."""
        lon, lat = self.to_crs(x_px, y_px, LONLAT)
        lon = np.array(lon)
        # Longitudes of a picture's own CRS run on beyond the 180th meridian.
        beyond = np.isfinite(lon) & (np.abs(lon) > 180.0)
        lon[beyond] -= 360.0 * np.round(lon[beyond] / 360.0)
        return _like(lon), lat

    def from_lonlat(self, lon: ArrayLike, lat: ArrayLike) -> tuple[Any, Any]:
        """Longitude and latitude, degrees, WGS 84, to pixel coordinates."""
        return self.from_crs(lon, lat, LONLAT)

    def contains_px(self, x_px: float, y_px: float) -> bool:
        """Whether a pixel position lies inside; positions that are not finite do not."""
        return 0.0 <= x_px < self.width_px and 0.0 <= y_px < self.height_px

    def to_metric_array(self, coordinates: FloatArray) -> FloatArray:
        """Pixel coordinates (n, 2) to the metric CRS (n, 2): made for `shapely.transform`."""
        x, y = self.to_crs(coordinates[:, 0], coordinates[:, 1], self.metric_crs)
        return np.column_stack([x, y])

    # -- sizes on the ground -----------------------------------------------------------

    @cached_property
    def centre_lonlat(self) -> tuple[float, float]:
        """Longitude and latitude of the centre, degrees."""
        lon, lat = self.to_lonlat(self.width_px / 2, self.height_px / 2)
        if not (math.isfinite(lon) and math.isfinite(lat)):
            raise CRSError(
                f"The picture's centre is not a place on earth in {self.crs.name}.",
                hint="Check the picture's transform and CRS with `gdalinfo`.",
            )
        return float(lon), float(lat)

    @cached_property
    def metric_crs(self) -> CRS:
        """The CRS in which lengths here are measured (see `geofield.crs.metric_crs`)."""
        return metric_crs(*self.centre_lonlat, own=self.crs)

    @cached_property
    def ground_resolution_m(self) -> float:
        """Metres per pixel on the ground at the centre (on the WGS 84 ellipsoid).

        The side of the square with the pixel's area, from geodesic lengths. The study's
        equation (3) measures on a sphere; it differs by up to 0.4 %.
        """
        return float(self.resolution_at(self.width_px / 2, self.height_px / 2))

    def resolution_at(self, x_px: ArrayLike, y_px: ArrayLike) -> Any:
        """Metres per pixel on the ground at pixel positions; scalars or arrays."""
        along, across, turn = self.pixel_sides(x_px, y_px)
        return _like(np.sqrt(along * across * np.abs(np.sin(turn))))

    def pixel_sides(self, x_px: ArrayLike, y_px: ArrayLike) -> tuple[Any, Any, Any]:
        """The sides of pixels around positions, metres on the ground, and their angle, radians."""
        x, y = np.asarray(x_px, float), np.asarray(y_px, float)
        lon, lat = self.to_lonlat(
            np.stack([x - 0.5, x + 0.5, x, x]), np.stack([y, y, y - 0.5, y + 0.5])
        )
        return cross(lon, lat)

    def corners_lonlat(self) -> list[tuple[float, float]]:
        """The four corners, clockwise from the top-left, as (lon, lat) in degrees."""
        w, h = self.width_px, self.height_px
        lon, lat = self.to_lonlat(np.array([0, w, w, 0]), np.array([0, 0, h, h]))
        return list(zip(lon.tolist(), lat.tolist(), strict=True))


def _like(value: FloatArray) -> Any:
    """A Python float for a scalar, the array itself otherwise."""
    return value.item() if np.ndim(value) == 0 else value


def web_mercator_resolution(zoom: int) -> float:
    """The study's equation (2): EPSG:3857 metres per pixel, true metres at the equator only."""
    return 2.0 * math.pi * EARTH_RADIUS_M / (TILE_SIZE_PX * 2.0**zoom)
