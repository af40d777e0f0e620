"""Shapes as only some programs write them: collections in collections, arcs, heights."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely

from geofield.field import field_from_boundary
from geofield_command import run_geofield

X, Y = 500_000, 5_400_000
FIELD = shapely.box(X, Y, X + 200, Y + 100)
_PLACES = [f"{X - 400} {Y}", f"{X} {Y + 400}", f"{X + 400} {Y}"]
#: The ground of a pivot, three points of the circle.
_CIRCLE = f"""<g:Curve><g:segments><g:Arc><g:posList>{" ".join(_PLACES)}</g:posList></g:Arc><g:Arc>
<g:posList>{X + 400} {Y} {X} {Y - 400} {X - 400} {Y}</g:posList></g:Arc></g:segments></g:Curve>"""
_GML = """<?xml version="1.0" encoding="utf-8"?>
<o:FeatureCollection xmlns:o="http://ogr.maptools.org/" xmlns:g="http://www.opengis.net/gml/3.2">
{}</o:FeatureCollection>"""
_MEMBER = """<o:featureMember><o:it g:id="it.{}"><o:shape>{}</o:shape></o:it></o:featureMember>"""
_PIVOT = f"""<g:Surface srsName="urn:ogc:def:crs:EPSG::32633"><g:patches><g:PolygonPatch>
<g:exterior><g:Ring><g:curveMember>{_CIRCLE}</g:curveMember></g:Ring></g:exterior>
</g:PolygonPatch></g:patches></g:Surface>"""


def written(path: Path, shapes: list[shapely.Geometry]) -> Path:
    frame = gpd.GeoDataFrame({"name": list("abc")[: len(shapes)]}, geometry=shapes, crs=32633)
    frame.to_crs(4326).to_file(path)
    return path


def geofield(folder: Path, *args: object, code: int = 0) -> str:
    done = run_geofield(*args, folder=folder)
    assert "Traceback" not in done.stderr
    assert done.returncode == code, done.stderr
    return done.stderr


def test_collections_in_collections_are_looked_into_by_all(tmp_path):
    """Only import did: a pond of several parts was no parcel, and a tree no circle."""
    ponds = shapely.MultiPolygon(
        [shapely.box(X + at, Y + 20, X + at + 10, Y + 30) for at in (20, 60)]
    )
    trees = shapely.MultiPoint([(X + 100, Y + 50), (X + 150, Y + 50)])
    fence = shapely.MultiLineString([[(X + 20, Y + 70), (X + 40, Y + 70)]])
    held = shapely.GeometryCollection([ponds, shapely.GeometryCollection([trees, fence])])
    written(tmp_path / "field.gpkg", [FIELD])
    written(tmp_path / "obstacles.geojson", [held])
    given = ("--spacing", 9, "-o")
    geofield(tmp_path, "tracks", "field.gpkg", "--obstacles", "obstacles.geojson", *given, "a.gpkg")
    geofield(tmp_path, "import", "field.gpkg", "obstacles.geojson", "-o", "b.gpkg")
    rows = [
        sorted(zip(one["kind"], one["radius_m"].fillna(0.0), one.area.round(3), strict=True))
        for one in (gpd.read_file(tmp_path / f"{name}.gpkg", layer="obstacles") for name in "ab")
    ]
    assert rows[0] == rows[1]
    assert len(rows[0]) == 5
    told = geofield(tmp_path, "tracks", "obstacles.geojson", *given, "ponds.gpkg")
    assert "3 shapes are no polygon" in told
    assert len(gpd.read_file(tmp_path / "ponds.gpkg", layer="field")) == 2


def test_a_parcel_in_collections_is_the_boundary(tmp_path):
    held = shapely.GeometryCollection([shapely.MultiPolygon([FIELD])])
    parcels = gpd.GeoDataFrame({"name": ["a"]}, geometry=[held], crs=32633)
    assert field_from_boundary(parcels).polygon.equals(FIELD)


@pytest.mark.parametrize("command", ["import", "tracks"])
def test_the_circle_of_a_pivot_is_round(tmp_path, command):
    """With lines of four degrees each, as GDAL makes them of arcs, 24 cm were cut off."""
    (tmp_path / "pivot.gml").write_text(_GML.format(_MEMBER.format(1, _PIVOT)))
    spacing = () if command == "import" else ("--spacing", 50)
    geofield(tmp_path, command, "pivot.gml", *spacing, "-o", "plan.gpkg")
    outline = gpd.read_file(tmp_path / "plan.gpkg", layer="field").geometry[0].exterior
    middles = shapely.line_interpolate_point(outline, np.arange(0.0, outline.length, 0.5))
    off_m = 400 - shapely.distance(middles, shapely.Point(X, Y))
    assert np.abs(off_m).max() < 0.02


def test_shapes_that_nothing_here_reads_are_no_crash(tmp_path):
    """GML of all kinds with heights, and arcs as text, ended in a traceback."""
    says = 'srsDimension="3" srsName="urn:ogc:def:crs:EPSG::32633"'
    members = [
        f"<g:Point {says}><g:pos>{X} {Y} 3</g:pos></g:Point>",
        f"<g:LineString {says}><g:posList>{X} {Y} 3 {X + 9} {Y} 3</g:posList></g:LineString>",
    ]
    high = _GML.format("".join(_MEMBER.format(no, each) for no, each in enumerate(members)))
    (tmp_path / "high.gml").write_text(high)
    (tmp_path / "arc.csv").write_text(
        f'name,WKT\na,"CIRCULARSTRING({X} {Y},{X + 1} {Y + 1},{X + 2} {Y})"\n'
    )
    written(tmp_path / "field.gpkg", [FIELD])
    told = geofield(tmp_path, "import", "high.gml", "-o", "plan.gpkg", code=1)
    assert "-dim XY" in told
    around = ("field.gpkg", "--obstacles")
    for command in (("import",), ("tracks",), ("tracks", *around)):
        told = geofield(tmp_path, *command, "arc.csv", "-o", "plan.gpkg", code=1)
        assert "-nlt CONVERT_TO_LINEAR" in told


def test_a_pole_is_no_tree_and_an_oak_is_one(tmp_path):
    """Each point was a tree, and as one it went to terminals: a pole, a manhole."""
    said = ["pole", "Regner", "Obstbaum", "Arbre", "oak", None, "tree", "7"]
    points = [shapely.Point(X + 20 * at, Y + 50) for at in range(1, 9)]
    frame = gpd.GeoDataFrame({"kind": said, "radius_m": 1.5}, geometry=points, crs=32633)
    frame.to_file(tmp_path / "points.gpkg")
    written(tmp_path / "field.gpkg", [FIELD])
    around = ("--obstacles", "points.gpkg", "--spacing", 9, "-o", "a.gpkg")
    told = geofield(tmp_path, "tracks", "field.gpkg", *around)
    assert "'pole' (now other), 'Regner' (now other), 'Obstbaum' (now tree)" in told
    geofield(tmp_path, "import", "field.gpkg", "points.gpkg", "-o", "b.gpkg")
    for name in ("a.gpkg", "b.gpkg"):
        found = gpd.read_file(tmp_path / name, layer="obstacles")
        assert found["kind"].tolist() == ["other"] * 2 + ["tree"] * 6


def test_a_layer_of_trees_beside_one_called_field_is_told(tmp_path):
    """Only the layer `field` was read, without a word, and tracks ran through the trees."""
    file = tmp_path / "map.gpkg"
    trees = gpd.GeoDataFrame({"radius_m": [4.0]}, geometry=[FIELD.centroid], crs=32633)
    field = gpd.GeoDataFrame({"name": ["a"]}, geometry=[FIELD], crs=32633)
    field.to_file(file, layer="field")
    trees[:0].to_file(file, layer="trees")
    given = ("--spacing", 9)
    geofield(tmp_path, "tracks", "map.gpkg", *given, "-o", "plan.gpkg")
    trees.to_file(file, layer="trees")
    for command in (("tracks", "-o", "other.gpkg"), ("batch", "--out", "farm")):
        told = geofield(tmp_path, *command, "map.gpkg", *given, code=1)
        assert "map.gpkg has 2 layers: field, trees" in told
    geofield(tmp_path, "import", "map.gpkg", "-o", "found.gpkg")
    assert len(gpd.read_file(tmp_path / "found.gpkg", layer="obstacles")) == 1


def test_a_waypoint_that_is_named_a_pole_is_no_tree(tmp_path):
    names = ["Power pole 3", "Hochspannungsmast", "Tree at the pond", "W 12", None]
    points = [shapely.Point(X + 20 * at, Y + 50) for at in range(1, 6)]
    frame = gpd.GeoDataFrame({"name": names}, geometry=points, crs=32633).to_crs(4326)
    frame.to_file(tmp_path / "marks.gpx", layer="waypoints", driver="GPX")
    written(tmp_path / "field.gpkg", [FIELD])
    geofield(tmp_path, "import", "field.gpkg", "marks.gpx", "-o", "plan.gpkg")
    found = gpd.read_file(tmp_path / "plan.gpkg", layer="obstacles")
    assert found["kind"].tolist() == ["other", "other", "tree", "tree", "tree"]


@pytest.mark.parametrize("column", ["width", "Diameter", "radius_ft"])
def test_a_size_that_is_not_read_is_told(tmp_path, column):
    """A ditch of 4 m was a line of 20 cm without a word."""
    ditch = shapely.LineString([(X + 50, Y + 20), (X + 50, Y + 80)])
    frame = gpd.GeoDataFrame({column: [4.0], "kind": "ditch"}, geometry=[ditch], crs=32633)
    frame.to_file(tmp_path / "ditch.gpkg")
    written(tmp_path / "field.gpkg", [FIELD])
    around = ("tracks", "field.gpkg", "--obstacles", "ditch.gpkg", "--spacing", 9)
    told = geofield(tmp_path, *around, "-o", "plan.gpkg")
    assert f"{column} of obstacles may say how wide they are" in told
    frame.rename(columns={column: "radius_m"}).to_file(tmp_path / "ditch.gpkg")
    assert "how wide" not in geofield(tmp_path, *around, "-o", "other.gpkg")
    # A size of 0 is none, and the column is the one that is read.
    frame.rename(columns={column: "radius_m"}).assign(radius_m=0.0).to_file(tmp_path / "ditch.gpkg")
    assert "how wide" not in geofield(tmp_path, *around, "-o", "third.gpkg")
