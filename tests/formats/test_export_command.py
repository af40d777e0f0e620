"""`geofield export` as a process: options, archives, what each file says of doubt and time."""

from __future__ import annotations

import dataclasses
import json
import re
import zipfile
from xml.etree import ElementTree as ET

import fiona
import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pytest
import shapely
from formats_plan import NAME, UTM, X0, Y0, make_dataset
from pyproj import CRS, Transformer

from geofield import theme
from geofield.errors import GeofieldError
from geofield.formats import read_dataset, write_dataset
from geofield.model import Provenance
from geofield_command import run_geofield as geofield

pytestmark = pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")
GPX = "{http://www.topografix.com/GPX/1/1}"
STATUSES = ["detected", "possible", "rejected", "added"]
KML = "{http://www.opengis.net/kml/2.2}"


@pytest.fixture(scope="module")
def plan_file(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plan")
    write_dataset(make_dataset(), folder, ["gpkg"])
    return folder / "field.gpkg"


@pytest.mark.parametrize(("arguments", "message"), [
    (["-f", "kml", "--profile", "aggps"], "No chosen format knows --profile. It is an option of"),
    (["-f", "kml,gpx", "--zip"], "No chosen format knows --zip."),
    (["-f", "shapefile", "--option", "profil=aggps"], "Did you mean 'profile'?"),
    (["-f", "dxf", "--option", "colour=red"], "knows --option colour"),
])  # fmt: skip
def test_options_that_no_format_knows(plan_file, tmp_path, arguments, message):
    done = geofield("export", plan_file, *arguments, "--out", tmp_path / "out")
    assert done.returncode == 2, done.stderr
    assert message in " ".join(done.stderr.split())
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["isoxml", "isoxml-v3"])
def test_isoxml_in_an_archive(plan_file, tmp_path, name):
    for number in (1, 2):
        done = geofield("export", plan_file, "-f", name, "--zip", "--out", tmp_path / str(number))
        assert done.returncode == 0, done.stderr
    file = tmp_path / "1" / f"field_{name}.zip"
    with zipfile.ZipFile(file) as archive:
        assert archive.namelist() == ["TASKDATA/TASKDATA.XML"]
    assert file.read_bytes() == (tmp_path / "2" / file.name).read_bytes()
    assert len(read_dataset(file).table("obstacles")) == 3
    assert geofield("validate", file).returncode == 0


@pytest.mark.parametrize(("name", "said", "files"), [
    ("gpkg", "project=no", ["field.gpkg"]), ("gpkg", "project=on", ["field.gpkg", "field.qgz"]),
    ("isoxml", "zip=false", ["TASKDATA.XML"]), ("isoxml", "zip=TRUE", ["field_isoxml.zip"]),
    ("gpkg", "project=maybe", []), ("isoxml", "headland=Strip", []),
])  # fmt: skip
def test_options_that_are_no_are_not_taken_for_yes(plan_file, tmp_path, name, said, files):
    """`zip=false` made an archive, `project=no` a project, `headland=Strip` the line."""
    done = geofield("export", plan_file, "-f", name, "--option", said, "--out", tmp_path / "out")
    written = sorted(each.name for each in (tmp_path / "out").rglob("*") if each.is_file())
    assert written == files, done.stderr
    assert done.returncode == (0 if files else 1)


def test_track_points_that_were_saved_in_another_crs_are_refused(plan_file, tmp_path):
    edited = tmp_path / "field.gpkg"
    edited.write_bytes(plan_file.read_bytes())
    points = pyogrio.read_dataframe(edited, layer="track_points")
    pyogrio.write_dataframe(points.to_crs("EPSG:4326"), edited, layer="track_points")
    done = geofield("export", edited, "-f", "geojson", "--out", tmp_path / "out")
    assert done.returncode == 1
    assert "layer 'track_points' is no longer in WGS 84 / UTM zone 36N" in done.stderr


def test_waypoints_are_the_centres(tmp_path):
    dataset = make_dataset()
    write_dataset(dataset, tmp_path, ["gpx"])
    points = pyogrio.read_dataframe(tmp_path / "field.gpx", layer="waypoints").to_crs(UTM)
    kept = dataset.table("obstacles").iloc[[0, 1, 3]]
    off = points.geometry.distance(kept.centroid.reset_index(drop=True))
    assert off.max() < 1e-3


def test_rings_of_drawings_are_closed(tmp_path):
    write_dataset(make_dataset(), tmp_path, ["dxf"])
    lines = (tmp_path / "field.dxf").read_text(encoding="utf-8").split("\n")
    pairs = [(a.strip(), b.strip()) for a, b in zip(lines[::2], lines[1::2], strict=False)]
    flags: dict[str, list[int]] = {}
    for code, value in pairs:
        if code == "0":
            entity = layer = None
            entity = value
        elif code == "8":
            layer = value
        elif code == "70" and entity == "LWPOLYLINE":
            flags.setdefault(layer, []).append(int(value) & 1)
    # The field and the shed have a hole each; two trees are kept.
    assert {layer: (sum(found), len(found)) for layer, found in flags.items()} == {
        "FIELD": (2, 2), "OBSTACLES": (4, 4), "TRACKS": (0, 23), "GAPS": (0, 11),
    }  # fmt: skip
    drawn = gpd.read_file(tmp_path / "field.dxf")
    assert drawn[drawn["Layer"] == "FIELD"].geometry.is_closed.all()


def test_undated_imagery_is_of_no_day(tmp_path):
    dataset = make_dataset(points=False)
    source = dataclasses.replace(dataset.provenance.source, date=None)
    undated = dataclasses.replace(
        dataset,
        provenance=Provenance("geofield 0.1.0", source),
        tables={**dataset.tables, "field": dataset.tables["field"].assign(imagery_date=None)},
    )
    names = ["gpkg", "geojson", "shapefile", "geoparquet", "flatgeobuf", "kml", "gpx", "csv"]
    names += ["fiboa", "dxf", "isoxml", "isoxml-v3", "agopengps", "turtle", "jsonld", "study-xml"]
    write_dataset(undated, tmp_path, names)
    written = [path for path in tmp_path.rglob("*") if path.is_file()]
    for path in written:
        assert b"1970-01-01" not in path.read_bytes(), path
    for table in tmp_path.rglob("*.dbf"):
        assert table.read_bytes()[1:4] == b"\0\0\0"
        with fiona.open(table.with_suffix(".shp")) as source:
            assert len(source)
    assert ET.parse(tmp_path / "field.gpx").getroot().find(f"{GPX}metadata/{GPX}time") is None


def test_kml_shows_what_tracks_run_through_apart(tmp_path):
    dataset = make_dataset(points=False)
    dataset.tables["obstacles"]["status"] = STATUSES
    write_dataset(dataset, tmp_path, ["kml"])
    root = ET.parse(tmp_path / "field.kml").getroot()
    styles = {style.get("id"): style for style in root.iter(f"{KML}Style")}
    looks = {}
    for mark in root.iter(f"{KML}Placemark"):
        name, style = mark.find(f"{KML}name").text, mark.find(f"{KML}styleUrl").text[1:]
        if name.startswith("Obstacle"):
            fill = styles[style].find(f"{KML}PolyStyle/{KML}color").text
            looks[name] = (styles[style].find(f"{KML}LineStyle/{KML}color").text, fill)
    assert list(looks) == [
        "Obstacle 1", "Obstacle 2 (possible)", "Obstacle 3 (rejected)", "Obstacle 4"
    ]  # fmt: skip
    # As everywhere else: the colours of the theme, here as alpha, blue, green, red.
    for (name, (line, _)), status in zip(looks.items(), STATUSES, strict=True):
        red, green, blue = theme.rgb(theme.STATUS[status].color)
        assert line == f"ff{blue:02x}{green:02x}{red:02x}", name
    assert [fill[:2] == "00" for _, fill in looks.values()] == [False, True, True, False]
    assert sorted(read_dataset(tmp_path / "field.kml").table("obstacles")["obstacle_no"]) == [
        1, 2, 3, 4
    ]  # fmt: skip


#: Fiji: the test field, which is 120 m wide, with the 180th meridian through its middle.
FIJI = CRS.from_epsg(32760)


def in_fiji():
    dataset = make_dataset(points=False)
    x, y = Transformer.from_crs(4326, FIJI, always_xy=True).transform(180.0, -17.0)
    moved = {}
    for name, table in dataset.tables.items():
        shapes = shapely.transform(
            table.geometry.to_numpy(), lambda c: c - [X0, Y0] + [round(x) - 60, round(y)]
        )
        moved[name] = table.set_geometry(gpd.GeoSeries(shapes, crs=FIJI), crs=FIJI)
    return dataclasses.replace(dataset, tables=moved, crs=FIJI, points=None, grid=None)


@pytest.mark.parametrize(("name", "product"), [
    ("gpkg", "field.gpkg"), ("geojson", "geojson"), ("shapefile", "shapefile"),
    ("geoparquet", "geoparquet"), ("flatgeobuf", "flatgeobuf"), ("kml", "field.kml"),
    ("isoxml", "isoxml"), ("isoxml-v3", "isoxml-v3"), ("agopengps", "agopengps/Fields"),
])  # fmt: skip
def test_a_field_across_the_180th_meridian_comes_back(tmp_path, name, product):
    dataset = in_fiji()
    write_dataset(dataset, tmp_path, [name])
    done = geofield("import", tmp_path / product, "-o", tmp_path / "back.gpkg", "--overwrite")
    assert done.returncode == 0, done.stderr
    back = read_dataset(tmp_path / "back.gpkg")
    ours = dataset.table("field").geometry.iloc[0]
    theirs = back.table("field").to_crs(FIJI).geometry.iloc[0]
    assert theirs.geom_type == "Polygon"
    assert shapely.hausdorff_distance(ours, theirs) < 0.02
    kept = dataset.table("obstacles").iloc[[0, 1, 3]]
    found = back.table("obstacles").to_crs(FIJI).set_index("obstacle_no").geometry
    for number, shape in zip(kept["obstacle_no"], kept.geometry, strict=True):
        # AgOpenGPS has no holes in obstacles: the shed's centre moves by 6 cm.
        assert found[number].centroid.distance(shape.centroid) < 0.07
    lengths = back.table("tracks").to_crs(FIJI).length
    np.testing.assert_allclose(
        sorted(lengths),
        sorted(dataset.table("tracks").length),
        atol=120 if name == "agopengps" else 0.05,
    )


@pytest.mark.parametrize("name", ["geojson", "shapefile", "fiboa", "kml"])
def test_shapes_are_cut_at_the_180th_meridian(tmp_path, name):
    dataset = in_fiji()
    write_dataset(dataset, tmp_path, [name])
    file = {"geojson": "geojson/field.geojson", "shapefile": "shapefile/boundary.shp",
            "fiboa": "fiboa/field.parquet", "kml": "field.kml"}[name]  # fmt: skip
    if name == "fiboa":
        shape = gpd.read_parquet(tmp_path / file).geometry.iloc[0]
    else:
        layer = "field" if name == "kml" else None
        shape = gpd.read_file(tmp_path / file, layer=layer).geometry.iloc[0]
    assert shape.geom_type == "MultiPolygon"
    # Degrees squared of the field; a ring that goes round the earth has a million times more.
    assert shape.area == pytest.approx(
        6384 / (111_320 * 110_660 * np.cos(np.radians(17))), rel=0.01
    )
    assert {round(abs(x)) for x in shape.bounds[::2]} == {180}
    assert shape.is_valid


def test_map_scene_and_report_are_products_like_others(tmp_path, simulated, simulated_tif):
    done = geofield(
        "run", simulated_tif, "--lat", simulated.lat, "--lon", simulated.lon,
        "--out", tmp_path / "run", "--format", "gpkg", "--format", "map",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    done = geofield(
        "export", tmp_path / "run" / "field.gpkg", "--format", "map", "--format", "scene",
        "--format", "report", "--out", tmp_path / "out",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "cannot carry" not in done.stderr
    for name in ("map.png", "scene.tif"):
        assert (tmp_path / "out" / name).read_bytes() == (tmp_path / "run" / name).read_bytes()
    reports = [json.loads((tmp_path / f / "report.json").read_text()) for f in ("run", "out")]
    assert {key for key in reports[0] if reports[0][key] != reports[1][key]} == {
        "formats", "timings_s"
    }  # fmt: skip
    (tmp_path / "run" / "scene.tif").unlink()
    done = geofield(
        "export", tmp_path / "run" / "field.gpkg", "-f", "scene", "--out", tmp_path / "none"
    )
    assert done.returncode == 1
    assert "There is no picture" in done.stderr
    plan, bare, whole = tmp_path / "run" / "field.gpkg", tmp_path / "bare", tmp_path / "whole"
    done = geofield("export", plan, "-f", "map", "--out", bare)
    assert "Shown without the picture, which is not beside the plan" in done.stderr
    done = geofield("export", plan, "-f", "map", "--picture", simulated_tif, "--out", whole)
    assert done.stderr.splitlines() == [str(whole / "map.png")]
    maps = [(folder / "map.png").read_bytes() for folder in (bare, whole, tmp_path / "run")]
    assert maps[0] != maps[1] == maps[2]


def test_what_a_person_edited_is_what_others_read(plan_file, tmp_path):
    """A moved row tells its new place, a drawn one has a number, place and status."""
    edited = tmp_path / "field.gpkg"
    edited.write_bytes(plan_file.read_bytes())
    table = gpd.read_file(edited, layer="obstacles")
    there = table.geometry.iloc[0].centroid
    table.loc[0, "geometry"] = shapely.affinity.translate(table.geometry.iloc[0], 7.0, 3.0)
    table.loc[1, "status"] = " Rejected"
    pond = shapely.box(X0 + 90, Y0 + 10, X0 + 96, Y0 + 14)
    drawn = gpd.GeoDataFrame({"status": [None]}, geometry=[pond], crs=UTM)
    pd.concat([table, drawn]).to_file(edited, layer="obstacles", driver="GPKG")
    outline = gpd.read_file(edited, layer="field")
    outline.geometry = outline.buffer(10.0, join_style="mitre")
    outline.to_file(edited, layer="field", driver="GPKG")
    done = geofield(
        "export", edited, "-f", "csv,gpx,geojson,report,html", "--out", tmp_path / "out"
    )
    assert done.returncode == 0, done.stderr
    rows = pd.read_csv(tmp_path / "out" / "csv" / "obstacles.csv").set_index("obstacle_no")
    x, y = Transformer.from_crs(4326, UTM, always_xy=True).transform(rows["lon"], rows["lat"])
    assert np.hypot(x[0] - there.x - 7.0, y[0] - there.y - 3.0) < 0.001
    assert np.hypot(x[4] - X0 - 93, y[4] - Y0 - 12) < 0.001
    assert list(rows["status"]) == ["confirmed", "rejected", "rejected", "added", "added"]
    waypoints = ET.parse(tmp_path / "out" / "field.gpx").getroot().iter(f"{GPX}wpt")
    assert [each.findtext(f"{GPX}name") for each in waypoints] == [
        f"Obstacle {number}" for number in (1, 4, 5)
    ]
    field = gpd.read_file(tmp_path / "out" / "geojson" / "field.geojson").to_crs(UTM)
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["field"]["area_ha"] == pytest.approx(field.area.iloc[0] / 1e4, rel=2e-3)
    assert field["area_ha"].iloc[0] == pytest.approx(report["field"]["area_ha"], abs=1e-4)


def test_a_name_and_id_that_a_person_emptied(plan_file, tmp_path):
    edited = tmp_path / "field.gpkg"
    edited.write_bytes(plan_file.read_bytes())
    outline = gpd.read_file(edited, layer="field").assign(name=None, field_id=None)
    outline.to_file(edited, layer="field", driver="GPKG")
    done = geofield("export", edited, "-f", "kml,fiboa", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    names = ET.parse(tmp_path / "out" / "field.kml").getroot().iter(f"{KML}Placemark")
    assert next(names).findtext(f"{KML}name") == NAME
    fiboa = json.loads((tmp_path / "out" / "fiboa" / "field.geojson").read_text())
    assert re.fullmatch(r"35\.\d+N33\.\d+E", fiboa["features"][0]["id"])


def test_whose_a_field_is_comes_back_from_a_shapefile(plan_file, tmp_path):
    owned = tmp_path / "field.gpkg"
    owned.write_bytes(plan_file.read_bytes())
    outline = gpd.read_file(owned, layer="field").assign(customer="M\u00fcller & S\u00f6hne")
    outline.to_file(owned, layer="field", driver="GPKG")
    done = geofield("export", owned, "-f", "shapefile", "--farm", "Ost", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    back = read_dataset(tmp_path / "out" / "shapefile").table("field").iloc[0]
    assert (back["customer"], back["farm"]) == ("M\u00fcller & S\u00f6hne", "Ost")


def test_an_exported_plan_that_a_person_edited_stays_as_the_earlier_one(plan_file, tmp_path):
    """QGIS opens it as it opens any plan, so it is edited as one."""
    out = tmp_path / "out"
    words = ("export", plan_file, "-f", "gpkg", "-f", "kml", "--out", out)
    assert geofield(*words).returncode == 0
    copy, project = out / "field.gpkg", out / "field.qgz"
    edited = gpd.read_file(copy, layer="obstacles").assign(note="a well")
    edited.to_file(copy, layer="obstacles")
    edited[["geometry"]].to_file(copy, layer="stones")
    with zipfile.ZipFile(project, "w") as archive:
        archive.writestr("field.qgs", "<qgis/>")
    saved = project.read_bytes()

    done = geofield(*words, "--overwrite", "--json")
    assert done.returncode == 0, done.stderr
    assert "field.qgz is as it was saved in QGIS: it stays" in " ".join(done.stderr.split())
    assert project.read_bytes() == saved
    assert json.loads(done.stdout)["files"] == [str(copy), str(out / "field.kml")]
    assert "stones" in pyogrio.list_layers(copy)[:, 0]
    assert "note" not in gpd.read_file(copy, layer="obstacles")

    done = geofield("undo", copy)
    assert done.returncode == 0, done.stderr
    assert (gpd.read_file(copy, layer="obstacles")["note"] == "a well").all()


def test_layers_that_a_product_has_no_more_go_with_the_earlier_one(plan_file, tmp_path):
    """A file of rejected obstacles stayed beside the new ones, with what is driven around again."""
    out = tmp_path / "out"
    words = ("export", plan_file, "-f", "shapefile", "-f", "geojson", "--out", out)
    assert geofield(*words).returncode == 0
    earlier = {file.name for file in (out / "shapefile").iterdir()}
    assert {f"obstacles_rejected.{end}" for end in ("shp", "shx", "dbf", "prj", "cpg")} <= earlier
    own = [out / "geojson/mine.geojson", out / "shapefile/obstacles_rejected.qml"]
    for file in (*own, out / "geojson/headland.geojson", out / "shapefile/obstacles_rejected.qix"):
        file.write_text("{}")

    edited = gpd.read_file(plan_file, layer="obstacles")
    edited["status"] = edited["status"].replace("rejected", "confirmed")
    edited.to_file(plan_file, layer="obstacles")
    refused = geofield(*words)
    assert refused.returncode == 1
    assert {file.name for file in (out / "shapefile").iterdir()} > earlier

    done = geofield(*words, "--overwrite")
    assert done.returncode == 0, done.stderr
    assert not list((out / "shapefile").glob("obstacles_rejected.[!q]*"))
    assert not (out / "geojson/headland.geojson").exists()
    assert [file for file in own if not file.exists()] == []
    numbers = gpd.read_file(out / "shapefile/obstacles.shp")
    assert len(numbers) == (edited["status"] != "possible").sum()

    # Another profile is another product.
    done = geofield(*words[:4], "--option", "profile=tracklead", "--out", out, "--overwrite")
    assert done.returncode == 0, done.stderr
    assert (out / "shapefile/boundary.shp").exists()


@pytest.mark.parametrize("name", ["dxf", "shapefile", "gpx", "geojson", "flatgeobuf"])
def test_a_file_that_found_no_room_is_told(tmp_path, name):
    """A DXF lost all its lines without a word; a Shapefile ended in a traceback."""
    resource = pytest.importorskip("resource")
    whole = write_dataset(make_dataset(), tmp_path / "whole", [name])
    room = max(path.stat().st_size for path in whole) * 3 // 4
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, limits[1]))
    try:
        with pytest.raises((GeofieldError, OSError)):
            write_dataset(make_dataset(), tmp_path / "cut", [name])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert not any(path.is_file() for path in (tmp_path / "cut").rglob("*"))
