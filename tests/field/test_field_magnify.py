"""Small pictures: what is looked at enlarged, and what comes of it."""

from dataclasses import replace

import numpy as np
import pytest

from geofield.field import extract_field, prepare_field
from geofield.field.magnify import magnified
from geofield.raster import resample
from geofield.simulate import SimulationSettings, simulate_field


def coarser(scene, times):
    """The same ground in fewer pixels."""
    bands = np.stack([resample(band.astype(np.float32), times) for band in scene.bands])
    rows, columns = bands.shape[1:]
    return replace(
        scene,
        grid=scene.grid.resized(columns, rows),
        bands=np.rint(bands).astype(np.uint8),
        valid=np.ones((rows, columns), bool),
    )


@pytest.mark.parametrize(("seed", "least"), [(2, 0.97), (3, 0.97), (8, 0.97)])
def test_a_field_of_few_pixels_is_found_as_exactly_as_one_of_many(seed, least):
    truth = simulate_field(seed, SimulationSettings(width_px=640, height_px=640))
    scene = coarser(truth.scene, 10)
    assert scene.grid.shape == (64, 64)
    field = extract_field(scene, lat=truth.lat, lon=truth.lon)
    true = truth.field.polygon
    overlap = field.polygon.intersection(true).area / field.polygon.union(true).area
    assert overlap > least
    assert field.quality.trusted
    kept = prepare_field(scene, lat=truth.lat, lon=truth.lon)
    again = extract_field(scene, lat=truth.lat, lon=truth.lon, search=kept)
    assert again.polygon == field.polygon


@pytest.mark.parametrize(
    ("rows", "columns", "times"),
    [(256, 256, 1), (171, 100, 1), (170, 20, 2), (64, 100, 3), (9, 12, 8)],
)
def test_only_small_pictures_are_enlarged_onto_the_same_ground(rows, columns, times):
    scene = simulate_field(1, SimulationSettings(width_px=300, height_px=300)).scene
    scene = scene.crop(10, 20, columns, rows)
    valid = scene.valid.copy()
    valid[0, 1] = False
    scene = replace(scene, valid=valid)
    large = magnified(scene)
    assert (large is scene) == (times == 1)
    assert large.grid.shape == (rows * times, columns * times)
    corners = ([0, columns, columns], [0, 0, rows])
    np.testing.assert_allclose(
        large.grid.to_native(*(times * np.array(one) for one in corners)),
        scene.grid.to_native(*corners),
    )
    # A pixel's middle keeps its value where cutting leaves it a middle.
    assert large.valid.sum() == valid.sum() * times**2
    assert not large.valid[0, times : 2 * times].any()
    if times % 2:
        middle = large.bands[:, times // 2 :: times, times // 2 :: times]
        np.testing.assert_array_equal(middle, scene.bands)
    assert abs(large.bands.mean() - scene.bands.mean()) < 1.5
