"""``geofield tracks`` on any polygons, with obstacles from any file."""

from __future__ import annotations

import json
import shutil
import sqlite3
import warnings
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pyogrio
import pytest
import shapely
from click.testing import CliRunner

import geofield as gf
from geofield import schema
from geofield.cli.main import cli
from geofield.errors import FormatError, FormatWarning, GeofieldError, TrackError, TrackWarning
from geofield.farm import read_farm
from geofield.model.map_words import figures_in_words
from geofield.plan import read_plan
from geofield.plan_files import save_plan
from geofield.tracks import plan_tracks
from geofield.tracks.fewest import candidate_angles
from geofield_command import run_geofield

CRS = 32633
SAMPLE = Path(__file__).parents[2] / "sample_data"


def outlines(count: int) -> gpd.GeoDataFrame:
    boxes = [
        shapely.box(500000 + 300 * k, 5600000, 500200 + 300 * k, 5600080) for k in range(count)
    ]
    return gpd.GeoDataFrame(
        {"name": [f"Field {k + 1}" for k in range(count)]}, geometry=boxes, crs=CRS
    )


def run(*arguments: str | Path) -> dict[str, Any]:
    result = CliRunner().invoke(cli, ["tracks", *map(str, arguments), "--json"])
    assert result.exception is None, result.output
    return json.loads(result.stdout)


def test_a_datum_that_is_metres_off_is_told_of_parcels_and_obstacles(tmp_path: Path) -> None:
    india = gpd.GeoDataFrame(geometry=[shapely.box(77.001, 28.0, 77.003, 28.002)], crs=4326)
    india = india.to_crs(24378)
    india.to_file(tmp_path / "parcel.gpkg")
    india.centroid.buffer(2.0).to_file(tmp_path / "trees.gpkg")
    files = [str(tmp_path / "parcel.gpkg"), "--obstacles", str(tmp_path / "trees.gpkg")]
    result = CliRunner().invoke(cli, ["tracks", *files, "-o", str(tmp_path / "plan.gpkg")])
    words = "Positions in EPSG:24378 are good to 22 m"
    assert f"Note: {words}" in result.stderr
    assert f"Note: trees.gpkg: {words}" in result.stderr


def test_obstacles_of_a_file_come_to_those_of_a_plan(tmp_path: Path) -> None:
    """A plan with obstacles was refused; in farms a fence through a tree was taken for the tree."""
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    trees = gpd.points_from_xy([500050, 500120], [5600030, 5600050])
    gpd.GeoDataFrame({"radius_m": [5.0, 5.0]}, geometry=trees, crs=CRS).to_file(
        tmp_path / "trees.gpkg"
    )
    plan = tmp_path / "plan.gpkg"
    run(tmp_path / "parcel.gpkg", "--obstacles", tmp_path / "trees.gpkg", "-o", plan)
    table = pyogrio.read_dataframe(plan, layer="obstacles")
    table.loc[1, "status"] = "possible"
    pyogrio.write_dataframe(table, plan, layer="obstacles")
    fence = shapely.LineString([(500030, 5600031), (500090, 5600031)])
    known = gpd.GeoDataFrame(
        {"name": ["fence", "pole", "the first tree"], "radius_m": [1.0, 0.5, 4.9]},
        geometry=[fence, trees[1], trees[0]],
        crs=CRS,
    )
    known.to_file(tmp_path / "known.gpkg")
    again: list[str | Path] = [plan, "--obstacles", tmp_path / "known.gpkg", "-o", plan]
    run(*again)
    table = pyogrio.read_dataframe(plan, layer="obstacles")
    assert table["status"].tolist() == ["added", "possible", "added", "added"]
    assert table["obstacle_no"].tolist() == [1, 2, 3, 4]
    segments = pyogrio.read_dataframe(plan, layer="segments")
    assert not segments.intersects(fence).any()
    assert not segments.intersects(trees[1].buffer(0.4)).any()
    pyogrio.write_dataframe(table[table["obstacle_no"] != 3], plan, layer="obstacles")
    run(*again)
    assert pyogrio.read_dataframe(plan, layer="obstacles")["obstacle_no"].tolist() == [1, 2, 4]


def test_a_heading_just_west_of_north_is_not_shown_as_180(tmp_path: Path) -> None:
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    plan = tmp_path / "plan.gpkg"
    arguments = [str(tmp_path / "parcel.gpkg"), "--spacing", "10", "--direction", "179.9997"]
    result = CliRunner().invoke(cli, ["tracks", *arguments, "-o", str(plan)])
    assert "heading 0.0 degrees" in result.output + result.stderr
    read = gf.read_plan(plan)
    assert read.tracks is not None
    assert "heading 0.0 degrees" in repr(read.tracks)
    assert "heading 0.0\N{DEGREE SIGN}" in "".join(figures_in_words(read.to_dataset()))
    files = read.write(tmp_path / "out", formats=["report"])
    (report,) = (each for each in files if each.name == "report.json")
    assert json.loads(report.read_text(encoding="utf-8"))["field"]["heading_deg"] == 0.0


def test_a_picture_is_told_where_parcels_are_wanted(tmp_path: Path) -> None:
    (tmp_path / "ortho.tif").write_bytes(b"II*\0" + bytes(60))
    arguments = ["tracks", str(tmp_path / "ortho.tif"), "-o", str(tmp_path / "out.gpkg")]
    error = CliRunner().invoke(cli, arguments).exception
    assert isinstance(error, FormatError)
    assert "is a picture" in error.message
    assert "geofield run" in str(error.hint)


def test_one_polygon_with_trees(tmp_path: Path) -> None:
    outlines(1).to_crs(4326).to_file(tmp_path / "parcel.geojson", driver="GeoJSON")
    trees = gpd.GeoDataFrame(
        {"radius_m": [3.0, 4.0, 5.0]},
        geometry=gpd.points_from_xy([500050, 500120, 600000], [5600030, 5600050, 5600050]),
        crs=CRS,
    )
    trees.to_file(tmp_path / "trees.shp")
    out = tmp_path / "plan.gpkg"
    report = run(
        tmp_path / "parcel.geojson", "--obstacles", tmp_path / "trees.shp", "--spacing", "5",
        "--headland", "10", "--route", "skip", "--turning-radius", "4", "-o", out,
    )  # fmt: skip
    (row,) = report["fields"]
    assert row["gap_count"] > 0
    assert {loss["obstacle_no"] for loss in row["losses"]} == {1, 2}
    assert row["turns_that_do_not_fit"] == 0
    layers = set(pyogrio.list_layers(out)[:, 0])
    assert {"field", "obstacles", "tracks", "segments", "gaps", "route", "turns"} <= layers
    for name in ("segments", "route", "turns", "headland_tracks"):
        table = pyogrio.read_dataframe(out, layer=name)
        assert [c for c in table.columns if c != "geometry"] == schema.layer(name).column_names
        assert len(table)

    # The plan is read back, a person's rejection counts, and another layout replaces this one.
    edited = pyogrio.read_dataframe(out, layer="obstacles")
    assert edited["obstacle_no"].tolist() == [1, 2]
    with pytest.warns(TrackWarning, match="a strip of 2.00 m unworked"):
        report = run(out, "--spacing", "8", "--direction", "30", "-o", out)
    (row,) = report["fields"]
    assert row["heading_deg"] == pytest.approx(30.0)
    assert row["turn_count"] > 0
    report = run(out, "--spacing", "8", "--defaults", "-o", out)
    assert "turn_count" not in report["fields"][0]


def test_many_polygons_make_many_plans(tmp_path: Path) -> None:
    # A file whose name began with a dash would be taken for options.
    outlines(3).replace("Field 3", "--Field 3").to_file(tmp_path / "parcels.shp")
    report = run(tmp_path / "parcels.shp", "--spacing", "8", "--each", "-o", tmp_path / "plans")
    rows = report["fields"]
    assert [row["name"] for row in rows] == ["Field 1", "Field 2", "--Field 3"]
    assert [row["length_m"] for row in rows] == pytest.approx([2000.0 / 0.9996] * 3, abs=0.1)
    assert sorted(p.name for p in (tmp_path / "plans").glob("*.gpkg")) == [
        "Field_1.gpkg", "Field_2.gpkg", "Field_3.gpkg",
    ]  # fmt: skip
    again = CliRunner().invoke(
        cli, ["tracks", str(tmp_path / "parcels.shp"), "--each", "-o", str(tmp_path / "one.gpkg")]
    )
    assert again.exit_code != 0


def test_names_longer_than_those_of_files_may_be(tmp_path: Path) -> None:
    """The first one ended the work, and those behind it had no plan."""
    outlines(3).assign(name="ö" * 200).to_file(tmp_path / "parcels.gpkg")
    report = run(tmp_path / "parcels.gpkg", "--spacing", "8", "--each", "-o", tmp_path / "plans")
    assert [row["name"] for row in report["fields"]] == ["ö" * 200] * 3
    assert len(list((tmp_path / "plans").glob("*.gpkg"))) == 3


def test_many_polygons_make_one_file(tmp_path: Path) -> None:
    frame = outlines(3).assign(crop=["rye", "oats", "rye"], spacing_m=[None, 16.0, None])
    frame.to_file(tmp_path / "parcels.gpkg")
    out = tmp_path / "all.gpkg"
    rows = run(tmp_path / "parcels.gpkg", "--spacing", "8", "-o", out)["fields"]
    assert [row["name"] for row in rows] == ["Field 1", "Field 2", "Field 3"]
    lengths = np.array([2000.0, 1000.0, 2000.0]) / 0.9996
    assert [row["length_m"] for row in rows] == pytest.approx(list(lengths), abs=0.1)
    field = gpd.read_file(out, layer="field").set_index("name").sort_index()
    assert list(field["crop"]) == ["rye", "oats", "rye"]
    tracks = gpd.read_file(out, layer="tracks")
    assert set(tracks["field_id"]) == set(field["field_id"])
    assert CRS in {tracks.crs.to_epsg(), field.crs.to_epsg()}
    refused = CliRunner().invoke(
        cli, ["tracks", str(tmp_path / "parcels.gpkg"), "--spacing", "9", "-o", str(out)]
    )
    assert "there already" in str(refused.exception)
    # The outlines of that file are parcels again; what geofield wrote beside them is no setting.
    again = run(out, "--spacing", "4", "-o", tmp_path / "again.gpkg")["fields"]
    assert [row["spacing_m"] for row in again] == [4.0] * 3


def test_many_polygons_make_a_farm(tmp_path: Path) -> None:
    outlines(3).to_file(tmp_path / "parcels.shp")
    rows = run(tmp_path / "parcels.shp", "--spacing", "8", "-o", tmp_path / "farm")["fields"]
    farm = read_farm(tmp_path / "farm")
    assert {row["field_id"] for row in rows} == set(farm.ids)
    assert (tmp_path / "farm" / "farm.gpkg").exists()
    assert {plan.tracks.spacing_m for plan in farm} == {8.0}


@pytest.mark.parametrize("wanted", [
    ["tracks", "--json", "-o", "all.gpkg"], ["tracks", "--json", "-o", "farm"],
    ["tracks", "--json", "--each", "-o", "plans"], ["batch", "--workers", "1", "--out", "farm"],
])  # fmt: skip
def test_what_is_told_of_fields_names_them_and_is_told_once(
    wanted: list[str], tmp_path: Path
) -> None:
    parcels = outlines(10)
    parcels.loc[:1, "name"] = "North"  # a name alone would be that of both
    ends = shapely.get_coordinates(parcels.geometry[9])[::-1].tolist()
    knot = [[502705, 5600081], [502704, 5600081], [502705, 5600080]]
    parcels.loc[9, "geometry"] = shapely.Polygon([[502704, 5600080], *knot, *ends])
    parcels.assign(id=range(10)).to_file(tmp_path / "parcels.gpkg")
    middles = parcels.geometry[:8].centroid
    rings = middles.buffer(np.arange(20.0, 28.0)).difference(middles.buffer(15.0))
    rings.to_file(tmp_path / "rings.gpkg")
    files = ["parcels.gpkg", "--obstacles", "rings.gpkg", "--spacing", "8"]
    result = run_geofield(wanted[0], *files, *wanted[1:], folder=tmp_path)
    assert result.returncode == 0, result.stderr
    notes = [line for line in result.stderr.splitlines() if line.startswith("Note: ")]
    (enclosed,) = (note for note in notes if "obstacles enclose" in note)
    assert enclosed.startswith("Note: North (0): 4 segments (")
    assert enclosed.endswith(
        "Likewise North (1), Field 3 (2), Field 4 (3), Field 5 (4), Field 6 (5) and 2 more."
    )
    (repaired,) = (note for note in notes if "was repaired" in note)
    assert repaired.startswith("Note: Field 10 (9): The field's outline was repaired")
    assert len(notes) == 2
    for at, row in enumerate(json.loads(result.stdout)["fields"] if "--json" in wanted else ()):
        words = "obstacles enclose" if at < 8 else "was repaired"
        assert [words in note for note in row["notes"]] == ([] if at == 8 else [True])
    # And of one field alone.
    parcels[9:].to_file(tmp_path / "parcels.gpkg")
    result = run_geofield("tracks", "parcels.gpkg", "--json", "-o", "one.gpkg", folder=tmp_path)
    (row,) = json.loads(result.stdout)["fields"]
    assert [f"Note: {note}" for note in row["notes"]] == result.stderr.splitlines()
    assert "was repaired" in row["notes"][0]


@pytest.mark.parametrize("target", ["all.gpkg", "farm", "plans"])
def test_parcels_that_overlap_are_told(target: str, tmp_path: Path) -> None:
    parcels = outlines(3)
    parcels.loc[1, "geometry"] = shapely.box(500190, 5600000, 500400, 5600080)
    parcels.to_file(tmp_path / "parcels.gpkg")
    each = ["--each"] if target == "plans" else []
    arguments = [str(tmp_path / "parcels.gpkg"), *each, "-o", str(tmp_path / target)]
    result = CliRunner().invoke(cli, ["tracks", *arguments])
    assert result.exception is None
    (note,) = (line for line in result.stderr.splitlines() if line.startswith("Note: "))
    assert "2 parcels overlap others, such as Field 1: it overlaps Field 2 by 0.08 ha" in note


def test_fields_that_fail_are_told_and_the_others_written(tmp_path: Path) -> None:
    frame = outlines(4).assign(spacing_m=[None, 900.0, 900.0, None])
    frame.loc[1:2, "name"] = "North"
    frame.to_file(tmp_path / "parcels.gpkg")
    for more in ((), ("--each",)):
        out = tmp_path / ("each" if more else "all")
        done = CliRunner().invoke(
            cli, ["tracks", str(tmp_path / "parcels.gpkg"), *more, "-o", str(out)]
        )
        assert "2 of 4 fields could not be planned" in str(done.exception)
        assert done.stderr.count("larger than the field") == 2
        assert done.stderr.count("\nNorth (50.5523N15.00") == 2
        assert len(list(out.glob("Field_*.gpkg")) if more else read_farm(out)) == 2


def test_what_cannot_be_read_is_refused(tmp_path: Path) -> None:
    places = gpd.GeoDataFrame(geometry=[shapely.Point(15, 50)], crs=4326)
    places.to_file(tmp_path / "places.geojson", driver="GeoJSON")
    result = CliRunner().invoke(
        cli, ["tracks", str(tmp_path / "places.geojson"), "-o", str(tmp_path / "x.gpkg")]
    )
    assert result.exit_code != 0
    assert "no polygons" in str(result.exception or result.output)
    outlines(1).to_file(tmp_path / "bare.shp")
    (tmp_path / "bare.prj").unlink()
    result = CliRunner().invoke(
        cli, ["tracks", str(tmp_path / "bare.shp"), "-o", str(tmp_path / "x.gpkg")]
    )
    assert "CRS" in str(result.exception or result.output)
    report = run(
        tmp_path / "bare.shp", "--crs", "EPSG:32633", "--spacing", "8", "-o", tmp_path / "x.gpkg"
    )
    assert len(report["fields"]) == 1  # type: ignore[arg-type]


def test_a_spacing_that_would_fill_the_memory_is_refused_at_once(tmp_path: Path) -> None:
    outlines(1).to_file(tmp_path / "parcel.shp")
    result = CliRunner().invoke(
        cli,
        ["tracks", str(tmp_path / "parcel.shp"), "--spacing", "1e-9", "--direction", "fewest",
         "-o", str(tmp_path / "plan.gpkg")],
    )  # fmt: skip
    assert isinstance(result.exception, TrackError)
    assert "2e+11 pieces of track; 1,000,000 are the most" in str(result.exception)
    assert not (tmp_path / "plan.gpkg").exists()


def test_a_spacing_of_a_centimetre_is_planned() -> None:
    (outline,) = outlines(1).geometry
    trees = list(shapely.points([(500050, 5600030), (500120, 5600050)]))
    tracks = plan_tracks(outline, trees, crs=CRS, spacing_m=0.01, clearance_m=5.0)
    assert len(tracks.lines) == 8003  # 80 m of the zone are 80.032 m on the ground
    assert len(tracks.segments) == 8003 + len(tracks.gaps)


def test_ever_more_edges_do_not_make_ever_more_directions() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 4000, endpoint=False)
    reach = 400.0 + np.where(np.arange(4000) % 2, 5.0, -5.0)
    saw = shapely.Polygon(np.column_stack((reach * np.cos(angle), reach * np.sin(angle))))
    assert len(candidate_angles(saw)) <= 600


def test_a_machine_of_the_settings_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("geofield.toml").write_text(
        "[machines.drill]\nwidth_m = 6\noverlap_m = 0.5\nturning_radius_m = 4\n"
    )
    outlines(1).to_file("parcel.shp")
    gpd.GeoDataFrame(
        {"radius_m": [2.0]}, geometry=gpd.points_from_xy([500100], [5600040]), crs=CRS
    ).to_file("tree.shp")
    report = run(
        "parcel.shp", "--obstacles", "tree.shp", "--machine", "drill", "--headland-passes", "2",
        "--route", "skip", "-o", "plan.gpkg",
    )  # fmt: skip
    (row,) = report["fields"]
    assert row["spacing_m"] == 5.5
    headland = pyogrio.read_dataframe("plan.gpkg", layer="headland")
    assert headland["width_m"].tolist() == [11.0]
    assert len(pyogrio.read_dataframe("plan.gpkg", layer="headland_tracks")) == 2
    # Half the width is kept from the tree, metre for metre on the ground.
    segments = pyogrio.read_dataframe("plan.gpkg", layer="segments")
    tree = shapely.Point(500100, 5600040)
    nearest_m = segments.distance(tree).min() / 0.9996
    assert nearest_m >= 5.0 - 1e-3


def test_plans_in_one_file_keep_what_stands_in_them(tmp_path: Path) -> None:
    """Planned again, tracks went through the trees, for only outlines were read."""
    outlines(2).to_file(tmp_path / "parcels.gpkg")
    places = [shapely.Point(500050 + 300 * k, 5600030).buffer(4) for k in range(2)]
    gpd.GeoDataFrame({"status": ["added", "rejected"]}, geometry=places, crs=CRS).to_file(
        tmp_path / "trees.gpkg"
    )
    made, again, farm = tmp_path / "made.gpkg", tmp_path / "again.gpkg", tmp_path / "farm"
    run(tmp_path / "parcels.gpkg", "--obstacles", tmp_path / "trees.gpkg", "--spacing", "5",
        "-o", made)  # fmt: skip
    run(made, "--spacing", "5", "-o", again)
    done = CliRunner().invoke(
        cli, ["batch", str(made), "--layer", "field", "--spacing", "5", "--out", str(farm),
              "--workers", "1"],
    )  # fmt: skip
    assert done.exception is None, done.output
    for file in (made, again, farm / "farm.gpkg"):
        standing = gpd.read_file(file, layer="obstacles").set_index("field_id")
        assert sorted(standing["status"]) == ["added", "rejected"]
        segments = gpd.read_file(file, layer="segments")
        avoided = standing[standing["status"] == "added"].geometry.iloc[0]
        passed = standing[standing["status"] == "rejected"].geometry.iloc[0]
        assert segments.intersection(avoided).length.sum() < 1e-6
        assert segments.intersection(passed).length.sum() > 5
    untold = CliRunner().invoke(cli, ["tracks", str(made), "-o", str(tmp_path / "two.gpkg")])
    assert "Obstacles  those of made.gpkg" in untold.output
    assert "keeps no settings of its fields: their spacing is 2 m" in untold.output


@pytest.mark.filterwarnings("ignore:.*non conformant file extension")
def test_a_plan_is_one_whatever_its_file_is_called(tmp_path: Path) -> None:
    """Of field.gpkg.bak, which is geofield's own, the outline alone was taken."""
    plan, earlier = SAMPLE / "field_1.gpkg", tmp_path / "field.gpkg.bak"
    shutil.copy(plan, earlier)
    lengths_m = {
        file.name: run(file, "--spacing", "6", "-o", tmp_path / f"{number}.gpkg")["fields"][0]
        for number, file in enumerate((plan, earlier))
    }
    assert lengths_m[earlier.name]["segment_count"] == lengths_m[plan.name]["segment_count"] > 31
    assert read_plan(earlier) == read_plan(plan)
    for places in (plan, earlier):
        (planned,) = gf.plan_fields(places, spacing_m=6)
        assert planned.tracks is not None
        standing = read_plan(plan).obstacles
        assert not planned.tracks.segments.intersects(standing.union_all().buffer(-0.01)).any()


def test_a_plan_that_lost_its_record_is_told(tmp_path: Path) -> None:
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    run(tmp_path / "parcel.gpkg", "--spacing", "5", "-o", tmp_path / "plan.gpkg")
    for layer in ("field", "tracks", "segments"):
        gpd.read_file(tmp_path / "plan.gpkg", layer=layer).to_file(
            tmp_path / "copy.gpkg", layer=layer
        )
    for name, lost in (("plan", False), ("copy", True)):
        files = f"{name}.gpkg", "-o", f"{name}_2.gpkg"
        done = run_geofield("tracks", *files, "--json", folder=tmp_path)
        assert done.returncode == 0, done.stderr
        assert ("has lost the record" in done.stderr) == lost
        (row,) = json.loads(done.stdout)["fields"]
        assert any("has lost the record" in note for note in row["notes"]) == lost


def test_tracks_that_were_imported_are_told_to_be_planned_anew(tmp_path: Path) -> None:
    """One that was taken away came back, at another spacing, without a word."""
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    plan, back = tmp_path / "plan.gpkg", tmp_path / "back.gpkg"
    run(tmp_path / "parcel.gpkg", "--spacing", "5", "-o", plan)
    told = []
    for arguments in (
        ["export", plan, "-f", "kml", "--out", tmp_path],
        ["import", tmp_path / "field.kml", "-o", back],
        ["tracks", back, "-o", back],
        ["tracks", back, "-o", back],
    ):
        done = run_geofield(*arguments)
        assert done.returncode == 0, done.stderr
        told.append(" ".join(done.stderr.split()))
    words = "back.gpkg has no record of how its tracks were planned (they were imported, perhaps)"
    assert [words in each for each in told] == [False, False, True, False]
    assert "the spacing is 2 m now" in told[2]


def test_a_blank_name_is_none(tmp_path: Path) -> None:
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    (row,) = run(tmp_path / "parcel.gpkg", "--name", "  ", "-o", tmp_path / "plan.gpkg")["fields"]
    assert row["name"] == "Field 1"


def test_options_of_one_field_are_refused_for_several(tmp_path: Path) -> None:
    """`--fresh` changed nothing there, without a word."""
    outlines(2).to_file(tmp_path / "parcels.gpkg")
    for option, told in ((["--fresh"], "--fresh is of the plan"), (["--name", "x"], "--name is")):
        done = run_geofield("tracks", tmp_path / "parcels.gpkg", *option, "-o", tmp_path / "f.gpkg")
        assert done.returncode == 2
        assert told in " ".join(done.stderr.split())


def test_a_file_that_is_read_is_never_replaced(tmp_path: Path) -> None:
    one, many, trees = (tmp_path / f"{name}.gpkg" for name in ("one", "many", "Field_1"))
    outlines(1).to_file(one)
    outlines(2).to_file(many)
    gpd.GeoDataFrame(
        {"radius_m": [3.0]}, geometry=gpd.points_from_xy([500050], [5600030]), crs=CRS
    ).to_file(trees)
    owned = {file: file.read_bytes() for file in (one, many, trees)}
    for words in (
        [one, "-o", one],
        [one, "--obstacles", trees, "-o", trees],
        [many, "--obstacles", trees, "-o", trees],
        [many, "--obstacles", trees, "--each", "-o", tmp_path],
    ):
        done = CliRunner().invoke(cli, ["tracks", *map(str, words), "--overwrite"])
        assert "is an input of this work" in str(done.exception)
        assert {file: file.read_bytes() for file in owned} == owned
    # Another one with several fields in it is replaced, and kept as the earlier one.
    made = tmp_path / "all.gpkg"
    run(many, "--spacing", "6", "-o", made)
    before = pyogrio.read_info(made, layer="tracks", force_feature_count=True)["features"]
    run(many, "--spacing", "8", "-o", made, "--overwrite")
    with closing(sqlite3.connect(tmp_path / "all.gpkg.bak")) as earlier:
        assert earlier.execute("SELECT count(*) FROM tracks").fetchone() == (before,)


def standing(path: Path, places: list[Any], crs: object = CRS, **columns: Any) -> Path:
    gpd.GeoDataFrame(columns or {"n": range(len(places))}, geometry=places, crs=crs).to_file(path)
    return path


def planned_around(
    parcels: Path, trees: Path, out: Path, code: int = 0, more: Sequence[str] = ()
) -> str:
    """What the command says, on one line."""
    where = ["tracks", str(parcels), "--obstacles", str(trees), "-o", str(out)]
    done = CliRunner().invoke(cli, [*where, "--spacing", "5", *more])
    assert done.exit_code == code or isinstance(done.exception, GeofieldError), done.output
    return " ".join(f"{done.output} {done.exception if code else ''}".split())


@pytest.mark.parametrize("size", ["4 m", -3.0, float("inf")])
def test_a_radius_that_is_no_length_is_refused_with_its_row(tmp_path: Path, size: object) -> None:
    """The points became circles of 2 m: 16.8 m of track in a crown of 6.5 m."""
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    trees = standing(
        tmp_path / "trees.gpkg", [shapely.Point(500050, 5600030)] * 2,
        radius_m=["3", size] if isinstance(size, str) else [3.0, size],
    )  # fmt: skip
    out = tmp_path / "plan.gpkg"
    assert "trees.gpkg, row 2: radius_m" in planned_around(tmp_path / "parcel.gpkg", trees, out, 1)
    assert not out.exists()


def test_sizes_of_points_are_taken_as_they_are_meant(tmp_path: Path) -> None:
    """A decimal comma is one, and a wood far off reaches in by its radius."""
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    east, south = outlines(1).total_bounds[2], 5600030
    trees = standing(
        tmp_path / "trees.gpkg", [shapely.Point(500050, south), shapely.Point(east + 120, south)],
        radius_m=["6,5", "150"],
    )  # fmt: skip
    planned_around(tmp_path / "parcel.gpkg", trees, tmp_path / "plan.gpkg")
    found = gpd.read_file(tmp_path / "plan.gpkg", layer="obstacles")
    assert found["radius_m"].tolist() == [6.5, 150.0]


def test_a_wood_that_just_reaches_in_near_the_equator_is_not_told_as_elsewhere(
    tmp_path: Path,
) -> None:
    """Degrees of latitude are 0.7 % shorter there: a wood of 100 m seemed to end 20 cm before."""
    parcel = shapely.box(558000, 11000, 558100, 11080)
    outline = gpd.GeoDataFrame(geometry=[parcel], crs=32636)
    outline.to_file(tmp_path / "parcel.gpkg")
    wood = shapely.Point(558050, 11080 + 99.8)
    trees = standing(tmp_path / "trees.gpkg", [wood], 32636, radius_m=[100.0])
    said = planned_around(tmp_path / "parcel.gpkg", trees, tmp_path / "plan.gpkg")
    assert len(gpd.read_file(tmp_path / "plan.gpkg", layer="obstacles")) == 1
    assert "avoided" not in said


def test_all_layers_of_a_file_of_obstacles_are_avoided(tmp_path: Path) -> None:
    """Only the first was: of a KML with folders, or trees beside fences, the rest was lost."""
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    trees = tmp_path / "mine.gpkg"
    here = shapely.Point(500050, 5600030)
    for layer, shape in (
        ("fences", shapely.LineString([(500020, 5600020), (500070, 5600020)])),
        ("trees", here),
    ):
        table = gpd.GeoDataFrame({"radius_m": [3.0]}, geometry=[shape], crs=CRS)
        (table if layer == "fences" else table.to_crs(4326)).to_file(trees, layer=layer)
    said = planned_around(tmp_path / "parcel.gpkg", trees, tmp_path / "plan.gpkg")
    assert "what all its layers hold is avoided: fences, trees" in said
    found = gpd.read_file(tmp_path / "plan.gpkg", layer="obstacles")
    assert len(found) == 2
    assert found.contains(here).any()
    # A plan in which nothing stands is no file of obstacles: its tracks would be.
    run(tmp_path / "parcel.gpkg", "-o", tmp_path / "bare.gpkg", "--spacing", "6")
    told = planned_around(tmp_path / "parcel.gpkg", tmp_path / "bare.gpkg", tmp_path / "no.gpkg", 1)
    assert "is a plan in which no obstacle stands" in told


def test_a_fence_in_a_file_is_as_wide_as_it_says(tmp_path: Path) -> None:
    """A margin beside a line was written down, and the tracks came to within 5 cm of the wire."""
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    y = np.array([20.0, 30.0, 40.0, 50.0]) + 5600000
    fences = gpd.GeoDataFrame(
        {"radius": [None, None, "1,5", "0,5"], "buffer_m": [None, 2.0, None, 1.0]},
        geometry=[shapely.LineString([(500020, v), (500070, v)]) for v in y],
        crs=CRS,
    )
    fences.to_file(tmp_path / "fences.gpkg")
    planned_around(tmp_path / "parcel.gpkg", tmp_path / "fences.gpkg", tmp_path / "plan.gpkg")
    found = gpd.read_file(tmp_path / "plan.gpkg", layer="obstacles")
    high = found.bounds["maxy"] - found.bounds["miny"]
    assert high.tolist() == pytest.approx([0.1, 4.1, 3.0, 3.0], rel=0.001)
    assert found["radius_m"].isna().all()
    fences.assign(buffer_m="wide").to_file(tmp_path / "words.gpkg")
    told = planned_around(tmp_path / "parcel.gpkg", tmp_path / "words.gpkg", tmp_path / "no", 1)
    assert "'wide' is no length" in told


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_trees_in_a_table_of_latitudes_and_longitudes(tmp_path: Path, mark: str) -> None:
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    here = gpd.GeoSeries([shapely.Point(500050, 5600030)], crs=CRS).to_crs(4326)[0]
    rows = [["name", "Lat", "Lon", "radius_m"], ["oak", f"{here.y}", f"{here.x}", "3.5"]]
    if mark == ";":
        rows[1] = [each.replace(".", ",") for each in rows[1]]
    trees = tmp_path / "trees.csv"
    trees.write_text("\n".join(mark.join(row) for row in rows), encoding="utf-8-sig")
    planned_around(tmp_path / "parcel.gpkg", trees, tmp_path / "plan.gpkg")
    found = gpd.read_file(tmp_path / "plan.gpkg", layer="obstacles")
    assert found["radius_m"].tolist() == [3.5]
    assert found.geometry[0].centroid.distance(shapely.Point(500050, 5600030)) < 0.01
    trees.write_text("name,up,right\noak,1,2\n")
    told = planned_around(tmp_path / "parcel.gpkg", trees, tmp_path / "no.gpkg", 1)
    assert "no columns lat and lon" in told
    trees.write_text("\n".join(mark.join(row) for row in rows).replace("oak", "öak"), "cp1252")
    told = planned_around(tmp_path / "parcel.gpkg", trees, tmp_path / "no.gpkg", 1)
    assert "Save it as UTF-8" in told  # bytes are no name of a tree
    metres = [["North", "East", "radius_m"], ["5600030", "500050", "3"]]
    trees.write_text("\n".join(map(mark.join, metres)))
    assert "does not say its CRS" in planned_around(tmp_path / "parcel.gpkg", trees, tmp_path, 1)
    out = tmp_path / "metres.gpkg"
    planned_around(tmp_path / "parcel.gpkg", trees, out, more=["--crs", f"EPSG:{CRS}"])
    found = gpd.read_file(tmp_path / "metres.gpkg", layer="obstacles")
    assert found.geometry[0].centroid.distance(shapely.Point(500050, 5600030)) < 0.01


def test_geoparquet_is_a_vector_file(tmp_path: Path) -> None:
    """GDAL as pyogrio brings it reads none: "Is the file whole?"."""
    from geofield.cli.parcels import parcel_and_point

    parcel = outlines(1).to_crs(4326)
    parcel.to_parquet(tmp_path / "parcel.parquet")
    field, lat, lon = parcel_and_point(tmp_path / "parcel.parquet", None, None, None, None)
    assert field is not None
    assert parcel.geometry.iloc[0].contains(shapely.Point(lon, lat))
    tree = gpd.GeoDataFrame({"radius_m": [3.0]}, geometry=[shapely.Point(lon, lat)], crs=4326)
    tree.to_parquet(tmp_path / "trees.parquet")
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    planned_around(tmp_path / "parcel.gpkg", tmp_path / "trees.parquet", tmp_path / "plan.gpkg")
    assert len(gpd.read_file(tmp_path / "plan.gpkg", layer="obstacles")) == 1


@pytest.mark.parametrize("several", [1, 2])
def test_obstacles_that_are_not_avoided_are_told(tmp_path: Path, several: int) -> None:
    outlines(several).to_file(tmp_path / "parcels.gpkg")
    here = shapely.Point(500050, 5600030)
    for name, places, crs, told in (
        ("elsewhere", [here], 32632, "no obstacle in it stands at a field"),
        ("empty", [], CRS, "holds no shape: NOTHING of it is avoided"),
        ("half", [here, None], CRS, "1 row has no shape and is not avoided: row 2"),
        ("right", [here], CRS, ""),
    ):
        trees = standing(tmp_path / f"{name}.gpkg", places, crs, radius_m=[3.0] * len(places))
        said = planned_around(tmp_path / "parcels.gpkg", trees, tmp_path / f"{name}_plan.gpkg")
        assert told in said
        assert ("avoided" in said) == bool(told)


def test_a_plan_behind_a_link_is_saved_where_it_is(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    plan, link = tmp_path / "real" / "plan.gpkg", tmp_path / "link.gpkg"
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    run(tmp_path / "parcel.gpkg", "--spacing", "5", "-o", plan)
    link.symlink_to(plan)
    run(link, "--spacing", "8", "-o", link)
    assert link.is_symlink()
    assert read_plan(plan).tracks.spacing_m == 8.0
    # Whoever saves it, as the review page does.
    save_plan(replace(read_plan(plan), tracks=None), link, read_from=link)
    assert link.is_symlink()
    assert read_plan(plan).tracks is None
    assert [each.name for each in tmp_path.glob("link*")] == ["link.gpkg"]


def test_what_a_person_keeps_in_a_plan_comes_along_or_is_refused(tmp_path: Path) -> None:
    plan = tmp_path / "plan.gpkg"
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    run(tmp_path / "parcel.gpkg", "--spacing", "8", "-o", plan)
    outlines(1).set_geometry(outlines(1).boundary).to_file(plan, layer="route")
    with closing(sqlite3.connect(plan)) as file, file:
        file.execute("CREATE TABLE visits (id INTEGER PRIMARY KEY, memo TEXT)")
        file.execute("INSERT INTO visits VALUES (7, 'wet corner')")
        file.execute("CREATE VIEW wet AS SELECT memo FROM visits")
        file.execute("INSERT INTO gpkg_metadata VALUES (2, 'dataset', 'qgis', 'text/xml', '<a/>')")
        file.execute(
            "INSERT INTO gpkg_metadata_reference "
            "VALUES ('table', 'obstacles', NULL, NULL, '2026-01-01T00:00:00.000Z', 2, NULL)"
        )
    for spacing in ("6", "5"):
        with pytest.warns(FormatWarning, match="'route' is not geofield's"):
            run(plan, "--spacing", spacing, "-o", plan)
    with closing(sqlite3.connect(plan)) as file:
        assert file.execute("SELECT * FROM visits").fetchall() == [(7, "wet corner")]
        assert file.execute("SELECT * FROM wet").fetchall() == [("wet corner",)]
        noted = "SELECT table_name, metadata FROM gpkg_metadata_reference JOIN gpkg_metadata "
        noted += "ON md_file_id = id WHERE table_name IS NOT NULL"
        assert file.execute(noted).fetchall() == [("obstacles", "<a/>")]
    assert gpd.read_file(plan, layer="route")["name"].tolist() == ["Field 1"]
    # Where the plan has such a layer itself, nothing is lost either.
    before = plan.read_bytes()
    with pytest.warns(FormatWarning, match="'route' is not geofield's"):
        done = CliRunner().invoke(cli, ["tracks", str(plan), "--route", "skip", "-o", str(plan)])
    assert "route cannot be taken along from the plan.gpkg that is there" in str(done.exception)
    assert plan.read_bytes() == before


@pytest.mark.filterwarnings("ignore:Between passes:geofield.errors.TrackWarning")
@pytest.mark.parametrize(
    ("how", "covered", "overlap"),
    [
        (("--spacing", "8"), 100.0, 0.0),
        # Ten strips of 4 m in 80 m; ten of 10 m, of which the outer ones begin at the border.
        (("--spacing", "8", "--width", "4"), 50.0, 0.0),
        (("--width", "10", "--overlap", "2"), 100.0, 22.5),
        (("--width", "10", "--overlap", "-10"), 50.0, 0.0),
    ],
)
def test_what_is_covered_is_what_the_machine_works(
    tmp_path: Path, how: tuple[str, ...], covered: float, overlap: float
) -> None:
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    plan = tmp_path / "plan.gpkg"
    row = run(tmp_path / "parcel.gpkg", *how, "--direction", "90", "-o", plan)
    found = row["fields"][0] if "fields" in row else row
    assert found["coverage_percent"] == pytest.approx(covered, abs=0.2)
    read = gf.read_plan(plan).tracks
    assert read is not None
    assert read.statistics.coverage_percent == pytest.approx(covered, abs=0.2)
    assert read.statistics.overlap_percent == pytest.approx(overlap, abs=0.2)
    between = {"4": "4.00", "-10": "10.00"}.get(how[-1])
    told = [note for note in read.notes if "stay unworked" in note]
    assert len(told) == (between is not None)
    assert not told or told[0].startswith(f"Between passes {between} m stay unworked")


@pytest.mark.filterwarnings("ignore:Of 10 tracks:geofield.errors.TrackWarning")
def test_more_tracks_to_skip_than_there_are_is_told(tmp_path: Path) -> None:
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    arguments = (tmp_path / "parcel.gpkg", "--spacing", "8", "--direction", "90", "--route", "skip")
    for skip, told in (("100", True), ("9", True), ("8", False)):
        plan = tmp_path / f"{skip}.gpkg"
        run(*arguments, "--skip", skip, "-o", plan)
        notes = gf.read_plan(plan).tracks.notes
        assert any(f"Of 10 tracks {skip} cannot be left out" in note for note in notes) == told


def test_an_offset_on_a_plan_with_a_line_is_told_the_way_out(tmp_path: Path) -> None:
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    plan, middle = tmp_path / "plan.gpkg", outlines(1).to_crs(4326).geometry[0].centroid
    line = (middle.x, middle.y, middle.x + 0.0005, middle.y)
    run(tmp_path / "parcel.gpkg", "--spacing", "8", "--ab-lonlat", *map(str, line), "-o", plan)
    again = ["tracks", str(plan), "--offset", "3", "--spacing", "8", "-o", str(plan)]
    error = CliRunner().invoke(cli, again).exception
    assert isinstance(error, TrackError)
    assert "--defaults" in str(error.hint)
    run(*again[1:], "--defaults")


@pytest.mark.parametrize(
    "place",
    [
        # A slip in one digit of A turned the tracks by 90 degrees.
        ("--ab-lonlat", "15.0", "51.54", "15.002", "50.54"),
        ("--through-lonlat", "15.001", "51.54"),
        ("--route", "shortest", "--start-lonlat", "16.5", "50.54"),
    ],
)
def test_a_place_far_from_the_field_is_a_slip(tmp_path: Path, place: tuple[str, ...]) -> None:
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    arguments = ["tracks", str(tmp_path / "parcel.gpkg"), "--spacing", "8", *place]
    error = CliRunner().invoke(cli, [*arguments, "-o", str(tmp_path / "plan.gpkg")]).exception
    assert isinstance(error, TrackError)
    assert "far from the field." in error.message
    assert "20 km" in str(error.hint)
    assert not (tmp_path / "plan.gpkg").exists()


@pytest.mark.parametrize(
    ("how", "told"),
    [
        (("--width", "6"), "a machine of 6 m reaches 1.5 m into obstacles: --clearance 3 "),
        (("--width", "6", "--clearance", "1"), "reaches 0.5 m into"),
        (("--width", "6", "--clearance", "3"), None),
        (("--width", "3"), None),
        (("--spacing", "6"), None),
    ],
)
def test_a_machine_whose_side_is_in_a_tree_is_told(
    tmp_path: Path, how: tuple[str, ...], told: str | None
) -> None:
    outlines(1).to_file(tmp_path / "parcel.gpkg")
    trees = {"radius_m": [4.0, 3.0], "buffer_m": [1.5, 2.0]}
    places = [shapely.Point(500050, 5600040), shapely.Point(500120, 5600020)]
    gpd.GeoDataFrame(trees, geometry=places, crs=CRS).to_file(tmp_path / "trees.gpkg")
    arguments = ["tracks", str(tmp_path / "parcel.gpkg"), *how]
    arguments += ["--obstacles", str(tmp_path / "trees.gpkg"), "-o", str(tmp_path / "plan.gpkg")]
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", TrackWarning)
        assert CliRunner().invoke(cli, arguments).exception is None
    notes = gf.read_plan(tmp_path / "plan.gpkg").tracks.notes
    assert list(notes) == [str(each.message) for each in found]
    assert len(notes) == (0 if told is None else 1)
    assert told is None or told in notes[0]


@pytest.mark.parametrize("suffix", ["geojson", "gpkg"])
def test_rows_without_a_shape_are_left_out_as_by_import(suffix: str, tmp_path: Path) -> None:
    file, plan = tmp_path / f"parcels.{suffix}", tmp_path / "plan.gpkg"
    frame = outlines(3).to_crs("OGC:CRS84")
    frame.loc[1, "geometry"] = None
    frame.to_file(file)
    words = "1 row has no shape and is left out: row 2."
    done = run_geofield("tracks", file, "--spacing", 20, "-o", plan, check=True)
    assert f"parcels.{suffix}: {words}" in done.stderr
    assert len(gpd.read_file(plan, layer="field")) == 2
    # One that is left is a plan of its own; none is an error.
    frame.iloc[:2].to_file(file)
    done = run_geofield("import", file, "-o", tmp_path / "imported.gpkg", check=True)
    assert words in done.stderr
    run_geofield("tracks", file, "--spacing", 20, "-o", plan, "--overwrite", check=True)
    assert read_plan(plan).tracks is not None
    frame.iloc[1:2].to_file(file)
    assert run_geofield("tracks", file, "--spacing", 20, "-o", tmp_path / "no.gpkg").returncode == 1


@pytest.mark.parametrize("archive", [False, True])
def test_a_shapefile_without_its_index_is_told_as_by_import(archive: bool, tmp_path: Path) -> None:
    file = tmp_path / "parcels.shp"
    outlines(2).to_file(file)
    file.with_suffix(".shx").unlink()
    if archive:
        file = Path(shutil.make_archive(str(tmp_path.with_suffix("")), "zip", tmp_path))
    target = ("-o", tmp_path / "plan.gpkg")
    said = [
        run_geofield(*words, *target).stderr
        for words in (("import", file), ("tracks", file, "--spacing", 20))
    ]
    assert said[0] == said[1]
    assert "parcels.shp lacks its .shx index.\nCopy all files of the Shapefile." in said[0]
