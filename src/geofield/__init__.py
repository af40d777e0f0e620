"""geofield: from a point in a farm field and a picture of it to drivable geodata.

>>> import geofield as gf                                            # doctest: +SKIP
>>> plan = gf.plan_field("ortho.tif", lat=35.0754, lon=33.5311)      # doctest: +SKIP
>>> plan.write("out/", formats=["gpkg", "geojson"])                  # doctest: +SKIP

The names below load their modules when they are first used, so that importing the package
is quick.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from geofield.late import late_names
from geofield.wording import names_from

__version__ = "0.1.0"

if TYPE_CHECKING:
    from collections.abc import Mapping

    from geofield.errors import GeofieldError, GeofieldWarning
    from geofield.evaluation import evaluate
    from geofield.farm import Farm, plan_fields, read_farm
    from geofield.field import extract_field, prepare_field
    from geofield.grid import Grid
    from geofield.imagery import read_scene, write_scene
    from geofield.model import Field, Scene, Tracks
    from geofield.obstacles import detect_obstacles
    from geofield.pipeline import plan_field
    from geofield.plan import Plan, read_plan
    from geofield.settings import Settings, load_settings
    from geofield.simulate import simulate_field, simulate_fields
    from geofield.tracks import plan_route, plan_tracks

__all__ = [
    "Farm",
    "Field",
    "GeofieldError",
    "GeofieldWarning",
    "Grid",
    "Plan",
    "Scene",
    "Settings",
    "Tracks",
    "__version__",
    "detect_obstacles",
    "evaluate",
    "extract_field",
    "load_settings",
    "plan_field",
    "plan_fields",
    "plan_route",
    "plan_tracks",
    "prepare_field",
    "read_farm",
    "read_plan",
    "read_scene",
    "simulate_field",
    "simulate_fields",
    "write_scene",
]

__getattr__ = late_names(
    __name__,
    {
        "errors": "GeofieldError GeofieldWarning",
        "evaluation": "evaluate",
        "farm": "Farm plan_fields read_farm",
        "field": "extract_field prepare_field",
        "grid": "Grid",
        "imagery": "read_scene write_scene",
        "model": "Field Scene Tracks",
        "obstacles": "detect_obstacles",
        "pipeline": "plan_field",
        "plan": "Plan read_plan",
        "settings": "Settings load_settings",
        "simulate": "simulate_field simulate_fields",
        "tracks": "plan_route plan_tracks",
    },
)


def _options() -> Mapping[str, str]:
    from geofield.settings import NAMES

    return NAMES


# Settings are above what words errors, and slow to load.
names_from(_options)


def __dir__() -> list[str]:
    return sorted(__all__)
