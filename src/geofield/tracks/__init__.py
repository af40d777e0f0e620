"""Stage 4: straight parallel tracks through a field, around every obstacle."""

from geofield.tracks.direction import find_baseline
from geofield.tracks.from_settings import plan_with_settings
from geofield.tracks.longest_edge import StraightRun, longest_edge
from geofield.tracks.planner import plan_tracks
from geofield.tracks.route import plan_route

__all__ = [
    "StraightRun",
    "find_baseline",
    "longest_edge",
    "plan_route",
    "plan_tracks",
    "plan_with_settings",
]
