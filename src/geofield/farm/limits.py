"""Limits of a field: time and memory, kept by a watch in its worker's own process.

Native code cannot be interrupted, so a place that goes over a limit is noted and its process
ends; the next worker reads the note and leaves the place out.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from geofield.errors import SettingsError, refuse_no_number
from geofield.farm.marks import Marks

_EVERY_S = 0.2
#: Three years: no alarm of the operating system is set for much more.
_LONG_S = 1e8
#: Exit status of a worker that ended itself.
OVER_LIMIT = 70


@dataclass(frozen=True, slots=True)
class Limits:
    """What one field may take."""

    time_s: float | None = None
    #: Of the worker's whole process.
    memory_mb: float | None = None

    def __post_init__(self) -> None:
        # An alarm for no time, or at the end of time, is none.
        refuse_no_number(SettingsError, "seconds", none_too=True, time_s=self.time_s)
        refuse_no_number(SettingsError, "megabytes", none_too=True, memory_mb=self.memory_mb)


class Watch:
    """Watches one place at a time."""

    def __init__(self, limits: Limits, marks: Marks) -> None:
        self._limits = limits
        self._marks = marks
        self._at: tuple[int, float] | None = None
        self._done = threading.Event()

    def begin(self, at: int) -> None:
        """A place is begun."""
        self._marks.begin(at)
        self._at = (at, time.monotonic())
        self._alarm(self._limits.time_s)

    def end(self, at: int) -> None:
        """It is ended."""
        self._at = None
        self._alarm(None)
        self._marks.end(at)

    def _alarm(self, seconds: float | None) -> None:
        """The operating system's own alarm, for code that lets no thread run."""
        if self._limits.time_s is not None and hasattr(signal, "setitimer"):
            late = 0.0 if seconds is None else 1.5 * seconds + 5.0
            signal.setitimer(signal.ITIMER_REAL, min(late, _LONG_S))

    def _look(self) -> None:
        while not self._done.wait(_EVERY_S):
            watched = self._at
            if watched is None:
                continue
            at, since = watched
            took_s = time.monotonic() - since
            if self._limits.time_s is not None and took_s > self._limits.time_s:
                self._marks.over_time(at, self._limits.time_s)
                os._exit(OVER_LIMIT)
            if self._limits.memory_mb is not None and memory_mb() > self._limits.memory_mb:
                self._marks.over_memory(at, self._limits.memory_mb)
                os._exit(OVER_LIMIT)

    @contextmanager
    def watching(self) -> Iterator[Watch]:
        """Watch for the time of a block."""
        if self._limits == Limits():
            yield self
            return
        thread = threading.Thread(target=self._look, name="limits", daemon=True)
        thread.start()
        try:
            yield self
        finally:
            self._done.set()
            self._alarm(None)
            thread.join()


def memory_mb() -> float:
    """Memory that this process holds, megabytes; 0 where the system does not tell."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
    except (OSError, ValueError, AttributeError):
        try:
            import psutil  # comes with the extra
        except ImportError:
            return 0.0
        return float(psutil.Process().memory_info().rss) / 1e6
