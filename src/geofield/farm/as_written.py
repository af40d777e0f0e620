"""Digests of what a person may change in a farm's overview, field by field."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from numbers import Real
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely

from geofield import schema
from geofield.crs import metre_in
from geofield.farm.layers import EPSG, FIELD_ID
from geofield.model.written import SAME_M, same_shapes
from geofield.plan import Plan

#: What a person may change, besides shapes.
_WORDS = {
    schema.FIELD: ("name",),
    schema.OBSTACLES: ("obstacle_no", "kind", "status", "radius_m", "buffer_m"),
}


def digests_of(fields: gpd.GeoDataFrame, obstacles: gpd.GeoDataFrame) -> dict[str, str]:
    """A digest per field of what a person may change of it."""
    parts: dict[str, list[bytes]] = {str(one): [] for one in fields[FIELD_ID]}
    for table, words in zip((fields, obstacles), _WORDS.values(), strict=True):
        flat = shapely.orient_polygons(shapely.force_2d(table.geometry.to_numpy()))
        shapes = shapely.to_wkb(flat, byte_order=1)
        for one, shape, row in zip(table[FIELD_ID], shapes, _told(table, words), strict=True):
            parts.setdefault(str(one), []).append(json.dumps(row).encode() + (shape or b""))
    return hashed(parts)


def _told(table: gpd.GeoDataFrame, words: Sequence[str]) -> Iterator[list[str]]:
    """What stands in some columns of each row, as text."""
    for row in zip(*(table[name].tolist() for name in words), strict=True):
        yield ["" if pd.isna(value) else str(value) for value in row]


def unlike(
    now: Mapping[schema.Layer, gpd.GeoDataFrame], then: Mapping[schema.Layer, gpd.GeoDataFrame]
) -> set[str]:
    """Fields of which rows in layers of one CRS say something else or have other shapes.

    Digests tell more apart: how an editor arranges rings, and the last digits of coordinates.
    """
    found: set[str] = set()
    for of, words in _WORDS.items():
        mine, theirs = _shapes(now[of], words), _shapes(then[of], words)
        found.update(one for one, _ in mine.keys() ^ theirs.keys())
        both = list(mine.keys() & theirs.keys())
        same = same_shapes(
            np.array([mine[key] for key in both], dtype=object),
            np.array([theirs[key] for key in both], dtype=object),
            SAME_M * metre_in(now[of].crs),
        )
        found.update(one for (one, _), is_same in zip(both, same, strict=True) if not is_same)
    return found


def _shapes(table: gpd.GeoDataFrame, words: Sequence[str]) -> dict[tuple[str, str], Any]:
    """The shapes of rows by their fields and what they say; alike ones are told apart."""
    shapes: dict[tuple[str, str], Any] = {}
    rows = zip(table[FIELD_ID], table.geometry, _told(table, words), strict=True)
    for at, (one, shape, row) in enumerate(rows):
        key = str(one), json.dumps(row)
        shapes[key if key not in shapes else (key[0], f"{key[1]} {at}")] = shape
    return shapes


def own_digests(tables: Mapping[schema.Layer, gpd.GeoDataFrame]) -> dict[str, str]:
    """A digest per field of what stands in columns of a person's own; none for fields without."""
    parts: dict[str, list[bytes]] = {}
    for of, table in tables.items():
        names = own_names(of, table)
        for one, *values in zip(table[FIELD_ID], *(table[each] for each in names), strict=True):
            told = {each: text_of(value) for each, value in zip(names, values, strict=True)}
            told = {each: text for each, text in told.items() if text}
            if told:
                row = of.name + json.dumps(told, sort_keys=True)
                parts.setdefault(str(one), []).append(row.encode())
    return hashed(parts)


def plan_digest(plan: Plan) -> str:
    """A digest of all that a person may have said of one plan."""
    tables = plan.to_dataset().tables
    standing = tables.get(schema.OBSTACLES.name)
    if standing is None:
        standing = schema.empty(schema.OBSTACLES, plan.field.crs)
    fields, obstacles = (
        table.assign(**{FIELD_ID: ""}) for table in (tables[schema.FIELD.name], standing)
    )
    own = own_digests({schema.FIELD: fields, schema.OBSTACLES: obstacles})
    settings = None if plan.settings is None else plan.settings.tracks.model_dump(mode="json")
    told = [digests_of(fields, obstacles), own, plan.track_edits.to_json(), settings]
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:16]


def hashed(parts: Mapping[str, list[bytes]]) -> dict[str, str]:
    """A digest per field of its parts, whatever their order."""
    return {
        one: hashlib.sha256(b"\0".join(sorted(rows))).hexdigest()[:16]
        for one, rows in parts.items()
    }


def with_rest(digests: Mapping[str, str], some: Collection[str]) -> dict[str, str]:
    """Digests of fields, and with those of `some` one of all: rows of them stand elsewhere."""
    every = hashed({"": [json.dumps(digests, sort_keys=True).encode()]})[""]
    return {**digests, **{one: f"{digests.get(one, '')}+{every}" for one in some}}


def own_names(of: schema.Layer, table: gpd.GeoDataFrame) -> list[str]:
    """The columns of a person's own in a layer of many fields."""
    return [each for each in schema.own_columns(of, table) if each not in (FIELD_ID, EPSG)]


def text_of(value: Any) -> str:
    """A value as text; 7 is the same where missing ones beside it made it 7.0."""
    if pd.api.types.is_scalar(value) and pd.isna(value):
        return ""
    return repr(float(value)) if isinstance(value, Real) else str(value)
