"""What speaks against a plan is told: on the terminal, in the report, on maps and in files."""

from __future__ import annotations

import json
import subprocess
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import geopandas as gpd
import numpy as np
import pytest
import shapely
from PIL import Image

import geofield as gf
from geofield import theme
from geofield.formats.qgis.layer_style import frame_strip
from geofield.imagery import write_scene
from geofield.model.field import FieldQuality
from geofield.model.frame import along_frame, shown_ground
from geofield.model.map_words import figures_in_words, frame_lines
from geofield.pipeline import run_tracks
from geofield.plan import Plan, read_plan
from geofield.review.live import LivePlans
from geofield.review.shown import field_of
from geofield.settings import load_settings
from geofield.simulate import SimulatedField
from geofield.wording import counted
from geofield_command import run_geofield

OUTSIDE = "outside the picture"


@pytest.fixture(scope="module")
def out(simulated: SimulatedField, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A run on a picture that ends in the middle of the field, and what it told."""
    folder = tmp_path_factory.mktemp("doubt")
    x, _ = simulated.scene.pixel_of(lat=simulated.lat, lon=simulated.lon)
    cut = simulated.scene.crop(0, 0, int(x) + 30, simulated.scene.grid.height_px)
    write_scene(cut, folder / "half.tif")
    command = ["run", folder / "half.tif", "--lat", simulated.lat, "--lon", simulated.lon]
    command += ["--out", folder / "out", "--spacing", 6, "--route", "boustrophedon"]
    command += ["--turning-radius", 5]
    for name in ("gpkg", "geojson", "shapefile", "isoxml", "rdf", "kml"):
        command += ["--format", name]
    return folder / "out", _called(*command).stderr


def test_the_terminal_and_the_report_tell(out: tuple[Path, str]) -> None:
    folder, told = out
    assert OUTSIDE in told
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    assert any(OUTSIDE in doubt for doubt in report["field"]["doubts"])
    assert 0 <= report["field"]["certainty"] <= 1
    turns = read_plan(folder / "field.gpkg").tracks.turns
    assert turns is not None
    unfit = int((turns["fits"] == "no").sum())
    assert unfit > 0
    assert report["tracks"]["turns_that_do_not_fit"] == unfit
    unworked_m = turns["skipped_m"].sum()
    assert unworked_m > 1
    assert report["tracks"]["unworked_at_turns_m"] == pytest.approx(unworked_m, abs=0.1)
    assert f"{unworked_m:.0f} m of track left unworked at them" in told
    assert f"{counted(unfit, 'turn does', 'turns do')} not fit" in told


def test_files_carry_it(out: tuple[Path, str]) -> None:
    folder, _ = out
    for file in ("field.gpkg", "geojson/field.geojson", "shapefile/boundary.shp"):
        layer = {"layer": "field"} if file.endswith("gpkg") else {}
        row = gpd.read_file(folder / file, **layer).iloc[0]
        assert OUTSIDE in row["doubts"], file
        assert 0 <= row["certainty"] <= 1
    assert OUTSIDE in (folder / "field.rdf").read_text(encoding="utf-8")
    task = ET.parse(folder / "isoxml/TASKDATA/TASKDATA.XML").getroot()
    (name,) = (plan.get("B") for plan in task.iter("PLN") if plan.get("A") == "1")
    assert name is not None
    assert name.endswith("(check)")
    assert len(name) <= 32


def test_the_map_shows_it(out: tuple[Path, str]) -> None:
    folder, _ = out
    with Image.open(folder / "map.png") as picture:
        pixels = np.asarray(picture.convert("RGB")).astype(int)

    def count(color: str) -> int:
        return int((np.abs(pixels - theme.rgb(color)).max(axis=2) < 40).sum())

    # The words in the panel and the dashes along the frame; turns that do not fit.
    assert count(theme.DOUBT) > 1500
    assert count(theme.UNFIT) > 200


def test_an_outline_within_the_picture_is_in_no_such_doubt(simulated: SimulatedField) -> None:
    field, grid = simulated.field, simulated.scene.grid
    assert along_frame(field.polygon, field.crs, grid) == []
    assert Plan(field, grid=grid).doubts == ()
    doubted = replace(field, quality=FieldQuality(0.4, ("borders are weak",), (), False))
    assert Plan(doubted, grid=grid).doubts == ("borders are weak",)


@pytest.mark.parametrize("how", ["study", "boundary"])
def test_how_certain_an_outline_is_that_nobody_measured_is_not_told(
    sample: Path, tmp_path: Path, how: str
) -> None:
    """It was "100% certain", of method study also along three quarters of the picture's edge."""
    where: tuple[object, ...] = ("--boundary", sample / "field_1.gpkg", "--boundary-layer", "field")
    if how == "study":
        where = ("--lat", "35.075373", "--lon", "33.531142", "--method", "study")
    _called("run", sample / "field_1.tif", *where, "--spacing", 6, "--out", tmp_path / "out")
    file = tmp_path / "out" / "field.gpkg"
    assert gpd.read_file(file, layer="field")["certainty"].isna().all()
    report = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert report["field"]["certainty"] is None
    plan = read_plan(file)
    assert plan.field.certainty is None
    assert field_of(plan)["certainty"] is None
    assert "certain" not in figures_in_words(plan.to_dataset())[0]
    told = _called("field", sample / "field_1.tif", *where, "-o", tmp_path / "field.gpkg").stderr
    assert "Trust      not measured" in told


def test_a_drawn_outline_at_the_frame_is_told_too(simulated: SimulatedField) -> None:
    grid, crs = simulated.scene.grid, simulated.field.crs
    x, y = grid.to_crs([0.0, 120.0, 120.0, 0.0], [40.0, 40.0, 200.0, 200.0], crs)
    drawn = shapely.Polygon(np.column_stack([x, y]))
    field = replace(simulated.field, polygon=drawn, method="drawn", quality=None)
    plan = run_tracks(
        Plan(field, grid=grid), settings=load_settings(None, {"tracks": {"spacing_m": 8.0}})
    )
    (doubt,) = plan.doubts
    assert OUTSIDE in doubt
    parcel = replace(plan, field=replace(field, method="boundary"))
    assert parcel.doubts == ()


def test_where_the_data_end_in_a_picture_is_its_edge_too(
    simulated: SimulatedField, tmp_path: Path
) -> None:
    # As in every orthomosaic that was flown askew.
    scene = simulated.scene
    x, y = scene.pixel_of(lat=simulated.lat, lon=simulated.lon)
    rows, columns = np.indices(scene.grid.shape)
    valid = columns - x + 0.6 * (rows - y) < 30
    write_scene(replace(scene, valid=valid), tmp_path / "half.tif")
    command = ["field", tmp_path / "half.tif", "--lat", simulated.lat, "--lon", simulated.lon]
    assert OUTSIDE in _called(*command, "-o", tmp_path / "field.gpkg").stderr
    plan = read_plan(tmp_path / "field.gpkg")
    assert sum(OUTSIDE in doubt for doubt in plan.doubts) == 1
    dashed_m = sum(line.length for line in plan.frame_lines)
    assert dashed_m > 0.15 * plan.field.perimeter_m
    # On the review page, on maps and in QGIS.
    assert len(field_of(plan)["frame"]) == len(plan.frame_lines)
    assert frame_lines(plan.to_dataset()) == plan.frame_lines
    strip = shapely.from_wkt(frame_strip(plan.to_dataset()))
    assert plan.field.polygon.exterior.intersection(strip).length > 0.9 * dashed_m
    # What a person draws there goes on outside, too.
    drawn = replace(plan, field=replace(plan.field, method="drawn", quality=None))
    assert OUTSIDE in drawn.doubts[0]


def test_specks_of_missing_data_are_no_edge(simulated: SimulatedField) -> None:
    field, grid = simulated.field, simulated.scene.grid
    valid = np.random.default_rng(1).random(grid.shape) > 0.01
    assert shown_ground(valid, grid.ground_resolution_m) is None
    assert shown_ground(np.ones(grid.shape, bool), 0.5) is None
    valid[:, :40] = False
    shown = shown_ground(valid, grid.ground_resolution_m)
    assert shown is not None
    assert shown.bounds == (40, 0, *grid.shape[::-1])
    assert along_frame(field.polygon, field.crs, grid, shown) == []


@pytest.fixture(scope="module")
def parcel(simulated: SimulatedField, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run in a parcel of one's own of which the picture shows two thirds."""
    folder = tmp_path_factory.mktemp("parcel")
    x, _ = simulated.scene.pixel_of(lat=simulated.lat, lon=simulated.lon)
    cut = simulated.scene.crop(0, 0, int(x) + 30, simulated.scene.grid.height_px)
    write_scene(cut, folder / "half.tif")
    outline = gpd.GeoDataFrame(geometry=[simulated.field.polygon], crs=simulated.field.crs)
    outline.to_file(folder / "parcel.gpkg")
    command = ["run", folder / "half.tif", "--lat", simulated.lat, "--lon", simulated.lon]
    command += ["--boundary", folder / "parcel.gpkg", "--out", folder / "out", "--spacing", 6]
    for name in ("gpkg", "geojson", "map", "html", "report"):
        command += ["--format", name]
    _called(*command)
    return folder / "out"


def _called(*command: object) -> subprocess.CompletedProcess[str]:
    done = run_geofield(*command)
    assert done.returncode == 0, done.stderr
    return done


def test_ground_that_nobody_saw_is_told_wherever_a_plan_is_looked_at(parcel: Path) -> None:
    unseen = "The picture does not show"
    assert unseen in _called("info", parcel / "field.gpkg").stdout
    report = json.loads((parcel / "report.json").read_text(encoding="utf-8"))
    assert unseen in report["evidence"]["obstacles"]["doubts"][0]
    assert unseen in (parcel / "geojson" / "field.geojson").read_text(encoding="utf-8")
    assert unseen in read_plan(parcel / "field.gpkg").provenance.obstacle_doubts[0]
    page = (parcel / "field.html").read_text(encoding="utf-8")
    start = page.index('id="plan">') + len('id="plan">')
    values = json.loads(page[start : page.index("</script>", start)])
    assert unseen in values["doubts"][0]
    shown = LivePlans().answer({"do": "plan", "file": str(parcel / "field.gpkg")})
    assert unseen in shown["doubts"][0]
    # A parcel is whole: it only leads out of the picture.
    assert values["field"]["frame"] == []


def test_a_farms_field_that_nobody_saw_whole_is_doubtful(parcel: Path, tmp_path: Path) -> None:
    # The middle of the parcel lies beside the picture.
    folder, farm = parcel.parent, tmp_path / "farm"
    told = _called("batch", folder / "parcel.gpkg", folder / "half.tif", "--spacing", 6,
                   "--workers", 1, "--out", farm)  # fmt: skip
    assert "1 of 1: 1 doubtful" in told.stderr
    assert "does not show" in gf.read_farm(farm).status["doubts"][0]
    # It is orange in the overview.
    fields = gpd.read_file(farm / "farm.gpkg", layer="field")
    assert "does not show" in fields["doubts"][0]


def test_a_map_shows_all_of_a_field_that_its_picture_does_not(
    parcel: Path, simulated: SimulatedField
) -> None:
    pixels = np.asarray(Image.open(parcel / "map.png").convert("RGB")).astype(int)
    assert int((np.abs(pixels - theme.rgb(theme.DOUBT)).max(axis=2) < 40).sum()) > 500
    map_part = pixels[: int(0.9 * len(pixels))]
    y, x = np.nonzero(np.abs(map_part - theme.rgb(theme.OUTLINE)).max(axis=2) < 30)
    left, bottom, right, top = simulated.field.polygon.bounds
    drawn = np.ptp(x) / np.ptp(y)
    assert drawn == pytest.approx((right - left) / (top - bottom), rel=0.03)


def test_an_outline_that_leads_out_of_the_picture_does_not_end_there(
    simulated: SimulatedField,
) -> None:
    grid, crs = simulated.scene.grid, simulated.field.crs
    x, y = grid.to_crs([-60.0, 120.0, 120.0, -60.0], [40.0, 50.0, 200.0, 220.0], crs)
    drawn = shapely.Polygon(np.column_stack([x, y]))
    assert along_frame(drawn, crs, grid) == []
