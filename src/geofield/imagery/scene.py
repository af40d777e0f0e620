"""Reading a scene: the picture around a point, ready for the next stages."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from geofield.errors import ImageryError, refuse_no_number
from geofield.imagery.pictures import open_reader
from geofield.imagery.reader import MAX_SIDE_PX, SceneReader
from geofield.model.scene import ImagerySource, Scene

#: More pixels than this are never read at once.
MAX_PIXELS = 20_000 * 20_000


def read_scene(
    path: str | Path,
    *,
    lat: float | None = None,
    lon: float | None = None,
    size_m: float | None = None,
    size_px: int | None = None,
    resolution_m: float | None = None,
    bands: Sequence[str] | None = None,
    crs: Any = None,
    scaling: tuple[float, float] | None = None,
    source: ImagerySource | None = None,
    allow: Sequence[str] = (),
    least_m: float = 0.0,
    on_data: bool = True,
) -> Scene:
    """Read the picture around a point.

    >>> scene = gf.read_scene("sample_data/field_1.tif", lat=35.0754, lon=33.5311, size_m=150)
    >>> scene.grid.shape
    (250, 250)

    Any CRS and rotation is kept; only a picture whose pixels are not square on the ground is
    reprojected. 16 bit and floating point values are scaled to 0..255 by percentiles of the
    window; a value that such a picture is filled with and does not name is no data. All of this is
    told in the scene's `notes`.

    Parameters
    ----------
    path : path or str
        A raster file, or an http(s) address of a GeoTIFF.
    lat, lon : float, optional
        The point, degrees, WGS 84; it must lie on the picture.
    size_m, size_px : optional
        Side of the square around the point, ground metres or pixels; by default all of the
        picture, or the part around the point where the picture is enormous.
    resolution_m : float, optional
        Read at this ground resolution where the picture is finer. A window of `size_m` that
        would hold more than 4096 pixels on a side is read coarser by itself.
    bands : sequence of str, optional
        What the bands show, in order: red, green, blue, nir, grey, alpha, other.
    crs : optional
        The CRS of a picture that does not name it.
    scaling : (float, float), optional
        File values that become 0 and 255.
    source : ImagerySource, optional
        Provenance that is known better than the file knows it.
    allow : sequence of str, optional
        Folders and hosts that a VRT, a tile index or a STAC file may lead to besides its own
        folder.
    least_m : float
        Of an enormous picture without a size, at least a square of this side is read, ground
        metres; coarser where that would be more than 4096 pixels.
    on_data : bool
        Whether the point must lie where the picture has data.

    Raises
    ------
    ImageryError
        Unreadable, truncated, too large; no data at all.
    CRSError
        No CRS or no position.
    PointOutsideError
        The point lies outside, or on no data.
    """
    if (lat is None) != (lon is None):
        raise ImageryError("A point needs both lat and lon.", hint="Give both, or neither.")
    if lat is None and (size_m is not None or size_px is not None):
        raise ImageryError(
            "A window needs a point at its centre.", hint="Give lat and lon, or no size."
        )
    if size_m is not None and size_px is not None:
        raise ImageryError("The size is given twice.", hint="Give size_m or size_px, not both.")
    refuse_no_number(ImageryError, "degrees", none_too=True, lat=lat, lon=lon)
    metres: dict[str, Any] = {"size_m": size_m, "resolution_m": resolution_m, "least_m": least_m}
    refuse_no_number(ImageryError, "metres on the ground", none_too=True, **metres)
    refuse_no_number(ImageryError, "pixels", none_too=True, whole=True, size_px=size_px)
    size_px = None if size_px is None else int(size_px)
    known: dict[str, Any] = {"bands": bands, "crs": crs, "scaling": scaling, "source": source}
    reader = open_reader(str(path), lat=lat, lon=lon, allow=allow, **known)
    if lat is None or lon is None:
        if max(reader.grid.shape) > MAX_SIDE_PX and resolution_m is None:
            raise ImageryError(
                f"The picture is large: {reader.grid.width_px} x {reader.grid.height_px} px.",
                hint="Give the point (lat, lon) and a size, or a coarser resolution_m.",
            )
        window = (0, 0, reader.grid.width_px, reader.grid.height_px)
    else:
        window = reader.window_around(
            lat=lat, lon=lon, size_m=size_m, size_px=size_px, least_m=least_m
        )
    scene = read_part(reader, window, resolution_m, exact=size_px is not None)
    if lat is not None and lon is not None and on_data:
        scene.pixel_of(lat=lat, lon=lon)  # says why when it lies on no data
    return scene


def read_part(
    reader: SceneReader,
    window: tuple[int, int, int, int],
    resolution_m: float | None = None,
    *,
    exact: bool = False,
) -> Scene:
    """Read a window that holds data, as :func:`read_scene` says coarser where it is large.

    Raises
    ------
    ImageryError
        No data at all.
    """
    scene = reader.read(window, shape_px=_shape(reader, window, resolution_m, exact=exact))
    if not scene.valid.any():
        raise ImageryError(
            f"The picture {scene.source.name} holds no data in the part asked for.",
            hint="Choose another point, or check its mask and no-data value with `gdalinfo`.",
        )
    return scene


def _shape(
    reader: SceneReader,
    window: tuple[int, int, int, int],
    resolution_m: float | None,
    *,
    exact: bool,
) -> tuple[int, int]:
    """Rows and columns to read: as they are, or fewer."""
    column, row, width, height = window
    factor = 1.0
    if resolution_m is not None:
        if not resolution_m > 0:
            raise ImageryError(f"A resolution of {resolution_m} m does not exist.")
        factor = resolution_m / reader.grid.crop(column, row, width, height).ground_resolution_m
    elif not exact:
        factor = max(width, height) / MAX_SIDE_PX
    factor = max(factor, 1.0)
    shape = (max(1, round(height / factor)), max(1, round(width / factor)))
    if shape[0] * shape[1] > MAX_PIXELS:
        raise ImageryError(
            f"A window of {shape[1]} x {shape[0]} px does not fit in memory.",
            hint="Give a smaller size, or a coarser resolution_m.",
        )
    return shape
