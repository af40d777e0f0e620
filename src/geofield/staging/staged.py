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
import time
from collections.abc import Collection, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from geofield.errors import FormatError, FormatWarning
from geofield.notes import warn
from geofield.staging.claims import (
    Seen,
    before_work,
    refuse_changed,
    refuse_claimed,
    refuse_place,
    seen,
)
from geofield.staging.folders import cannot_write, made_folder
from geofield.staging.leftovers import LEAVING, MOVING, alone, sweep, unstopped, working_folder


@contextmanager
def staged_folder(
    folder: Path | str,
    *,
    overwrite: bool = False,
    inputs: Iterable[Path | str] = (),
    products: Iterable[Collection[Path]] = (),
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
    products : iterable of collection of Path
        Files that are one product: where some of them are written, those of an earlier one that
        are not go.

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
    with ExitStack() as held:
        held.enter_context(made_folder(target))
        with alone(target) as certain:
            sweep(target, certain=certain)
            refuse_claimed(target, ())
            before = before_work(target)
            try:
                staging = held.enter_context(working_folder(target))
            except OSError as error:
                raise cannot_write(target, error) from error
        try:
            work = staging / "new"
            work.mkdir()
            yield work
            with alone(target), unstopped():
                _publish(work, target, staging, overwrite, inputs, before, products)
        except OSError as error:
            raise cannot_write(target, error) from error
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode != sqlite3.SQLITE_FULL:
                raise
            raise cannot_write(target, OSError(errno.ENOSPC, str(error))) from error


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
    refuse_place(target, overwrite, inputs)
    with staged_folder(target.parent, overwrite=overwrite, inputs=inputs) as folder:
        yield folder / target.name


def _publish(
    work: Path,
    target: Path,
    staging: Path,
    overwrite: bool,
    inputs: Iterable[Path | str],
    before: Seen,
    products: Iterable[Collection[Path]],
) -> None:
    files = sorted(path for path in work.rglob("*") if path.is_file())
    pairs = [(path, target / path.relative_to(work)) for path in files]
    places = [place for _, place in pairs]
    whole = {
        file for product in products if not set(product).isdisjoint(places) for file in product
    }
    gone = sorted(filter(Path.is_file, whole.difference(places)))
    refuse_claimed(target, {place.relative_to(target).parts[0] for place in places})
    refuse_changed(target, [*places, *gone], before)
    for place in (*places, *gone):
        if not place.parent.resolve().is_relative_to(target.resolve()):
            raise FormatError(
                f"{place.parent} is a link that leads out of {target}: nothing was written.",
                hint="Remove the link, or write to another folder.",
            )
        refuse_place(place, overwrite, inputs)
    now_ns = time.time_ns()
    for path in files:
        # What came into place together has one time: none of it is older than the rest.
        os.utime(path, ns=(now_ns, now_ns))
    links = {place: place.resolve() for place in places if place.is_symlink()}
    _move(pairs, gone, target, staging)
    for place, led_to in links.items():
        words = f"{place} was a link to {led_to}, which stays as it was; it is a file now."
        warn(words, FormatWarning)
    before |= seen(target, places)  # a claim may write more than once


def _move(pairs: list[tuple[Path, Path]], gone: list[Path], target: Path, staging: Path) -> None:
    """Move all files into place and remove what is gone, or nothing of it."""
    old = staging / "old"
    moved: list[tuple[Path, Path | None]] = []
    for place in gone:
        note = staging / LEAVING / place.relative_to(target)
        note.parent.mkdir(parents=True, exist_ok=True)
        note.touch()
    (staging / MOVING).touch()
    try:
        for source, place in (*pairs, *((None, place) for place in gone)):
            place.parent.mkdir(parents=True, exist_ok=True)
            kept = None
            if place.exists():
                kept = old / place.relative_to(target)
                kept.parent.mkdir(parents=True, exist_ok=True)
                _keep(place, kept)
                with suppress(OSError):  # a file system without modes
                    shutil.copymode(place, source or kept)
            moved.append((place, kept))
            if source is None:
                place.unlink()
            else:
                source.replace(place)
    except BaseException:
        # BaseException: nothing that comes between two moves may leave a mixture.
        for place, kept in reversed(moved):
            try:
                if kept is None:
                    place.unlink(missing_ok=True)
                else:
                    kept.replace(place)
            except PermissionError:
                # Windows replaces nothing that is open; what was to come last is as it was then.
                if place != moved[-1][0]:
                    raise
        (staging / MOVING).unlink()
        raise


def _keep(place: Path, kept: Path) -> None:
    """A second name for a file; a copy where there are no hard links (FAT sticks)."""
    try:
        os.link(place, kept)
    except OSError:
        shutil.copy2(place, kept)
