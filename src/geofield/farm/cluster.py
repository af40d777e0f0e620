"""A Dask cluster that somebody started, as engine (extra `batch`).

Workers write into the farm's folder themselves; through the scheduler go only the places of a
chunk, and back how many of them went well.
"""

from __future__ import annotations

import contextlib
import logging
import time
from collections.abc import Callable, Iterator
from threading import Event
from typing import Any

from geofield import __version__
from geofield.errors import GeofieldError, NetworkError
from geofield.farm.chunk import Done, Orders, Task, plan_chunk
from geofield.farm.engine import Patience, one_thread
from geofield.farm.marks import WORK
from geofield.farm.store import Store
from geofield.staging import unstopped

#: Chunks per worker thread in the scheduler: one is worked on, one is there when it is done.
_AHEAD = 2
_CONNECT_S = 15


class Cluster:
    """A Dask cluster.

    `client` is closed with the engine, and `after` called then. `work` is what workers do with a
    chunk, for measuring the scheduler alone.
    """

    def __init__(
        self,
        client: Any,
        work: Callable[[Task, Orders], Done] | None = None,
        after: Callable[[], None] | None = None,
    ) -> None:
        self._client = client
        self._after = after or (lambda: None)
        self._work = work or _work

    @classmethod
    def at(cls, address: str, store: Store) -> Cluster:
        """A cluster that exists, whose workers can do the work on a farm.

        Raises
        ------
        NetworkError
            When its scheduler does not answer.
        GeofieldError
            When its workers cannot do the work.
        """
        from distributed import Client

        give_back = _held_messages()
        try:
            client = Client(address, timeout=_CONNECT_S, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            give_back()
            raise NetworkError(
                f"The scheduler {address} does not answer ({type(error).__name__}).",
                hint="Start one with `dask scheduler`, and name its address: tcp://HOST:8786.",
            ) from None
        cluster = cls(client, after=give_back)
        try:
            cluster.check(store)
        except BaseException:
            cluster.close()
            raise
        return cluster

    @property
    def where(self) -> str:
        """In words, with the dashboard's address."""
        threads = sum(self._client.nthreads().values())
        link = self._client.dashboard_link
        return f"{threads} Dask worker threads" + (f", dashboard at {link}" if link else "")

    def check(self, store: Store) -> None:
        """Refuse workers that cannot do the work, before they have it.

        Raises
        ------
        GeofieldError
            When there are none, they have another version of geofield or none, or do not see the
            farm's folder.
        """
        until = time.monotonic() + _CONNECT_S
        while not self._client.nthreads():
            if time.monotonic() > until:
                raise GeofieldError(
                    "The scheduler has no workers.", hint="Start some with `dask worker ADDRESS`."
                )
            time.sleep(0.2)
        probe = f"{WORK}/probe-{time.time_ns()}"
        store.put(probe, b"here")
        try:
            answers = self._client.run(_facts, store, probe, on_error="return")
        finally:
            store.remove(probe)
            if not store.names(WORK):
                store.remove(WORK)
        for worker, facts in sorted(answers.items()):
            if isinstance(facts, ImportError):
                raise GeofieldError(
                    f"The worker {worker} has no geofield that fits: {facts}.",
                    hint="Install the same version of geofield[batch] where workers run.",
                )
            if isinstance(facts, BaseException):
                raise GeofieldError(
                    f"The worker {worker} cannot be used: {facts}.",
                    hint="Look at what it wrote, and start it again: `dask worker ADDRESS`.",
                )
            version, sees = facts
            if version != __version__:
                raise GeofieldError(
                    f"The worker {worker} has geofield {version}; here it is {__version__}.",
                    hint="Install the same version everywhere: results could differ.",
                )
            if not sees:
                raise GeofieldError(
                    f"The worker {worker} does not see {store.shown}.",
                    hint="Write to a folder that all machines share, or to an object store.",
                )

    def run(self, tasks: Iterator[Task], orders: Orders, stop: Event) -> Iterator[Done]:
        """Plan chunks; see `geofield.farm.engine.Engine`."""
        from distributed import CancelledError, KilledWorker, wait
        from distributed.comm import CommClosedError

        patience = Patience()
        running: dict[Any, Task] = {}
        again: list[Task] = []
        try:
            while True:
                ahead = _AHEAD * max(1, sum(self._client.nthreads().values()))
                while len(running) < ahead and not stop.is_set():
                    task = again.pop() if again else next(tasks, None)
                    if task is None:
                        break
                    running[self._client.submit(self._work, task, orders, pure=False)] = task
                if not running:
                    return
                try:
                    with self._client.as_current():
                        ready = wait(list(running), 0.5, return_when="FIRST_COMPLETED").done
                except TimeoutError:
                    continue
                for future in ready:
                    task = running.pop(future)
                    try:
                        yield future.result()
                    except KilledWorker:
                        patience.again(task)
                        again.append(task)
        except (CancelledError, CommClosedError) as error:
            raise NetworkError(
                "The scheduler has gone, and the work with it.",
                hint="What was done is kept: the same command does what is missing.",
            ) from error
        finally:
            for future in running:
                with contextlib.suppress(CommClosedError):
                    future.cancel()

    def close(self) -> None:
        """Leave the cluster.

        A stop waits until that is done: what is left half closed Dask closes when Python ends, and
        waits ten seconds for it.
        """
        with unstopped(), contextlib.suppress(TimeoutError, OSError):
            self._client.close(timeout=10)
            self._after()  # else it goes on ending, and talks of it


def _held_messages() -> Callable[[], None]:
    """Hold Dask's own messages: ends on purpose are no news, accidents are told by us.

    Returns what gives them back.
    """
    levels = [(each, each.level) for each in logging.getLogger("distributed").handlers]
    for handler, _ in levels:
        handler.setLevel(logging.CRITICAL)

    def give_back() -> None:
        for handler, level in levels:
            handler.setLevel(level)

    return give_back


def _facts(store: Store, probe: str) -> tuple[str, bool]:
    """What a worker is: its version, and whether it sees the farm."""
    return __version__, store.get(probe) is not None


def _work(task: Task, orders: Orders) -> Done:
    one_thread()
    return plan_chunk(task, orders)
