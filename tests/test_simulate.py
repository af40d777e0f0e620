"""Simulated fields: the same from a seed, and true to their truth."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
import rasterio
import shapely

from geofield.errors import SettingsError
from geofield.simulate import SimulationSettings, simulate_field, simulate_fields

SMALL = SimulationSettings(width_px=256, height_px=256, obstacles=6)


def test_the_same_seed_gives_the_same_picture_and_truth() -> None:
    one, two = simulate_field(5, SMALL), simulate_field(5, SMALL)
    assert np.array_equal(one.scene.bands, two.scene.bands)
    assert one.field.polygon.equals(two.field.polygon)
    assert one.obstacles.equals(two.obstacles)
    other = simulate_field(6, SMALL)
    assert not np.array_equal(one.scene.bands, other.scene.bands)


@pytest.mark.parametrize("seed", range(8))
def test_the_truth_lies_where_the_picture_shows_it(seed: int) -> None:
    made = simulate_field(seed, SMALL)
    assert shapely.is_valid(made.field.polygon)
    assert len(made.obstacles) == 6
    assert made.field.polygon.contains(shapely.union_all(made.obstacles.geometry.to_numpy()))
    # Crowns are dark against the ground around them, wherever the truth says a crown is.
    grey = made.scene.grey
    rows, columns = np.mgrid[: grey.shape[0], : grey.shape[1]] + 0.5
    for x, y, radius in made.obstacles[["x_px", "y_px", "radius_px"]].to_numpy():
        distance = np.hypot(columns - x, rows - y)
        crown = grey[distance < 0.8 * radius].mean()
        ring = np.median(grey[(distance > radius + 2) & (distance < radius + 8)])
        assert crown < ring - 15
    # The point handed out with it lies in the field, on no crown.
    x, y = made.scene.grid.from_lonlat(made.lon, made.lat)
    assert made.field.polygon_px(made.scene.grid).contains(shapely.Point(x, y))
    assert min(np.hypot(made.obstacles["x_px"] - x, made.obstacles["y_px"] - y)) > 5


def test_a_crown_is_held_against_those_around_it_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    compared = Mock(wraps=math.hypot)
    monkeypatch.setattr(math, "hypot", compared)
    made = simulate_field(4, SimulationSettings(width_px=512, height_px=512, obstacles=200))
    assert len(made.obstacles) == 200
    assert compared.call_count < 10_000  # 63 847 with all others


def test_equal_brightness_means_equal_grey_levels_and_other_colours() -> None:
    settings = SimulationSettings(
        width_px=256, height_px=256, obstacles=0, equal_brightness=True, climate="temperate"
    )
    made = simulate_field(3, settings)
    inside = made.field.mask(made.scene.grid)
    ring: Any = made.field.polygon.buffer(25).difference(made.field.polygon.buffer(6))
    outside = made.field.mask(made.scene.grid) ^ True
    near = type(made.field)(ring, made.field.crs).mask(made.scene.grid) & outside
    grey, red = made.scene.grey, made.scene.bands[0].astype(float)
    assert abs(np.median(grey[inside]) - np.median(grey[near])) < 8
    assert abs(np.median(red[inside]) - np.median(red[near])) > 4


def test_many_fields_take_their_counts_in_turn() -> None:
    made = list(simulate_fields(4, 2, SMALL, obstacle_counts=[1, 3]))
    assert [len(each.obstacles) for each in made] == [1, 3, 1, 3]
    assert len({each.scene.source.name for each in made}) == 4


def test_without_near_infrared_there_are_three_bands() -> None:
    made = simulate_field(1, SimulationSettings(width_px=128, height_px=128, nir=False))
    assert made.scene.roles == ("red", "green", "blue")


@pytest.mark.parametrize(
    "settings",
    [
        {"width_px": 10},
        {"radius_m": (5, 2)},
        {"radius_m": (2.0, float("inf"))},
        {"resolution_m": 0},
        {"resolution_m": float("inf")},
        {"obstacles": -5},
        {"climate": "moon"},
    ],
)
def test_impossible_settings_are_refused(settings: dict[str, object]) -> None:
    with pytest.raises(SettingsError):
        SimulationSettings(**settings)  # type: ignore[arg-type]


def test_the_sample_data_come_from_their_seed(sample: Path) -> None:
    settings = SimulationSettings(width_px=480, height_px=480)
    for index, made in enumerate(simulate_fields(2, 5, settings), start=1):
        with rasterio.open(sample / f"field_{index}.tif") as file:
            assert np.array_equal(file.read(), made.scene.bands)
            assert file.transform == made.scene.grid.transform
        # The examples' point lies in both fields, on no crown.
        x, y = made.scene.grid.from_lonlat(33.531142, 35.075373)
        assert made.field.polygon_px(made.scene.grid).contains(shapely.Point(x, y))
    total = sum(path.stat().st_size for path in sample.iterdir())
    assert total < 2_000_000


def test_the_command_tells_of_trees_without_room_and_of_a_bad_seed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from geofield.cli import main

    with pytest.raises(SystemExit, match="0"):
        main(["simulate", "--size", "64", "--trees", "40", "--out", str(tmp_path / "sim")])
    said = capsys.readouterr().err
    assert "Not every field has room for 40 trees" in said
    with pytest.raises(SystemExit, match="0"):
        main(["simulate", "--fields", "1", "--trees", "1", "--out", str(tmp_path / "one")])
    assert "Wrote 1 field with 1 tree to" in capsys.readouterr().err
    with pytest.raises(SystemExit, match="2"):
        main(["simulate", "--seed", "-1", "--out", str(tmp_path / "none")])
    with pytest.raises(SettingsError, match="below zero"):
        simulate_field(-1)
