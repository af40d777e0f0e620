"""With which settings of its tracks each reviewed plan was put into a farm.

A later run plans with its own and leaves the plan in `reviewed/` as it is: that this has others
tells nothing. That they are others than it was put with is a person's word.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from geofield.farm.folder import REVIEWED
from geofield.farm.store import Store
from geofield.plan import Plan

#: By field id.
_FILE = f"{REVIEWED}/.settings.json"


def note_settings(store: Store, plans: Iterable[Plan]) -> None:
    """Note the settings of plans that were put into a farm."""
    noted = settings_put(store) | {plan.field.field_id: track_values(plan) for plan in plans}
    store.note(_FILE, noted)


def settings_put(store: Store) -> dict[str, dict[str, Any]]:
    """The settings of the tracks of all plans that were put into a farm, by field id."""
    noted: dict[str, dict[str, Any]] = store.noted(_FILE)
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
