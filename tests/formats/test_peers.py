"""Other people's readers and validators agree with what was written."""

from __future__ import annotations

import json
import sqlite3
import xml.etree.ElementTree as ET
from contextlib import closing

import fiona
import geojson_validator
import geopandas as gpd
import geoparquet_validator
import numpy as np
import pyarrow.parquet as pq
import pyogrio
import pytest
import shapely
from formats_plan import NAME, SCALE, make_dataset

from geofield import schema
from geofield.formats import validate_file, write_dataset
from geofield.formats.arrow import to_lonlat

pytestmark = pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")
LAYERS = [layer.name for layer in schema.LAYERS if not layer.optional]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("peers")
    names = ["gpkg", "geojson", "shapefile", "flatgeobuf", "geoparquet"]
    names += ["kml", "gpx", "csv", "fiboa", "dxf"]
    write_dataset(make_dataset(), out, names)
    return out


@pytest.fixture(scope="module")
def plan():
    return make_dataset()


@pytest.mark.parametrize("layer", LAYERS)
def test_fiona_and_pyogrio_read_the_same_geopackage(folder, plan, layer):
    path = folder / "field.gpkg"
    ours = plan.table(layer)
    with fiona.open(path, layer=layer) as source:
        assert source.crs.to_epsg() == 32636
        assert source.schema["geometry"] == schema.layer(layer).geometry
        kinds = {name: kind.split(":")[0] for name, kind in source.schema["properties"].items()}
        rows = list(source)
    wanted = {"int": "int", "float": "float", "str": "str", "date": "date"}
    for column in schema.layer(layer).columns:
        assert kinds[column.name].rstrip("0123456789") == wanted[column.type]
    assert [row.geometry.type for row in rows] == list(ours.geom_type)
    theirs = pyogrio.read_dataframe(path, layer=layer)
    for row, (_, other) in zip(rows, theirs.iterrows(), strict=True):
        assert shapely.geometry.shape(row.geometry).equals_exact(other.geometry, 0)
    assert theirs.crs.to_epsg() == 32636


def test_styles_and_projects_are_no_layers(folder):
    # Both readers list attribute tables: what they hold must not look like geometry.
    kinds = dict(pyogrio.list_layers(folder / "field.gpkg"))
    assert {name for name, kind in kinds.items() if kind is not None} == set(LAYERS)


def test_geopackage_tables(folder):
    with closing(sqlite3.connect(folder / "field.gpkg")) as connection, connection:

        def ask(text):
            return connection.execute(text).fetchall()

        assert ask("PRAGMA user_version") == [(10300,)]
        assert ask("PRAGMA journal_mode") == [("delete",)]
        assert ask("PRAGMA integrity_check") == [("ok",)]
        styles = ask(
            "SELECT f_table_name, f_geometry_column, f_table_catalog, useAsDefault, styleQML, "
            "styleSLD FROM layer_styles"
        )
        assert [row[0] for row in styles] == LAYERS
        for _, column, catalog, default, qml, sld in styles:
            assert (column, catalog, default) == ("geom", "", 1)
            assert ET.fromstring(qml.partition("\n")[2]).get("version").startswith("3.22")
            assert ET.fromstring(sld).tag.endswith("StyledLayerDescriptor")
        ((name, content),) = ask("SELECT name, content FROM qgis_projects")
        assert name == "field"
        assert bytes.fromhex(content.decode()) == (folder / "field.qgz").read_bytes()
        titles = dict(ask("SELECT column_name, title FROM gpkg_data_columns"))
        assert titles["radius_m"] == "Radius"
        values = ask(
            "SELECT value FROM gpkg_data_column_constraints "
            "WHERE constraint_name = 'obstacles_status'"
        )
        assert sorted(value for (value,) in values) == sorted(schema.STATUSES)
    connection.close()


@pytest.mark.parametrize("layer", LAYERS)
def test_geojson_validator(folder, layer):
    content = json.loads((folder / "geojson" / f"{layer}.geojson").read_text(encoding="utf-8"))
    assert "crs" not in content
    errors = geojson_validator.validate_structure(content)
    assert not errors, errors
    if layer in ("field", "obstacles"):
        found = geojson_validator.validate_geometries(content)
        assert not found["invalid"], found["invalid"]
        # Seven decimals are a centimetre; the validator asks for six.
        assert set(found["problematic"]) <= {"excessive_coordinate_precision", "holes"}


@pytest.mark.parametrize(
    "product",
    ["field.gpkg", "geojson", "shapefile", "flatgeobuf", "geoparquet", "field.kml"],
)
def test_own_validation_finds_no_fault(folder, product):
    assert [each for each in validate_file(folder / product) if each.level == "error"] == []


def test_geoparquet_by_geopandas(folder, plan):
    frame = gpd.read_parquet(folder / "geoparquet" / "obstacles.parquet")
    assert frame.crs.to_epsg() == 32636
    assert frame.geometry.geom_equals(plan.table("obstacles").geometry).all()
    inside = gpd.read_parquet(
        folder / "geoparquet" / "obstacles.parquet",
        bbox=tuple(plan.table("obstacles").geometry.iloc[0].bounds),
    )
    assert list(inside["obstacle_no"]) == [1]


def test_fiboa(folder, plan):
    content = json.loads((folder / "fiboa" / "field.geojson").read_text(encoding="utf-8"))
    (feature,) = content["features"]
    properties = feature["properties"]
    assert properties["collection"] in content["schemas"]
    assert any("fiboa" in uri and "v0.3.0" in uri for uri in content["schemas"]["geofield"])
    assert isinstance(feature["id"], str)
    shape = plan.table("field").geometry.iloc[0]
    assert properties["metrics:area"] == pytest.approx(shape.area / SCALE**2, abs=0.01)
    assert properties["metrics:perimeter"] == pytest.approx(shape.length / SCALE, abs=0.01)
    assert properties["determination:method"] == "auto-imagery"
    assert properties["determination:datetime"] == "2020-06-01T00:00:00Z"
    parquet = gpd.read_parquet(folder / "fiboa" / "field.parquet")
    assert parquet.crs.to_epsg() == 4326
    assert parquet["determination:datetime"].iloc[0].isoformat() == "2020-06-01T00:00:00+00:00"
    import pyarrow.parquet as pq

    metadata = pq.read_metadata(folder / "fiboa" / "field.parquet").metadata
    assert json.loads(metadata[b"collection"])["schemas"] == content["schemas"]


def test_gpx(folder, plan):
    space = {"g": "http://www.topografix.com/GPX/1/1"}
    root = ET.parse(folder / "field.gpx").getroot()
    assert root.get("version") == "1.1"
    tracks = root.findall("g:trk", space)
    assert [t.find("g:name", space).text for t in tracks] == [f"Track {n}" for n in range(1, 13)]
    counts = [len(track.findall("g:trkseg", space)) for track in tracks]
    assert counts == list(plan.table("tracks")["segment_count"])
    first = tracks[0].find("g:trkseg/g:trkpt", space)
    line = to_lonlat(plan.table("segments").geometry.to_numpy(), plan.crs)[0]
    lon, lat = line.coords[0]
    assert abs(float(first.get("lon")) - lon) < 1e-9
    assert abs(float(first.get("lat")) - lat) < 1e-9
    assert len(root.findall("g:wpt", space)) == 3  # the rejected tree is none


def test_kml_by_gdal(folder, plan):
    frame = pyogrio.read_dataframe(folder / "field.kml", layer="tracks")
    assert list(frame["Name"]) == [f"Track {n}" for n in range(1, 13)]
    assert frame.crs.to_epsg() == 4326
    assert frame.geometry.iloc[0].has_z


def test_csv(folder, plan):
    import pandas as pd

    frame = pd.read_csv(folder / "csv" / "track_points.csv")
    points = plan.table("track_points")
    assert list(frame.columns) == schema.TRACK_POINTS.column_names
    assert len(frame) == len(points)
    np.testing.assert_allclose(frame["lat"], points["lat"], atol=1e-9)
    np.testing.assert_allclose(frame["x_px"], points["x_px"], atol=1e-3)
    obstacles = pd.read_csv(folder / "csv" / "obstacles.csv")
    assert list(obstacles["status"]) == list(plan.table("obstacles")["status"])


def test_dxf_by_gdal(folder, plan):
    frame = pyogrio.read_dataframe(folder / "field.dxf")
    counts = frame["Layer"].value_counts().to_dict()
    assert counts == {"TRACKS": 23, "GAPS": 11, "OBSTACLES": 4, "FIELD": 2}
    lengths = frame[frame["Layer"] == "TRACKS"].length.sum()
    assert lengths == pytest.approx(plan.table("segments").length.sum(), abs=1e-3)
    assert "UTM" in (folder / "field.prj").read_text()


def test_shapefile_by_fiona(folder):
    with fiona.open(folder / "shapefile" / "boundary.shp") as source:
        assert source.crs.to_epsg() == 4326
        (row,) = source
        assert row.properties["FIELD"] == row.properties["name"] == NAME
        ring = row.geometry.coordinates[0]
        assert not shapely.is_ccw(shapely.LinearRing(ring))  # clockwise outside
    assert (folder / "shapefile" / "boundary.cpg").read_text().strip() == "UTF-8"


@pytest.mark.filterwarnings("ignore:The inplace keyword")  # dask's own
@pytest.mark.parametrize("layer", LAYERS)
def test_dask_and_a_validator_read_geoparquet(folder, plan, layer):
    import dask_geopandas

    path = folder / "geoparquet" / f"{layer}.parquet"
    ours = plan.table(layer)
    theirs = dask_geopandas.read_parquet(path)
    assert theirs.crs.to_epsg() == 32636
    # Read without computing: the partitions' extents stand in the metadata.
    extent = theirs.spatial_partitions.total_bounds
    np.testing.assert_allclose(extent, ours.total_bounds, rtol=0, atol=1e-9)
    mine = shapely.normalize(np.asarray(ours.geometry.to_numpy(), dtype=object))
    shapes = shapely.normalize(np.asarray(theirs.compute().geometry.to_numpy(), dtype=object))
    assert shapely.equals_exact(mine, shapes, 0).all()
    report = geoparquet_validator.check(str(path))
    assert geoparquet_validator.failed(report) == []
    passed = [each["id"] for each in report["outcomes"] if each["status"] == "pass"]
    assert "/conf/core/geo-metadata" in passed


def test_fiboa_as_its_own_validator_reads_it(folder):
    # It asks the Arrow schema for the metadata, wants id, collection and geometry never missing,
    # and everything else, a box included, optional.
    path = folder / "fiboa" / "field.parquet"
    found = pq.read_schema(path)
    schemas = json.loads(found.metadata[b"collection"])["schemas"]["geofield"]
    assert any(each.startswith("https://fiboa.org/specification/") for each in schemas)
    assert json.loads(found.metadata[b"geo"])["primary_column"] == "geometry"
    needed = [field.name for field in found if not field.nullable]
    assert needed == ["id", "collection", "geometry"]
    assert found.field("metrics:area").type == "float"
    assert str(found.field("determination:datetime").type) == "timestamp[ms, tz=UTC]"
    report = geoparquet_validator.check(str(path))
    assert geoparquet_validator.failed(report, "core") == []
