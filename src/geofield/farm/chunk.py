"""The work on a chunk of neighbouring places: plan each, write all, say what became of them."""

from __future__ import annotations

import os
import platform
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import pyarrow as pa

from geofield import __version__
from geofield.errors import FormatError
from geofield.farm.folder import sweep_chunk, write_chunk
from geofield.farm.layers import tables_of
from geofield.farm.limits import Limits, Watch
from geofield.farm.marks import MOST_DEATHS, Marks
from geofield.farm.places import Place
from geofield.farm.reviewed import file_of, reviewed_plan
from geofield.farm.status import Outcome, outcome_words, status_table
from geofield.farm.store import Store
from geofield.farm.work import Job, in_words, plan_place, told
from geofield.notes import listening
from geofield.plan import Plan

_LIMIT_HINT = "Look at it alone with `geofield run`, or give it more: --{}-limit."


@dataclass(frozen=True)
class Orders:
    """What every worker of a run is told."""

    store: Store
    job: Job
    #: The user's own columns, by the places file.
    own: pa.Schema | None = None
    limits: Limits = field(default_factory=Limits)
    #: Files of the plans that a person put back.
    reviewed: frozenset[str] = frozenset()
    #: Of geofield where the run was started.
    version: str = __version__


@dataclass(frozen=True)
class Task:
    """One chunk of places."""

    chunk: int
    places: Sequence[Place]


@dataclass(frozen=True)
class Done:
    """What became of a chunk: how many places of each status, and the seconds it took."""

    chunk: int
    counts: Mapping[str, int]
    seconds: float = 0.0


def plan_chunk(task: Task, orders: Orders) -> Done:
    """Plan the places of a chunk and write them; the same bytes whoever does it.

    Raises
    ------
    FormatError
        When the farm's folder cannot be written; a place that fails is no error.
    """
    if orders.version != __version__:
        raise FormatError(
            f"A worker has geofield {__version__}; the run was started with {orders.version}.",
            hint="Install the same version everywhere.",
        )
    begun = time.perf_counter()
    marks = Marks.load(orders.store, task.chunk)
    if marks.again:
        sweep_chunk(orders.store, task.chunk)
    plans: list[Plan] = []
    outcomes: list[Outcome] = []
    done = False
    try:
        with Watch(orders.limits, marks).watching() as watch:
            for at, place in enumerate(task.places):
                outcome = _condemned(place, at, marks)
                if outcome is None:
                    watch.begin(at)
                    plan, outcome = _planned(place, orders)
                    watch.end(at)
                    plans += [] if plan is None else [plan]
                outcomes.append(outcome)
        write_chunk(orders.store, task.chunk, tables_of(plans, orders.own), status_table(outcomes))
        done = True
    finally:
        marks.close(done=done)
    counts = Counter(one.status for one in outcomes)
    return Done(task.chunk, dict(counts), time.perf_counter() - begun)


def _planned(place: Place, orders: Orders) -> tuple[Plan | None, Outcome]:
    """The plan of a place, where there is one, and its row of the status."""
    begun = time.perf_counter()
    plan: Plan | None = None
    is_reviewed = file_of(place.field_id) in orders.reviewed
    with listening() as heard:
        try:
            previous = reviewed_plan(orders.store, place.field_id) if is_reviewed else None
            plan = plan_place(place, orders.job, previous)
            words = outcome_words(plan)
        except Exception as error:  # noqa: BLE001 - a fault in one field must not stop a million
            words = in_words(error)
    return plan, _outcome(
        place,
        notes=told(place, heard),
        reviewed=is_reviewed,
        seconds=round(time.perf_counter() - begun, 4),
        **words,
    )


def _condemned(place: Place, at: int, marks: Marks) -> Outcome | None:
    """The outcome of a place that no worker should try again."""
    if at in marks.over:
        kind, value = marks.over[at]
        what, unit = ("time", "s") if kind == "t" else ("memory", "MB")
        error = f"It took more than the {what} limit of {value:g} {unit}."
        return _outcome(place, status="failed", error=error, hint=_LIMIT_HINT.format(what))
    if marks.deaths[at] >= MOST_DEATHS:
        return _outcome(
            place,
            status="lost",
            error=f"It ended its worker {MOST_DEATHS} times.",
            hint="Look at its picture and outline; try it alone with `geofield run`.",
        )
    return None


def _outcome(place: Place, **words: object) -> Outcome:
    return Outcome(
        place.field_id,
        place.name,
        place.row,
        place.lat,
        place.lon,
        worker=f"{platform.node()}:{os.getpid()}",
        **words,  # type: ignore[arg-type]
    )
