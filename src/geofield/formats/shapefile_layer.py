"""One Shapefile: what it holds, whether it fits, and writing it.

A Shapefile cuts names at ten characters, text at 254 bytes and files at 2 GB, mostly in
silence. Everything that would be cut is an error here, before anything is written. Each column
has the type that its schema says, whether or not there is a row to guess it from.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import shapely

from geofield import schema
from geofield.crs import LONLAT
from geofield.errors import FormatError, FormatWarning
from geofield.formats.arrow import arrow_values, cut_lonlat, disk_hint, exact_geometry, write_file
from geofield.model import Dataset
from geofield.notes import warn

TEXT_BYTES = 254
NAME_CHARACTERS = 10
FILE_BYTES = 2**31 - 1
#: Text columns have at least so many bytes, and terminals some room to write.
_TEXT_WIDTH = 80
#: Width of the other columns as GDAL declares them; a day has eight digits.
_WIDTHS = {"int": 18, "float": 24, "date": 8}

_SENTENCES = {"doubts"}

Column = tuple[schema.ColumnType, Sequence[Any]]


@dataclass(frozen=True, slots=True)
class ShapefileLayer:
    """One Shapefile to write.

    Attributes
    ----------
    path : Path
        Relative to the output folder, without suffix.
    geometry : str
        The one type of all shapes.
    columns : mapping
        Type and values by name.
    shapes : array of geometries
        In WGS 84.
    """

    path: Path
    geometry: str
    columns: Mapping[str, Column]
    shapes: Any


def schema_layer(
    dataset: Dataset,
    path: Path,
    of: schema.Layer,
    table: Any,
    before: Mapping[str, Column] | None = None,
) -> ShapefileLayer:
    """A table of the schema as a Shapefile with all its columns, further ones before them.

    Only sentences of our own are cut to what fits: names and ids are refused instead.
    """
    shapes = exact_geometry(of, table)
    table = table.assign(
        **{
            name: [text if pd.isna(text) else _cut(str(text)) for text in table[name]]
            for name in _SENTENCES & set(table.columns)
        }
    )
    columns: dict[str, Column] = {**(before or {})}
    columns |= {column.shapefile: (column.type, list(table[column.name])) for column in of.columns}
    for name in schema.own_columns(of, table):
        # The shapes are written as a column of the name `geom`.
        columns[_short(str(name), [*columns, "geom"])] = _own(table[name])
    return ShapefileLayer(path, of.geometry, columns, cut_lonlat(shapes, dataset.crs))


def _short(name: str, taken: Iterable[str]) -> str:
    """A user's column name cut to what fits, unlike the others."""
    lower = {str(each).lower() for each in taken}
    kept = name.encode()[:NAME_CHARACTERS].decode(errors="ignore")
    number = 1
    while kept.lower() in lower:
        number += 1
        end = f"_{number}"
        kept = name.encode()[: NAME_CHARACTERS - len(end)].decode(errors="ignore") + end
    return kept


def _own(series: Any) -> Column:
    """A user's own column: whole numbers, numbers, or what can be read as text.

    Of whole numbers with more digits readers make numbers with a point, which lack the last ones.
    """
    kind = schema.own_type(series)
    long_ones = kind == "int" and (series.abs() >= 10 ** _WIDTHS["int"]).any()
    if kind != "str" and not long_ones:
        return kind, list(series)
    texts = [None if pd.isna(value) else str(value) for value in series]
    long = [text for text in texts if text is not None and len(text.encode()) > TEXT_BYTES]
    if long:
        warn(
            f"Shapefiles cut text at {TEXT_BYTES} bytes: column {series.name!r} has longer ones.",
            FormatWarning,
        )
    return "str", [None if text is None else _cut(text) for text in texts]


def identified(layer: ShapefileLayer, dataset: Dataset) -> ShapefileLayer:
    """A layer that says in each row of which field it is."""
    column = schema.FIELD.column("field_id")
    if column.shapefile in layer.columns:
        return layer
    field_id = str(dataset.table(schema.FIELD.name)[column.name].iloc[0])
    count = len(layer.shapes)
    own: dict[str, Column] = {column.shapefile: (column.type, [field_id] * count)}
    return replace(layer, columns={**own, **layer.columns})


def merged(layers: Sequence[ShapefileLayer]) -> list[ShapefileLayer]:
    """Layers of one path as one; columns that only some of them have are empty in the others."""
    by_path: dict[Path, list[ShapefileLayer]] = {}
    for each in layers:
        by_path.setdefault(each.path, []).append(each)
    return [_one_of(same) if len(same) > 1 else same[0] for same in by_path.values()]


def _one_of(layers: Sequence[ShapefileLayer]) -> ShapefileLayer:
    kinds: dict[str, set[schema.ColumnType]] = {}
    for each in layers:
        for name, (kind, _) in each.columns.items():
            kinds.setdefault(name, set()).add(kind)
    columns: dict[str, Column] = {}
    for name, found in kinds.items():
        joint: schema.ColumnType = found.pop() if len(found) == 1 else "str"
        rows: list[Any] = []
        for each in layers:
            values = each.columns[name][1] if name in each.columns else [None] * len(each.shapes)
            rows += [v if joint != "str" or pd.isna(v) else str(v) for v in values]
        columns[name] = (joint, rows)
    shapes = np.concatenate([np.asarray(each.shapes, dtype=object) for each in layers])
    return ShapefileLayer(layers[0].path, layers[0].geometry, columns, shapes)


def _cut(text: str) -> str:
    """The beginning of a text, with an ellipsis, where it has too many bytes."""
    if len(text.encode()) <= TEXT_BYTES:
        return text
    return text.encode()[: TEXT_BYTES - 3].decode(errors="ignore") + "…"


def check_limits(layer: ShapefileLayer) -> None:
    """Refuse names, text and files that a Shapefile would cut."""
    name = layer.path.name
    seen: set[str] = set()
    record = 1
    for column, (kind, values) in layer.columns.items():
        if column.lower() in seen:
            raise FormatError(
                f"Shapefile {name}: two columns are called {column!r}, but for capital letters.",
                hint="Call that column the same in all fields.",
            )
        seen.add(column.lower())
        longest = _longest(values) if kind == "str" else ""
        if len(longest.encode()) > TEXT_BYTES:
            raise FormatError(
                f"Shapefile {name}: a text in column {column!r} has {len(longest.encode())} "
                f"bytes, {TEXT_BYTES} fit: {longest[:40]!r}...",
                hint="Shorten it, or use GeoPackage.",
            )
        record += _WIDTHS.get(kind, max(_TEXT_WIDTH, len(longest.encode())))
    points = int(shapely.get_num_coordinates(layer.shapes).sum())
    count = len(layer.shapes)
    size = max(100 + 64 * count + 16 * points, 1000 + record * count)
    if size > FILE_BYTES:
        raise FormatError(
            f"Shapefile {name} would need {size / 2**30:.1f} GB; 2 GB fit.",
            hint="Use GeoPackage or FlatGeobuf.",
        )


def _longest(values: Sequence[Any]) -> str:
    texts = (str(value) for value in values if not pd.isna(value))
    return max(texts, key=lambda text: len(text.encode()), default="")


def write_shapefile(layer: ShapefileLayer, place: Path, day: str | None) -> list[Path]:
    """Write one Shapefile with all its parts at a place without suffix.

    `day` (ISO 8601) is that of the last change.
    """
    columns = {
        name: arrow_values(schema.Column(name, kind, "", ""), pd.Series(values, dtype=object))
        for name, (kind, values) in layer.columns.items()
    }
    columns["geom"] = pa.array(shapely.to_wkb(layer.shapes), pa.binary())
    file = place.with_name(place.name + ".shp")
    write_file(
        pa.table(columns),
        file,
        "ESRI Shapefile",
        geometry_type=layer.geometry,
        crs=LONLAT.to_wkt("WKT1_GDAL"),
        encoding="UTF-8",
        DBF_DATE_LAST_UPDATE=day or "1970-01-01",
    )
    if not _is_whole(file, len(layer.shapes)):
        raise FormatError(f"{file.name} could not be written whole.", hint=disk_hint(file))
    if day is None:  # the day of the last change stays empty
        with file.with_suffix(".dbf").open("r+b") as table:
            table.seek(1)
            table.write(b"\0\0\0")
    return [place.with_name(place.name + end) for end in (".shp", ".shx", ".dbf", ".prj", ".cpg")]


def _is_whole(file: Path, rows: int) -> bool:
    """Whether all of a Shapefile is there: of a disk that is full at its end GDAL does not tell."""
    index, table = file.with_suffix(".shx"), file.with_suffix(".dbf")
    with file.open("rb") as shapes, table.open("rb") as records:
        (words,) = struct.unpack(">24xi", shapes.read(28).ljust(28, b"\0"))
        count, start, width = struct.unpack("<4xIHH", records.read(12).ljust(12, b"\0"))
    sizes = [each.stat().st_size for each in (file, index, table)]
    return count == rows and sizes == [2 * words, 100 + 8 * rows, start + rows * width + 1]
