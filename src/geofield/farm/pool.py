"""A pool of worker processes on this machine, each of which may die without harm."""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import subprocess
import sys
import tempfile
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from threading import Event
from typing import IO, Any

from geofield.errors import GeofieldError
from geofield.farm.chunk import Done, Orders, Task
from geofield.farm.engine import ONE_THREAD, Patience
from geofield.farm.folder import sweep_chunk
from geofield.farm.worker import ENDED, send
from geofield.wording import counted

#: What a worker is started with; what libraries warn of is not why it died.
PROGRAM: Sequence[str] = (sys.executable, "-W", "ignore", "-m", "geofield.farm.worker")
#: Workers that end before they are ready: more of them are no accident.
_FALSE_STARTS = 3
_GONE = object()


def cores() -> int:
    """Cores that this process may use."""
    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed else os.cpu_count() or 1


class Pool:
    """Processes of this machine; one for each core is best."""

    def __init__(self, workers: int) -> None:
        self._count = workers
        self._workers: list[_Worker] = []
        self._events: queue.Queue[tuple[_Worker, Any]] = queue.Queue()

    @property
    def where(self) -> str:
        """In words."""
        return f"{counted(self._count, 'worker')} on this machine"

    def run(self, tasks: Iterator[Task], orders: Orders, stop: Event) -> Iterator[Done]:
        """Plan chunks; see `geofield.farm.engine.Engine`."""
        patience, false_starts = Patience(), 0
        again: deque[Task] = deque()
        try:
            while True:
                self._employ(tasks, again, orders, stop)
                if not any(worker.task for worker in self._workers):
                    return
                # Not forever: an interrupt must come through on every system.
                with contextlib.suppress(queue.Empty):
                    worker, message = self._events.get(timeout=0.5)
                    if message is _GONE:
                        if worker in self._workers:
                            self._workers.remove(worker)
                        false_starts = 0 if worker.ready else false_starts + 1
                        if false_starts >= _FALSE_STARTS:
                            raise GeofieldError(
                                f"Workers end before they are ready: {worker.last_words()}",
                                hint="Is there enough memory for all? Try with --workers 1.",
                            )
                        if worker.task is not None:
                            if worker.ready:
                                patience.again(worker.task)
                            again.append(worker.task)
                        worker.close()
                    elif message == "ready":
                        worker.ready = True
                    elif isinstance(message, BaseException):
                        raise message
                    else:
                        worker.task = None
                        yield message
        finally:
            self._end(orders)

    def _employ(
        self, tasks: Iterator[Task], again: deque[Task], orders: Orders, stop: Event
    ) -> None:
        """Give every free worker a chunk, and start workers that are missing."""
        free = [worker for worker in self._workers if worker.task is None]
        while free or len(self._workers) < self._count:
            if stop.is_set():
                return
            task = again.popleft() if again else next(tasks, None)
            if task is None:
                return
            if free:
                worker = free.pop()
            else:
                worker = _Worker.start(orders, self._events)
                self._workers.append(worker)
            worker.take(task)

    def _end(self, orders: Orders) -> None:
        """End all workers, and remove what they were writing where another one could not go on."""
        begun = [worker.task.chunk for worker in self._workers if worker.task is not None]
        self.close()
        for chunk in begun:
            sweep_chunk(orders.store, chunk)

    def close(self) -> None:
        """End all workers now."""
        for worker in self._workers:
            worker.close()
        self._workers.clear()


@dataclass(eq=False)
class _Worker:
    """One process."""

    process: subprocess.Popen[bytes]
    errors: IO[bytes]
    task: Task | None = None
    ready: bool = False

    @classmethod
    def start(cls, orders: Orders, events: queue.Queue[tuple[_Worker, Any]]) -> _Worker:
        errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the worker
        path = os.pathsep.join(part for part in sys.path if part)
        process = subprocess.Popen(
            PROGRAM,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            env={**os.environ, **ONE_THREAD, "PYTHONPATH": path},
            # Ctrl+C of a terminal goes to all processes of its group.
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),  # of Windows
        )
        worker = cls(process, errors)

        def listen() -> None:
            with contextlib.suppress(*ENDED, OSError, ValueError):
                while process.stdout is not None:
                    events.put((worker, pickle.load(process.stdout)))  # noqa: S301 - our child's
            events.put((worker, _GONE))

        threading.Thread(target=listen, name="answers", daemon=True).start()
        worker._say(orders)
        return worker

    def take(self, task: Task) -> None:
        """Give it a chunk; where it has died meanwhile, that is heard of soon."""
        self.task = task
        self._say(task)

    def _say(self, message: Any) -> None:
        with contextlib.suppress(OSError, ValueError):
            send(self.process.stdin, message)  # type: ignore[arg-type]

    def last_words(self) -> str:
        """The end of what it wrote on its standard error."""
        self.errors.seek(0)
        lines = self.errors.read().decode(errors="replace").strip().splitlines()
        return lines[-1][:300] if lines else f"exit status {self.process.wait()}"

    def close(self) -> None:
        """End it now."""
        self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout, self.errors):
            with contextlib.suppress(OSError):
                if stream is not None:
                    stream.close()
