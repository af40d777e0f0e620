"""Which plans lie in a folder: looked at before anything heavy is loaded."""

from __future__ import annotations

import sqlite3
from pathlib import Path

from geofield.errors import FormatError
from geofield.strangers import database

#: The file that makes a folder a farm.
_FARM = "farm.json"
#: What the notes of a plan's edits are called, behind its name.
SUFFIX = ".review.jsonl"
#: Where a farm's fields lie while they are edited.
REVIEWING = "reviewing"
#: Folders below the one that was named: `farm/field.gpkg` and `farm/field-7/field.gpkg`.
_DEPTH = ("*.gpkg", "*/*.gpkg")


def is_farm(place: Path) -> bool:
    """Whether a folder is a farm of geofield."""
    return (place / _FARM).is_file()


def plans_in(folder: Path) -> list[Path]:
    """The plans of geofield in a folder and the folders in it, by name.

    Raises
    ------
    FormatError
        There is none.
    """
    places = [path for pattern in _DEPTH for path in sorted(folder.glob(pattern))]
    found = [path for path in places if not path.name.startswith(".") and is_plan(path)]
    if not found:
        raise FormatError(
            f"{folder} holds no plan of geofield.",
            hint="Name a GeoPackage that `geofield run` wrote, or a folder with such files.",
        )
    return found


def journal_path(plan_path: Path) -> Path:
    """Where the edits of a plan are kept until the session ends with all saved."""
    return plan_path.with_name(plan_path.name + SUFFIX)


def unsaved_in(folder: Path) -> list[Path]:
    """The notes of edits that were not saved, of plans in a folder or a farm."""
    found = [*folder.glob(f"*{SUFFIX}"), *folder.glob(f"{REVIEWING}/*{SUFFIX}")]
    return [path for path in sorted(found) if path.is_file() and _is_unsaved(path)]


def _is_unsaved(journal: Path) -> bool:
    """Whether something is noted behind the line that tells of the last saving."""
    lines = [line for line in journal.read_bytes().split(b"\n") if line.strip()]
    return len(lines) > 1 and not lines[-1].startswith(b'{"saved"')


def is_plan(path: Path) -> bool:
    """Whether a file says that it is a plan of geofield; it may be damaged all the same."""
    try:
        with database(path) as file:
            return bool(file.execute("SELECT 1 FROM gpkg_metadata").fetchone())
    except sqlite3.Error:
        return False
