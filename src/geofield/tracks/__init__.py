"""Stage 4: straight parallel tracks through a field, around every obstacle."""

from __future__ import annotations

from typing import TYPE_CHECKING

from geofield.late import late_names
from geofield.tracks.direction import find_baseline
from geofield.tracks.from_settings import plan_with_settings, route_with_settings
from geofield.tracks.longest_edge import StraightRun, longest_edge
from geofield.tracks.planner import plan_tracks

if TYPE_CHECKING:
    from geofield.tracks.route import plan_route

__all__ = [
    "StraightRun",
    "find_baseline",
    "longest_edge",
    "plan_route",
    "plan_tracks",
    "plan_with_settings",
    "route_with_settings",
]

# Most runs need no route.
__getattr__ = late_names(__name__, {"route": "plan_route"})
