"""Many pictures read as one: a folder of drone tiles, a set of orthophoto sheets.

The picture that holds the point gives the grid (its CRS, its pixels); the others are put on
it, pixel for pixel where they lie on the same lattice, reprojected where they do not, as with
sheets in another UTM zone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rasterio.windows import Window

from geofield.errors import GeofieldError, ImageryError, ImageryWarning, PointOutsideError
from geofield.grid import Grid
from geofield.imagery.bands import BandRoles
from geofield.imagery.gdal import display_name
from geofield.imagery.opening import OpenOptions
from geofield.imagery.placing import REACH_M, WarpOrigin, border_px, square_grid
from geofield.imagery.reader import SceneReader
from geofield.model.scene import swapped
from geofield.notes import warn

#: Readers of pictures that were looked at: values without open files.
_KNOWN: dict[Any, SceneReader] = {}
_MOST_KNOWN = 10_000
#: So many damaged pictures are named.
_TOLD = 3
#: A picture that is left out is missed this near to a window.
_NEAR_PX = 32
#: Lattices this near to each other (px) are the same.
_SAME_PX = 1e-3
#: Left, top, right, bottom, pixels.
_Box = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True)
class Part:
    """One picture on the common grid."""

    #: Read as it is when `offset` is given, else already reprojected to the common grid.
    reader: SceneReader
    #: Column and row of its first pixel on the common grid.
    offset: tuple[int, int] | None
    #: Common pixels that it may touch.
    bounds: _Box

    def picks(self, roles: Sequence[str]) -> list[int] | None:
        """Which of its bands show these roles; None where one is not there."""
        own = self.reader.shown_roles
        if own == tuple(roles):
            return list(range(len(own)))
        return [own.index(role) for role in roles] if set(roles) <= set(own) else None


@dataclass(frozen=True, eq=False)
class CollectionReader(SceneReader):
    """A reader over several pictures; see `SceneReader`."""

    #: In the order of precedence: the first picture with data at a pixel shows there.
    parts: tuple[Part, ...] = ()
    #: Pictures that cannot be joined, and where they lie.
    left_out: tuple[tuple[str, _Box], ...] = ()

    def _for(self, box: _Box) -> SceneReader:
        """The reader of a part: with the bands that all pictures there have."""
        there = [part for part in self.parts if _meet(part.bounds, box)]
        common = [role for role in self.shown_roles if all(part.picks([role]) for part in there)]
        lost = [role for role in self.shown_roles if role not in common]
        guesses, roles = self.guesses, self.roles
        if lost:
            less = next(part.reader for part in there if not part.picks(lost))
            roles = BandRoles(tuple(common))
            guesses += (
                f"Read without {' and '.join(lost)}, which {display_name(less.path)} does not "
                "have; take it out of the set to have it.",
            )
        out = [why for why, place in self.left_out if _meet(place, box)]
        guesses += (_told(out),) if out else ()
        return replace(self, roles=roles, guesses=guesses)

    def _pixels(
        self, window: Window, shape: tuple[int, int]
    ) -> tuple[NDArray[Any], NDArray[np.bool_]]:
        count = 3 if self.palette else len(self.roles.shown)
        dtype = np.uint8 if self.palette else np.dtype(self.dtype)
        values = np.zeros((count, *shape), dtype)
        valid = np.zeros(shape, bool)
        left, top = int(window.col_off), int(window.row_off)
        right, bottom = left + int(window.width), top + int(window.height)
        full = shape == (bottom - top, right - left)
        for part in self.parts:
            c0, r0 = max(left, part.bounds[0]), max(top, part.bounds[1])
            c1, r1 = min(right, part.bounds[2]), min(bottom, part.bounds[3])
            if c1 <= c0 or r1 <= r0 or valid.all():
                continue
            if full:
                dc, dr = part.offset or (0, 0)
                inner = Window(c0 - dc, r0 - dr, c1 - c0, r1 - r0)
                got, there = part.reader._pixels(inner, (r1 - r0, c1 - c0))
                place = np.s_[r0 - top : r1 - top, c0 - left : c1 - left]
            else:
                whole = part.reader if part.offset is None else on_grid(part.reader, self.grid)
                got, there = whole._pixels(window, shape)
                place = np.s_[0 : shape[0], 0 : shape[1]]
            new = there & ~valid[place]
            picks = range(count) if self.palette else part.picks(self.shown_roles) or ()
            for band, pick in enumerate(picks):
                values[band][place][new] = got[pick][new]
            valid[place] |= new
        return values, valid


def open_collection(
    paths: Sequence[str] | Mapping[str, OpenOptions], options: OpenOptions, *, name: str = ""
) -> SceneReader:
    """A reader over several pictures, with a warning where some cannot be read.

    Earlier ones win where several are as fine at the point; those farther than 10 km from it are
    left out. `name` is that of the whole, for people; what is known of each may be given with it.

    Raises
    ------
    ImageryError
        None of them can be read.
    PointOutsideError
        None of those that can be read holds the point.
    """
    readers: list[SceneReader] = []
    damaged: list[str] = []
    for path in paths:
        try:
            known = paths[path] if isinstance(paths, Mapping) else options
            readers.append(_looked_at(path, known))
        except GeofieldError as error:
            damaged.append(f"{display_name(path)} was left out: {error.message}")
    notes, told = list(damaged), _told(damaged)
    if not readers:
        raise ImageryError(
            f"{name or 'The collection'} holds no picture that can be read.",
            hint=told or "Give a folder with GeoTIFF files.",
        )
    at = _reference(readers, options.point, name, told)
    reference = readers[at] = _around_point(readers[at], options.point)
    if damaged:
        warn(told, ImageryWarning)
    unlike = [_unlike(each, reference) for each in readers]
    usable = [each for each, why in zip(readers, unlike, strict=True) if not why]
    usable.sort(key=lambda each: each is not reference)  # stable: the reference first
    grid, boxes = _common_grid(reference, usable, options.point)
    parts = [
        _part(reader, grid, box)
        for reader, box in zip(usable, boxes, strict=True)
        if box is not None
    ]
    left_out = [
        (f"{display_name(each.path)} was left out: {why}.", place)
        for each, why in zip(readers, unlike, strict=True)
        if why and (place := _around(each, grid)) is not None
    ]
    if len(parts) > 1:
        moved = sum(part.offset is None for part in parts)
        notes.append(
            f"Joined from {len(parts)} pictures"
            + (f"; {moved} of them reprojected to {grid.crs.name}." if moved else ".")
        )
    source = options.source or replace(reference.source, name=name or reference.source.name)
    return CollectionReader(
        path=reference.path,
        grid=grid,
        roles=reference.roles,
        dtype=reference.dtype,
        source=source,
        scaling=reference.scaling,
        notes=(*reference.notes, *notes),
        guesses=reference.guesses,
        left_out=tuple(left_out),
        palette=reference.palette,
        parts=tuple(parts),
    )


def _part(reader: SceneReader, grid: Grid, box: _Box) -> Part:
    offset = _offset(reader.grid, grid) if reader.warped_from is None else None
    if offset is None:
        return Part(on_grid(reader, grid), None, box)
    (column, row), own = offset, reader.grid
    return Part(reader, offset, (column, row, column + own.width_px, row + own.height_px))


def _told(damaged: Sequence[str]) -> str:
    """What was left out: all of it where that is little."""
    more = [f"So were {len(damaged) - _TOLD} more."] if len(damaged) > _TOLD else []
    return " ".join([*damaged[:_TOLD], *more])


def _version(path: str) -> tuple[int, int] | None:
    """What changes when a file does; None for what is no file here."""
    try:
        facts = Path(path).stat()
    except (OSError, ValueError):
        return None
    return facts.st_mtime_ns, facts.st_size


def _looked_at(path: str, options: OpenOptions) -> SceneReader:
    """A picture's reader; each file is looked at once, however many fields lie in the set."""
    # Where the point is and whose the set is does not matter to one of its pictures.
    options = replace(options, lat=None, lon=None, source=None)
    if (version := _version(path)) is None:
        return SceneReader.open(path, options)
    bands = tuple(options.bands or ())
    key = (path, version, bands, str(options.crs), options.scaling, options.reach)
    if key not in _KNOWN:
        if len(_KNOWN) >= _MOST_KNOWN:
            _KNOWN.clear()
        _KNOWN[key] = SceneReader.open(path, options)
    return _KNOWN[key]


def on_grid(reader: SceneReader, grid: Grid) -> SceneReader:
    """The same picture read through a reprojection to another grid."""
    origin = reader.warped_from or WarpOrigin(reader.grid.crs, reader.grid)
    return replace(reader, grid=grid, warped_from=origin)


def _around_point(reader: SceneReader, point: tuple[float, float] | None) -> SceneReader:
    """A picture that is reprojected, for a point that it shows."""
    if point is None or reader.own_grid is reader.grid:
        return reader
    return replace(reader, grid=square_grid(reader.own_grid, point))


def _reference(
    readers: list[SceneReader], point: tuple[float, float] | None, name: str, left_out: str
) -> int:
    """The number of the finest picture at the point; the first of equals."""
    grids = [each.own_grid for each in readers]
    places = [(grid.width_px / 2, grid.height_px / 2) for grid in grids]
    here = list(range(len(grids)))
    if point is not None:
        places = [grid.from_lonlat(*point) for grid in grids]
        here = [at for at in here if grids[at].contains_px(*places[at])]
        if not here:
            raise PointOutsideError(_outside(grids, *point, name), hint=left_out)
    # At the point itself: in most systems pixels of one size are others from place to place.
    return min(here, key=lambda at: round(grids[at].resolution_at(*places[at]), 4))


def _outside(grids: list[Grid], lon: float, lat: float, name: str) -> str:
    corners = [corner for each in grids for corner in each.corners_lonlat()]
    lons, lats = [c[0] for c in corners], [c[1] for c in corners]
    one = len(grids) == 1
    all_of, covers = (
        ("the picture", "covers a part") if one else (f"all {len(grids)} pictures", "cover parts")
    )
    message = (
        f"The point lat {lat}, lon {lon} lies outside {all_of} of {name or 'the collection'}, "
        f"which {covers} of lat {min(lats):.6f} to {max(lats):.6f}, lon {min(lons):.6f} to "
        f"{max(lons):.6f}."
    )
    if abs(lon) <= 90 and any(each.contains_px(*each.from_lonlat(lat, lon)) for each in grids):
        message += f" {swapped(lat, lon)}"
    return message


def _unlike(reader: SceneReader, reference: SceneReader) -> str:
    """Why a picture cannot be joined to the reference; "" where it can."""
    name, own = display_name(reference.path), reader.shown_roles
    wanted = [role for role in reference.shown_roles if role != "nir"] or reference.shown_roles
    if reader is reference:
        return ""
    if reader.dtype != reference.dtype:
        return (
            f"its values are {reader.dtype}, those of {name} {reference.dtype}; bring them to one "
            "type, as with gdal_translate -ot Byte -scale"
        )
    if not set(wanted) <= set(own) or bool(reader.palette) != bool(reference.palette):
        shows = "colours by number" if reader.palette else ", ".join(own)
        return (
            f"it shows {shows}, unlike {name}; make it a picture of the same bands, as with "
            "gdal_translate -b or -expand rgb"
        )
    for each in (reader, reference):
        if _by_points(each):
            which = display_name(each.path)
            return f"only control points place {which}; make a GeoTIFF of it with gdalwarp"
    return ""


def _by_points(reader: SceneReader) -> bool:
    """Whether control points alone place a picture: GDAL fits them on a grid of its own choice."""
    return reader.warped_from is not None and reader.warped_from.grid is None


def _meet(one: _Box, other: _Box) -> bool:
    """Whether two boxes share pixels."""
    left, top = max(one[0], other[0]), max(one[1], other[1])
    return left < min(one[2], other[2]) and top < min(one[3], other[3])


def _common_grid(
    reference: SceneReader, readers: list[SceneReader], point: tuple[float, float] | None
) -> tuple[Grid, list[_Box | None]]:
    """The reference's lattice over all pictures near the point, and each one's place on it."""
    base = reference.grid
    reach = math.inf
    x0, y0 = base.width_px / 2, base.height_px / 2
    if point is not None and not _by_points(reference):
        x0, y0 = base.from_lonlat(*point)
        reach = REACH_M / base.ground_resolution_m
    # All of the others; of the reference what its grid shows around the point.
    px = np.array(
        [_border_px(base if each is reference else each.own_grid, base) for each in readers]
    )
    low = np.maximum(px.min(axis=2), (x0 - reach, y0 - reach))
    high = np.minimum(px.max(axis=2), (x0 + reach, y0 + reach))
    there = np.isfinite(px).all(axis=(1, 2)) & (high > low).all(axis=1)
    first = np.floor(low[there].min(axis=0) + _SAME_PX)
    size = np.ceil(high[there].max(axis=0) - _SAME_PX) - first
    grid = base.crop(*map(int, first), *map(int, size))
    start = np.maximum(np.floor(low) - first - 1, 0)
    stop = np.minimum(np.ceil(high) - first + 1, size)
    places: list[_Box | None] = [
        (int(left), int(top), int(right), int(bottom)) if near else None
        for near, (left, top), (right, bottom) in zip(there, start, stop, strict=True)
    ]
    return grid, places


def _border_px(grid: Grid, base: Grid) -> NDArray[np.float64]:
    """Where the border of a picture lies on another one's grid: columns and rows."""
    return np.array(base.from_crs(*grid.to_native(*border_px(grid, 9)), grid.crs))


def _around(reader: SceneReader, grid: Grid) -> _Box | None:
    """The pixels of a grid, inside or not, near which a picture lies; None where it is far."""
    px = _border_px(reader.own_grid, grid)
    if not np.isfinite(px).all():
        return None
    (left, top), (right, bottom) = px.min(axis=1) - _NEAR_PX, px.max(axis=1) + _NEAR_PX
    return int(left), int(top), int(right), int(bottom)


def _offset(grid: Grid, common: Grid) -> tuple[int, int] | None:
    """Whole pixels from the common grid's corner, when both lie on one lattice."""
    if grid.crs != common.crs:
        return None
    w, h = grid.width_px, grid.height_px
    x, y = common.from_native(*grid.to_native(np.array([0, w, 0]), np.array([0, 0, h])))
    column, row = round(x[0]), round(y[0])
    expected_x, expected_y = np.array([column, column + w, column]), np.array([row, row, row + h])
    near = np.abs(x - expected_x).max() < _SAME_PX and np.abs(y - expected_y).max() < _SAME_PX
    return (column, row) if near else None
