"""Tables of positions: columns of latitude and longitude, of x and y, or shapes as WKT."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pyarrow as pa
import shapely
from numpy.typing import NDArray
from pyproj import CRS

from geofield.angles import angle_of
from geofield.crs import LONLAT, refuse_outside
from geofield.errors import FormatError
from geofield.formats.foreign import RawLayer, files_in, read_foreign
from geofield.formats.raw_tables import RawTable, read_raw
from geofield.model import Dataset
from geofield.wording import SWAP, nearest, some_of

LAT = ("lat", "latitude")
LON = ("lon", "lng", "long", "longitude")
_X = ("x", "easting", "east", "rechtswert")
_Y = ("y", "northing", "north", "hochwert")
#: What tables have where a number is missing.
_MISSING = ("", "na", "n/a", "nan", "null")


def read_table(path: Path, layer: str | None = None) -> gpd.GeoDataFrame:
    """The rows of a CSV table: shapes as WKT, or points by columns lat and lon, or x and y.

    What are no degrees is of no CRS: a table cannot say it. Nor has it a `layer`.

    Raises
    ------
    FormatError
        When there are no such columns, or positions are no positions.
    """
    raw = read_raw(path, layer=layer, texts=())
    if raw.geometry is not None:
        shapes = shapely.from_wkb(raw.geometry.to_numpy(zero_copy_only=False))
        west, south, east, north = shapely.total_bounds(shapes)
        in_degrees = max(-west, east) <= 180.0 and max(-south, north) <= 90.0
        frame = raw.table.to_pandas()
        return gpd.GeoDataFrame(frame, geometry=shapes, crs=LONLAT if in_degrees else None)
    lonlat = found(raw, None, LON), found(raw, None, LAT)
    names = lonlat if None not in lonlat else (found(raw, None, _X), found(raw, None, _Y))
    if None in names:
        raise FormatError(
            f"{raw.name} has no columns lat and lon and no geometry.",
            hint=f"It has {', '.join(raw.table.column_names)}; rename them to lat and lon.",
        )
    if names != lonlat:
        x, y = (_numbers(raw, str(name)) for name in names)
    else:
        x, y = (degrees(raw, str(name), of) for name, of in zip(names, ("EW", "NS"), strict=True))
        if len(x):
            check_positions(raw, y, x, np.arange(len(x)), LONLAT)
    known = np.isfinite(x) & np.isfinite(y)
    points = np.full(len(x), None)
    points[known] = shapely.points(x[known], y[known])
    crs = LONLAT if names == lonlat else None
    # Those of our own tables stay.
    rest = raw.table.drop_columns(
        [each for each in names if each not in ("lat", "lon")]
    ).to_pandas()
    return gpd.GeoDataFrame(rest, geometry=points, crs=crs)


def read(path: Path, *, crs: CRS | None = None) -> Dataset:
    """The dataset in a table of shapes or positions, or in a folder of some."""
    tables = [RawLayer(file.stem, read_table(file)) for file in files_in(path, ".csv", ".tsv")]
    return read_foreign(tables, path, crs=crs)


def found(raw: RawTable, asked: str | None, usual: Sequence[str]) -> str | None:
    """The column that was asked for, or one with a usual name."""
    names = raw.table.column_names
    if asked is None:
        by_name = {name.lower(): name for name in reversed(names)}
        return next((by_name[name] for name in usual if name in by_name), None)
    if asked not in names:
        raise FormatError(
            f"{raw.name} has no column {asked!r}.{nearest(asked, names)}",
            hint=f"It has {', '.join(names)}.",
        )
    return asked


def _plain(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def degrees(raw: RawTable, name: str, letters: str) -> NDArray[np.float64]:
    """A column's latitudes or longitudes, which may be written as for the options."""
    return _numbers(raw, name, lambda text: angle_of(text, letters), "35.0754 or 35 4.524 N")


def _numbers(
    raw: RawTable,
    name: str,
    understood: Callable[[str], float | None] = _plain,
    example: str = "533812.5",
) -> NDArray[np.float64]:
    """A column's numbers, of texts what is `understood`; missing ones are not a number."""
    column = raw.table[name]
    with suppress(pa.ArrowInvalid, pa.ArrowNotImplementedError):
        return np.asarray(column.cast(pa.float64()).to_numpy(), dtype=np.float64)
    texts = ["" if each is None else str(each).strip() for each in column.to_pylist()]
    found = [np.nan if text.lower() in _MISSING else understood(text) for text in texts]
    wrong = [row for row, number in enumerate(found) if number is None]
    if wrong:
        rows = some_of([str(row + 1) for row in wrong], 5)
        raise FormatError(
            f"{raw.name}: column {name!r}, row {rows}: {texts[wrong[0]]!r} is no number.",
            hint=f"Write {example}; rows are counted from 1 below the columns' names.",
        )
    return np.array(found, dtype=np.float64)


def check_positions(raw: RawTable, lat: Any, lon: Any, row: Any, source: CRS) -> None:
    """Refuse what cannot be a latitude or longitude; `row` counts from 0, `source` is the file's.

    Raises
    ------
    FormatError
        Saying whether the two look swapped, or some rows are in another CRS.
    """
    if (np.isnan(lat) | np.isnan(lon)).all():
        raise FormatError(
            f"{raw.name} holds no row with a position.",
            hint="Give each row a latitude and a longitude, or a shape.",
        )
    wrong = np.flatnonzero((np.abs(lat) > 90) | (np.abs(lon) > 180))
    if not len(wrong):
        return
    rows = dict.fromkeys(row[wrong] + 1)
    shown = some_of([str(one) for one in rows], 5)
    refuse_outside(source, lat[wrong], lon[wrong], what=f"{raw.name}: coordinates in row {shown}")
    first = f"lat {lat[wrong[0]]:g}, lon {lon[wrong[0]]:g}"
    swapped = (np.abs(lat[wrong]) <= 180) & (np.abs(lon[wrong]) <= 90)
    if swapped.all() and len(wrong) < np.isfinite(lat + lon).sum():
        hint = "Correct it there: latitude and longitude may be exchanged."
    elif swapped.all():
        what = "the columns' names" if raw.geometry is None else f"them in the file (`{SWAP}`)"
        hint = f"Latitude and longitude look swapped: exchange {what}."
    elif len(wrong) < len(lat):
        hint = "Other rows are degrees: these may be in another CRS. Bring all rows into one."
    else:
        hint = "Give degrees (WGS 84), or a vector file that says its CRS."
    raise FormatError(f"{raw.name}: no position on earth in row {shown} ({first}).", hint=hint)
