"""Files of rows read into Arrow: CSV, Parquet, and whatever GDAL reads."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas as gpd
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import shapely

from geofield.errors import CRSError, FormatError, MissingFileError
from geofield.formats.catalogue import PARQUET
from geofield.formats.foreign import has_rows, read_vector, refuse_layer
from geofield.formats.gpkg_read import is_own
from geofield.formats.registry import detect, files_of, refuse_no_rows
from geofield.formats.row_crs import refuse_other_rows, said_crs
from geofield.formats.zipped import unpacked
from geofield.strangers import check_vector, unreadable
from geofield.wording import command, nearest

CSV = (".csv", ".tsv", ".txt")
_ROWS = "Give a row of names, and one per field or obstacle."
_UTF_8 = "Save it as UTF-8 (Excel: CSV UTF-8)."
#: Kinds of shapes that may have arcs: circular strings to multi-surfaces.
_CURVED = range(8, 13)
_GEOMETRY = ("geometry", "geom", "wkt", "the_geom")


@dataclass(frozen=True, slots=True)
class RawTable:
    """A file of rows as it is."""

    #: For people.
    name: str
    #: All columns but the geometry.
    table: pa.Table
    #: Well-known binary.
    geometry: pa.Array | None = None
    geometry_name: str = ""
    #: Of the geometry, as the file says; None where it does not.
    crs: Any = None
    #: Whether coordinates without a CRS are degrees.
    in_degrees: bool = False


def read_raw(path: Path, *, layer: str | None, texts: Sequence[str | None]) -> RawTable:
    """A file of rows; `layer` is needed where it has several.

    `texts` are columns that are text whatever they look like: 007 is no 7.

    Raises
    ------
    FormatError
        When the file is missing, damaged, or has several layers of which none was named.
    """
    if not path.exists():
        raise MissingFileError(
            f"There is no file {path}.", hint="It is a file with a row per field or obstacle."
        )
    if path.suffix.lower() == ".zip":
        with unpacked(path) as folder:
            file = _only_file(path, folder, layer)
            if is_own(file):
                raise FormatError(
                    f"{path} holds {file.name} of geofield, whose obstacles and settings are only "
                    "read where it lies by itself.",
                    hint="Unpack it, and give that file.",
                )
            return read_raw(file, layer=layer, texts=texts)
    if path.suffix.lower() in (*CSV, *PARQUET):
        refuse_layer(path, layer)
    if path.suffix.lower() in CSV:
        return _csv(path, {text.lower() for text in texts if text})
    if path.suffix.lower() in PARQUET:
        return _parquet(path)
    if path.suffix.lower() == ".dxf":
        return _drawing(path, layer)
    return _vector(path, layer)


def _only_file(archive: Path, folder: Path, layer: str | None) -> Path:
    """The file of rows in a folder that was unpacked; of several, the one called like `layer`."""
    files = files_of(folder, detect(folder))
    if len(files) == 1:
        return files[0]
    if not files:
        raise FormatError(f"{archive} holds no file of places.", hint=_ROWS)
    named = [file for file in files if file.stem == layer]
    if len(named) != 1:
        raise _several(archive, [file.stem for file in files])
    return named[0]


def _several(path: Path, layers: Sequence[str]) -> FormatError:
    """That a file has several layers: one field among them is found, one of many fields named."""
    return FormatError(
        f"{path} has {len(layers)} layers: {', '.join(layers[:8])}.",
        hint=f"Find the field in them: {command('import', path, '-o', 'field.gpkg')} (or name the "
        "layer of places to `geofield batch`: --layer NAME).",
    )


def raw_of(frame: pd.DataFrame) -> RawTable:
    """A table of places that a Python user has."""
    name = "The table"
    shapes = frame.geometry if isinstance(frame, gpd.GeoDataFrame) else None
    if shapes is not None and shapes.crs is None:
        raise CRSError(f"{name} does not say its CRS.", hint="Name it: frame.set_crs(...).")
    plain = pd.DataFrame(frame.loc[:, (frame.dtypes != "geometry").to_numpy(bool)])
    try:
        # The index comes along: it may be the names, and counts the rows where no column does.
        table = pa.Table.from_pandas(plain, preserve_index=True).replace_schema_metadata(None)
    except (pa.ArrowException, ValueError) as error:
        raise FormatError(
            f"{name} has a column of several kinds of values, or two of one name: {error}.",
            hint="Give each column a name of its own, and values of one kind.",
        ) from None
    unnamed = [each for each in table.column_names if each.startswith("__index_level_")]
    table = table.drop_columns(unnamed)
    return RawTable(name, table) if shapes is None else _with_shapes(name, table, shapes)


def _drawing(path: Path, layer: str | None) -> RawTable:
    """A layer of a drawing."""
    frame = read_vector(path)
    layers = frame["Layer"].unique().tolist()
    if layer is None and len(layers) > 1:
        raise _several(path, layers)
    frame = frame if layer is None else frame[_of_layer(path, layers, layer) == frame["Layer"]]
    return _with_shapes(path.name, pa.table({"layer": frame["Layer"]}), frame.geometry)


def _with_shapes(name: str, table: pa.Table, shapes: gpd.GeoSeries) -> RawTable:
    geometry = pa.array(shapely.to_wkb(shapes.to_numpy()), pa.binary(), from_pandas=True)
    return RawTable(name, table, geometry, str(shapes.name), shapes.crs)


def _of_layer(path: Path, layers: Sequence[str], layer: str) -> str:
    """A layer that there is."""
    if layer not in layers:
        raise FormatError(
            f"{path} has no layer {layer!r}.{nearest(layer, layers)}",
            hint=f"It has {', '.join(layers[:8])}.",
        )
    return layer


def _csv(path: Path, texts: set[str]) -> RawTable:
    import pyarrow.csv as table_csv

    try:
        with path.open("rb") as file:
            head = file.read(1 << 16)
        lines = head.decode("utf-8-sig", errors="replace").split("\n", 2)
        # A line such as sep=; is Excel's: what stands between the columns.
        above = int(lines[0].lower().startswith("sep=") and len(lines) > 1)
        first = lines[above].strip("\r")
        if not first:
            raise FormatError(f"{path} is empty: it holds no rows.", hint=_ROWS)
        mark = max(";\t,", key=first.count)
        names = [name.strip().strip('"') for name in first.split(mark)]
        # 35,0754;33,5311 is how spreadsheets write it in half of Europe.
        comma = mark != "," and re.search(rb"[;\t\n]-?\d+,\d+", head) is not None
        table = table_csv.read_csv(
            path,
            read_options=table_csv.ReadOptions(column_names=names, skip_rows=above + 1),
            parse_options=table_csv.ParseOptions(delimiter=mark, newlines_in_values=True),
            convert_options=table_csv.ConvertOptions(
                column_types={name: pa.string() for name in names if name.lower() in texts},
                decimal_point="," if comma else ".",
            ),
        )
    except OSError as error:
        raise FormatError(f"{path} cannot be read: {error}.", hint="May you read it?") from None
    except (pa.ArrowInvalid, pa.ArrowKeyError) as error:
        if "Empty CSV" in str(error):
            raise FormatError(f"{path} is empty: it holds no rows.", hint=_ROWS) from None
        hint = _UTF_8
        if "Expected" in str(error) and b"\0" not in head:
            hint = "Each row has as many values as the first: quote texts that hold commas."
        raise FormatError(f"{path} cannot be read: {error}.", hint=hint) from None
    if any(pa.types.is_binary(kind) for kind in table.schema.types):
        raise FormatError(f"{path} has texts that are no UTF-8.", hint=_UTF_8)
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise FormatError(f"{path} has two columns {twice[0]!r}.", hint="Rename one of them.")
    texts_in = [name for name in names if pa.types.is_string(table.schema.field(name).type)]
    for name in texts_in:  # NA and null are missing numbers, but texts as others
        empty = pc.equal(table[name], "")
        table = table.set_column(names.index(name), name, pc.if_else(empty, None, table[name]))
    column = next((name for name in texts_in if name.lower() in _GEOMETRY), None)
    if column is None:
        return RawTable(path.name, table)
    shapes = _of_texts(path, table[column].to_numpy())
    geometry = pa.array(shapely.to_wkb(shapes), pa.binary(), from_pandas=True)
    return RawTable(path.name, table.drop_columns(column), geometry, column, in_degrees=True)


def _of_texts(path: Path, texts: Any) -> Any:
    """Shapes of well-known text, none where it is none."""
    try:
        return shapely.from_wkt(texts, on_invalid="ignore")
    except NotImplementedError:
        raise FormatError(
            f"{path} has shapes with arcs.",
            hint="Make lines of them: ogr2ogr -nlt CONVERT_TO_LINEAR NAME.gpkg FILE",
        ) from None


def _parquet(path: Path) -> RawTable:
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(path)
    except (pa.ArrowInvalid, OSError) as error:
        raise unreadable(path, error) from None
    geo = json.loads((table.schema.metadata or {}).get(b"geo", b"{}"))
    # Texts that are views, as Polars has them, are not sorted or taken from.
    kinds = {pa.string_view(): pa.string(), pa.binary_view(): pa.binary()}
    plain = [each.with_type(kinds.get(each.type, each.type)) for each in table.schema]
    table = table.cast(pa.schema(plain))
    name = geo.get("primary_column")
    if name not in table.column_names:
        return RawTable(path.name, table)
    column = geo["columns"][name]
    if column.get("encoding") != "WKB":
        raise FormatError(
            f"{path}: geometry in the encoding {column.get('encoding')} is not read.",
            hint='Write it as WKB: gdf.to_parquet(path, geometry_encoding="WKB").',
        )
    crs = column.get("crs", "OGC:CRS84")
    geometry = table[name].combine_chunks()
    boxes = column.get("covering", {}).get("bbox", {}).get("xmin", [None])[0]
    rest = table.drop_columns([each for each in {name, boxes} if each in table.column_names])
    if isinstance(crs, dict):
        crs = json.dumps(crs)
    return RawTable(path.name, rest, geometry, name, crs)


def _layer(path: Path, layer: str | None) -> str | None:
    """The layer that is asked for, or the only one in which something is."""
    import pyogrio

    listed = pyogrio.list_layers(path)
    layers = [str(name) for name, kind in listed if kind is not None]
    if not len(listed):
        raise FormatError(f"{path} holds no layers.", hint=_ROWS)
    if layer is not None and layer not in listed[:, 0]:
        _of_layer(path, layers, layer)
    if layer is None and "field" in layers and is_own(path):
        return "field"  # what stands there is known by the other layers, and read with it
    if layer is None and len(layers) > 1:
        filled = [each for each in layers if has_rows(path, each)]
        if len(filled) > 1:
            raise _several(path, filled)
        return (filled or layers)[0]
    return layer


def _vector(path: Path, layer: str | None) -> RawTable:
    import pyogrio
    from pyogrio.errors import DataLayerError, DataSourceError

    check_vector(path)
    refuse_no_rows(path)
    try:
        layer = _layer(path, layer)
        meta, table = pyogrio.read_arrow(path, layer=layer)
        try:
            table.validate(full=True)
        except pa.ArrowInvalid:  # as of a Shapefile that does not say its encoding
            table = pyogrio.read_arrow(path, layer=layer, encoding=meta["encoding"])[1]
            table.validate(full=True)
    except (DataSourceError, DataLayerError) as error:
        raise unreadable(path, error) from None
    except (UnicodeDecodeError, pa.ArrowInvalid) as error:
        raise FormatError(
            f"{path}: its text is not in the encoding it claims ({error}).",
            hint="Save it as UTF-8 (a Shapefile with a .cpg file beside it).",
        ) from None
    refuse_other_rows(path, layer, meta["crs"])
    name = meta["geometry_name"] or "wkb_geometry"
    table = table.replace_schema_metadata(None)
    if name not in table.column_names:
        return RawTable(path.name, table)
    geometry = table[name].combine_chunks()
    crs = said_crs(path, meta["crs"], lambda: _shapes(geometry))
    if _is_curved(geometry):  # only here GDAL makes lines of arcs
        geometry = pa.array(pyogrio.raw.read(path, layer=layer, columns=[])[2], pa.binary())
    return RawTable(path.name, table.drop_columns(name), geometry, name, crs)


def _shapes(geometry: pa.Array) -> Any:
    return shapely.from_wkb(geometry.to_numpy(zero_copy_only=False), on_invalid="ignore")


def _is_curved(geometry: pa.Array) -> bool:
    """Whether some shapes have arcs, as those of cadastres, by the kinds of well-known binary."""
    kinds = pc.unique(pc.binary_slice(geometry, 1, 5)).drop_null().to_pylist()
    return any(int.from_bytes(kind, "little") % 1000 in _CURVED for kind in kinds)
