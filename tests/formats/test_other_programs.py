"""Files of other programs, made by GDAL: what it finds shapes in is read like all others."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely

from geofield.crs import LONLAT, parse_crs, transformer
from geofield.formats import read_dataset
from geofield_command import run_geofield as geofield

SAMPLE = Path(__file__).parents[2] / "sample_data" / "field_1.tif"
BOX = shapely.box(500_000, 5_500_000, 500_200, 5_500_100)
TREES = [shapely.Point(500_100 + 9 * i, 5_500_050).buffer(3) for i in range(3)]
DRIVERS = {"a.gml": "GML", "a.tab": "MapInfo File", "a.gdb": "OpenFileGDB", "a.sqlite": "SQLite"}


@pytest.mark.parametrize("name", DRIVERS)
def test_what_gdal_finds_shapes_in_is_imported_exported_and_checked(tmp_path, name):
    frame = gpd.GeoDataFrame({"name": ["Große Äcker"]}, geometry=[BOX], crs="EPSG:32633")
    file = tmp_path / "in" / name
    file.parent.mkdir()
    frame.to_file(file, driver=DRIVERS[name])
    done = geofield("import", file, "-o", tmp_path / "plan.gpkg", "--json")
    assert json.loads(done.stdout)["rows"] == {"field": 1}, done.stderr
    field = read_dataset(tmp_path / "plan.gpkg").table("field")
    assert field["name"].tolist() == ["Große Äcker"]
    assert shapely.hausdorff_distance(field.geometry.iloc[0], BOX) < 0.01
    assert geofield("validate", file).returncode == 0
    assert "vector file of another program" in geofield("info", file).stdout


@pytest.mark.parametrize("name", ["a.gml", "a.tab", "a.mif", "a.sqlite"])
def test_it_is_read_in_an_archive_and_in_a_folder_too(tmp_path, name):
    """A GML file that was fine by itself was "no product that is known" there."""
    frame = gpd.GeoDataFrame({"name": ["Acre"]}, geometry=[BOX], crs="EPSG:32633")
    (tmp_path / "in").mkdir()
    frame.to_file(tmp_path / "in" / name, driver=DRIVERS.get(name, "MapInfo File"))
    (tmp_path / "in" / "readme.md").write_text("of the office")
    archive = shutil.make_archive(str(tmp_path / "sent"), "zip", tmp_path / "in")
    assert geofield("validate", tmp_path / "in").returncode == 0
    done = geofield("import", archive, "-o", tmp_path / "plan.gpkg", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["rows"] == {"field": 1}
    done = geofield("tracks", archive, "--spacing", 5, "-o", tmp_path / "tracks.gpkg")
    assert done.returncode == 0, done.stderr
    if name == "a.gml":
        shutil.copy(tmp_path / "in" / name, tmp_path / "in" / "b.gml")
        done = geofield("import", tmp_path / "in", "-o", tmp_path / "two.gpkg")
        assert "holds 2 files (vector file of another program).\nName one of them." in done.stderr


def test_a_boundary_of_another_format_around_trees_of_a_usual_one(tmp_path):
    gpd.GeoDataFrame(geometry=[BOX], crs="EPSG:32633").to_file(tmp_path / "a.gml", driver="GML")
    gpd.GeoDataFrame(geometry=TREES, crs="EPSG:32633").to_file(tmp_path / "b.geojson")
    files = tmp_path / "b.geojson", tmp_path / "a.gml"
    done = geofield("import", *files, "-o", tmp_path / "plan.gpkg", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["rows"] == {"field": 1, "obstacles": 3}


@pytest.mark.skipif(shutil.which("ogr2ogr") is None, reason="ogr2ogr is not installed")
@pytest.mark.parametrize("command", ["import", "tracks"])
def test_the_command_that_exchanges_latitude_and_longitude_does(tmp_path, command):
    """ogr2ogr -swapXY was named; there is no such option."""
    shape = shapely.box(36.14, 133.0, 36.143, 133.003)
    file = tmp_path / "a.geojson"
    gpd.GeoDataFrame(geometry=[shape], crs="EPSG:4326").to_file(file)
    told = geofield(command, file, "-o", tmp_path / "plan.gpkg").stderr
    words = shlex.split(re.search("`(ogr2ogr -ct .*?)`", told)[1])
    put = {"NAME.gpkg": tmp_path / "b.gpkg", "FILE": file}
    subprocess.run([put.get(word, word) for word in words], check=True)
    done = geofield(command, tmp_path / "b.gpkg", "-o", tmp_path / "plan.gpkg")
    assert done.returncode == 0, done.stderr


def test_a_spreadsheet_is_to_be_saved_as_csv(tmp_path):
    (tmp_path / "trees.xlsx").write_bytes(b"PK\3\4" + bytes(60))
    done = geofield("import", tmp_path / "trees.xlsx", "-o", tmp_path / "plan.gpkg")
    assert done.returncode == 1
    assert "is a spreadsheet." in done.stderr
    assert "Save the sheet as a CSV file" in done.stderr


def test_coordinates_outside_their_crs_are_told_by_file_and_layer(tmp_path):
    """With a zone's number before the easting: "lon inf, lat inf is not a place on earth"."""
    far = "+proj=tmerc +lat_0=0 +lon_0=33 +k=0.9996 +x_0=36500000 +ellps=GRS80 +units=m"
    file = tmp_path / "a.shp"
    gpd.GeoDataFrame(geometry=[BOX], crs=far).to_file(file)
    done = geofield("import", file, "-o", tmp_path / "plan.gpkg")
    assert done.returncode == 1
    assert "Coordinates of layer 'a' are outside the area of" in done.stderr
    assert "Check the CRS" in done.stderr


def test_what_tracks_says_of_metres_without_a_crs_and_of_lines(tmp_path):
    gpd.GeoDataFrame(geometry=[BOX], crs="EPSG:32633").to_file(tmp_path / "a.shp")
    (tmp_path / "a.prj").unlink()
    done = geofield("tracks", tmp_path / "a.shp", "-o", tmp_path / "plan.gpkg")
    assert "EPSG:4326 for degrees, or, for instance, EPSG:32633" in done.stderr
    ring = shapely.LineString(BOX.exterior.coords)
    gpd.GeoDataFrame(geometry=[ring], crs="EPSG:32633").to_file(tmp_path / "b.shp")
    done = geofield("tracks", tmp_path / "b.shp", "-o", tmp_path / "plan.gpkg")
    assert "QGIS makes parcels of closed lines" in done.stderr


def drawing(file, *entities):
    """A DXF file of entities, each a kind with its codes and values, as of AutoCAD 2018."""
    lines = ["0", "SECTION", "2", "HEADER", "9", "$ACADVER", "1", "AC1032"]
    lines += ["9", "$DWGCODEPAGE", "3", "ANSI_1252", "0", "ENDSEC", "0", "SECTION", "2", "ENTITIES"]
    for kind, layer, pairs in entities:
        lines += ["0", kind, "8", layer]
        lines += [str(each) for pair in pairs for each in pair]
    file.write_text("\n".join([*lines, "0", "ENDSEC", "0", "EOF", ""]), "utf-8")


def closed_line(layer, xy):
    places = [pair for x, y in xy for pair in ((10, x), (20, y))]
    return "LWPOLYLINE", layer, [(100, "AcDbPolyline"), (90, len(xy)), (70, 1), *places]


def test_a_drawing_is_read_with_the_crs_that_it_cannot_say(tmp_path):
    """A DXF file was refused; of a surveyor it mostly is the outline, drawn as a closed line."""
    x, y = 500000.0, 5600000.0
    ring = [(x, y), (x + 200, y), (x + 200, y + 150), (x, y + 150)]
    drawing(
        tmp_path / "a.dxf",
        closed_line("SCHLAG", ring),
        ("LINE", "RAHMEN", [(67, 1), (10, 0), (20, 0), (11, 280), (21, 0)]),  # on a sheet of paper
        ("CIRCLE", "BÄUME", [(10, x + 60), (20, y + 60), (40, 4.0)]),
        ("POINT", "BÄUME", [(10, x + 30), (20, y + 90)]),
        ("TEXT", "SCHRIFT", [(10, x + 90), (20, y + 70), (40, 5.0), (1, "Schlag 7")]),
    )
    place = "-o", tmp_path / "plan.gpkg"
    refused = geofield("import", tmp_path / "a.dxf", *place)
    assert refused.returncode == 1
    assert "does not say its CRS" in refused.stderr
    assert "--crs EPSG:" in refused.stderr
    done = geofield("import", tmp_path / "a.dxf", *place, "--crs", "EPSG:25832", "--json")
    assert done.returncode == 0, done.stderr
    assert "a.dxf: 1 text left out" in done.stderr
    told = json.loads(done.stdout)
    assert told["rows"] == {"field": 1, "obstacles": 2}
    assert told["taken"] == [
        "SCHLAG: 1 polygon taken as the field",
        "BÄUME: 1 polygon taken as obstacles",
        "BÄUME: 1 point taken as obstacles",
    ]
    plan = read_dataset(tmp_path / "plan.gpkg")
    assert plan.crs.to_epsg() == 25832
    outline = plan.table("field").geometry.iloc[0]
    assert outline.equals(shapely.Polygon(ring))
    middles = plan.table("obstacles").centroid
    assert middles.distance(shapely.Point(x + 60, y + 60)).min() < 0.01


def test_a_drawing_is_read_alike_by_all(tmp_path):
    """Only import knew it: of --obstacles a tank of 4 m was a ring, and its name a tree."""
    x, y = 500000.0, 5600000.0
    ring = list(shapely.box(x, y, x + 200, y + 150).exterior.coords)[:-1]
    here, to = ("--crs", "EPSG:25832", "--spacing", 9, "-o"), tmp_path / "plan.gpkg"
    drawing(tmp_path / "outline.dxf", closed_line("0", ring))
    drawing(
        tmp_path / "tank.dxf",
        ("CIRCLE", "TANK", [(10, x + 60), (20, y + 60), (40, 4.0)]),
        ("TEXT", "SCHRIFT", [(10, x + 90), (20, y + 70), (40, 5.0), (1, "Tank")]),
    )
    done = geofield(
        "tracks", tmp_path / "outline.dxf", "--obstacles", tmp_path / "tank.dxf", *here, to
    )
    assert done.returncode == 0, done.stderr
    assert "tank.dxf: 1 text left out" in done.stderr
    plan = read_dataset(to)
    assert plan.table("field").geometry.iloc[0].equals(shapely.Polygon(ring))
    assert plan.table("obstacles").area.to_numpy() == pytest.approx([16 * np.pi], rel=1e-3)
    both = closed_line("0", ring), ("CIRCLE", "TANK", [(10, x + 60), (20, y + 60), (40, 4.0)])
    drawing(tmp_path / "both.dxf", *both)
    refused = geofield("tracks", tmp_path / "both.dxf", *here, tmp_path / "other.gpkg")
    assert "both.dxf has 2 layers: 0, TANK" in refused.stderr
    assert "geofield import" in refused.stderr


def test_a_drawing_of_ours_comes_back_where_its_prj_says(tmp_path):
    gpd.GeoDataFrame(geometry=[BOX], crs="EPSG:32633").to_file(tmp_path / "a.geojson")
    geofield("tracks", tmp_path / "a.geojson", "--spacing", 20, "-o", tmp_path / "plan.gpkg")
    geofield("export", tmp_path / "plan.gpkg", "-f", "dxf", "--out", tmp_path / "out")
    (drawn,) = (tmp_path / "out").glob("*.dxf")
    assert geofield("validate", drawn).returncode == 0
    done = geofield("import", drawn, "-o", tmp_path / "back.gpkg")
    assert done.returncode == 0, done.stderr
    done = geofield("import", drawn, "-o", tmp_path / "other.gpkg", "--crs", "EPSG:25832")
    assert "is in WGS 84 / UTM zone 33N by its own word" in done.stderr
    plan, back = (read_dataset(tmp_path / name) for name in ("plan.gpkg", "back.gpkg"))
    assert back.crs == plan.crs
    assert len(back.table("segments")) == len(plan.table("segments"))
    shapes = [each.table("field").geometry.iloc[0] for each in (plan, back)]
    assert shapely.hausdorff_distance(*shapes) < 1e-6


@pytest.mark.skipif(shutil.which("ogr2ogr") is None, reason="ogr2ogr is not installed")
def test_the_command_that_gives_a_drawing_its_crs_does(tmp_path):
    x, y = transformer(LONLAT, parse_crs("EPSG:32636")).transform(33.531142, 35.075373)
    ring = list(shapely.box(x - 60, y - 40, x + 60, y + 40).exterior.coords)[:-1]
    drawing(tmp_path / "a.dxf", closed_line("0", ring))
    words = ("field", SAMPLE, "-o", tmp_path / "plan.gpkg", "--boundary")
    refused = geofield(*words, tmp_path / "a.dxf")
    assert refused.returncode == 1
    command = shlex.split(re.search("`(ogr2ogr -a_srs .*?)`", refused.stderr)[1])
    given = {"EPSG:25832": "EPSG:32636", "FILE": "a.dxf"}
    subprocess.run([given.get(each, each) for each in command], cwd=tmp_path, check=True)
    done = geofield(*words, tmp_path / "parcels.gpkg")
    assert done.returncode == 0, done.stderr
    outline = read_dataset(tmp_path / "plan.gpkg").table("field").geometry.iloc[0]
    assert outline.symmetric_difference(shapely.Polygon(ring)).area < 1
