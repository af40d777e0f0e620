"""Plans that a person reviewed and put back into a farm: no run changes their word."""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from urllib.parse import quote

from geofield.errors import FormatError
from geofield.farm.folder import REVIEWED, STATUS, read_parts
from geofield.farm.status import outcomes_of
from geofield.farm.store import Store
from geofield.plan import Plan, read_plan

SUFFIX = ".gpkg"
#: Names of files may have 255 bytes, and what is half written has some more.
_LONGEST = 200


def name_of(field_id: str) -> str:
    """What a field's plan is called as a file, whatever its id."""
    stem = quote(field_id, safe=" ")
    if stem.startswith("."):  # hidden, and passed over by readers
        stem = f"%2E{stem[1:]}"
    if len(stem) > _LONGEST:
        stem = f"{stem[:_LONGEST]}~{hashlib.sha256(field_id.encode()).hexdigest()[:16]}"
    return f"{stem}{SUFFIX}"


def file_of(field_id: str) -> str:
    """Where the reviewed plan of a field lies."""
    return f"{REVIEWED}/{name_of(field_id)}"


def reviewed_files(store: Store) -> frozenset[str]:
    """The plans that a person put back, as :func:`file_of` names them."""
    names = (name for name in store.names(REVIEWED) if name.endswith(SUFFIX))
    return frozenset(f"{REVIEWED}/{name}" for name in names)


def reviewed_rows(store: Store) -> list[dict[str, Any]]:
    """The status rows of fields that a person reviewed."""
    tables = (table for _, table in read_parts(store, STATUS))
    return [row for table in tables for row in outcomes_of(table) if row["reviewed"]]


def without_place(store: Store, ids: Iterable[str]) -> list[str]:
    """The plans that a person put back, and that are of no place with one of these ids."""
    return sorted(reviewed_files(store) - {file_of(one) for one in ids})


def reviewed_plan(store: Store, field_id: str) -> Plan:
    """The plan of a field as a person left it."""
    if store.folder is not None:
        return read_plan(store.folder / file_of(field_id))
    data = store.get(file_of(field_id))
    if data is None:
        raise FormatError(
            f"The reviewed plan of {field_id} is gone from {store.shown}.",
            hint="Bring it back from a copy; without it --retry plans the field anew.",
        )
    with tempfile.TemporaryDirectory(prefix="geofield-") as folder:
        path = Path(folder) / "field.gpkg"
        path.write_bytes(data)
        return read_plan(path)
