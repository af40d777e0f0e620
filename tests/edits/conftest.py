"""A simulated field, its picture, and a run's products to change."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from changed_plans import run

from geofield.simulate import SimulatedField, SimulationSettings, simulate_field


@pytest.fixture(scope="session")
def made() -> SimulatedField:
    """A field with eleven trees."""
    return simulate_field(
        11, SimulationSettings(width_px=360, height_px=360, obstacles=11, climate="temperate")
    )


@pytest.fixture(scope="session")
def first(made: SimulatedField, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the picture and a run's products."""
    from geofield.imagery import write_scene

    folder = tmp_path_factory.mktemp("first")
    write_scene(made.scene, folder / "picture.tif")
    run(folder, made)
    return folder


@pytest.fixture
def folder(first: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(first, tmp_path / "work"))
