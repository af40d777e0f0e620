"""Reading places: positions, outlines, ids and names of whatever file a person has."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import shapely
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT, authority_name, parse_crs, transformer
from geofield.datum import datum_notes
from geofield.errors import CRSError, FormatError
from geofield.farm.place_settings import check_settings, setting_names
from geofield.farm.places import Places
from geofield.formats.antimeridian import joined
from geofield.formats.foreign_tables import ID_COLUMNS, NAME_COLUMNS
from geofield.formats.raw_tables import RawTable, raw_of, read_raw
from geofield.formats.table_positions import LAT, LON, check_positions, degrees, found
from geofield.model.place import position_words
from geofield.parts import single_parts
from geofield.settings import Settings
from geofield.wording import NAME_CRS, cell_text, counted, unlike

_BATCH = 50_000


def read_places(
    path: str | Path | pd.DataFrame,
    *,
    settings: Settings | None = None,
    layer: str | None = None,
    crs: str | None = None,
    id_column: str | None = None,
    name_column: str | None = None,
    lat_column: str | None = None,
    lon_column: str | None = None,
    unnamed: str | None = None,
) -> Places:
    """Read places: points (columns lat and lon, or geometry) or parcels.

    From a table, CSV, Parquet, or any vector file that GDAL reads, of which `layer` is one of
    several and `crs` is that of coordinates that do not say theirs. Columns with usual names are
    found; those named like settings are judged with `settings`. Places without a name are called
    `unnamed`, with their row, or by their id.

    Raises
    ------
    FormatError
        When there is no such column, an id comes twice, there are no places, positions are no
        positions, or a column that is named like a setting holds something else.
    CRSError
        When the file does not say its CRS, or has coordinates outside it.
    """
    texts = (*ID_COLUMNS, *NAME_COLUMNS, id_column, name_column)
    if isinstance(path, pd.DataFrame):
        raw = raw_of(path)
        where = raw.name
    else:
        raw = read_raw(Path(path), layer=layer, texts=texts)
        where = str(path)
    if not raw.table.num_rows:
        raise FormatError(f"{where} is empty: it holds no places.", hint="Give one row per field.")
    # What geofield wrote beside the names of its own outlines is no word of the user's.
    raw = replace(raw, table=raw.table.select(schema.of_others(raw.table.column_names)))
    id_name, name_name = found(raw, id_column, ID_COLUMNS), found(raw, name_column, NAME_COLUMNS)
    lat_name, lon_name = found(raw, lat_column, LAT), found(raw, lon_column, LON)
    notes: list[str] = []
    kept = np.arange(raw.table.num_rows)
    outlines, part = None, np.zeros(raw.table.num_rows, dtype=np.int64)
    source = LONLAT
    if raw.geometry is not None:
        source = _crs_of(raw, crs)
        kept, part, outlines, lat, lon = _shapes(raw, raw.geometry, source, notes)
        used = {id_name, name_name, raw.geometry_name}
    elif lat_name and lon_name:
        lat, lon = degrees(raw, lat_name, "NS"), degrees(raw, lon_name, "EW")
        used = {id_name, name_name, lat_name, lon_name}
    else:
        raise FormatError(
            f"{raw.name} has no columns lat and lon and no geometry.",
            hint=f"It has {', '.join(raw.table.column_names)}; name them with --lat-column and "
            "--lon-column.",
        )
    check_positions(raw, lat, lon, kept, source)
    rest = [name for name in raw.table.column_names if name not in used]
    per_place = [name for name in rest if name in setting_names()]
    own = _plain(raw.table.select([name for name in rest if name not in per_place])).take(kept)
    said = raw.table.select(per_place).take(kept)
    check_settings(raw.name, said, settings)
    ids, names = _names(raw, id_name, name_name, unnamed, kept, part, lat, lon)
    return Places(
        where, ids, names, lat, lon, kept + 1, outlines, source,
        own.rename_columns(schema.own_names(schema.FIELD, own.column_names)),
        said, tuple(notes), ids_given=id_name is not None,
    )  # fmt: skip


def _plain(table: pa.Table) -> pa.Table:
    """A table in which lists, objects and time spans are text, as all files of a farm have it."""
    for at, each in enumerate(table.schema):
        if pa.types.is_nested(each.type) or pa.types.is_duration(each.type):
            text = str if pa.types.is_duration(each.type) else _as_json
            values = [None if one is None else text(one) for one in table[at].to_pylist()]
            table = table.set_column(at, each.name, pa.array(values, pa.string()))
    return table


def _as_json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, default=str)


def _crs_of(raw: RawTable, crs: str | None) -> CRS:
    if raw.crs is None and crs is None and raw.in_degrees:
        return LONLAT
    if raw.crs is None and crs is None:
        raise CRSError(f"{raw.name} does not say its CRS.", hint=NAME_CRS)
    own = None if raw.crs is None else parse_crs(raw.crs)
    given = own if crs is None else parse_crs(crs)
    if own is not None and given is not None and not own.equals(given, ignore_axis_order=True):
        raise CRSError(
            f"{raw.name} is in {own.name} by its own word, not in {given.name}.",
            hint="Leave out --crs, or correct the file.",
        )
    return given if own is None else own  # type: ignore[return-value]


def _shapes(raw: RawTable, geometry: pa.Array, source: CRS, notes: list[str]) -> tuple[Any, ...]:
    """The rows that are places, the part of the row, outlines, latitudes and longitudes."""
    kept, part, outlines, xs, ys, other = [], [], [], [], [], 0
    for begin in range(0, len(geometry), _BATCH):
        binary = geometry.slice(begin, _BATCH).to_numpy(zero_copy_only=False)
        shapes = shapely.force_2d(shapely.from_wkb(binary, on_invalid="fix"))
        shapes = joined(shapes, source)  # a parcel cut at 180 degrees is one
        shapes[shapely.is_empty(shapes)] = None
        single, row = single_parts(shapes)
        # A row without shape is a place that fails and says so.
        absent = np.setdiff1d(np.arange(len(shapes)), row)
        kind = shapely.get_type_id(single)
        # A point beside a polygon in one row is no field of its own.
        point = (kind == 0) & ~np.isin(row, row[kind == 3])
        usable = point | (kind == 3)
        other += int((~usable).sum())
        single = np.append(single[usable], np.full(len(absent), None))
        row = np.append(row[usable], absent)
        order = np.argsort(row, kind="stable")
        single, row = single[order], row[order]
        within = np.arange(len(row)) - np.searchsorted(row, row)
        several = np.bincount(row, minlength=len(shapes))[row] > 1
        where = shapely.point_on_surface(single)
        kept.append(row + begin)
        part.append(np.where(several, within + 1, 0))
        xs.append(shapely.get_x(where))
        ys.append(shapely.get_y(where))
        area = shapely.get_type_id(single) == 3
        wkb = shapely.to_wkb(single)
        wkb[~area] = None
        outlines.append(pa.array(wkb, pa.binary(), from_pandas=True))
    if other:
        are = counted(other, "shape is", "shapes are")
        notes.append(f"{are} no polygon and no place: left out.")
    rows, parts = np.concatenate(kept), np.concatenate(part)
    if not len(rows):
        raise FormatError(
            f"{raw.name} holds no points and no polygons.",
            hint="Give a point or a parcel a row (QGIS makes parcels of closed lines: Lines to "
            "polygons).",
        )
    if parts.any():
        of_parts = len(np.unique(rows[parts > 0]))
        notes.append(
            f"{counted(of_parts, 'parcel has', 'parcels have')} several parts: each is a field."
        )
    every = pa.concat_arrays(outlines)
    _refuse_degrees(raw, source, np.concatenate(xs), np.concatenate(ys))
    notes += datum_notes(source, np.concatenate(xs), np.concatenate(ys))
    lon, lat = transformer(source, LONLAT).transform(np.concatenate(xs), np.concatenate(ys))
    if source.is_geographic:  # longitudes from 0 to 360, as of joined parcels
        lon = np.where((lon > 180.0) & (lon < 360.0), lon - 360.0, lon)
    return rows, parts, every if every.null_count < len(every) else None, lat, lon


def _refuse_degrees(raw: RawTable, source: CRS, x: Any, y: Any) -> None:
    """Refuse degrees that a file calls metres: all its places would lie off the coast of Africa."""
    known = np.isfinite(x) & np.isfinite(y)
    if source.is_projected and known.any() and (np.hypot(x, y)[known] < 200.0).all():
        raise CRSError(
            f"{raw.name} is in {authority_name(source)} by its own word, and its coordinates look "
            "like degrees.",
            hint="Say the true CRS in the file: ogr2ogr -a_srs EPSG:4326 right.gpkg FILE",
        )


def _names(
    raw: RawTable, id_name: str | None, name_name: str | None, unnamed: str | None,
    kept: Any, part: Any, lat: Any, lon: Any,
) -> tuple[pa.Array, pa.Array]:  # fmt: skip
    """Ids and names of all places; those without a name go by `unnamed` and their row, or their id.

    Raises
    ------
    FormatError
        When an id of the file comes twice.
    """
    ids: list[str | None] = [None] * len(kept)
    names: list[str | None] = [None] * len(kept)
    if name_name is not None:
        names = _texts(raw.table[name_name]).take(kept).to_pylist()
    if id_name is not None:
        column = _texts(raw.table[id_name])
        counts = pc.value_counts(column.drop_null())
        double = counts.filter(pc.greater(counts.field("counts"), 1)).field("values").to_pylist()
        if double:
            first = double[0]
            rows = [i + 1 for i, one in enumerate(column.to_pylist()) if one == first]
            hint = (
                "Give each place an id of its own, or name another column "
                "(`geofield batch --id-column`)."
            )
            if raw.geometry is not None:
                hint += " Merge what are parts of one field (QGIS: Merge Selected Features)."
            raise FormatError(
                f"{raw.name}: column {id_name!r} holds {len(double)} ids more than once, such as "
                f"{first!r} in rows {', '.join(map(str, rows[:5]))}.",
                hint=hint,
            )
        ids = column.take(kept).to_pylist()
    elif None not in names and len(set(names)) == len(names) > 1 and not part.any():
        ids = list(names)  # names that are all different do as well
    taken = {one for one in ids if one}
    for at, one in enumerate(ids):
        if one:
            ids[at] = unlike(f"{one}.{part[at]}", taken, "-", key=str) if part[at] else one
        else:
            ids[at] = unlike(_place_id(lat[at], lon[at], int(kept[at]) + 1), taken, "-", key=str)
    others: Sequence[str | None] = ids
    if unnamed is not None:
        one = raw.table.num_rows == 1
        others = [unnamed if one else f"{unnamed}_{row + 1}" for row in kept.tolist()]
    called = [name or other for name, other in zip(names, others, strict=True)]
    return pa.array(ids, pa.string()), pa.array(called, pa.string())


def _texts(column: Any) -> Any:
    """A column as text; whole numbers without a point, what is empty missing."""
    if pa.types.is_floating(column.type) or pa.types.is_nested(column.type):
        texts = [None if one is None else cell_text(one) for one in column.to_pylist()]
        column = pa.chunked_array([pa.array(texts, pa.string())])
    text = pc.utf8_trim_whitespace(column.cast(pa.string()).combine_chunks())
    return pc.if_else(pc.equal(text, ""), pa.scalar(None, pa.string()), text)


def _place_id(lat: float, lon: float, row: int) -> str:
    """An id for a place without one: where it is, to about 10 m."""
    if not (np.isfinite(lat) and np.isfinite(lon)):
        return f"row{row}"
    return position_words(lat, lon, 4)
