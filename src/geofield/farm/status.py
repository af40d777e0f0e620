"""Status: what became of each place, one row per place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from geofield.plan import Plan

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a place.

    Attributes
    ----------
    field_id, name : str
    place : int
        Row in the places file, from 1.
    lat, lon : float
        Degrees, WGS 84.
    status : str
        ``done``; ``doubtful`` (planned, but a person should look at the outline); ``failed``;
        ``lost`` (it ended its worker, twice).
    error, hint : str
        Why it failed, and what helps.
    notes : str
        What the stages had to tell.
    certainty : float or None
        Of the outline.
    doubts : str
        What speaks against the outline.
    reviewed : bool
        Whether it is as a person left it.
    seconds : float
    worker : str
    """

    field_id: str
    name: str = ""
    place: int = 0
    lat: float = float("nan")
    lon: float = float("nan")
    status: str = "done"
    error: str = ""
    hint: str = ""
    notes: str = ""
    certainty: float | None = None
    doubts: str = ""
    reviewed: bool = False
    seconds: float = 0.0
    worker: str = ""

    @property
    def planned(self) -> bool:
        """Whether there is a plan."""
        return self.status in ("done", "doubtful")


def outcome_words(plan: Plan) -> dict[str, Any]:
    """Status, certainty and doubts of a plan that was made."""
    doubts = plan.doubts
    quality = plan.field.quality
    trusted = quality is None or quality.trusted or plan.outline_edited
    return {
        "status": "done" if trusted and not doubts else "doubtful",
        "certainty": None if plan.outline_edited else plan.field.certainty,
        "doubts": "; ".join(doubts),
    }


def status_table(outcomes: Sequence[Outcome]) -> pa.Table:
    """The rows as Arrow, a point for each place."""
    import pyarrow as pa

    texts = ("field_id", "name", "status", "error", "hint", "notes", "doubts", "worker")
    columns: dict[str, Any] = {
        name: pa.array([getattr(one, name) or None for one in outcomes], pa.string())
        for name in texts
    }
    for name in ("lat", "lon", "certainty", "seconds"):
        values = [getattr(one, name) for one in outcomes]
        columns[name] = pa.array(values, pa.float64(), from_pandas=True)
    columns["place"] = pa.array([one.place for one in outcomes], pa.int64())
    columns["reviewed"] = pa.array([one.reviewed for one in outcomes], pa.bool_())
    order = (
        "field_id", "name", "status", "error", "hint", "notes", "certainty", "doubts",
        "reviewed", "place", "lat", "lon", "seconds", "worker",
    )  # fmt: skip
    places = np.array([[one.lon, one.lat] for one in outcomes]).reshape(-1, 2)
    columns["geometry"] = pa.array(shapely.to_wkb(shapely.points(places)), pa.binary())
    return pa.table({name: columns[name] for name in (*order, "geometry")})


def outcomes_of(table: pa.Table) -> list[dict[str, Any]]:
    """The rows of a status table as arguments of :class:`Outcome`."""
    rows = table.drop_columns("geometry").to_pylist()
    may_miss = ("certainty",)
    return [{k: v for k, v in row.items() if v is not None or k in may_miss} for row in rows]
