"""The default method: fields with known outlines, seeds anywhere, equal brightness."""

import numpy as np
import pytest
import shapely

from geofield.errors import FieldWarning
from geofield.field import extract_field
from geofield.simulate import SimulationSettings, simulate_field


def overlap(a, b):
    return a.intersection(b).area / a.union(b).area


@pytest.mark.parametrize("seed", [700_021, 700_027])
def test_equal_brightness_is_no_obstacle(seed):
    truth = simulate_field(
        seed, SimulationSettings(width_px=400, height_px=400, equal_brightness=True)
    )
    field = extract_field(truth.scene, lat=truth.lat, lon=truth.lon)
    assert overlap(field.polygon, truth.field.polygon) > 0.93
    assert field.polygon.is_valid
    assert not list(field.polygon.interiors)
    assert field.quality is not None
    assert field.quality.trusted
    # However plain a field is: nobody was there.
    assert 0.9 < dict(field.quality.figures)["ground_certainty"] <= 0.99


def test_crowns_become_holes_when_asked():
    truth = simulate_field(700_024, SimulationSettings(width_px=400, height_px=400, obstacles=8))
    field = extract_field(truth.scene, lat=truth.lat, lon=truth.lon, holes="keep")
    holes = len(list(field.polygon.interiors))
    assert 7 <= holes <= 9
    crowns = sum(shapely.Polygon(ring).area for ring in field.polygon.interiors)
    # Holes take in shadows and soft rims too.
    assert 1.0 < crowns / (np.pi * (truth.obstacles["radius_m"] ** 2).sum()) < 3.0
    assert overlap(shapely.Polygon(field.polygon.exterior), truth.field.polygon) > 0.9


def test_the_same_picture_gives_the_same_outline():
    truth = simulate_field(700_024, SimulationSettings(width_px=300, height_px=300))
    first, second = (
        extract_field(truth.scene, lat=truth.lat, lon=truth.lon).polygon for _ in range(2)
    )
    assert np.array_equal(np.array(first.exterior.coords), np.array(second.exterior.coords))


def test_a_rounding_error_in_the_point_changes_nothing():
    truth = simulate_field(700_024, SimulationSettings(width_px=300, height_px=300))
    grid = truth.scene.grid
    x, y = (float(round(at)) for at in grid.from_lonlat(truth.lon, truth.lat))
    fields = []
    for error in (1e-6, -1e-6):  # pixels
        lon, lat = grid.to_lonlat(x + error, y - error)
        fields.append(extract_field(truth.scene, lat=lat, lon=lon))
    first, second = fields
    assert first.polygon.equals(second.polygon)
    assert first.quality == second.quality


def test_a_small_picture_of_a_drone_gives_an_outline():
    # The median's square of 21 metres is 421 pixels wide here.
    truth = simulate_field(
        700_021, SimulationSettings(width_px=64, height_px=64, resolution_m=0.05)
    )
    with pytest.warns(FieldWarning):
        field = extract_field(truth.scene, lat=truth.lat, lon=truth.lon)
    assert field.polygon.is_valid
    assert 0 < 1e4 * field.area_ha < 11
