"""Reviewed plans that a person edited where they lie in a farm, since it took them in."""

from __future__ import annotations

from collections.abc import Iterator, Set
from pathlib import Path
from typing import Any

from geofield.errors import FieldWarning, FormatError, GeofieldError
from geofield.farm.folder import REVIEWED, STATUS, read_parts
from geofield.farm.folder import file_of as file_in
from geofield.farm.layers import FIELD_ID
from geofield.farm.reviewed import file_of, reviewed_files
from geofield.farm.store import Store
from geofield.farm.taken_out import settings_put, settings_said
from geofield.farm.value import read_farm
from geofield.notes import warn
from geofield.plan import Plan, read_plan
from geofield.staging import written_ns

#: The overview of which edits are just being taken in, and their fields.
BEGUN = f"{REVIEWED}/.begun.json"


def edited_in_place(store: Store, only: Set[str] | None = None) -> Iterator[str]:
    """Fields whose plan in `reviewed/` was edited there since the farm took it in.

    Only those that the farm has a plan of, and `only` some where that is given; a file that is
    newer, or came later, and says the same, is none.

    Warns
    -----
    FieldWarning
        When such a file cannot be read, or names another field.
    """
    names = reviewed_files(store) - _begun(store)
    if only is not None:
        names &= {file_of(one) for one in only}
    if store.folder is None or not names:
        return
    farm, put = read_farm(store.place), settings_put(store)
    for chunk, status in read_parts(store, STATUS, [FIELD_ID]):
        taken_in_ns = written_ns(store.folder / file_in(STATUS, chunk))
        for one in status[FIELD_ID].to_pylist():
            if file_of(one) not in names or one not in farm:
                continue
            file = store.folder / file_of(one)
            # One that was edited elsewhere may come with the time of then.
            if max(written_ns(file), file.stat().st_ctime_ns) <= taken_in_ns:
                continue
            if _differs(file, farm[one], put.get(one, {})):
                yield one


def _begun(store: Store) -> frozenset[str]:
    """Plans that a run put here which was killed before it had taken in all edits of an overview.

    They are no edits made here, and are put again from the overview.
    """
    overview, *ids = store.noted(BEGUN) or [""]
    return frozenset(map(file_of, ids) if Path(overview).is_file() else ())


def _differs(file: Path, before: Plan, put: dict[str, Any]) -> bool:
    """Whether a reviewed plan was edited since the farm took it in; no, where it cannot be read."""
    field_id = before.field.field_id
    try:
        plan = read_plan(file)
        if plan.field.field_id != field_id:
            raise FormatError(
                f"It is named {plan.field.field_id!r}, and not {field_id!r}.",
                hint="Give it that field_id back, or move it out of the farm.",
            )
        return _is_edited(plan, before, put)
    except GeofieldError as error:
        words = f"{file_of(field_id)} is not taken in: {error}"
        warn(words, FieldWarning)
        return False


def _is_edited(plan: Plan, before: Plan, put: dict[str, Any]) -> bool:
    """Whether a reviewed plan says something else than the one that the farm made of it.

    `put` are the settings that it was put with.
    """
    known, said = plan.evidence.track_edits, before.evidence.track_edits
    return (
        not _same_ground(plan, before)
        or plan.field.name != before.field.name
        or _own_of(plan) != _own_of(before)
        or plan.track_edits != known
        or known != said
        or bool(settings_said(plan, put))
    )


def _same_ground(plan: Plan, other: Plan) -> bool:
    """Whether outline and obstacles of two plans are the same."""
    if not plan.field.polygon.equals_exact(other.field.polygon, 1e-6):
        return False
    # A file holds a layer without rows where none was looked for.
    mine, theirs = (
        None if one.obstacles is None or one.obstacles.empty else one.obstacles
        for one in (plan, other)
    )
    return mine is theirs if mine is None or theirs is None else bool(mine.equals(theirs))


def _own_of(plan: Plan) -> dict[str, Any]:
    """What stands in the field's columns of a person's own."""
    return {name: value for name, value in plan.field.own if value is not None}
