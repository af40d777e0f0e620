"""Tracks at once for another program: a question in a line of JSON, the answer in another.

A geographic information system whose user edits a plan's layers asks for the tracks after each
edit. Python and its libraries stay loaded between the questions, and the plan as it lies in its
file is read once.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd
import shapely

from geofield import schema
from geofield.errors import GeofieldError
from geofield.plan import read_plan
from geofield.review.session import Step, planned
from geofield.staging import log_of
from geofield.web.view import lines_of

if TYPE_CHECKING:
    import geopandas as gpd

    from geofield.plan import Plan


class LivePlans:
    """Answers questions about plans; keeps the one asked about last."""

    def __init__(self) -> None:
        self._key: object = None
        self._plan: Plan | None = None

    def answer(self, question: Mapping[str, Any]) -> dict[str, Any]:
        """The answer to a question, plain JSON values; an error is an answer, too.

        Parameters
        ----------
        question : mapping
            ``do`` is ``plan`` (the tracks for ``obstacles`` and ``outline`` as they are in the
            editor, without a route, which takes seconds where obstacles are many) or ``write``
            (plan what lies in the file, its route, too, and write it); ``file`` is the
            GeoPackage. ``obstacles`` are rows with the layer's columns and ``wkb``; ``outline``
            is the WKB of the field; both in the plan's metric CRS, hexadecimal.
        """
        try:
            if question.get("do") not in ("plan", "write"):
                raise GeofieldError(f"There is no question {question.get('do')!r}.")
            path = Path(question["file"])
            if question["do"] == "write":
                return self._written(path)
            edited = _edited(self._read(path), question)
            return _told(planned(edited, None, with_route=False))
        except GeofieldError as error:
            return {"error": {"message": error.message, "hint": error.hint or ""}}
        except (KeyError, ValueError, TypeError, shapely.errors.GEOSException) as error:
            return {"error": {"message": f"The question cannot be understood: {error}", "hint": ""}}

    def _read(self, path: Path) -> Plan:
        key = (path, _version(path))
        if self._plan is None or key != self._key:
            self._plan, self._key = read_plan(path), key
        return self._plan

    def _written(self, path: Path) -> dict[str, Any]:
        from geofield.plan_files import save_plan

        step = planned(self._read(path), None)
        save_plan(step.plan, path, read_from=path)
        return _told(step)


def _version(path: Path) -> list[tuple[int, int]]:
    """Times and sizes that tell whether a plan was written since, its write-ahead log included."""
    try:
        facts = [path.stat()]
    except OSError as error:
        raise GeofieldError(f"{path} cannot be read: {error.strerror}.") from None
    with suppress(FileNotFoundError):
        facts.append(log_of(path).stat())
    return [(each.st_mtime_ns, each.st_size) for each in facts]


def _edited(plan: Plan, question: Mapping[str, Any]) -> Plan:
    """The plan with the rows and the outline of an editor."""
    if "obstacles" in question:
        plan = replace(plan, obstacles=_obstacles(plan, question["obstacles"]))
    if "outline" in question:
        outline = shapely.from_wkb(question["outline"])
        parts = shapely.get_parts(outline)
        if len(parts) != 1 or not isinstance(parts[0], shapely.Polygon):
            raise GeofieldError("The outline is not one polygon.")
        if not shapely.equals_exact(parts[0], plan.field.polygon, tolerance=1e-9):
            plan = replace(plan, field=replace(plan.field, polygon=parts[0]))
    return plan


def _obstacles(plan: Plan, rows: list[Mapping[str, Any]]) -> gpd.GeoDataFrame:
    """The rows of the layer as the file would give them, had they been saved."""
    import geopandas as gpd

    names = [column.name for column in schema.OBSTACLES.columns]
    columns = {name: [row.get(name) for row in rows] for name in names}
    shapes = shapely.from_wkb([row["wkb"] for row in rows])
    frame = gpd.GeoDataFrame(pd.DataFrame(columns), geometry=shapes, crs=plan.field.crs)
    return schema.conform(schema.OBSTACLES, frame)


def _told(step: Step) -> dict[str, Any]:
    tracks = step.plan.tracks
    if tracks is None:
        raise GeofieldError("There are no tracks.")
    around = tracks.headland_tracks
    return {
        "segments": lines_of(tracks.segments.geometry),
        "gaps": lines_of(tracks.gaps.geometry),
        "headland_tracks": [] if around is None else lines_of(around.geometry),
        "figures": {
            "tracks": len(tracks.lines),
            "segments": len(tracks.segments),
            "length_m": float(tracks.segments["length_m"].sum()),
        },
        "notes": [*step.notes, *tracks.notes],
        "doubts": list(step.plan.evidence.obstacle_doubts),
    }
