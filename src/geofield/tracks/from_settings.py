"""Tracks, and a route where one is wanted, from the settings of stage 4."""

from __future__ import annotations

from typing import Any

from pyproj import CRS
from shapely import Polygon

from geofield.crs import LONLAT, transformer
from geofield.grid import Grid
from geofield.model.tracks import Tracks
from geofield.settings import TrackSettings
from geofield.tracks.outline import metric
from geofield.tracks.planner import plan_tracks


def plan_with_settings(
    polygon: Polygon,
    obstacles: Any,
    settings: TrackSettings,
    *,
    crs: Any,
    grid: Grid | None = None,
) -> Tracks:
    """Plan tracks and, when `settings.route` names a pattern, the route through them.

    Parameters
    ----------
    polygon, obstacles, crs, grid
        As for `plan_tracks`.
    settings : TrackSettings
        Places in it are longitude and latitude.
    """
    metric_crs = metric(crs)
    direction: Any = settings.direction
    if settings.ab_lonlat is not None:
        a_b = settings.ab_lonlat
        direction = [_place(a_b[:2], metric_crs), _place(a_b[2:], metric_crs)]
    through = settings.through_lonlat
    tracks = plan_tracks(
        polygon,
        obstacles,
        crs=metric_crs,
        spacing_m=settings.spacing_m,
        direction=direction,
        offset_m=settings.offset_m,
        through=None if through is None else _place(through, metric_crs),
        last_strip=settings.last_strip,
        headland_m=settings.headland_m,
        headland_holes=settings.headland_holes,
        min_segment_m=settings.min_segment_m,
        clearance_m=settings.clearance_m,
        step_m=settings.step_m,
        straight_tolerance_m=settings.straight_tolerance_m,
        grid=grid,
    )
    if settings.route == "none":
        return tracks
    start = settings.start_lonlat
    from geofield.tracks.route import plan_route

    return plan_route(
        tracks,
        pattern=settings.route,
        skip=settings.skip,
        turning_radius_m=settings.turning_radius_m,
        curve=settings.curve,
        margin_m=settings.margin_m,
        start=None if start is None else _place(start, metric_crs),
    )


def _place(lonlat: tuple[float, ...], crs: CRS) -> tuple[float, float]:
    x, y = transformer(LONLAT, crs).transform(lonlat[0], lonlat[1])
    return float(x), float(y)
