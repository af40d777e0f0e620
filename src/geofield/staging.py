"""Files come into place whole or not at all.

Products are written into a hidden folder inside the target folder (the same file system, so
that `os.replace` is one step of the operating system) and moved when everything is there.
When a move fails, files replaced before it are put back. Leftovers of runs that were killed
are swept by the next one (see `leftovers`).
"""

from __future__ import annotations

import errno
import os
import shutil
import sqlite3
import stat
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from geofield.errors import FormatError, OutputExistsError
from geofield.leftovers import MOVING, PREFIX, alive, alone, sweep

_SQLITE_MAGIC = b"SQLite format 3\x00"


@contextmanager
def staged_folder(
    folder: Path | str, *, overwrite: bool = False, inputs: Iterable[Path | str] = ()
) -> Iterator[Path]:
    """An empty folder whose files appear in `folder` when the block ends well.

    Parameters
    ----------
    folder : Path
        Where the products go; made when it is missing.
    overwrite : bool
        Whether products that are there already may be replaced.
    inputs : iterable of Path
        Files read for this work: none of them is ever replaced.

    Yields
    ------
    Path
        The staging folder. Sub-folders keep their names.

    Raises
    ------
    OutputExistsError
        When a product is there already and `overwrite` is false.
    FormatError
        When the folder cannot be written, the disk is full, or a product is open in another
        program. The previous products are then as they were.
    """
    target, inputs = Path(folder), tuple(inputs)
    made = _make_folder(target)
    sweep(target)
    before = _seen(target)
    try:
        staging = Path(tempfile.mkdtemp(prefix=PREFIX, dir=target))
    except OSError as error:
        _remove_made(made)
        raise cannot_write(target, error) from error
    done = False
    try:
        with alive(staging):
            work = staging / "new"
            work.mkdir()
            try:
                yield work
                with alone(target):
                    _publish(work, target, staging, overwrite, inputs, before)
            except OSError as error:
                raise cannot_write(target, error) from error
            done = True
    finally:
        shutil.rmtree(staging, ignore_errors=True)
        if not done:
            _remove_made(made)


#: Inode and time of change of files, by path.
_Seen = dict[Path, tuple[int, int]]


def _seen(target: Path) -> _Seen:
    """What lies in a folder and one below, as far as it could be a product."""
    found = {}
    upper = _listed(target)
    for place in (*upper, *(inner for one in upper for inner in _listed(one))):
        try:
            facts = place.stat()
        except OSError:
            continue
        if not place.name.startswith(PREFIX) and stat.S_ISREG(facts.st_mode):
            found[place] = (facts.st_ino, facts.st_mtime_ns)
    return found


def _listed(folder: Path) -> list[Path]:
    """What is in a folder; nothing in what is none, or has gone meanwhile."""
    try:
        return list(folder.iterdir())
    except OSError:
        return []


@contextmanager
def staged_file(
    path: Path | str, *, overwrite: bool = False, inputs: Iterable[Path | str] = ()
) -> Iterator[Path]:
    """A path to write one file at; it becomes `path` when the block ends well.

    The name is the same, so that drivers which look at the suffix are content. Parameters
    and errors are those of :func:`staged_folder`, but what may not be replaced is refused
    before the work, not after it.
    """
    target, inputs = Path(path), tuple(inputs)
    _refuse(target, overwrite, inputs)
    with staged_folder(target.parent, overwrite=overwrite, inputs=inputs) as folder:
        yield folder / target.name


def _make_folder(target: Path) -> list[Path]:
    """Make a folder; returns the folders that were not there before, innermost first."""
    made = []
    current = target
    while not current.exists():
        made.append(current)
        current = current.parent
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        _remove_made(made)
        raise cannot_write(target, error) from error
    return made


def _remove_made(made: list[Path]) -> None:
    for folder in made:
        try:
            folder.rmdir()
        except OSError:
            return


def _publish(
    work: Path,
    target: Path,
    staging: Path,
    overwrite: bool,
    inputs: Iterable[Path | str],
    before: _Seen,
) -> None:
    old = staging / "old"
    files = sorted(path for path in work.rglob("*") if path.is_file())
    pairs = [(path, target / path.relative_to(work)) for path in files]
    now = _seen(target)
    for _, place in pairs:
        if now.get(place) not in (None, before.get(place)):
            raise OutputExistsError(
                f"{place} was written by another program while this one worked: it is left as "
                "it is now.",
                hint="Repeat when the other one has finished.",
            )
        if not place.parent.resolve().is_relative_to(target.resolve()):
            raise FormatError(
                f"{place.parent} is a link that leads out of {target}: nothing was written.",
                hint="Remove the link, or write to another folder.",
            )
        _refuse(place, overwrite, inputs)
    moved: list[tuple[Path, Path | None]] = []
    (staging / MOVING).touch()
    try:
        for source, place in pairs:
            place.parent.mkdir(parents=True, exist_ok=True)
            kept = None
            if place.exists():
                kept = old / place.relative_to(target)
                kept.parent.mkdir(parents=True, exist_ok=True)
                _keep(place, kept)
            source.replace(place)
            moved.append((place, kept))
    except BaseException:
        # BaseException: an interrupt between two moves must not leave a mixture either.
        for place, kept in reversed(moved):
            if kept is None:
                place.unlink(missing_ok=True)
            else:
                kept.replace(place)
        (staging / MOVING).unlink()
        raise


def _refuse(place: Path, overwrite: bool, inputs: Iterable[Path | str]) -> None:
    """Refuse a place that may not be written or replaced."""
    if place.resolve() in {Path(path).resolve() for path in inputs}:
        raise FormatError(
            f"{place} is an input of this work and would be overwritten.",
            hint="Write to another folder.",
        )
    if place.is_dir():
        raise FormatError(f"{place} is a folder.", hint="Choose another name.")
    if place.exists():
        if not overwrite:
            raise OutputExistsError(
                f"{place} is there already.",
                hint="Write to another folder, or allow overwriting (--overwrite).",
            )
        refuse_locked(place)


def _keep(place: Path, kept: Path) -> None:
    """A second name for a file; a copy where there are no hard links (FAT sticks)."""
    try:
        os.link(place, kept)
    except OSError:
        shutil.copy2(place, kept)


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


def cannot_write(target: Path, error: OSError) -> FormatError:
    """The error in words that a person can do something with."""
    place = error.filename or target
    if error.errno == errno.ENOSPC:
        return FormatError(f"The disk is full: {place}.", hint="Free some space, then repeat.")
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return FormatError(
            f"{target} cannot be written ({error.strerror}).",
            hint="Choose a folder you may write to.",
        )
    if error.errno in (errno.EEXIST, errno.ENOTDIR):
        return FormatError(
            f"{target} is not a folder ({error.strerror}).", hint="Choose another --out."
        )
    return FormatError(f"{target}: {error.strerror or error}.")
