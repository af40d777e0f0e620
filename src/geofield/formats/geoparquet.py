"""GeoParquet 1.1: one file per layer in the metric CRS, with bounding boxes per row.

Written row group by row group, so that track points stream. The origin travels in the
file's key-value metadata.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import shapely
from numpy.typing import NDArray
from pyproj import CRS

from geofield.formats import origin
from geofield.formats.arrow import layer_batches
from geofield.formats.catalogue import PARQUET
from geofield.formats.foreign import RawLayer, files_in, read_foreign, read_parquet
from geofield.model import Dataset

GEOMETRY = "geometry"
_ORIGIN_KEY = "geofield"
#: Of the box of each row.
SIDES = ("xmin", "ymin", "xmax", "ymax")


def write(dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]) -> list[Path]:
    """Write ``geoparquet/<layer>.parquet`` for every layer."""
    written = []
    for layer in dataset.layers():
        path = folder / "geoparquet" / f"{layer.name}.parquet"
        path.parent.mkdir(exist_ok=True)
        batches = layer_batches(dataset, layer, geometry_name=GEOMETRY, reserved=("bbox",))
        record = {_ORIGIN_KEY: origin.to_json(dataset)}
        write_geoparquet(path, batches, dataset.crs, [layer.geometry], record)
        written.append(path)
    return written


def write_geoparquet(
    path: Path,
    batches: pa.RecordBatchReader,
    crs: CRS,
    geometry_types: Sequence[str],
    metadata: Mapping[str, str],
    *,
    covering: bool = True,
) -> None:
    """Write Arrow batches with a WKB column `geometry` as one GeoParquet 1.1 file.

    Parameters
    ----------
    batches : pa.RecordBatchReader
        Each becomes a row group.
    geometry_types : sequence of str
        All that there are.
    metadata : mapping
        Further key-value metadata.
    covering : bool
        Whether each row gets its bounding box, by which readers skip rows.
    """
    import pyarrow.parquet as pq

    columns, box = batches.schema, pa.struct([(side, pa.float64()) for side in SIDES])
    if covering:
        # As optional as the geometry it covers.
        columns = columns.append(pa.field("bbox", box, columns.field(GEOMETRY).nullable))
    totals = []
    # Readers look for metadata in the Arrow schema where there is one; what is added when the
    # last rows are in stands beside it, where only some of them look.
    with pq.ParquetWriter(path, columns, compression="zstd", store_schema=False) as writer:
        for batch in batches:
            shapes = shapely.from_wkb(batch[GEOMETRY].to_numpy(zero_copy_only=False))
            sides = [pa.array(side) for side in shapely.bounds(shapes).T]
            boxes = pa.StructArray.from_arrays(sides, SIDES)
            arrays = [*batch.columns, boxes] if covering else batch.columns
            writer.write_table(pa.Table.from_arrays(arrays, schema=columns))
            totals.append(shapely.total_bounds(shapes))
        bounds = np.array(totals).reshape(-1, 4)
        geo = described(crs, geometry_types, bounds, covering=covering)
        writer.add_key_value_metadata({"geo": geo, **metadata})


def described(
    crs: CRS, geometry_types: Sequence[str], bounds: NDArray[np.float64], *, covering: bool
) -> str:
    """What a file says of its column `geometry`: the value of its key ``geo``.

    `bounds` (n, 4) are those of its shapes, or of parts of them; `covering` says whether each row
    has its box in the column `bbox`.
    """
    column: dict[str, Any] = {
        "encoding": "WKB",
        "crs": crs.to_json_dict(),
        "geometry_types": geometry_types,
        "orientation": "counterclockwise",
    }
    if covering:
        column["covering"] = {"bbox": {side: ["bbox", side] for side in SIDES}}
    known = bounds[np.isfinite(bounds).all(axis=1)]
    if len(known):
        column["bbox"] = [*known[:, :2].min(axis=0), *known[:, 2:].max(axis=0)]
    geo = {"version": "1.1.0", "primary_column": GEOMETRY, "columns": {GEOMETRY: column}}
    return json.dumps(geo)


def read(path: Path) -> Dataset:
    """The dataset in a GeoParquet file, or in all of a folder."""
    import pyarrow.parquet as pq

    layers, record = [], None
    for file in files_in(path, *PARQUET):
        layers.append(RawLayer(file.stem, read_parquet(file)))
        text = (pq.read_metadata(file).metadata or {}).get(_ORIGIN_KEY.encode())
        if text is not None:
            record = origin.from_json(text.decode(errors="replace"))
    return origin.restored(read_foreign(layers, path), record)
