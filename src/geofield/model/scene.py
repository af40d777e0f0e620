"""Scene: the picture that a field is found in, with its source, date and terms."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from datetime import date
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geofield.crs import authority_name
from geofield.errors import ImageryError, PointOutsideError, refuse_no_number
from geofield.grid import Grid
from geofield.model.card import words
from geofield.model.frame import Shown, shown_ground

#: What a band can show.
ROLES = ("red", "green", "blue", "nir", "grey", "other")

#: Weights of red, green and blue in the grey picture (METHOD.md, section 2).
GREY_WEIGHTS = (0.298, 0.587, 0.114)
_RGB = ("red", "green", "blue")
#: What shows brightness where there is no colour, the best first.
_AS_GREY = ("grey", "green", "red", "blue", "other", "nir")

#: The next step where something else stands for a picture.
OPEN_IT = "Of a file read one: gf.read_scene(path)."


@dataclass(frozen=True, slots=True)
class ImagerySource:
    """Where a picture comes from and what its terms allow.

    Attributes
    ----------
    name : str
        The source's name, or the file's, without folders.
    date : str or None
        When the picture was taken, ISO 8601; None where nobody knows.
    attribution, licence : str
        As they must travel with every product.
    may_derive, may_cache : bool
        Whether the terms allow deriving geodata, and keeping tiles.
    zoom : int or None
        Of tiled sources.
    details : tuple of (str, str)
        Further facts, for instance the fetch date; never a key or password.
    """

    name: str = ""
    date: str | None = None
    attribution: str = ""
    licence: str = ""
    may_derive: bool = True
    may_cache: bool = True
    zoom: int | None = None
    details: tuple[tuple[str, str], ...] = ()

    def is_same_picture(self, other: ImagerySource) -> bool:
        """Whether both tell of one picture, as far as name and date tell pictures apart."""
        return (self.name, self.date) == (other.name, other.date)

    @property
    def day(self) -> str | None:
        """The day of `date`, YYYY-MM-DD; None where that tells none, as a year alone does not."""
        parts = re.match(r"(\d{4})[-:]?(\d\d)[-:]?(\d\d)(?!\d)", self.date or "")
        try:
            return str(date(*map(int, parts.groups()))) if parts else None
        except ValueError:
            return None


@dataclass(frozen=True, eq=False, repr=False)
class Scene:
    """A georeferenced picture in memory.

    >>> scene = gf.read_scene("sample_data/field_1.tif")
    >>> scene.rgb.shape, scene.source.licence
    ((480, 480, 3), 'CC0-1.0')

    Attributes
    ----------
    grid : Grid
        Where its pixels lie.
    bands : uint8 array (bands, rows, columns)
        Values scaled to 0..255; the scaling is in `scaling`.
    roles : tuple of str
        What each band shows, one of `ROLES`.
    valid : bool array (rows, columns)
        False where the picture has no data.
    source : ImagerySource
    scaling : (float, float) or None
        The file's values that became 0 and 255; None where the file held 8 bits.
    notes : tuple of str
        What was done to the picture on the way in (reprojected, rescaled, cut off).
    guesses : tuple of str
        Those of the notes that may be wrong, for a person to look at: what its bands show.
    nir_scaling : (float, float) or None
        The same as `scaling` of near infrared, which is several times brighter.
    """

    grid: Grid
    bands: NDArray[np.uint8]
    roles: tuple[str, ...]
    valid: NDArray[np.bool_]
    source: ImagerySource = field(default_factory=ImagerySource)
    scaling: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()
    guesses: tuple[str, ...] = ()
    nir_scaling: tuple[float, float] | None = None

    def __repr__(self) -> str:
        grid, source = self.grid, self.source
        facts = {
            "size": f"{grid.width_px} x {grid.height_px} px of {grid.ground_resolution_m:.3g} m",
            "bands": " ".join(self.roles),
            "CRS": authority_name(grid.crs),
            "date": source.date or "unknown",
        }
        return words(f"Scene {source.name!r}", facts)

    def __post_init__(self) -> None:
        if self.bands.ndim != 3 or self.bands.shape[0] != len(self.roles) or not self.roles:
            raise ImageryError(
                f"{self.bands.shape} bands do not fit the {len(self.roles)} roles {self.roles}."
            )
        if self.bands.shape[1:] != self.grid.shape or self.valid.shape != self.grid.shape:
            raise ImageryError(
                f"Bands {self.bands.shape[1:]} and mask {self.valid.shape} do not fit the grid "
                f"{self.grid.shape}."
            )
        unknown = set(self.roles) - set(ROLES)
        if unknown:
            raise ImageryError(f"Unknown band role {sorted(unknown)[0]!r}.", hint=f"Use {ROLES}.")

    def band(self, role: str) -> NDArray[np.uint8] | None:
        """The first band of `role` (``red``, ``nir``, ...), or None."""
        return self.bands[self.roles.index(role)] if role in self.roles else None

    @property
    def is_blank(self) -> bool:
        """Whether all pixels with data have one and the same value, or none has data."""
        row, column = np.unravel_index(np.argmax(self.valid), self.valid.shape)
        return not any(((band != band[row, column]) & self.valid).any() for band in self.bands)

    @cached_property
    def shown_px(self) -> Shown | None:
        """Where the picture has data, pixel coordinates; None where that is all of it."""
        return shown_ground(self.valid, self.grid.ground_resolution_m)

    @property
    def is_colour(self) -> bool:
        """Whether red, green and blue are all there."""
        return set(_RGB) <= set(self.roles)

    @property
    def nir(self) -> NDArray[np.uint8] | None:
        """The near infrared band, or None."""
        return self.band("nir")

    @property
    def rgb(self) -> NDArray[np.uint8]:
        """Red, green and blue (rows, columns, 3); one band repeated where there is no colour."""
        return np.stack(self.rgb_bands, axis=-1)

    @property
    def rgb_bands(self) -> list[NDArray[np.uint8]]:
        """Red, green and blue one by one (rows, columns), as they lie in the scene."""
        grey = next(role for role in _AS_GREY if role in self.roles)
        roles = _RGB if self.is_colour else (grey,) * 3
        return [self.bands[self.roles.index(role)] for role in roles]

    @property
    def grey(self) -> NDArray[np.float32]:
        """Brightness 0..255: ``0.298 R + 0.587 G + 0.114 B`` (METHOD.md, section 2)."""
        if not self.is_colour:
            return np.asarray(self.rgb_bands[0], np.float32)
        grey = np.zeros(self.grid.shape, np.float32)
        for band, weight in zip(self.rgb_bands, GREY_WEIGHTS, strict=True):
            grey += np.float32(weight) * band
        return grey

    def crop(self, column: int, row: int, width_px: int, height_px: int) -> Scene:
        """The part of `width_px` by `height_px` from `column`, `row` on, cut at the edge."""
        asked: dict[str, Any] = {
            "column": column,
            "row": row,
            "width_px": width_px,
            "height_px": height_px,
        }
        refuse_no_number(ImageryError, "pixels", whole=True, **asked)
        column, row, width_px, height_px = map(int, asked.values())
        c0, r0 = max(column, 0), max(row, 0)
        c1 = min(column + width_px, self.grid.width_px)
        r1 = min(row + height_px, self.grid.height_px)
        if c1 <= c0 or r1 <= r0:
            raise ImageryError("The part lies outside the picture.")
        grid = self.grid.crop(c0, r0, c1 - c0, r1 - r0)
        bands, valid = self.bands[:, r0:r1, c0:c1], self.valid[r0:r1, c0:c1]
        return replace(self, grid=grid, bands=bands, valid=valid)

    def pixel_of(self, *, lat: float, lon: float, option: str | None = None) -> tuple[float, float]:
        """The pixel position of a point that must lie on the picture's data.

        Rounded to a thousandth of a pixel, and so far within the picture: the last digits are the
        transformation's own, and a point given on a pixel's border must not fall to either side of
        it by chance.

        Parameters
        ----------
        lat, lon : float
            Degrees, WGS 84.
        option : str, optional
            What gave the point as LON,LAT, for the message; ``--lat`` and ``--lon`` otherwise.

        Raises
        ------
        PointOutsideError
            Outside the picture (says so when latitude and longitude look swapped), or
            where it has no data.
        ImageryError
            Latitude or longitude is no number.
        """
        refuse_no_number(ImageryError, "degrees", lat=lat, lon=lon)
        x, y = self.grid.from_lonlat(lon, lat)
        if not self.grid.contains_px(x, y):
            raise outside(self.grid, lat, lon, option)
        rows, columns = self.grid.shape
        # On no border either: an outline does not hold the points that lie on its own.
        x, y = np.clip(np.round([x, y], 3), 1e-3, (columns - 1e-3, rows - 1e-3)).tolist()
        if not self.valid[int(y), int(x)]:
            raise PointOutsideError(
                f"{_point(lat, lon, option)} (pixel {x:.0f}, {y:.0f}) lies where the picture has "
                "no data.",
                hint="Choose a point on the picture itself.",
            )
        return x, y


def outside(grid: Grid, lat: float, lon: float, option: str | None = None) -> PointOutsideError:
    """The error of a point outside: what is covered, and whether lat and lon look swapped.

    `option` is what gave the point as LON,LAT; ``--lat`` and ``--lon`` when None.
    """
    corners = grid.corners_lonlat()
    lons, lats = [c[0] for c in corners], [c[1] for c in corners]
    message = (
        f"{_point(lat, lon, option)} lies outside the picture, which covers lat {min(lats):.6f} "
        f"to {max(lats):.6f}, lon {min(lons):.6f} to {max(lons):.6f}."
    )
    if abs(lon) <= 90 and grid.contains_px(*grid.from_lonlat(lat, lon)):  # lat as lon and back
        return PointOutsideError(f"{message} {swapped(lat, lon, option)}")
    return PointOutsideError(
        message, hint="Give a point on the picture, or a picture of the point."
    )


def swapped(lat: float, lon: float, option: str | None = None) -> str:
    """What to say of a point that lies right with latitude and longitude exchanged."""
    right = f"{option} {lat},{lon}" if option else f"--lat {lon} --lon {lat}"
    return f"Latitude and longitude look swapped: try {right}."


def _point(lat: float, lon: float, option: str | None) -> str:
    return f"The point lat {lat}, lon {lon}{f' of {option}' if option else ''}"
