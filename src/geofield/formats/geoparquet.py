"""GeoParquet 1.1: one file per layer in the metric CRS, with bounding boxes per row.

Written row group by row group, so that track points stream. The origin travels in the
file's key-value metadata.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from pyproj import CRS
from pyproj.exceptions import ProjError

from geofield import schema
from geofield.crs import parse_crs
from geofield.errors import FormatError
from geofield.formats import origin
from geofield.formats.arrow import arrow_table
from geofield.formats.foreign import RawLayer, read_foreign
from geofield.model import Dataset

if TYPE_CHECKING:
    import pyarrow as pa

GEOMETRY = "geometry"
_ORIGIN_KEY = "geofield"
_SIDES = ("xmin", "ymin", "xmax", "ymax")


def write(dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]) -> list[Path]:
    """Write ``geoparquet/<layer>.parquet`` for every layer."""
    written = []
    for layer in dataset.layers():
        path = folder / "geoparquet" / f"{layer.name}.parquet"
        path.parent.mkdir(exist_ok=True)
        chunks = (
            dataset.point_chunks()
            if layer.name == schema.TRACK_POINTS.name
            else iter([dataset.table(layer.name)])
        )
        tables = (arrow_table(layer, chunk, geometry_name=GEOMETRY) for chunk in chunks)
        empty = arrow_table(layer, schema.empty(layer, dataset.crs), geometry_name=GEOMETRY)
        write_geoparquet(
            path,
            tables,
            empty.schema,
            dataset.crs,
            [layer.geometry],
            {_ORIGIN_KEY: origin.to_json(dataset)},
        )
        written.append(path)
    return written


def write_geoparquet(
    path: Path,
    tables: Iterable[pa.Table],
    fallback: pa.Schema,
    crs: CRS,
    geometry_types: list[str],
    metadata: Mapping[str, str],
    *,
    covering: bool = True,
) -> None:
    """Write Arrow tables with a WKB column `geometry` as one GeoParquet 1.1 file.

    Parameters
    ----------
    path : Path
    tables : iterable of pa.Table
        Of the same columns.
    fallback : pa.Schema
        The columns, should there be no table.
    crs : CRS
    geometry_types : list of str
        All that there are.
    metadata : mapping
        Further key-value metadata.
    covering : bool
        Whether each row gets its bounding box, by which readers skip rows.
    """
    import pyarrow.parquet as pq

    writer: pq.ParquetWriter | None = None
    boxes: list[Any] = []
    stream = iter(tables)
    table = next(stream, fallback.empty_table())
    while table is not None:
        table, box = _with_boxes(table, covering=covering)
        boxes.append(box)
        if writer is None:
            # Readers look for metadata in the Arrow schema where there is one; what is added
            # when the last rows are in stands beside it, where only some of them look.
            writer = pq.ParquetWriter(path, table.schema, compression="zstd", store_schema=False)
        writer.write_table(table)
        table = next(stream, None)
    column: dict[str, Any] = {
        "encoding": "WKB",
        "crs": crs.to_json_dict(),
        "geometry_types": geometry_types,
        "orientation": "counterclockwise",
    }
    if covering:
        column["covering"] = {"bbox": {side: ["bbox", side] for side in _SIDES}}
    known = np.array([box for box in boxes if box is not None])
    if len(known):
        column["bbox"] = [
            *(float(v) for v in known[:, :2].min(axis=0)),
            *(float(v) for v in known[:, 2:].max(axis=0)),
        ]
    geo = {"version": "1.1.0", "primary_column": GEOMETRY, "columns": {GEOMETRY: column}}
    if writer is None:
        raise FormatError(f"{path.name}: there was no table to write.")
    with writer:
        writer.add_key_value_metadata({"geo": json.dumps(geo), **metadata})


def _with_boxes(table: pa.Table, *, covering: bool) -> tuple[pa.Table, Any]:
    """The table with a column of boxes, where wanted, and the box of all rows."""
    import pyarrow as pa

    shapes = shapely.from_wkb(table[GEOMETRY].to_numpy())
    total = shapely.total_bounds(shapes) if len(shapes) else None
    if not covering:
        return table, total
    bounds = shapely.bounds(shapes).reshape(-1, 4)
    box = pa.StructArray.from_arrays(
        [pa.array(bounds[:, side]) for side in range(4)], names=list(_SIDES)
    )
    # As optional as the geometry it covers.
    field = pa.field("bbox", box.type, nullable=table.schema.field(GEOMETRY).nullable)
    return table.append_column(field, box), total


def read(path: Path) -> Dataset:
    """The dataset in a GeoParquet file, or in all of a folder."""
    import geopandas as gpd
    import pyarrow as pa
    import pyarrow.parquet as pq

    files = sorted(path.glob("*.parquet")) if path.is_dir() else [path]
    layers, record = [], None
    for file in files:
        try:
            text = (pq.read_metadata(file).metadata or {}).get(_ORIGIN_KEY.encode())
            frame = gpd.read_parquet(file)
            if frame.crs is not None:  # only now is it looked at
                parse_crs(frame.crs)
            if text is not None:
                record = origin.from_json(text.decode())
        except (pa.ArrowInvalid, ValueError, OSError, ProjError) as error:
            reason = f"{error}"[:200]
            raise FormatError(f"{file} cannot be read: {reason}.", hint="Is it whole?") from error
        layers.append(RawLayer(file.stem, frame.drop(columns="bbox", errors="ignore")))
    return origin.restored(read_foreign(layers, path), record)
