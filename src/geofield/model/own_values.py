"""Columns that a person added to a layer: what stands in them, row by row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from geofield import schema

if TYPE_CHECKING:
    import geopandas as gpd


def own_values(layer: schema.Layer, table: gpd.GeoDataFrame) -> dict[int, dict[str, Any]]:
    """What a person wrote into columns of their own, plain JSON, by the position of the row.

    Empty cells are left out, and rows of nothing else.

    Parameters
    ----------
    layer : Layer
    table : GeoDataFrame
        With the columns of the layer and further ones.
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
    """A table with such columns; as it is where there are none.

    Parameters
    ----------
    layer : Layer
    table : GeoDataFrame
    said : sequence of mapping or None
        For each row what stands in its cells, by name.
    """
    import pandas as pd

    names = dict.fromkeys(name for own in said if own for name in own)
    if not names:
        return table
    columns = {
        name: pd.Series([(own or {}).get(name) for own in said], dtype=object) for name in names
    }
    values = {name: one.infer_objects().convert_dtypes() for name, one in columns.items()}
    return schema.conform(layer, table.reset_index(drop=True).assign(**values), extras=True)


def _plain(value: Any) -> Any:
    value = value.item() if isinstance(value, np.generic) else value
    return value if isinstance(value, bool | int | float | str) else str(value)
