"""Marks: which place of a chunk a worker was at, should it die there.

A worker notes each place that it begins and ends in a file of the chunk. Whoever takes the
chunk up again learns from it which place ended a worker: twice in a row, and the place is lost.
A place that went over its limits is noted with its reason. The file is gone when the chunk is done.
"""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from geofield.farm.store import Store
from geofield.staging import cannot_write

WORK = ".work"
#: There while files that are made from the whole farm are older than it.
CHANGED = f"{WORK}/changed"
#: As often as this a place may end its worker.
MOST_DEATHS = 2
_BEGIN, _END, _EXCUSED, _TIME, _MEMORY = "b", "e", "x", "t", "m"


@dataclass
class Marks:
    """The marks of one chunk."""

    store: Store
    chunk: int
    #: How often each place ended its worker since it last went well.
    deaths: Counter[int] = field(default_factory=Counter)
    #: Places that went over a limit: ``t`` and seconds, or ``m`` and megabytes.
    over: dict[int, tuple[str, float]] = field(default_factory=dict)
    #: Whether a worker has ended at the chunk before.
    again: bool = False
    _lines: list[str] = field(default_factory=list)
    _handle: int | None = None

    @classmethod
    def load(cls, store: Store, chunk: int) -> Marks:
        """What earlier workers noted of a chunk."""
        marks = cls(store, chunk)
        marks._lines = (store.get(marks.name) or b"").decode(errors="replace").split("\n")[:-1]
        marks.again = bool(marks._lines)
        marks._judge()
        if store.folder is not None:
            path = store.folder / marks.name
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
                marks._handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
            except OSError as error:
                raise cannot_write(path, error) from error
        elif not marks.again:
            store.put(marks.name, b"x\n")
        return marks

    @property
    def name(self) -> str:
        """The file."""
        return f"{WORK}/chunk={self.chunk:04d}.marks"

    def _judge(self) -> None:
        begun: int | None = None
        for line in self._lines:
            kind, _, rest = line.partition(" ")
            if begun is not None and kind == _BEGIN:
                self.deaths[begun] += 1
            begun = int(rest) if kind == _BEGIN else None
            if kind == _END:
                self.deaths.pop(int(rest), None)
            elif kind in (_TIME, _MEMORY):
                at, _, value = rest.partition(" ")
                self.over[int(at)] = (kind, float(value))
        if begun is not None:
            self.deaths[begun] += 1

    def begin(self, at: int) -> None:
        """A place of the chunk is begun."""
        self._note(f"{_BEGIN} {at}")

    def end(self, at: int) -> None:
        """It is ended, well or with an error."""
        self._note(f"{_END} {at}")

    def over_time(self, at: int, seconds: float) -> None:
        """It took too long; its worker ends now."""
        self._note(f"{_TIME} {at} {seconds:.1f}")

    def over_memory(self, at: int, megabytes: float) -> None:
        """It took too much memory; its worker ends now."""
        self._note(f"{_MEMORY} {at} {megabytes:.0f}")

    def _note(self, line: str) -> None:
        if self._handle is not None:
            try:
                os.write(self._handle, f"{line}\n".encode())
            except OSError as error:
                raise cannot_write(Path(self.store.place, self.name), error) from error
        elif self.again:
            # In an object store each note is an upload: only where a worker ended before.
            self._lines.append(line)
            self.store.put(self.name, "".join(f"{each}\n" for each in self._lines).encode())

    def close(self, *, done: bool) -> None:
        """No more marks; gone when the chunk is done."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None
        if done:
            self.store.remove(self.name)


def excuse_all(store: Store) -> None:
    """A stopped run is no place's fault: what was begun then does not count against it."""
    for name in _files(store):
        store.put(name, (store.get(name) or b"") + f"{_EXCUSED}\n".encode())


def forget_all(store: Store) -> None:
    """All is done: of a worker that died behind its last place a file may be there yet."""
    for name in _files(store):
        store.remove(name)


def _files(store: Store) -> list[str]:
    return [f"{WORK}/{name}" for name in store.names(WORK) if name.endswith(".marks")]
