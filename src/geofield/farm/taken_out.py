"""Plans that were taken out of a farm: whether what they are put over is what they came from.

A plan that is taken out notes what the farm's plan said then. A farm notes which file each plan
was put back from, so that the same file can be put back again and again, and with which settings
of its tracks. A later run plans with its own and leaves the plan in `reviewed/` as it is: that this
has others tells nothing. That they are others than it was put with is a person's word.
"""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from geofield.errors import FormatError
from geofield.farm.as_written import plan_digest
from geofield.farm.folder import REVIEWED
from geofield.farm.store import Store
from geofield.plan import Plan

#: Which file each plan was put back from, and a digest of what it said.
PUT = f"{REVIEWED}/.put.json"
#: With which settings of its tracks, by field id.
_PUT_SETTINGS = f"{REVIEWED}/.settings.json"
#: What the farm's plan said, in the evidence of one that was taken out.
_TAKEN = "taken"
#: With which settings of its tracks.
_SETTINGS = "taken_settings"


def taken_out(plan: Plan) -> Plan:
    """A plan of a farm, noting what it says."""
    farm = {**plan.evidence.farm, _TAKEN: plan_digest(plan), _SETTINGS: track_values(plan)}
    return replace(plan, evidence=replace(plan.evidence, farm=farm))


def settings_taken(plan: Plan, before: Plan | None) -> dict[str, Any]:
    """The settings of its tracks that a plan was taken out with; else those of the farm's plan."""
    taken: dict[str, Any] = plan.evidence.farm.get(_SETTINGS, track_values(before))
    return taken


def refuse_changed(plan: Plan, before: Plan, plan_file: Path, store: Store) -> None:
    """Refuse to put a plan over one that a person put back since it was taken out.

    Raises
    ------
    FormatError
        With the ways on.
    """
    field_id, there = before.field.field_id, plan_digest(before)
    taken = plan.evidence.farm.get(_TAKEN)
    if there == taken or store.noted(PUT).get(field_id) == [_name_of(plan_file), there]:
        return
    raise FormatError(
        f"{store.shown} holds a reviewed plan of {field_id} from which {plan_file.name} was not "
        "made."
        if taken is None
        else f"{field_id} was changed in {store.shown} since {plan_file.name} was taken out of it.",
        hint="Take that plan out under another name (geofield farm get) and make your edits there; "
        f"with --anyway {plan_file.name} takes its place, and it stays beside as .bak.",
    )


def note_put(plan: Plan, plan_file: Path, store: Store) -> None:
    """Note from which file a plan of the farm was put back."""
    put = {plan.field.field_id: [_name_of(plan_file), plan_digest(plan)]}
    store.note(PUT, store.noted(PUT) | put)


def _name_of(file: Path) -> str:
    """A file on this machine, without telling where it is."""
    return hashlib.sha256(f"{platform.node()}:{file.resolve()}".encode()).hexdigest()[:16]


def note_settings(store: Store, plans: Iterable[Plan]) -> None:
    """Note the settings of plans that were put into a farm."""
    noted = settings_put(store) | {plan.field.field_id: track_values(plan) for plan in plans}
    store.note(_PUT_SETTINGS, noted)


def settings_put(store: Store) -> dict[str, dict[str, Any]]:
    """The settings of the tracks of all plans that were put into a farm, by field id."""
    noted: dict[str, dict[str, Any]] = store.noted(_PUT_SETTINGS)
    return noted


def settings_said(plan: Plan, put: dict[str, Any]) -> dict[str, Any]:
    """Settings of the tracks that a plan has, and was not `put` with, or taken out with."""
    now = {} if plan.settings is None else dict(plan.settings.tracks)
    told = track_values(plan)
    return {name: now[name] for name in told if name in put and put[name] != told[name]}


def track_values(plan: Plan | None) -> dict[str, Any]:
    """The settings of a plan's tracks as plain JSON values."""
    if plan is None or plan.settings is None:
        return {}
    return plan.settings.tracks.model_dump(mode="json")
