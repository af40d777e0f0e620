"""Plans as tables of many fields, and back: one Arrow table per layer.

Every row carries `field_id` and `utm_epsg`. `geometry` is WGS 84, for every reader and any
number of zones; `geometry_utm` is the same shape in the metric CRS of its field, to the last
bit, so that a plan comes back as it was. What is no table (settings, source, evidence, grid)
stands in the layer `plan`, one row per field.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import groupby
from operator import itemgetter
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyarrow as pa
import shapely
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT, parse_crs, reproject
from geofield.errors import FormatError
from geofield.formats import origin
from geofield.formats.antimeridian import joined, seamless, split
from geofield.formats.arrow import arrow_type, arrow_values
from geofield.model import Dataset
from geofield.model.dataset import refuse_other_crs
from geofield.model.rows import Rows
from geofield.plan import Plan

FIELD_ID = "field_id"
EPSG = "utm_epsg"
GEOMETRY = "geometry"
EXACT = "geometry_utm"
#: One row per field: what is no layer of its own.
PLAN = "plan"
#: Written for every chunk, with rows or not: readers of a folder then always find them.
ALWAYS = ("field", "obstacles", "tracks", "segments", "gaps", PLAN)
#: The layers of a farm, in the schema's order; track points follow from the segments.
LAYERS = tuple(each for each in schema.LAYERS if each.name != schema.TRACK_POINTS.name)
#: All that is kept of plans in a farm.
KEPT = (*(each.name for each in LAYERS), PLAN)

Tables = dict[str, "pa.Table"]


def tables_of(plans: Iterable[Plan], own: pa.Schema | None = None) -> Tables:
    """The tables of some plans, by layer name, with `plan`.

    Optional layers are there only where they have rows. Each plan has a `field_id` of its own.
    `own` gives names and types of the user's own columns of the field; they are found out without.
    """
    plans = list(plans)
    rows = [plan.rows() for plan in plans]
    crs = [plan.field.crs for plan in plans]
    for each, its in zip(rows, crs, strict=True):
        refuse_other_crs(each, its)
    ids = [plan.field.field_id for plan in plans]
    tables: Tables = {}
    for layer in LAYERS:
        parts = [
            (at, one[layer.name])
            for at, one in enumerate(rows)
            if layer.name in one and len(one[layer.name])
        ]
        if parts or layer.name in ALWAYS:
            given = own if layer.name == schema.FIELD.name else None
            tables[layer.name] = layer_table(layer, parts, crs, ids, given)
    tables[PLAN] = _records(plans, rows, ids)
    return tables


def layer_table(
    of: schema.Layer,
    parts: Sequence[tuple[int, Rows]] = (),
    crs: Sequence[CRS] = (),
    ids: Sequence[str] = (),
    own: pa.Schema | None = None,
) -> pa.Table:
    """A layer of some fields; one without rows where none has it.

    `parts` are the rows with the positions of their fields in `crs` and `ids`.
    """
    counts = [len(rows) for _, rows in parts]
    mine = [ids[at] for at, _ in parts]
    zones = [epsg_of(crs[at]) for at, _ in parts]
    columns: dict[str, Any] = {
        FIELD_ID: pa.array(np.repeat(np.array(mine, dtype=object), counts), pa.string()),
        EPSG: pa.array(np.repeat(np.array(zones, dtype=object), counts), pa.int32()),
    }
    for column in of.columns:
        if column.name != FIELD_ID:
            values = [rows.column(column.name) for _, rows in parts]
            columns[column.name] = _joined(column, values)
    columns |= _own([rows for _, rows in parts], own)
    lonlat, shapes = [np.empty(0, dtype=object)], [np.empty(0, dtype=object)]
    # Neighbours in one CRS are transformed by one call.
    placed = ((crs[at], rows.geometry) for at, rows in parts)
    for zone, group in groupby(placed, key=itemgetter(0)):
        run = np.concatenate([geometry for _, geometry in group])
        lonlat.append(_lonlat(run, zone))
        shapes.append(run)
    exact = np.concatenate(shapes)
    columns[GEOMETRY] = pa.array(shapely.to_wkb(np.concatenate(lonlat), flavor="iso"), pa.binary())
    columns[EXACT] = pa.array(shapely.to_wkb(exact, flavor="iso"), pa.binary())
    return pa.table(columns)


def _joined(column: schema.Column, parts: Sequence[Any]) -> pa.Array:
    """A column of several fields, of which some may be tables that a person has changed."""
    kind = arrow_type(column)
    if not parts:
        return pa.array([], kind)
    wanted = {"int": "i", "float": "f"}.get(column.type)
    if wanted and all(isinstance(one, np.ndarray) and one.dtype.kind == wanted for one in parts):
        return pa.array(np.concatenate(parts), kind, from_pandas=True)
    return pa.concat_arrays(
        arrow_values(column, one) if column.type == "date" or isinstance(one, pd.Series)
        else pa.array(one, kind, from_pandas=True)
        for one in parts
    )  # fmt: skip


def _own(parts: Sequence[Rows], own: pa.Schema | None) -> dict[str, Any]:
    """The user's own columns, by name; of given types where they are known before."""
    names = list(own.names) if own is not None else []
    names += [name for rows in parts for name in rows.own if name not in (EPSG, EXACT, FIELD_ID)]
    columns = {}
    for name in dict.fromkeys(names):
        values: list[Any] = []
        for rows in parts:
            values += rows.own_values(name)
        kind = None if own is None or name not in own.names else own.field(name).type
        try:
            found = pa.array(values, kind, from_pandas=True)
        except (pa.ArrowInvalid, pa.ArrowTypeError, pa.ArrowNotImplementedError):
            # One says 7 and another "7 a": text holds both.
            texts = [None if each is None else str(each) for each in values]
            found = pa.array(texts, pa.string())
        columns[name] = found.cast(pa.string()) if pa.types.is_null(found.type) else found
    return columns


def _lonlat(shapes: Any, crs: CRS) -> Any:
    """Shapes in WGS 84, rings counter-clockwise, cut at the 180th meridian."""
    moved = reproject(shapes, crs, LONLAT)
    west, _, east, _ = shapely.total_bounds(moved)
    if east - west > 180.0:
        moved = split(moved)
    return shapely.orient_polygons(moved)


def _records(
    plans: Sequence[Plan], rows: Sequence[Mapping[str, Rows]], ids: Sequence[str]
) -> pa.Table:
    """What is no layer, as text; the same texts for many fields take no room."""
    settings: dict[int, str] = {}
    records = []
    for plan, layers in zip(plans, rows, strict=True):
        if id(plan.settings) not in settings:
            settings[id(plan.settings)] = _json(plan.provenance.settings)
        records.append(_record(plan, layers) | {"settings": settings[id(plan.settings)]})
    names = ("name", "crs", "tables", "software", "settings", "source", "evidence", "grid")
    columns: dict[str, Any] = {
        FIELD_ID: pa.array(list(ids), pa.string()),
        EPSG: pa.array([epsg_of(plan.field.crs) for plan in plans], pa.int32()),
    }
    for name in names:
        columns[name] = pa.array([row[name] for row in records], pa.string())
    return pa.table(columns)


def _record(plan: Plan, layers: Mapping[str, Rows]) -> dict[str, str]:
    """What is no layer of one field, but for its settings, which it shares with many."""
    provenance = replace(plan, settings=None).provenance
    bare = Dataset({}, plan.field.crs, plan.field.name, provenance, plan.grid)
    content = origin.content_of(bare)
    texts = {name: _json(content[name]) for name in ("source", "evidence", "grid")}
    own = {name: rows.own for name, rows in layers.items()}
    return texts | {
        "name": plan.field.name,
        "crs": content["crs"],
        "tables": _json(own),
        "software": content["software"],
    }


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"))


@lru_cache(maxsize=256)
def _epsg(wkt: str) -> int | None:
    return CRS(wkt).to_epsg(min_confidence=100)


def epsg_of(crs: CRS) -> int | None:
    """The EPSG code of a metric CRS; None where it has none."""
    return _epsg(crs.srs)


def plan_of(tables: Mapping[str, pa.Table]) -> Plan:
    """The plan of one field, from its rows by layer name, with `plan`."""
    if PLAN not in tables or tables[PLAN].num_rows != 1:
        raise FormatError(
            "The farm's record of this field is missing or double.",
            hint="Repeat `geofield batch` with --fresh: what you reviewed stays.",
        )
    record = tables[PLAN].to_pylist()[0]
    crs = parse_crs(record["crs"])
    parsed = {name: json.loads(record[name]) for name in ("settings", "source", "evidence", "grid")}
    parsed |= {"version": origin.VERSION, "name": record["name"], "software": record["software"]}
    back = origin.from_content({**parsed, "crs": record["crs"]})
    frames = {
        name: _frame(schema.layer(name), tables.get(name), own, crs)
        for name, own in json.loads(record["tables"]).items()
    }
    return Plan.from_dataset(Dataset(frames, crs, record["name"], back.provenance, back.grid))


def _frame(
    of: schema.Layer, table: pa.Table | None, own: Sequence[str], crs: CRS
) -> gpd.GeoDataFrame:
    """A layer of one field as it was before :func:`tables_of`."""
    if table is None or not table.num_rows:
        return schema.empty(of, crs)
    names = [name for name in (*of.column_names, *own) if name in table.column_names]
    shapes = shapely.from_wkb(table[EXACT].to_numpy(zero_copy_only=False))
    frame = gpd.GeoDataFrame(table.select(names).to_pandas(), geometry=shapes, crs=crs)
    return schema.conform(of, frame, extras=True)


def stacked(parts: Sequence[pa.Table]) -> pa.Table:
    """Parts of a layer as one table; where a column is of two kinds, text holds both."""
    for name in {name for part in parts for name in part.column_names}:
        kinds = [pa.schema([one.schema.field(name)]) for one in parts if name in one.column_names]
        try:
            pa.unify_schemas(kinds, promote_options="permissive")
        except pa.ArrowTypeError:
            told = {
                one[name].type for one in parts if name in one.column_names and _tells(one, name)
            }
            kind = told.pop() if len(told) == 1 else pa.string()
            parts = [_of_kind(part, name, kind) for part in parts]
    return pa.concat_tables(parts, promote_options="permissive")


def _tells(table: pa.Table, name: str) -> bool:
    """Whether a column has a value."""
    return bool(table[name].null_count < table.num_rows)


def _of_kind(table: pa.Table, name: str, kind: pa.DataType) -> pa.Table:
    """A table with a column of a kind, which is text where its values are of another."""
    if name not in table.column_names or table[name].type == kind:
        return table
    values = [None if each is None else str(each) for each in table[name].to_pylist()]
    column = pa.array(values, pa.string()) if _tells(table, name) else pa.nulls(len(table), kind)
    return table.set_column(table.column_names.index(name), name, column)


def frame_of(table: pa.Table) -> gpd.GeoDataFrame:
    """A layer of many fields as people use it.

    In the metric CRS where all its fields share one, else in WGS 84, or in Pacific Mercator where
    some are near 180 degrees; lengths and areas are true metres and hectares in their columns.
    """
    zones = table[EPSG].to_pandas()
    shared = zones.nunique(dropna=False) == 1 and zones.notna().all()
    shapes = shapely.from_wkb(table[EXACT if shared else GEOMETRY].to_numpy(zero_copy_only=False))
    crs = CRS.from_epsg(int(zones.iloc[0])) if shared else seamless(shapes)
    if not shared and crs != LONLAT:
        exact = shapely.from_wkb(table[EXACT].to_numpy(zero_copy_only=False))
        shapes = reproject(joined(shapes, LONLAT), LONLAT, crs)
        for zone in zones.dropna().unique():
            # As they were, not joined again behind a cut.
            mine = (zones == zone).to_numpy()
            shapes[mine] = reproject(exact[mine], CRS.from_epsg(int(zone)), crs)
    # Whole numbers stay whole beside missing ones.
    kinds = {pa.int64(): pd.Int64Dtype(), pa.bool_(): pd.BooleanDtype()}
    rest = table.drop_columns([GEOMETRY, EXACT]).to_pandas(types_mapper=kinds.get)
    return gpd.GeoDataFrame(rest, geometry=shapes, crs=crs)
