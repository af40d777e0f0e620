"""Tile pyramids: how a map is cut into tiles at each zoom, and blocks of tiles.

A pyramid has a CRS and levels; a level is a raster of the whole map, cut into tiles. Web
Mercator's ``z/x/y`` scheme, WMTS tile matrix sets and windows of a WMS are all pyramids.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from affine import Affine
from pyproj import CRS
from shapely.geometry.base import BaseGeometry

from geofield.crs import WEB_MERCATOR, WEB_MERCATOR_MAX_LAT
from geofield.errors import ImageryError
from geofield.grid import EARTH_RADIUS_M, MAX_ZOOM, Grid

_WORLD_M = 2.0 * math.pi * EARTH_RADIUS_M


@dataclass(frozen=True, slots=True)
class Tile:
    """One tile: zoom, column from the west, row from the north."""

    zoom: int
    column: int
    row: int


@dataclass(frozen=True, slots=True)
class TileLevel:
    """One zoom of a pyramid."""

    zoom: int
    #: CRS units per pixel.
    resolution: float
    #: left, top: the corner of tile (0, 0) in the CRS.
    left: float
    top: float
    #: columns, rows: tiles of the whole map.
    columns: int
    rows: int
    #: Width and height of a tile.
    tile_px: tuple[int, int] = (256, 256)
    #: The service's own name of the level (WMTS).
    identifier: str = ""
    #: Whether column `columns` is column 0 again, all around the earth.
    wraps: bool = False

    @property
    def scheme_zoom(self) -> int:
        """The zoom in the ``z/x/y`` scheme, by which MBTiles files count."""
        return self.columns.bit_length() - 1 if self.wraps else self.zoom

    def grid(self, column: int, row: int, width_px: int, height_px: int, crs: CRS) -> Grid:
        """The grid that starts at a pixel of the level."""
        # One product from the corner, so that tiles get the same bounds however they are met.
        step = self.resolution
        corner = self.left + column * step, self.top - row * step
        transform = Affine(step, 0.0, corner[0], 0.0, -step, corner[1])
        return Grid(width_px, height_px, transform, crs)

    def to_px(self, x: float, y: float) -> tuple[float, float]:
        """A position in the CRS to continuous pixels of the level."""
        return (x - self.left) / self.resolution, (self.top - y) / self.resolution


@dataclass(frozen=True, slots=True)
class TilePyramid:
    """A CRS and its levels, coarse to fine."""

    crs: CRS
    levels: tuple[TileLevel, ...]

    @classmethod
    def web_mercator(
        cls, min_zoom: int = 0, max_zoom: int = MAX_ZOOM, tile_px: int = 256, *, shift: int = 0
    ) -> TilePyramid:
        """The ``z/x/y`` scheme of web maps; 512 px tiles (@2x) cover the same ground.

        Zoom z takes the tiles of scheme zoom z - `shift`: with ``tile_px=512, shift=1`` a zoom
        has its usual resolution in tiles twice as wide.
        """
        levels = []
        for zoom in range(max(min_zoom, shift), max_zoom + 1):
            count, half, size = 2 ** (zoom - shift), _WORLD_M / 2, (tile_px, tile_px)
            corner = (_WORLD_M / count / tile_px, -half, half)
            levels.append(TileLevel(zoom, *corner, count, count, size, str(zoom), wraps=True))
        return cls(WEB_MERCATOR, tuple(levels))

    @classmethod
    def metric(cls, crs: CRS, tile_px: int) -> TilePyramid:
        """Levels over a projected CRS: windows of a WMS that stay put.

        From 256 to 0.125 units per pixel, each half of the one before.
        """
        reach, levels = 2.0**24, []
        for zoom in range(12):
            resolution = 2.0 ** (8 - zoom)
            tiles = math.ceil(2 * reach / resolution / tile_px)
            size = (tile_px, tile_px)
            levels.append(TileLevel(zoom, resolution, -reach, reach, tiles, tiles, size))
        return cls(crs, tuple(levels))

    @property
    def zooms(self) -> tuple[int, int]:
        """Coarsest and finest zoom."""
        return self.levels[0].zoom, self.levels[-1].zoom

    def level(self, zoom: int) -> TileLevel:
        """The level of a zoom; an error where the source does not have it."""
        for level in self.levels:
            if level.zoom == zoom:
                return level
        low, high = self.zooms
        raise ImageryError(
            f"The source has no zoom {zoom}.", hint=f"It has {low} to {high}; try --zoom {high}."
        )

    def ground_resolution_m(self, zoom: int, *, lat: float, lon: float) -> float:
        """Metres per pixel on the ground at a place."""
        level = self.level(zoom)
        x, y = self._position(lat, lon)
        column, row = level.to_px(x, y)
        return level.grid(int(column), int(row), 1, 1, self.crs).ground_resolution_m

    def zoom_for(self, resolution_m: float, *, lat: float, lon: float) -> int:
        """The coarsest zoom at least as fine as a ground resolution; else the finest there is."""
        if not resolution_m > 0:
            raise ImageryError(f"A resolution of {resolution_m} m does not exist.")
        for level in self.levels:
            # A thousandth of leave: 0.6 m is what 0.5999 m was meant to be.
            if self.ground_resolution_m(level.zoom, lat=lat, lon=lon) <= resolution_m * 1.001:
                return level.zoom
        return self.levels[-1].zoom

    def zoom_to_fit(self, area: BaseGeometry, frame_px: int) -> int:
        """The largest zoom at which an area (lon/lat degrees) still fits a square frame."""
        for level in reversed(self.levels):
            left, top, right, bottom = self._bounds_px(level, area)
            if max(right - left, bottom - top) <= frame_px:
                return level.zoom
        return self.levels[0].zoom

    def block_around(
        self,
        zoom: int,
        *,
        lat: float,
        lon: float,
        size_px: int | None = None,
        size_m: float | None = None,
        whole_tiles: bool = False,
    ) -> Block:
        """The tiles under a square of 640 pixels, or of a size, around a point (degrees, WGS 84).

        The picture is cut on the level's own pixel edges, so nothing is resampled: the point
        lies within half a pixel of its centre. `whole_tiles` keeps every pixel of them instead.
        """
        level = self.level(zoom)
        x, y = level.to_px(*self._position(lat, lon))
        if size_m is not None:
            if not size_m > 0:
                raise ImageryError(f"A picture of {size_m} m shows nothing.")
            size_px = max(1, round(size_m / self.ground_resolution_m(zoom, lat=lat, lon=lon)))
        size_px = 640 if size_px is None else size_px
        if size_px < 1:
            raise ImageryError(f"A picture of {size_px} px shows nothing.")
        column, row = round(x - size_px / 2), round(y - size_px / 2)
        return self._block(level, (column, row, column + size_px, row + size_px), whole_tiles)

    def block_over(self, zoom: int, area: BaseGeometry, *, whole_tiles: bool = False) -> Block:
        """The tiles under an area given in lon/lat degrees."""
        level = self.level(zoom)
        left, top, right, bottom = self._bounds_px(level, area)
        first = math.floor(left + 1e-6), math.floor(top + 1e-6)
        last = math.ceil(right - 1e-6), math.ceil(bottom - 1e-6)
        return self._block(level, (*first, *last), whole_tiles)

    # -- inside ----------------------------------------------------------------------------

    def _position(self, lat: float, lon: float, near_x: float = 0.0) -> tuple[float, float]:
        """A place in the CRS: of the two that it has across the antimeridian the one near x."""
        if self.crs == WEB_MERCATOR and not abs(lat) <= WEB_MERCATOR_MAX_LAT:
            raise ImageryError(
                f"Latitude {lat} lies outside Web Mercator.",
                hint=f"It ends at {WEB_MERCATOR_MAX_LAT:.4f} degrees; use a source in another CRS.",
            )
        unit = Grid(1, 1, Affine.translation(near_x, 0.0), self.crs)
        x, y = unit.from_lonlat(lon, lat)
        if not (math.isfinite(x) and math.isfinite(y)):
            raise ImageryError(
                f"The point lat {lat}, lon {lon} lies outside the source's map ({self.crs.name})."
            )
        return float(x) + near_x, float(y)

    def _bounds_px(self, level: TileLevel, area: BaseGeometry) -> tuple[float, float, float, float]:
        if area.is_empty:
            raise ImageryError("The area asked for is empty.")
        west, south, east, north = area.bounds
        lats, lons = np.linspace(south, north, 17), np.linspace(west, east, 17)
        middle_x, _ = self._position(lats[8], lons[8])
        px = np.array([
            level.to_px(*self._position(lat, lon, middle_x)) for lat in lats for lon in lons
        ])  # fmt: skip
        return *px.min(axis=0), *px.max(axis=0)

    def _block(
        self, level: TileLevel, window: tuple[int, int, int, int], whole_tiles: bool
    ) -> Block:
        width, height = level.tile_px
        # The map ends in the north and south, and east and west where it does not wrap.
        top, bottom = max(window[1], 0), min(window[3], level.rows * height)
        left, right = window[0], window[2]
        if level.wraps:
            right = min(right, left + level.columns * width)
        else:
            left, right = max(left, 0), min(right, level.columns * width)
        if right <= left or bottom <= top:
            raise ImageryError("The part asked for lies outside the source's map.")
        first = (left // width, top // height)
        last = (-(-right // width), -(-bottom // height))
        crop = (left - first[0] * width, top - first[1] * height, right - left, bottom - top)
        size = last[0] - first[0], last[1] - first[1]
        return Block(self.crs, level, *first, *size, None if whole_tiles else crop)


@dataclass(frozen=True, slots=True)
class Block:
    """A rectangle of tiles, and the part of it that is wanted."""

    crs: CRS
    level: TileLevel
    #: column, row: the first tile; the column may lie outside 0 .. columns - 1 across the
    #: antimeridian.
    column: int
    row: int
    #: columns, rows: tiles.
    columns: int
    rows: int
    #: Column, row, width and height of the wanted pixels within the block; None for all.
    crop: tuple[int, int, int, int] | None = None

    @property
    def count(self) -> int:
        """How many tiles."""
        return self.columns * self.rows

    @property
    def window(self) -> tuple[int, int, int, int]:
        """Column, row, width and height of the wanted pixels within the block."""
        width, height = self.level.tile_px
        return self.crop or (0, 0, self.columns * width, self.rows * height)

    @property
    def grid(self) -> Grid:
        """Of the wanted pixels."""
        column, row, width, height = self.window
        tile_width, tile_height = self.level.tile_px
        return self.level.grid(
            self.column * tile_width + column, self.row * tile_height + row, width, height, self.crs
        )

    def tiles(self, row: int) -> Iterator[Tile]:
        """The tiles of one row of the block (0 is the northernmost), west to east."""
        for column in range(self.column, self.column + self.columns):
            wrapped = column % self.level.columns if self.level.wraps else column
            yield Tile(self.level.zoom, wrapped, self.row + row)
