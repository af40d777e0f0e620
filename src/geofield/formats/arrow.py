"""From tables to files through Arrow: exact column types, missing values, streaming.

GDAL's writers take Arrow batches as they come, so that a layer of millions of points
never lies in memory as a whole, and an empty layer has the same columns as a full one.
"""

from __future__ import annotations

import shutil
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from datetime import datetime
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pyarrow as pa
import shapely
from numpy.typing import NDArray
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT, authority_name, reproject
from geofield.errors import FormatError
from geofield.formats.antimeridian import split
from geofield.wording import unlike

if TYPE_CHECKING:
    import geopandas as gpd

    from geofield.model import Dataset
    from geofield.schema import Column, Layer

#: Numbers of geometry types, as GEOS has them.
TYPE_IDS = {"Point": 0, "LineString": 1, "Polygon": 3, "MultiLineString": 5, "MultiPolygon": 6}
_PART = {"MultiLineString": 1, "MultiPolygon": 3}
_WHOLE = {"Point": 4, "LineString": 5, "Polygon": 6}
_NEARLY_FULL = 2**26
# GDAL's configuration belongs to the whole process.
_GDAL_CONFIG = threading.Lock()


@contextmanager
def gdal_config(**options: str) -> Iterator[None]:
    """GDAL configuration options for a block, one block at a time."""
    import pyogrio

    with _GDAL_CONFIG:
        before = {key: pyogrio.get_gdal_config_option(key) for key in options}
        pyogrio.set_gdal_config_options(options)
        try:
            yield
        finally:
            pyogrio.set_gdal_config_options(before)


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Writing a file with GDAL, which may refuse it.

    Raises
    ------
    FormatError
        With the driver's words.
    """
    try:
        yield
    except RuntimeError as error:  # which all errors of pyogrio are
        # Before them stands the statement that failed, of a new GeoPackage six thousand letters.
        words = str(error).rpartition(" failed: ")[2]
        raise FormatError(
            f"{path.name} could not be written: {words}.", hint=disk_hint(path)
        ) from error


def disk_hint(path: Path) -> str:
    """What to tell beside a driver's refusal: the disk only where it is nearly full."""
    free = shutil.disk_usage(path.parent).free
    return f"The disk has {free / 2**20:.0f} MB left." if free < _NEARLY_FULL else ""


def to_lonlat(geometry: NDArray[np.object_], crs: CRS) -> NDArray[np.object_]:
    """Geometries in WGS 84 longitude and latitude, degrees; those across 180 jump there."""
    return np.asarray(reproject(geometry, crs, LONLAT), dtype=object)


def cut_lonlat(geometry: NDArray[np.object_], crs: CRS) -> NDArray[np.object_]:
    """The same, those across 180 cut there."""
    return split(to_lonlat(geometry, crs))


def exact_geometry(of: Layer, table: gpd.GeoDataFrame) -> NDArray[np.object_]:
    """The geometries of a table as a layer wants them.

    Two-dimensional, of the layer's one type (single geometries are promoted), exterior rings
    counter-clockwise.

    Raises
    ------
    FormatError
        For a missing or empty geometry, or one of another type.
    """
    geometry = np.asarray(table.geometry.to_numpy(), dtype=object)
    wanted, kind = TYPE_IDS[of.geometry], shapely.get_type_id(geometry)
    geometry = promoted(of, geometry)
    wrong = (shapely.get_type_id(geometry) != wanted) | shapely.is_empty(geometry)
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        found = "no geometry" if kind[row] < 0 else geometry[row].geom_type
        if kind[row] >= 0 and shapely.is_empty(geometry[row]):
            found = f"an empty {found}"
        raise FormatError(
            f"Layer {of.name!r} holds {of.geometry} geometries; row {row + 1} has {found}.",
            hint="Split multi-part geometries and remove empty ones, then repeat.",
        )
    if shapely.has_z(geometry).any():
        geometry = shapely.force_2d(geometry)
    if wanted in (3, 6):
        geometry = shapely.orient_polygons(geometry)
    return np.asarray(geometry, dtype=object)


def promoted(of: Layer, geometry: NDArray[np.object_]) -> NDArray[np.object_]:
    """Single geometries as multi ones where a layer wants those; single parts out of multi ones."""
    kind, geometry = shapely.get_type_id(geometry), geometry.copy()
    if of.geometry in _PART:
        single = kind == _PART[of.geometry]
        lines = of.geometry == "MultiLineString"
        promote = shapely.multilinestrings if lines else shapely.multipolygons
        if single.any():
            geometry[single] = promote(geometry[single], indices=np.arange(single.sum()))
    else:
        alone = (kind == _WHOLE[of.geometry]) & (shapely.get_num_geometries(geometry) == 1)
        geometry[alone] = shapely.get_geometry(geometry[alone], 0)
    return geometry


def arrow_type(column: Column) -> Any:
    """The Arrow type of a column."""
    types = {"int": pa.int64(), "float": pa.float64(), "str": pa.string(), "date": pa.date32()}
    return types[column.type]


def arrow_values(column: Column, series: Any) -> pa.Array:
    """A column's values as Arrow; missing ones (NaN included) as null."""
    try:
        if column.type == "date":
            return pa.array([None if pd.isna(v) else str(v)[:10] for v in series]).cast(pa.date32())
        if column.type == "str":
            return pa.array([None if pd.isna(v) else str(v) for v in series], pa.string())
        if column.type == "float":
            values = series.to_numpy(dtype="float64", na_value=np.nan)
            return pa.array(values, pa.float64(), from_pandas=True)
        return pa.array(series.astype("Int64"), pa.int64(), from_pandas=True)
    except (pa.ArrowInvalid, pa.ArrowTypeError, ValueError, TypeError) as error:
        raise FormatError(
            f"Column {column.name!r} holds a value that is no {column.type}: {error}.",
            hint="Correct the value.",
        ) from error


def arrow_table(
    of: Layer,
    table: gpd.GeoDataFrame,
    *,
    lonlat: bool = False,
    decimals: int | None = None,
    geometry_name: str = "geom",
    reserved: Iterable[str] = (),
) -> pa.Table:
    """A layer's table as Arrow, geometry as WKB in the last column.

    The user's own columns stand behind those of the schema; one with a name of the schema in
    large or small letters, or with a `reserved` one, has a number behind it. `lonlat` reprojects
    to WGS 84; `decimals` rounds the coordinates.
    """
    geometry = exact_geometry(of, table)
    if lonlat:
        geometry = cut_lonlat(geometry, CRS(table.crs))
    if decimals is not None:
        geometry = _rounded(geometry, decimals)
    columns = {column.name: arrow_values(column, table[column.name]) for column in of.columns}
    taken = {*columns, geometry_name, *reserved}
    for name in schema.own_columns(of, table):
        # A person's `Name` is not our `name`, but GDAL and SQLite take one for the other.
        columns[unlike(str(name), taken, "_")] = _own_values(table[name])
    columns[geometry_name] = pa.array(shapely.to_wkb(geometry, flavor="iso"), pa.binary())
    return pa.table(columns)


def _rounded(geometry: NDArray[np.object_], decimals: int) -> NDArray[np.object_]:
    """Shapes on a grid of so many decimals, vertex by vertex; built anew where that breaks one."""
    rounded = shapely.transform(geometry, lambda xy: np.round(xy, decimals))
    broken = shapely.is_valid(geometry) & ~shapely.is_valid(rounded)
    sound = shapely.set_precision(geometry[broken], 10.0**-decimals)
    # What is too thin for the grid stays as it is: `validate` says so, and no row is lost.
    rounded[broken] = np.where(shapely.is_empty(sound), rounded[broken], sound)
    return np.asarray(rounded, dtype=object)


def _own_values(series: Any) -> pa.Array:
    try:
        values = pa.array(series, from_pandas=True)
        # Of days and times in one column Arrow makes days.
        mixed = pa.types.is_date(values.type) and any(
            isinstance(v, datetime) for v in series.dropna()
        )
    except (pa.ArrowInvalid, pa.ArrowTypeError, pa.ArrowNotImplementedError):
        mixed = True
    if mixed:
        values = pa.array([None if pd.isna(v) else str(v) for v in series], pa.string())
    as_text = pa.types.is_null(values.type) or pa.types.is_large_string(values.type)
    return values.cast(pa.string()) if as_text else values


def layer_batches(
    dataset: Dataset, of: Layer, *, points: bool = True, **how: Any
) -> pa.RecordBatchReader:
    """A layer as Arrow batches (`how` as of :func:`arrow_table`); track points as they come."""
    if of.name != schema.TRACK_POINTS.name:
        return arrow_table(of, dataset.table(of.name), **how).to_reader()
    chunks: Iterator[Any] = iter(dataset.point_chunks() if points else ())
    first = next(chunks, None)
    head = arrow_table(of, schema.empty(of, LONLAT) if first is None else first, **how)
    rest = (arrow_table(of, chunk, **how).cast(head.schema) for chunk in chunks)
    return pa.RecordBatchReader.from_batches(
        head.schema, (batch for table in chain([head], rest) for batch in table.to_batches())
    )


def write_layer(
    dataset: Dataset,
    of: Layer,
    path: Path,
    driver: str,
    *,
    lonlat: bool = False,
    decimals: int | None = None,
    points: bool = True,
    **options: Any,
) -> None:
    """Write a layer into a file through GDAL, in the dataset's CRS or WGS 84."""
    crs = LONLAT if lonlat else dataset.crs
    name = authority_name(crs)
    write_file(
        layer_batches(dataset, of, points=points, lonlat=lonlat, decimals=decimals),
        path,
        driver,
        layer=of.name,
        geometry_type=of.geometry,
        crs=name if ":" in name else crs.to_wkt(),
        **options,
    )


def write_file(
    rows: pa.Table | pa.RecordBatchReader, path: Path, driver: str, **options: Any
) -> None:
    """Write Arrow, WKB in its column `geom`, into a file through GDAL."""
    import pyogrio

    path.parent.mkdir(parents=True, exist_ok=True)
    with writing(path):
        pyogrio.write_arrow(rows, path, driver=driver, geometry_name="geom", **options)
