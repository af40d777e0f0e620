"""One generation back: the plan that a run replaced stays beside the new one."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

from geofield.errors import FormatError
from geofield.staging import staged_folder
from geofield.strangers import database

SUFFIX = ".bak"


def earlier_of(plan_file: Path) -> Path:
    """Where the plan lies that a run replaced: ``field.gpkg.bak``."""
    return plan_file.with_name(plan_file.name + SUFFIX)


def keep_earlier(plan_file: Path, staging: Path) -> Path | None:
    """Put the plan that is there into a staging folder, under its name as the earlier one.

    It comes into place together with what replaces it. Returns the copy, None without a plan.
    """
    if not plan_file.is_file():
        return None
    earlier = staging / earlier_of(plan_file).name
    copy_whole(plan_file, earlier)
    return earlier


def undo(plan_file: Path) -> None:
    """Exchange a plan with the one before it; a second time takes that back.

    Raises
    ------
    FormatError
        When there is no earlier plan.
    """
    earlier = earlier_of(plan_file)
    if not earlier.is_file():
        raise FormatError(
            f"There is no earlier plan beside {plan_file}.",
            hint=f"A run that replaces a plan keeps it as {earlier.name}.",
        )
    with staged_folder(plan_file.parent, overwrite=True) as staging:
        copy_whole(earlier, staging / plan_file.name)
        keep_earlier(plan_file, staging)


def copy_whole(source: Path, target: Path) -> None:
    """A GeoPackage with all that was written to it, also where a program left a log beside it."""
    try:
        with database(source) as old, closing(sqlite3.connect(target)) as new:
            old.backup(new)
            # A copy that nobody has open needs no log beside it.
            new.execute("PRAGMA journal_mode = DELETE")
    except sqlite3.DatabaseError:
        shutil.copy2(source, target)
