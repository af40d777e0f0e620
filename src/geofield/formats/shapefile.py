"""ESRI Shapefiles: WGS 84, explicit short names, refused rather than cut.

A Shapefile cuts names at ten characters, text at 254 bytes and files at 2 GB, mostly in
silence. Everything that would be cut is an error here, before anything is written.
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import shapely
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT
from geofield.errors import FormatError
from geofield.formats.arrow import arrow_table, write_layer
from geofield.formats.foreign import RawLayer, read_foreign, read_vector
from geofield.formats.origin import timestamp
from geofield.formats.shapefile_profiles import PROFILES
from geofield.model import Dataset

if TYPE_CHECKING:
    import geopandas as gpd
    import pyarrow as pa

TEXT_BYTES = 254
NAME_CHARACTERS = 10
FILE_BYTES = 2**31 - 1

#: File name and layer of the generic profile.
GENERIC = {"boundary": schema.FIELD, "obstacles": schema.OBSTACLES, "guidance": schema.SEGMENTS}


@dataclass(frozen=True, slots=True)
class ShapefileLayer:
    """One Shapefile to write: its path without suffix, geometry type and Arrow table."""

    path: Path
    geometry: str
    table: pa.Table


def write(dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]) -> list[Path]:
    """Write Shapefiles.

    Options: ``profile`` (``generic``, ``tracklead`` or ``aggps``), ``customer`` and ``farm``
    (names for terminals), ``zip`` (true: one archive without sub-folders).
    """
    profile = str(options.get("profile", "generic"))
    customer, farm = str(options.get("customer", "")), str(options.get("farm", ""))
    if profile == "generic":
        layers = _generic(dataset, folder / "shapefile", customer, farm)
    elif profile in PROFILES:
        layers = [
            ShapefileLayer(folder / path, geometry, table)
            for path, geometry, table in PROFILES[profile](dataset, customer, farm)
        ]
    else:
        raise FormatError(
            f"There is no Shapefile profile {profile!r}.",
            hint=f"Profiles: generic, {', '.join(PROFILES)}.",
        )
    for layer in layers:
        check_limits(layer)
    date = timestamp(dataset)[:10]
    written: list[Path] = []
    for layer in layers:
        write_layer(
            layer.table,
            layer.path.with_name(layer.path.name + ".shp"),
            layer=layer.path.name,
            driver="ESRI Shapefile",
            geometry_type=layer.geometry,
            crs=LONLAT,
            layer_options={"ENCODING": "UTF-8", "DBF_DATE_LAST_UPDATE": date},
        )
        written += [
            layer.path.with_name(layer.path.name + suffix)
            for suffix in (".shp", ".shx", ".dbf", ".prj", ".cpg")
        ]
    if options.get("zip"):
        return [_zipped(written, folder / f"{stem}_shapefile.zip", date)]
    return written


def short_names(of: schema.Layer) -> dict[str, str]:
    """The names of a layer's columns in a Shapefile."""
    return {column.name: column.shapefile for column in of.columns}


def check_limits(layer: ShapefileLayer) -> None:
    """Refuse what a Shapefile would cut.

    Raises
    ------
    FormatError
        For names, text or files that are too long.
    """
    import pyarrow as pa

    name = layer.path.name
    seen: set[str] = set()
    record = 1
    for column, values in zip(layer.table.column_names, layer.table.columns, strict=True):
        if column == "geom":
            continue
        if len(column.encode()) > NAME_CHARACTERS or column.lower() in seen:
            raise FormatError(f"Shapefile {name}: the column name {column!r} is too long or twice.")
        seen.add(column.lower())
        if pa.types.is_string(values.type):
            texts = [text for text in values.to_pylist() if text is not None]
            longest = max(texts, key=lambda text: len(text.encode()), default="")
            if len(longest.encode()) > TEXT_BYTES:
                raise FormatError(
                    f"Shapefile {name}: a text in column {column!r} has {len(longest.encode())} "
                    f"bytes, {TEXT_BYTES} fit: {longest[:40]!r}...",
                    hint="Shorten it, or use GeoPackage.",
                )
            record += max(80, len(longest.encode()))
        else:
            record += 24
    geometry = shapely.from_wkb(layer.table["geom"].to_numpy())
    points = int(shapely.get_num_coordinates(geometry).sum()) if len(geometry) else 0
    size = max(100 + 64 * len(geometry) + 16 * points, 1000 + record * layer.table.num_rows)
    if size > FILE_BYTES:
        raise FormatError(
            f"Shapefile {name} would need {size / 2**30:.1f} GB; 2 GB fit.",
            hint="Use GeoPackage or FlatGeobuf.",
        )


def _generic(dataset: Dataset, folder: Path, customer: str, farm: str) -> list[ShapefileLayer]:
    import pyarrow as pa

    layers = []
    for name, layer in GENERIC.items():
        table = arrow_table(
            layer, dataset.table(layer.name), names=short_names(layer), lonlat=True, extras=False
        )
        if layer is schema.FIELD:
            # The boundary import of several farm platforms asks for these three.
            rows = table.num_rows
            for position, (key, value) in enumerate(
                (("CLIENT", customer), ("FARM", farm), ("FIELD", dataset.name))
            ):
                table = table.add_column(position, key, pa.array([value] * rows, pa.string()))
        layers.append(ShapefileLayer(folder / name, layer.geometry, table))
    return layers


def _zipped(files: list[Path], path: Path, date: str) -> Path:
    year, month, day = (int(part) for part in date.split("-"))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in files:
            # ZIP knows no time before 1980.
            info = zipfile.ZipInfo(file.name, (max(year, 1980), month, day, 0, 0, 0))
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, file.read_bytes())
            file.unlink()
    return path


def read(path: Path, *, crs: CRS | None = None) -> Dataset:
    """The dataset in a Shapefile, or in all Shapefiles of a folder."""
    files = sorted(path.glob("*.[sS][hH][pP]")) if path.is_dir() else [path]
    return read_foreign([_raw(file) for file in files], path, crs=crs)


def _raw(file: Path) -> RawLayer:
    if not any(file.with_suffix(suffix).exists() for suffix in (".shx", ".SHX")):
        raise FormatError(
            f"{file.name} lacks its .shx index.", hint="Copy all files of the Shapefile."
        )
    frame: gpd.GeoDataFrame = read_vector(file)
    layer = GENERIC.get(file.stem.lower())
    if layer is None:
        return RawLayer(file.stem, frame)
    back = {short: name for name, short in short_names(layer).items()}
    if not set(frame.columns) >= set(back):
        return RawLayer(file.stem, frame)
    frame = frame.drop(columns=[c for c in ("CLIENT", "FARM", "FIELD") if c in frame.columns])
    return RawLayer(layer.name, frame.rename(columns=back))
