"""The farm as a STAC catalogue: a collection, and an item per chunk with its files.

Terms of the imagery stand in the collection and in each item, so that whoever finds a file
finds what it may be used for. SpatioTemporal Asset Catalog 1.0.0.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow.compute as pc
import shapely

from geofield import __version__, schema
from geofield.farm.folder import RECORD, STATUS, committed, file_of, read_part
from geofield.farm.layers import GEOMETRY, LAYERS, PLAN
from geofield.farm.store import Store
from geofield.formats.antimeridian import extent, extent_box
from geofield.wording import counted

COLLECTION = "collection.json"
ITEMS = "stac"
_VERSION = "1.0.0"
_PARQUET = "application/vnd.apache.parquet"
_OF_A_CHUNK = re.compile(r"chunk-\d+\.json")
_SPDX = re.compile(r"[A-Za-z0-9.+-]+")
#: Of an item whose imagery nobody has dated; STAC wants some interval.
_UNKNOWN = {"start_datetime": "1900-01-01T00:00:00Z", "end_datetime": "9999-12-31T23:59:59Z"}


def write_stac(store: Store, *, name: str = "farm") -> list[str]:
    """Write ``collection.json`` and ``stac/chunk-0007.json``; the names of the files.

    `name` is the id of the collection. Items of chunks that are gone are removed.
    """
    written: dict[str, dict[str, Any]] = {}
    present = {layer: set(store.names(layer)) for layer, _ in _layers()}
    for chunk in committed(store):
        item = _item(store, chunk, name, present)
        if item is not None:
            file = f"{ITEMS}/chunk-{chunk:04d}.json"
            store.put(file, _json(item))
            written[file] = item
    for each in store.names(ITEMS):
        if _OF_A_CHUNK.fullmatch(each) and f"{ITEMS}/{each}" not in written:
            store.remove(f"{ITEMS}/{each}")
    if not written:
        store.remove(COLLECTION)
        return []
    store.put(COLLECTION, _json(_collection(written, name)))
    return [COLLECTION, *written]


def _item(
    store: Store, chunk: int, collection: str, present: Mapping[str, Collection[str]]
) -> dict[str, Any] | None:
    fields = read_part(store, schema.FIELD.name, chunk)
    if fields is None or not fields.num_rows:
        return None
    shapes = shapely.from_wkb(fields[GEOMETRY].to_numpy(zero_copy_only=False))
    west, south, east, north = (round(each, 7) for each in extent(shapes))
    days = sorted({str(day)[:10] for day in fields["imagery_date"].to_pylist() if day})
    properties: dict[str, Any] = {"datetime": None, **_UNKNOWN}
    if days:
        properties |= {
            "start_datetime": f"{days[0]}T00:00:00Z",
            "end_datetime": f"{days[-1]}T23:59:59Z",
        }
    status = read_part(store, STATUS, chunk)
    counts = [] if status is None else pc.value_counts(status["status"]).to_pylist()
    return {
        "type": "Feature",
        "stac_version": _VERSION,
        "id": f"{collection}-chunk-{chunk:04d}",
        "collection": collection,
        "geometry": json.loads(shapely.to_geojson(extent_box(west, south, east, north))),
        "bbox": [west, south, east, north],
        "properties": {
            **properties,
            "title": f"Fields of chunk {chunk}",
            "geofield:fields": fields.num_rows,
            "geofield:status": {row["values"]: row["counts"] for row in counts},
            "geofield:imagery": _terms(store, chunk),
        },
        "links": [_link(rel, f"../{COLLECTION}") for rel in ("root", "parent", "collection")],
        "assets": {
            name: {
                "href": f"../{file_of(name, chunk)}",
                "type": _PARQUET,
                "title": title,
                "roles": ["data"],
            }
            for name, title in _layers()
            if f"chunk={chunk:04d}" in present[name]
        },
    }


def _layers() -> list[tuple[str, str]]:
    own = [(each.name, each.title) for each in LAYERS]
    return [*own, (PLAN, "Settings and evidence"), (STATUS, "What became of each place")]


def _terms(store: Store, chunk: int) -> list[dict[str, Any]]:
    """The pictures behind the fields of a chunk: name, day, attribution and licence, each once."""
    plans = read_part(store, PLAN, chunk, ["source"])
    found: list[dict[str, Any]] = []
    for text in [] if plans is None else pc.unique(plans["source"]).to_pylist():
        source = json.loads(text or "{}")
        names = ("name", "date", "attribution", "licence")
        said = {name: source[name] for name in names if source.get(name)}
        if said and said not in found:
            found.append(said)
    return found


def _collection(by_file: Mapping[str, dict[str, Any]], name: str) -> dict[str, Any]:
    items = by_file.values()
    west, south, east, north = extent(np.array([extent_box(*item["bbox"]) for item in items]))
    known = (item["properties"] for item in items)
    dated = [one for one in known if one["start_datetime"] != _UNKNOWN["start_datetime"]]
    begin = min((each["start_datetime"] for each in dated), default=None)
    end = max((each["end_datetime"] for each in dated), default=None)
    terms = [term for item in items for term in item["properties"]["geofield:imagery"]]
    licences = sorted({term["licence"] for term in terms if term.get("licence")})
    attributions = sorted({term["attribution"] for term in terms if term.get("attribution")})
    count = sum(item["properties"]["geofield:fields"] for item in items)
    return {
        "type": "Collection",
        "stac_version": _VERSION,
        "id": name,
        "title": name,
        "description": f"{counted(count, 'field')} with outlines, obstacles and tracks, "
        f"planned by geofield {__version__}. "
        + (f"Imagery: {'; '.join(attributions)}." if attributions else ""),
        # What is derived follows the terms of the pictures it is derived from.
        "license": _licence(licences),
        "geofield:imagery_licences": licences,
        "extent": {
            "spatial": {"bbox": [[west, south, east, north]]},
            "temporal": {"interval": [[begin, end]]},
        },
        "links": [
            _link("root", f"./{COLLECTION}"),
            *(_link("item", f"./{file}", "application/geo+json") for file in by_file),
        ],
        "assets": {
            "record": {
                "href": f"./{RECORD}",
                "type": "application/json",
                "title": "Settings, places and imagery of the farm",
                "roles": ["metadata"],
            }
        },
    }


def _link(rel: str, href: str, kind: str = "application/json") -> dict[str, str]:
    return {"rel": rel, "href": href, "type": kind}


def _licence(licences: Sequence[str]) -> str:
    """An SPDX name where there is one licence that looks like it; else STAC's word for others."""
    if not licences:
        return "proprietary"
    name = licences[0].replace(" ", "-")
    return name if len(licences) == 1 and _SPDX.fullmatch(name) else "various"


def _json(content: Any) -> bytes:
    return (json.dumps(content, ensure_ascii=False, indent=1) + "\n").encode()
