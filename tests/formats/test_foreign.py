"""Files that other programs made: what is what, in which CRS, and every doubt said aloud."""

from __future__ import annotations

import json
import warnings

import geopandas as gpd
import pytest
import shapely
from pyproj import CRS

from geofield.cli.parcels import parcel_and_point
from geofield.errors import CRSError, FormatError, FormatWarning
from geofield.formats import FORMATS, read_dataset, write_dataset
from geofield.formats.foreign_tables import obstacle_table
from geofield.formats.importing import merged
from geofield_command import run_geofield

UTM = "EPSG:32633"
BOX = shapely.box(500_000, 5_500_000, 500_200, 5_500_100)


def write(path, shapes, crs=UTM, driver=None, **columns):
    frame = gpd.GeoDataFrame(columns, geometry=list(shapes), crs=crs)
    frame.to_file(path, driver=driver)
    return path


def test_a_plain_boundary_in_any_crs(tmp_path):
    for number, crs in enumerate([UTM, "EPSG:4326", "EPSG:3857", "EPSG:2056"]):
        shape = gpd.GeoSeries([BOX], crs=UTM).to_crs(crs)
        path = write(tmp_path / f"acker{number}.geojson", shape, crs, name=["Großer Acker"])
        if crs not in (UTM,):
            path = write(tmp_path / f"acker{number}.gpkg", shape, crs, name=["Großer Acker"])
        dataset = read_dataset(path)
        field = dataset.table("field")
        assert dataset.crs == CRS(UTM)
        assert dataset.name == field["name"].iloc[0] == "Großer Acker"
        assert field["area_ha"].iloc[0] == pytest.approx(2.0 / 0.9996**2, rel=1e-6)
        assert field["field_id"].iloc[0]


def test_numbers_as_names_have_no_point(tmp_path):
    """As Shapefiles and tables with empty cells have them: the field was called 12.0."""
    columns = {"NAME": [12.0], "ID": [17.0]}
    field = read_dataset(write(tmp_path / "field.shp", [BOX], **columns)).table("field")
    assert list(field[["name", "field_id"]].iloc[0]) == ["12", "17"]


@pytest.mark.parametrize("name", ["field.geoparquet", "field.pq"])
def test_geoparquet_under_its_other_names(tmp_path, name):
    """`tracks` read them, `import`, `info` and `validate` did not know them."""
    gpd.GeoDataFrame(geometry=[BOX], crs=UTM).to_parquet(tmp_path / name)
    assert read_dataset(tmp_path / name).table("field").geometry.iloc[0].equals(BOX)
    assert read_dataset(tmp_path).has("field")


def test_feet_become_metres(tmp_path):
    feet = "EPSG:2227"  # California zone 3, US survey feet
    shape = gpd.GeoSeries([shapely.box(-121.5, 37.5, -121.498, 37.501)], crs="EPSG:4326")
    dataset = read_dataset(write(tmp_path / "field.gpkg", shape.to_crs(feet), feet))
    assert dataset.crs == CRS("EPSG:32610")
    truth = shape.to_crs(dataset.crs).area.iloc[0]
    assert dataset.table("field").area.iloc[0] == pytest.approx(truth, rel=1e-4)


def test_without_prj_degrees_are_told_and_metres_refused(tmp_path):
    degrees = write(tmp_path / "degrees.shp", gpd.GeoSeries([BOX], crs=UTM).to_crs(4326), 4326)
    degrees.with_suffix(".prj").unlink()
    with pytest.warns(FormatWarning, match=r"\.prj.*look like degrees"):
        assert read_dataset(degrees).crs == CRS(UTM)
    metres = write(tmp_path / "metres.shp", [BOX])
    metres.with_suffix(".prj").unlink()
    with pytest.raises(FormatError, match="metres or feet of any projection"):
        read_dataset(metres)
    assert read_dataset(metres, crs=UTM).table("field").area.iloc[0] == pytest.approx(20_000)


def test_geojson_of_metres_is_in_the_crs_that_is_named(tmp_path):
    """Many farm programs write it: it was "in WGS 84 by its own word", whatever was named."""
    row = {"type": "Feature", "properties": {}, "geometry": shapely.geometry.mapping(BOX)}
    path = tmp_path / "metres.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [row]}))
    for words in (
        ("import", path, "--crs", UTM, "-o", tmp_path / "a.gpkg"),
        ("tracks", path, "--crs", UTM, "--spacing", 5, "-o", tmp_path / "b.gpkg"),
    ):
        run_geofield(*words, check=True)
        field = gpd.read_file(words[-1], layer="field")
        assert field.geometry[0].equals(BOX)
        assert field.crs == CRS(UTM)
    with pytest.raises(FormatError, match="does not say its CRS"):
        read_dataset(path)
    with pytest.raises(CRSError, match=r"no coordinate reference system(.|\n)*ogr2ogr -a_srs"):
        parcel_and_point(path, None, None, None, None)
    # What the file says stands.
    said = {"crs": {"type": "name", "properties": {"name": "EPSG:4326"}}}
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [row], **said}))
    with pytest.raises(FormatError, match="by its own word"):
        read_dataset(path, crs=UTM)


def test_closed_lines_without_an_outline_are_told(tmp_path):
    """`--boundary` took such a line for the field, import for a track, without a word."""
    path = write(tmp_path / "ring.shp", [shapely.LineString(BOX.exterior.coords)])
    dataset = read_dataset(path)
    assert dataset.has("tracks")
    assert dataset.notes[-1] == (
        "no field in 1 line that ends where it begins: `geofield field --boundary` makes one of "
        "such a line"
    )
    assert parcel_and_point(path, None, None, None, None)[0].polygon.equals(BOX)
    inner = write(tmp_path / "both.gpkg", [BOX, shapely.LineString(BOX.buffer(-5).exterior.coords)])
    assert not any("no field" in note for note in read_dataset(inner).notes)


def test_a_wrong_crs_is_not_believed(tmp_path):
    with pytest.raises(FormatError, match="by its own word"):
        read_dataset(write(tmp_path / "a.shp", [BOX]), crs="EPSG:25833")
    path = write(tmp_path / "a.gpkg", [BOX])
    with pytest.raises(FormatError, match="say their CRS themselves"):
        read_dataset(path, crs=UTM)


def test_swapped_latitudes_are_noticed(tmp_path):
    shape = shapely.box(35.0, 120.0, 35.001, 120.001)
    with pytest.raises(FormatError, match="may be swapped"):
        read_dataset(write(tmp_path / "a.geojson", [shape], 4326))


def test_inner_polygons_are_obstacles_and_points_get_a_radius(tmp_path):
    pond = shapely.box(500_050, 5_500_020, 500_070, 5_500_040)
    path = write(tmp_path / "farm.gpkg", [BOX, pond, shapely.Point(500_100, 5_500_050)])
    with pytest.warns(FormatWarning, match="1 obstacle point has no radius; it is a circle"):
        obstacles = read_dataset(path).table("obstacles")
    assert list(obstacles["status"]) == ["added", "added"]
    by_kind = obstacles.set_index("kind")
    assert by_kind.geometry["other"].area == pytest.approx(400)
    assert by_kind["radius_m"]["tree"] == 2.0


def test_a_kind_that_is_not_known_is_told(tmp_path):
    shapes = [shapely.Point(x, 5_500_050).buffer(3) for x in (500_020, 500_050, 500_080, 500_110)]
    kinds = ["hut", "Tree", None, "hut"]
    path = write(tmp_path / "things.gpkg", shapes, kind=kinds, status=["gone", "added", "", None])
    with pytest.warns(FormatWarning) as caught:
        obstacles = obstacle_table(gpd.read_file(path), CRS(UTM), path)
    assert list(obstacles["kind"]) == ["other", "tree", "other", "other"]
    kind, status = (str(each.message) for each in caught)
    assert "none of tree, other: 'hut' (now other). Correct" in kind
    assert "'gone' (now added)" in status


def test_points_with_a_radius_keep_it(tmp_path):
    path = write(
        tmp_path / "trees.geojson",
        gpd.GeoSeries([shapely.Point(500_010, 5_500_010)], crs=UTM).to_crs(4326),
        4326,
        Radius=[3.5],
        status=["Confirmed"],
    )
    (row,) = read_dataset(path).table("obstacles").to_dict("records")
    assert (row["radius_m"], row["status"]) == (3.5, "confirmed")
    assert row["geometry"].area == pytest.approx(3.5**2 * 3.14159, rel=0.01)


def test_lines_become_tracks(tmp_path):
    lines = [
        shapely.LineString([(500_000, 5_500_000 + y), (500_100, 5_500_000 + y)]) for y in (0, 4)
    ]
    dataset = read_dataset(write(tmp_path / "ab.gpkg", lines, Name=["AB 7", "AB 9"]))
    assert list(dataset.table("tracks")["track_no"]) == [7, 9]
    assert dataset.table("tracks")["length_m"].iloc[0] == pytest.approx(100 / 0.9996)
    assert dataset.table("tracks")["heading_deg"].iloc[0] == pytest.approx(90, abs=0.01)


def test_several_fields_are_refused_by_name(tmp_path):
    other = shapely.box(600_000, 5_500_000, 600_100, 5_500_100)
    path = write(tmp_path / "farm.gpkg", [BOX, other], name=["East", "West"])
    with pytest.raises(FormatError, match=r"2 outlines \(East, West\);"):
        read_dataset(path)


def test_self_crossing_outlines_are_told(tmp_path):
    bow = shapely.Polygon([(500_000, 5_500_000), (500_100, 5_500_050), (500_100, 5_500_000),
                           (500_040, 5_500_060), (500_000, 5_500_060)])  # fmt: skip
    path = write(tmp_path / "farm.gpkg", [bow])
    with pytest.warns(FormatWarning, match="1 polygon crosses itself"), pytest.raises(FormatError):
        read_dataset(path)


def test_outlines_that_cross_themselves_and_have_a_spur_keep_their_areas(tmp_path):
    bow = shapely.Polygon([(20, 20), (30, 30), (30, 20), (20, 30), (10, 30), (20, 30)])
    bow = shapely.affinity.translate(bow, 500_000, 5_500_000)
    path = write(tmp_path / "farm.gpkg", [BOX, bow])
    with pytest.warns(FormatWarning, match="1 polygon crosses itself"):
        assert read_dataset(path).table("obstacles").area.tolist() == [25.0, 25.0]
    with pytest.warns(FormatWarning, match="into parts"), pytest.raises(FormatError, match="2 out"):
        read_dataset(write(tmp_path / "bow.gpkg", [bow]))


def test_google_earth_kml(tmp_path):
    (tmp_path / "acker.kml").write_text(
        """<?xml version="1.0" encoding="UTF-8"?>
        <kml xmlns="http://www.opengis.net/kml/2.2"><Document><name>Mine</name>
        <Placemark><name>Äußerer Schlag</name><Polygon><outerBoundaryIs><LinearRing><coordinates>
        15.0,50.0,0 15.002,50.0,0 15.002,50.001,0 15.0,50.001,0 15.0,50.0,0
        </coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>
        </Document></kml>""",
        encoding="utf-8",
    )
    dataset = read_dataset(tmp_path / "acker.kml")
    assert dataset.name == "Äußerer Schlag"
    assert dataset.table("field").area.iloc[0] == pytest.approx(143.4 * 111.2, rel=0.01)


def test_boundary_and_trees_from_two_files(tmp_path):
    boundary = read_dataset(write(tmp_path / "boundary.gpkg", [BOX], name=["East"]))
    tree = shapely.Point(500_020, 5_500_020).buffer(3)
    trees = read_dataset(
        write(tmp_path / "trees.gpkg", [tree, shapely.affinity.translate(tree, 9)])
    )
    both = merged([boundary, trees], name="Ost")
    assert both.name == "Ost"
    assert len(both.table("field")) == 1
    assert list(both.table("obstacles")["obstacle_no"]) == [1, 2]
    with pytest.raises(FormatError, match="Two of the files"):
        merged([boundary, boundary])


@pytest.mark.parametrize("content", [b"", b"{", b"\x00" * 200, "ungültig".encode("latin-1")])
@pytest.mark.parametrize(
    "name", ["a.geojson", "a.gpkg", "a.kml", "a.parquet", "a.fgb", "TASKDATA.XML", "Boundary.txt"]
)
def test_damaged_files_are_named(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(FormatError) as caught:
        read_dataset(tmp_path / name)
    assert str(tmp_path) in str(caught.value)


def test_empty_layers(tmp_path):
    path = write(tmp_path / "a.geojson", [], 4326)
    with pytest.raises(FormatError, match="holds no geometries"):
        read_dataset(path)


@pytest.mark.real
def test_real_parcels_there_and_back(shared, tmp_path):
    parcels = gpd.read_file(shared / "data" / "fields" / "fields.gpkg")
    names = ["gpkg", "geojson", "shapefile", "geoparquet", "flatgeobuf", "kml"]
    names += ["isoxml", "isoxml-v3", "agopengps"]
    for number in range(0, len(parcels), 15):
        parcel = parcels.iloc[[number]]
        parcel[["geometry"]].explode().iloc[[0]].to_file(tmp_path / f"p{number}.gpkg")
        first = read_dataset(tmp_path / f"p{number}.gpkg")
        shape = first.table("field").geometry.iloc[0]
        for name in names:
            out = tmp_path / f"{number}-{name}"
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", FormatWarning)
                written = write_dataset(first, out, [name])
                read = {"gpkg": "field.gpkg", "kml": "field.kml", "agopengps": "agopengps/Fields"}
                back = read_dataset(out / read.get(name, name))
            assert written
            theirs = back.table("field").geometry.iloc[0]
            moved = shapely.hausdorff_distance(shape, theirs)
            assert moved <= max(FORMATS[name].precision_m, 1e-9) * 1.01, (name, number)


@pytest.mark.parametrize(("names", "numbers"), [
    (["2024 North", "2024 South"], [(1, 1), (2, 1)]),
    (["AB 1", "Curve 1"], [(1, 1), (2, 1)]),
    (["Swath 4", "Swath 9"], [(4, 1), (9, 1)]),
    (["Track 7", "Track 7-2"], [(7, 1), (7, 2)]),
    (["Track 7-2", "Track 7-2"], [(7, 1), (7, 2)]),
    ([f"AB {10**30}", "AB 1"], [(1, 1), (2, 1)]),
])  # fmt: skip
def test_lines_are_one_track_only_where_their_names_say_so(tmp_path, names, numbers):
    lines = [shapely.LineString([(500_000, y), (500_200, y)]) for y in (5_500_004, 5_500_008)]
    segments = read_dataset(write(tmp_path / "lines.gpkg", lines, name=names)).table("segments")
    assert list(zip(segments["track_no"], segments["segment_no"], strict=True)) == numbers


@pytest.mark.parametrize("numbers", [[1e300, 2.0], [1.2, 1.7], [-3.0, 4.0]])
def test_track_numbers_that_nobody_counts_with(tmp_path, numbers):
    lines = [shapely.LineString([(500_000, y), (500_200, y)]) for y in (5_500_004, 5_500_008)]
    path = write(tmp_path / "lines.gpkg", lines, track=numbers)
    assert list(read_dataset(path).table("segments")["track_no"]) == [1, 2]


def test_a_line_without_length_is_no_track(tmp_path):
    here = (500_000, 5_500_004)
    lines = [shapely.LineString([here, here]), shapely.LineString([here, (500_200, 5_500_004)])]
    dataset = read_dataset(write(tmp_path / "lines.gpkg", lines))
    assert len(dataset.table("tracks")) == 1
    assert "lines: 1 line left out, having no length" in dataset.notes


@pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")
@pytest.mark.parametrize("columns", [
    {"certainty": ["high", "low"]},
    {"heading_deg": ["N", "N"]},
    {"imagery_date": ["May 2020", "later"]},
    {"confidence": ["high", "low"]},
    {"radius": [0.0, 2.0], "buffer": [0.0, -5.0]},
    {"radius": [0.0, float("inf")], "buffer": [0.0, float("inf")]},
    {"number": [1.0, 1e30]},
])  # fmt: skip
def test_columns_of_another_meaning_are_passed_over(tmp_path, columns):
    shapes = [BOX, shapely.Point(500_100, 5_500_050)]
    dataset = read_dataset(write(tmp_path / "field.gpkg", shapes, **columns))
    write_dataset(dataset, tmp_path / "out", ["gpkg"])
    back = read_dataset(tmp_path / "out" / "field.gpkg")
    assert back.table("field").geometry.iloc[0].equals(BOX)
    assert list(back.table("obstacles")["obstacle_no"]) == [1]
    radius_m = 2.0 / 0.9996
    assert back.table("obstacles").area.iloc[0] == pytest.approx(3.14 * radius_m**2, rel=0.01)


def test_collections_of_collections_are_taken_apart(tmp_path):
    ponds = shapely.multipolygons([shapely.box(*p, p[0] + 5, p[1] + 5) for p in
                                   [(500_010, 5_500_010), (500_050, 5_500_010)]])  # fmt: skip
    trees = shapely.multipoints([(500_100, 5_500_050), (500_120, 5_500_050)])
    both = shapely.geometrycollections([ponds, shapely.geometrycollections([trees])])
    with pytest.warns(FormatWarning, match="2 obstacle points have no radius"):
        dataset = read_dataset(write(tmp_path / "field.gpkg", [BOX, both]))
    assert len(dataset.table("obstacles")) == 4
