"""CSV: track points and obstacles as tables, as the study prints them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from geofield import schema
from geofield.formats.arrow import arrow_type, arrow_values
from geofield.model import Dataset

if TYPE_CHECKING:
    import geopandas as gpd

    from geofield.schema import Layer

#: Decimals by unit: a tenth of a millimetre in degrees, a thousandth of a pixel or metre.
DECIMALS = {"deg": 9, "px": 3, "m": 3, "1": 4}


#: A spreadsheet takes a cell that begins so for a formula, and may run a program by it (OWASP).
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")


def harmless(text: str) -> str:
    """A text that no spreadsheet computes: with an apostrophe before what would be a formula."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def write(dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]) -> list[Path]:
    """Write ``csv/track_points.csv`` and ``csv/obstacles.csv``: UTF-8, comma, decimal point."""
    points = folder / "csv" / "track_points.csv"
    obstacles = folder / "csv" / "obstacles.csv"
    points.parent.mkdir()
    _write(schema.TRACK_POINTS, dataset.point_chunks(), points)
    _write(schema.OBSTACLES, iter([dataset.table(schema.OBSTACLES.name)]), obstacles)
    return [points, obstacles]


def _write(layer: Layer, chunks: Iterator[gpd.GeoDataFrame], path: Path) -> None:
    from pyarrow.csv import CSVWriter

    fields = pa.schema([(column.name, arrow_type(column)) for column in layer.columns])
    with CSVWriter(path, fields) as writer:
        for chunk in chunks:
            writer.write_table(_rounded(layer, chunk, fields))


def _rounded(layer: Layer, chunk: gpd.GeoDataFrame, fields: pa.Schema) -> pa.Table:
    arrays = []
    for column in layer.columns:
        series = chunk[column.name]
        if column.type == "float":
            series = series.astype("float64")
            series = np.round(series, DECIMALS[column.unit])
        elif column.type == "str":
            series = series.map(harmless, na_action="ignore")
        arrays.append(arrow_values(column, series))
    return pa.table(arrays, schema=fields)
