"""Plans that a person reviewed and put back into a farm: no run changes their word."""

from __future__ import annotations

import hashlib
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from geofield.errors import FormatError
from geofield.farm.folder import REVIEWED, STATUS, Record, committed, read_part, write_chunk
from geofield.farm.folder import file_of as file_in
from geofield.farm.layers import KEPT, stacked, tables_of
from geofield.farm.status import Outcome, outcome_words, outcomes_of, status_table
from geofield.farm.store import Store
from geofield.plan import Plan, read_plan
from geofield.staging.generations import copy_whole

if TYPE_CHECKING:
    import pyarrow as pa

_SUFFIX = ".gpkg"
#: Names of files may have 255 bytes, and what is half written has some more.
_LONGEST = 200
#: Of a status row that a person's plan took the place of.
_SAID = {"reviewed": True, "error": "", "hint": "", "notes": ""}


def file_of(field_id: str) -> str:
    """Where the reviewed plan of a field lies."""
    stem = quote(field_id, safe=" ")
    if stem.startswith("."):  # hidden, and passed over by readers
        stem = f"%2E{stem[1:]}"
    if len(stem) > _LONGEST:
        stem = f"{stem[:_LONGEST]}~{hashlib.sha256(field_id.encode()).hexdigest()[:16]}"
    return f"{REVIEWED}/{stem}{_SUFFIX}"


def reviewed_files(store: Store) -> frozenset[str]:
    """The plans that a person put back, as :func:`file_of` names them."""
    return frozenset(f"{REVIEWED}/{name}" for name in store.names(REVIEWED))


def reviewed_plan(store: Store, field_id: str) -> Plan:
    """The plan of a field as a person left it."""
    if store.folder is not None:
        return read_plan(store.folder / file_of(field_id))
    data = store.get(file_of(field_id))
    if data is None:
        raise FormatError(f"The reviewed plan of {field_id} is gone from {store.shown}.")
    with tempfile.TemporaryDirectory(prefix="geofield-") as folder:
        path = Path(folder) / "field.gpkg"
        path.write_bytes(data)
        return read_plan(path)


def put_back(plan_file: Path, folder: str | Path) -> str:
    """Put a reviewed plan back into a farm, in the place of the one that is there; the field's id.

    The plan itself is kept in the farm, so that no later run changes what a person said.

    Raises
    ------
    FormatError
        When there is no such field in the farm.
    """
    store = Store.of(folder)
    if Record.read(store) is None:
        raise FormatError(f"{folder} is no farm of geofield.", hint="Make one: geofield batch.")
    plan = read_plan(plan_file)
    field_id = plan.field.field_id
    for chunk in committed(store):
        status = read_part(store, STATUS, chunk)
        if status is not None and field_id in status["field_id"].to_pylist():
            break
    else:
        raise FormatError(
            f"{folder} has no field {field_id!r}.",
            hint="The field's id must be that of the farm: see its status table.",
        )
    # First what must not be lost; the tables follow from it.
    store.put(file_of(field_id), _file_bytes(plan_file))
    _replace(store, chunk, plan, status)
    return field_id


def _file_bytes(path: Path) -> bytes:
    """A GeoPackage with all that was written to it, also where a program has it open."""
    with tempfile.TemporaryDirectory(prefix="geofield-") as folder:
        copy = Path(folder) / path.name
        copy_whole(path, copy)
        return copy.read_bytes()


def _replace(store: Store, chunk: int, plan: Plan, status: pa.Table) -> None:
    """Write a chunk again with one plan in the place of another."""
    mine, ids, fresh = plan.field.field_id, status["field_id"].to_pylist(), tables_of([plan])
    tables = {name: read_part(store, name, chunk) for name in KEPT}
    merged = {
        name: _spliced(tables[name], fresh.get(name), mine, ids)
        for name in KEPT
        if name in fresh or tables[name] is not None
    }
    said = outcome_words(plan) | _SAID
    rows = [
        Outcome(**row | said if row["field_id"] == mine else row) for row in outcomes_of(status)
    ]
    # Rows of layers that are no longer there must not stay.
    store.remove(file_in(STATUS, chunk))
    write_chunk(store, chunk, merged, status_table(rows))


def _spliced(old: Any, new: Any, field_id: str, ids: list[str]) -> pa.Table:
    """A table with one field's rows exchanged, the fields in their order."""
    import pyarrow as pa
    import pyarrow.compute as pc

    rest = None if old is None else old.filter(pc.not_equal(old["field_id"], field_id))
    parts = [part for part in (rest, new) if part is not None]
    whole = stacked(parts)
    at = pc.index_in(whole["field_id"], pa.array(ids, pa.string()))
    order = pc.sort_indices(pa.table({"at": at, "row": range(len(whole))}),
                            sort_keys=[("at", "ascending"), ("row", "ascending")])  # fmt: skip
    return whole.take(order)
