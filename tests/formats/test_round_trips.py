"""Every importable format: out and back, within the precision that the registry states."""

from __future__ import annotations

import dataclasses
import json
import re
import shutil
import tempfile
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely
from formats_compare import assert_same_table
from formats_plan import NAME, make_dataset
from hypothesis import given, settings
from hypothesis import strategies as st

from geofield.crs import LONLAT
from geofield.errors import FormatError
from geofield.formats import FORMATS, read_dataset, validate_file, write_dataset
from geofield.formats.antimeridian import joined, split
from geofield.formats.export import dropped
from geofield.formats.names import cut_name

pytestmark = pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")

ALL = ("field", "obstacles", "tracks", "segments", "gaps", "track_points")
#: Format, what to read, and the layers that come back row by row.
WHOLE = [
    ("gpkg", "field.gpkg", ALL),
    ("geojson", "geojson", ALL),
    ("geoparquet", "geoparquet", ALL),
    ("flatgeobuf", "flatgeobuf", ALL),
    ("shapefile", "shapefile", ("field", "obstacles", "segments")),
    ("kml", "field.kml", ("field", "obstacles", "tracks", "gaps")),
]


@pytest.mark.parametrize(("name", "product", "layers"), WHOLE)
def test_same_rows_and_shapes(dataset, tmp_path, name, product, layers):
    write_dataset(dataset, tmp_path, [name])
    back = read_dataset(tmp_path / product)
    assert back.crs == dataset.crs
    assert back.name == NAME
    for layer in layers:
        assert_same_table(
            dataset.table(layer),
            back.table(layer),
            precision_m=FORMATS[name].precision_m,
            number_tolerance=0.0 if FORMATS[name].precision_m == 0 else 1e-8,
        )


@pytest.mark.parametrize("name", ["isoxml", "isoxml-v3", "agopengps"])
def test_what_no_longer_knows_its_trees_is_told(dataset, tmp_path, name):
    """They came back from ISOXML 3 and AgOpenGPS as kind `other`, without a word."""
    write_dataset(dataset, tmp_path, [name])
    trees = (read_dataset(tmp_path / name).table("obstacles")["kind"] == "tree").any()
    assert (dataset.table("obstacles")["kind"] == "tree").any()
    assert trees != ("which obstacles are trees" in dropped(dataset, FORMATS[name]))


def test_study_xml_tells_what_it_leaves_out(dataset, tmp_path):
    """It had no rejected obstacle and no status, without a word."""
    write_dataset(dataset, tmp_path, ["study-xml"])
    root = ET.parse(tmp_path / "obstacles.xml").getroot()
    numbers = {int(each.text) for each in root.iter("Number")}
    assert numbers == set(dataset.table("obstacles")["obstacle_no"]) - {3}
    told = dropped(dataset, FORMATS["study-xml"])
    assert "obstacles that tracks run through" in told
    assert "the status, safety margin and confidence of obstacles" in told


def test_fiboa_keeps_the_name_and_what_speaks_against_the_outline(dataset, tmp_path):
    field = dataset.table("field").assign(certainty=[0.41], doubts=["the border is faint"])
    doubtful = dataclasses.replace(dataset, tables={**dataset.tables, "field": field})
    write_dataset(doubtful, tmp_path, ["fiboa"])
    for file in ("field.geojson", "field.parquet"):
        path = tmp_path / "fiboa" / file
        row = (gpd.read_parquet if file.endswith("parquet") else gpd.read_file)(path).iloc[0]
        assert (row["name"], row["certainty"], row["doubts"]) == (NAME, 0.41, "the border is faint")


def test_the_studys_points_come_back_as_exactly_as_is_said(dataset, tmp_path):
    """Said to be exact, and 7 mm off: the study writes seven decimals of a degree."""
    write_dataset(dataset, tmp_path, ["rdf-study"])
    back = read_dataset(tmp_path / "tracks.rdf").table("track_points")
    assert_same_table(
        dataset.table("track_points"),
        back,
        precision_m=FORMATS["rdf-study"].precision_m,
        columns=["point_no", "track_no", "segment_no"],
    )
    assert FORMATS["rdf-study"].precision_m < 0.01


@pytest.mark.parametrize("name", ["isoxml", "isoxml-v3"])
def test_terminals_get_what_they_drive_by(dataset, tmp_path, name):
    write_dataset(dataset, tmp_path, [name])
    back = read_dataset(tmp_path / name)
    assert back.name == NAME
    kept = dataset.table("obstacles")
    kept = kept[kept["status"] != "rejected"].reset_index(drop=True)
    precision = FORMATS[name].precision_m
    numbers = ["obstacle_no", "kind"] if name == "isoxml" else ["obstacle_no"]
    assert_same_table(
        dataset.table("field"), back.table("field"), precision_m=precision, columns=["name"]
    )
    assert_same_table(kept, back.table("obstacles"), precision_m=precision, columns=numbers)
    for layer, columns in (
        ("segments", ["track_no", "segment_no"]),
        ("tracks", ["track_no", "gap_count"]),
    ):
        assert_same_table(
            dataset.table(layer), back.table(layer), precision_m=precision, columns=columns
        )
    assert set(back.table("obstacles")["status"]) == {"added"}


def test_agopengps_keeps_rings_numbers_and_lines(dataset, tmp_path):
    write_dataset(dataset, tmp_path, ["agopengps"])
    back = read_dataset(tmp_path / "agopengps" / "Fields")
    assert back.name == NAME
    precision = FORMATS["agopengps"].precision_m
    assert_same_table(
        dataset.table("field"),
        back.table("field"),
        precision_m=precision,
        columns=["name"],
        same_vertices=False,
    )
    kept = dataset.table("obstacles")
    kept = kept[kept["status"] != "rejected"].reset_index(drop=True)
    kept.geometry = [shapely.Polygon(shape.exterior) for shape in kept.geometry]
    assert_same_table(
        kept,
        back.table("obstacles"),
        precision_m=precision,
        columns=["obstacle_no"],
        same_vertices=False,
    )
    whole = dataset.table("tracks").copy()
    whole.geometry = [
        shapely.multilinestrings([shapely.get_coordinates(line)[[0, -1]]])
        for line in whole.geometry
    ]
    assert_same_table(whole, back.table("tracks"), precision_m=precision, columns=["track_no"])


@pytest.mark.parametrize("name", ["gpkg", "geoparquet"])
def test_lossless_formats_keep_the_origin(dataset, tmp_path, name):
    write_dataset(dataset, tmp_path, [name])
    back = read_dataset(tmp_path / ("field.gpkg" if name == "gpkg" else name))
    assert back.provenance == dataset.provenance
    assert back.grid == dataset.grid
    assert back.crs == dataset.crs


OPTIONAL = ("headland", "headland_tracks", "route", "turns")


@pytest.mark.parametrize("name", ["gpkg", "geojson", "geoparquet", "flatgeobuf"])
def test_layers_that_not_every_plan_has(tmp_path, name):
    dataset = make_dataset(optional=True)
    write_dataset(dataset, tmp_path, [name])
    back = read_dataset(tmp_path / ("field.gpkg" if name == "gpkg" else name))
    for layer in OPTIONAL:
        assert_same_table(
            dataset.table(layer),
            back.table(layer),
            precision_m=FORMATS[name].precision_m,
            number_tolerance=1e-9,
        )


def test_terminals_get_the_headland(tmp_path):
    dataset = make_dataset(optional=True)
    write_dataset(dataset, tmp_path, ["isoxml", "shapefile"], options={"profile": "tracklead"})
    text = (tmp_path / "isoxml" / "TASKDATA" / "TASKDATA.XML").read_text(encoding="utf-8")
    assert text.count('<PLN A="10"') == 1
    assert [f.level for f in validate_file(tmp_path / "isoxml") if f.level == "error"] == []
    names = {path.name for path in (tmp_path / "shapefile").glob("*.shp")}
    assert names == {
        f"Grosser_Acker_Nandu_{kind}.shp"
        for kind in ("boundary", "obstacles", "guidancepath", "headland")
    }


# Characters that XML has no way to write are refused (test_bad_input).
TEXTS = st.text(
    st.characters(codec="utf-8", exclude_categories=["Cc", "Cs", "Cn"]), min_size=1, max_size=40
)


@given(TEXTS, st.sampled_from(["gpkg", "geojson", "shapefile", "isoxml", "kml", "geoparquet"]))
@settings(max_examples=25, deadline=None)
def test_any_name_survives(text, name):
    name_there = text.strip() or "x"
    dataset = make_dataset(points=False)
    field = dataset.tables["field"].assign(name=name_there)
    small = dataclasses.replace(dataset, tables={"field": field}, name=name_there)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        write_dataset(small, out, [name])
        read = {"gpkg": "field.gpkg", "kml": "field.kml"}
        back = read_dataset(out / read.get(name, name))
    expected = cut_name(name_there, 32) if name == "isoxml" else name_there
    assert back.name == expected


@pytest.mark.parametrize("profile", ["tracklead", "aggps"])
def test_what_terminals_hold_can_be_imported(dataset, tmp_path, profile):
    written = write_dataset(dataset, tmp_path, ["shapefile"], options={"profile": profile})
    back = read_dataset(written[0].parent)
    assert (
        back.table("field")
        .geometry.iloc[0]
        .symmetric_difference(dataset.table("field").geometry.iloc[0])
        .area
        < 0.01
    )
    kept = dataset.table("obstacles").set_index("obstacle_no").geometry
    found = back.table("obstacles")
    assert len(found) == 3
    for shape in found.geometry:
        nearest = min(kept, key=lambda other: other.centroid.distance(shape.centroid))
        if profile == "aggps" or len(nearest.interiors) == 0:
            assert nearest.symmetric_difference(shape).area < 0.01
    assert len(back.table("segments")) == len(dataset.table("segments"))


@pytest.mark.parametrize("name", ["shapefile", "isoxml", "gpkg"])
def test_archives_are_read(dataset, tmp_path, name):
    write_dataset(dataset, tmp_path / "there", [name])
    whole = shutil.make_archive(str(tmp_path / "stick"), "zip", tmp_path / "there")
    back = read_dataset(whole)
    assert back.name == NAME
    assert len(back.table("obstacles")) == (3 if name == "isoxml" else 4)
    if name == "gpkg":
        assert len(back.table("track_points")) == len(dataset.table("track_points"))
    assert [f for f in validate_file(whole) if f.level == "error"] == []


def test_own_zipped_shapefiles(dataset, tmp_path):
    (path,) = write_dataset(dataset, tmp_path, ["shapefile"], options={"zip": True})
    assert len(read_dataset(path).table("segments")) == len(dataset.table("segments"))


@pytest.mark.parametrize("lon", [-62.0, 120.0, 33.0])
def test_geojson_keeps_digits_behind_zeros_and_nines(dataset, tmp_path, lon):
    """-62.0000008 is a tenth of a metre from -62: no noise that a writer may drop."""
    lons = lon + np.array([*range(1, 10), 999_999, 999_991, 1_000_004, 4_999_998]) / 1e7
    line = shapely.LineString([(each, -33.0 - n * 1e-4) for n, each in enumerate(lons)])
    segments = dataset.tables["segments"].iloc[:1].to_crs(LONLAT).set_geometry([line], crs=LONLAT)
    moved = dataclasses.replace(dataset, tables={"segments": segments}, crs=LONLAT, points=None)
    write_dataset(moved, tmp_path, ["geojson"])
    text = (tmp_path / "geojson" / "segments.geojson").read_text(encoding="utf-8")
    (feature,) = json.loads(text)["features"]
    xy = np.array(feature["geometry"]["coordinates"])
    np.testing.assert_allclose(xy, shapely.get_coordinates(line), rtol=0, atol=5.1e-8)
    assert not re.search(r"\d\.\d{8,}", text.partition('"coordinates"')[2])
    assert '"xy_coordinate_resolution": 1e-07' in text


def test_geojson_loses_no_row_that_is_too_thin_for_it(dataset, tmp_path):
    obstacles = dataset.tables["obstacles"].copy()
    x, y = obstacles.geometry.iloc[0].centroid.coords[0]
    obstacles.geometry = [shapely.box(x, y, x + 9, y + 1e-4), *obstacles.geometry.iloc[1:]]
    thin = dataclasses.replace(dataset, tables={**dataset.tables, "obstacles": obstacles})
    write_dataset(thin, tmp_path, ["geojson"])
    assert list(read_dataset(tmp_path / "geojson").table("obstacles")["obstacle_no"]) == [
        1,
        2,
        3,
        4,
    ]


def test_archives_that_lead_out_of_their_folder(tmp_path):
    with zipfile.ZipFile(tmp_path / "bad.zip", "w") as archive:
        archive.writestr("../../evil.shp", b"x")
    with pytest.raises(FormatError, match="leads out"):
        read_dataset(tmp_path / "bad.zip")
    (tmp_path / "broken.zip").write_bytes(b"PK not really")
    with pytest.raises(FormatError, match="cannot be unpacked"):
        read_dataset(tmp_path / "broken.zip")


def test_options_for_one_format_alone(dataset, tmp_path):
    options = {"shapefile": {"profile": "tracklead"}, "customer": "Ann"}
    write_dataset(dataset, tmp_path, ["shapefile", "isoxml"], options=options)
    assert list((tmp_path / "shapefile").glob("*_guidancepath.shp"))
    with pytest.raises(FormatError, match="Did you mean 'profile'"):
        write_dataset(dataset, tmp_path / "x", ["shapefile"], options={"shapefile": {"profil": 1}})


def test_what_ends_just_behind_the_180th_meridian_ends_there_again():
    """Half a millionth of a degree is five centimetres."""
    line = shapely.LineString([(179.9999, -17.0), (-179.9999995, -17.0)])
    (back,) = joined(split(np.array([line])), LONLAT)
    assert shapely.get_coordinates(back)[-1][0] == pytest.approx(180.0000005, abs=1e-9)


def test_a_shape_round_a_pole_is_refused_in_degrees() -> None:
    ring = shapely.Polygon([(x, 89.99) for x in range(-180, 180, 20)])
    with pytest.raises(FormatError, match="round a pole"):
        split(np.array([ring]))


@pytest.mark.parametrize("lonlat", [
    [(179.99, 1), (180.01, 1.01), (180.01, 1), (179.99, 1.01)],
    [(179.99, 1), (180.01, 1), (179.99, 1)],
    [(179.99, 1), (180.02, 1), (180.02, 1.1), (180.01, 1.1), (180.01, 0.9), (179.9, 0.9)],
    [(179.9, 1), (180, 1), (180.1, 1), (180.1, 1.1), (180, 1.1), (179.9, 1.1)],
])  # fmt: skip
def test_a_line_that_crosses_itself_and_the_180th_meridian_is_driven_as_before(lonlat):
    """Joined by places, it came back in several pieces, or ground driven twice counted once."""
    line = shapely.LineString([(x - 360.0 * (x > 180.0), y) for x, y in lonlat])
    (cut,) = split(np.array([line]))
    assert np.abs(shapely.get_coordinates(cut)[:, 0]).max() == 180.0
    (back,) = joined(np.array([cut]), LONLAT)
    assert back.geom_type == "LineString"
    assert back.length == pytest.approx(shapely.LineString(lonlat).length, abs=1e-9)
    corners = shapely.get_coordinates(back)[:, 0] != 180.0
    inner = [corner for corner in lonlat if corner[0] != 180]
    assert shapely.get_coordinates(back)[corners] == pytest.approx(np.array(inner), abs=1e-9)
