"""Fixtures shared by all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

from geofield.simulate import SimulatedField, SimulationSettings, simulate_field

settings.register_profile("geofield", deadline=None, max_examples=60, derandomize=True)
settings.load_profile("geofield")

ROOT = Path(__file__).resolve().parents[1]


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests that share a fixture of their module run in one worker, where it is made once."""
    for item in items:
        known = getattr(item, "_fixtureinfo", None)
        found = known.name2fixturedefs.values() if known else ()
        shares = any(each[-1].scope == "module" for each in found)
        if shares and item.get_closest_marker("xdist_group") is None:
            item.add_marker(pytest.mark.xdist_group(item.nodeid.partition("::")[0]))


def shared_folder() -> Path | None:
    """The folder with real data, where there is one."""
    place = Path(os.environ.get("GEOFIELD_SHARED", ROOT.parent / "shared"))
    return place if (place / "data").is_dir() else None


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder with real imagery, parcels and the study's tables."""
    place = shared_folder()
    if place is None:
        pytest.skip("no real data beside the checkout (../shared or GEOFIELD_SHARED)")
    return place


@pytest.fixture(scope="session")
def sample() -> Path:
    """The folder with the project's own sample fields."""
    return ROOT / "sample_data"


@pytest.fixture(autouse=True)
def _own_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """No setting of the person who runs the tests may change them."""
    for name in list(os.environ):
        if name.startswith("GEOFIELD_") and name != "GEOFIELD_SHARED":
            monkeypatch.delenv(name)


@pytest.fixture(scope="session")
def simulated() -> SimulatedField:
    """A small field with eight trees and its truth."""
    return simulate_field(
        11, SimulationSettings(width_px=320, height_px=320, obstacles=8, climate="temperate")
    )


@pytest.fixture(scope="session")
def simulated_tif(simulated: SimulatedField, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small field's picture as a GeoTIFF."""
    from geofield.imagery import write_scene

    path = tmp_path_factory.mktemp("simulated") / "field.tif"
    write_scene(simulated.scene, path)
    return path
