"""Bands that name different values of no data, as those of a VRT may, reprojected too."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import rasterio.shutil
from affine import Affine

from geofield.imagery import SceneReader, read_scene

from .pictures import write

SIDE, EMPTY = 240, 60
VALUES = (1.0, 255.0, 7.0)
#: Degrees, of which a picture is reprojected.
TRANSFORM = Affine(5e-6, 0, 25.0, 0, -5e-6, 62.0)


@pytest.fixture
def path(tmp_path: Path) -> str:
    """A VRT without data in its first columns; elsewhere single bands hold those values, too."""
    values = np.random.default_rng(2).integers(100, 140, (3, SIDE, SIDE)).astype(np.uint8)
    values[:, :, :EMPTY] = np.reshape(VALUES, (3, 1, 1))
    values[1, :, 120:140] = 255
    write(tmp_path / "x.tif", values, crs="EPSG:4326", transform=TRANSFORM, photometric="RGB")
    vrt = tmp_path / "x.vrt"
    rasterio.shutil.copy(tmp_path / "x.tif", vrt, driver="VRT")
    nodata = iter(VALUES)
    text = re.sub(
        "<VRTRasterBand[^>]*>",
        lambda found: f"{found[0]}<NoDataValue>{next(nodata):g}</NoDataValue>",
        vrt.read_text(),
    )
    vrt.write_text(text)
    return str(vrt)


def test_each_band_has_its_own(path: str) -> None:
    reader = SceneReader.open(path)
    assert reader.warped_from is not None
    scene = reader.read()
    rows, columns = np.mgrid[0.5 : scene.grid.height_px, 0.5 : scene.grid.width_px]
    lon, lat = scene.grid.to_lonlat(columns, rows)
    x, y = (lon - 25.0) / 5e-6, (62.0 - lat) / 5e-6
    inside = (y > 1) & (y < SIDE - 1) & (x > 1) & (x < SIDE - 1)
    assert not scene.valid[inside & (x < EMPTY - 1)].any()
    assert scene.valid[inside & (x > EMPTY + 1)].all()
    # Nothing of them is mixed into the ground beside, and what one band holds alone is ground.
    beside = scene.bands[:, scene.valid & inside & (x < 118)]
    assert beside.min() >= 100
    assert beside.max() < 140
    assert (scene.bands[1][inside & (x > 122) & (x < 138)] == 255).all()


def test_a_part_is_a_part_of_the_whole(path: str) -> None:
    reader = SceneReader.open(path)
    whole, window = reader.read(), (30, 40, 90, 70)
    part = reader.read(window)
    assert 0 < part.valid.mean() < 1
    assert np.array_equal(part.valid, whole.crop(*window).valid)
    assert np.array_equal(part.bands, whole.crop(*window).bands)
    assert read_scene(path, lat=61.9994, lon=25.0004, size_m=20).valid.any()
