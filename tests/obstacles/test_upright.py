"""A picture gives the same obstacles whichever way its file runs."""

import numpy as np
import pytest
import rasterio
from affine import Affine

import geofield as gf
from geofield.imagery import SceneReader
from geofield.imagery.gdal import to_rasterio
from geofield.model.upright import Turn
from turned_pictures import TURNS, turned

UTM = "EPSG:32633"


@pytest.fixture(scope="module")
def oblong(simulated):
    """A part of a picture whose sides are whole multiples of nothing."""
    return simulated.scene.crop(3, 5, 371, 290)


def assert_same(found, expected, least=8):
    assert len(expected) >= least
    assert found.obstacle_no.tolist() == expected.obstacle_no.tolist()
    assert found.kind.tolist() == expected.kind.tolist()
    for column in ("radius_m", "confidence", "lat", "lon"):
        values, right = (table[column].to_numpy(dtype=float) for table in (found, expected))
        np.testing.assert_allclose(values, right, rtol=0, atol=1e-7)
    assert found.geometry.hausdorff_distance(expected.geometry).max() < 1e-6


@pytest.mark.parametrize("turn", TURNS)
def test_obstacles_lie_where_they_lie(simulated, oblong, turn):
    expected = gf.detect_obstacles(oblong, simulated.field)
    picture = turned(oblong, turn)
    found = gf.detect_obstacles(picture, simulated.field)
    assert_same(found, expected)
    x, y = picture.grid.from_lonlat(found.lon.to_numpy(), found.lat.to_numpy())
    assert found[["x_px", "y_px"]].to_numpy() == pytest.approx(np.column_stack([x, y]), abs=1e-5)


@pytest.mark.parametrize("strategy", ["max_of_all", "study_listing", "consensus"])
def test_the_study_sees_them_upright_too(simulated, oblong, strategy):
    options = {"strategy": strategy, "edge_method": None, "min_share": 0.02}
    if strategy == "consensus":
        options |= {"edge_method": "sobel", "threshold_range": (0.0, 0.2, 0.01)}
    expected = gf.detect_obstacles(oblong, simulated.field, **options)
    for turn in TURNS:
        found = gf.detect_obstacles(turned(oblong, turn), simulated.field, **options)
        assert found.attrs == expected.attrs
        assert_same(found, expected, least=5)


@pytest.mark.parametrize("turn", ["south-up", "quarter"])
def test_pictures_read_in_parts_too(simulated, oblong, turn, tmp_path, monkeypatch):
    monkeypatch.setattr("geofield.obstacles.default.CORE_PX", 256)
    found = []
    for name, scene in (("as-it-is", oblong), (turn, turned(oblong, turn))):
        path = tmp_path / f"{name}.tif"
        profile = {"driver": "GTiff", "dtype": "uint16", "count": len(scene.bands)}
        height, width = scene.grid.shape
        crs, transform = to_rasterio(scene.grid.crs), scene.grid.transform
        with rasterio.open(
            path, "w", height=height, width=width, crs=crs, transform=transform, **profile
        ) as file:
            file.write(scene.bands.astype(np.uint16) * 9 + 300)
        reader = SceneReader.open(str(path))
        found.append(gf.detect_obstacles(reader, simulated.field))
    assert_same(found[1], found[0])


@pytest.mark.parametrize("degrees", [-40, -10, 0, 10, 40])
def test_a_picture_that_is_askew_stays_as_it_lies(degrees):
    transform = Affine.rotation(degrees) @ Affine.scale(0.5, -0.5)
    assert not Turn.upright(gf.Grid(30, 20, transform, UTM))


@pytest.mark.parametrize("degrees", [50, 90, 130, 180, 230, 270, 310])
def test_a_picture_is_brought_to_within_an_eighth_of_a_turn_of_north(degrees):
    transform = Affine.rotation(degrees) @ Affine.scale(0.5, -0.5)
    grid = gf.Grid(30, 20, transform, UTM)
    turn = Turn.upright(grid)
    upright = turn.grid(grid)
    assert turn
    assert not Turn.upright(upright)
    here = np.array([[3.0, 4.0]])
    x, y = upright.to_native(*here.T)
    assert np.column_stack(grid.from_native(x, y)) == pytest.approx(turn.points_back(here))


def test_north_is_that_of_the_ground_not_of_the_crs():
    """South African Lo grids count to the west and to the south."""
    crs, metric = "EPSG:2053", gf.Grid(9, 9, Affine(0.5, 0, 5e5, 0, -0.5, 7e6), "EPSG:32735")
    x, y = metric.to_crs([0.0, 9.0, 0.0], [0.0, 0.0, 9.0], crs)
    steps = [x[1] - x[0], x[2] - x[0], x[0] * 9, y[1] - y[0], y[2] - y[0], y[0] * 9]
    grid = gf.Grid(9, 9, Affine(*(step / 9 for step in steps)), crs)
    assert grid.transform.a < 0 < grid.transform.e
    assert not Turn.upright(grid)
