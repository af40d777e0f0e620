"""Staging folders of other processes: which of them live, and what becomes of the dead.

A process holds a lock on a file in its staging folder for as long as it lives; the operating
system takes the lock away however it ends. Where it died while its products were moved into
place, the move is finished, so that no mixture stays; else its folder is removed.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

from geofield.errors import FormatError

PREFIX = ".geofield-"
#: The file of a staging folder whose products are being moved into place.
MOVING = "moving"
_LOCK = "lock"
#: What is left of a folder that was being removed, without a lock perhaps.
_GONE = PREFIX + "gone-"
#: A folder without a lock is another version's, or was made this moment.
_OLD_S = 3600.0
_PATIENCE_S = 30.0
_SWEEPING_S = 0.5
#: Not on Windows: there leftovers wait until they are old.
_LOCKS = find_spec("fcntl") is not None


@contextmanager
def alive(staging: Path) -> Iterator[None]:
    """Hold the lock that says that a staging folder is in use."""
    with (staging / _LOCK).open("w") as lock:
        _hold(lock.fileno())
        # Only a lock with something in it counts: there is a moment between open and flock.
        lock.write(f"{os.getpid()}\n")
        lock.flush()
        yield


@contextmanager
def alone(target: Path) -> Iterator[None]:
    """Be the only process that moves products into a folder.

    Raises
    ------
    FormatError
        When another one does not finish.
    """
    if not _LOCKS:
        yield
        return
    folder = os.open(target, os.O_RDONLY)
    try:
        until = time.monotonic() + _PATIENCE_S
        while True:
            try:
                _hold(folder)
                break
            except BlockingIOError:
                if time.monotonic() > until:
                    raise FormatError(
                        f"Another geofield is writing into {target}.", hint="Repeat later."
                    ) from None
                time.sleep(0.02)
            except OSError:
                break  # a file system without locks
        yield
    finally:
        os.close(folder)


def sweep(target: Path) -> None:
    """Remove the staging folders of processes that are dead; those of living ones stay."""
    for staging in target.glob(PREFIX + "*"):
        if staging.is_symlink() or not staging.is_dir():
            continue
        if staging.name.startswith(_GONE):
            shutil.rmtree(staging, ignore_errors=True)
            continue
        try:
            with (staging / _LOCK).open("r+") as lock:
                if not _LOCKS or not lock.read(1):
                    _sweep_old(staging)
                    continue
                _hold(lock.fileno())
                if (staging / MOVING).exists():
                    _finish(staging, target)
                discard(staging)
        except FileNotFoundError:
            _sweep_old(staging)
        except OSError:
            continue  # locked by the living, or not ours to remove


def discard(staging: Path) -> None:
    """Remove a staging folder; a stop meanwhile leaves a name that everybody may sweep."""
    gone = staging.with_name(_GONE + staging.name.removeprefix(PREFIX))
    try:
        staging.rename(gone)
    except OSError:
        gone = staging
    shutil.rmtree(gone, ignore_errors=True)


def is_living(staging: Path) -> bool:
    """Whether the process that made a folder still runs; not known, and so false, on Windows."""
    until = time.monotonic() + _SWEEPING_S
    while True:
        try:
            with (staging / _LOCK).open("r+") as lock:
                if _LOCKS and lock.read(1):
                    _hold(lock.fileno())
                return False
        except BlockingIOError:
            # Perhaps only held by one who sweeps it away.
            if time.monotonic() > until:
                return True
            time.sleep(0.02)
        except OSError:
            return False


def _hold(file: int) -> None:
    """Take the lock of an open file; refused with `BlockingIOError` when it is taken."""
    if _LOCKS:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _sweep_old(staging: Path) -> None:
    try:
        if time.time() - staging.stat().st_mtime > _OLD_S:
            shutil.rmtree(staging, ignore_errors=True)
    except OSError:
        return


def _finish(staging: Path, target: Path) -> None:
    """Move the rest into place, unless something was changed there since."""
    since = (staging / MOVING).stat().st_mtime_ns
    work = staging / "new"
    rest = [(file, target / file.relative_to(work)) for file in work.rglob("*") if file.is_file()]
    if any(place.exists() and place.stat().st_mtime_ns > since for _, place in rest):
        return
    for file, place in rest:
        place.parent.mkdir(parents=True, exist_ok=True)
        file.replace(place)
