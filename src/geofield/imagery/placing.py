"""Where a picture lies, and whether it must be reprojected to be looked at.

A grid in any CRS, rotated or not, is used as it is. A picture is put on square metres only
where its pixels are not square on the ground, or where only control points place it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from affine import Affine
from numpy.typing import NDArray
from pyproj import CRS
from rasterio.transform import from_gcps
from rasterio.vrt import WarpedVRT
from rasterio.windows import Window

from geofield.crs import LONLAT, metric_crs, transformer
from geofield.datum import datum_notes
from geofield.errors import CRSError
from geofield.grid import Grid
from geofield.imagery.gdal import display_name, to_rasterio
from geofield.model.scene import outside

#: Sides of a ground pixel may differ by this factor before the picture is reprojected.
MAX_ASPECT = 1.1
#: The angle between a pixel's sides may differ from a right angle by this many degrees.
MAX_SKEW_DEG = 3.0
#: A reprojected picture reaches this far from the point: one UTM zone does not hold a country.
REACH_M = 10_000.0

#: Longitude and latitude, degrees.
LonLat = tuple[float, float]


@dataclass(frozen=True, slots=True)
class WarpOrigin:
    """How the file itself is placed, for a picture that is read through a reprojection.

    Without a grid its ground control points place it.
    """

    crs: CRS
    grid: Grid | None = None

    def window(self, shape: tuple[int, int], grid: Grid) -> Window:
        """The pixels of the file, of `shape` (rows, columns), that a reprojected grid shows."""
        height, width = shape
        whole = Window(0, 0, width, height)
        if self.grid is None:
            return whole
        edge = np.linspace(0.0, 1.0, 9)
        x, y = (each.ravel() for each in np.meshgrid(edge * grid.width_px, edge * grid.height_px))
        x, y = self.grid.from_crs(*grid.to_crs(x, y, self.crs), self.crs)
        if not (np.isfinite(x).all() and np.isfinite(y).all()):
            return whole
        # Between the places looked at, and to sample between pixels, a little more is shown.
        (left, right), (top, bottom) = (
            np.clip((np.floor(v.min()) - 2, np.ceil(v.max()) + 2), 0, side).astype(int).tolist()
            for v, side in ((x, width), (y, height))
        )
        return Window(left, top, right - left, bottom - top)


@dataclass(frozen=True, slots=True)
class Place:
    """The grid a picture is read on; `warped_from` is None when that is its own grid."""

    grid: Grid
    warped_from: WarpOrigin | None = None
    notes: tuple[str, ...] = ()
    guesses: tuple[str, ...] = ()


def refuse_unplaced(dataset: Any) -> None:
    """Refuse a file that does not say where its pixels lie, whatever CRS it or a person names.

    Raises
    ------
    CRSError
    """
    if dataset.transform.is_identity and len(dataset.gcps[0]) < 3:
        raise CRSError(
            f"The picture {display_name(dataset.name)} has no position on the ground.",
            hint="Georeference it (QGIS: Layer > Georeferencer), or put its world file beside.",
        )


def find_place(dataset: Any, crs: CRS, *, point: LonLat | None = None) -> Place:
    """The grid on which an open raster dataset is read; `crs` is its own or what the user says.

    At `point` the ground pixel is measured and a reprojection is centred; else at the centre.

    Raises
    ------
    CRSError
        A CRS that is not one of maps.
    PointOutsideError
        A picture to be reprojected does not hold the point.
    """
    gcps, _ = dataset.gcps
    transform = Affine(*tuple(dataset.transform)[:6])
    if crs.is_geocentric or crs.is_vertical or crs.is_engineering:
        raise CRSError(
            f"{crs.name} is not the CRS of a map.",
            hint="Reproject the picture first, or name its CRS, for instance --crs EPSG:32633 "
            "(UTM zone 33 north).",
        )
    if transform.is_identity:
        rough = Grid(dataset.width, dataset.height, from_gcps(gcps), crs)
        target = metric_crs(*rough.centre_lonlat)
        # GDAL fits the control points only on a grid of its own choice.
        with WarpedVRT(dataset, src_crs=to_rasterio(crs), crs=to_rasterio(target)) as warped:
            grid = Grid(warped.width, warped.height, warped.transform, target)
        guess = f"Placed by its {len(gcps)} ground control points alone."
        told = datum_notes(crs, *rough.to_native(0, 0))
        return Place(grid, WarpOrigin(crs), guesses=(guess, *told))
    native = Grid(dataset.width, dataset.height, transform, crs)
    aspect, skew_deg = pixel_shape(native, point)
    guesses = datum_notes(crs, *native.to_native(native.width_px / 2, native.height_px / 2))
    if aspect <= MAX_ASPECT and skew_deg <= MAX_SKEW_DEG:
        return Place(native, guesses=guesses)
    why = f"its pixels are skewed by {skew_deg:.0f} degrees"
    if aspect > MAX_ASPECT:
        why = f"its pixels are {aspect:.2f} times longer one way"
    grid = square_grid(native, point)
    note = f"Reprojected from {crs.name} to {grid.crs.name}: {why} on the ground."
    return Place(grid, WarpOrigin(crs, native), (note,), guesses)


def pixel_shape(grid: Grid, point: LonLat | None = None) -> tuple[float, float]:
    """How far a ground pixel is from a square, at a point or the centre.

    Its longer side by the shorter one, and how far the angle between them is from a right one,
    degrees.
    """
    x, y = grid.width_px / 2, grid.height_px / 2
    if point is not None:
        px, py = grid.from_lonlat(*point)
        if grid.contains_px(px, py):
            x, y = px, py
    along, across, turn = grid.pixel_sides(x, y)
    if not min(along, across) > 0:
        raise CRSError(
            f"The picture's centre is not a place on earth in {grid.crs.name}.",
            hint="Check the picture's transform and CRS with `gdalinfo`.",
        )
    aspect = max(along, across) / min(along, across)
    return float(aspect), float(abs(np.degrees(turn) % 180.0 - 90.0))


def border_px(grid: Grid, per_side: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Columns and rows of places along the border of a grid, corners included."""
    edge, zero, one = np.linspace(0.0, 1.0, per_side), np.zeros(per_side), np.ones(per_side)
    x, y = np.concatenate([edge, one, edge, zero]), np.concatenate([zero, edge, one, edge])
    return x * grid.width_px, y * grid.height_px


def square_grid(native: Grid, point: LonLat | None) -> Grid:
    """Square metres over a picture: around the point, in its metric CRS, else around its centre."""
    here = native.centre_lonlat if point is None else point
    local = native
    if point is not None:
        lon, lat = point
        x, y = native.from_lonlat(lon, lat)
        if not native.contains_px(x, y):
            raise outside(native, lat, lon)
        local = native.crop(int(x), int(y), 1, 1)
    target = metric_crs(*here)
    aspect, _ = pixel_shape(local)
    # The finer of the two sides, so that no detail is lost.
    resolution = float(f"{local.ground_resolution_m / np.sqrt(aspect):.4g}")
    xs, ys = native.to_crs(*border_px(native, 33), target)
    cx, cy = transformer(LONLAT, target).transform(*here)
    finite = np.isfinite(xs) & np.isfinite(ys)
    xs = np.clip(np.append(xs[finite], cx), cx - REACH_M, cx + REACH_M)
    ys = np.clip(np.append(ys[finite], cy), cy - REACH_M, cy + REACH_M)
    west = np.floor(xs.min() / resolution) * resolution
    north = np.ceil(ys.max() / resolution) * resolution
    return Grid(
        int(np.ceil((xs.max() - west) / resolution)) or 1,
        int(np.ceil((north - ys.min()) / resolution)) or 1,
        Affine(resolution, 0, float(west), 0, -resolution, float(north)),
        target,
    )
