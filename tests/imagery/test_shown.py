"""Pictures are shown where they lie, whichever way their files run."""

import base64
import io
import json
import re

import numpy as np
import pytest
from PIL import Image

from geofield.imagery import write_scene
from geofield.imagery.display import TILE_PX, TiledPicture, shown_pixels
from geofield.simulate import SimulatedField
from geofield_command import run_geofield
from turned_pictures import TURNS, turned


@pytest.mark.parametrize("turn", TURNS)
def test_a_picture_is_shown_where_it_lies(simulated: SimulatedField, tmp_path, turn) -> None:
    """One that was turned by half a circle could not be reviewed, and plots had it upside down."""
    plain = simulated.scene.crop(3, 5, 301, 220)
    other, crs = turned(plain, turn), plain.grid.crs
    right, bounds = shown_pixels(plain, crs, 2000)
    found, there = shown_pixels(other, crs, 2000)
    assert there == pytest.approx(bounds, abs=1e-6)
    error = np.abs(found.astype(int) - right).mean()
    assert error < 0.3 * np.abs(right[1:].astype(int) - right[:-1]).mean()
    picture = TiledPicture.open(write_scene(other, tmp_path / "turned.tif"), crs)
    assert picture.bounds == pytest.approx(bounds, abs=1e-6)
    assert picture.resolutions_m == pytest.approx([plain.grid.transform.a], rel=1e-3)
    data, _ = picture.tile(0, 0, 0, "colour")
    tile = np.asarray(Image.open(io.BytesIO(data)))
    assert tile.shape == (TILE_PX, TILE_PX, 4)
    assert np.abs(tile[:219, :300].astype(int) - right[:219, :300]).mean() < 0.5


def test_the_page_of_a_picture_upside_down(simulated: SimulatedField, tmp_path) -> None:
    picture = write_scene(turned(simulated.scene, "half"), tmp_path / "half.tif")
    place = ["--lat", simulated.lat, "--lon", simulated.lon, "--spacing", 8, "--format", "html"]
    run_geofield("run", picture, *place, "--out", tmp_path / "out", check=True)
    page = (tmp_path / "out" / "field.html").read_text(encoding="utf-8")
    found = re.search(r'<script type="application/json" id="plan">(.*?)</script>', page, re.S)
    assert found is not None
    shown = base64.b64decode(json.loads(found.group(1))["picture"].partition(",")[2])
    pixels = np.asarray(Image.open(io.BytesIO(shown)).convert("RGB")).astype(int)
    right, _ = shown_pixels(simulated.scene, simulated.scene.grid.crs, 2000)
    assert pixels.shape == right[..., :3].shape
    assert np.abs(pixels - right[..., :3]).mean() < 6
