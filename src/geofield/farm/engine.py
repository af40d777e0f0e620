"""Engines: who plans the chunks. A pool of processes here, or a Dask cluster; the same results.

Both take chunks from an iterator as workers get free, so that a million places never lie in a
scheduler, and both go on where a worker ended.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from threading import Event
from typing import Protocol

import pyarrow as pa

from geofield.errors import GeofieldError
from geofield.farm.chunk import Done, Orders, Task, plan_chunk

#: Workers are single-threaded: there is one for each core.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "GDAL_NUM_THREADS")
ONE_THREAD = dict.fromkeys((*_THREADS, "OPENCV_FOR_THREADS_NUM"), "1")


class Engine(Protocol):
    """Plans chunks."""

    @property
    def where(self) -> str:
        """Who does the work, in words; with the address of a dashboard where there is one."""

    def run(self, tasks: Iterator[Task], orders: Orders, stop: Event) -> Iterator[Done]:
        """Plan chunks, each handed out when it is done; ends when what was begun is done.

        No chunk is begun any more when `stop` is set.
        """

    def close(self) -> None:
        """End all workers now."""


class Here:
    """Work in this process itself, one chunk after the other."""

    where = "this process"

    def run(self, tasks: Iterator[Task], orders: Orders, stop: Event) -> Iterator[Done]:
        """Plan chunks; see :class:`Engine`."""
        for task in tasks:
            if stop.is_set():
                return
            yield plan_chunk(task, orders)

    def close(self) -> None:
        """Nothing is to be ended."""


@dataclass
class Patience:
    """How often a chunk is tried again: each of its places may end its worker twice."""

    tries: dict[int, int] = field(default_factory=dict)

    def again(self, task: Task) -> None:
        """Note that a worker ended at a chunk.

        Raises
        ------
        GeofieldError
            When it cannot be the fault of its places.
        """
        self.tries[task.chunk] = self.tries.get(task.chunk, 0) + 1
        if self.tries[task.chunk] > 3 * len(task.places) + 3:
            raise GeofieldError(
                f"Workers end at chunk {task.chunk} again and again.",
                hint="Is there enough memory for all of them? Try with --workers 1.",
            )


def one_thread() -> None:
    """Keep libraries that ask no environment to one thread in this process."""
    import cv2

    cv2.setNumThreads(1)
    pa.set_cpu_count(1)
    pa.set_io_thread_count(1)
