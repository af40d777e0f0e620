"""Field, obstacles and tracks as a page sees them: plain JSON values.

Coordinates are in the metric CRS of the plan, rounded to millimetres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from pyproj import CRS

from geofield.crs import LONLAT, transformer

if TYPE_CHECKING:
    import geopandas as gpd

    from geofield.model.tracks import Tracks

_DIGITS = 3


def tracks_view(tracks: Tracks | None, area_ha: float, notes: Sequence[str] = ()) -> dict[str, Any]:
    """Tracks, gaps, turns and figures: what changes while a person edits.

    Parameters
    ----------
    tracks : Tracks or None
    area_ha : float
        Of the field.
    notes : sequence of str
        Told beside the tracks' own.
    """
    if tracks is None:
        names = ("tracks", "gaps", "headland", "route", "drive")
        return {**{name: [] for name in names}, "figures": {}, "notes": list(notes)}
    numbers = tracks.segments["track_no"].to_numpy(dtype=np.int64).tolist()
    gaps, around, turns = tracks.gaps, tracks.headland_tracks, tracks.turns
    return {
        "tracks": list(zip(numbers, lines_of(tracks.segments.geometry), strict=True)),
        "gaps": [
            (line, "" if cause is None else str(cause))
            for line, cause in zip(lines_of(gaps.geometry), gaps["cause"], strict=True)
        ],
        "headland": [] if around is None else lines_of(around.geometry),
        "route": []
        if turns is None
        else [
            {"line": line, "fits": fits != "no"}
            for line, fits in zip(lines_of(turns.geometry), turns["fits"], strict=True)
        ],
        "drive": [] if tracks.route is None else _drive(tracks.route),
        "figures": _figures(tracks, area_ha),
        "notes": [*tracks.notes, *notes],
    }


def outline_view(
    polygon: shapely.Polygon,
    *,
    method: str,
    certainty: float | None,
    doubts: Sequence[str],
    frame: Sequence[shapely.LineString],
) -> dict[str, Any]:
    """The outline, its doubts in words, and where it is the picture's frame."""
    return {
        "rings": rings_of(polygon),
        "method": method,
        "certainty": _number(certainty),
        "doubts": list(doubts),
        "frame": lines_of(frame),
    }


def rings_of(polygon: shapely.Polygon) -> list[list[list[float]]]:
    """The rings of a polygon, the outer one first, without their last place, which is the first."""
    return [ring[:-1] for ring in lines_of([polygon.exterior, *polygon.interiors])]


def obstacles_view(
    obstacles: gpd.GeoDataFrame | None, tracks: Tracks | None
) -> list[dict[str, Any]]:
    """Every obstacle with its shape, what is known of it and what it costs."""
    if obstacles is None:
        return []
    lost = {} if tracks is None else {one.obstacle_no: one.length_m for one in tracks.losses}
    centres = np.round(
        shapely.get_coordinates(shapely.centroid(obstacles.geometry.to_numpy())), _DIGITS
    ).tolist()
    rings, of_row = shapely.get_rings(obstacles.geometry.to_numpy(), return_index=True)
    rows: list[dict[str, Any]] = [
        {
            "no": int(row.obstacle_no),
            "kind": row.kind,
            "status": row.status,
            "confidence": _number(row.confidence),
            "radius_m": _number(row.radius_m),
            "buffer_m": _number(row.buffer_m),
            "lost_m": _number(lost.get(int(row.obstacle_no))),
            "centre": centre,
            "rings": [],
        }
        for row, centre in zip(obstacles.itertuples(), centres, strict=True)
    ]
    for at, ring in zip(of_row.tolist(), lines_of(rings), strict=True):
        rows[at]["rings"].append(ring[:-1])
    return rows


def place_table(crs: CRS, bounds: tuple[float, float, float, float]) -> dict[str, Any]:
    """Longitude and latitude on 3 x 3 places of an extent, to interpolate between.

    Over some kilometres a parabola in each direction errs by far less than a millimetre.
    """
    x = np.linspace(bounds[0], bounds[2], 3)
    y = np.linspace(bounds[1], bounds[3], 3)
    xx, yy = np.meshgrid(x, y)
    lon, lat = transformer(crs, LONLAT).transform(xx, yy)
    # A parabola through 179.9 and -179.9 leads nowhere: they go on beyond 180.
    lon = lon[0, 0] + (lon - lon[0, 0] + 180.0) % 360.0 - 180.0
    return {"x": x.tolist(), "y": y.tolist(), "lon": lon.tolist(), "lat": lat.tolist()}


def margin_bounds(polygon: shapely.Polygon) -> tuple[float, float, float, float]:
    """What to show of a field without a picture: its extent and a tenth around it."""
    left, bottom, right, top = polygon.bounds
    margin = 0.1 * max(right - left, top - bottom)
    return left - margin, bottom - margin, right + margin, top + margin


def _drive(route: gpd.GeoDataFrame) -> list[list[float]]:
    """Where and which way segments are driven, in order: x, y and the turn from east, radians."""
    work = route[route["kind"] == "work"].geometry.to_numpy()
    # A person may have bent one: its middle lies on it.
    behind, middle, before = (
        shapely.get_coordinates(shapely.line_interpolate_point(work, share, normalized=True))
        for share in (0.499, 0.5, 0.501)
    )
    ahead, middle = before - behind, np.round(middle, _DIGITS)
    turned = np.round(np.arctan2(ahead[:, 1], ahead[:, 0]), 4)
    arrows: list[list[float]] = np.column_stack([middle, turned]).tolist()
    return arrows


def _figures(tracks: Tracks, area_ha: float) -> dict[str, Any]:
    found, turns = tracks.statistics, tracks.turns
    return {
        "area_ha": _number(area_ha),
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


def lines_of(lines: Any) -> list[list[list[float]]]:
    """The coordinates of each line: lists of x, y."""
    shapes = np.asarray(lines, dtype=object)
    xy, row = shapely.get_coordinates(shapes, return_index=True)
    rounded = np.round(xy, _DIGITS).tolist()
    ends = np.searchsorted(row, np.arange(len(shapes) + 1))
    return [rounded[start:end] for start, end in pairwise(ends)]


def _number(value: Any) -> float | None:
    if value is None:
        return None
    number = float(value)
    return round(number, 4) if math.isfinite(number) else None
