"""``failed.csv``: the places that have no plan, as a file of places again."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import shapely

from geofield.crs import LONLAT, reproject
from geofield.farm import folder
from geofield.farm.places import Places
from geofield.farm.store import Store

FAILED = "failed.csv"
_STATUS = ["field_id", "status", "error", "hint"]


def write_failed(store: Store, places: Places) -> list[str]:
    """Write the failed places with their columns, and why they failed; the name of the file.

    There is none where every place has a plan.
    """
    import pyarrow.csv

    bad = [
        table.filter(pc.is_in(table["status"], pa.array(["failed", "lost"])))
        for _, table in folder.read_parts(store, folder.STATUS, _STATUS)
    ]
    failed = pa.concat_tables(bad) if bad else None
    if failed is None or not failed.num_rows:
        store.remove(FAILED)
        return []
    position = {one: at for at, one in enumerate(places.ids.to_pylist())}
    rows = [(position[one], at) for at, one in enumerate(failed["field_id"].to_pylist())]
    # In the order of the file that they came from.
    at = np.array(sorted(rows), dtype=np.int64).reshape(-1, 2)
    columns: dict[str, Any] = {
        "field_id": places.ids.take(at[:, 0]),
        "name": places.names.take(at[:, 0]),
    }
    columns |= _positions(places, at[:, 0])
    for table in (places.settings, places.own):
        columns |= {name: _text(table[name].take(at[:, 0])) for name in table.column_names}
    why = failed.take(at[:, 1])
    columns |= {name: why[name] for name in ("status", "error", "hint")}
    sink = io.BytesIO()
    pyarrow.csv.write_csv(pa.table(columns), sink)
    store.put(FAILED, sink.getbuffer())
    return [FAILED]


def _positions(places: Places, at: Any) -> dict[str, Any]:
    """Where they are: latitude and longitude, or the parcels as text."""
    if places.outlines is None:
        lat, lon = (pa.array(values[at], from_pandas=True) for values in (places.lat, places.lon))
        return {"lat": lat, "lon": lon}
    shapes = shapely.from_wkb(places.outlines.take(at).to_numpy(zero_copy_only=False))
    shapes = reproject(shapes, places.crs, LONLAT)
    points = shapely.points(places.lon[at], places.lat[at])
    text = shapely.to_wkt(np.where(shapely.is_missing(shapes), points, shapes), -1)
    return {"geometry": pa.array(text, pa.string(), from_pandas=True)}


def _text(column: Any) -> Any:
    """What CSV has no type for, as text."""
    kind = column.type
    if pa.types.is_binary(kind):  # a photo, say
        told = [None if one is None else one.hex() for one in column.to_pylist()]
        return pa.array(told, pa.string())
    plain = pa.types.is_primitive(kind) or pa.types.is_string(kind)
    return column if plain else column.cast(pa.string())
