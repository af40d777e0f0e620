"""Claims: who works on which products of a folder, and what lay there when the work began.

A work that reads a folder, thinks for a minute and then replaces what is there must be alone
with it from its first look on: of two runs the later one would else overwrite the other's
products, or an edit that a person saved meanwhile. A claim is a hidden folder beside the products
whose lock the operating system takes away however the process ends (see `leftovers`): none is ever
stale.
"""

from __future__ import annotations

import json
import os
import sqlite3
import stat
import time
from collections.abc import Collection, Iterable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path

from geofield.errors import FormatError, OutputExistsError
from geofield.staging.folders import (
    cannot_write,
    log_of,
    made_folder,
    refuse_locked,
    written_ns,
)
from geofield.staging.leftovers import PREFIX, alone, is_living, sweep, working_folder
from geofield.strangers import picture_file

_CLAIM = "claim"
#: Of folders, in which what lay there is remembered; deeper lies only what plans are sent on as.
_LEVELS = 2
#: Size and time of the last writing of files, by path from the folder. Not the inode: on sticks and
#: network shares its number changes while nobody writes.
Seen = dict[Path, tuple[int, int]]


#: What this process holds, by the name of its sign: the folder, and what lay there before.
_MINE: dict[str, tuple[Path, Seen]] = {}


@contextmanager
def claimed(
    folder: Path | str,
    names: Collection[str] | None = None,
    *,
    replaced: Collection[str] = (),
    overwrite: bool = True,
    inputs: Iterable[Path | str] = (),
) -> Iterator[None]:
    """Be the only geofield that works on a folder's products until the block ends.

    What the block then writes there by `staging` replaces nothing that was changed since it began.
    `names` are the files and folders in it that are claimed; all of it without. A missing folder is
    made, and removed again when nothing comes into it. Of files that will be `replaced` it is told
    at once that they cannot be, as when they are written (see `staged_folder`).

    Raises
    ------
    OutputExistsError
        Another process holds them, or a file is there already and `overwrite` is false.
    FormatError
        A file that will be replaced is one of the `inputs`, read-only, or open in another program.
    """
    target = Path(folder)
    with ExitStack() as held:
        held.enter_context(made_folder(target))
        with alone(target) as certain:
            sweep(target, certain=certain)
            refuse_claimed(target, names)
            for place in filter(Path.is_file, (target / name for name in replaced)):
                refuse_place(place, overwrite, inputs)
            try:
                _fold_in_logs(target)
                sign = held.enter_context(working_folder(target))
                before = seen(target)
                said = {
                    "names": None if names is None else sorted(names),
                    "process": os.getpid(),
                    "since": time.time(),
                }
                (sign / _CLAIM).write_text(json.dumps(said), encoding="utf-8")
            except OSError as error:
                raise cannot_write(target, error) from error
        _MINE[sign.name] = target.resolve(), before
        held.callback(_MINE.pop, sign.name)
        yield


def refuse_place(place: Path, overwrite: bool, inputs: Iterable[Path | str]) -> None:
    """Refuse a place that may not be written or replaced."""
    if place.resolve() in {picture_file(path).resolve() for path in inputs}:
        raise FormatError(
            f"{place} is an input of this work and would be overwritten.",
            hint="Write to another file or folder.",
        )
    if place.is_dir():
        raise FormatError(f"{place} is a folder.", hint="Choose another name.")
    if place.exists():
        if not overwrite:
            raise OutputExistsError(
                f"{place} is there already.",
                hint="Choose another name or folder, or allow overwriting (--overwrite).",
            )
        refuse_locked(place)


def refuse_claimed(folder: Path, names: Collection[str] | None) -> None:
    """Refuse names in a folder, or all of it, that a living process has claimed.

    Raises
    ------
    OutputExistsError
    """
    for sign in folder.glob(PREFIX + "*"):
        # By name, which is drawn by lot: the same folder may be written in several ways.
        if sign.name in _MINE:
            continue
        try:
            said = json.loads((sign / _CLAIM).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue  # only a staging folder
        theirs = said["names"]
        if not (theirs is None or names is None or set(theirs) & set(names)):
            continue
        if is_living(sign):
            what = folder if theirs is None or names is None else folder / sorted(names)[0]
            raise OutputExistsError(
                f"Another geofield is working on {what} (process {said['process']}, since "
                f"{time.strftime('%H:%M:%S', time.localtime(said['since']))}): left to it.",
                hint="Repeat when it has finished, or write to another folder.",
            )


def before_work(folder: Path) -> Seen:
    """What lay in a folder when this process began its work on it; now, without a claim."""
    place = folder.resolve()
    for claimed_place, before in list(_MINE.values()):
        if claimed_place == place:
            return before
    return seen(folder)


def seen(target: Path, places: Iterable[Path] | None = None) -> Seen:
    """What tells one version of the files in a folder, and one below, from another.

    With `places` only of these files of it.
    """
    if places is None:
        upper = [place for place in _listed(target) if not place.name.startswith(PREFIX)]
        places = (*upper, *(inner for one in upper for inner in _listed(one)))
    found = {}
    for place in places:
        try:
            facts = place.stat()
        except OSError:
            continue
        if stat.S_ISREG(facts.st_mode):
            found[place.relative_to(target)] = (facts.st_size, written_ns(place, facts))
    return found


def refuse_changed(target: Path, places: Iterable[Path], before: Seen) -> None:
    """Refuse to replace files that came or changed since a work began.

    Raises
    ------
    OutputExistsError
    """
    for inside, facts in seen(target, places).items():
        if len(inside.parts) <= _LEVELS and facts != before.get(inside):
            raise OutputExistsError(
                f"{target / inside} was written by another program while this one worked: it is "
                "left as it is now.",
                hint="Repeat when the other one has finished.",
            )


def _listed(folder: Path) -> list[Path]:
    """What is in a folder; nothing in what is none, or has gone meanwhile."""
    try:
        return list(folder.iterdir())
    except OSError:
        return []


def _fold_in_logs(folder: Path) -> None:
    """Take in what a program that ended badly left in SQLite's write-ahead logs.

    Whoever reads such a file does so: it would look as if another program had written meanwhile.
    """
    for file in folder.glob("*.gpkg"):
        log = log_of(file)
        if not (log.is_file() and log.stat().st_size):
            continue
        with suppress(sqlite3.Error), closing(sqlite3.connect(file)) as connection:
            connection.execute("SELECT count(*) FROM sqlite_master")
