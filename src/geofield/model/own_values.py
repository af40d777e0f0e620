"""Columns that a person added to a layer: what stands in them, row by row."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from datetime import date, datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from geofield import schema

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd


def own_values(layer: schema.Layer, table: gpd.GeoDataFrame) -> dict[int, dict[str, Any]]:
    """What a person wrote into columns of their own, plain JSON, by the position of the row.

    Empty cells are left out, and rows of nothing else.
    """
    import pandas as pd

    names = schema.own_columns(layer, table)
    found: dict[int, dict[str, Any]] = {}
    for row, values in enumerate(zip(*(table[name] for name in names), strict=True)):
        said = {
            name: _plain(value)
            for name, value in zip(names, values, strict=True)
            if not (pd.api.types.is_scalar(value) and pd.isna(value))
        }
        if said:
            found[row] = said
    return found


def with_own_values(
    layer: schema.Layer, table: gpd.GeoDataFrame, said: Sequence[Mapping[str, Any] | None]
) -> gpd.GeoDataFrame:
    """A table with such columns, of each row what is `said` in it by name; as it is without any."""
    names = dict.fromkeys(name for own in said if own for name in own)
    if not names:
        return table
    values = {name: _column([_value((own or {}).get(name)) for own in said]) for name in names}
    return schema.conform(layer, table.reset_index(drop=True).assign(**values), extras=True)


def empty_columns(layer: schema.Layer, table: gpd.GeoDataFrame) -> list[str]:
    """The columns of a person's own in which nothing stands."""
    return [name for name in schema.own_columns(layer, table) if table[name].isna().all()]


def _plain(value: Any) -> Any:
    """A value as plain JSON, from which :func:`_value` makes it again."""
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, bytes):
        return {"bytes": base64.b64encode(value).decode()}
    if isinstance(value, datetime):
        return {"time": value.isoformat()}
    if isinstance(value, date):
        return {"date": value.isoformat()}
    return value if isinstance(value, bool | int | float | str) else str(value)


def _value(plain: Any) -> Any:
    if not isinstance(plain, Mapping):
        return plain
    ((kind, text),) = plain.items()
    if kind == "bytes":
        return base64.b64decode(text)
    return date.fromisoformat(text) if kind == "date" else datetime.fromisoformat(text)


def _column(values: list[Any]) -> pd.Series[Any]:
    """Values of one type, and None, as a column of that type."""
    import pandas as pd
    import pyarrow as pa

    kinds = {type(value) for value in values if value is not None}
    if kinds == {int, float}:
        kinds = {float}
    types: dict[type, Any] = {
        bool: "boolean",
        int: "Int64",
        float: "float64",
        str: "string",
        date: pd.ArrowDtype(pa.date32()),
        bytes: pd.ArrowDtype(pa.binary()),
    }
    if len(kinds) == 1 and (kind := kinds.pop()) in types:
        typed: pd.Series[Any] = pd.Series(values, dtype=types[kind])
        return typed
    mixed: pd.Series[Any] = pd.Series(values, dtype=object)
    return mixed.infer_objects()
