"""A real QGIS, as a subprocess with a home of its own."""

from __future__ import annotations

import dataclasses
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
import rasterio

from real_qgis import asking, environment_in, mark_all

sys.path.insert(0, str(Path(__file__).parent.parent / "formats"))
from formats_plan import make_dataset

from geofield.formats import write_dataset

CLIENT = Path(__file__).with_name("client.py")


def pytest_collection_modifyitems(items):
    mark_all(items, CLIENT.parent)


@pytest.fixture(scope="session")
def qgis_environment(tmp_path_factory):
    return environment_in(tmp_path_factory.mktemp("qgis"))


@pytest.fixture(scope="session")
def qgis(qgis_environment):
    """Ask QGIS something; see client.py for what."""
    with asking(CLIENT, qgis_environment) as ask:
        yield ask


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
