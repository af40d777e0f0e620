"""Tracks that a person edited in a farm's overview: told by digests, and put into their plans.

What is taken away, drawn, moved or written beside tracks and segments there is a person's word
like what is edited in the plan of one field.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import geopandas as gpd
import numpy as np
import shapely
from pyproj import CRS

from geofield import schema
from geofield.farm.as_written import hashed, own_names, text_of
from geofield.farm.dissolved import KEYS
from geofield.farm.layers import EPSG, FIELD_ID
from geofield.farm.value import Farm
from geofield.model.lost_numbers import known_by_shape
from geofield.plan import Plan

Tables = Mapping[schema.Layer, gpd.GeoDataFrame]
#: By layer, what columns of a person's own are called in the file, and in the farm.
Names = Mapping[str, Mapping[str, str]]

#: The layers that a person may edit, and what tells their rows apart.
EDITED = {of: KEYS[of] for of in (schema.TRACKS, schema.SEGMENTS)}


def track_digests(tables: Tables) -> dict[str, str]:
    """A digest per field of its tracks, segments and what a person wrote beside them.

    `tables` are the layers `EDITED` of many fields, as below.
    """
    parts: dict[str, list[bytes]] = {}
    for of, keys in EDITED.items():
        table = tables[of]
        shapes = shapely.to_wkb(shapely.force_2d(table.geometry.to_numpy()), byte_order=1)
        numbers = table[list(keys)].to_numpy("float64", na_value=np.nan)
        rows = [key.tobytes() + (shape or b"") for key, shape in zip(numbers, shapes, strict=True)]
        for name in sorted(own_names(of, table)):
            for at, text in enumerate(map(text_of, table[name])):
                rows[at] += f"{name}={text}".encode() if text else b""
        for one, row in zip(table[FIELD_ID].astype(str), rows, strict=True):
            parts.setdefault(one, []).append(row)
    return hashed(parts)


def layers_of(
    farm: Farm, layers: Iterable[schema.Layer], ids: Collection[str], crs: CRS, names: Names
) -> Tables:
    """Layers of some of a farm's fields, in the CRS and with the columns' names of the overview."""
    tables = {}
    for of in layers:
        table = farm.layer(of.name)
        there = {name: called for called, name in names.get(of.name, {}).items()}
        some = table[table[FIELD_ID].isin(list(ids))]
        tables[of] = some.to_crs(crs).rename(columns=there)
    return tables


def with_tracks(plan: Plan, tables: Tables, names: Names) -> Plan:
    """A plan with the tracks and segments of its field as they were edited."""
    if plan.tracks is None:
        return plan

    def mine(of: schema.Layer) -> gpd.GeoDataFrame:
        table = tables[of]
        rows = table[table[FIELD_ID] == plan.field.field_id].to_crs(plan.field.crs)
        # A column of the other fields alone says nothing here.
        empty = [name for name in own_names(of, rows) if rows[name].isna().all()]
        rows = rows.drop(columns=[FIELD_ID, EPSG, *empty], errors="ignore")
        return schema.conform(of, rows.rename(columns=names.get(of.name, {})), extras=True)

    lines, segments = (mine(of) for of in (schema.TRACKS, schema.SEGMENTS))
    written = plan.tracks.written
    if written is not None:
        lines = known_by_shape(schema.TRACKS, lines, written)
        segments = known_by_shape(schema.SEGMENTS, segments, written)
    return replace(plan, tracks=replace(plan.tracks, lines=lines, segments=segments))


def saying_nothing_new(farm: Farm, ids: Collection[str], tables: Tables, names: Names) -> set[str]:
    """Of fields whose digests differ those whose tracks are as they were.

    Digests tell more apart: the last digits of coordinates, numbers that another program lost.
    """
    found: set[str] = set()
    for plan in (farm[one] for one in ids if one in farm):
        if plan.tracks is None or plan.tracks.written is None:
            continue
        if with_tracks(plan, tables, names).track_edits == plan.track_edits:
            found.add(plan.field.field_id)
    return found


def layers_in(overview: Path) -> set[schema.Layer]:
    """The layers `EDITED` that an overview holds: those of very large farms have none."""
    import pyogrio

    found = {str(name) for name in pyogrio.list_layers(overview)[:, 0]}
    return {of for of in EDITED if of.name in found}
