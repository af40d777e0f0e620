"""Tracks that a person edited in a farm's overview: told by digests, and put into their plans.

What is taken away, drawn, moved or written beside tracks and segments there is a person's word
like what is edited in the plan of one field.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from geofield import schema
from geofield.farm.as_written import own_names, text_of
from geofield.farm.layers import EPSG, FIELD_ID
from geofield.plan import Plan

if TYPE_CHECKING:
    import geopandas as gpd

Tables = Mapping[schema.Layer, "gpd.GeoDataFrame"]

#: The layers that a person may edit, and what tells their rows apart.
EDITED = {schema.TRACKS: ("track_no",), schema.SEGMENTS: ("track_no", "segment_no")}


def track_digests(tables: Tables) -> dict[str, str]:
    """A digest per field of its tracks, segments and what a person wrote beside them.

    Parameters
    ----------
    tables : mapping
        The layers `EDITED` of many fields.
    """
    found: dict[str, list[bytes]] = {}
    for of, keys in EDITED.items():
        table = tables[of]
        shapes = shapely.to_wkb(shapely.force_2d(table.geometry.to_numpy()), byte_order=1)
        numbers = table[list(keys)].to_numpy("float64", na_value=np.nan).tobytes()
        size = 8 * len(keys)
        rows = [
            numbers[size * at : size * (at + 1)] + (shape or b"") for at, shape in enumerate(shapes)
        ]
        for name in own_names(of, table):
            for at, text in enumerate(map(text_of, table[name])):
                rows[at] += f"{name}={text}".encode() if text else b""
        for one, row in zip(table[FIELD_ID].astype(str), rows, strict=True):
            found.setdefault(one, []).append(row)
    return {
        one: hashlib.sha256(b"\0".join(sorted(rows))).hexdigest()[:16]
        for one, rows in found.items()
    }


def with_tracks(plan: Plan, tables: Tables, names: Mapping[str, Mapping[str, str]]) -> Plan:
    """A plan with the tracks and segments of its field as they were edited.

    Parameters
    ----------
    plan : Plan
    tables : mapping
        The layers `EDITED` of many fields.
    names : mapping
        By layer, what columns of a person's own are called in the file, and in the farm.
    """
    if plan.tracks is None:
        return plan

    def mine(of: schema.Layer) -> gpd.GeoDataFrame:
        table = tables[of]
        own = table[table[FIELD_ID] == plan.field.field_id].to_crs(plan.field.crs)
        own = own.drop(columns=[name for name in (FIELD_ID, EPSG) if name in own])
        # A column of the other fields alone says nothing here.
        empty = [name for name in schema.own_columns(of, own) if own[name].isna().all()]
        own = own.drop(columns=empty).rename(columns=names.get(of.name, {}))
        return schema.conform(of, own, extras=True)

    lines, segments = (mine(of) for of in (schema.TRACKS, schema.SEGMENTS))
    return replace(plan, tracks=replace(plan.tracks, lines=lines, segments=segments))


def layers_in(overview: Path) -> bool:
    """Whether an overview holds tracks: those of very large farms do not."""
    import pyogrio

    found = {str(name) for name in pyogrio.list_layers(overview)[:, 0]}
    return {of.name for of in EDITED} <= found


def changed(now: Mapping[str, str], before: Mapping[str, str] | None) -> dict[str, str]:
    """The digests of fields whose tracks are others than before; none where nothing is known."""
    if before is None:
        return {}
    return {one: now.get(one, "") for one in {*now, *before} if now.get(one) != before.get(one)}
