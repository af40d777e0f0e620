"""What is no number is refused by its argument's name, wherever it comes in."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from affine import Affine

import geofield as gf
from geofield.errors import GeofieldError
from geofield.simulate import SimulatedField, SimulationSettings

SAMPLE = Path(__file__).parents[1] / "sample_data" / "field_1.tif"
POINT: dict[str, Any] = {"lat": 35.075373, "lon": 33.531142}
UTM = "EPSG:32636"

CALLS: dict[str, Callable[[SimulatedField, Any], object]] = {
    "size_m": lambda made, v: gf.read_scene(SAMPLE, **POINT, size_m=v),
    "size_px": lambda made, v: gf.read_scene(SAMPLE, **POINT, size_px=v),
    "resolution_m": lambda made, v: gf.read_scene(SAMPLE, **POINT, resolution_m=v),
    "lat": lambda made, v: gf.extract_field(made.scene, lat=v, lon=made.lon),
    "lon": lambda made, v: gf.prepare_field(made.scene, lat=made.lat, lon=v),
    "buffer_m": lambda made, v: gf.detect_obstacles(made.scene, made.field, buffer_m=v),
    "cost_missed": lambda made, v: gf.detect_obstacles(made.scene, made.field, cost_missed=v),
    "min_confidence": lambda made, v: gf.detect_obstacles(made.scene, min_confidence=v),
    "spacing_m": lambda made, v: gf.plan_tracks(made.field.polygon, crs=UTM, spacing_m=v),
    "distance_m": lambda made, v: gf.evaluate(made.obstacles, made.obstacles, distance_m=v),
    "zoom": lambda made, v: gf.Grid.web_mercator(**POINT, zoom=v),
    "width_px": lambda made, v: gf.Grid(v, 3, made.scene.grid.transform, UTM),
    "seed": lambda made, v: gf.simulate_field(v),
    "height_px": lambda made, v: SimulationSettings(height_px=v),
    "transform": lambda made, v: gf.Grid(3, 3, v, UTM),
}  # fmt: skip
#: Arguments for which None is a choice.
OPTIONAL = {"size_m", "size_px", "resolution_m", "min_confidence"}


CASES = [
    (name, value)
    for name in CALLS
    for value in ("20", "x", None, [4])
    if value is not None or name not in OPTIONAL
]


@pytest.mark.parametrize(("name", "value"), CASES)
def test_its_name_and_what_is_wanted_are_told(
    simulated: SimulatedField, name: str, value: Any
) -> None:
    with pytest.raises(GeofieldError) as error:
        CALLS[name](simulated, value)
    assert error.value.message.startswith(f"{name} is {value!r}; it must be ")
    if value == "20" and name not in ("transform", "spacing_m"):
        assert error.value.hint == f"Write {name}=20."


def test_numbers_of_numpy_are_numbers() -> None:
    sizes: list[Any] = [np.array(100.0), np.int64(100), np.float32(100)]
    point: dict[str, Any] = {name: np.float32(value) for name, value in POINT.items()}
    whole = gf.read_scene(SAMPLE, **POINT, size_m=100)
    for size in sizes:
        assert gf.read_scene(SAMPLE, **point, size_m=size).grid.shape == whole.grid.shape


def test_fields_and_grids_are_made_with_the_name_of_a_crs() -> None:
    """Type checkers read this, too."""
    shape = shapely.box(500000, 3900000, 500200, 3900100)
    assert gf.Field(shape, "EPSG:32636").crs.to_epsg() == 32636
    assert gf.Grid(3, 3, Affine(1, 0, 500000, 0, -1, 3900000), UTM).crs.to_epsg() == 32636
