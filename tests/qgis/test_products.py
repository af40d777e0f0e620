"""QGIS opens every product as it is meant, and finds no fault with its polygons."""

from __future__ import annotations

import json
import subprocess

import pytest
from formats_plan import make_dataset

from geofield.formats import write_dataset

#: File, sublayer, rows, geometry type (WKB), CRS.
PRODUCTS = [
    ("geojson/field.geojson", None, 1, 3, "EPSG:4326"),
    ("geojson/obstacles.geojson", None, 4, 3, "EPSG:4326"),
    ("geojson/tracks.geojson", None, 12, 5, "EPSG:4326"),
    ("geojson/gaps.geojson", None, 11, 2, "EPSG:4326"),
    (
        "geojson/track_points.geojson",
        None,
        len(make_dataset().table("track_points")),
        1,
        "EPSG:4326",
    ),
    ("shapefile/boundary.shp", None, 1, 6, "EPSG:4326"),
    ("shapefile/obstacles.shp", None, 3, 6, "EPSG:4326"),
    ("shapefile/obstacles_rejected.shp", None, 1, 6, "EPSG:4326"),
    ("shapefile/guidance.shp", None, 23, 5, "EPSG:4326"),
    ("flatgeobuf/obstacles.fgb", None, 4, 3, "EPSG:32636"),
    ("flatgeobuf/tracks.fgb", None, 12, 5, "EPSG:32636"),
    ("field.kml", "obstacles", 4, 1003, "EPSG:4326"),
    ("field.kml", "tracks", 12, 1005, "EPSG:4326"),
    ("field.gpx", "tracks", 12, 5, "EPSG:4326"),
    ("field.gpx", "waypoints", 3, 1, "EPSG:4326"),
    ("fiboa/field.geojson", None, 1, 3, "EPSG:4326"),
    ("field.dxf", "entities", 40, 2, "EPSG:32636"),
]
FIELD_LONLAT = (33.537, 35.0705, 33.539, 35.0712)


@pytest.fixture(scope="module")
def answers(product, qgis):
    requests = [
        {"do": "vector", "uri": str(product / name) + (f"|layername={sub}" if sub else "")}
        for name, sub, *_ in PRODUCTS
    ]
    return dict(zip([p[:2] for p in PRODUCTS], qgis("several", requests=requests), strict=True))


@pytest.mark.parametrize("expected", PRODUCTS, ids=lambda p: f"{p[0]}:{p[1]}")
def test_qgis_opens_every_vector_product(answers, expected):
    name, sub, rows, kind, crs = expected
    facts = answers[name, sub]
    assert facts["valid"], facts["error"]
    assert facts["rows"] == rows
    assert facts["wkb"] % 1000 == kind % 1000
    if not name.endswith(".dxf"):
        assert facts["crs"] == crs
    if crs == "EPSG:4326":
        west, south, east, north = facts["extent"]
        assert FIELD_LONLAT[0] < west < east < FIELD_LONLAT[2]
        assert FIELD_LONLAT[1] < south < north < FIELD_LONLAT[3]


def test_qgis_opens_the_picture(product, qgis):
    facts = qgis("raster", uri=str(product / "scene.tif"))
    assert facts["valid"]
    assert facts["crs"] == "EPSG:32636"


def test_check_validity_finds_no_error(copy, qgis):
    uris = [
        *(f"{copy / 'field.gpkg'}|layername={name}" for name in ("field", "obstacles")),
        str(copy / "geojson" / "field.geojson"),
        str(copy / "geojson" / "obstacles.geojson"),
        str(copy / "shapefile" / "boundary.shp"),
        str(copy / "shapefile" / "obstacles.shp"),
        str(copy / "flatgeobuf" / "obstacles.fgb"),
        str(copy / "fiboa" / "field.geojson"),
    ]
    for uri, (valid, invalid, errors) in qgis("validity", uris=uris).items():
        assert valid > 0, uri
        assert (invalid, errors) == (0, 0), uri


def test_gdal_finds_no_fault_with_the_geopackage(product, qgis_environment):
    done = subprocess.run(
        [
            "/usr/bin/python3",
            "-m",
            "osgeo_utils.samples.validate_gpkg",
            str(product / "field.gpkg"),
        ],
        env=qgis_environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "WARNING" not in done.stdout.upper()


@pytest.mark.parametrize("profile", ["tracklead", "aggps"])
def test_terminal_shapefiles_open(tmp_path, qgis, profile):
    with pytest.warns(match="cannot carry"):
        written = write_dataset(
            make_dataset(), tmp_path, ["shapefile"], options={"profile": profile}
        )
    requests = [{"do": "vector", "uri": str(f)} for f in written if f.suffix == ".shp"]
    answers = qgis("several", requests=requests)
    assert len(answers) == (3 if profile == "tracklead" else 4)
    for facts in answers:
        assert facts["valid"], json.dumps(facts)
        assert facts["rows"] > 0
        assert facts["crs"] == "EPSG:4326"
