"""Tables in the shape of a layer."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from geofield.errors import FormatError, FormatWarning
from geofield.notes import warn
from geofield.schema.columns import ColumnType, Layer
from geofield.schema.layers import FIELD
from geofield.wording import unlike

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd
    from pyproj import CRS

#: Columns of files with several fields, and of their shapes; small letters.
_OURS = ("field_id", "fid", "geometry", "geometry_utm", "utm_epsg", "bbox", "chunk")


def empty(of: Layer, crs: CRS) -> gpd.GeoDataFrame:
    """A table of a layer with all its columns and no rows."""
    return table(of, {}, [], crs)


def table(
    of: Layer, data: dict[str, Any], geometry: Any, crs: CRS, own: Mapping[str, Any] | None = None
) -> gpd.GeoDataFrame:
    """A table of a layer from columns and geometries, with exact types and order.

    Columns that are missing in `data` are filled with missing values; `own` are the user's.
    """
    import geopandas as gpd
    import numpy as np
    import pandas as pd
    from geopandas.array import from_shapely

    count = len(geometry)
    # Plain arrays: a table made of series costs five times as much.
    columns: dict[str, Any] = {}
    for column in of.columns:
        values = data.get(column.name)
        if values is None:
            values = [np.nan if column.type == "float" else None] * count
        if column.type == "float":
            columns[column.name] = np.array(values, dtype="float64")
        elif column.type != "int":
            columns[column.name] = np.empty(count, dtype=object)
            columns[column.name][:] = list(values)
        elif isinstance(values, np.ndarray) and values.dtype.kind == "i":
            whole = values.astype("int64")
            columns[column.name] = pd.arrays.IntegerArray(whole, np.zeros(count, dtype=bool))
        else:
            columns[column.name] = pd.array(list(values), dtype="Int64")
    columns["geometry"] = from_shapely(geometry, crs=crs)
    # By way of a plain table: geopandas takes twice as long to make one of columns.
    return gpd.GeoDataFrame(
        pd.DataFrame(columns | dict(own or {}), copy=False), geometry="geometry"
    )


def own_columns(of: Layer, frame: gpd.GeoDataFrame) -> list[str]:
    """The columns that the user added to a layer."""
    known = {*of.column_names, frame.geometry.name, "geometry", "fid"}
    return [name for name in frame.columns if name not in known]


def own_names(of: Layer, names: Iterable[str]) -> list[str]:
    """Names for a user's columns that are none of a layer's, each once: `own_kind`, `place_doubts`.

    Nor are they any that files of several fields have beside the layer's.
    """
    before = "place_" if of is FIELD else "own_"
    ours = {*of.column_names, *_OURS}
    names = list(names)
    taken = {name for name in names if name.lower() not in ours}
    return [
        name if name in taken else unlike(f"{before}{name}", taken, "_", key=str) for name in names
    ]


def of_others(names: Iterable[str]) -> list[str]:
    """The columns of outlines that geofield does not write itself; all in another program's.

    Id and name are a person's word in either.
    """
    names, ours = list(names), set(FIELD.column_names)
    shared = ours & set(names)
    if FIELD.key[0] not in shared or 2 * len(shared) < len(ours):
        return names
    gone = (ours - {*FIELD.key, "name"}) | {"utm_epsg"}
    return [name for name in names if name not in gone]


def own_type(values: pd.Series[Any]) -> ColumnType:
    """What the values of a user's column are: whole numbers, numbers, or else text."""
    kinds: dict[str, ColumnType] = {"i": "int", "u": "int", "f": "float"}
    return kinds.get(values.dtype.kind, "str")


def conform(of: Layer, frame: gpd.GeoDataFrame, *, extras: bool = False) -> gpd.GeoDataFrame:
    """Any table in the shape of a layer: its columns, order and types, sorted by its key.

    Rows without a key come last. Further columns are left out, or kept behind the layer's
    own where `extras` is true.
    """
    import numpy as np
    import pandas as pd

    data: dict[str, Any] = {}
    for column in of.columns:
        if column.name not in frame.columns:
            continue
        series = frame[column.name]
        if column.type in ("int", "float"):
            try:
                series = pd.to_numeric(series)
            except (ValueError, TypeError) as error:
                known = series.isna() | pd.to_numeric(series, errors="coerce").notna()
                row = int((~known).to_numpy().argmax())
                raise FormatError(
                    f"Layer {of.name!r}: column {column.name!r}, row {row + 1}: "
                    f"{str(series.iloc[row])!r} is no number.",
                    hint="Correct the column, or leave the cell empty.",
                ) from error
        if column.type == "int":
            if series.dtype.kind == "i" and not series.isna().any():
                data[column.name] = series.to_numpy(dtype="int64")
            else:
                data[column.name] = _whole_numbers(of, column.name, series)
        elif column.type == "float":
            data[column.name] = series.to_numpy(dtype="float64", na_value=np.nan)
        elif column.type == "date":
            data[column.name] = [None if pd.isna(v) else str(v)[:10] for v in series]
        else:
            data[column.name] = [None if pd.isna(v) else str(v) for v in series]
    result = table(of, data, frame.geometry.to_numpy(), frame.crs)
    for name in own_columns(of, frame) if extras else ():
        result[name] = frame[name].array
    result = result.sort_values(list(of.key), kind="stable", na_position="last")
    return result.reset_index(drop=True)


def _whole_numbers(of: Layer, name: str, numbers: pd.Series[Any]) -> pd.Series[Any]:
    """A column without numbers that are not whole, as means are, which is told."""
    import numpy as np

    plain = numbers.to_numpy(dtype="float64", na_value=np.nan)
    with np.errstate(invalid="ignore"):
        strange = ~np.isnan(plain) & ~(np.abs(plain - np.round(plain)) < 1e-6)
    if strange.any():
        what = f"{name} {plain[strange][0]:g}"
        warn(f"Layer {of.name!r}: {what} is no whole number and counts as none.", FormatWarning)
    return numbers.mask(strange).round().astype("Int64")
