"""The plugin in a real QGIS, as a subprocess with a home of its own."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

from geofield_command import run_geofield
from real_qgis import asking, environment_in, mark_all

sys.path.insert(0, str(Path(__file__).parent))
from plugin_place import CLIENT, PLUGINS, ROOT, SAMPLE


def pytest_collection_modifyitems(items):
    mark_all(items, CLIENT.parent)


@pytest.fixture(scope="session")
def qgis_environment(tmp_path_factory):
    # Only the command: in front of the PATH, this environment's Python would be QGIS's.
    tools = tmp_path_factory.mktemp("tools")
    (tools / "geofield").symlink_to(Path(sys.executable).with_name("geofield"))
    more = {
        "PATH": f"/usr/bin:/bin:{tools}",
        "QGIS_PLUGINPATH": str(PLUGINS),
        "PYTHONDONTWRITEBYTECODE": "1",
        "OMP_NUM_THREADS": "1",
        "GDAL_PAM_ENABLED": "NO",  # QGIS would note its statistics beside the sample
    }
    return environment_in(tmp_path_factory.mktemp("qgis"), more)


@pytest.fixture(scope="session")
def qgis(qgis_environment):
    """Ask QGIS something; see client.py for what."""
    with asking(CLIENT, qgis_environment) as ask:
        yield ask


@pytest.fixture(scope="module")
def panel(request, qgis_environment):
    """Ask QGIS something of its review panel; the file beside the test says what."""
    file = request.path.with_name(request.path.name.removeprefix("test_"))
    with asking(file, qgis_environment) as ask:
        yield ask


@pytest.fixture(scope="session")
def geofield():
    """Run the command itself, to compare with."""

    def call(*words, variables=None):
        with pytest.MonkeyPatch.context() as own:
            for name, value in (variables or {}).items():
                own.setenv(name, value)
            return run_geofield(*words, folder=ROOT, check=True)

    return call


@pytest.fixture(scope="session")
def reviewable(geofield, tmp_path_factory):
    """The sample planned, in a folder."""
    folder = tmp_path_factory.mktemp("panel") / "out"
    place = ("--lat", 35.075373, "--lon", 33.531142)
    geofield("run", SAMPLE, *place, "--spacing", 8, "--out", folder)
    return folder


@pytest.fixture
def plan(reviewable, tmp_path):
    """A copy of its plan: each test changes it."""
    return str(shutil.copytree(reviewable, tmp_path / "plan") / "field.gpkg")
