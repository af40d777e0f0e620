"""Folders of products: made when they are missing, and why they cannot be written."""

from __future__ import annotations

import errno
import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from geofield.errors import FormatError

_SQLITE_MAGIC = b"SQLite format 3\x00"


@contextmanager
def made_folder(target: Path) -> Iterator[None]:
    """Make a folder for as long as it takes; gone again, as its parents made, when it stays empty.

    Raises
    ------
    FormatError
        It cannot be made.
    """
    made = []
    current = target
    while not current.exists():
        made.append(current)
        current = current.parent
    try:
        try:
            target.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(target, error) from error
        yield
    finally:
        for folder in made:
            try:
                folder.rmdir()
            except OSError:
                break  # something is in it


def log_of(file: Path) -> Path:
    """The write-ahead log of SQLite, where QGIS puts what it saves while the file is open there."""
    return file.with_name(file.name + "-wal")


def written_ns(file: Path, facts: os.stat_result | None = None) -> int:
    """When a file was written last, also where that still lies in the log beside it."""
    written = (facts or file.stat()).st_mtime_ns
    with suppress(FileNotFoundError):
        log = log_of(file).stat()
        if log.st_size:
            written = max(written, log.st_mtime_ns)
    return written


def cannot_write(target: Path, error: OSError) -> FormatError:
    """Why a folder takes no products, in words; or that a file which is read for them cannot be."""
    place = Path(os.fsdecode(error.filename or target))
    if error.errno == errno.ENOSPC:
        return FormatError(f"The disk is full: {place}.", hint="Free some space, then repeat.")
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        if error.filename2 is not None:  # Windows replaces nothing that is open
            return FormatError(
                f"{os.fsdecode(error.filename2)} cannot be replaced ({error.strerror}).",
                hint="Close it in the program that has it open, then repeat.",
            )
        if place.is_file() and not os.access(place, os.R_OK):
            return FormatError(
                f"{place} cannot be read ({error.strerror}).",
                hint="Give yourself the right to read it, then repeat.",
            )
        return FormatError(
            f"{target} cannot be written ({error.strerror}).",
            hint="Choose a folder you may write to.",
        )
    if error.errno in (errno.EEXIST, errno.ENOTDIR):
        return FormatError(
            f"{target} is not a folder ({error.strerror}).",
            hint="Choose another folder.",
        )
    return FormatError(
        f"{target}: {error.strerror or error}.", hint="Repeat, or write to another folder."
    )


def refuse_locked(place: Path) -> None:
    """Refuse to replace a read-only file, or a GeoPackage that another program has open.

    QGIS keeps a GeoPackage in WAL mode while it is open. Leaving that mode needs to be
    alone with the file, and it also folds a write-ahead log left by a crash into the file:
    otherwise SQLite would replay that log into the new one.
    """
    if not os.access(place, os.W_OK):
        raise FormatError(
            f"{place} is read-only.", hint="Make it writable, or write to another folder."
        )
    with place.open("rb") as file:
        if file.read(16) != _SQLITE_MAGIC:
            return
    try:
        with closing(sqlite3.connect(place, timeout=0.5, isolation_level=None)) as connection:
            connection.execute("PRAGMA journal_mode = DELETE").fetchone()
            connection.execute("BEGIN EXCLUSIVE")
            connection.execute("ROLLBACK")
    except sqlite3.OperationalError as error:
        raise FormatError(
            f"{place} is open in another program ({error}).",
            hint="Close it there (in QGIS: remove its layers or close the project), then repeat.",
        ) from error
    except sqlite3.DatabaseError:
        return  # damaged: nothing in it to protect from being replaced
