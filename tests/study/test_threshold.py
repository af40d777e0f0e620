"""The study's method: thresholds, numbered regions, reconstruction."""

import numpy as np
import pytest
from affine import Affine

from geofield.crs import parse_crs
from geofield.errors import FieldError, FieldWarning, PointOutsideError, SettingsError
from geofield.field import extract_field
from geofield.grid import Grid
from geofield.model import Scene
from geofield.study.threshold import study_pictures


def scene_of(grey):
    rows, columns = grey.shape
    grid = Grid(columns, rows, Affine(0.5, 0, 500_000, 0, -0.5, 5_000_000), parse_crs("EPSG:32633"))
    return Scene(grid, grey.astype(np.uint8)[None], ("grey",), np.ones(grey.shape, bool))


@pytest.fixture
def two_fields():
    grey = np.full((200, 240), 60.0)
    grey[30:150, 20:110] = 180
    grey[60:120, 140:220] = 190
    grey[80:92, 50:62] = 30  # a crown
    grey += np.random.default_rng(3).normal(0, 6, grey.shape)
    return np.clip(grey, 0, 255)


def at(scene, x, y):
    lon, lat = scene.grid.to_lonlat(x, y)
    return {"lat": lat, "lon": lon}


def test_regions_are_numbered_by_size(two_fields):
    pictures = study_pictures(two_fields.astype(np.float32))
    assert 60 < pictures.threshold < 180
    assert (np.diff(pictures.counts) <= 0).all()
    assert pictures.counts.sum() == two_fields.size
    bright = pictures.region_at(30, 40), pictures.region_at(180, 90)
    assert pictures.counts[bright[0] - 1] == pytest.approx(120 * 90 - 144, rel=0.02)
    assert bright[0] < bright[1]


def test_the_field_at_the_point_in_ground_metres(two_fields):
    scene = scene_of(two_fields)
    field = extract_field(scene, **at(scene, 30, 40), method="study")
    assert field.area_ha == pytest.approx((120 * 90 - 144) * 0.25 / 1e4, rel=0.02)
    assert len(list(field.polygon.interiors)) == 1
    filled = extract_field(scene, **at(scene, 30, 40), method="study", holes="fill")
    assert not list(filled.polygon.interiors)
    assert filled.quality is not None
    assert filled.quality.trusted


def test_regions_chosen_by_hand(two_fields):
    two_fields[88:92, 108:142] = 60
    scene = scene_of(two_fields)
    numbers = study_pictures(scene.grey)
    right = numbers.region_at(180, 90)
    field = extract_field(scene, **at(scene, 30, 40), method="study", regions=[right])
    assert field.polygon_px(scene.grid).centroid.x == pytest.approx(180, abs=1)
    with pytest.raises(FieldError, match="no region 9999"):
        extract_field(scene, **at(scene, 30, 40), method="study", regions=[9999])


def test_a_chosen_region_that_lies_apart_is_told(two_fields):
    scene = scene_of(two_fields)
    numbers = study_pictures(scene.grey)
    left, right, around = (numbers.region_at(*at) for at in ((30, 40), (180, 90), (120, 20)))
    place = at(scene, 30, 40)
    apart = extract_field(scene, **place, method="study", regions=[right, left])
    assert apart.area_ha == pytest.approx((120 * 90 - 144) * 0.25 / 1e4, rel=0.02)
    told = f"region {right} does not touch the others and is left out"
    assert told in apart.quality.reasons
    with pytest.warns(FieldWarning, match="fills the whole picture"):
        joined = extract_field(scene, **place, method="study", regions=[right, left, around])
    assert not any("left out" in reason for reason in joined.quality.reasons)
    twice = extract_field(scene, **place, method="study", regions=[left, left])
    assert not any("left out" in reason for reason in twice.quality.reasons)


def test_reconstruction_removes_dark_specks_inside(two_fields):
    pictures = study_pictures(two_fields.astype(np.float32))
    picture = pictures.reconstruction((pictures.region_at(30, 40),))
    assert picture[40, 200] == 0
    assert picture[86, 56] > 120


def test_wrong_use_is_explained(two_fields):
    scene = scene_of(two_fields)
    with pytest.raises(SettingsError, match="Unknown field method"):
        extract_field(scene, **at(scene, 30, 40), method="magic")
    with pytest.raises(PointOutsideError):
        extract_field(scene, **at(scene, -30, 40), method="study")


def test_a_field_at_the_pictures_edge_says_so():
    grey = np.full((100, 100), 50.0)
    grey[:, 30:] = 200
    scene = scene_of(grey)
    field = extract_field(scene, **at(scene, 60, 50), method="study")
    assert field.quality is not None
    assert any("edge" in reason for reason in field.quality.reasons)


def test_a_point_on_a_speck_is_flagged():
    grey = np.full((100, 100), 200.0)
    grey[45:55, 45:55] = 20
    scene = scene_of(grey)
    with pytest.warns(FieldWarning, match="only"):
        extract_field(scene, **at(scene, 50, 50), method="study")
