"""Tracks, and a route where one is wanted, from the settings of stage 4."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from pyproj import CRS
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from geofield.crs import LONLAT, transformer
from geofield.errors import TrackError, TrackWarning
from geofield.grid import Grid
from geofield.model.obstacles import active
from geofield.model.rows import replaced
from geofield.model.track_edits import TrackEdits
from geofield.model.tracks import Tracks
from geofield.notes import warn
from geofield.settings import TrackSettings
from geofield.tracks.outline import NEAR_M, metric, near, refuse_wide_turns
from geofield.tracks.planner import plan_tracks

#: Settings that are arguments of the same name.
_OF_TRACKS = (
    "spacing_m", "width_m", "offset_m", "last_strip", "headland_m", "headland_holes",
    "min_segment_m", "clearance_m", "step_m", "straight_tolerance_m",
)  # fmt: skip
_OF_ROUTE = ("skip", "turning_radius_m", "curve", "margin_m")
#: So far into an obstacle is no fault, metres.
_HAIR_M = 0.05


def plan_with_settings(
    polygon: Polygon,
    obstacles: Any,
    settings: TrackSettings,
    *,
    crs: Any,
    grid: Grid | None = None,
    outside: Sequence[LineString] | None = None,
    edits: TrackEdits | None = None,
) -> Tracks:
    """Plan tracks; the route through them is :func:`route_with_settings`.

    Parameters
    ----------
    polygon, obstacles, crs, grid, outside, edits
        As for `plan_tracks`.
    settings : TrackSettings
        Places in it are longitude and latitude.
    """
    metric_crs = metric(crs)
    _refuse_too_wide(polygon, settings.spacing_m)

    def place(lonlat: tuple[float, ...] | None, what: str) -> tuple[float, float] | None:
        return None if lonlat is None else _place(lonlat, metric_crs, polygon, what)

    direction: Any = settings.direction
    if settings.ab_lonlat is not None:
        a_b = settings.ab_lonlat
        direction = [place(end, "A-B line") for end in (a_b[:2], a_b[2:])]
    tracks = plan_tracks(
        polygon,
        obstacles,
        crs=metric_crs,
        direction=direction,
        through=place(settings.through_lonlat, "place to pass through"),
        grid=grid,
        outside=outside,
        edits=edits,
        **{name: getattr(settings, name) for name in _OF_TRACKS},
    )
    if settings.route != "none" and settings.turning_radius_m is not None:
        # Where the route is planned later, too, nobody is told of it later.
        bounds_m = np.array(polygon.bounds) / tracks.ground_scale
        refuse_wide_turns(bounds_m, settings.turning_radius_m, settings.margin_m)
    told = _reaching_in(settings, obstacles)
    for note in told:
        warn(note, TrackWarning)
    return replaced(tracks, notes=(*tracks.notes, *told))


def route_with_settings(tracks: Tracks, settings: TrackSettings, polygon: Polygon) -> Tracks:
    """The tracks in a field with a route, when `settings.route` names a pattern."""
    if settings.route == "none":
        return tracks
    from geofield.tracks.route import plan_route

    start = settings.start_lonlat
    return plan_route(
        tracks,
        pattern=settings.route,
        **{name: getattr(settings, name) for name in _OF_ROUTE},
        start=None if start is None else _place(start, tracks.crs, polygon, "start"),
    )


def _refuse_too_wide(polygon: BaseGeometry, spacing_m: float) -> None:
    """A spacing beyond the field's whole length is a slip of the keyboard, not a plan."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(polygon))
    longest_m = float(np.hypot(*np.diff(corners, axis=0).T).max())
    if spacing_m > longest_m:
        raise TrackError(
            f"A spacing of {spacing_m:g} m is larger than the field ({longest_m:.0f} m long).",
            hint="Give the distance between two tracks in metres, for instance --spacing 3.",
        )


def _reaching_in(settings: TrackSettings, obstacles: Any) -> tuple[str, ...]:
    """That a machine's side is in obstacles which its middle passes, where it is."""
    if not settings.width_m or "buffer_m" not in getattr(obstacles, "columns", ()):
        return ()
    margin_m = np.nan_to_num(active(obstacles)["buffer_m"].to_numpy(dtype=np.float64))
    half_m = settings.width_m / 2.0
    into_m = half_m - settings.clearance_m - margin_m.min(initial=np.inf)
    if into_m < _HAIR_M:
        return ()
    return (
        f"Beside its track a machine of {settings.width_m:g} m reaches {into_m:.1f} m into "
        f"obstacles: --clearance {half_m:g} keeps it out.",
    )


def _place(
    lonlat: tuple[float, ...], crs: CRS, polygon: BaseGeometry, what: str
) -> tuple[float, float]:
    """A place in the CRS.

    Raises
    ------
    TrackError
        When it is far from the field, as where latitude and longitude are swapped.
    """
    project, (lon, lat) = transformer(LONLAT, crs), lonlat[:2]
    x, y = project.transform(lon, lat)
    if near(polygon, x, y):
        return float(x), float(y)
    swapped = abs(lon) <= 90 and near(polygon, *project.transform(lat, lon))
    raise TrackError(
        f"The {what} at longitude {lon}, latitude {lat} is far from the field"
        + ("; with the two swapped it is there." if swapped else "."),
        hint=f"Longitude comes first: {lat} {lon}."
        if swapped
        else f"It may be {NEAR_M / 1000:.0f} km away. Longitude comes first, both in degrees.",
    )
