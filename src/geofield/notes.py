"""Notes: what geofield tells beside a result, heard by one piece of work at a time.

A note is a warning of Python for whoever calls the package. Work that gathers the notes of its
own (an edit on the review page, a field of a farm) listens: Python's own way to record warnings
belongs to the whole process, and loses them where another thread records or silences some.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from geofield.errors import GeofieldWarning

#: Who listens here, the innermost last: what was heard, and the kind that is.
_EARS: ContextVar[tuple[tuple[list[GeofieldWarning], type[GeofieldWarning]], ...]] = ContextVar(
    "ears", default=()
)


def warn(words: str, kind: type[GeofieldWarning], *, stacklevel: int = 1) -> None:
    """Tell something to whoever listens, else to all as a warning of Python.

    Parameters
    ----------
    words : str
    kind : type
        A child of `GeofieldWarning`.
    stacklevel : int
        Whose line a warning of Python names, as `warnings.warn` has it: 1 is the caller's.
    """
    for heard, of_kind in reversed(_EARS.get()):
        if issubclass(kind, of_kind):
            heard.append(kind(words))
            return
    warnings.warn(words, kind, stacklevel=stacklevel + 1)


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
