"""Stage 4: straight parallel tracks through a field, around every obstacle."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from geofield.tracks.direction import find_baseline
from geofield.tracks.from_settings import plan_with_settings
from geofield.tracks.longest_edge import StraightRun, longest_edge
from geofield.tracks.planner import plan_tracks

if TYPE_CHECKING:
    from geofield.tracks.route import plan_route

#: Names whose modules load when they are first used: most runs need none of them.
_LATE = {
    "plan_route": "geofield.tracks.route",
}

__all__ = [
    "StraightRun",
    "find_baseline",
    "longest_edge",
    "plan_route",
    "plan_tracks",
    "plan_with_settings",
]


def __getattr__(name: str) -> Any:
    if name not in _LATE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_LATE[name]), name)
    globals()[name] = value
    return value
