"""The plugin in a real QGIS, as a subprocess with a home of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from plugin_place import CLIENT, PLUGINS, PYTHON, ROOT


def pytest_collection_modifyitems(items):
    for item in items:
        if Path(item.fspath).parent == CLIENT.parent:
            item.add_marker(pytest.mark.qgis)


@pytest.fixture(scope="session")
def qgis_environment(tmp_path_factory):
    home = tmp_path_factory.mktemp("qgis")
    home.chmod(0o700)
    # Only the command: in front of the PATH, this environment's Python would be QGIS's.
    tools = tmp_path_factory.mktemp("tools")
    (tools / "geofield").symlink_to(Path(sys.executable).with_name("geofield"))
    environment = {
        "QT_QPA_PLATFORM": "offscreen",
        "HOME": str(home),
        "XDG_RUNTIME_DIR": str(home),
        "PATH": f"/usr/bin:/bin:{tools}",
        "LC_ALL": "C.UTF-8",
        "QGIS_PLUGINPATH": str(PLUGINS),
        "PYTHONDONTWRITEBYTECODE": "1",
        "OMP_NUM_THREADS": "1",
        "GDAL_PAM_ENABLED": "NO",  # QGIS would note its statistics beside the sample
    }
    found = (
        Path(PYTHON).exists()
        and subprocess.run(
            [PYTHON, "-c", "import qgis.core"], env=environment, capture_output=True, check=False
        ).returncode
        == 0
    )
    if not found:
        if os.environ.get("CI"):
            pytest.fail("QGIS is missing: apt-get install qgis python3-qgis python3-gdal")
        pytest.skip("needs QGIS: apt-get install qgis python3-qgis python3-gdal")
    return environment


@pytest.fixture(scope="session")
def qgis(qgis_environment):
    """Ask QGIS something; see client.py for what."""

    def ask(do, variables=None, timeout_s=300, **arguments):
        request = json.dumps({"do": do, **arguments})
        done = subprocess.run(
            [PYTHON, str(CLIENT), request],
            env={**qgis_environment, **(variables or {})},
            capture_output=True,
            text=True,
            timeout=timeout_s,
            check=False,
        )
        assert "@@@" in done.stdout, f"QGIS failed: {done.stdout[-500:]} {done.stderr[-3000:]}"
        return json.loads(done.stdout.rsplit("@@@", 1)[1])

    return ask


@pytest.fixture(scope="session")
def geofield():
    """Run the command itself, to compare with."""

    def call(*words, variables=None):
        command = Path(sys.executable).with_name("geofield")
        return subprocess.run(
            [command, *map(str, words)],
            cwd=ROOT,
            check=True,
            capture_output=True,
            text=True,
            env={**os.environ, **(variables or {})},
        )

    return call
