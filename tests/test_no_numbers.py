"""What is no number is refused by its argument's name, wherever it comes in."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
import shapely
from affine import Affine
from click.testing import CliRunner
from pydantic import ValidationError

import geofield as gf
from geofield.cli.main import cli
from geofield.cli.options import stage_options
from geofield.errors import GeofieldError, TrackError
from geofield.farm.limits import Limits, Watch
from geofield.farm.marks import Marks
from geofield.farm.store import Store
from geofield.simulate import SimulatedField, SimulationSettings

SAMPLE = Path(__file__).parents[1] / "sample_data" / "field_1.tif"
POINT: dict[str, Any] = {"lat": 35.075373, "lon": 33.531142}
UTM = "EPSG:32636"


def at(made: SimulatedField) -> dict[str, Any]:
    return {"lat": made.lat, "lon": made.lon}


def study(made: SimulatedField, **options: Any) -> object:
    return gf.detect_obstacles(made.scene, made.field, **{"strategy": "single"} | options)


def tracks(made: SimulatedField) -> gf.Tracks:
    return gf.plan_tracks(made.field, spacing_m=30)


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
    "tolerance_px": lambda made, v: gf.extract_field(made.scene, **at(made), tolerance_px=v),
    "min_hole_m2": lambda made, v: gf.extract_field(made.scene, **at(made), min_hole_m2=v),
    "regions": lambda made, v: gf.extract_field(
        made.scene, **at(made), method="study", regions=[v]
    ),
    "sensitivity": lambda made, v: study(made, sensitivity=v),
    "min_share": lambda made, v: study(made, min_share=v),
    "threshold": lambda made, v: study(made, threshold=v),
    "skip": lambda made, v: gf.plan_route(tracks(made), pattern="skip", skip=v),
    "margin_m": lambda made, v: gf.plan_route(tracks(made), pattern="skip", margin_m=v),
    "turning_radius_m": lambda made, v: gf.plan_route(
        tracks(made), pattern="skip", turning_radius_m=v
    ),
    "column": lambda made, v: made.scene.crop(v, 0, 9, 9),
    "count": lambda made, v: list(gf.simulate_fields(v, seed=1)),
    "bootstrap": lambda made, v: gf.evaluate(made.obstacles, made.obstacles, bootstrap=v),
    "time_s": lambda made, v: Limits(time_s=v),
    "memory_mb": lambda made, v: Limits(memory_mb=v),
    "radius_m": lambda made, v: SimulationSettings(radius_m=(v, 9)),
}  # fmt: skip
#: Arguments for which None is a choice.
OPTIONAL = {
    "time_s",
    "memory_mb",
    "size_m",
    "size_px",
    "resolution_m",
    "min_confidence",
    "threshold",
    "turning_radius_m",
}
#: Arguments that are counted.
WHOLE = {
    "size_px", "zoom", "width_px", "height_px", "seed", "regions", "skip", "column", "count",
    "bootstrap",
}  # fmt: skip


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


@pytest.mark.parametrize("name", sorted(CALLS.keys() - {"transform"}))
@pytest.mark.parametrize(
    "value", [True, np.True_, np.array(True), float("nan"), np.float32("nan"), float("inf"), 3j]
)
def test_what_only_counts_as_a_number_is_none(
    simulated: SimulatedField, name: str, value: Any
) -> None:
    """A spacing of True was one metre, and a tolerance without end never came back."""
    with pytest.raises(GeofieldError) as error:
        CALLS[name](simulated, value)
    assert error.value.message.startswith(f"{name} is {value!r}; it must be a ")


@pytest.mark.parametrize("name", sorted(WHOLE))
def test_what_is_counted_has_no_fraction(simulated: SimulatedField, name: str) -> None:
    """Half a zoom was another scale, and half a pixel another place."""
    with pytest.raises(GeofieldError, match=rf"{name} is 2\.5; it must be a whole number"):
        CALLS[name](simulated, 2.5)


def test_whole_numbers_are_that_as_floats_too(simulated: SimulatedField) -> None:
    grid = gf.Grid(np.float64(3.0), 4.0, simulated.scene.grid.transform, UTM)  # type: ignore[arg-type]
    assert (grid, grid.shape) == (gf.Grid(3, 4, grid.transform, UTM), (4, 3))
    assert isinstance(grid.width_px, int)
    read = gf.read_scene(SAMPLE, **POINT, size_px=np.float32(40))  # type: ignore[arg-type]
    assert read.crop(np.int64(3), 2.0, 9, 9).grid.shape == (9, 9)  # type: ignore[arg-type]


@pytest.mark.parametrize("value", [True, np.True_, float("nan"), "x"])
def test_numbers_in_pairs_too(simulated: SimulatedField, value: Any) -> None:
    made = simulated
    calls: list[Callable[[], object]] = [
        lambda: gf.read_scene(SAMPLE, scaling=(value, 200)),
        lambda: gf.detect_obstacles(made.scene, made.field, radius_m=(value, 9)),
        lambda: study(made, strategy="t_range", threshold_range=(value, 0.2, 0.1)),
        lambda: study(made, grey_check=value),
        lambda: gf.plan_tracks(made.field, spacing_m=20, direction=value),
        lambda: gf.Grid(3, 3, (value, 0, 5e5, 0, -1, 39e5), UTM),  # type: ignore[arg-type]
        lambda: gf.Settings.model_validate({"obstacles": {"radius_m": [value, 9]}}),
        lambda: gf.Settings.model_validate({"tracks": {"through_lonlat": [value, 9]}}),
        lambda: gf.Settings.model_validate({"field": {"include": [[value, 9]]}}),
        lambda: gf.Settings.model_validate({"tracks": {"spacing_m": value}}),
    ]
    for call in calls:
        with pytest.raises((GeofieldError, ValidationError)):
            call()


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


def options() -> list[tuple[list[str], click.Option]]:
    """All options of all commands that take numbers with a point."""
    context = click.Context(cli)
    waiting = [([name], cli.get_command(context, name)) for name in cli.list_commands(context)]
    found: list[tuple[list[str], click.Option]] = []
    for path, command in waiting:
        if isinstance(command, click.Group):
            waiting += [([*path, name], each) for name, each in command.commands.items()]
        for each in command.params if command is not None else ():
            kinds = each.type.types if isinstance(each.type, click.Tuple) else [each.type]
            if isinstance(each, click.Option) and any(
                isinstance(kind, click.types.FloatParamType) for kind in kinds
            ):
                found.append((path, each))
    return found


@click.command()
@stage_options("imagery", "field", "obstacles", "tracks", "export")
def staged(settings: gf.Settings, **_: Any) -> None:
    """A command of all settings, and of nothing else."""


@pytest.mark.parametrize("value", ["nan", "inf"])
def test_the_option_that_was_typed_is_named(value: str) -> None:
    """They named an argument of Python, or a table of the settings file."""
    every = options()
    assert {"--size-m", "--distance", "--time-limit", "--spacing", "--radius", "--lat"} <= {
        each.opts[0] for _, each in every
    }
    for path, each in every:
        is_setting = "__" in str(each.name)
        words = [each.opts[0], *[value] * each.nargs]
        done = CliRunner().invoke(
            staged if is_setting else cli, words if is_setting else [*path, *words]
        )
        error = done.exception
        told = error.message if isinstance(error, GeofieldError) else done.output
        assert each.opts[0] in told, (path, told)


def test_settings_that_need_another_option_name_it() -> None:
    error = CliRunner().invoke(staged, ["--overlap", "3"]).exception
    assert isinstance(error, GeofieldError)
    assert "(--width)" in error.message
    error = (
        CliRunner().invoke(staged, ["--include-lonlat", "nan", "--radius", "3", "2e9"]).exception
    )
    assert isinstance(error, GeofieldError)
    assert "--include-lonlat: write a position as LON,LAT" in error.message
    assert "--radius: input should be less than or equal to 1000 (given: 2" in error.message
    assert "Did you mean" not in error.message


def test_a_limit_of_all_times_is_none() -> None:
    """The operating system refused such an alarm, in a traceback."""
    with Watch(Limits(time_s=1e30), Marks(Store("."), 0)).watching() as watch:
        watch._alarm(1e30)
        assert 0 < signal.getitimer(signal.ITIMER_REAL)[0] < 1e9


def test_a_headland_without_an_area_is_none(simulated: SimulatedField) -> None:
    with pytest.raises(TrackError, match="A headland of 1e-30 m is too narrow to be one"):
        gf.plan_tracks(simulated.field, spacing_m=30, headland_m=1e-30)
