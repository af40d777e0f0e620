"""A plan as the page sees it: plain JSON values, coordinates in the plan's metric CRS."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from geofield.crs import LONLAT, transformer
from geofield.tracks.direction import picture_frame

if TYPE_CHECKING:
    import geopandas as gpd

    from geofield.plan import Plan
    from geofield.review.session import Session

#: An outline this near to the picture's frame goes on outside, pixels.
_FRAME_PX = 1.5
_DIGITS = 3


def state_of(session: Session) -> dict[str, Any]:
    """All that the page shows of a session."""
    plan = session.plan
    return {
        **tracks_of(session.step.plan, session.step.notes),
        "name": plan.field.name,
        "field_id": plan.field.field_id,
        "crs": plan.field.crs.name,
        "field": field_of(plan),
        "obstacles": obstacles_of(plan),
        "settings": _track_settings(plan),
        "edited": session.edited,
        "can_undo": session.can_undo,
        "can_redo": session.can_redo,
    }


def tracks_of(plan: Plan, notes: tuple[str, ...] = ()) -> dict[str, Any]:
    """Tracks, gaps, route and figures: what changes while a person drags."""
    tracks = plan.tracks
    if tracks is None:
        return {"tracks": [], "gaps": [], "headland": [], "route": [], "figures": {}, "notes": []}
    numbers = tracks.segments["track_no"].to_numpy(dtype=np.int64)
    ends = _ends(tracks.segments)
    gaps = tracks.gaps
    around = tracks.headland_tracks
    return {
        "tracks": [[int(no), *end] for no, end in zip(numbers, ends, strict=True)],
        "gaps": [
            [*end, "" if cause is None else str(cause)]
            for end, cause in zip(_ends(gaps), gaps["cause"], strict=True)
        ],
        "headland": [] if around is None else [_xy(line) for line in around.geometry],
        "route": [] if tracks.turns is None else _turns(tracks.turns),
        "figures": _figures(plan),
        "notes": [*tracks.notes, *notes],
    }


def field_of(plan: Plan) -> dict[str, Any]:
    """The outline, its doubts in words, and where it runs along the picture's frame."""
    field = plan.field
    rings = [field.polygon.exterior, *field.polygon.interiors]
    drawn = plan.outline_edited or field.method in ("drawn", "boundary")
    quality = None if drawn else field.quality
    return {
        "rings": [_xy(ring)[:-1] for ring in rings],
        "method": "drawn" if drawn else field.method,
        "certainty": None if quality is None else round(float(quality.score), 3),
        "doubts": [] if quality is None else list(quality.reasons),
        "frame": _along_frame(plan),
    }


def obstacles_of(plan: Plan) -> list[dict[str, Any]]:
    """Every obstacle with its shape, what is known of it and what it costs."""
    if plan.obstacles is None:
        return []
    lost = (
        {}
        if plan.tracks is None
        else {loss.obstacle_no: loss.length_m for loss in plan.tracks.statistics.losses}
    )
    rows = []
    for row in plan.obstacles.itertuples():
        number, centre = int(row.obstacle_no), row.geometry.centroid
        rows.append(
            {
                "no": number,
                "kind": row.kind,
                "status": row.status,
                "confidence": _number(row.confidence),
                "radius_m": _number(row.radius_m),
                "buffer_m": _number(row.buffer_m),
                "lost_m": _number(lost.get(number)),
                "centre": [round(centre.x, _DIGITS), round(centre.y, _DIGITS)],
                "rings": [
                    _xy(ring)[:-1]
                    for part in shapely.get_parts(row.geometry)
                    for ring in [part.exterior, *part.interiors]
                ],
            }
        )
    return rows


def place_table(plan: Plan, bounds: tuple[float, float, float, float]) -> dict[str, Any]:
    """Longitude and latitude on 3 x 3 places of an extent, to interpolate between.

    Over some kilometres a parabola in each direction errs by far less than a millimetre.
    """
    x = np.linspace(bounds[0], bounds[2], 3)
    y = np.linspace(bounds[1], bounds[3], 3)
    xx, yy = np.meshgrid(x, y)
    lon, lat = transformer(plan.field.crs, LONLAT).transform(xx, yy)
    return {"x": x.tolist(), "y": y.tolist(), "lon": lon.tolist(), "lat": lat.tolist()}


def _figures(plan: Plan) -> dict[str, Any]:
    tracks = plan.tracks
    if tracks is None:
        return {}
    found = tracks.statistics
    turns = tracks.turns
    return {
        "area_ha": _number(plan.field.area_ha),
        "tracks": found.track_count,
        "segments": found.segment_count,
        "length_m": _number(found.length_m),
        "coverage_percent": _number(found.coverage_percent),
        "overlap_percent": _number(found.overlap_percent),
        "heading_deg": _number(tracks.heading_deg),
        "lost_m": _number(sum(loss.length_m for loss in found.losses)),
        "turns": None if turns is None else len(turns),
        "turns_that_do_not_fit": None if turns is None else int((turns["fits"] == "no").sum()),
    }


def _track_settings(plan: Plan) -> dict[str, Any]:
    from geofield.settings import Settings

    return (plan.settings or Settings()).tracks.model_dump(mode="json")


def _along_frame(plan: Plan) -> list[list[list[float]]]:
    """The stretches of the outline where the field goes on outside the picture."""
    if plan.grid is None:
        return []
    frame = picture_frame(plan.grid, plan.field.crs).exterior
    near = shapely.buffer(frame, _FRAME_PX * plan.grid.ground_resolution_m)
    along = shapely.intersection(plan.field.polygon.exterior, near)
    lines = shapely.get_parts(shapely.line_merge(along))
    return [_xy(line) for line in lines if shapely.length(line) > 2 * _FRAME_PX]


def _turns(turns: gpd.GeoDataFrame) -> list[dict[str, Any]]:
    return [
        {"line": _xy(line), "fits": fits != "no"}
        for line, fits in zip(turns.geometry, turns["fits"], strict=True)
    ]


def _ends(lines: gpd.GeoDataFrame) -> list[list[float]]:
    """First and last place of each line: x0, y0, x1, y1."""
    xy = shapely.get_coordinates(lines.geometry.to_numpy()).reshape(-1, 4)
    rounded: list[list[float]] = np.round(xy, _DIGITS).tolist()
    return rounded


def _xy(line: Any) -> list[list[float]]:
    coordinates: list[list[float]] = np.round(shapely.get_coordinates(line), _DIGITS).tolist()
    return coordinates


def _number(value: Any) -> float | None:
    if value is None:
        return None
    number = float(value)
    return round(number, 4) if math.isfinite(number) else None
