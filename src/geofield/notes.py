"""Notes: what geofield tells beside a result, heard by one piece of work at a time.

A note is a warning of Python for whoever calls the package. Work that gathers the notes of its
own (an edit on the review page, a field of a farm) listens: Python's own way to record warnings
belongs to the whole process, and loses them where another thread records or silences some.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from traceback import walk_stack
from types import FrameType

from geofield.errors import GeofieldWarning

#: Who listens here, the innermost last: what was heard, and the kind that is.
_EARS: ContextVar[tuple[tuple[list[GeofieldWarning], type[GeofieldWarning]], ...]] = ContextVar(
    "ears", default=()
)


def warn(words: str, kind: type[GeofieldWarning]) -> None:
    """Tell something to whoever listens, else to all as a warning of Python.

    That names the line that called geofield, however deep in it the words are found.
    """
    for heard, of_kind in reversed(_EARS.get()):
        if issubclass(kind, of_kind):
            heard.append(kind(words))
            return
    frames = enumerate(walk_stack(sys._getframe()), start=1)
    ours = [level for level, (frame, _) in frames if _is_ours(frame)]
    warnings.warn(words, kind, stacklevel=ours[-1] + 1)


def _is_ours(frame: FrameType) -> bool:
    return str(frame.f_globals.get("__name__")).partition(".")[0] == __package__


@contextmanager
def listening(kind: type[GeofieldWarning] = GeofieldWarning) -> Iterator[list[GeofieldWarning]]:
    """Hear the notes of a block in this thread, of one kind or all; nobody else hears those.

    A thread that the block starts is heard where it runs in a copy of the context.
    """
    heard: list[GeofieldWarning] = []
    token = _EARS.set((*_EARS.get(), (heard, kind)))
    try:
        yield heard
    finally:
        _EARS.reset(token)
