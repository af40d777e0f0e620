"""What a run was asked for, as a record and a fingerprint: other work is another farm."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow as pa

from geofield import __version__
from geofield.farm.folder import Record
from geofield.farm.places import Places
from geofield.farm.work import Job


def record_of(places: Places, job: Job, imagery: Mapping[str, Any], chunk_fields: int) -> Record:
    """The record of a run, with the fingerprint of all that decides its result."""
    record = Record(
        settings=job.settings.model_dump(mode="json", exclude={"fetch", "export"}),
        places={
            "file": Path(places.path).name,
            "count": len(places),
            "digest": places_digest(places),
        },
        imagery={**imagery, **_obstacles(job)},
        chunk_fields=chunk_fields,
        chunks=-(-len(places) // chunk_fields),
    )
    return replace(record, digest=_digest(record))


def _obstacles(job: Job) -> dict[str, Any]:
    standing = job.standing
    if job.obstacles is None or standing is None:
        return {}
    # Of its rows: QGIS toggled to editing changes bytes, and an edit may lie in a log beside it.
    rows = f"{standing.crs.srs}{standing.to_wkb(hex=True).to_csv()}".encode()
    digest = hashlib.sha256(rows).hexdigest()
    return {"obstacles": job.obstacles.name, "obstacles_digest": digest}


def _digest(record: Record) -> str:
    places = record.places["digest"]
    content = [__version__, record.settings, places, record.imagery, record.chunk_fields]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def difference(there: Record, wanted: Record) -> str:
    """What differs, in words."""
    words = []
    for section, values in wanted.settings.items():
        before = there.settings.get(section, {})
        for name in {*values, *before}:
            if values.get(name) != before.get(name):
                words.append(f"{name} was {before.get(name)} and is {values.get(name)}")
    if there.places.get("digest") != wanted.places["digest"]:
        words.append("the places differ")
    if there.imagery != wanted.imagery:
        words.append("the pictures or obstacles differ")
    return ", ".join(sorted(words)[:4]) or "it was made with another version of geofield"


def places_digest(places: Places) -> str:
    """A fingerprint of places: where they are, what they are called and all their columns."""
    columns: dict[str, Any] = {"id": places.ids, "name": places.names}
    columns |= {"lat": pa.array(places.lat), "lon": pa.array(places.lon)}
    if places.outlines is not None:
        columns["outline"] = places.outlines
    for table, mark in ((places.own, "own"), (places.settings, "set")):
        columns |= {f"{mark} {name}": table[name] for name in table.column_names}
    digest = hashlib.sha256(str(places.crs.srs).encode())
    whole = pa.table(columns)
    with pa.ipc.new_stream(_Hashing(digest), whole.schema) as stream:
        # Batches of one size: how a file was read in pieces must not count.
        for batch in whole.combine_chunks().to_batches(max_chunksize=10_000):
            stream.write_batch(batch)
    return digest.hexdigest()


class _Hashing:
    """A file that only hashes what is written."""

    closed = False

    def __init__(self, digest: Any) -> None:
        self._digest = digest

    def write(self, data: Any) -> int:
        self._digest.update(data)
        return len(data)

    def flush(self) -> None: ...

    def close(self) -> None: ...
