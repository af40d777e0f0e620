"""A picture gives the same outline whichever way its file runs."""

import dataclasses
import json

import numpy as np
import pytest

import geofield as gf
from geofield.imagery import write_scene
from geofield.simulate import SimulationSettings, simulate_field
from geofield_command import run_geofield
from turned_pictures import TURNS, turned


@pytest.fixture(scope="module")
def oblong():
    """A part of a picture with a corner that shows nothing, and the point in its field."""
    truth = simulate_field(3, SimulationSettings(width_px=420, height_px=380, obstacles=6))
    scene = truth.scene.crop(3, 5, 371, 330)
    valid = scene.valid.copy()
    valid[:40, :25] = False
    return dataclasses.replace(scene, valid=valid), {"lat": truth.lat, "lon": truth.lon}


def assert_same(found, expected):
    assert found.polygon.hausdorff_distance(expected.polygon) < 1e-6
    assert found.quality == expected.quality
    assert len(found.alternatives) == len(expected.alternatives)
    for one, other in zip(found.alternatives, expected.alternatives, strict=True):
        assert one.polygon.hausdorff_distance(other.polygon) < 1e-6
        assert one.certainty == other.certainty


@pytest.mark.parametrize("turn", TURNS)
def test_outlines_lie_where_they_lie(oblong, turn):
    scene, point = oblong
    other = turned(scene, turn)
    assert_same(gf.extract_field(other, **point), gf.extract_field(scene, **point))


@pytest.mark.parametrize("turn", ["west", "quarter"])
@pytest.mark.filterwarnings("ignore::geofield.errors.FieldWarning")
def test_what_a_person_said_stays_where_it_was_said(oblong, turn):
    scene, point = oblong
    other = turned(scene, turn)
    x, y = scene.grid.from_lonlat(point["lon"], point["lat"])
    apart = scene.grid.to_lonlat(x + 40, y + 15)
    said = point | {"exclude": [apart], "include": [scene.grid.to_lonlat(x - 30, y)]}
    expected = gf.extract_field(scene, **said)
    search = gf.prepare_field(other, **point)
    for found in (gf.extract_field(other, **said), gf.extract_field(other, **said, search=search)):
        assert_same(found, expected)
    with pytest.raises(gf.GeofieldError, match="another picture or point"):
        gf.extract_field(scene.crop(0, 0, 300, 300), **point, search=search)


@pytest.mark.parametrize("turn", ["south-up", "exchanged"])
@pytest.mark.filterwarnings("ignore::geofield.errors.FieldWarning")
def test_the_study_sees_them_upright_too(oblong, turn):
    """It straightened a mirrored border the other way round: up to 9 m beside it."""
    scene, point = oblong
    other = turned(scene, turn)
    expected = gf.extract_field(scene, **point, method="study")
    assert_same(gf.extract_field(other, **point, method="study"), expected)


@pytest.mark.filterwarnings("ignore::geofield.errors.FieldWarning")
def test_numbers_of_regions_are_those_that_are_listed(oblong, tmp_path):
    scene, point = oblong
    at = [f"--{name}={value}" for name, value in point.items()]
    lists = []
    for name, one in (("as-it-is", scene), ("turned", turned(scene, "quarter"))):
        write_scene(one, path := tmp_path / f"{name}.tif")
        told = run_geofield("field", path, *at, "--list", "--json")
        lists.append(json.loads(told.stdout)["regions"])
    assert lists[0] == lists[1]
    numbers = [row["region"] for row in lists[0]]
    assert len(numbers) > 1
    fields = [
        gf.extract_field(one, **point, method="study", regions=[numbers[1]])
        for one in (scene, turned(scene, "quarter"))
    ]
    assert_same(*fields)
    assert np.isclose(fields[0].area_ha, lists[0][1]["area_ha"], rtol=0.2)
