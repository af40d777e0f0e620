"""Runs commands as Windows and a FAT stick would, as far as files go: lists of words, as JSON.

What is open cannot be renamed, replaced or removed, nor a folder that holds it; lines of text end
in CR LF where nobody says how; the disk is waited for only by who may write; locks are those of
`msvcrt`; signals are few, and no file gets a second name.
"""

from __future__ import annotations

import errno
import fcntl
import inspect
import io
import json
import os
import signal
import subprocess  # noqa: F401 - looks for `msvcrt` while it loads
import sys
import types
from contextlib import suppress
from pathlib import Path
from typing import Any

#: The word for a process that plans fields for `batch`.
WORKER = "a worker"
_OPENED = io.open
#: Where the path of an event's argument is, and the folder that a relative one begins at.
_NAMED = {"os.rename": ((0, 2), (1, 3)), "os.remove": ((0, 1),), "os.rmdir": ((0, 1),)}


def _opened(*words: Any, **given: Any) -> Any:
    told = inspect.signature(_OPENED).bind(*words, **given).arguments
    if not {"b", "r"} & set(told.get("mode", "r")) and told.get("newline") is None:
        told["newline"] = "\r\n"
    return _OPENED(**told)


def _refuse_open(event: str, words: tuple[Any, ...]) -> None:
    for at, folder in _NAMED.get(event, ()):
        place = os.fsdecode(words[at])
        if words[folder] >= 0:  # as `shutil` names what it removes
            place = str(Path(f"/proc/self/fd/{words[folder]}").readlink() / place)
        place = str(Path(place).absolute())
        held = [one for one in _open_files() if one == place or one.startswith(f"{place}/")]
        if held:
            sys.stderr.write(f"OPEN: {event} {held}\n")
            raise PermissionError(errno.EACCES, "It is open", place)


def _open_files() -> list[str]:
    """The files that this process has open."""
    found = []
    for link in Path("/proc/self/fd").iterdir():
        with suppress(OSError):  # the one that lists them is closed by now
            found.append(link.readlink())
    return [str(place) for place in found if place.is_file()]


def _locking(file: int, mode: int, length: int) -> None:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise PermissionError(errno.EACCES, "Permission denied") from None


def _fsync(file: int) -> None:
    if fcntl.fcntl(file, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY:
        raise OSError(errno.EBADF, os.strerror(errno.EBADF))


def _link(*_: Any) -> None:
    raise OSError(errno.EPERM, os.strerror(errno.EPERM))


def main() -> None:
    """Run them one after the other, up to the first that fails."""
    there: dict[str, Any] = {
        "fcntl": None,
        "msvcrt": types.SimpleNamespace(LK_NBLCK=2, locking=_locking),
    }
    sys.modules.update(there)
    for name in ("SIGHUP", "pthread_kill", "setitimer"):
        delattr(signal, name)
    os.fsync, os.link, io.open = _fsync, _link, _opened  # type: ignore[assignment]
    sys.addaudithook(_refuse_open)
    from geofield.cli import main as command
    from geofield.farm import pool, worker
    from geofield.staging import leftovers

    vars(leftovers)["sys"] = types.SimpleNamespace(platform="win32")
    if sys.argv[1] == WORKER:
        worker.main()
    pool.PROGRAM = (sys.executable, __file__, WORKER)
    for words in json.loads(sys.argv[1]):
        try:
            command(words)
        except SystemExit as stop:
            if stop.code:
                sys.exit(f"{words} ended with {stop.code}")


if __name__ == "__main__":
    main()
