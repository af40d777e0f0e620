"""A real QGIS, as a subprocess with a home of its own."""

from __future__ import annotations

import dataclasses
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import rasterio

sys.path.insert(0, str(Path(__file__).parent.parent / "formats"))
from formats_plan import make_dataset

from geofield.formats import write_dataset

CLIENT = Path(__file__).with_name("client.py")
#: QGIS belongs to Debian's Python, never to the environment of the tests.
PYTHON = "/usr/bin/python3"


def pytest_collection_modifyitems(items):
    for item in items:
        if Path(item.fspath).parent == CLIENT.parent:
            item.add_marker(pytest.mark.qgis)


@pytest.fixture(scope="session")
def qgis_environment(tmp_path_factory):
    home = tmp_path_factory.mktemp("qgis")
    home.chmod(0o700)
    environment = {
        "QT_QPA_PLATFORM": "offscreen",
        "HOME": str(home),
        "XDG_RUNTIME_DIR": str(home),
        "PATH": "/usr/bin:/bin",
        "LC_ALL": "C.UTF-8",
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

    def ask(do, **arguments):
        request = json.dumps({"do": do, **arguments})
        done = subprocess.run(
            [PYTHON, str(CLIENT), request],
            env=qgis_environment,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        assert "@@@" in done.stdout, f"QGIS failed: {done.stdout[-500:]} {done.stderr[-2000:]}"
        return json.loads(done.stdout.rsplit("@@@", 1)[1])

    return ask


@pytest.fixture(scope="session")
def product(tmp_path_factory):
    """The test plan with a picture below it, in all formats that QGIS opens."""
    folder = tmp_path_factory.mktemp("product")
    dataset = make_dataset()
    grid = dataset.grid
    noise = np.random.default_rng(1).normal(0, 10, grid.shape)
    picture = np.stack([110 + noise, 130 + noise, 70 + noise]).clip(0, 255).astype("uint8")
    with rasterio.open(
        folder / "scene.tif",
        "w",
        driver="COG",
        width=grid.width_px,
        height=grid.height_px,
        count=3,
        dtype="uint8",
        crs=grid.crs.to_wkt(),
        transform=grid.transform,
    ) as file:
        file.write(picture)
    dataset = dataclasses.replace(dataset, scene_path=folder / "scene.tif")
    with pytest.warns(match="cannot carry"):
        write_dataset(
            dataset,
            folder,
            ["gpkg", "geojson", "shapefile", "flatgeobuf", "kml", "gpx", "dxf", "fiboa"],
        )
    return folder


@pytest.fixture
def copy(product, tmp_path):
    """A copy: QGIS alters a GeoPackage when it opens it."""
    return Path(shutil.copytree(product, tmp_path / "copy"))
