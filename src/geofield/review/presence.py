"""Which notes of reviews belong to sessions that still run: those hold a lock on them.

The operating system takes a lock away however its process ends. Not on Windows, where notes that
are open could not be moved: there every session counts as ended.
"""

from __future__ import annotations

import os
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

_LOCKS = find_spec("fcntl") is not None
#: Open files of the notes that this process holds.
_HELD: dict[Path, int] = {}


def hold(notes: Path) -> None:
    """Let other processes know, for as long as this one lives, that notes belong to it."""
    if not _LOCKS:
        return
    import fcntl

    path = notes.absolute()
    with suppress(OSError):
        if path in _HELD and os.path.samestat(os.fstat(_HELD[path]), path.stat()):
            return
        release(path)
        file = os.open(path, os.O_RDONLY)
        _HELD[path] = file
        fcntl.flock(file, fcntl.LOCK_SH)


def release(notes: Path) -> None:
    """Let go of notes that are needed no more."""
    file = _HELD.pop(notes.absolute(), None)
    if file is not None:
        os.close(file)


def is_open_elsewhere(notes: Path) -> bool:
    """Whether another process, which still runs, holds these notes."""
    if not _LOCKS:
        return False
    import fcntl

    try:
        file = os.open(notes, os.O_RDONLY)
    except OSError:
        return False
    try:
        there = os.fstat(file)
        if any(os.path.samestat(os.fstat(own), there) for own in _HELD.values()):
            return False
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False  # a file system without locks
    finally:
        os.close(file)
    return False
