"""Hidden folders in a folder of products: which of them live, and what becomes of the dead.

A process holds a lock on a file in its hidden folder for as long as it lives; the operating
system takes the lock away however it ends. Where it died while its products were moved into
place, the move is finished, so that no mixture stays; else its folder is removed. Folders are made
and swept by one process at a time, so that one without a lock is known to be dead as well.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from geofield.errors import FormatError
from geofield.stop_signals import STOP_SIGNALS

PREFIX = ".geofield-"
#: The file of a staging folder whose products are being moved into place.
MOVING = "moving"
#: The folder of one whose files say by their places which files of an earlier product go.
LEAVING = "leaving"
_LOCK = "lock"
#: What is left of a folder that was being removed, without a lock perhaps.
_GONE = PREFIX + "gone-"
#: A folder without a lock is another version's, or lies where there are no locks.
_OLD_S = 3600.0
_PATIENCE_S = 30.0
_SWEEPING_S = 0.5
#: The byte that is locked on Windows, where nobody else can read it: behind all that is written.
_FAR = 1 << 30


@contextmanager
def working_folder(target: Path) -> Iterator[Path]:
    """A hidden folder that others leave alone until the block ends, or its process does.

    To be entered by who is :func:`alone` with the target.
    """
    with ExitStack() as held:
        with unstopped():
            folder = Path(tempfile.mkdtemp(prefix=PREFIX, dir=target))
            held.callback(discard, folder)
            lock = held.enter_context((folder / _LOCK).open("w"))
            with suppress(OSError):  # a file system without locks
                _hold(lock.fileno())
            lock.write(f"{os.getpid()}\n")
            lock.flush()
        yield folder


@contextmanager
def unstopped() -> Iterator[None]:
    """Let a stop wait until the block ends, which must be short."""
    if threading.current_thread() is not threading.main_thread():
        yield  # Python handles signals in the main thread alone
        return
    came: list[int] = []
    usual = {kind: signal.getsignal(kind) for kind in STOP_SIGNALS}
    for kind in usual:
        signal.signal(kind, lambda number, _: came.append(number))
    try:
        yield
    finally:
        for kind, handler in usual.items():
            signal.signal(kind, handler or signal.SIG_DFL)
        if came:
            signal.raise_signal(came[0])


@contextmanager
def alone(target: Path) -> Iterator[bool]:
    """Be the only process that makes, moves or sweeps in a folder; never inside itself.

    Yields whether that is certain: not on Windows, nor on a file system without locks.

    Raises
    ------
    FormatError
        When another one does not finish.
    """
    certain = sys.platform != "win32"  # no folder can be opened there
    if not certain:
        yield certain
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
                certain = False
                break
        yield certain
    finally:
        os.close(folder)


def sweep(target: Path, *, certain: bool) -> None:
    """Remove the hidden folders of processes that are dead; those of living ones stay.

    `certain` is what :func:`alone`, inside which this is called, has yielded.
    """
    for folder in target.glob(PREFIX + "*"):
        if folder.is_symlink() or not folder.is_dir():
            continue
        if folder.name.startswith(_GONE):
            shutil.rmtree(folder, ignore_errors=True)
            continue
        try:
            with (folder / _LOCK).open("r+") as lock:
                _hold(lock.fileno())
                if (folder / MOVING).exists():
                    _finish(folder, target)
        except FileNotFoundError:
            if not (certain and _is_removed(folder)):
                _sweep_old(folder)
        except (BlockingIOError, PermissionError):
            continue  # locked by the living, or not ours to remove
        except OSError:
            _sweep_old(folder)  # a file system without locks
        else:
            discard(folder)  # its lock is closed: Windows removes nothing that is open


def _is_removed(folder: Path) -> bool:
    """Whether a folder was empty, and is no more: its process died before it came to its lock."""
    try:
        folder.rmdir()
    except OSError:
        return False
    return True


def discard(staging: Path) -> None:
    """Remove a hidden folder; a kill meanwhile leaves a name that everybody may sweep."""
    gone = staging.with_name(_GONE + staging.name.removeprefix(PREFIX))
    with unstopped():
        try:
            staging.rename(gone)
        except OSError:
            gone = staging
        shutil.rmtree(gone, ignore_errors=True)


def is_living(staging: Path) -> bool:
    """Whether the process that made a folder still runs; not known, and so false, without locks."""
    until = time.monotonic() + _SWEEPING_S
    while True:
        try:
            with (staging / _LOCK).open("r+") as lock:
                if lock.read(1):
                    _hold(lock.fileno())
                return False
        except (BlockingIOError, PermissionError):
            # Perhaps only held by one who sweeps it away.
            if time.monotonic() > until:
                return True
            time.sleep(0.02)
        except OSError:
            return False


def _hold(file: int) -> None:
    """Take the lock of an open file; refused with `BlockingIOError` when it is taken."""
    if sys.platform == "win32":
        import msvcrt

        os.lseek(file, _FAR, os.SEEK_SET)
        try:
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
        except PermissionError as error:
            raise BlockingIOError(*error.args) from None
        finally:
            os.lseek(file, 0, os.SEEK_SET)
    else:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _sweep_old(staging: Path) -> None:
    with suppress(OSError):
        if time.time() - staging.stat().st_mtime > _OLD_S:
            shutil.rmtree(staging, ignore_errors=True)


def _finish(staging: Path, target: Path) -> None:
    """Move the rest into place and remove what goes, unless something was changed there since."""
    since = (staging / MOVING).stat().st_mtime_ns
    rest, gone = (
        [(file, target / file.relative_to(of)) for file in of.rglob("*") if file.is_file()]
        for of in (staging / "new", staging / LEAVING)
    )
    if any(place.exists() and place.stat().st_mtime_ns > since for _, place in (*rest, *gone)):
        return
    for _, place in gone:
        place.unlink(missing_ok=True)
    for file, place in rest:
        place.parent.mkdir(parents=True, exist_ok=True)
        file.replace(place)
