"""A run: places in, farm out; only what is missing is done."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from threading import Event
from typing import Any

from geofield.errors import OutputExistsError
from geofield.farm import folder as place
from geofield.farm.chunk import Orders, Task
from geofield.farm.digest import difference, record_of
from geofield.farm.engine import Engine
from geofield.farm.limits import Limits
from geofield.farm.marks import CHANGED, WORK, excuse_all, forget_all
from geofield.farm.places import Places
from geofield.farm.reviewed import reviewed_files
from geofield.farm.stac import ITEMS as STAC_ITEMS
from geofield.farm.store import Store
from geofield.farm.value import clear
from geofield.farm.work import Job

#: Places per chunk at most: half a minute of work with pictures, some seconds without.
MOST_WITH_PICTURES, MOST_PARCELS = 25, 250
_LEAST_PARCELS = 25
#: Chunks that a run has at least, where there are enough places, so that all workers have work.
_CHUNKS = 64


@dataclass
class Count:
    """How far a run is."""

    #: Places of the farm.
    total: int
    #: How many places have which status.
    statuses: Counter[str] = field(default_factory=Counter)
    #: Places that were done when the run began.
    before: int = 0
    _begun: float = field(default_factory=time.monotonic)

    @property
    def done(self) -> int:
        """Places with a status."""
        return sum(self.statuses.values())

    @property
    def failed(self) -> int:
        """Places that failed or were lost."""
        return self.statuses["failed"] + self.statuses["lost"]

    @property
    def per_minute(self) -> float:
        """Places per minute in this run."""
        return 60.0 * (self.done - self.before) / max(time.monotonic() - self._begun, 1e-3)

    @property
    def left_s(self) -> float | None:
        """Seconds that are left at this pace; None where it is not known."""
        pace = self.per_minute / 60.0
        return (self.total - self.done) / pace if pace > 0 else None


def chunk_fields(places: int, *, pictures: bool) -> int:
    """Places per chunk: the same for the same work, whoever does it."""
    wanted = -(-places // _CHUNKS)
    if pictures:
        return max(1, min(wanted, MOST_WITH_PICTURES))
    return max(_LEAST_PARCELS, min(wanted, MOST_PARCELS))


def run_farm(
    places: Places,
    job: Job,
    store: Store,
    engine: Callable[[], Engine],
    *,
    limits: Limits | None = None,
    fresh: bool = False,
    retry: bool = False,
    imagery: Mapping[str, Any] | None = None,
    stop: Event | None = None,
    tell: Callable[[Count], None] = lambda count: None,
) -> Count:
    """Plan all places that have no status yet.

    The store is new, empty, or a farm of the same places and settings. `engine` is asked for the
    one who works only when there is something to do; `tell` is called with the count when a chunk
    is done; `imagery` (the pictures and their terms) is for the record. With `fresh` all is planned
    anew where the farm is of other places or settings, what a person reviewed stays; with `retry`
    chunks again in which places failed or were lost.

    Raises
    ------
    OutputExistsError
        When the folder holds something else.
    FormatError
        When it cannot be written.
    """
    record, there = _asked(places, job, store, imagery or {}, fresh=fresh)
    done = [] if fresh else place.committed(store)
    again = _with_failures(store, done) if retry else []
    done = [chunk for chunk in done if chunk not in again]
    missing = sorted(set(range(record.chunks)) - set(done))
    # Nothing is changed before somebody is there who can do the work.
    hired = engine() if missing else None
    try:
        if fresh and there is not None:
            clear(store)
            store.remove(WORK)
        if fresh or there is None:
            store.put(place.RECORD, record.to_json())
        for name in ("", place.REVIEWED, STAC_ITEMS):
            store.sweep(name)
        if missing:
            store.put(CHANGED, b"")
        for chunk in again:
            store.remove(place.file_of(place.STATUS, chunk))
        excuse_all(store)
        count = Count(len(places), _statuses(store, done))
        count.before = count.done
        tell(count)
        if hired is not None:
            size, order = record.chunk_fields, places.order()
            orders = Orders(
                store, job, places.own.schema, limits or Limits(), reviewed_files(store)
            )
            tasks = (
                Task(chunk, list(places.take(order[chunk * size : (chunk + 1) * size])))
                for chunk in missing
            )
            for one in hired.run(tasks, orders, stop or Event()):
                count.statuses.update(one.counts)
                tell(count)
    finally:
        if hired is not None:
            hired.close()
    if count.done == count.total:
        forget_all(store)
    return count


def _asked(
    places: Places, job: Job, store: Store, imagery: Mapping[str, Any], *, fresh: bool
) -> tuple[place.Record, place.Record | None]:
    """The record of what is asked for, and the one that is there.

    Raises
    ------
    OutputExistsError
        When there is something else.
    """
    size = chunk_fields(len(places), pictures=job.imagery is not None)
    wanted = record_of(places, job, imagery, size)
    there = place.Record.read(store)
    if there is None and store.names(""):
        raise OutputExistsError(
            f"{store.shown} is not empty, and no farm.", hint="Choose another folder."
        )
    if there is not None and there.digest != wanted.digest and not fresh:
        raise OutputExistsError(
            f"{store.shown} is a farm of other work: {difference(there, wanted)}.",
            hint="Choose another folder, or --fresh (of `geofield tracks` --overwrite): all is "
            "planned anew, what you reviewed stays.",
        )
    return wanted, there


def _statuses(store: Store, chunks: list[int]) -> Counter[str]:
    parts = place.read_parts(store, place.STATUS, ["status"], chunks)
    return Counter(one for _, table in parts for one in table["status"].to_pylist())


def _with_failures(store: Store, chunks: list[int]) -> list[int]:
    """The chunks in which places failed or were lost."""
    bad = ("failed", "lost")
    return [chunk for chunk in chunks if any(_statuses(store, [chunk])[status] for status in bad)]
