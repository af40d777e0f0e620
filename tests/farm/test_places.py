"""Places from whatever file a person has, and what is refused."""

from __future__ import annotations

import struct
import warnings
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pyogrio
import pytest
import shapely
import shapely.affinity

import geofield as gf
from geofield.errors import CRSError, FormatError
from geofield.farm import read_places
from geofield_command import run_geofield

POINTS = pd.DataFrame(
    {
        "id": ["007", "8", "9"],
        "name": ["Zum See", "b", None],
        "lat": [50.001, 50.0, 50.002],
        "lon": [10.0, 10.001, 10.002],
        "spacing_m": [3.0, None, 12.0],
        "farmer": ["Öz", "May;er", "x"],
        "area_ha": [1.0, 2.0, None],
    }
)


def as_frame(table: pd.DataFrame) -> gpd.GeoDataFrame:
    shapes = gpd.points_from_xy(table["lon"], table["lat"])
    return gpd.GeoDataFrame(table.drop(columns=["lat", "lon"]), geometry=shapes, crs=4326)


def written(kind: str, folder: Path) -> Path:
    path = folder / f"places.{kind}"
    if kind == "csv":
        POINTS.to_csv(path, index=False)
    elif kind == "german.csv":
        POINTS.to_csv(path, index=False, sep=";", decimal=",", encoding="utf-8-sig")
    elif kind == "excel.csv":
        rows = POINTS.to_csv(index=False, sep=";", decimal=",", lineterminator="\r\n")
        path.write_bytes(f"sep=;\r\n{rows}".encode())
    elif kind == "receiver.csv":
        # As receivers show them: minutes with decimals and a letter.
        shown = {
            name: [f"{letter} {int(x)}° {x % 1 * 60:.7f}" for x in POINTS[name]]
            for name, letter in (("lat", "N"), ("lon", "E"))
        }
        POINTS.assign(**shown).to_csv(path, index=False)
    elif kind == "german.txt.csv":
        POINTS.to_csv(path, index=False, sep="\t", decimal=",", encoding="utf-8-sig")
    elif kind == "plain.parquet":
        POINTS.to_parquet(path)
    elif kind == "parquet":
        as_frame(POINTS).to_parquet(path, write_covering_bbox=True)
    elif kind == "wkt.csv":
        table = POINTS.assign(wkt=[f"POINT ({x} {y})" for x, y in zip(POINTS["lon"], POINTS["lat"],
                                                                       strict=True)])  # fmt: skip
        table.drop(columns=["lat", "lon"]).to_csv(path, index=False)
    else:
        as_frame(POINTS).to_crs(32632).to_file(path)
    return path


@pytest.mark.parametrize(
    "kind",
    [
        "csv",
        "german.csv",
        "excel.csv",
        "receiver.csv",
        "german.txt.csv",
        "wkt.csv",
        "plain.parquet",
        "parquet",
        "gpkg",
        "shp",
        "geojson",
        "fgb",
    ],
)
def test_every_kind_of_file_gives_the_same_places(kind: str, tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        path = written(kind, tmp_path)
    places = sorted(read_places(path), key=lambda place: place.row)
    if kind == "fgb":  # a packed tree has an order of its own
        places.sort(key=lambda place: place.field_id)
    assert [place.field_id for place in places] == ["007", "8", "9"]
    assert [place.name for place in places] == ["Zum See", "b", "9"]
    assert [place.lat for place in places] == pytest.approx(list(POINTS["lat"]), abs=1e-8)
    assert [place.lon for place in places] == pytest.approx(list(POINTS["lon"]), abs=1e-8)
    assert [dict(place.settings) for place in places] == [
        {"spacing_m": 3.0}, {}, {"spacing_m": 12.0}
    ]  # fmt: skip
    assert dict(places[0].own) == {"farmer": "Öz", "place_area_ha": 1.0}
    assert dict(places[2].own) == {"farmer": "x"}


def test_texts_that_are_called_like_missing_numbers(tmp_path: Path) -> None:
    """NA, nan, null and None as names and notes were read as missing; of numbers NA is."""
    rows = (
        "name,lat,lon,note,spacing_m\nNA,50.1,15.1,nan,3\nnull,50.2,15.2,wet,NA\nNaN,50.3,15.3,,\n"
    )
    (tmp_path / "places.csv").write_text(rows)
    places = list(read_places(tmp_path / "places.csv"))
    assert [place.name for place in places] == ["NA", "null", "NaN"]
    assert [dict(place.own).get("note") for place in places] == ["nan", "wet", None]
    assert [dict(place.settings) for place in places] == [{"spacing_m": 3.0}, {}, {}]


def test_ids_in_columns_of_numbers(tmp_path: Path) -> None:
    """20 digits, as cadastres have them and Shapefiles hold as numbers, ended in a traceback."""
    for given, ids in (
        ([1e19, 2e19, 7.0], ["10000000000000000000", "20000000000000000000", "7"]),
        ([1.5, np.inf, 3.0], ["1.5", "inf", "3"]),
    ):
        as_frame(POINTS.assign(id=given)).to_file(tmp_path / "ids.gpkg")
        assert read_places(tmp_path / "ids.gpkg").ids.to_pylist() == ids


def test_columns_of_lists_objects_and_time_spans_are_text(tmp_path: Path) -> None:
    """A list beside a parcel, as fiboa's categories are, ended a whole farm in a traceback."""
    frame = as_frame(POINTS[["id"]].join(POINTS[["lat", "lon"]]))
    frame = frame.set_geometry(frame.to_crs(32632).buffer(40).to_crs(4326))
    frame["crops"] = [["rye", "öats"], [], None]
    frame["by"] = [{"name": "May"}, None, {"name": None}]
    frame["took"] = pd.to_timedelta([5, None, 90], unit="s")
    frame.to_parquet(tmp_path / "lists.parquet")
    for places in (tmp_path / "lists.parquet", frame):
        farm = gf.Farm(gf.plan_fields(places, spacing_m=10))
        fields = farm.fields.set_index("field_id")
        assert fields.loc["007", "crops"] == '["rye", "öats"]'
        assert fields.loc["007", "by"] == '{"name": "May"}'
        assert fields.loc["9", "took"] == "0:01:30"
        assert fields.loc[["9", "8"], ["crops", "by"]].isna().to_numpy().tolist() == [
            [True, False], [False, True]
        ]  # fmt: skip


def test_texts_that_are_views_are_read(tmp_path: Path) -> None:
    """As Polars writes them: they ended in a traceback."""
    table = pa.Table.from_pandas(POINTS, preserve_index=False)
    views = [
        one if pa.types.is_floating(one.type) else one.with_type(pa.string_view())
        for one in table.schema
    ]
    pq.write_table(table.cast(pa.schema(views)), tmp_path / "views.parquet")
    places = read_places(tmp_path / "views.parquet")
    assert places.ids.to_pylist() == ["007", "8", "9"]
    assert dict(next(iter(places)).own)["farmer"] == "Öz"


def test_parcels_with_arcs_are_read(tmp_path: Path) -> None:
    """As cadastres have them: they ended in a traceback."""
    file, (x, y) = tmp_path / "arcs.gpkg", (500_100.0, 5_500_100.0)
    ring = [(x - 100, y), (x, y + 100), (x + 100, y), (x, y - 100), (x - 100, y)]
    arcs = struct.pack("<BII", 1, 8, len(ring)) + np.array(ring).tobytes()
    circle = struct.pack("<BII", 1, 10, 1) + arcs
    square = shapely.to_wkb(shapely.box(x + 200, y, x + 300, y + 100))
    how = {"geometry_type": "Unknown", "crs": "EPSG:32633", "driver": "GPKG"}
    pyogrio.raw.write(
        file, np.array([circle, square], object), [np.array(["a", "b"])], ["id"], **how
    )
    whole = gf.Farm(gf.plan_fields(file, spacing_m=20))
    areas_ha = whole.fields.set_index("field_id")["area_ha"]
    assert areas_ha["a"] == pytest.approx(np.pi / 0.9996**2, rel=1e-3)
    assert areas_ha["b"] == pytest.approx(1.0 / 0.9996**2, rel=1e-6)


def test_neighbours_lie_beside_each_other(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    table = pd.DataFrame({"lat": rng.uniform(50, 51, 900), "lon": rng.uniform(10, 11, 900)})
    table.to_csv(tmp_path / "many.csv", index=False)
    places = read_places(tmp_path / "many.csv")
    order = places.order()
    assert sorted(order) == list(range(900))
    steps = np.hypot(np.diff(places.lat[order]), np.diff(places.lon[order]))
    assert np.median(steps) < 2.0 / np.sqrt(900)
    assert len(set(places.ids.to_pylist())) == 900


def parcels(tmp_path: Path) -> Path:
    shapes = [
        shapely.box(500_000, 5_500_000, 500_100, 5_500_090),
        shapely.MultiPolygon(
            [shapely.box(500_200, 5_500_000, 500_300, 5_500_080),
             shapely.box(500_400, 5_500_000, 500_450, 5_500_080)]
        ),
        shapely.LineString([(500_000, 5_500_000), (500_100, 5_500_000)]),
    ]  # fmt: skip
    frame = gpd.GeoDataFrame(
        {"id": [1, 2, 3], "crop": ["rye", "oats", ""]}, geometry=shapes, crs=25832
    )
    frame.to_file(tmp_path / "parcels.gpkg")
    return tmp_path / "parcels.gpkg"


def test_parcels_keep_their_columns_and_their_zone(tmp_path: Path) -> None:
    places = read_places(parcels(tmp_path))
    assert places.parcels
    assert [place.field_id for place in places] == ["1", "2.1", "2.2"]
    assert "1 parcel has several parts" in places.notes[1]
    plans = {plan.field.field_id: plan for plan in gf.plan_fields(places, spacing_m=4)}
    assert set(plans) == {"1", "2.1", "2.2"}
    one = plans["1"]
    assert one.field.crs.to_epsg() == 25832
    assert one.field.polygon.equals(shapely.box(500_000, 5_500_000, 500_100, 5_500_090))
    assert one.field.own == (("crop", "rye"),)
    assert one.settings.tracks.spacing_m == 4.0


def test_a_table_is_as_good_as_its_file(tmp_path: Path) -> None:
    path = parcels(tmp_path)
    frame = gpd.read_file(path).rename_geometry("shape")
    from_file = {plan.field.field_id: plan for plan in gf.plan_fields(path, spacing_m=9)}
    for table in (frame, frame.to_crs(4326)):
        from_table = {plan.field.field_id: plan for plan in gf.plan_fields(table, spacing_m=9)}
        assert from_table.keys() == from_file.keys()
        for name, plan in from_table.items():
            same = from_file[name]
            assert plan.field.own == same.field.own
            assert plan.field.area_ha == pytest.approx(same.field.area_ha, rel=1e-6)
            assert len(plan.tracks.segments) == len(same.tracks.segments)
    for bad, message in (
        (frame.set_crs(None, allow_override=True), "set_crs"),
        (frame.iloc[:0], "holds no places"),
        (pd.DataFrame({"a": [1]}), "no columns lat and lon"),
        (pd.DataFrame({"lat": [35.0, "x"], "lon": [33.0, 33.0]}), "several kinds"),
        (pd.concat([POINTS, POINTS[["name"]]], axis=1), "two of one name"),
    ):
        with pytest.raises(gf.GeofieldError, match=message):
            list(gf.plan_fields(bad))
    with pytest.raises(gf.GeofieldError, match=r"there_is_none\.gpkg cannot be read"):
        next(gf.plan_fields(frame, obstacles="there_is_none.gpkg"))


def test_a_table_of_shapes_alone_and_names_in_the_index() -> None:
    """The one was told to be empty, and the names of the other were lost."""
    alone = as_frame(POINTS)[["geometry"]]
    assert len(read_places(alone)) == 3
    named = read_places(as_frame(POINTS).drop(columns="id").set_index("name"))
    assert [place.name for place in named][:2] == ["Zum See", "b"]
    machine = POINTS.drop(columns="spacing_m").assign(machine=pd.Series([{"width_m": 6.0}] * 3))
    assert len(read_places(machine)) == 3
    with pytest.raises(FormatError, match="row 1: column 'machine'"):
        read_places(machine.assign(machine=pd.Series([{"wide": 6.0}] * 3)))


def test_a_column_named_like_a_setting_holds_for_its_field(tmp_path: Path) -> None:
    frame = gpd.read_file(parcels(tmp_path)).iloc[:2].explode(ignore_index=True)
    frame["id"] = ["a", "b", "c"]
    frame["heading_deg"] = [30.0, None, 120.0]
    frame["spacing_m"] = [None, 6.0, 9.0]
    frame.to_file(tmp_path / "said.geojson", driver="GeoJSON")
    plans = {p.field.field_id: p for p in gf.plan_fields(tmp_path / "said.geojson", spacing_m=5)}
    assert plans["a"].tracks.heading_deg == pytest.approx(30.0, abs=1e-6)
    assert plans["c"].tracks.heading_deg == pytest.approx(120.0, abs=1e-6)
    assert plans["b"].settings.tracks.direction == "dominant"
    assert [plans[one].tracks.spacing_m for one in "abc"] == [5.0, 6.0, 9.0]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"id": ["x", "x", "y"]}, "'x' in rows 1, 2"),
        ({"lat": [50.0, 95.0, 50.0]}, "row 2"),
        ({"lat": [110.0, 120.0, 130.0], "lon": [50.0, 50.0, 50.0]}, "swapped"),
        ({"lat": [50.0, 5_500_000.0, 50.0], "lon": [10.0, 500_000.0, 10.0]}, "another CRS"),
        ({"lat": ["50", "fifty", "51"]}, "column 'lat', row 2: 'fifty' is no number"),
        ({"lat": ["50 3.5 N", "51", "fifty"]}, "column 'lat', row 3: 'fifty' is no number"),
        ({"lon": ["2026-04-01", "2026-04-02", ""]}, "column 'lon', row 1, 2: '2026-04-01' is"),
        ({"lat": [None, None, None]}, "no row with a position"),
        ({"spacing_m": ["3", "wide", "4"]}, "row 2: column 'spacing_m'"),
        ({"spacing_m": [3, -2, 4]}, "row 2: column 'spacing_m'"),
        ({"route": ["none", "shortest", "zigzag"]}, "row 3: column 'route'"),
    ],
)
def test_bad_rows_are_told_by_their_number(
    change: dict[str, Any], words: str, tmp_path: Path
) -> None:
    POINTS.assign(**change).to_csv(tmp_path / "bad.csv", index=False)
    with pytest.raises(FormatError, match=words):
        read_places(tmp_path / "bad.csv")


def test_rows_outside_their_crs_are_told_by_their_number(tmp_path: Path) -> None:
    sound = shapely.box(500000, 5500000, 500300, 5500200)
    two = shapely.MultiPolygon([sound, shapely.affinity.translate(sound, 1000.0)])
    outside = shapely.affinity.translate(sound, 32e6)
    shapes = [None, two, outside, sound, outside]
    gpd.GeoDataFrame(geometry=shapes, crs=25832).to_file(tmp_path / "zones.gpkg")
    with pytest.raises(CRSError, match=r"zones\.gpkg: coordinates in row 3, 5 are outside"):
        read_places(tmp_path / "zones.gpkg")


def test_a_column_that_is_not_there(tmp_path: Path) -> None:
    POINTS.to_csv(tmp_path / "p.csv", index=False)
    with pytest.raises(FormatError, match=r"no column 'farmr'\. Did you mean 'farmer'"):
        read_places(tmp_path / "p.csv", id_column="farmr")
    POINTS.drop(columns="lat").to_csv(tmp_path / "q.csv", index=False)
    with pytest.raises(FormatError, match="no columns lat and lon"):
        read_places(tmp_path / "q.csv")


@pytest.mark.parametrize("text", ["", "lat,lon\n", "lat,lon"])
def test_an_empty_file(text: str, tmp_path: Path) -> None:
    (tmp_path / "none.csv").write_text(text)
    with pytest.raises(FormatError, match="empty"):
        read_places(tmp_path / "none.csv")


def test_a_file_without_crs_must_be_told_it(tmp_path: Path) -> None:
    frame = as_frame(POINTS).set_crs(None, allow_override=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        frame.to_file(tmp_path / "bare.shp")
    with pytest.raises(CRSError, match="does not say its CRS"):
        read_places(tmp_path / "bare.shp")
    assert len(read_places(tmp_path / "bare.shp", crs="EPSG:4326")) == 3


def test_a_place_that_fails_does_not_stop_the_others(tmp_path: Path) -> None:
    frame = gpd.read_file(parcels(tmp_path)).iloc[:2].explode(ignore_index=True)
    frame["id"] = ["a", "b", "c"]
    frame["spacing_m"] = [5.0, 500.0, 5.0]
    frame.to_file(tmp_path / "wide.gpkg")
    with pytest.warns(gf.GeofieldWarning, match="b .*500 m is larger than the field"):
        plans = list(gf.plan_fields(tmp_path / "wide.gpkg"))
    assert {plan.field.field_id for plan in plans} == {"a", "c"}


def test_a_parcel_across_the_180th_meridian_is_one_place(tmp_path: Path) -> None:
    """Cut there as GeoJSON asks for, jumping there, or with longitudes from 0 to 360."""
    south, north = -17.0, -16.998
    cut = shapely.MultiPolygon(
        [shapely.box(179.999, south, 180, north), shapely.box(-180, south, -179.999, north)]
    )
    sides = (179.999, -179.999, -179.999, 179.999)
    jumping = shapely.Polygon(list(zip(sides, (south, south, north, north), strict=True)))
    turned = shapely.box(179.999, south, 180.001, north)
    gpd.GeoDataFrame(
        {"id": ["cut", "jumping", "turned"]}, geometry=[cut, jumping, turned], crs=4326
    ).to_file(tmp_path / "fiji.gpkg")
    places = read_places(tmp_path / "fiji.gpkg")
    assert places.ids.to_pylist() == ["cut", "jumping", "turned"]
    assert np.abs(places.lon) == pytest.approx(180.0)
    for plan in gf.plan_fields(places, spacing_m=10):
        assert plan.field.crs.to_epsg() == 32701
        assert plan.field.area_ha == pytest.approx(4.714, abs=1e-3)


def test_rows_without_shape_and_ids_of_parts(tmp_path: Path) -> None:
    one = shapely.box(15, 47, 15.001, 47.001)
    two = shapely.MultiPolygon([one, shapely.affinity.translate(one, 0.01)])
    gpd.GeoDataFrame(
        {"id": ["a", "a.1", "b", "c"]}, geometry=[two, one, None, shapely.Polygon()], crs=4326
    ).to_file(tmp_path / "odd.gpkg")
    places = read_places(tmp_path / "odd.gpkg")
    assert places.ids.to_pylist() == ["a.1-2", "a.2", "a.1", "b", "c"]
    # They fail, and say so.
    assert np.isfinite(places.lat).tolist() == [True, True, True, False, False]
    assert not any("left out" in note for note in places.notes)


def test_text_shapes_are_in_the_crs_that_is_named(tmp_path: Path) -> None:
    shape = shapely.box(500_000, 5_300_000, 500_100, 5_300_100)
    (tmp_path / "utm.csv").write_text(f'id,wkt\n1,"{shape.wkt}"\n')
    places = read_places(tmp_path / "utm.csv", crs="EPSG:32633")
    assert places.lat[0] == pytest.approx(47.8538, abs=1e-3)
    with pytest.raises(FormatError, match="no position on earth"):
        read_places(tmp_path / "utm.csv")


def test_one_row_that_is_wrong_does_not_blame_the_columns(tmp_path: Path) -> None:
    # "Exchange the columns' names" would have moved the rows that are right to another country.
    (tmp_path / "some.csv").write_text("id,lat,lon\na,35.1,33.5\nb,91,33.5\nc,,\n")
    done = run_geofield("batch", "some.csv", "--out", "farm", folder=tmp_path)
    assert done.returncode == 1
    assert "no position on earth in row 2 (lat 91, lon 33.5)" in done.stderr
    assert "Correct it there: latitude and longitude may be exchanged." in done.stderr
    (tmp_path / "all.csv").write_text("id,lat,lon\na,-117.3,34.0\nb,-117.4,34.1\nc,,\n")
    done = run_geofield("batch", "all.csv", "--out", "farm", folder=tmp_path)
    assert done.returncode == 1
    assert "look swapped: exchange the columns' names" in done.stderr


def test_layers_and_rows_that_are_none(tmp_path: Path) -> None:
    kml = '<kml xmlns="http://www.opengis.net/kml/2.2"><Document></Document></kml>'
    (tmp_path / "none.kml").write_text(kml)
    with pytest.raises(FormatError, match="holds no layers"):
        read_places(tmp_path / "none.kml")
    as_frame(POINTS).to_file(tmp_path / "a.gpkg", layer="fields")
    with pytest.raises(FormatError, match=r"no layer 'felds'.*fields"):
        read_places(tmp_path / "a.gpkg", layer="felds")
    for kind in ("csv", "parquet"):  # which have none: the layer changed nothing, without a word
        path = tmp_path / f"b.{kind}"
        (POINTS.to_csv if kind == "csv" else POINTS.to_parquet)(path, index=False)
        with pytest.raises(FormatError, match="one table and has no layer 'felds'"):
            read_places(path, layer="felds")
        assert len(read_places(path, layer="b")) == len(POINTS)
    (tmp_path / "a.csv").write_text("id,lat,lon\n1,47.5,15.3,a,b\n")
    with pytest.raises(FormatError) as told:
        read_places(tmp_path / "a.csv")
    assert "as many values as the first" in str(told.value.hint)


def test_columns_of_a_user_are_none_of_ours_and_each_once(tmp_path: Path) -> None:
    shape = shapely.box(15, 47, 15.001, 47.001)
    heads = ["id", "area_ha", "place_area_ha", "FID", "geom"]
    (tmp_path / "own.csv").write_text(f'{",".join(heads)},wkt\n1,2,3,4,5,"{shape.wkt}"\n')
    places = read_places(tmp_path / "own.csv")
    told = ["place_area_ha_2", "place_area_ha", "place_FID", "geom"]
    assert places.own.column_names == told
    assert places.own.to_pylist() == [dict(zip(told, [2, 3, "4", 5], strict=True))]
    assert places.parcels
