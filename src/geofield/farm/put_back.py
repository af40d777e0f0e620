"""Reviewed plans go back into a farm, in the place of those that are there."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from geofield.earlier import is_planned
from geofield.errors import FieldWarning, FormatError
from geofield.farm.edited_in_place import edited_in_place
from geofield.farm.folder import REVIEWED, STATUS, read_part, read_parts, write_chunk
from geofield.farm.folder import file_of as file_in
from geofield.farm.layers import FIELD_ID, KEPT, stacked, tables_of
from geofield.farm.marks import CHANGED
from geofield.farm.reviewed import SUFFIX, file_of, reviewed_files
from geofield.farm.status import Outcome, outcome_words, outcomes_of, status_table
from geofield.farm.store import Store
from geofield.farm.taken_out import (
    note_put,
    note_settings,
    refuse_changed,
    settings_put,
    settings_said,
    settings_taken,
)
from geofield.farm.value import read_farm
from geofield.farm.work import is_near, overlap
from geofield.formats.gpkg_guests import bring_guests
from geofield.known import with_given
from geofield.model.written import same_shapes
from geofield.notes import warn
from geofield.pipeline import run_tracks
from geofield.plan import Plan, read_plan
from geofield.plan_files import save_plan
from geofield.settings import Settings
from geofield.staging import refuse_locked
from geofield.staging.generations import copy_whole, earlier_of
from geofield.wording import command

#: Of a status row that a person's plan took the place of.
_SAID = {"reviewed": True, "error": "", "hint": "", "notes": ""}


def put_back(plan_file: Path, folder: str | Path, *, anyway: bool = False) -> str:
    """Put a reviewed plan back into a farm, in the place of the one that is there; the field's id.

    The plan itself is kept in the farm, so that no later run changes what a person said. Tracks
    are planned again unless the plan's own record says that nothing was edited since they were.
    One that a person put back is replaced by what was made from it, or by any `anyway`; it stays
    beside as ``.bak``.

    Raises
    ------
    FormatError
        When there is no such field in the farm, or it lies elsewhere; when the plan of it that was
        put back before is another than this one was made from, or was edited since.
    TrackError
        When its tracks cannot be planned again.

    Warns
    -----
    FieldWarning
        When its tracks were planned again.
    """
    store = Store.of(folder)
    plan, farm = read_plan(plan_file), read_farm(folder)
    field_id = plan.field.field_id
    chunks = _chunks_with(store, {field_id})
    if not chunks:
        raise FormatError(
            f"{folder} has no field {field_id!r}.",
            hint="The field's id must be one of the farm's, which are in its farm.gpkg.",
        )
    refuse_unseen(store, {field_id}, but=plan_file)
    before = farm[field_id] if field_id in farm else None  # noqa: SIM401 - a farm has no get
    _refuse_elsewhere(plan, before, chunks)
    there = Path(store.place, file_of(field_id))
    mine = there.is_file() and there.samefile(plan_file)
    if before is not None:
        if not (anyway or mine) and file_of(field_id) in reviewed_files(store):
            refuse_changed(plan, before, plan_file, store)
        plan = with_given(_with_its_outline(plan, before), before)
    taken = settings_put(store).get(field_id, {}) if mine else settings_taken(plan, before)
    known, plan = plan, _with_said(plan, settings_said(plan, taken))
    settings = plan.settings or (None if before is None else before.settings)
    with tempfile.TemporaryDirectory(prefix="geofield-") as name:
        file = Path(name) / "field.gpkg"
        whole = plan_file.suffix.lower() == SUFFIX
        if whole:
            # With all that was written to it, also where a program has it open.
            copy_whole(plan_file, file)
        edited = plan.track_edits != plan.evidence.track_edits
        if settings is not None and (edited or not _has_its_tracks(plan)):
            if not edited:
                why = (
                    "there is no record of how its tracks were written, so they"
                    if plan.tracks is None
                    else "its tracks were not those of its outline and obstacles, and"
                )
                warn(f"{plan.field.name}: {why} are planned again.", FieldWarning)
            plan = run_tracks(plan, settings=settings)
        another = there.is_file() and not mine
        if another or not (whole and plan is known):
            save_plan(plan, file, overwrite=True)
        if another:
            # Layers and the like of a person's own that this file has not.
            bring_guests(there, file, further=True)
        # First what must not be lost; the tables follow from it.
        _put(store, field_id, file)
    note_settings(store, [plan])
    replace_plans(store, [plan])
    if not mine:
        note_put(read_farm(folder)[field_id], plan_file, store)
    return field_id


def _refuse_elsewhere(plan: Plan, before: Plan | None, chunks: Mapping[int, pa.Table]) -> None:
    """Refuse a plan of other ground than the farm's of that id, or than its place without one."""
    field = plan.field
    if before is not None:
        near = overlap(field, before.field)
    else:
        rows = [row for status in chunks.values() for row in outcomes_of(status)]
        (row,) = [row for row in rows if row[FIELD_ID] == field.field_id]
        near = is_near(field, row.get("lat", np.nan), row.get("lon", np.nan))
    if not near:
        raise FormatError(
            f"This plan of {field.field_id!r} is of a field elsewhere: the farm's lies on other "
            "ground.",
            hint="Give it the id (field_id) of its own field, or put it into its own farm.",
        )


def take_in_place(store: Store, field_id: str) -> None:
    """Take in a plan that was edited in `reviewed/`, its tracks planned again as the farm's are.

    Raises
    ------
    FormatError
        When another program has it open.
    TrackError
        When its tracks cannot be planned again.
    """
    before = read_farm(store.place)[field_id]
    edited = read_plan(Path(store.place, file_of(field_id)))
    plan = with_given(_with_its_outline(edited, before), before)
    settings = before.settings or plan.settings or Settings()
    said = settings_said(plan, settings_put(store).get(field_id, {}))
    tracks = settings.tracks.model_copy(update=said)
    settings = settings.model_copy(update={"tracks": tracks})
    plan = run_tracks(_with_said(plan, said), settings=settings)
    keep_plans(store, [plan])
    replace_plans(store, [plan])


def _with_said(plan: Plan, names: Iterable[str]) -> Plan:
    """A plan some of whose tracks' settings are a person's word, whatever they were said with."""
    said = tuple(sorted({*plan.evidence.said_tracks, *names}))
    if said == plan.evidence.said_tracks:
        return plan
    return replace(plan, evidence=replace(plan.evidence, said_tracks=said))


def _put(store: Store, field_id: str, file: Path) -> None:
    """Keep a reviewed plan, in the place of the one that is there, which stays beside it."""
    there = None if store.folder is None else store.folder / file_of(field_id)
    if there is not None and there.is_file():
        if file_of(field_id) not in reviewed_files(store):
            raise FormatError(
                f"Where {file_of(field_id)} would lie is the plan of another field: this disk does "
                "not tell capitals from small letters.",
                hint="Give one of the two fields another id in the file of places.",
            )
        refuse_locked(there)
        store.put(f"{REVIEWED}/{earlier_of(there).name}", there.read_bytes())
    store.put(file_of(field_id), file.read_bytes())


def refuse_unseen(store: Store, ids: Set[str], *, but: Path | None = None) -> None:
    """Refuse to write over plans in `reviewed/` whose edits the farm has not taken in."""
    for one in edited_in_place(store, ids):
        file = Path(store.place) / file_of(one)
        if but is None or not file.samefile(but):
            raise FormatError(
                f"{file_of(one)} has edits that the farm does not hold yet.",
                hint=f"Take them in first: {command('farm', 'put', file, Path(store.place))}; or "
                "move that file out of the farm.",
            )


def _has_its_tracks(plan: Plan) -> bool:
    """Whether a plan's record says that its tracks are those of its outline and obstacles.

    What the farm has does not tell: tracks may have been planned before the last edit, and the
    farm may have changed since.
    """
    recorded = plan.evidence.outline is not None and (
        plan.obstacles is None or plan.obstacles.empty or plan.evidence.written is not None
    )
    return plan.tracks is not None and recorded and is_planned(plan)


def _with_its_outline(plan: Plan, before: Plan) -> Plan:
    """A plan whose outline counts as drawn where only the farm can tell that it was moved."""
    if plan.evidence.outline is not None:
        return plan
    if same_shapes([plan.field.polygon], [before.field.polygon])[0]:
        return plan
    return replace(plan, field=replace(plan.field, method="drawn", quality=None))


def keep_plans(store: Store, plans: Sequence[Plan]) -> None:
    """Keep plans of fields of the farm: none of them can be lost any more.

    What a person has in the file of one that is there comes along.
    """
    for plan in plans:
        field_id = plan.field.field_id
        there = Path(store.place, file_of(field_id))
        with tempfile.TemporaryDirectory(prefix="geofield-") as name:
            file = Path(name) / "field.gpkg"
            if there.is_file():
                copy_whole(there, file)
            save_plan(plan, file, overwrite=True)
            _put(store, field_id, file)
    note_settings(store, plans)


def _chunks_with(store: Store, ids: Set[str]) -> dict[int, pa.Table]:
    """The status of the chunks in which fields are."""
    return {
        chunk: status
        for chunk, status in read_parts(store, STATUS)
        if not ids.isdisjoint(status["field_id"].to_pylist())
    }


def replace_plans(store: Store, plans: Sequence[Plan]) -> None:
    """Write chunks again with plans in the place of others."""
    by_id = {plan.field.field_id: plan for plan in plans}
    chunks = _chunks_with(store, by_id.keys())
    for chunk in chunks:
        # Without it a chunk does not count: where all ends here, it is planned again.
        store.remove(file_in(STATUS, chunk))
    store.put(CHANGED, b"")
    for chunk, status in chunks.items():
        ids = status["field_id"].to_pylist()
        mine = {one: by_id[one] for one in ids if one in by_id}
        fresh = tables_of(mine.values())
        tables = {name: read_part(store, name, chunk) for name in KEPT}
        merged = {
            name: _spliced(tables[name], fresh.get(name), list(mine), ids)
            for name in KEPT
            if name in fresh or tables[name] is not None
        }
        rows = [
            row | outcome_words(mine[row["field_id"]]) | _SAID if row["field_id"] in mine else row
            for row in outcomes_of(status)
        ]
        write_chunk(store, chunk, merged, status_table([Outcome(**row) for row in rows]))


def _spliced(old: Any, new: Any, mine: list[str], ids: list[str]) -> pa.Table:
    """A table with the rows of some fields exchanged, the fields in their order."""
    parts = [] if new is None else [new]
    if old is not None:
        theirs = pc.invert(pc.is_in(old["field_id"], pa.array(mine, pa.string())))
        parts.insert(0, old.filter(theirs))
    whole = stacked(parts)
    at = pc.index_in(whole["field_id"], pa.array(ids, pa.string()))
    order = pc.sort_indices(pa.table({"at": at, "row": range(len(whole))}),
                            sort_keys=[("at", "ascending"), ("row", "ascending")])  # fmt: skip
    return whole.take(order)
