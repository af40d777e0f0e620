"""``geofield field`` from the outside."""

import json

import pytest

from geofield.cli.main import main
from geofield.imagery import write_scene
from geofield.plan import read_plan
from geofield.simulate import SimulationSettings, simulate_field


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    truth = simulate_field(700_021, SimulationSettings(width_px=300, height_px=300))
    folder = tmp_path_factory.mktemp("field")
    write_scene(truth.scene, folder / "scene.tif")
    return truth, folder


def run(*arguments):
    try:
        main([str(a) for a in arguments])
    except SystemExit as stop:
        return stop.code
    return 0


def point(truth):
    return ("--lat", truth.lat, "--lon", truth.lon)


def test_extract_list_choose_and_own_boundary(sample, capsys):
    truth, folder = sample
    scene, out = folder / "scene.tif", folder / "out.gpkg"
    assert run("field", scene, *point(truth), "-o", out, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["area_ha"] == pytest.approx(truth.field.area_ha, rel=0.08)
    assert found["method"] == "auto"
    assert "quality" in found["evidence"]
    field = read_plan(out).field
    assert field.area_ha == pytest.approx(found["area_ha"], rel=1e-6)

    assert run("field", scene, *point(truth), "-o", out) == 1
    assert "there already" in capsys.readouterr().err

    pictures = folder / "pictures"
    listing = ("field", scene, *point(truth), "--list", "--json", "--pictures", pictures)
    assert run(*listing) == 0
    regions = json.loads(capsys.readouterr().out)["regions"]
    assert sum(row["at_point"] for row in regions) == 1
    names = {path.name for path in pictures.iterdir()}
    assert names == {"grey.png", "binary.png", "regions.png", "reconstruction.png"}

    chosen = folder / "chosen.gpkg"
    number = regions[0]["region"]
    assert run("field", scene, *point(truth), "--region", number, "-o", chosen) == 0
    assert read_plan(chosen).field.method == "study-manual"

    parcels = folder / "parcels.geojson"
    import geopandas as gpd

    gpd.GeoDataFrame(
        {"name": ["home"]}, geometry=[truth.field.polygon], crs=truth.field.crs
    ).to_crs(4326).to_file(parcels)
    own = folder / "own.gpkg"
    assert run("field", scene, *point(truth), "--boundary", parcels, "-o", own) == 0
    plan = read_plan(own)
    assert (plan.field.name, plan.field.method) == ("home", "boundary")
    assert plan.field.area_ha == pytest.approx(truth.field.area_ha, rel=1e-3)


def test_an_existing_output_is_refused_before_the_work(sample, tmp_path, capsys):
    truth, folder = sample
    file = tmp_path / "x.gpkg"
    file.write_bytes(b"mine")
    code = run("field", folder / "scene.tif", *point(truth), "--pictures", folder / "p", "-o", file)
    told = capsys.readouterr()
    assert code != 0
    assert "is there already" in told.err
    assert not told.out
    assert file.read_bytes() == b"mine"


def test_wrong_use_is_code_2(sample, capsys):
    truth, folder = sample
    scene = folder / "scene.tif"
    assert run("field", scene, *point(truth)) == 2
    assert "-o" in capsys.readouterr().err
    file = folder / "x.gpkg"
    assert run("field", scene, *point(truth), "--list", "-o", file) == 2
    assert "leave -o" in capsys.readouterr().err
    both = ("--boundary", scene, "--list")
    assert run("field", scene, *point(truth), *both) == 2


def test_a_window_of_one_pixel_grows(sample, tmp_path):
    truth, folder = sample
    code = run(
        "field", folder / "scene.tif", *point(truth), "--size-m", 0.1, "-o", tmp_path / "x.gpkg"
    )
    assert code == 0
    assert read_plan(tmp_path / "x.gpkg").field.area_ha == pytest.approx(
        truth.field.area_ha, rel=0.2
    )


def test_a_picture_of_one_pixel_is_told(sample, tmp_path, capsys):
    truth, folder = sample
    one = tmp_path / "one.tif"
    assert run("tiles", folder / "scene.tif", *point(truth), "--size", 1, "-o", one) == 0
    assert run("field", one, *point(truth), "-o", tmp_path / "x.gpkg") == 1
    assert "is one pixel" in capsys.readouterr().err


def test_bands_are_told_from_what_the_picture_has(sample, tmp_path, capsys):
    truth, folder = sample
    out = ("-o", tmp_path / "x.gpkg")
    scene = folder / "scene.tif"
    assert run("field", scene, *point(truth), "--bands", "red,grene", *out) == 1
    told = capsys.readouterr().err
    assert "Did you mean 'green'" in told
    assert "the picture has 4 bands (red, green, blue, nir)" in told
    assert run("field", scene, *point(truth), "--bands", "red,green,blue,nir", *out) == 0
