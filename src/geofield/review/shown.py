"""A session as the page sees it."""

from __future__ import annotations

from typing import Any

from geofield.plan import Plan
from geofield.review.session import Session
from geofield.settings import Settings
from geofield.web.view import obstacles_view, outline_view, rings_of, tracks_view


def state_of(session: Session) -> dict[str, Any]:
    """All that the page shows of a session and that an edit may change."""
    plan = session.plan
    return {
        **tracks_of(plan, session.step.notes),
        "route_waits": session.step.waits,
        "name": plan.field.name,
        "field_id": plan.field.field_id,
        "crs": plan.field.crs.name,
        "field": field_of(plan),
        "doubts": list(plan.evidence.obstacle_doubts),
        "obstacles": obstacles_view(plan.obstacles, plan.tracks),
        "settings": (plan.settings or Settings()).tracks.model_dump(mode="json"),
        "detected_from": _detected_from(plan),
        "edited": session.edited,
        "can_undo": session.can_undo,
        "can_redo": session.can_redo,
    }


def tracks_of(plan: Plan, notes: tuple[str, ...] = ()) -> dict[str, Any]:
    """Tracks and figures: what changes while a person drags."""
    return tracks_view(plan.tracks, plan.field.area_ha, notes)


def _detected_from(plan: Plan) -> float | None:
    """The confidence from which what was found is driven around without a person's word.

    None where nothing was searched.
    """
    found = plan.evidence.detection
    if not found:
        return None
    # The study's own methods know nothing merely possible; their thresholds are of other things.
    return float(found["threshold"]) if "possible_from" in found else 0.0


def field_of(plan: Plan) -> dict[str, Any]:
    """The outline; of a person's own nothing is in doubt but where the picture ends."""
    field = plan.field
    method = "drawn" if plan.outline_edited else field.method
    shown = outline_view(
        field.polygon,
        method=method,
        certainty=None if plan.outline_edited else field.certainty,
        doubts=plan.doubts,
        frame=plan.frame_lines,
    )
    others = [
        {"rings": rings_of(one.polygon), "certainty": round(one.certainty, 3)}
        for one in field.alternatives
    ]
    return {**shown, "alternatives": others}
