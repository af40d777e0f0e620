"""What a person says of the ground: points that belong and that do not, and a choice."""

import json
import pickle
import warnings
from dataclasses import replace
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import shapely

from geofield.errors import FieldError, FieldWarning, PointOutsideError, SettingsError
from geofield.field import extract_field, prepare_field
from geofield.field.points import obeying, obeys
from geofield.imagery import write_scene
from geofield.model.segmentation import Segmentation
from geofield.plan import read_plan
from geofield.simulate import SimulationSettings, simulate_field
from geofield_command import run_geofield


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    truth = simulate_field(700_031, SimulationSettings(width_px=320, height_px=320))
    folder = tmp_path_factory.mktemp("points")
    write_scene(truth.scene, folder / "scene.tif")
    return truth, folder


def command(*arguments):
    return run_geofield("field", *arguments)


def written(value):
    return f"{value[0]:.8f},{value[1]:.8f}"


def in_zone(place, layer):
    return gpd.GeoSeries([shapely.Point(place)], crs=4326).to_crs(layer.crs).iloc[0]


def test_a_strip_to_the_point_that_pixels_break_loses_no_ground(sample, monkeypatch):
    """The part at the point was a few pixels, and the field strips of a metre between points."""
    truth, _ = sample
    scene = truth.scene
    mask = np.zeros(scene.grid.shape, bool)
    mask[200:300, 40:280] = True
    mask[100:103, 100:103] = True
    found = Segmentation(mask, (), (("certainty", 0.1),))
    monkeypatch.setattr("geofield.field.extract.method_of", lambda *_: lambda *_, **__: found)
    lon, lat = scene.grid.to_lonlat(101.5, 101.5)
    with pytest.warns(FieldWarning):
        field = extract_field(scene, lat=lat, lon=lon, include=[scene.grid.to_lonlat(150, 250)])
    outline = field.polygon_px(scene.grid)
    assert shapely.contains_xy(outline, [101.5, 150], [101.5, 250]).all()
    assert outline.intersection(shapely.box(40, 200, 280, 300)).area > 0.98 * 100 * 240
    assert outline.area < 1.05 * 100 * 240


def test_points_are_obeyed_whatever_the_picture_shows(sample):
    truth, _ = sample
    scene = truth.scene
    rng = np.random.default_rng(3)
    search = prepare_field(scene, lat=truth.lat, lon=truth.lon)
    for count in range(1, 7):
        places = rng.uniform(5, 315, (count, 2))
        lonlat = [scene.grid.to_lonlat(x, y) for x, y in places]
        include, exclude = lonlat[::2], lonlat[1::2]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            field = extract_field(
                scene,
                lat=truth.lat,
                lon=truth.lon,
                include=include,
                exclude=exclude,
                search=search,
            )
        for one in (field.polygon, *(each.polygon for each in field.alternatives)):
            outline = replace(field, polygon=one).polygon_px(scene.grid)
            assert all(shapely.contains_xy(outline, *xy) for xy in places[::2])
            assert not any(shapely.contains_xy(outline, *xy) for xy in places[1::2])


@pytest.mark.parametrize("seed", range(40))
def test_any_outline_is_made_to_obey_any_points(seed):
    rng = np.random.default_rng(seed)
    side = float(rng.choice([5.0, 50.0, 400.0]))
    include = rng.uniform(0, side, (rng.integers(1, 5), 2))
    exclude = rng.uniform(0, side, (rng.integers(0, 5), 2))
    away = np.hypot(*(include[:, None] - exclude).transpose(2, 0, 1)).min(axis=0, initial=1e9)
    include, exclude = include.tolist(), exclude[away > 0.5].tolist()
    outline: Any = shapely.convex_hull(shapely.MultiPoint(rng.uniform(0, side, (6, 2))))
    made = obeying(outline, include, exclude)
    assert made.is_valid
    assert obeys(made, include, exclude)


def test_points_that_contradict_each_other_are_refused(sample):
    truth, _ = sample
    here = truth.scene.grid.to_lonlat(150.0, 150.0)
    options = {"lat": truth.lat, "lon": truth.lon}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(FieldError, match="and not to belong"):
            extract_field(truth.scene, **options, include=[here], exclude=[here])
    with pytest.raises(PointOutsideError):
        extract_field(truth.scene, **options, include=[(0.0, 0.0)])
    with pytest.raises(SettingsError, match="method auto"):
        extract_field(truth.scene, **options, include=[here], method="study")


def known(search):
    """The outlines that were measured, with what was."""
    return {key: held for view in search.views.values() for key, held in view.search.known.items()}


def test_a_search_is_kept_for_further_points(sample):
    truth, _ = sample
    scene = truth.scene
    search = prepare_field(scene, lat=truth.lat, lon=truth.lon)
    options = {"lat": truth.lat, "lon": truth.lon}

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        extract_field(scene, **options, search=search)
        measured = known(search)
        again = pickle.loads(pickle.dumps(search))
        apart = [scene.grid.to_lonlat(20.0, 20.0)]
        kept = extract_field(scene, **options, search=search, exclude=apart)
        other = extract_field(scene, **options, search=again, exclude=apart)
        fresh = extract_field(scene, **options, exclude=apart)
    # The search that was given is asked, and what it measured is not measured again.
    assert measured
    assert len(known(again)) == len(known(search)) > len(measured)
    assert all(known(search)[polygon] is held for polygon, held in measured.items())
    assert kept.polygon.equals(other.polygon)
    overlap = kept.polygon.intersection(fresh.polygon).area / kept.polygon.union(fresh.polygon).area
    assert overlap > 0.9


def test_points_are_recorded_and_kept_by_a_later_run(sample):
    truth, folder = sample
    scene, out = folder / "scene.tif", folder / "points.gpkg"
    point = ("--lat", truth.lat, "--lon", truth.lon)
    outside = truth.scene.grid.to_lonlat(12.0, 12.0)
    middle = truth.field.polygon_px(truth.scene.grid).representative_point()
    inside = truth.scene.grid.to_lonlat(middle.x, middle.y)
    first = command(
        *(scene, *point, "-o", out),
        *("--include-lonlat", written(inside), "--exclude-lonlat", written(outside)),
    )
    assert first.returncode == 0, first.stderr
    again = command(scene, *point, "-o", out, "--overwrite", "--json")
    assert again.returncode == 0, again.stderr
    layer = gpd.read_file(out, layer="field")
    assert not layer.geometry[0].contains(in_zone(outside, layer))
    assert layer.geometry[0].contains(in_zone(inside, layer))
    told = read_plan(out).settings.field
    assert told.exclude == ((round(outside[0], 8), round(outside[1], 8)),)
    # The last word on a place counts.
    turned = command(scene, *point, "-o", out, "--overwrite", "--include-lonlat", written(outside))
    assert turned.returncode == 0, turned.stderr
    layer = gpd.read_file(out, layer="field")
    assert layer.geometry[0].contains(in_zone(outside, layer))
    wrong = command(scene, *point, "-o", out, "--overwrite", "--include-lonlat", "33,35,7")
    assert wrong.returncode != 0
    assert "LON,LAT" in wrong.stderr.upper()


def test_an_alternative_that_was_chosen_is_a_persons_word(sample):
    truth, folder = sample
    scene, out = folder / "haze.tif", folder / "chosen.gpkg"
    hazy = np.rint(0.03 * truth.scene.bands + 120).astype(np.uint8)
    write_scene(replace(truth.scene, bands=hazy), scene)
    point = ("--lat", truth.lat, "--lon", truth.lon)
    first = command(scene, *point, "-o", out, "--alternatives", "--json")
    assert first.returncode == 0, first.stderr
    offered = json.loads(first.stdout)["alternatives"]
    layer = gpd.read_file(out, layer="alternatives")
    assert len(layer) == len(offered) >= 2
    assert layer["alternative_no"].tolist() == list(range(1, len(layer) + 1))
    assert layer["certainty"].between(0, 1).all()
    assert layer["certainty"].is_monotonic_decreasing
    second = layer.geometry[1]
    assert layer.geometry[0].intersection(second).area < 0.9 * layer.geometry[0].union(second).area

    chosen = command(scene, *point, "-o", out, "--overwrite", "--choose", 2)
    assert chosen.returncode == 0, chosen.stderr
    for _ in range(2):
        field = gpd.read_file(out, layer="field")
        assert field.geometry[0].equals(second)
        assert field["method"][0] == "chosen"
        assert command(scene, *point, "-o", out, "--overwrite").returncode == 0
    assert command(scene, *point, "-o", out, "--overwrite", "--fresh").returncode == 0
    assert gpd.read_file(out, layer="field").geometry[0].equals(layer.geometry[0])

    none = command(scene, *point, "-o", folder / "none.gpkg", "--method", "study", "--choose", 2)
    assert none.returncode == 1
    assert "no outline 2" in none.stderr

    plain = command(folder / "scene.tif", *point, "-o", folder / "plain.gpkg", "--alternatives")
    assert "Outline 1" in plain.stderr
    assert "Others     none is likely" in plain.stderr
