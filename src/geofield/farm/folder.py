"""A farm's folder: ``<layer>/chunk=0007/part-0.parquet``, and which chunks count.

    FARM/farm.json                         what was asked, and how the places are cut into chunks
    FARM/<layer>/chunk=0007/part-0.parquet GeoParquet 1.1: boxes of the rows, zstd
    FARM/plan/chunk=0007/part-0.parquet    what is no layer: settings, source, evidence
    FARM/status/chunk=0007/part-0.parquet  one row per place; written last, it makes the chunk count
    FARM/reviewed/ID.gpkg                  plans that a person put back

The same places and settings give the same bytes in every layer but `status`, which tells
seconds and workers.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyarrow as pa
import shapely
from numpy.typing import NDArray

from geofield import __version__, schema
from geofield.crs import LONLAT
from geofield.errors import FormatError
from geofield.farm.layers import EXACT, GEOMETRY, KEPT, Tables
from geofield.farm.store import Store
from geofield.formats.geoparquet import SIDES, described

VERSION = 1
RECORD = "farm.json"
STATUS = "status"
REVIEWED = "reviewed"
#: All fields for QGIS, made from the whole farm.
OVERVIEW, PROJECT = "farm.gpkg", "farm.qgz"
#: What may become of a place.
STATUSES = ("done", "doubtful", "failed", "lost")
_CHUNK = re.compile(r"chunk=(\d+)")


@dataclass(frozen=True, slots=True)
class Record:
    """What `farm.json` says."""

    #: Of all that decides the result: settings, places, imagery, software.
    digest: str = ""
    #: Plain JSON values.
    settings: Mapping[str, Any] = field(default_factory=dict)
    #: File, number and digest of the places.
    places: Mapping[str, Any] = field(default_factory=dict)
    #: What the pictures are, with their terms; empty without imagery.
    imagery: Mapping[str, Any] = field(default_factory=dict)
    #: Places per chunk.
    chunk_fields: int = 250
    chunks: int = 0

    def to_json(self) -> bytes:
        """As the file's bytes."""
        content = {
            "version": VERSION,
            "software": f"geofield {__version__}",
            "digest": self.digest,
            "chunks": self.chunks,
            "chunk_fields": self.chunk_fields,
            "places": self.places,
            "imagery": self.imagery,
            "settings": self.settings,
        }
        return (json.dumps(content, ensure_ascii=False, indent=2) + "\n").encode()

    @classmethod
    def read(cls, store: Store) -> Record | None:
        """The record of a farm; None where there is no farm."""
        data = store.get(RECORD)
        if data is None:
            return None
        try:
            content = json.loads(data)
            if content["version"] > VERSION:
                raise FormatError(
                    f"{store.shown} was written by a later version of geofield.",
                    hint="Update geofield.",
                )
            said: list[Any] = [dict(content[name]) for name in ("settings", "places", "imagery")]
            said += [int(content[name]) for name in ("chunk_fields", "chunks")]
            return cls(str(content["digest"]), *said)
        except (KeyError, TypeError, ValueError) as error:
            raise FormatError(
                f"{store.shown}/{RECORD} is damaged: {error!r}.",
                hint="Bring it back from a copy, or choose another --out.",
            ) from None


def file_of(layer: str, chunk: int) -> str:
    """The file of a layer's chunk."""
    return f"{layer}/chunk={chunk:04d}/part-0.parquet"


def committed(store: Store) -> list[int]:
    """The chunks that count, in order: those with a status."""
    found = (_CHUNK.fullmatch(name) for name in store.names(STATUS))
    numbers = [int(match[1]) for match in found if match]
    if store.folder is None:
        return sorted(numbers)
    # A folder may be there before its file.
    return sorted(n for n in numbers if (store.folder / file_of(STATUS, n)).is_file())


def write_chunk(store: Store, chunk: int, tables: Tables, status: pa.Table) -> None:
    """Write the layers of a chunk, and last its status, which makes it count."""
    for layer in KEPT:
        if layer in tables:
            store.put(file_of(layer, chunk), parquet_bytes(layer, tables[layer]))
    store.put(file_of(STATUS, chunk), parquet_bytes(STATUS, status))


def sweep_chunk(store: Store, chunk: int) -> None:
    """Remove what a worker that was killed had begun to write of a chunk."""
    for layer in (*KEPT, STATUS):
        store.sweep(file_of(layer, chunk).rpartition("/")[0])


def parquet_bytes(layer: str, table: pa.Table) -> memoryview:
    """A table as a Parquet file; GeoParquet 1.1 with boxes where it has shapes."""
    import pyarrow.parquet as pq

    if GEOMETRY in table.column_names:
        geometry = table[GEOMETRY].combine_chunks()
        shapes = shapely.from_wkb(geometry.to_numpy(zero_copy_only=False))
        bounds = shapely.bounds(shapes).reshape(-1, 4)
        # Single precision, rounded outwards: half the bytes, and no row is missed.
        outward = np.array([-np.inf, -np.inf, np.inf, np.inf], dtype=np.float32)
        boxes = bounds.astype(np.float32)
        inside = np.where(outward < 0, boxes > bounds, boxes < bounds)
        boxes = np.where(inside, np.nextafter(boxes, outward), boxes)
        box = pa.StructArray.from_arrays(
            [pa.array(boxes[:, side], from_pandas=True) for side in range(4)], names=list(SIDES)
        )
        table = table.append_column("bbox", box)
        kind = "Point" if layer == STATUS else schema.layer(layer).geometry
        # At the 180th meridian shapes are cut into parts.
        kinds = [kind] if kind.startswith("Multi") or kind == "Point" else [kind, f"Multi{kind}"]
        geo = described(LONLAT, kinds, bounds, covering=True)
        table = table.replace_schema_metadata({"geo": geo})
    sink = io.BytesIO()
    # Exact shapes are all different: looking for repetition in them is time for nothing.
    plain = [EXACT, GEOMETRY, *(f"bbox.{side}" for side in SIDES)]
    names = [name for name in table.column_names if name not in {*plain, "bbox"}]
    pq.write_table(table, sink, compression="zstd", use_dictionary=names)
    return sink.getbuffer()


def read_part(
    store: Store, layer: str, chunk: int, columns: Sequence[str] | None = None
) -> pa.Table | None:
    """A layer of one chunk, without its boxes; None where the chunk has no such layer."""
    import pyarrow.parquet as pq

    data = store.get(file_of(layer, chunk))
    if data is None:
        return None
    try:
        # By this thread alone: one of Arrow's that lets go of the bytes while Python ends makes C++
        # abort the process.
        file = pq.ParquetFile(pa.BufferReader(data))
        table = file.read(columns, use_threads=False)
    except (pa.ArrowInvalid, OSError) as error:
        raise FormatError(
            f"{store.shown}/{file_of(layer, chunk)} is damaged: {error}.",
            hint="Remove that chunk's file in status/, and run geofield batch again.",
        ) from None
    return table.drop_columns("bbox") if "bbox" in table.column_names else table


def read_parts(
    store: Store,
    layer: str,
    columns: Sequence[str] | None = None,
    chunks: Iterable[int] | None = None,
) -> Iterator[tuple[int, pa.Table]]:
    """A layer of all chunks that count, or of some, with their numbers; of those that have it."""
    for chunk in committed(store) if chunks is None else chunks:
        table = read_part(store, layer, chunk, columns)
        if table is not None:
            yield chunk, table


def outlines_in(store: Store) -> Iterator[NDArray[np.object_]]:
    """The outlines of a farm in degrees, chunk by chunk."""
    for _, table in read_parts(store, schema.FIELD.name, [GEOMETRY]):
        yield shapely.from_wkb(table[GEOMETRY].to_numpy(zero_copy_only=False))
