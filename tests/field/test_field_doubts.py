"""Bad input: a clear message or a flagged result, never a silent wrong polygon."""

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
import shapely
from affine import Affine

from geofield.crs import parse_crs
from geofield.errors import FieldWarning, GeofieldError
from geofield.field import extract_field
from geofield.field.plausible import look
from geofield.field.quality import judge
from geofield.grid import Grid
from geofield.model import Scene
from geofield.model.segmentation import Segmentation
from geofield.raster import block_mean
from geofield.simulate import SimulationSettings, simulate_field

ROLES = ("red", "green", "blue", "nir")


def scene_of(bands, valid=None):
    rows, columns = bands.shape[1:]
    grid = Grid(columns, rows, Affine(0.6, 0, 500_000, 0, -0.6, 5_000_000), parse_crs("EPSG:32633"))
    valid = np.ones((rows, columns), bool) if valid is None else valid
    return Scene(grid, np.clip(bands, 0, 255).astype(np.uint8), ROLES, valid)


def judged(scene, x, y, method="auto"):
    lon, lat = scene.grid.to_lonlat(x, y)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FieldWarning)
        try:
            field = extract_field(scene, lat=lat, lon=lon, method=method)
        except GeofieldError:
            return None
    assert field.polygon.is_valid
    return field


def flat(colour, shape=(200, 200), noise=3.0, seed=0):
    rng = np.random.default_rng(seed)
    return np.array(colour, float)[:, None, None] + rng.normal(0, noise, (4, *shape))


def test_one_surface_that_fills_the_picture():
    field = judged(scene_of(flat([120, 130, 80, 150])), 100, 100)
    assert field is None or not field.quality.trusted


def test_a_wood():
    from scipy.ndimage import gaussian_filter

    rng = np.random.default_rng(2)
    crowns = gaussian_filter(rng.normal(size=(200, 200)), 2.5)
    bands = flat([60, 80, 50, 120]) + 28 * crowns / crowns.std()
    field = judged(scene_of(bands), 100, 100)
    assert field is None or not field.quality.trusted


def test_a_lake():
    bands = flat([110, 125, 70, 160])
    bands[:, 40:160, 40:170] = flat([40, 60, 70, 15], (120, 130), seed=1)
    field = judged(scene_of(bands), 100, 100)
    assert field is not None
    assert not field.quality.trusted
    assert any("water" in reason for reason in field.quality.reasons)


def test_a_road():
    bands = flat([110, 125, 70, 160])
    bands[:, 95:105] = flat([150, 148, 145, 120], (10, 200), seed=1)
    field = judged(scene_of(bands), 100, 100)
    assert field is None or not field.quality.trusted or field.area_ha > 0.5


@pytest.mark.parametrize("position", [(0.2, 100), (199.9, 0.1), (100, 199.5)])
def test_the_pictures_edge(position):
    bands = flat([110, 125, 70, 160])
    bands[:, :, 120:] = flat([150, 130, 100, 140], (200, 80), seed=1)
    field = judged(scene_of(bands), *position)
    assert field is not None
    assert any("edge" in reason for reason in field.quality.reasons)


def test_no_data_ends_a_field():
    bands = flat([110, 125, 70, 160])
    valid = np.ones((200, 200), bool)
    valid[:, 150:] = False
    field = judged(scene_of(bands, valid), 60, 100)
    assert field is not None
    assert field.polygon_px(scene_of(bands).grid).bounds[2] <= 152
    assert judged(scene_of(bands, valid), 180, 100) is None


def test_a_seed_on_a_crown_finds_the_field_and_says_so():
    truth = simulate_field(700_021, SimulationSettings(width_px=400, height_px=400))
    crown = truth.obstacles.sort_values("radius_m").iloc[-1]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FieldWarning)
        field = extract_field(truth.scene, lat=crown["lat"], lon=crown["lon"])
    true = truth.field.polygon
    assert field.polygon.intersection(true).area / field.polygon.union(true).area > 0.9
    assert any("small" in reason for reason in field.quality.reasons)


@pytest.mark.parametrize("shape", [(1, 1), (3, 50), (20, 20)])
def test_tiny_pictures_do_not_crash(shape):
    field = judged(scene_of(flat([110, 125, 70, 160], shape)), shape[1] / 2, shape[0] / 2)
    assert field is None or not field.quality.trusted


def test_grey_pictures_work():
    grey = np.full((200, 200), 90.0) + np.random.default_rng(0).normal(0, 3, (200, 200))
    grey[40:160, 50:170] += 60
    grid = Grid(200, 200, Affine(0.6, 0, 500_000, 0, -0.6, 5_000_000), parse_crs("EPSG:32633"))
    scene = Scene(grid, grey.astype(np.uint8)[None], ("grey",), np.ones((200, 200), bool))
    field = judged(scene, 100, 100)
    assert field is not None
    assert field.polygon_px(grid).area == pytest.approx(120 * 120, rel=0.02)


def test_a_border_from_coarse_pixels_is_told_as_such():
    truth = simulate_field(12, SimulationSettings(width_px=1600, height_px=1600))
    said = []
    for factor in (4, 8):
        bands = np.stack([block_mean(band, factor) for band in truth.scene.bands]).astype(np.uint8)
        grid = truth.scene.grid.resized(bands.shape[2], bands.shape[1])
        scene = replace(truth.scene, grid=grid, bands=bands, valid=np.ones(grid.shape, bool))
        quality = extract_field(scene, lat=truth.lat, lon=truth.lon).quality
        assert quality is not None
        said.append("; ".join(quality.reasons))
    assert "coarse" not in said[0]
    assert "coarse (4.8 m per pixel)" in said[1]


@pytest.mark.parametrize("certainty", [0.705, 0.715])
def test_what_is_not_trusted_says_why(certainty):
    """Between where doubt is told and where trust begins the warning gave no reason."""
    truth = simulate_field(2, SimulationSettings(width_px=320, height_px=320))
    scene = truth.scene
    outline = truth.field.polygon_px(scene.grid)
    mask = truth.field.mask(scene.grid, holes=False)
    found = Segmentation(mask, (), (("certainty", certainty),))
    seed = scene.pixel_of(lat=truth.lat, lon=truth.lon)
    whole = shapely.box(0, 0, 320, 320)
    quality = judge(scene, look(scene), mask, outline, found, seed, whole)
    assert not quality.trusted
    assert len(quality.reasons) == 1
    assert quality.reasons[0].startswith("where it ends is not certain (certainty 7")
    sure = replace(found, figures=(("certainty", 0.9),))
    assert judge(scene, look(scene), mask, outline, sure, seed, whole).reasons == ()


def reasons_against(bands, left, top, right, bottom, certainty=0.95, seed=None):
    """Whether an outline in a picture is trusted, and what is said against it."""
    scene = scene_of(bands)
    rows, columns = scene.grid.shape
    mask = np.zeros((rows, columns), bool)
    mask[top:bottom, left:right] = True
    found = Segmentation(mask, (), (("certainty", certainty),))
    seed = seed or ((left + right) / 2, (top + bottom) / 2)
    whole, outline = (shapely.box(0, 0, columns, rows), shapely.box(left, top, right, bottom))
    quality = judge(scene, look(scene), mask, outline, found, seed, whole)
    return quality.trusted, "; ".join(quality.reasons)


@pytest.mark.parametrize("size", [200, 390, 900])
def test_a_narrow_field_is_told_with_its_width_in_metres(size):
    """Whatever the picture was reduced by to look at it."""
    bands = flat([110, 125, 70, 160], (size, size))
    trusted, said = reasons_against(bands, 50, 20, 68, size - 20)
    width = re.search(r"it is only (\d+) m wide \(a road, a strip", said)
    assert width
    assert float(width[1]) == pytest.approx(18 * 0.6, abs=2.5)
    assert not trusted
    assert reasons_against(bands, 50, 20, 80, size - 20) == (True, "")


def test_rough_ground_is_told_and_costs_certainty():
    for noise, words in ((20.0, "it is rough (shrubs, a wood, buildings?)"), (8.0, "")):
        bands = flat([110, 125, 70, 160], noise=3.0)
        bands[:3] += np.random.default_rng(4).normal(0, noise, bands.shape[1:])
        assert reasons_against(bands, 40, 40, 160, 160) == (not words, words)


def test_a_scrap_is_told_with_its_area_and_a_full_picture_as_one():
    bands = flat([110, 125, 70, 160])
    assert reasons_against(bands, 50, 50, 80, 80) == (False, "it has only 324 m2")
    assert reasons_against(bands, 50, 50, 84, 84) == (True, "")
    trusted, said = reasons_against(bands, 0, 0, 200, 200)
    assert not trusted
    assert "it fills the whole picture" in said
    assert "wide" not in said
    trusted, said = reasons_against(bands, 0, 0, 200, 185)
    assert trusted
    assert "fills" not in said


def test_a_point_beside_the_outline_costs_trust_unless_a_person_chose_the_region():
    bands, outline = flat([110, 125, 70, 160]), (40, 40, 160, 160)
    for certainty, trusted in ((0.95, False), (1.0, True)):
        told = reasons_against(bands, *outline, certainty=certainty, seed=(20.0, 20.0))
        assert told == (trusted, "the point lies on something else (a tree, a road, a roof?)")
