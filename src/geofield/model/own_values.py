"""Columns that a person added to a layer: what stands in them, row by row."""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from datetime import date, datetime
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from geofield import schema
from geofield.wording import cell_text

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd

_DECIMAL_COMMA = r"^\s*([+-]?\d+),(\d+)\s*$"
#: Sizes that differ by less are the same, share; positions, degrees (ten metres).
_SAME_SHARE, _SAME_DEG = 1e-3, 1e-4


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


def told_beside(
    of: schema.Layer, table: gpd.GeoDataFrame, rows: gpd.GeoDataFrame, told: Mapping[str, str]
) -> dict[str, Any]:
    """Columns of another program's `rows` that the `table` made of them does not repeat, by name.

    `told` has the layer's column that was made of one, by its name; else that is the one of the
    same name. What says something else than the layer's column is kept under another name.
    """
    ours = {name.lower(): name for name in of.column_names}
    kept = []
    for name in rows.columns.difference([rows.geometry.name, "geometry", "fid"], sort=False):
        into = told.get(name, ours.get(name.lower()))
        if into is None or not _repeats(of.column(into), rows[name], table[into]):
            kept.append(name)
    names = schema.own_names(of, kept)
    return {new: rows[name].array for new, name in zip(names, kept, strict=True)}


def _repeats(column: schema.Column, said: pd.Series[Any], told: pd.Series[Any]) -> bool:
    """Whether a layer's column tells all that another program's says; 0 is no number there."""
    texts = said.astype("string").fillna("").str.strip()
    if column.type in ("int", "float"):
        numbers, ours = as_numbers(said), told.to_numpy("float64", na_value=np.nan)
        share, off = (0.0, _SAME_DEG) if column.unit == "deg" else (_SAME_SHARE, 0.0)
        # Of things that had one number, as the parts of a row, the first keeps it.
        whole = column.type == "int"
        same = np.isin(numbers, ours) if whole else np.isclose(numbers, ours, rtol=share, atol=off)
        return bool((same | (numbers == 0) | (texts == "").to_numpy(bool)).all())
    return all(
        not text or text.lower() == str(ours).lower() or cell_text(value) == ours
        for value, text, ours in zip(said, texts, told, strict=True)
    )


def as_numbers(values: pd.Series[Any]) -> NDArray[np.float64]:
    """Numbers as floats, texts with a decimal comma, too; NaN where there are none."""
    import pandas as pd

    if not pd.api.types.is_numeric_dtype(values):
        values = values.astype(str).str.replace(_DECIMAL_COMMA, r"\1.\2", regex=True)
    numeric = pd.to_numeric(values, errors="coerce")
    # A copy: what pandas hands out may be read-only.
    return np.array(numeric.to_numpy(dtype="float64", na_value=np.nan))


def first_of(values: pd.Series[Any]) -> Any:
    """The value in the first row; a missing one is of its column's type, and equal to itself."""
    import pandas as pd

    value = values.iloc[0]
    if not values.isna().iloc[0]:
        return value.tolist() if isinstance(value, np.ndarray) else value
    return math.nan if values.dtype.kind in "iuf" else pd.NaT if values.dtype.kind == "M" else None


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
