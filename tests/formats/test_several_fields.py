"""Several plans in one product, through the command, read by other people's programs."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from datetime import date
from typing import Any
from xml.etree import ElementTree as ET

import fiona
import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pyoxigraph as ox
import pytest
import shapely
from formats_plan import make_dataset
from isoxml.util.isoxml_io import isoxml_from_path
from pyproj import CRS

from geofield.formats import read_dataset, validate_file, write_dataset, write_datasets
from geofield.formats.arrow import to_lonlat
from geofield_command import run_geofield as geofield

pytestmark = pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")
KML = "{http://www.opengis.net/kml/2.2}"
FORMATS = [
    *("gpkg", "geojson", "shapefile", "geoparquet", "flatgeobuf", "kml", "gpx", "fiboa", "dxf"),
    *("isoxml", "isoxml-v3", "agopengps", "turtle", "ntriples", "jsonld", "rdf"),
]


def moved(number, name, zone, **own):
    """The test plan 300 m further east for each number, or in another zone, with own columns."""
    dataset, crs, tables = make_dataset(points=False), CRS.from_epsg(32600 + zone), {}
    east = np.array([300.0 * number, 0.0])
    for layer, table in dataset.tables.items():
        shapes = shapely.transform(table.geometry.to_numpy(), lambda xy: xy + east)
        tables[layer] = table.set_geometry(gpd.GeoSeries(shapes, crs=crs))
    middles = tables["obstacles"].geometry.centroid.to_crs(4326)
    tables["obstacles"] = tables["obstacles"].assign(lat=middles.y, lon=middles.x)
    tables["field"] = tables["field"].assign(field_id=f"f{number}", name=name, **own)
    return replace(dataset, tables=tables, crs=crs, name=name, grid=None)


#: Two fields of one name, one in the next zone, with columns that not all have.
FARM = [
    moved(0, "North", 36, customer="Ann Löw", farm="Upper", crop="wheat"),
    moved(1, "North", 36, customer="Bob", farm="Upper", crop="barley"),
    moved(2, "West", 35, customer="Bob", farm="Upper", plot=7),
]


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("several")
    plans = []
    for number, dataset in enumerate(FARM):
        (plan, *_) = write_dataset(dataset, folder / str(number), ["gpkg"])
        plans.append(plan)
    done = geofield(
        "export",
        *plans,
        "-f",
        ",".join(FORMATS),
        "--out",
        folder / "out",
        "--stem",
        "farm",
        "--json",
    )
    assert done.returncode == 0, done.stderr
    assert all((folder / "out").joinpath(p).exists() for p in json.loads(done.stdout)["files"])
    return folder / "out"


@pytest.mark.parametrize("name", ["isoxml", "isoxml-v3"])
def test_one_task_file(out, name):
    path = out / name / "TASKDATA" / "TASKDATA.XML"
    assert [f for f in validate_file(path) if f.level == "error"] == []
    data, _ = isoxml_from_path(path)
    assert [field.designator for field in data.partfields] == ["North", "North 2", "West"]
    named = [getattr(c, "last_name", None) or c.designator for c in data.customers]
    assert named == ["Ann Löw", "Bob"]
    # Each customer has an Upper farm of his own.
    assert [farm.customer_id_ref for farm in data.farms] == ["CTR1", "CTR2"]
    assert [field.farm_id_ref for field in data.partfields] == ["FRM1", "FRM2", "FRM2"]
    root = ET.parse(path).getroot()
    ids = [e.get("A") for e in root.iter() if e.tag in ("CTR", "FRM", "PFD", "GGP", "GPN")]
    assert len(ids) == len(set(ids)) > 3
    for field, dataset in zip(data.partfields, FARM, strict=True):
        ring = field.polygons[0].line_strings[0].points
        (shape,) = to_lonlat(dataset.table("field").geometry.to_numpy(), dataset.crs)
        found = shapely.Polygon([(float(p.east), float(p.north)) for p in ring])
        assert shapely.hausdorff_distance(found, shapely.Polygon(shape.exterior)) < 2e-9


@pytest.mark.parametrize(("place", "layered"), [
    ("farm.gpkg", True), ("geojson/{}.geojson", False), ("geoparquet/{}.parquet", False),
    ("flatgeobuf/{}.fgb", False),
])  # fmt: skip
@pytest.mark.parametrize("layer", ["field", "obstacles", "segments", "gaps"])
def test_tables_say_of_which_field_a_row_is(out, place, layered, layer):
    path = out / place.format(layer)
    read = gpd.read_parquet if path.suffix == ".parquet" else gpd.read_file
    table = read(path, **({"layer": layer} if layered else {}))
    assert table.crs.to_epsg() == 4326
    wanted = [
        field
        for field, d in zip(("f0", "f1", "f2"), FARM, strict=True)
        for _ in d.table(layer).index
    ]
    # A spatial index may set FlatGeobuf's rows in another order.
    assert sorted(table["field_id"]) == wanted
    if layer == "field":
        by_id = table.set_index("field_id")
        assert by_id.loc[["f0", "f1"], "crop"].tolist() == ["wheat", "barley"]
        assert by_id["crop"].isna()["f2"]
        assert float(by_id.loc["f2", "plot"]) == 7
        assert np.allclose(by_id.loc[["f0", "f1"], "area_ha"], FARM[0].table("field")["area_ha"])


def test_fields_of_one_zone_stay_in_it(out, tmp_path):
    plans = [
        write_dataset(d, tmp_path / d.name / str(i), ["gpkg"])[0] for i, d in enumerate(FARM[:2])
    ]
    done = geofield("export", *plans, "-f", "gpkg", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    table = pyogrio.read_dataframe(tmp_path / "out" / "field.gpkg", layer="segments")
    assert table.crs.to_epsg() == 32636
    assert set(table["field_id"]) == {"f0", "f1"}


def test_one_set_of_shapefiles(out):
    with fiona.open(out / "shapefile" / "boundary.shp") as source:
        rows = [dict(row.properties) for row in source]
    assert [row["field_id"] for row in rows] == ["f0", "f1", "f2"]
    assert [row["CLIENT"] for row in rows] == ["Ann Löw", "Bob", "Bob"]
    assert [row["crop"] for row in rows] == ["wheat", "barley", None]
    assert [row["plot"] for row in rows] == [None, None, 7]
    guidance = gpd.read_file(out / "shapefile" / "guidance.shp")
    assert guidance["field_id"].value_counts().to_dict() == {
        f"f{i}": len(d.table("segments")) for i, d in enumerate(FARM)
    }


def test_one_kml_with_a_folder_per_field(out):
    document = ET.parse(out / "farm.kml").getroot()[0]
    folders = document.findall(f"{KML}Folder")
    assert [each.findtext(f"{KML}name") for each in folders] == ["North", "North 2", "West"]
    inner = [each.findtext(f"{KML}name") for each in folders[0].findall(f"{KML}Folder")]
    assert inner == ["field", "obstacles", "tracks", "gaps"]
    assert len(pyogrio.list_layers(out / "farm.kml")) >= 4
    values = [each.text for each in document.iter(f"{KML}SimpleData") if each.get("name") == "crop"]
    assert values == ["wheat", "barley"]


def test_fields_of_one_kml_are_apart_again(out, tmp_path):
    """Nothing said of which field a track was: the import of it could not be exported."""
    done = geofield("import", out / "farm.kml", "-o", tmp_path / "farm.gpkg")
    assert done.returncode == 0, done.stderr
    done = geofield("export", tmp_path / "farm.gpkg", "-f", "isoxml", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    fields, wanted = (
        ET.parse(folder / "isoxml/TASKDATA/TASKDATA.XML").getroot().findall("PFD")
        for folder in (tmp_path, out)
    )
    assert [len(each.findall("GGP")) for each in fields] == [24, 24, 24]
    assert [each.get("D") for each in fields] == [each.get("D") for each in wanted]


def test_one_fiboa_collection(out):
    table = gpd.read_parquet(out / "fiboa" / "farm.parquet")
    assert table["id"].tolist() == ["f0", "f1", "f2"]
    assert table["crop"].tolist()[:2] == ["wheat", "barley"]
    content = json.loads((out / "fiboa" / "farm.geojson").read_text(encoding="utf-8"))
    assert [each["properties"].get("plot") for each in content["features"]] == [None, None, 7]


@pytest.mark.parametrize(("files", "kind"), [
    (["farm.ttl"], ox.RdfFormat.TURTLE), (["farm.nt"], ox.RdfFormat.N_TRIPLES),
    (["farm.jsonld"], ox.RdfFormat.JSON_LD),
    (["farm_field.rdf", "farm_obstacles.rdf", "farm_tracks.rdf"], ox.RdfFormat.RDF_XML),
])  # fmt: skip
def test_one_linked_dataset(out, files, kind):
    store = ox.Store()
    for file in files:
        store.load(path=str(out / file), format=kind)
    count = (
        "PREFIX gf: <https://w3id.org/geofield#> "
        "SELECT ?field (COUNT(?segment) AS ?n) WHERE { ?segment a gf:Segment ; "
        "gf:onTrack/gf:inField ?field } GROUP BY ?field"
    )
    rows: Any = store.query(count)
    found = {row["field"].value: int(row["n"].value) for row in rows}
    assert sorted(found.values()) == [len(d.table("segments")) for d in FARM]


def test_validate_says_that_there_are_several(out):
    done = geofield("validate", out / "farm.ttl")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 fields" in done.stderr
    assert "error:" not in done.stderr


@pytest.mark.parametrize("file", ["farm.gpkg", "geojson", "isoxml", "isoxml-v3"])
def test_validate_checks_each_of_several_fields(out, file, tmp_path):
    """Tracks that leave one of several fields passed without a word."""
    place = tmp_path / file
    (shutil.copytree if (out / file).is_dir() else shutil.copy)(out / file, place)
    done = geofield("validate", place)
    assert (done.returncode, done.stderr) == (0, f"{place}: no fault found\n")
    if file.startswith("isoxml"):
        tree = ET.parse(xml := place / "TASKDATA" / "TASKDATA.XML")
        for point in tree.getroot().findall("PFD")[2].find("PLN").iter("PNT"):
            point.set("C", f"{float(point.get('C')) + 0.0005:.9f}")
        tree.write(xml)
    else:
        there = place / "field.geojson" if place.is_dir() else place
        table = gpd.read_file(there, layer="field")
        table.loc[2, "geometry"] = shapely.affinity.translate(table.geometry[2], 0, 0.0005)
        table.to_file(there, layer="field")
    done = geofield("validate", place)
    assert done.returncode == 1
    assert "error: West, segments" in done.stderr
    assert "North" not in done.stderr


@pytest.mark.parametrize("file", ["geojson/segments.geojson", "shapefile/guidance.shp"])
def test_a_layer_of_several_fields_alone_can_be_checked(out, file):
    """Each field has a track 1: a traceback, then two rows of one key."""
    done = geofield("validate", out / file)
    assert (done.returncode, done.stderr) == (0, f"{out / file}: no fault found\n")


def test_others_have_a_file_or_folder_of_their_own(out):
    for name in ("North", "North_2", "West"):
        for suffix in (".gpx", ".dxf"):
            assert (out / f"{name}{suffix}").is_file()
        dataset = read_dataset(out / "agopengps" / "Fields" / name)
        assert len(dataset.table("field")) == 1


def test_times_stay_times_beside_days(tmp_path):
    """Arrow makes days of a column of both: what time it was, was gone."""
    day, time = date(2024, 3, 1), pd.Timestamp("2024-05-01 10:11:12")
    fields = [moved(0, "North", 36, seen=day), moved(1, "West", 36, seen=time)]
    write_datasets(fields, tmp_path, ["gpkg"], tell_drops=False)
    seen = gpd.read_file(tmp_path / "field.gpkg", layer="field")["seen"]
    assert seen.astype(str).tolist() == ["2024-03-01", "2024-05-01 10:11:12"]


def test_the_same_field_twice_is_refused(tmp_path):
    (plan, *_) = write_dataset(FARM[0], tmp_path, ["gpkg"])
    done = geofield("export", plan, plan, "-f", "isoxml", "--out", tmp_path / "out")
    assert done.returncode == 1
    assert "Two fields have the id 'f0'" in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_file_of_several_fields_is_exported_field_by_field(tmp_path):
    """What is one GeoPackage with all of them, as of `geofield tracks parcels.shp`."""
    write_datasets(FARM, tmp_path / "farm", ["gpkg"])
    file = tmp_path / "farm" / "field.gpkg"
    done = geofield("export", file, "-f", "isoxml", "-f", "gpx", "-f", "turtle", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    write_datasets(FARM, tmp_path / "apart", ["isoxml"])
    root, wanted = (
        ET.parse(folder / "isoxml" / "TASKDATA" / "TASKDATA.XML").getroot()
        for folder in (tmp_path, tmp_path / "apart")
    )
    assert [f.get("C") for f in root.iter("PFD")] == [f.get("C") for f in wanted.iter("PFD")]
    for ours, theirs in zip(root.iter("PFD"), wanted.iter("PFD"), strict=True):
        assert ours.get("D") == theirs.get("D")
        lonlat, other = (
            np.array([(float(p.get("D")), float(p.get("C"))) for p in each.iter("PNT")])
            for each in (ours, theirs)
        )
        np.testing.assert_allclose(lonlat, other, rtol=0, atol=2e-9)
    assert len(list(tmp_path.glob("*.gpx"))) == 3
    assert [f for f in validate_file(tmp_path / "field.ttl") if f.level == "error"] == []


def test_segments_of_several_fields_that_lost_their_numbers(tmp_path):
    """They are known by the tracks; ISOXML ended in a traceback, GPX had lines without names."""
    write_datasets(FARM, tmp_path, ["gpkg"])
    file = tmp_path / "field.gpkg"
    before = pyogrio.read_dataframe(file, layer="segments")
    drawn = before.iloc[:1].assign(geometry=before.geometry[:1].translate(0, 1e-5))
    bare = pd.concat([before, drawn], ignore_index=True)[["field_id", "geometry"]]
    pyogrio.write_dataframe(bare, file, layer="segments", geometry_name="geom")
    done = geofield("export", file, "-f", "isoxml", "-f", "geojson", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "no column track_no, segment_no any more" in done.stderr
    after = gpd.read_file(tmp_path / "out" / "geojson" / "segments.geojson")
    keys = ["field_id", "track_no", "segment_no"]
    own = drawn.assign(track_no=before["track_no"][before["field_id"] == "f0"].max() + 1)
    wanted = pd.concat([before, own.assign(segment_no=1)]).set_index(keys)["length_m"]
    found = after.set_index(keys)["length_m"]
    assert found.to_dict() == pytest.approx(wanted.to_dict(), abs=0.002)


def test_a_row_of_none_of_the_fields_is_not_left_out_silently(tmp_path):
    write_datasets(FARM[:2], tmp_path, ["gpkg"])
    file = tmp_path / "field.gpkg"
    obstacles = pyogrio.read_dataframe(file, layer="obstacles")
    obstacles.loc[3, "field_id"] = None
    pyogrio.write_dataframe(obstacles, file, layer="obstacles")
    done = geofield("export", file, "-f", "isoxml", "--out", tmp_path / "out")
    assert done.returncode == 1
    assert "'obstacles' has 1 row of none of the 2 fields" in done.stderr


def test_each_field_of_a_set_of_shapefiles_has_its_own_tracks(tmp_path):
    """Two fields with a track 1 each have two of them, and are exported as two again."""
    write_datasets(FARM[:2], tmp_path, ["shapefile", "isoxml"])
    done = geofield("import", tmp_path / "shapefile", "-o", tmp_path / "all.gpkg")
    assert done.returncode == 0, done.stderr
    assert ": 2 fields, " in done.stderr
    tracks = pyogrio.read_dataframe(tmp_path / "all.gpkg", layer="tracks")
    wanted = [len(each.table("tracks")) for each in FARM[:2]]
    assert tracks["field_id"].value_counts(sort=False).tolist() == wanted
    args = (tmp_path / "all.gpkg", "-f", "isoxml", "-f", "csv", "--out", tmp_path / "again")
    done = geofield("export", *args)
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("there are none of their points") == 1
    lines = [
        sorted(len(list(field.iter("LSG"))) for field in ET.parse(file).getroot().iter("PFD"))
        for folder in (tmp_path, tmp_path / "again")
        for file in [folder / "isoxml" / "TASKDATA" / "TASKDATA.XML"]
    ]
    assert lines[0] == lines[1]


def test_places_that_are_no_farms_are_a_persons_own(tmp_path):
    points = gpd.GeoDataFrame(geometry=[shapely.Point(0, 0)], crs=4326)
    # A farm's overview says which layers are its own (`test_an_overview_of_one_field...`).
    for number, layer, told in ((2, "places", 1), (2, "mine", 1), (1, "places", 1)):
        folder = tmp_path / f"{layer}{number}"
        write_datasets(FARM[:number], folder, ["gpkg"])
        pyogrio.write_dataframe(points, folder / "field.gpkg", layer=layer)
        done = geofield("export", folder / "field.gpkg", "-f", "kml", "--out", folder / "out")
        assert done.returncode == 0, done.stderr
        assert done.stderr.count("is not geofield's") == told
