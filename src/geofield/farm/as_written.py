"""Digests of what a person may change in a farm's overview, field by field."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Mapping
from numbers import Real
from typing import Any

import geopandas as gpd
import pandas as pd
import shapely

from geofield import schema
from geofield.farm.layers import EPSG, FIELD_ID
from geofield.plan import Plan

#: What a person may change, besides shapes.
_FIELD_WORDS = ("name",)
_OBSTACLE_WORDS = ("obstacle_no", "kind", "status", "radius_m", "buffer_m")


def digests_of(fields: gpd.GeoDataFrame, obstacles: gpd.GeoDataFrame) -> dict[str, str]:
    """A digest per field of what a person may change of it."""
    parts: dict[str, list[bytes]] = {str(one): [] for one in fields[FIELD_ID]}
    for table, words in ((fields, _FIELD_WORDS), (obstacles, _OBSTACLE_WORDS)):
        flat = shapely.orient_polygons(shapely.force_2d(table.geometry.to_numpy()))
        shapes = shapely.to_wkb(flat, byte_order=1)
        told = zip(*(table[name].tolist() for name in words), strict=True)
        for one, shape, row in zip(table[FIELD_ID], shapes, told, strict=True):
            plain = ["" if pd.isna(value) else str(value) for value in row]
            parts.setdefault(str(one), []).append(json.dumps(plain).encode() + (shape or b""))
    return hashed(parts)


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
