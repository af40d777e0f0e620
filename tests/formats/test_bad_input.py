"""What a format cannot hold is refused before anything is written, with the next step."""

from __future__ import annotations

import dataclasses
import json
import re
import sqlite3
from contextlib import closing

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pytest
import shapely
from formats_plan import make_dataset
from hypothesis import given
from hypothesis import strategies as st

from geofield import schema
from geofield.errors import FormatError, FormatWarning
from geofield.formats import FORMATS, read_dataset, shapefile_layer, write_dataset
from geofield.formats.names import safe_name
from geofield.formats.shapefile_profiles import PROFILES

pytestmark = pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")


def renamed(dataset, name):
    field = dataset.tables["field"].assign(name=name)
    return dataclasses.replace(dataset, name=name, tables={**dataset.tables, "field": field})


def test_shapefile_names_fit_and_do_not_collide():
    for layer in schema.LAYERS:
        names = [column.shapefile for column in layer.columns]
        assert all(0 < len(name) <= 10 and name.isascii() for name in names)
        assert len({name.lower() for name in names}) == len(names)


def test_profiles_fit_too(dataset):
    for profile in PROFILES.values():
        for layer in profile(dataset, "c", "f"):
            assert all(len(name) <= 10 for name in layer.columns)


def test_more_than_a_shapefile_holds_is_refused_before_writing(dataset, tmp_path, monkeypatch):
    monkeypatch.setattr(shapefile_layer, "FILE_BYTES", 1000)
    with pytest.raises(FormatError, match=r"GB; 2 GB fit.*GeoPackage or FlatGeobuf"):
        write_dataset(dataset, tmp_path / "out", ["shapefile"])
    assert not (tmp_path / "out").exists()


def test_size_estimate_is_not_below_the_file(dataset, tmp_path):
    written = write_dataset(dataset, tmp_path, ["shapefile"])
    largest = max(path.stat().st_size for path in written)
    for bytes_ in (largest - 1,):
        shapefile_bytes, shapefile_layer.FILE_BYTES = shapefile_layer.FILE_BYTES, bytes_
        try:
            with pytest.raises(FormatError, match="GB"):
                write_dataset(dataset, tmp_path / "again", ["shapefile"])
        finally:
            shapefile_layer.FILE_BYTES = shapefile_bytes


@pytest.mark.parametrize("name", ["kml", "gpx", "isoxml"])
def test_characters_that_xml_cannot_carry(dataset, tmp_path, name):
    with pytest.raises(FormatError, match=r"U\+0007.*Remove it from the name"):
        write_dataset(renamed(dataset, "bell\x07"), tmp_path, [name])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["isoxml", "agopengps", "shapefile", "gpkg"])
@pytest.mark.parametrize("field", ["../../etc/passwd", "CON", "a/b\\c:d", "田" * 300, " . "])
def test_no_name_leads_out_of_the_folder(dataset, tmp_path, name, field):
    if name == "shapefile" and len(field) > 84:
        with pytest.raises(FormatError, match="254 fit"):
            write_dataset(renamed(dataset, field), tmp_path / "out", [name])
        return
    for path in write_dataset(renamed(dataset, field), tmp_path / "out", [name]):
        assert path.resolve().is_relative_to((tmp_path / "out").resolve())
        assert len(path.name) < 100
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@given(st.text(max_size=60))
def test_safe_names(text):
    name = safe_name(text)
    assert 0 < len(name) <= 41
    assert name.isascii()
    assert not set(name) & set('/\\:*?"<>|. ')
    assert name.upper().rstrip("_") not in ("CON", "NUL") or name.endswith("_")


def test_empty_layers_are_written_with_their_columns(dataset, tmp_path):
    empty = {name: dataset.tables[name].iloc[:0] for name in dataset.tables if name != "field"}
    bare = dataclasses.replace(
        dataset, tables={"field": dataset.tables["field"], **empty}, points=None
    )
    names = [n for n in FORMATS if not FORMATS[n].writer.startswith("geofield.formats.rdf")]
    names.remove("scene")
    write_dataset(bare, tmp_path, names)
    info = pyogrio.read_info(tmp_path / "field.gpkg", layer="obstacles")
    assert list(info["fields"]) == schema.OBSTACLES.column_names
    assert info["geometry_type"] == "Polygon"
    back = read_dataset(tmp_path / "field.gpkg")
    assert len(back.table("obstacles")) == 0
    assert list(back.table("obstacles").columns[:-1]) == schema.OBSTACLES.column_names


@pytest.mark.parametrize("shape", [None, shapely.Polygon()])
def test_missing_and_empty_geometries_are_refused(dataset, tmp_path, shape):
    broken = dataset.tables["obstacles"].copy()
    broken.loc[1, "geometry"] = shape
    with pytest.raises(FormatError, match="row 2 has"):
        write_dataset(
            dataclasses.replace(dataset, tables={**dataset.tables, "obstacles": broken}),
            tmp_path,
            ["gpkg"],
        )


def test_rows_without_geometry_made_in_qgis_are_told(dataset, tmp_path):
    write_dataset(dataset, tmp_path, ["gpkg"])
    with closing(sqlite3.connect(tmp_path / "field.gpkg")) as connection, connection:
        # Its condition needs functions that only GDAL and QGIS bring along.
        connection.execute('DROP TRIGGER "rtree_obstacles_geom_insert"')
        connection.execute("INSERT INTO obstacles (status) VALUES ('added')")
    with pytest.warns(FormatWarning, match="1 row has no shape"):
        back = read_dataset(tmp_path / "field.gpkg")
    assert len(back.table("obstacles")) == 4


def test_two_formats_for_one_file(dataset, tmp_path):
    with pytest.raises(FormatError, match="Two of the formats write"):
        write_dataset(dataset, tmp_path, ["rdf", "rdf-study"])


@pytest.mark.parametrize("name", ["isoxml", "agopengps"])
def test_terminals_need_one_field(dataset, tmp_path, name):
    none = dataclasses.replace(
        dataset, tables={**dataset.tables, "field": dataset.tables["field"].iloc[:0]}
    )
    with pytest.raises(FormatError, match="one field; there are 0"):
        write_dataset(none, tmp_path, [name])


def test_rows_that_lost_their_shape_are_told_by_number(dataset, tmp_path):
    write_dataset(dataset, tmp_path, ["gpkg"])
    file = tmp_path / "field.gpkg"
    obstacles = pyogrio.read_dataframe(file, layer="obstacles")
    obstacles.loc[1, "geometry"] = None
    pyogrio.write_dataframe(obstacles, file, layer="obstacles")
    with pytest.warns(
        FormatWarning, match="'obstacles': 1 row has no shape and is left out: row 2"
    ):
        assert len(read_dataset(file).table("obstacles")) == len(obstacles) - 1


def test_a_reprojected_layer_is_told(dataset, tmp_path):
    write_dataset(dataset, tmp_path, ["gpkg"])
    path = tmp_path / "field.gpkg"
    moved = dataset.table("obstacles").to_crs(3857)
    moved.to_file(path, layer="obstacles", driver="GPKG")
    with pytest.raises(FormatError, match="no longer in"):
        read_dataset(path)


def test_infinite_coordinates_are_found(tmp_path):
    from geofield.formats.validation import check_dataset

    dataset = make_dataset()
    broken = dataset.tables["gaps"].copy()
    broken.loc[0, "geometry"] = shapely.LineString([(0, 0), (np.inf, 1)])
    broken_set = dataclasses.replace(dataset, tables={**dataset.tables, "gaps": broken})
    assert any("not a number" in each.message for each in check_dataset(broken_set))


def drawn_by_a_person(dataset):
    """The plan with a row as QGIS makes it: a shape, and nothing else."""
    import pandas as pd

    table = dataset.tables["obstacles"]
    new = schema.table(schema.OBSTACLES, {}, [shapely.box(*(table.total_bounds + 1))], dataset.crs)
    both = pd.concat([table, new], ignore_index=True)
    return dataclasses.replace(dataset, tables={**dataset.tables, "obstacles": both})


@pytest.mark.parametrize("name", ["isoxml", "agopengps", "gpx", "kml", "dxf", "shapefile", "csv"])
def test_a_drawn_obstacle_is_exported_before_planning_again(dataset, tmp_path, name):
    edited = drawn_by_a_person(dataset)
    written = write_dataset(edited, tmp_path, [name])
    for path in written:
        assert b"<NA>" not in path.read_bytes()
        assert b"&lt;NA&gt;" not in path.read_bytes()
        assert b"Obstacle None" not in path.read_bytes()
        assert b"Obstacle nan" not in path.read_bytes()
    if name in ("isoxml", "agopengps"):
        # It covers others, and is one with them on a terminal.
        text = b"".join(path.read_bytes() for path in written)
        assert re.search(rb"Obstacle (\d+\+)*5\b", text)


def test_a_renamed_field_keeps_its_new_name(dataset, tmp_path):
    write_dataset(dataset, tmp_path, ["gpkg"])
    with closing(sqlite3.connect(tmp_path / "field.gpkg")) as connection, connection:
        for (trigger,) in connection.execute(
            "SELECT name FROM sqlite_master WHERE type='trigger' AND tbl_name='field'"
        ).fetchall():
            connection.execute(f'DROP TRIGGER "{trigger}"')
        connection.execute("UPDATE field SET name = 'Neuer Name'")
    assert read_dataset(tmp_path / "field.gpkg").name == "Neuer Name"


def test_an_obstacle_of_two_parts_becomes_two(dataset, tmp_path):
    write_dataset(dataset, tmp_path, ["gpkg"])
    path = tmp_path / "field.gpkg"
    table = dataset.table("obstacles").copy()
    two = shapely.multipolygons([table.geometry.iloc[0], table.geometry.iloc[2]])
    table.loc[0, "geometry"] = two
    table.to_file(path, layer="obstacles", driver="GPKG")
    back = read_dataset(path).table("obstacles")
    assert len(back) == 5
    assert back["obstacle_no"].duplicated().sum() == 1
    assert set(back.geom_type) == {"Polygon"}


def test_text_where_numbers_belong(dataset, tmp_path):
    write_dataset(dataset, tmp_path, ["gpkg"])
    table = dataset.table("obstacles").copy()
    table["radius_m"] = [None, "2.5", "about three", None]
    table.to_file(tmp_path / "field.gpkg", layer="obstacles", driver="GPKG")
    with pytest.raises(FormatError, match="'radius_m', row 3: 'about three' is no number"):
        read_dataset(tmp_path / "field.gpkg")


@pytest.mark.parametrize(("name", "column"), [
    ("gpkg", "Name"), ("gpkg", "geom"), ("geojson", "Name"), ("flatgeobuf", "Name"),
    ("geoparquet", "bbox"), ("shapefile", "geom"),
])  # fmt: skip
def test_a_persons_column_beside_one_of_ours_like_it(dataset, tmp_path, name, column):
    field = dataset.tables["field"].assign(**{column: "theirs"})
    tables = {**dataset.tables, "field": field}
    write_dataset(dataclasses.replace(dataset, tables=tables), tmp_path, [name])
    path = tmp_path / "field.gpkg" if name == "gpkg" else tmp_path / name
    back = read_dataset(path).table("field")
    assert back["name"].iloc[0] == field["name"].iloc[0]
    assert back[f"{column}_2"].iloc[0] == "theirs"


def test_edits_that_qgis_has_saved_but_not_folded_in_are_read(dataset, tmp_path):
    """While QGIS is open, what a person saved lies in the write-ahead log beside the file."""
    write_dataset(dataset, tmp_path, ["gpkg"])
    path = tmp_path / "field.gpkg"
    other = sqlite3.connect(path)
    other.execute("PRAGMA journal_mode = WAL")
    other.execute("PRAGMA wal_autocheckpoint = 0")
    for (trigger,) in other.execute(
        "SELECT name FROM sqlite_master WHERE type='trigger' AND tbl_name='obstacles'"
    ).fetchall():
        other.execute(f'DROP TRIGGER "{trigger}"')
    other.execute("UPDATE obstacles SET status = 'rejected' WHERE obstacle_no = 1")
    other.commit()
    try:
        assert (tmp_path / "field.gpkg-wal").stat().st_size > 0
        back = read_dataset(path).table("obstacles")
        assert list(back["status"])[:2] == ["rejected", "confirmed"]
    finally:
        other.close()


LIST = [["operational", "organic"]]


@pytest.mark.parametrize("name", ["gpkg", "shapefile", "kml", "fiboa", "turtle"])
@pytest.mark.parametrize("column", [
    {"id": [5]}, {"category": LIST}, {"tags": LIST}, {"history": [{"crop": "rye"}]},
    {"determination:datetime": ["soon"]}, {"sown": [pd.Timestamp("2026-03-01")]},
    {"waits": [pd.Timedelta("2h")]}, {"yield": [np.inf]}, {"size": np.array([3], dtype="uint8")},
], ids=str)  # fmt: skip
def test_a_users_column_of_any_name_and_type(dataset, tmp_path, name, column):
    field = dataset.tables["field"].assign(**{key: pd.Series(v) for key, v in column.items()})
    owned = dataclasses.replace(dataset, tables={**dataset.tables, "field": field})
    for path in write_dataset(owned, tmp_path, [name]):
        if path.suffix == ".geojson" and name == "fiboa":
            (one,) = json.loads(path.read_text(), parse_constant=pytest.fail)["features"]
            assert one["id"] == field["field_id"].iloc[0]
            assert one["properties"]["category"] == ["operational"]


def test_long_numbers_and_names_of_placemarks_survive_kml(dataset, tmp_path):
    """A 32-bit number in KML would be cut to 2147483647; GDAL has columns of its own there."""
    own = {"parcel": 3210000123, "crop_no": 7, "id": "A5", "description": "wet", "begin": "May"}
    field = dataset.tables["field"].assign(**own)
    write_dataset(
        dataclasses.replace(dataset, tables={**dataset.tables, "field": field}), tmp_path, ["kml"]
    )
    back = read_dataset(tmp_path / "field.kml").table("field").iloc[0]
    assert {name: back[name] for name in own} == own | {"parcel": "3210000123"}


def test_long_numbers_survive_shapefiles(dataset, tmp_path):
    """Readers take 19 digits for a number with a point: the last three were others."""
    own = {"parcel": 1234567890123456789, "crop_no": 7}
    field = dataset.tables["field"].assign(**own)
    owned = dataclasses.replace(dataset, tables={**dataset.tables, "field": field})
    write_dataset(owned, tmp_path, ["shapefile"])
    back = gpd.read_file(tmp_path / "shapefile" / "boundary.shp").iloc[0]
    assert {name: back[name] for name in own} == own | {"parcel": str(own["parcel"])}


def test_text_that_a_shapefile_cuts_is_told(dataset, tmp_path):
    field = dataset.tables["field"].assign(remark="long " * 60)
    long = dataclasses.replace(dataset, tables={**dataset.tables, "field": field})
    with pytest.warns(FormatWarning, match="cut text at 254 bytes: column 'remark'"):
        write_dataset(long, tmp_path, ["shapefile"], tell_drops=False)


def test_a_strangers_plan_names_no_picture_elsewhere(dataset, tmp_path):
    secret = tmp_path / "secret.tif"
    secret.write_bytes(b"not for others")
    write_dataset(dataset, tmp_path / "plan", ["gpkg"])
    path = tmp_path / "plan" / "field.gpkg"
    for place in ("../secret.tif", str(secret)):
        with closing(sqlite3.connect(path)) as connection, connection:
            (text,) = connection.execute("SELECT metadata FROM gpkg_metadata").fetchone()
            said = json.dumps(json.loads(text) | {"scene": place})
            connection.execute("UPDATE gpkg_metadata SET metadata = ?", (said,))
        connection.close()
        assert read_dataset(path).scene_path is None


def test_a_picture_that_cannot_be_read_is_named_with_what_to_do(dataset, tmp_path):
    picture = tmp_path / "scene.tif"
    picture.write_bytes(b"no picture")
    with pytest.raises(FormatError, match=r"The picture .*scene\.tif of the plan cannot") as told:
        write_dataset(dataclasses.replace(dataset, scene_path=picture), tmp_path, ["gpkg"])
    assert told.value.hint.startswith("Put a whole one there")


@pytest.mark.parametrize(
    ("damaged", "what"),
    [("{}", "'version' is missing"), ('{"version": 1', "Expecting"), ("[]", "list indices")],
)
def test_a_damaged_note_of_what_was_written_is_told_with_what_to_do(
    dataset, tmp_path, damaged, what
):
    write_dataset(dataset, tmp_path, ["gpkg"])
    path = tmp_path / "field.gpkg"
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("UPDATE gpkg_metadata SET metadata = ?", (damaged,))
    with pytest.raises(FormatError, match=f"noted in the file is damaged: .*{what}") as told:
        read_dataset(path)
    assert "ogr2ogr copy.gpkg" in told.value.hint
