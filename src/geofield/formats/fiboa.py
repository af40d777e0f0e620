"""fiboa 0.3.0, field boundaries for agriculture: the field as GeoJSON and GeoParquet."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import shapely

from geofield import schema
from geofield.crs import LONLAT, ground_areas_m2, ground_lengths_m
from geofield.formats.arrow import cut_lonlat, exact_geometry
from geofield.formats.geoparquet import GEOMETRY, write_geoparquet
from geofield.formats.origin import lineage
from geofield.model import Dataset

SCHEMAS = (
    "https://vecorel.org/specification/v0.1.0/schema.yaml",
    "https://vecorel.org/geometry-metrics-extension/v0.1.0/schema.yaml",
    "https://fiboa.org/specification/v0.3.0/schema.yaml",
)
COLLECTION = "geofield"
#: What people call a field, and what speaks against its outline.
_MORE = ("name", "certainty", "doubts")
#: How the outline came to be, in fiboa's words.
_DRAWN = {"drawn": "manual", "boundary": "unknown", "given": "unknown"}
#: Degrees: a centimetre, RFC 7946's advice and a half.
DECIMALS = 7


def write(
    datasets: Sequence[Dataset], folder: Path, *, stem: str, options: Mapping[str, Any]
) -> list[Path]:
    """Write ``fiboa/{stem}.geojson`` and ``fiboa/{stem}.parquet``: one collection of all fields."""
    rows: list[dict[str, Any]] = []
    placed: list[Any] = []
    for dataset in datasets:
        table = dataset.table(schema.FIELD.name)
        placed += list(cut_lonlat(exact_geometry(schema.FIELD, table), dataset.crs))
        rows += [
            _properties(row, shape, dataset)
            for row, shape in zip(table.to_dict("records"), table.geometry, strict=True)
        ]
    shapes = np.array(placed, dtype=object)
    out = folder / "fiboa"
    out.mkdir()
    geojson, parquet = out / f"{stem}.geojson", out / f"{stem}.parquet"
    _write_geojson(geojson, rows, shapes)
    _write_parquet(parquet, rows, shapes)
    return [geojson, parquet]


def _properties(row: Mapping[str, Any], shape: Any, dataset: Dataset) -> dict[str, Any]:
    method = str(row["method"]) if isinstance(row["method"], str) else "given"
    date = row["imagery_date"]
    properties: dict[str, Any] = {
        "id": str(row["field_id"]),
        "collection": COLLECTION,
        "category": ["operational"],
        "metrics:area": round(float(ground_areas_m2([shape], dataset.crs)[0]), 2),
        "metrics:perimeter": round(float(ground_lengths_m([shape], dataset.crs)[0]), 2),
        "determination:method": _DRAWN.get(method, "auto-imagery"),
        "determination:details": f"{method}; {lineage(dataset)}".strip("; "),
    }
    if not pd.isna(date):
        properties["determination:datetime"] = f"{str(date)[:10]}T00:00:00Z"
    # fiboa knows no such thing, and lets files have more than it knows.
    more = {name: _plain(row.get(name)) for name in _MORE}
    properties |= {name: value for name, value in more.items() if value is not None}
    # A user's column of the same name takes no word of fiboa's another meaning.
    known = {*properties, "determination:datetime", "geometry", "bbox", "schemas"}
    for name in schema.own_columns(schema.FIELD, dataset.table(schema.FIELD.name)):
        value = _plain(row[name])
        if value is not None:
            properties[f"own_{name}" if name in known else str(name)] = value
    return properties


def _plain(value: Any) -> Any:
    """A number, truth or text that JSON has; None for a missing value."""
    if pd.isna(value):
        return None
    plain = getattr(value, "item", lambda: value)()
    if isinstance(plain, float) and not math.isfinite(plain):
        return None
    return plain if isinstance(plain, bool | int | float | str) else str(value)


def _write_geojson(path: Path, rows: list[dict[str, Any]], shapes: Any) -> None:
    rounded = shapely.orient_polygons(shapely.transform(shapes, lambda c: np.round(c, DECIMALS)))
    features = [
        {
            "type": "Feature",
            "id": row["id"],
            "properties": {key: value for key, value in row.items() if key != "id"},
            "geometry": json.loads(shapely.to_geojson(shape)),
        }
        for row, shape in zip(rows, rounded, strict=True)
    ]
    collection = {
        "type": "FeatureCollection",
        "schemas": {COLLECTION: list(SCHEMAS)},
        "features": features,
    }
    text = json.dumps(collection, ensure_ascii=False, indent=1)
    path.write_text(f"{text}\n", encoding="utf-8", newline="\n")


def _write_parquet(path: Path, rows: list[dict[str, Any]], shapes: Any) -> None:
    fields = pa.schema(
        [
            pa.field("id", pa.string(), nullable=False),
            pa.field("collection", pa.string(), nullable=False),
            pa.field("category", pa.list_(pa.string())),
            pa.field("metrics:area", pa.float32()),
            pa.field("metrics:perimeter", pa.float32()),
            pa.field("determination:method", pa.string()),
            pa.field("determination:details", pa.string()),
            pa.field("determination:datetime", pa.timestamp("ms", tz="UTC")),
            pa.field(GEOMETRY, pa.binary(), nullable=False),
        ]
    )
    day = "determination:datetime"
    records = [
        {**row, GEOMETRY: wkb, day: datetime.fromisoformat(row[day]) if day in row else None}
        for row, wkb in zip(rows, shapely.to_wkb(shapes, flavor="iso"), strict=True)
    ]
    for name in dict.fromkeys(name for row in rows for name in row if name not in fields.names):
        having = [record for record in records if name in record]
        if len({type(record[name]) for record in having}) > 1:
            for record in having:
                record[name] = str(record[name])
        values = pa.array([record[name] for record in having])
        fields = fields.append(pa.field(name, values.type))
    table = pa.Table.from_pylist(records, schema=fields)
    collection = json.dumps({"schemas": {COLLECTION: list(SCHEMAS)}})
    # GeoParquet wants boxes as obligatory as the geometry, fiboa wants them optional.
    write_geoparquet(
        path,
        table.to_reader(),
        LONLAT,
        sorted({str(shape.geom_type) for shape in shapes}),
        {"collection": collection},
        covering=False,
    )
