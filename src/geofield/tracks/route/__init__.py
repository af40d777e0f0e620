"""The order of work: routes through all segments, ways around obstacles, turns."""

from geofield.tracks.route.planner import plan_route

__all__ = ["plan_route"]
