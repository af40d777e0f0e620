"""SceneReader: a picture on disk or on a server, read window by window.

The reader is a value (what the file says about itself); every read opens the file, so it can
be pickled and sent to a pool. Pixels are kept as they are in any CRS, rotated or not. Only
where they are not square on the ground, as in degrees at high latitude, is the picture
reprojected to the metric CRS, because the trees in it would not be round.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rasterio.enums import MaskFlags, Resampling
from rasterio.vrt import WarpedVRT
from rasterio.windows import Window

from geofield.crs import parse_crs
from geofield.errors import ImageryError
from geofield.grid import Grid
from geofield.imagery.as_taken import as_taken, masked_by_values
from geofield.imagery.bands import BandRoles
from geofield.imagery.damage import check_blocks
from geofield.imagery.facts import crs_of, opaque, palette_of, roles_of, top_of
from geofield.imagery.fill import undeclared_fill
from geofield.imagery.gdal import display_name, gdal_env, open_picture, reading, to_rasterio
from geofield.imagery.opening import OpenOptions
from geofield.imagery.placing import WarpOrigin, find_place, refuse_unplaced
from geofield.imagery.reach import OWN_FOLDER, Reach
from geofield.imagery.scaling import scaled_bands
from geofield.imagery.tags import is_ours, notes_from_tags, scaling_from_tags, source_from_tags
from geofield.model.scene import ImagerySource, Scene, outside
from geofield.wording import counted

#: Read at a coarser resolution rather than hold more pixels than this on a side.
MAX_SIDE_PX = 4096
_NEGATIVE = "Its lowest value is white (MINISWHITE): the values were turned round."
_NOTHING = OpenOptions()
_FILLED = "The value {:g}, alike in all bands, is taken as no data: the file names none."


@dataclass(frozen=True, eq=False)
class SceneReader:
    """A picture that scenes are read from.

    Make one with :meth:`open`. The attributes are facts of the file.

    Attributes
    ----------
    path : str
        Path or address, as GDAL takes it.
    grid : Grid
        Of the whole picture, as it is read (reprojected where that is needed).
    roles : BandRoles
        What each band of the file shows.
    source : ImagerySource
    scaling : (float, float) or None
        Values that become 0 and 255 in every window; None means the window's percentiles.
    notes : tuple of str
        What was done to the whole picture.
    guesses : tuple of str
        What had to be guessed about it.
    """

    path: str
    grid: Grid
    roles: BandRoles
    dtype: str
    source: ImagerySource
    scaling: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()
    guesses: tuple[str, ...] = ()
    nodata: float | None = None
    palette: tuple[tuple[int, int, int, int], ...] = ()
    has_mask: bool = False
    #: What an opaque pixel of the alpha band holds.
    opaque_at: float | None = None
    #: The first band's lowest value is white.
    negative: bool = False
    #: The scaling that made the file's own bytes.
    scaled_before: tuple[float, float] | None = None
    #: Set where the file is read through a warp: its own CRS, control points or grid.
    warped_from: WarpOrigin | None = None
    #: What a VRT may lead to.
    reach: Reach = OWN_FOLDER

    @classmethod
    def open(cls, path: str, options: OpenOptions = _NOTHING) -> SceneReader:
        """Look at a picture without reading its pixels.

        Parameters
        ----------
        path : str
            Path, or an http(s) address of a GeoTIFF; anything GDAL opens.
        options : OpenOptions
            What is known of it.

        Raises
        ------
        ImageryError
            Not a picture, without bands or of complex numbers.
        CRSError
            Without CRS or without position.
        """
        path = str(path)
        # A name that is mistyped is refused, though a file may say its own.
        crs = None if options.crs is None else parse_crs(options.crs)
        reach = options.reach
        with gdal_env(path), open_picture(path, reach) as dataset:
            if dataset.count == 0:
                inner, told, hint = dataset.subdatasets, "", "Give a raster file."
                if inner:
                    told = f", but {counted(len(inner), 'other')}"
                    hint = f"Name one of them, as in {inner[0]!r}."
                raise ImageryError(
                    f"The file {display_name(path)} holds no picture itself{told}.", hint=hint
                )
            dtypes = set(dataset.dtypes)
            if any("complex" in each for each in dtypes):
                raise ImageryError(
                    f"The picture {display_name(path)} holds complex numbers (radar?).",
                    hint="Give an optical picture.",
                )
            with reading(path):
                palette = palette_of(dataset)
                roles = roles_of(dataset, options.bands) if not palette else BandRoles(("red",))
                flags, tags = dataset.mask_flag_enums[0], dataset.tags()
                has_mask = MaskFlags.per_dataset in flags and MaskFlags.alpha not in flags
                top = top_of(dataset, roles.alpha)
                fill = None
                if not palette and not has_mask:
                    fill = undeclared_fill(dataset, roles.shown, alpha=roles.alpha, top=top)
            refuse_unplaced(dataset)
            # A file of ours says its own, which may be another than that of what it was made from.
            if crs is None or is_ours(tags):
                crs = crs_of(dataset, path, options.point)
            dtype = str(np.result_type(*dtypes))
            place = find_place(dataset, crs, point=options.point)
            negative = dataset.tags(ns="IMAGE_STRUCTURE").get("MINISWHITE") == "YES"
            filled = () if fill is None else (_FILLED.format(fill),)
            done = (*notes_from_tags(tags), *([_NEGATIVE] if negative else ()))
            return cls(
                path=path,
                grid=place.grid,
                roles=roles,
                dtype=dtype,
                source=options.source or source_from_tags(tags, path),
                scaling=options.scaling,
                notes=(*done, *place.notes),
                guesses=(*roles.notes, *filled, *place.guesses),
                nodata=dataset.nodata if fill is None else fill,
                palette=palette,
                reach=reach,
                has_mask=has_mask,
                opaque_at=top,
                negative=negative,
                scaled_before=scaling_from_tags(tags) if dtype == "uint8" else None,
                warped_from=place.warped_from,
            )

    @property
    def shown_roles(self) -> tuple[str, ...]:
        """What the bands that a scene keeps show, in the file's order."""
        return tuple(self.roles.roles[i] for i in self.roles.shown)

    @property
    def own_grid(self) -> Grid:
        """Where all of the file lies: what is reprojected reaches no farther than 10 km."""
        origin = self.warped_from
        return self.grid if origin is None or origin.grid is None else origin.grid

    # -- which part ------------------------------------------------------------------------

    def window_around(
        self,
        *,
        lat: float,
        lon: float,
        size_m: float | None = None,
        size_px: int | None = None,
        least_m: float = 0.0,
    ) -> tuple[int, int, int, int]:
        """The part of the picture around a point, cut at its edges.

        Parameters
        ----------
        lat, lon : float
            Degrees, WGS 84.
        size_m, size_px : optional
            Side of the square; without both, all of the picture or, where it is enormous,
            `MAX_SIDE_PX` pixels.
        least_m : float
            That part of an enormous picture has at least this side, ground metres.

        Returns
        -------
        column, row, width_px, height_px : int

        Raises
        ------
        PointOutsideError
        """
        x, y = self.grid.from_lonlat(lon, lat)
        if not self.grid.contains_px(x, y):
            raise outside(self.grid, lat, lon)
        if size_px is not None:
            if size_px < 1:
                raise ImageryError(
                    f"A window of {size_px} px shows nothing.", hint="Give at least 1 pixel."
                )
        elif size_m is not None:
            if not size_m > 0:
                raise ImageryError(
                    f"A window of {size_m} m shows nothing.", hint="Give a size above 0."
                )
            size_px = max(1, round(size_m / self.grid.resolution_at(x, y)))
        elif max(self.grid.shape) <= MAX_SIDE_PX:
            return 0, 0, self.grid.width_px, self.grid.height_px
        else:
            size_px = max(MAX_SIDE_PX, round(least_m / self.grid.resolution_at(x, y)))
        column, row = round(x - size_px / 2), round(y - size_px / 2)
        c0, r0 = max(column, 0), max(row, 0)
        c1 = min(column + size_px, self.grid.width_px)
        r1 = min(row + size_px, self.grid.height_px)
        return c0, r0, max(c1 - c0, 1), max(r1 - r0, 1)

    # -- pixels ----------------------------------------------------------------------------

    def read(
        self,
        window: tuple[int, int, int, int] | None = None,
        *,
        shape_px: tuple[int, int] | None = None,
        scaling: tuple[float, float] | None = None,
        nir_scaling: tuple[float, float] | None = None,
    ) -> Scene:
        """Read a part of the picture.

        Parameters
        ----------
        window : (column, row, width_px, height_px), optional
            Must lie inside the picture; all of it by default.
        shape_px : (rows, columns), optional
            Read that many pixels instead, each the average of those it covers.
        scaling, nir_scaling : (float, float), optional
            File values that become 0 and 255, those of near infrared apart; a scene's make a
            second window fit.

        Raises
        ------
        ImageryError
            The window reaches outside, or the file is damaged.
        """
        column, row, width, height = window or (0, 0, self.grid.width_px, self.grid.height_px)
        right, bottom = column + width, row + height
        inside = right <= self.grid.width_px and bottom <= self.grid.height_px
        if min(column, row) < 0 or min(width, height) < 1 or not inside:
            raise ImageryError(
                f"The window {width} x {height} px at column {column}, row {row} reaches outside "
                f"the picture of {self.grid.width_px} x {self.grid.height_px} px."
            )
        grid = self.grid.crop(column, row, width, height)
        there = self._for((column, row, right, bottom))
        notes = (*self.notes, *there.guesses)
        if shape_px is not None and shape_px != (height, width):
            grid = grid.resized(shape_px[1], shape_px[0])
            notes += (
                f"Read at {grid.ground_resolution_m:.3g} m per pixel instead of "
                f"{self.grid.ground_resolution_m:.3g} m.",
            )
        values, valid = there._pixels(Window(column, row, width, height), grid.shape)
        if self.palette:
            roles: tuple[str, ...] = ("red", "green", "blue")
            bands, limits, own = values.astype(np.uint8), None, None
        else:
            roles, scaling = there.shown_roles, scaling or self.scaling
            # What an earlier reading did to the pixels is kept, not repeated.
            bands, limits, own = values, self.scaled_before, None
            if values.dtype != np.uint8 or scaling not in (None, self.scaled_before):
                bands, limits, own, more = scaled_bands(values, roles, valid, scaling, nir_scaling)
                notes += more
        bands = np.where(valid, bands, np.uint8(0))
        return Scene(grid, bands, roles, valid, self.source, limits, notes, there.guesses, own)

    def _for(self, box: tuple[int, int, int, int]) -> SceneReader:
        """The reader of a part (left, top, right, bottom, pixels): what it has and is guessed."""
        return self

    def _pixels(
        self, window: Window, shape: tuple[int, int]
    ) -> tuple[NDArray[Any], NDArray[np.bool_]]:
        """The shown bands (bands, rows, columns) in the file's type, and what is valid."""
        indexes = [i + 1 for i in self.roles.shown]
        part = self.grid.crop(window.col_off, window.row_off, window.width, window.height)
        with (
            gdal_env(self.path),
            open_picture(self.path, self.reach, placed=True) as dataset,
            reading(self.path),
            as_taken(dataset, self.nodata, alpha=self.roles.alpha is not None) as plain,
            self._through_warp(plain, part) as raster,
        ):
            full = shape == (window.height, window.width)
            resampling = Resampling.nearest if full or self.palette else Resampling.average
            values = raster.read(
                indexes, window=window, out_shape=(len(indexes), *shape), resampling=resampling
            )
            if full or not dataset.overviews(1):
                origin = self.warped_from
                check_blocks(
                    dataset, window if origin is None else origin.window(dataset.shape, part)
                )
            valid = np.ones(shape, bool)
            said = [raster.nodatavals[i] for i in self.roles.shown]
            nearest = {"window": window, "out_shape": shape, "resampling": Resampling.nearest}
            if self.roles.alpha is not None and self.opaque_at is not None:
                alpha = raster.read(self.roles.alpha + 1, **nearest)
                valid &= opaque(alpha, self.opaque_at)
            elif self.warped_from is not None:  # the mask that the warp added
                valid &= raster.read(raster.count, **nearest) > 0
            elif self.has_mask:
                valid &= raster.read_masks(1, **nearest) > 0
        if self.warped_from is None and self.nodata is not None and not np.isnan(self.nodata):
            said = [self.nodata if each is None else each for each in said]
            valid &= ~np.all(
                [band == each for band, each in zip(values, said, strict=True)], axis=0
            )
        if values.dtype.kind == "f":
            valid &= np.all(np.isfinite(values), axis=0)
        if self.negative and 0 in self.roles.shown:
            first = values[self.roles.shown.index(0)]
            first[:] = -first if values.dtype.kind == "f" else ~first
        if self.palette:
            table = np.asarray(self.palette, np.uint8)[values[0]]
            valid &= table[..., 3] >= 128
            values = np.moveaxis(table[..., :3], -1, 0)
        return values, valid

    @contextmanager
    def _through_warp(self, dataset: Any, part: Grid) -> Iterator[Any]:
        """The dataset itself, or its reprojection: without an alpha band, a mask is its last."""
        if self.warped_from is None:
            yield dataset
            return
        origin = self.warped_from
        options: dict[str, Any] = {"src_crs": to_rasterio(origin.crs)}
        if origin.grid is not None:
            options |= {
                "src_transform": origin.grid.transform,
                "transform": self.grid.transform,
                "width": self.grid.width_px,
                "height": self.grid.height_px,
            }
        alpha = self.roles.alpha
        options["add_alpha"] = alpha is None
        if alpha is not None:
            options["src_alpha"] = alpha + 1
        own_mask = alpha is not None or self.has_mask
        bands = () if own_mask else self.roles.shown
        with (
            masked_by_values(dataset, bands, origin.window(dataset.shape, part)) as masked,
            WarpedVRT(
                masked,
                crs=to_rasterio(self.grid.crs),
                resampling=Resampling.nearest if self.palette else Resampling.bilinear,
                src_nodata=self.nodata if masked is dataset else None,
                **options,
            ) as warped,
        ):
            yield warped
