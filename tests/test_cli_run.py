"""The command line as a newcomer meets it: the main job, the stages, wrong input."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import rasterio
from affine import Affine
from PIL import Image
from pyproj import CRS

import geofield as gf
from geofield.cli.main import COMMANDS, main
from geofield.grid import Grid
from geofield.model import Scene
from geofield.plan import read_plan
from geofield.simulate import SimulatedField

SAMPLE = Path(__file__).parents[1] / "sample_data"
PICTURE, PLAN = str(SAMPLE / "field_1.tif"), str(SAMPLE / "field_1.gpkg")


def geofield(*args: object) -> int:
    """Run the command line in this process; returns the exit code."""
    try:
        main([str(arg) for arg in args])
    except SystemExit as stop:
        return int(stop.code or 0)
    return 0


def point(made: SimulatedField) -> list[object]:
    return ["--lat", made.lat, "--lon", made.lon]


@pytest.fixture
def ran(simulated: SimulatedField, simulated_tif: Path, tmp_path: Path) -> Path:
    out = tmp_path / "out"
    assert geofield("run", simulated_tif, *point(simulated), "--spacing", 6, "--out", out) == 0
    return out


def test_the_main_job(
    simulated: SimulatedField,
    simulated_tif: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    ran = tmp_path / "out"
    ran.mkdir()
    (ran / ".DS_Store").touch()  # of a file manager that looked into it
    assert geofield("run", simulated_tif, *point(simulated), "--spacing", 6, "--out", ran) == 0
    output = capsys.readouterr()
    assert output.out == ""
    assert "map.png" in output.err
    plan = read_plan(ran / "field.gpkg")
    assert plan.settings is not None
    assert plan.settings.tracks.spacing_m == 6
    with Image.open(ran / "map.png") as picture:
        assert picture.width > 1000


def test_json_goes_to_stdout_alone(
    simulated: SimulatedField,
    simulated_tif: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "out"
    assert geofield("run", simulated_tif, *point(simulated), "--out", out, "--json") == 0
    report = json.loads(capsys.readouterr().out)
    assert report["tracks"]["tracks"] > 0


def test_stage_by_stage_gives_the_same_plan(
    ran: Path,
    simulated: SimulatedField,
    simulated_tif: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = tmp_path / "stages.gpkg"
    scene = tmp_path / "scene.tif"
    where = point(simulated)
    assert geofield("tiles", simulated_tif, *where, "-o", scene) == 0
    assert geofield("field", scene, *where, "-o", file) == 0
    assert geofield("obstacles", scene, file, "-o", file) == 0
    assert geofield("tracks", file, "--spacing", 6, "-o", file) == 0
    assert geofield("export", file, "--format", "geojson", "--out", tmp_path / "export") == 0
    one, other = read_plan(ran / "field.gpkg"), read_plan(file)
    assert one.tracks is not None
    assert other.tracks is not None
    assert one.field.polygon.equals(other.field.polygon)
    assert one.obstacles is not None
    assert other.obstacles is not None
    assert one.obstacles.equals(other.obstacles)
    assert one.tracks.segments.equals(other.tracks.segments)
    exported = (tmp_path / "export/geojson/segments.geojson").read_bytes()
    assert exported == (ran / "geojson/segments.geojson").read_bytes()
    for stage in (["obstacles", scene, file], ["field", scene, *where, "--overwrite"]):
        assert "Tracks removed" not in capsys.readouterr().err
        assert geofield(*stage, "-o", file) == 0
        assert "Tracks removed: they no longer fit (geofield tracks" in capsys.readouterr().err
        assert geofield("tracks", file, "-o", file) == 0


def test_an_own_boundary_is_taken_as_it_is(
    simulated: SimulatedField, simulated_tif: Path, tmp_path: Path
) -> None:
    import geopandas as gpd

    shape = simulated.field.polygon.buffer(-10)
    parcels = tmp_path / "parcels.geojson"
    table = gpd.GeoDataFrame({"name": ["mine"]}, geometry=[shape], crs=simulated.field.crs)
    table.to_crs(4326).to_file(parcels, driver="GeoJSON", COORDINATE_PRECISION=9)
    out = tmp_path / "out"
    # One parcel needs no point beside it; half a point is a slip.
    run = ["run", simulated_tif, "--boundary", parcels, "--spacing", 8, "--out", out]
    assert geofield(*run, "--lon", simulated.lon) == 2
    assert geofield(*run) == 0
    plan = read_plan(out / "field.gpkg")
    assert plan.field.method == "boundary"
    assert plan.field.polygon.symmetric_difference(shape).area < 0.01 * shape.area
    assert plan.tracks is not None
    assert all(shape.buffer(0.01).covers(each) for each in plan.tracks.segments.geometry)


def test_figures_that_are_none_are_null_in_json(
    ran: Path, simulated_tif: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The radius of what is not round was NaN, which is no JSON."""
    import geopandas as gpd
    import pandas as pd

    plan = tmp_path / "field.gpkg"
    plan.write_bytes((ran / "field.gpkg").read_bytes())
    table = gpd.read_file(plan, layer="obstacles")
    inside = (
        gpd.read_file(plan, layer="field").representative_point().buffer(3.0, cap_style="square")
    )
    pond = gpd.GeoDataFrame({"kind": ["other"], "status": ["added"]}, geometry=inside)
    pd.concat([table, pond]).to_file(plan, layer="obstacles", driver="GPKG", geometry_name="geom")
    capsys.readouterr()
    assert geofield("obstacles", simulated_tif, plan, "-o", plan, "--json") == 0
    told = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)["obstacles"]
    assert [row["radius_m"] for row in told if row["kind"] == "other"] == [None]


def test_overwriting_keeps_a_persons_edits(
    ran: Path, simulated: SimulatedField, simulated_tif: Path
) -> None:
    import geopandas as gpd

    file = ran / "field.gpkg"
    table = gpd.read_file(file, layer="obstacles")
    table.loc[0, "status"] = "rejected"
    table.to_file(file, layer="obstacles", driver="GPKG", geometry_name="geom")
    run = ["run", simulated_tif, *point(simulated), "--spacing", 6, "--out", ran]
    assert geofield(*run) == 1
    assert geofield(*run, "--overwrite") == 0
    kept = read_plan(file).obstacles
    assert kept is not None
    assert kept["status"].tolist().count("rejected") == 1
    assert geofield(*run, "--overwrite", "--fresh") == 0
    fresh = read_plan(file).obstacles
    assert fresh is not None
    assert set(fresh["status"]) <= {"detected", "possible"}


def fails(capsys: pytest.CaptureFixture[str], out: Path, *args: object, code: int = 1) -> str:
    """Run the main job with wrong input; it must say why and write nothing."""
    assert geofield("run", *args, "--out", out) == code
    message = capsys.readouterr().err
    assert "Traceback" not in message
    assert not out.exists()
    return message


def test_wrong_points(
    simulated: SimulatedField,
    simulated_tif: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "out"
    message = fails(capsys, out, simulated_tif, "--lat", 10, "--lon", 10)
    assert "outside the picture" in message
    message = fails(capsys, out, simulated_tif, "--lat", simulated.lon, "--lon", simulated.lat)
    assert "swapped" in message
    message = fails(capsys, out, simulated_tif, "--lat", 95, "--lon", 0, code=2)
    assert "--lat" in message
    fails(capsys, out, simulated_tif, "--lat", "nan", "--lon", 0, code=2)


@pytest.mark.parametrize("spacing", ["0", "-2", "nan", "inf"])
def test_wrong_spacing(
    spacing: str,
    simulated: SimulatedField,
    simulated_tif: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "out"
    message = fails(capsys, out, simulated_tif, *point(simulated), "--spacing", spacing, code=2)
    assert "spacing" in message


def test_a_spacing_wider_than_the_field_is_said(
    simulated: SimulatedField,
    simulated_tif: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "out"
    message = fails(capsys, out, simulated_tif, *point(simulated), "--spacing", 5000)
    assert "5000 m is larger than the field" in message


def test_wrong_pictures(
    simulated: SimulatedField,
    simulated_tif: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out, where = tmp_path / "out", point(simulated)
    assert "missing.tif" in fails(capsys, out, tmp_path / "missing.tif", *where, code=2)
    text = tmp_path / "text.tif"
    text.write_text("this is no picture")
    assert "text.tif" in fails(capsys, out, text, *where)
    cut = tmp_path / "cut.tif"
    cut.write_bytes(simulated_tif.read_bytes()[:4000])
    assert "cut.tif" in fails(capsys, out, cut, *where)
    plain = tmp_path / "plain.tif"
    with rasterio.open(simulated_tif) as source:
        bands = source.read()
    with (
        warnings.catch_warnings(action="ignore"),
        rasterio.open(
            plain,
            "w",
            driver="GTiff",
            width=bands.shape[2],
            height=bands.shape[1],
            count=4,
            dtype="uint8",
        ) as target,
    ):
        target.write(bands)
    assert "plain.tif has no position on the ground" in fails(capsys, out, plain, *where)
    local = tmp_path / "local.tif"
    shape = {"width": bands.shape[2], "height": bands.shape[1], "count": 4, "dtype": "uint8"}
    crs = rasterio.crs.CRS.from_wkt('LOCAL_CS["mine",UNIT["metre",1]]')
    with rasterio.open(local, "w", **shape, crs=crs, transform=Affine.scale(2, -2)) as target:
        target.write(bands)
    message = fails(capsys, out, local, *where)
    assert "mine is not the CRS of a map" in message
    assert "--crs" in message


def test_an_empty_scene_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    grid = Grid(200, 200, Affine(0.6, 0, 500_000, 0, -0.6, 3_900_000), CRS.from_epsg(32636))
    scene = Scene(
        grid,
        np.full((3, 200, 200), 128, np.uint8),
        ("red", "green", "blue"),
        np.ones((200, 200), bool),
    )
    gf.write_scene(scene, tmp_path / "empty.tif")
    lon, lat = grid.centre_lonlat
    where = ["--lat", lat, "--lon", lon]
    assert "empty" in fails(capsys, tmp_path / "out", tmp_path / "empty.tif", *where)


def test_output_folders(
    simulated: SimulatedField,
    simulated_tif: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    where = point(simulated)
    occupied = tmp_path / "occupied"
    occupied.mkdir()
    (occupied / "diary.txt").write_text("mine")
    assert geofield("run", simulated_tif, *where, "--out", occupied) == 1
    assert "--overwrite" in capsys.readouterr().err
    assert [path.name for path in occupied.iterdir()] == ["diary.txt"]
    assert geofield("run", simulated_tif, *where, "--out", occupied, "--overwrite") == 0
    assert (occupied / "diary.txt").read_text() == "mine"
    assert geofield("run", simulated_tif, *where, "--out", simulated_tif) == 2


def test_a_full_disk_leaves_nothing(
    simulated: SimulatedField,
    simulated_tif: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "map.png")

    monkeypatch.setattr("PIL.Image.Image.save", full)
    message = fails(capsys, tmp_path / "out", simulated_tif, *point(simulated))
    assert "disk is full" in message


def test_an_input_is_never_overwritten(
    simulated: SimulatedField, simulated_tif: Path, tmp_path: Path
) -> None:
    picture = tmp_path / "scene.tif"
    picture.write_bytes(simulated_tif.read_bytes())
    before = picture.read_bytes()
    run = ["run", picture, *point(simulated), "--out", tmp_path, "--overwrite"]
    assert geofield(*run) == 1
    assert picture.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["scene.tif"]


def test_every_command_has_help_with_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    for name in COMMANDS:
        assert geofield(name, "--help") == 0
        text = capsys.readouterr().out
        assert "Example" in text, name
        assert f"geofield {name}" in text, name


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["simulate", "--seed", "-5", "--out", "sim"], "x>=0"),
        (["evaluate", PLAN, PLAN, "--seed", "-5"], "x>=0"),
        (["evaluate", PLAN, PLAN, "--draw", "hits.shp"], "hits.shp is not the name of a picture"),
        (["obstacles", PLAN, PICTURE, "-o", "field.gpkg"], "The picture comes first"),
        (["field", PICTURE, "--lat", "35,07", "--lon", "33.5", "-o", "a.gpkg"], "write 35.07."),
        (["run", PICTURE, "--lat", "35.07", "--lon", "33.5", "--out", ""], "it is empty"),
        (["run", PICTURE, "--lat", "35.07", "--lon", "33.5", "--out", "-"], "give a name"),
        (["batch", PLAN, "--out", ""], "'--out': it is empty"),
        (["farm", "get", "", "a", "-o", "a.gpkg"], "'FARM': it is empty"),
        (["farm", "put", PLAN, ""], "'FARM': it is empty"),
        (["tracks", PLAN, "--spacing", "4", "-o", "-"], "standard input and output are not used"),
        (["tracks", PLAN, "-o", "--overwrite"], "--overwrite is an option: give a name"),
    ],
)
def test_wrong_words_are_told_with_the_right_ones(
    words: list[str],
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert geofield(*words) == 2
    assert told in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_taken_name_is_told_before_the_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    taken = tmp_path / "taken.gpkg"
    taken.write_bytes(b"mine")
    # A picture that is not there would be the next to be told.
    assert geofield("obstacles", "missing.tif", PLAN, "-o", taken) == 1
    assert "is there already" in capsys.readouterr().err
    assert geofield("field", "missing.tif", "--lat", 35, "--lon", 33, "-o", "field.shp") == 1
    assert "not a GeoPackage name" in capsys.readouterr().err
    # It said FIELD.GPKG and wrote FIELD.gpkg, or ended in a traceback where that was the plan.
    capitals = tmp_path / "FIELD.GPKG"
    assert geofield("tracks", PLAN, "--spacing", 4, "-o", capitals) == 1
    assert "not a GeoPackage name" in capsys.readouterr().err
    # What the driver had to say was six thousand letters of SQL.
    assert geofield("tracks", PLAN, "--spacing", 4, "-o", tmp_path / f"{'x' * 245}.gpkg") == 1
    words = capsys.readouterr().err
    assert "could not be written: unable to open database file." in words
    assert "CREATE TABLE" not in words
    assert list(tmp_path.iterdir()) == [taken]


def test_simulated_trees_without_room_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert geofield("simulate", "--size", 64, "--trees", 500, "--out", tmp_path / "sim") == 0
    assert "Not every field has room for 500 trees" in capsys.readouterr().err


def test_a_mistyped_command_gets_a_suggestion(capsys: pytest.CaptureFixture[str]) -> None:
    assert geofield("tracs") == 2
    assert "'tracks'" in capsys.readouterr().err


def test_light_imports() -> None:
    heavy = "{'numpy', 'rasterio', 'geopandas', 'shapely', 'pydantic'}"
    code = f"import sys, geofield.cli; sys.exit(bool({heavy} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_pictures_are_cut_without_what_tables_need() -> None:
    code = "import sys, geofield.model, geofield.imagery; sys.exit('pandas' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_doctor_reports_versions(capsys: pytest.CaptureFixture[str]) -> None:
    geofield("doctor", "--json")
    facts = json.loads(capsys.readouterr().out)
    assert facts["native"]["GDAL of rasterio"]


def test_simulate_writes_pictures_and_truth(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    args = ["simulate", "--fields", 2, "--seed", 4, "--size", 160, "--trees", 3, "--out"]
    assert geofield(*args, tmp_path / "sim", "--json") == 0
    rows = json.loads(capsys.readouterr().out)
    assert len(rows) == 2
    truth = read_plan(tmp_path / "sim" / rows[0]["truth"])
    assert truth.obstacles is not None
    assert len(truth.obstacles) == 3
    assert (tmp_path / "sim" / "seeds.csv").is_file()
    assert geofield(*args, tmp_path / "sim") == 1
