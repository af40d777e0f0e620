"""What a raster file says about itself: palette, band roles, CRS; and whether to believe it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyproj import CRS
from rasterio.enums import ColorInterp
from rasterio.windows import Window

from geofield.crs import authority_name, utm_crs
from geofield.errors import CRSError
from geofield.imagery.bands import OPAQUE, BandRoles, Look, find_roles, kept_roles, look_of
from geofield.imagery.gdal import display_name, gdal_env, open_picture, to_pyproj
from geofield.imagery.tags import notes_from_tags, roles_from_tags, source_from_tags
from geofield.model.scene import ImagerySource

_SAMPLE_PX = 128
#: A place whose zone is named where none is known, degrees.
_EXAMPLE = (15.0, 45.0)


def palette_of(dataset: Any) -> tuple[tuple[int, int, int, int], ...]:
    """Red, green, blue, alpha of each value; empty for pictures without a palette."""
    if dataset.colorinterp[0] != ColorInterp.palette:
        return ()
    table = dataset.colormap(1)
    size = max(256, max(table) + 1)
    return tuple(tuple(table.get(i, (0, 0, 0, 0))) for i in range(size))


def roles_of(dataset: Any, given: Sequence[str] | None) -> BandRoles:
    """What each band shows: as given, as our own tag says, or as found.

    What is given may be of the picture that a file of ours was made from: it has fewer bands.
    """
    remembered = roles_from_tags(dataset.tags())
    if remembered and len(remembered) == dataset.count:
        given = remembered if not given or kept_roles(given) == remembered else given
    marked = [interpretation.name for interpretation in dataset.colorinterp]
    looks: list[Look] = ["picture"] * dataset.count
    if not given:
        unnamed = {"alpha", "undefined"}
        looks = [
            look_of(sampled(dataset, i + 1)) if name in unnamed else "picture"
            for i, name in enumerate(marked)
        ]
    return find_roles(dataset.descriptions, marked, looks, given)


def picture_facts(path: str | Path) -> dict[str, list[str]]:
    """What a picture that geofield wrote says of its bands and of what was done to it."""
    with gdal_env(str(path)), open_picture(str(path)) as dataset:
        tags = dataset.tags()
    return {"bands": list(roles_from_tags(tags) or ()), "notes": list(notes_from_tags(tags))}


def source_of(path: str | Path) -> ImagerySource:
    """Where a picture comes from, by its own word."""
    with gdal_env(str(path)), open_picture(str(path)) as dataset:
        return source_from_tags(dataset.tags(), str(path))


def sampled(dataset: Any, bands: int | list[int]) -> NDArray[Any]:
    """Values of 3 x 3 small windows spread over the picture: the same ones every time."""
    windows = spread(dataset.shape, _SAMPLE_PX, 3)
    return np.concatenate([dataset.read(bands, window=each).ravel() for each in windows])


def spread(shape: tuple[int, int], side_px: int, each_way: int) -> list[Window]:
    """Square windows spread evenly over a picture of rows and columns, `each_way` at the most."""
    sides = [min(side, side_px) for side in shape]
    rows, columns = (
        sorted({round((side - window) * n / (each_way - 1)) for n in range(each_way)})
        for side, window in zip(shape, sides, strict=True)
    )
    return [Window(column, row, sides[1], sides[0]) for row in rows for column in columns]


def top_of(dataset: Any, alpha: int | None) -> float | None:
    """What an opaque pixel of a file's alpha band (0-based) holds: by its values, for all of it.

    Alpha of 0 and 255 goes with pictures of any type.
    """
    if alpha is None:
        return None
    sample = sampled(dataset, alpha + 1)
    most = float(np.nanmax(sample, initial=0))
    ends = [end for end in OPAQUE if end >= most]
    if sample.dtype.kind in "ui":
        ends = [end for end in ends if end <= np.iinfo(sample.dtype).max]
        ends.append(int(np.iinfo(sample.dtype).max))
    return float(ends[0]) if ends else most


def opaque(alpha: NDArray[Any], top: float) -> NDArray[np.bool_]:
    """Whether an alpha band hides less than half; `top` hides nothing."""
    return np.asarray(alpha.astype(np.float64) * 2 > top)


def crs_of(dataset: Any, path: str, point: tuple[float, float] | None = None) -> CRS:
    """The CRS of the file or of its ground control points; a hint names the zone of `point`.

    Raises
    ------
    CRSError
        The file names none.
    """
    gcps, gcp_crs = dataset.gcps
    found = dataset.crs or (gcp_crs if gcps else None)
    if not found:
        zone = utm_crs(*(point or _EXAMPLE))
        named = f"{authority_name(zone)} ({zone.name.rpartition(' / ')[2]})"
        raise CRSError(
            f"The picture {display_name(path)} does not name its coordinate reference system.",
            hint=f"Name it, for instance --crs {named}; in Python crs=...",
        )
    return to_pyproj(found)
