"""`geofield import`: what other people's layers are taken as, and that it is always said."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import geopandas as gpd
import numpy as np
import pytest
import shapely
import shapely.affinity
from formats_plan import make_dataset

from geofield.formats import FORMATS, read_dataset, write_dataset
from geofield.formats.export import dropped
from geofield_command import run_geofield as geofield

BOX = shapely.box(500_000, 5_500_000, 500_200, 5_500_100)
POND = shapely.box(500_050, 5_500_020, 500_070, 5_500_040)
TREES = [shapely.Point(500_100 + 9 * i, 5_500_050).buffer(3) for i in range(3)]
LINES = [shapely.LineString([(500_000, 5_500_000 + y), (500_200, 5_500_000 + y)]) for y in (4, 8)]


def write(path, shapes, **columns):
    gpd.GeoDataFrame(columns, geometry=list(shapes), crs="EPSG:32633").to_file(path)
    return path


def imported(folder, *files):
    done = geofield("import", *files, "-o", folder / "plan.gpkg", "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), done.stderr, read_dataset(folder / "plan.gpkg")


@pytest.mark.parametrize("name", [
    "whole_farm", "Baumgarten", "street_12", "Singapore", "Turner_farm", "Route66", "headland",
    "tree", "interior", "gaps",
])  # fmt: skip
def test_a_lone_polygon_is_the_field_whatever_its_name(tmp_path, name):
    found, said, back = imported(tmp_path, write(tmp_path / f"{name}.shp", [BOX]))
    assert found["rows"] == {"field": 1}
    assert f"{name}: 1 polygon taken as the field" in said
    assert back.table("field").geometry.iloc[0].symmetric_difference(BOX).area < 0.1


@pytest.mark.parametrize("name", ["Singapore", "Turner", "Route66", "turns", "gaps"])
def test_lines_never_vanish(tmp_path, name):
    found, said, _ = imported(tmp_path, write(tmp_path / f"{name}.shp", LINES))
    assert found["rows"] == {"tracks": 2, "segments": 2}
    assert f"{name}: 2 lines taken as guidance" in said


@pytest.mark.parametrize(("trees", "field"), [
    ("obstacles", "a"), ("AreaFeature", "b"), ("old trees", "boundary"), ("x", "Feldgrenze"),
    ("z_border_stones", "Baumgarten"), ("a", "tree_nursery"),
])  # fmt: skip
def test_words_columns_and_place_tell_obstacles_from_fields(tmp_path, trees, field):
    folder = tmp_path / "stick"
    folder.mkdir()
    write(folder / f"{trees}.shp", [POND, *TREES])
    write(folder / f"{field}.shp", [BOX])
    found, said, back = imported(tmp_path, folder)
    assert found["rows"] == {"field": 1, "obstacles": 4}
    assert back.table("field").area.iloc[0] == pytest.approx(20_000)
    assert f"{trees}: 4 polygons" in said
    assert f"{field}: 1 polygon taken as the field" in said


def test_a_field_in_an_archive_is_called_after_the_archive(tmp_path):
    folder = tmp_path / "inside"
    folder.mkdir()
    write(folder / "a.shp", [BOX])
    archive = shutil.make_archive(str(tmp_path / "North meadow"), "zip", folder)
    _, _, back = imported(tmp_path, archive)
    assert list(back.table("field")["name"]) == ["North meadow"]


def test_one_tree_in_a_file_of_its_own(tmp_path):
    tree = write(tmp_path / "pappel.shp", [POND])
    found, said, _ = imported(tmp_path, tree, write(tmp_path / "Schlag 7.shp", [BOX]))
    assert found["rows"] == {"field": 1, "obstacles": 1}
    assert found["name"] == "Schlag 7"
    assert "pappel: its polygon lies in another one: taken as an obstacle" in said


def test_numbers_that_no_obstacle_can_have_are_told_and_replaced_at_once(tmp_path):
    trees = write(tmp_path / "trees.geojson", TREES, number=[0, 3_000_000_000, 2])
    _, said, back = imported(tmp_path, write(tmp_path / "field.shp", [BOX]), trees)
    assert "0, 3000000000 is no whole number from 1" in said
    assert back.table("obstacles")["obstacle_no"].tolist() == [2, 3, 4]


def test_columns_tell_circles_of_a_person(tmp_path):
    folder = tmp_path / "stick"
    folder.mkdir()
    write(folder / "schicht1.shp", TREES, radius_m=[2.5] * 3)
    found, _, _ = imported(tmp_path, folder)
    assert found["rows"] == {"obstacles": 3}


def test_what_is_left_out_is_said(tmp_path):
    folder = tmp_path / "stick"
    folder.mkdir()
    write(folder / "boundary.shp", [BOX])
    write(folder / "headland.shp", [BOX.difference(BOX.buffer(-8))])
    write(folder / "ab.shp", LINES)
    write(folder / "turns.shp", LINES)
    found, said, _ = imported(tmp_path, folder)
    assert found["rows"] == {"field": 1, "tracks": 2, "segments": 2}
    assert "headland: 1 polygon left out" in said
    assert "turns: 2 lines left out" in said
    assert found["taken"] == [line for line in said.splitlines() if ": " in line]


def test_a_fence_is_no_guidance(tmp_path):
    """A machine was steered along it; and what came beside a plan's own obstacles was dropped."""
    dataset = make_dataset()
    write_dataset(dataset, tmp_path, ["geojson"], tell_drops=False)
    west, south, east, north = dataset.table("field").total_bounds
    line = shapely.LineString([(west + 5, south + 5), (east - 5, north - 5)])
    fence = gpd.GeoDataFrame({"radius_m": [0.5]}, geometry=[line], crs=dataset.crs).to_crs(4326)
    fence.to_file(tmp_path / "geojson" / "fences.geojson")
    _, said, plan = imported(tmp_path, tmp_path / "geojson")
    assert "fences: 1 line taken as obstacles, by name" in said
    before, now = dataset.table("obstacles"), plan.table("obstacles")
    assert len(now) == len(before) + 1
    assert now["obstacle_no"].is_unique
    assert now["obstacle_no"].tolist()[:-1] == before["obstacle_no"].tolist()
    assert now.area.iloc[-1] == pytest.approx(line.length, rel=0.01)
    assert len(plan.table("tracks")) == len(dataset.table("tracks"))


@pytest.mark.parametrize(
    ("name", "column"), [("k.kml", "Name"), ("g.gpx", "name"), ("o.geojson", "barrier")]
)
def test_a_fence_among_guidance_is_no_guidance(tmp_path, name, column):
    """Placemarks, recorded tracks and ways of maps lie in one layer and have names or kinds."""
    lines = [*LINES, *(shapely.affinity.translate(line, 0, 30) for line in LINES)]
    names = ["Fence east", "AB hedge side", "Heckenweg", "Zaun 2"]
    there = gpd.GeoDataFrame({column: names}, geometry=lines, crs=32633).to_crs(4326)
    there.to_file(tmp_path / name)
    _, said, plan = imported(tmp_path, tmp_path / name)
    assert "2 lines taken as obstacles, by name" in said
    assert "2 lines taken as guidance" in said
    assert plan.table("obstacles").area.to_numpy() == pytest.approx([20, 20], rel=0.01)
    assert len(plan.table("tracks")) == 2


def test_polygons_that_say_what_they_are_need_no_layer_of_their_own(tmp_path):
    """A pond beside the field was a second field."""
    beside = shapely.box(500_210, 5_500_020, 500_230, 5_500_040)
    shapes = [BOX, beside, POND]
    file = write(tmp_path / "map.shp", shapes, name=["Am Graben", "x", "y"], type=["", "pond", ""])
    _, said, plan = imported(tmp_path, file)
    assert "map: 1 polygon taken as the field" in said
    assert plan.table("field").geometry.iloc[0].symmetric_difference(BOX).area < 0.1
    assert len(plan.table("obstacles")) == 2


def test_rows_without_a_shape_are_told(tmp_path):
    """They were left out without a word."""
    nowhere = write(tmp_path / "field.gpkg", [BOX, None, shapely.Polygon()], name=["a", "b", "c"])
    _, said, plan = imported(tmp_path, nowhere)
    assert plan.name == "a"
    assert "field.gpkg: field: 2 rows have no shape and are left out" in said


def test_own_columns_of_guidance_come_back(tmp_path):
    """They were gone where the tracks are made of it: a Shapefile has no layer of whole ones."""
    dataset = make_dataset()
    segments = dataset.table("segments")
    numbers = [f"driver {no}" for no in range(len(segments))]
    tables = {**dataset.tables, "segments": segments.assign(driver=numbers)}
    write_dataset(replace(dataset, tables=tables), tmp_path, ["shapefile"], tell_drops=False)
    _, _, plan = imported(tmp_path, tmp_path / "shapefile")
    assert plan.table("segments")["driver"].tolist() == numbers


def test_tracks_of_a_file_without_segments_are_driven(tmp_path):
    """A plan that came as KML steered a machine along nothing: its guidance was empty."""
    dataset = make_dataset()
    write_dataset(dataset, tmp_path, ["kml"], tell_drops=False)
    told, _, _ = imported(tmp_path, tmp_path / "field.kml")
    assert told["rows"]["segments"] == len(dataset.table("segments"))
    done = geofield("export", tmp_path / "plan.gpkg", "-f", "shapefile", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    driven = gpd.read_file(tmp_path / "shapefile/guidance.shp").to_crs(dataset.crs)
    lost = dataset.table("tracks").union_all().difference(driven.union_all().buffer(0.01))
    assert lost.length < 0.01


def test_a_shape_that_is_drawn_anew_after_an_import_is_no_circle(tmp_path):
    """Nobody had recorded the imported one: the radius of the tree stayed with a shed."""
    write_dataset(make_dataset(), tmp_path, ["geojson"], tell_drops=False)
    _, _, plan = imported(tmp_path, tmp_path / "geojson")
    table = plan.table("obstacles").set_index("obstacle_no")
    assert (table["status"][2], table["radius_m"][2]) == ("confirmed", pytest.approx(3.125))
    middle = table.geometry[2].centroid
    shed = shapely.box(middle.x - 1, middle.y - 5, middle.x + 1, middle.y + 5)
    edited = plan.table("obstacles").copy()
    edited.loc[edited["obstacle_no"] == 2, "geometry"] = shed
    edited.to_file(tmp_path / "plan.gpkg", layer="obstacles", geometry_name="geom")
    done = geofield("tracks", tmp_path / "plan.gpkg", "--spacing", 5, "-o", tmp_path / "plan.gpkg")
    assert done.returncode == 0, done.stderr
    assert "obstacles: 1 changed" in done.stderr
    now = read_dataset(tmp_path / "plan.gpkg").table("obstacles").set_index("obstacle_no")
    assert np.isnan(now["radius_m"][2])
    assert now.geometry[2].equals_exact(shed, 1e-6)


def test_a_route_of_another_file_name_is_no_guidance(tmp_path):
    """It has all columns of a segment: what was driven between tracks was a track."""
    write_dataset(make_dataset(optional=True), tmp_path, ["geojson"], tell_drops=False)
    (tmp_path / "one").mkdir()
    for name, copy in (("field", "field"), ("route", "route (1)")):
        shutil.copy(tmp_path / f"geojson/{name}.geojson", tmp_path / f"one/{copy}.geojson")
    told, _, _ = imported(tmp_path, tmp_path / "one")
    assert told["rows"] == {"field": 1, "route": 1}


def test_nothing_found_is_an_error(tmp_path):
    empty = tmp_path / "empty.geojson"
    empty.write_text('{"type": "FeatureCollection", "features": []}')
    nowhere = tmp_path / "nowhere.geojson"
    nowhere.write_text(
        '{"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {}, '
        '"geometry": null}]}'
    )
    for file in (empty, nowhere):
        done = geofield("import", file, "-o", tmp_path / "plan.gpkg")
        assert done.returncode == 1
        assert "holds no geometries" in done.stderr
    assert not (tmp_path / "plan.gpkg").exists()


OPEN_RING = "15.0,50.0,0 15.002,50.0,0 15.002,50.001,0 15.0,50.001,0"
OPEN_FILES = {
    "open.kml": f"""<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2"><Document><Placemark><name>Acker</name><Polygon>
<outerBoundaryIs><LinearRing><coordinates>{OPEN_RING}</coordinates></LinearRing>
</outerBoundaryIs></Polygon></Placemark></Document></kml>""",
    "open.geojson": """{"type": "Feature", "properties": {"name": "Acker"}, "geometry": {"type":
"Polygon", "coordinates": [[[15, 50], [15.002, 50], [15.002, 50.001], [15, 50.001]]]}}""",
}


@pytest.mark.parametrize("name", list(OPEN_FILES))
def test_rings_that_are_not_closed_are_closed_and_that_is_said(tmp_path, name):
    (tmp_path / name).write_text(OPEN_FILES[name], encoding="utf-8")
    found, said, back = imported(tmp_path, tmp_path / name)
    assert "1 with rings that were not closed" in said
    assert found["name"] == "Acker"
    ring = back.table("field").to_crs(4326).geometry.iloc[0]
    assert shapely.equals_exact(
        shapely.normalize(ring), shapely.normalize(shapely.box(15, 50, 15.002, 50.001)), 1e-9
    )
    for command in ("tracks", "info", "validate"):
        extra = ["--spacing", "4", "-o", tmp_path / "t.gpkg"] if command == "tracks" else []
        done = geofield(command, tmp_path / name, *extra)
        assert "Traceback" not in done.stderr


def test_rings_of_two_points_are_left_out_and_that_is_said(tmp_path):
    ring = json.loads(OPEN_FILES["open.geojson"])
    line = json.loads(OPEN_FILES["open.geojson"])
    line["geometry"]["coordinates"] = [[[15, 50], [15.002, 50]]]
    (tmp_path / "two.geojson").write_text(
        json.dumps({"type": "FeatureCollection", "features": [line, ring]})
    )
    found, said, _ = imported(tmp_path, tmp_path / "two.geojson")
    assert found["rows"] == {"field": 1}
    assert "1 without a shape that can be" in said


@pytest.mark.parametrize("name", ["A.GEOJSON", "A.PARQUET", "A.FGB", "A.SHP"])
def test_folders_of_files_in_capitals(tmp_path, name):
    """As sticks with old file systems have them."""
    folder = tmp_path / "stick"
    folder.mkdir()
    frame = gpd.GeoDataFrame(geometry=[BOX], crs="EPSG:32633")
    if name.endswith("PARQUET"):
        frame.to_parquet(folder / name)
    else:
        suffix = name[1:].lower()
        frame.to_file(folder / f"a{suffix}")
        for part in list(folder.iterdir()):
            part.rename(folder / part.name.upper())
    assert len(read_dataset(folder).table("field")) == 1


def test_a_hole_of_another_file_keeps_its_name(tmp_path):
    """Only what was in its own columns came along."""
    pond = write(tmp_path / "duck pond.shp", [POND], depth=[3])
    _, _, plan = imported(tmp_path, write(tmp_path / "field.shp", [BOX]), pond)
    assert plan.table("obstacles")["name"].tolist() == ["duck pond"]
    assert plan.table("obstacles")["depth"].tolist() == [3]


def test_columns_of_imported_lines_are_of_the_tracks_too(tmp_path):
    """They lay in the segments alone, which KML has not."""
    lines = write(tmp_path / "ab.gpkg", LINES, note=["a", "b"], swath=[7, 8], code=[2**60, 1])
    imported(tmp_path, write(tmp_path / "field.shp", [BOX]), lines)
    done = geofield(
        "export", tmp_path / "plan.gpkg", "-f", "kml,shapefile", "--out", tmp_path / "o"
    )
    assert (done.returncode, "of your own" in done.stderr) == (0, False)
    for place in (tmp_path / "plan.gpkg", tmp_path / "o/field.kml", tmp_path / "o/shapefile"):
        plan = read_dataset(place)
        for layer in ("tracks", "segments"):
            assert plan.table(layer)["note"].tolist() == ["a", "b"]
            assert [int(code) for code in plan.table(layer)["code"]] == [2**60, 1]
    tables = dict(plan.tables, segments=plan.table("segments").assign(note=["a", "c"]))
    write_with = replace(plan, tables=tables)
    assert dropped(write_with, FORMATS["kml"])[-1] == "columns of your own in segments"
    assert "columns of your own in tracks" in dropped(write_with, FORMATS["shapefile"])


def test_files_of_a_folder_that_are_not_read_are_told(tmp_path):
    """Of a stick with a boundary and trees of two formats only one was read, without a word."""
    folder = tmp_path / "stick"
    folder.mkdir()
    write(folder / "boundary.shp", [BOX])
    write(folder / "trees.geojson", TREES)
    found, said, _ = imported(tmp_path, folder)
    assert found["rows"] == {"obstacles": 3}
    assert "nothing else: boundary.shp must be named" in said
    found, said, _ = imported(tmp_path, folder, folder / "boundary.shp", "--overwrite")
    assert found["rows"] == {"field": 1, "obstacles": 3}


@pytest.mark.parametrize("files", [("edge.shp", "stones.shp"), ("stones.shp", "edge.shp")])
def test_polygons_in_the_outline_of_another_file_are_obstacles(tmp_path, files):
    write(tmp_path / "edge.shp", [BOX])
    write(tmp_path / "stones.shp", [POND, *TREES])
    found, said, _ = imported(tmp_path, *(tmp_path / file for file in files))
    assert found["rows"] == {"field": 1, "obstacles": 4}
    assert "stones: 4 polygons taken as obstacles" in said


def test_polygons_that_lie_in_no_other_outline_or_in_two_are_not_guessed(tmp_path):
    edge = write(tmp_path / "edge.shp", [BOX])
    stones = write(tmp_path / "stones.shp", [POND, *TREES])
    over = write(tmp_path / "over.shp", [POND, shapely.affinity.translate(POND, 140)])
    around = write(tmp_path / "around.shp", [BOX.buffer(50)])
    for files in ((stones,), (over, edge), (edge, stones, around)):
        done = geofield("import", *files, "-o", tmp_path / "plan.gpkg")
        assert done.returncode == 1
        assert "outlines; a dataset is one field" in done.stderr


def test_a_pond_among_points_of_another_file_is_an_obstacle(tmp_path):
    edge = write(tmp_path / "edge.shp", [BOX])
    stands = write(tmp_path / "stands.gpkg", [POND, shapely.Point(500_100, 5_500_050)])
    found, said, back = imported(tmp_path, edge, stands)
    assert found["rows"] == {"field": 1, "obstacles": 2}
    assert "stands: its polygon lies in another one: taken as an obstacle" in said
    assert sorted(back.table("obstacles")["obstacle_no"]) == [1, 2]
