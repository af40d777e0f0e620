"""Status: what became of each place, one row per place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
import shapely

from geofield.plan import Plan


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a place."""

    field_id: str
    name: str = ""
    #: Row in the places file, from 1.
    place: int = 0
    #: lat, lon: degrees, WGS 84.
    lat: float = float("nan")
    lon: float = float("nan")
    #: ``done``; ``doubtful`` (planned, but a person should look at the outline, or at ground that
    #: the picture did not show); ``failed``; ``lost`` (it ended its worker, twice).
    status: str = "done"
    #: error, hint: why it failed, and what helps.
    error: str = ""
    hint: str = ""
    #: What the stages had to tell.
    notes: str = ""
    #: Of the outline.
    certainty: float | None = None
    #: What speaks against the outline, and for obstacles that nobody saw.
    doubts: str = ""
    #: Whether it is as a person left it.
    reviewed: bool = False
    seconds: float = 0.0
    worker: str = ""


def outcome_words(plan: Plan) -> dict[str, Any]:
    """Status, certainty and doubts of a plan that was made."""
    # A coarse or flat picture is that of all fields; ground that nobody saw is of this one.
    doubts = (*plan.doubts, *(f"Obstacles: {each}" for each in plan.evidence.unseen))
    quality = plan.field.quality
    trusted = quality is None or quality.trusted or plan.outline_edited
    return {
        "status": "done" if trusted and not doubts else "doubtful",
        "certainty": None if plan.outline_edited else plan.field.certainty,
        "doubts": "; ".join(doubts),
    }


def status_table(outcomes: Sequence[Outcome]) -> pa.Table:
    """The rows as Arrow, a point for each place."""
    number, text = pa.float64(), pa.string()
    kinds = {
        "field_id": text, "name": text, "status": text, "error": text, "hint": text, "notes": text,
        "certainty": number, "doubts": text, "reviewed": pa.bool_(), "place": pa.int64(),
        "lat": number, "lon": number, "seconds": number, "worker": text,
    }  # fmt: skip
    columns = {}
    for name, kind in kinds.items():
        values = [getattr(one, name) for one in outcomes]
        values = [value or None for value in values] if kind == text else values
        columns[name] = pa.array(values, kind, from_pandas=True)
    places = np.array([[one.lon, one.lat] for one in outcomes]).reshape(-1, 2)
    columns["geometry"] = pa.array(shapely.to_wkb(shapely.points(places)), pa.binary())
    return pa.table(columns)


def outcomes_of(table: pa.Table) -> list[dict[str, Any]]:
    """The rows of a status table as arguments of :class:`Outcome`."""
    rows = table.drop_columns("geometry").to_pylist()
    return [{k: v for k, v in row.items() if v is not None or k == "certainty"} for row in rows]
