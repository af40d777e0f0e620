"""The window grows with the field; diffusion keeps borders."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from geofield.errors import FieldWarning, SettingsError
from geofield.field import extract_field, grow_field
from geofield.field.diffusion import diffuse
from geofield.simulate import SimulationSettings, simulate_field


def reader(scene, lat, lon):
    x, y = scene.grid.from_lonlat(lon, lat)
    sizes = []

    def read(size_m):
        sizes.append(size_m)
        side = round(size_m / scene.grid.ground_resolution_m)
        return scene.crop(round(x - side / 2), round(y - side / 2), side, side)

    return read, sizes


def test_the_window_grows_until_the_field_is_inside():
    truth = simulate_field(700_021, SimulationSettings(width_px=400, height_px=400))
    read, sizes = reader(truth.scene, truth.lat, truth.lon)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FieldWarning)
        field, scene = grow_field(read, lat=truth.lat, lon=truth.lon, size_m=60)
    assert sizes[:2] == [60, 120]
    assert scene.grid.width_px > 100
    truth_polygon = truth.field.polygon
    overlap = field.polygon.intersection(truth_polygon).area
    assert overlap / field.polygon.union(truth_polygon).area > 0.95


def test_a_picture_that_ends_first_is_told():
    truth = simulate_field(700_021, SimulationSettings(width_px=400, height_px=400))
    x, y = (int(v) for v in truth.scene.grid.from_lonlat(truth.lon, truth.lat))
    part = truth.scene.crop(x - 30, y - 30, 60, 60)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FieldWarning)
        field, _ = grow_field(lambda size: part, lat=truth.lat, lon=truth.lon, size_m=60)
    assert field.quality is not None
    assert any("edge" in reason or "picture" in reason for reason in field.quality.reasons)


def test_all_of_a_picture_is_searched_once(monkeypatch):
    truth = simulate_field(700_021, SimulationSettings(width_px=400, height_px=400))
    x, y = (int(v) for v in truth.scene.grid.from_lonlat(truth.lon, truth.lat))
    part = truth.scene.crop(x - 30, y - 30, 60, 60)
    searched = []

    def counted(scene, **options):
        searched.append(scene)
        return extract_field(scene, **options)

    monkeypatch.setattr("geofield.field.grow.extract_field", counted)
    with pytest.warns(FieldWarning, match="outside the picture"):
        grow_field(lambda size: part, lat=truth.lat, lon=truth.lon, size_m=60)
    assert len(searched) == 1


def test_no_window_is_widened_where_the_data_end():
    truth = simulate_field(700_021, SimulationSettings(width_px=400, height_px=400))
    x, y = (int(v) for v in truth.scene.grid.from_lonlat(truth.lon, truth.lat))
    valid = np.zeros(truth.scene.grid.shape, bool)
    valid[y - 30 : y + 30, x - 30 : x + 30] = True
    read, sizes = reader(replace(truth.scene, valid=valid), truth.lat, truth.lon)
    with pytest.warns(FieldWarning, match="outside the picture"):
        grow_field(read, lat=truth.lat, lon=truth.lon, size_m=60)
    assert sizes == [60]


def test_impossible_windows_are_refused():
    with pytest.raises(SettingsError, match="must grow"):
        grow_field(lambda size: None, lat=0, lon=0, size_m=500, largest_m=100)


def test_diffusion_smooths_surfaces_and_keeps_borders():
    rng = np.random.default_rng(1)
    band = np.where(np.arange(80) < 40, 80.0, 140.0) + rng.normal(0, 5, (60, 80))
    smooth = diffuse(band)
    assert smooth[:, 5:35].std() < 0.4 * band[:, 5:35].std()
    step = smooth[:, 40:43].mean() - smooth[:, 37:40].mean()
    assert step > 50
    assert smooth.mean() == pytest.approx(band.mean(), abs=0.01)
