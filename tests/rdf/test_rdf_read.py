"""Back from RDF to the same dataset, and files of other programs."""

from __future__ import annotations

import re

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rdf_plans import plan_across_180, small_plan

from geofield.crs import LONLAT, areas_anywhere_m2
from geofield.errors import FormatError, FormatWarning
from geofield.formats.rdf import write
from geofield.formats.rdf.read import from_graph, load, read
from geofield.formats.rdf.validate import check

WRITERS = {
    "xml": write.write_rdfxml,
    "turtle": write.write_turtle,
    "json-ld": write.write_jsonld,
    "nt": write.write_ntriples,
}


def assert_same_tables(got, wanted, *, points=False):
    """Every column and every coordinate identical, to the last bit; points to a centimetre."""
    assert set(got.tables) == set(wanted.tables)
    for name, table in wanted.tables.items():
        other = got.tables[name]
        if name == "track_points" and not points:
            assert other.empty
            continue
        if name == "track_points":
            assert_same_points(other, table)
            continue
        pd.testing.assert_frame_equal(
            pd.DataFrame(other.drop(columns="geometry")),
            pd.DataFrame(table.drop(columns="geometry")),
            check_exact=True,
            obj=name,
        )
        same = shapely.equals_identical(other.geometry.to_numpy(), table.geometry.to_numpy())
        assert same.all(), name


def assert_same_points(got, wanted):
    """Numbers identical; places to the seven decimals of a degree in which they are told."""
    for column in ("point_no", "track_no", "segment_no"):
        assert got[column].tolist() == wanted[column].tolist(), column
    for column in ("lat", "lon"):
        assert np.abs(got[column] - wanted[column]).max() <= 0.51e-7, column
    for column in ("x_px", "y_px"):
        assert np.abs(got[column] - wanted[column]).max() < 0.05, column
    assert shapely.distance(got.geometry.to_numpy(), wanted.geometry.to_numpy()).max() < 0.01


def test_a_plan_across_180_is_cut_there_and_reads_back_whole(tmp_path):
    plan = plan_across_180()
    (path,) = write.write_ntriples(plan, tmp_path, options={})
    text = path.read_text(encoding="utf-8")
    assert "sf#MultiPolygon" in text
    shapes = re.findall(r'CRS84> ((?:MULTI)?(?:POLYGON|LINESTRING)[^"]*)"', text)
    for part in shapely.get_parts(shapely.from_wkt(shapes)):
        west, _, east, _ = part.bounds
        assert east - west < 0.01
    assert_same_tables(read(path), plan)
    # Without the geometries of the metric CRS, to the nine decimals of a degree.
    lines = [line for line in text.splitlines(keepends=True) if "/EPSG-32660>" not in line]
    path.write_text("".join(lines), encoding="utf-8")
    got = read(path)
    for name in ("field", "obstacles", "segments"):
        ours, theirs = plan.tables[name].geometry, got.tables[name].geometry
        assert shapely.hausdorff_distance(ours.to_numpy(), theirs.to_numpy()).max() < 1e-3


@pytest.mark.parametrize("profile", write.PROFILES)
@pytest.mark.parametrize("syntax", WRITERS)
def test_a_plan_reads_back_whole(plan, tmp_path, profile, syntax):
    options = {"rdf_profile": profile, "points": True}
    for path in WRITERS[syntax](plan, tmp_path, options=options):
        got = read(path)
        assert_same_tables(got, plan, points=True)
        assert got.crs == plan.crs
        assert got.name == plan.name
        assert got.grid == plan.grid
        assert got.provenance == plan.provenance


@pytest.mark.parametrize("crs", ["EPSG:25832", "EPSG:3044", "EPSG:32736", "EPSG:26910"])
def test_utm_zones_of_any_datum_and_axis_order_read_back(tmp_path, crs):
    # EPSG:3044 is ETRS89 / UTM 32N with the northing first: WKT must swap, tables must not.
    plan = small_plan(crs=crs)
    (path,) = write.write_turtle(plan, tmp_path, options={})
    assert_same_tables(read(path), plan)


def test_a_metric_crs_without_epsg_code_reads_back_to_less_than_a_micrometre(tmp_path):
    plan = small_plan(crs="+proj=tmerc +lat_0=35 +lon_0=33.5 +x_0=548000 +y_0=3881000 +units=m")
    (path,) = write.write_turtle(plan, tmp_path, options={})
    assert "metricCrsWkt" in path.read_text()
    got = read(path)
    assert got.crs == plan.crs
    for name, table in plan.tables.items():
        if name == "track_points":
            continue
        difference = shapely.get_coordinates(
            got.tables[name].geometry.to_numpy()
        ) - shapely.get_coordinates(table.geometry.to_numpy())
        assert np.abs(difference).max() < 1e-6, name


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    text=st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1).filter(str.strip),
    radius=st.floats(0, 1e6, allow_subnormal=True),
    confidence=st.one_of(st.just(np.nan), st.floats(0, 1)),
    syntax=st.sampled_from(sorted(WRITERS)),
)
def test_any_text_and_number_reads_back(tmp_path, text, radius, confidence, syntax):
    plan = small_plan(spacing_m=30)
    plan.tables["field"].loc[0, ["name", "imagery", "method"]] = text
    plan.tables["obstacles"].loc[0, "radius_m"] = radius
    plan.tables["obstacles"].loc[1, "confidence"] = confidence
    assert_same_tables(read(WRITERS[syntax](plan, tmp_path, options={})[0]), plan)


def test_an_empty_plan_is_written_and_read(tmp_path):
    plan = small_plan()
    only_field = type(plan)({"field": plan.tables["field"]}, plan.crs, plan.name)
    for writer in WRITERS.values():
        path = writer(only_field, tmp_path, options={})[0]
        got = read(path)
        assert len(got.table("field")) == 1
        assert not got.has("tracks")
        assert not got.has("obstacles")


def test_files_of_another_field_beside_are_left_alone(plan, tmp_path):
    write.write_rdfxml(plan, tmp_path, options={})
    other = small_plan()
    other.tables["field"].loc[0, "field_id"] = "other"
    (tmp_path / "b").mkdir()
    write.write_rdfxml(other, tmp_path / "b", options={})
    (tmp_path / "b" / "obstacles.rdf").replace(tmp_path / "obstacles.rdf")
    with pytest.warns(FormatWarning, match=r"obstacles\.rdf is of another field"):
        got = read(tmp_path / "field.rdf")
    assert not got.has("obstacles")
    assert got.has("tracks")


OTHER_PLANNER = """
@prefix geo: <http://www.opengis.net/ont/geosparql#> .
@prefix gf: <https://w3id.org/geofield#> .
@prefix my: <https://planner.example/> .

my:f a gf:Field ; geo:hasDefaultGeometry my:fg .
my:fg geo:asWKT
  "POLYGON ((33.530 35.075, 33.532 35.075, 33.532 35.076, 33.530 35.076, 33.530 35.075))"
  ^^geo:wktLiteral .
my:tree a gf:Obstacle ; geo:hasGeometry my:og .
my:og geo:asWKT '''<http://www.opengis.net/def/crs/EPSG/0/4326>
  POLYGON ((35.0755 33.5310, 35.0756 33.5310, 35.0756 33.5311, 35.0755 33.5310))'''
  ^^geo:wktLiteral .
my:a a gf:Track ; gf:trackNo 1 ; geo:hasGeometry my:ag .
my:ag geo:asWKT "LINESTRING (33.5301 35.0751, 33.5319 35.0751)"
  ^^geo:wktLiteral .
my:b a gf:Track ; gf:trackNo 2 ; geo:hasGeometry my:bg .
my:bg geo:asWKT
  "MULTILINESTRING ((33.5301 35.0753, 33.5305 35.0753), (33.5310 35.0753, 33.5319 35.0753))"
  ^^geo:wktLiteral .
"""


def test_another_planners_sparse_file_loads(tmp_path):
    path = tmp_path / "other.ttl"
    path.write_text(OTHER_PLANNER)
    got = read(path)
    assert got.crs.to_epsg() == 32636
    assert got.table("field")["area_ha"].iloc[0] == pytest.approx(2.02, abs=0.02)
    assert got.table("tracks")["segment_count"].tolist() == [1, 2]
    assert got.table("tracks")["length_m"].iloc[0] == pytest.approx(164.1, abs=0.3)
    assert got.table("tracks")["heading_deg"].iloc[0] == pytest.approx(90.0, abs=0.01)
    assert got.table("segments")[["track_no", "segment_no"]].values.tolist() == [
        [1, 1],
        [2, 1],
        [2, 2],
    ]
    obstacle = got.table("obstacles").iloc[0]
    assert (obstacle["obstacle_no"], obstacle["kind"], obstacle["status"]) == (1, "other", "added")
    # EPSG:4326 is latitude first: the obstacle must lie in the field all the same.
    assert got.table("field").geometry.iloc[0].contains(obstacle["geometry"])


@pytest.mark.parametrize("code", [3857, 28992, 2263])
def test_outlines_in_a_crs_whose_lengths_are_others_are_brought_to_the_zone(tmp_path, code):
    """Web Mercator and feet, as maps and surveyors have them; a national grid in metres stays."""
    lon, lat = {3857: (33.53, 35.07), 28992: (5.4, 52.1), 2263: (-74.0, 40.7)}[code]
    square = gpd.GeoSeries([shapely.box(lon, lat, lon + 0.002, lat + 0.001)], crs="EPSG:4326")
    wkt = square.to_crs(code).iloc[0].wkt
    path = tmp_path / "other.ttl"
    iri = f"<http://www.opengis.net/def/crs/EPSG/0/{code}>"
    path.write_text(
        re.sub(r'(?s)fg geo:asWKT\s+".*?"', f'fg geo:asWKT "{iri} {wkt}"', OTHER_PLANNER)
    )
    got = read(path)
    assert got.crs.to_epsg() == (28992 if code == 28992 else square.estimate_utm_crs().to_epsg())
    (area_ha,) = got.table("field")["area_ha"]
    assert area_ha == pytest.approx(areas_anywhere_m2(square, LONLAT)[0] / 1e4, rel=1e-3)


def test_a_mark_before_the_text_and_decimal_numbers_are_other_programs_ways(tmp_path):
    path = tmp_path / "other.ttl"
    number = 'gf:trackNo "2.0"^^<http://www.w3.org/2001/XMLSchema#decimal>'
    path.write_text(OTHER_PLANNER.replace("gf:trackNo 2", number), encoding="utf-8-sig")
    assert read(path).table("tracks")["track_no"].tolist() == [1, 2]


@pytest.mark.parametrize(
    ("pattern", "replacement", "words"),
    [
        (r"(?s)POLYGON \(\(33.*?\)\)", "POLYGON EMPTY", "fg>: its geometry is empty"),
        (r"(?s)POLYGON \(\(35.*?\)\)", "POLYGON EMPTY", "tree>: its geometry is empty"),
        ("EPSG/0/4326", "EPSG/0/999999", "is not known"),
        ("EPSG/0/4326", "EPSG/0/5773", "is not known"),  # heights
        ("EPSG/0/4326", "EPSG/0/4978", "is not known"),  # from the middle of the earth
        ("trackNo 2", 'trackNo "2.5"', "'2.5', not a whole number"),
    ],
)
def test_what_is_no_place_or_number_is_told(tmp_path, pattern, replacement, words):
    path = tmp_path / "other.ttl"
    path.write_text(re.sub(pattern, replacement, OTHER_PLANNER))
    with pytest.raises(FormatError, match=re.escape(words)):
        read(path)
    assert any(finding.level == "error" for finding in check(path))


def test_a_position_that_is_no_number_is_told(tmp_path):
    path = tmp_path / "other.ttl"
    path.write_text(
        "@prefix gf: <https://w3id.org/geofield#> .\n"
        "@prefix wgs84: <http://www.w3.org/2003/01/geo/wgs84_pos#> .\n"
        '<urn:tree> a gf:Obstacle ; gf:radiusInMetres 3.0 ; wgs84:lat "35,07" ; wgs84:long 33.5 .'
    )
    with pytest.raises(FormatError, match="lat is '35,07', not a finite number"):
        read(path)


def test_two_planners_share_the_obstacles_and_merge(plan, tmp_path):
    other = small_plan(spacing_m=12)
    (mine,) = write.write_turtle(plan, tmp_path, stem="mine", options={})
    (theirs,) = write.write_turtle(other, tmp_path, stem="theirs", options={"plan_name": "acme"})
    merged = load(mine)
    before = set(merged.of_type("https://w3id.org/geofield#Obstacle"))
    merged.merge(load(theirs))
    assert set(merged.of_type("https://w3id.org/geofield#Obstacle")) == before
    # Nothing says two different things of one obstacle, track or geometry.
    for name in ("geo:asWKT", "gf:status"):
        assert len(merged.column(name)) > 3
        assert [merged.values(iri, name) for iri in merged.column(name)] == [
            [text] for text in merged.column(name).values()
        ]
    assert_same_tables(from_graph(merged, plan="acme"), other)
    with pytest.warns(FormatWarning, match="2 track plans"):
        assert_same_tables(from_graph(merged), plan)
    with pytest.raises(FormatError, match="no one track plan"):
        from_graph(merged, plan="nobody")


def test_the_study_alone_is_enough_for_obstacles(tmp_path):
    # As the study prints a node, without a word of geofield's vocabulary but the radius.
    path = tmp_path / "sample.rdf"
    path.write_text(
        """<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"
 xmlns:o="http://www.DLC.org/Obstacle#" xmlns:w="http://www.w3.org/2003/01/geo/wgs84_pos#"
 xmlns:gf="https://w3id.org/geofield#" xmlns:t="http://www.DLC.org/trajectory#"
 xmlns:po="http://purl.obolibrary.org/obo/PO_0000003/hasNarrowSynonym#"
 xmlns:gml="http://www.opengis.net/gml/">
<po:tree rdf:about="http://www.DLC.org/Obstacle#1"><o:no>1</o:no><w:lat>35.075575</w:lat>
<w:long>33.530917</w:long><gf:radiusInMetres>1.03</gf:radiusInMetres></po:tree>
<gml:point rdf:about="http://www.DLC.org/Trajectory#1"><t:no>1</t:no><t:track>1</t:track>
<gml:lat>35.07558507</gml:lat><gml:long>33.53089255</gml:long></gml:point>
</rdf:RDF>"""
    )
    got = read(path)
    obstacle = got.table("obstacles").iloc[0]
    assert obstacle["obstacle_no"] == 1
    assert obstacle["geometry"].area == pytest.approx(np.pi * 1.03**2, rel=0.01)
    point = got.table("track_points").iloc[0]
    assert (point["point_no"], point["track_no"]) == (1, 1)
    assert point["lat"] == 35.07558507


def test_two_rows_of_one_number_are_refused(plan, tmp_path):
    obstacles = plan.tables["obstacles"].copy()
    obstacles.loc[1, "obstacle_no"] = 1
    twice = type(plan)({**plan.tables, "obstacles": obstacles}, plan.crs, plan.name)
    with pytest.raises(FormatError, match="two rows with obstacle_no 1"):
        write.write_turtle(twice, tmp_path, options={})


def test_an_infinite_number_is_refused(plan, tmp_path):
    obstacles = plan.tables["obstacles"].copy()
    obstacles.loc[1, "radius_m"] = np.inf
    endless = type(plan)({**plan.tables, "obstacles": obstacles}, plan.crs, plan.name)
    with pytest.raises(FormatError, match="radius_m is infinite"):
        write.write_turtle(endless, tmp_path, options={})
