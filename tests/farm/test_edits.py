"""Edits made in a farm's overview are kept: by batch, by put, with tracks planned again."""

from __future__ import annotations

import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import geopandas as gpd
import pandas as pd
import pyogrio
import pytest
import shapely
import shapely.affinity
from pyproj import CRS

import geofield as gf
from geofield.errors import FieldWarning, FormatError
from geofield.farm.edits import put_edits
from geofield.farm.put_back import _put, put_back
from geofield.farm.store import Store
from geofield.model.evidence import Evidence, outline_record
from geofield.pipeline import run_tracks
from geofield.plan_files import save_plan
from geofield.review import Session
from geofield.settings import Settings
from geofield_command import run_geofield

SIDE_M = 120.0


def geofield(*arguments: object, code: int = 0) -> str:
    done = run_geofield(*arguments)
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    return done.stderr


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A farm of four square fields with two obstacles in each, beside its places."""
    folder = tmp_path_factory.mktemp("edits")
    corners = [(500_000 + 150 * i, 5_300_000) for i in range(4)]
    gpd.GeoDataFrame(
        {"id": list("abcd"), "crop": ["rye"] * 4},
        geometry=[shapely.box(x, y, x + SIDE_M, y + SIDE_M) for x, y in corners], crs=32633,
    ).to_file(folder / "parcels.gpkg")  # fmt: skip
    trees = [(x + dx, y + 60) for x, y in corners for dx in (40, 80)]
    gpd.GeoDataFrame(
        {"radius_m": [3.0] * 8}, geometry=gpd.points_from_xy(*zip(*trees, strict=True)), crs=32633
    ).to_file(folder / "trees.gpkg")
    _batch(folder)
    return folder


def _batch(folder: Path, *more: object, code: int = 0) -> str:
    return geofield(
        "batch", folder / "parcels.gpkg", "--obstacles", folder / "trees.gpkg", "--spacing", 6,
        "--workers", 1, "--out", folder / "farm", *more, code=code,
    )  # fmt: skip


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "copy"))


def _edit(folder: Path, layer: str, change: Callable[[Any], Any]) -> None:
    """Change a layer of the overview in place, as a program that knows nothing of geofield does."""
    path = folder / "farm" / "farm.gpkg"
    table = change(pyogrio.read_dataframe(path, layer=layer))
    with closing(sqlite3.connect(path)) as file:
        columns = {row[1] for row in file.execute(f"PRAGMA table_info({layer})")}
    assert set(table.columns) - {"geometry"} <= columns
    pyogrio.write_dataframe(table, path, layer=layer, geometry_name="geom")


def _tree_grown(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    row = (table["field_id"] == "b").to_numpy() & (table["obstacle_no"] == 3).to_numpy()
    table.loc[row, "geometry"] = table.loc[row, "geometry"].buffer(5)
    rejected = (table["field_id"] == "c").to_numpy() & (table["obstacle_no"] == 6).to_numpy()
    table.loc[rejected, "status"] = "Rejected"
    return table


@pytest.mark.parametrize("door", ["batch", "put"])
def test_what_was_edited_in_qgis_stands(folder: Path, door: str) -> None:
    # A farm reads its folder when it is asked.
    before = {plan.field.field_id: plan for plan in gf.read_farm(folder / "farm")}
    _edit(folder, "obstacles", _tree_grown)
    if door == "batch":
        said = _batch(folder)
        assert "b as edited" in said
        assert "c as edited" in said
        assert "a as edited" not in said
        # The overview is written anew, and nothing in it counts as an edit.
        assert "as edited" not in _batch(folder, "--fresh", "--spacing", 8)
    else:
        geofield("farm", "put", folder / "farm" / "farm.gpkg", folder / "farm")
    after = gf.read_farm(folder / "farm")
    assert after["a"] == before["a"] or door == "batch"
    grown = after["b"].obstacles.set_index("obstacle_no")
    old = before["b"].obstacles.set_index("obstacle_no")
    assert grown.geometry[3].area > 2 * old.geometry[3].area
    assert grown["status"].to_dict() == {3: "added", 4: "added"}
    assert grown.geometry[4].equals_exact(old.geometry[4], 1e-6)
    assert dict(after["c"].obstacles[["obstacle_no", "status"]].values)[6] == "rejected"
    for one in "bc":
        plan = after[one]
        assert not plan.tracks.segments.intersects(
            plan.obstacles[plan.obstacles["status"] != "rejected"].union_all().buffer(-0.01)
        ).any()
    assert len(after["c"].tracks.gaps) < len(before["c"].tracks.gaps)
    status = after.status.set_index("field_id")["reviewed"]
    assert status.to_dict() == {"a": False, "b": True, "c": True, "d": False}


def test_a_new_obstacle_and_another_outline(folder: Path) -> None:
    farm = gf.read_farm(folder / "farm")
    middle = farm["d"].field.polygon.centroid

    def drawn(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        row = table.iloc[[0]].copy()
        for name in row.columns.drop("geometry"):
            row[name] = None
        row["geometry"] = shapely.box(middle.x, middle.y + 20, middle.x + 9, middle.y + 30)
        return gpd.GeoDataFrame(gpd.pd.concat([table, row], ignore_index=True), crs=table.crs)

    def reshaped(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        row = (table["field_id"] == "a").to_numpy()
        table.loc[row, "geometry"] = table.loc[row, "geometry"].intersection(
            table.loc[row, "geometry"].translate(-30, 0).iloc[0]
        )
        return table

    _edit(folder, "obstacles", drawn)
    _edit(folder, "field", reshaped)
    _batch(folder)
    after = gf.read_farm(folder / "farm")
    assert len(after["d"].obstacles) == 3
    assert after["d"].obstacles["status"].tolist()[-1] == "added"
    assert after["a"].field.polygon.area == pytest.approx((SIDE_M - 30) * SIDE_M, rel=1e-6)
    assert after["a"].field.method == "drawn"
    assert after["a"].tracks.segments.within(after["a"].field.polygon.buffer(0.01)).all()
    assert after.fields.set_index("field_id")["crop"]["a"] == "rye"


def test_an_edit_that_cannot_stand_stops_before_anything_is_lost(folder: Path) -> None:
    def crossed(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        row = (table["field_id"] == "a").to_numpy()
        west, south, east, north = table.loc[row].total_bounds
        bow = shapely.Polygon([(west, south), (east, north), (east, south), (west, north)])
        table.loc[row, "geometry"] = bow
        return table

    _edit(folder, "field", crossed)
    before = (folder / "farm" / "farm.gpkg").read_bytes()
    said = _batch(folder, code=1)
    assert "outline of field a" in " ".join(said.split())
    assert (folder / "farm" / "farm.gpkg").read_bytes() == before


def test_what_a_person_keeps_beside_the_farm(folder: Path) -> None:
    path = folder / "farm" / "farm.gpkg"
    fields = pyogrio.read_dataframe(path, layer="field")
    notes = fields[["geometry"]].assign(text="wet", geometry=fields.geometry.centroid)
    pyogrio.write_dataframe(notes, path, layer="notes")
    _edit(folder, "obstacles", _tree_grown)
    for more in ((), ("--fresh",)):
        _batch(folder, *more)
        kept = pyogrio.read_dataframe(path, layer="notes")[["text", "geometry"]]
        assert kept.equals(notes[["text", "geometry"]])


def test_columns_of_a_person_stay(folder: Path) -> None:
    path = folder / "farm" / "farm.gpkg"
    fields = pyogrio.read_dataframe(path, layer="field")
    fields["sown"] = [None, 5, None, 7.5]
    fields.loc[fields["field_id"] == "c", "crop"] = "oats"
    pyogrio.write_dataframe(fields, path, layer="field", geometry_name="geom")
    trees = pyogrio.read_dataframe(path, layer="obstacles")
    trees["species"] = ["oak" if one == 1 else None for one in trees["obstacle_no"]]
    pyogrio.write_dataframe(trees, path, layer="obstacles", geometry_name="geom")
    said = _batch(folder)
    assert [one for one in "abcd" if f"{one} as edited" in said] == list("abcd")
    assert "as edited" not in _batch(folder, "--fresh", "--spacing", 8)
    farm = gf.read_farm(folder / "farm")
    for found in (farm.fields, pyogrio.read_dataframe(path, layer="field")):
        rows = found.set_index("field_id")
        assert rows["sown"].fillna(0).to_dict() == {"a": 0, "b": 5, "c": 0, "d": 7.5}
        assert rows["crop"].to_dict() == {"a": "rye", "b": "rye", "c": "oats", "d": "rye"}
    assert farm["a"].obstacles["species"].fillna("").tolist() == ["oak", ""]
    _sql(path, "UPDATE field SET sown = NULL WHERE field_id = 'b'")
    said = _batch(folder, "--spacing", 8)
    assert [one for one in "abcd" if f"{one} as edited" in said] == ["b"]
    rows = gf.read_farm(folder / "farm").fields.set_index("field_id")
    assert rows["sown"].fillna(0).to_dict() == {"a": 0, "b": 0, "c": 0, "d": 7.5}


def _sql(path: Path, statement: str) -> None:
    subprocess.run(["ogrinfo", "-q", path, "-sql", statement], check=True, capture_output=True)


def _parcels(folder: Path, change: Callable[[gpd.GeoDataFrame], gpd.GeoDataFrame]) -> None:
    change(gpd.read_file(folder / "parcels.gpkg")).to_file(folder / "parcels.gpkg")


def test_names_and_columns_of_a_person_stay_with_other_settings(folder: Path) -> None:
    said = geofield("farm", "get", folder / "farm", "x", "-o", folder / "a.gpkg", code=1)
    assert said.endswith("It has plans of a, b, c, d.\n"), said
    geofield("farm", "get", folder / "farm", "a", "-o", folder / "a.gpkg")
    plan = pyogrio.read_dataframe(folder / "a.gpkg", layer="field")
    # The code was a number, and those of the other fields are.
    plan = plan.assign(name="Hof", code="A7", note="wet", crop=None)
    pyogrio.write_dataframe(plan, folder / "a.gpkg", layer="field", geometry_name="geom")
    _parcels(folder, lambda table: table.assign(code=[1, 2, 3, 4]))
    _batch(folder, "--fresh")
    geofield("farm", "put", folder / "a.gpkg", folder / "farm")
    for more in ((), ("--fresh", "--spacing", 8)):
        _batch(folder, *more)
        rows = gf.read_farm(folder / "farm").fields.set_index("field_id")
        assert rows.loc["a", ["name", "code", "note"]].tolist() == ["Hof", "A7", "wet"]
        assert rows.loc["b", ["name", "code", "crop"]].tolist() == ["b", "2", "rye"]
        assert rows["crop"].isna().tolist() == [True, False, False, False]


def test_a_reviewed_plan_lands_on_no_other_field(folder: Path) -> None:
    def drawn(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        mine = table["field_id"] == "d"
        table.loc[mine, "geometry"] = table.loc[mine].geometry.scale(0.8, 1)
        return table

    _edit(folder, "obstacles", _tree_grown)
    _edit(folder, "field", drawn)
    _batch(folder)

    def moved(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        shapes = table.geometry.to_numpy(copy=True)
        shapes[1] = shapely.affinity.translate(shapes[1], 0, 3000)
        shapes[2] = shapely.affinity.scale(shapes[2], 0.9, 1)
        return table.set_geometry(gpd.GeoSeries(shapes, crs=table.crs))

    _parcels(folder, moved)
    said = " ".join(_batch(folder, "--fresh", code=1).split())
    assert "1 reviewed field has no plan: b." in said
    status = gf.read_farm(folder / "farm").status.set_index("field_id")
    assert status["status"].to_dict() == {"a": "done", "b": "failed", "c": "done", "d": "done"}
    assert "reviewed as 'b' is of a field elsewhere" in status["error"]["b"]
    # Of c an obstacle was reviewed, and the outline of d was drawn.
    area_ha = gf.read_farm(folder / "farm").fields.set_index("field_id")["area_ha"]
    assert area_ha["c"] == pytest.approx(0.9 * 1.44, rel=1e-3)
    words = "The reviewed outline stands; that of the places differs by 0.29 ha."
    assert status["notes"]["d"] == words
    assert f"d: {words}" in said
    _parcels(folder, lambda table: table.assign(id=["a", "b", "C", "d"]))
    said = " ".join(_batch(folder, "--fresh", code=1).split())
    assert "1 reviewed plan is of no id in parcels.gpkg, and waits for one: reviewed/c" in said


def test_any_id_can_be_reviewed(folder: Path) -> None:
    ids = [".5", "a/b", "поле" * 20, "y" * 300]
    _parcels(folder, lambda table: table.assign(id=ids))
    _batch(folder, "--fresh")
    _sql(folder / "farm" / "farm.gpkg", "UPDATE obstacles SET status = 'rejected'")
    _batch(folder)
    _batch(folder, "--fresh")
    farm = gf.read_farm(folder / "farm")
    assert set(farm.status["field_id"]) == set(ids)
    assert farm.status["reviewed"].all()
    assert set(farm.obstacles["status"]) == {"rejected"}


def test_a_disk_that_takes_two_ids_for_one_name_loses_no_plan(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Windows, macOS and sticks do not tell North.gpkg from north.gpkg."""
    store = Store.of(folder / "farm")
    save_plan(gf.read_farm(folder / "farm")["b"], folder / "b.gpkg")
    _put(store, "north", folder / "b.gpkg")
    before = (folder / "farm" / "reviewed" / "north.gpkg").read_bytes()
    is_file = Path.is_file

    def alike(path: Path) -> bool:
        there = path.parent.iterdir() if path.parent.is_dir() else ()
        return is_file(path) or path.name.lower() in {each.name.lower() for each in there}

    monkeypatch.setattr(Path, "is_file", alike)
    with pytest.raises(FormatError, match="is the plan of another field"):
        _put(store, "North", folder / "b.gpkg")
    assert [each.name for each in (folder / "farm" / "reviewed").iterdir()] == ["north.gpkg"]
    assert (folder / "farm" / "reviewed" / "north.gpkg").read_bytes() == before


def test_a_column_that_has_another_name_in_the_file(tmp_path: Path) -> None:
    shape = shapely.box(15, 47, 15.001, 47.001).wkt
    (tmp_path / "a.csv").write_text(f'id,geom,wkt\na,5,"{shape}"\n')
    asked = ("batch", tmp_path / "a.csv", "--spacing", 6, "--workers", 1, "--out", tmp_path / "own")
    geofield(*asked)
    # The shapes are called geom there.
    _sql(tmp_path / "own" / "farm.gpkg", "UPDATE field SET geom_2 = 7")
    geofield(*asked)
    assert gf.read_farm(tmp_path / "own")["a"].field.own == (("geom", 7),)


def test_edits_wait_for_the_plan_of_their_field(folder: Path) -> None:
    """A run that was killed leaves an overview with fields that are not planned anew yet."""
    path = folder / "farm" / "farm.gpkg"
    _edit(folder, "obstacles", _tree_grown)
    before = path.read_bytes()
    shutil.rmtree(folder / "farm" / "status")
    _parcels(folder, lambda table: table[table["id"] != "c"])
    said = _batch(folder, "--fresh")
    assert "b as edited" in said
    assert "has edits of fields without a plan (c)" in " ".join(said.split())
    assert path.read_bytes() == before
    path.unlink()
    _batch(folder)
    farm = gf.read_farm(folder / "farm")
    assert farm.ids == ["a", "b", "d"]
    assert farm["b"].obstacles.geometry.area.max() > 100


def test_a_field_edited_in_two_places_is_refused(folder: Path) -> None:
    farm, path = folder / "farm", folder / "farm" / "farm.gpkg"
    geofield("farm", "get", farm, "b", "-o", folder / "b.gpkg")
    _sql(folder / "b.gpkg", "UPDATE obstacles SET status = 'rejected' WHERE obstacle_no = 4")
    unedited = path.read_bytes()
    _edit(folder, "obstacles", _tree_grown)
    edited = path.read_bytes()
    said = geofield("farm", "put", folder / "b.gpkg", farm, code=1)
    assert "b is edited in farm.gpkg, too" in " ".join(said.split())
    # Put back while the overview had no edits; it is edited as it was before that.
    path.write_bytes(unedited)
    geofield("farm", "put", folder / "b.gpkg", farm)
    path.write_bytes(edited)
    said = " ".join(_batch(folder, code=1).split())
    assert "b was edited in farm.gpkg, and changed in the farm since" in said
    assert path.read_bytes() == edited
    geofield("farm", "put", path, farm)
    assert set(gf.read_farm(farm)["b"].obstacles["status"]) == {"added"}
    assert "as edited" not in _batch(folder)


def test_edits_are_taken_in_after_a_kill_amid_that(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first of two plans is in place then, and the farm is as it was."""
    farm = folder / "farm"
    _edit(folder, "obstacles", _tree_grown)

    def killed(store: Store, field_id: str, file: Path) -> None:
        _put(store, field_id, file)
        raise KeyboardInterrupt

    monkeypatch.setattr("geofield.farm.put_back._put", killed)
    with pytest.raises(KeyboardInterrupt):
        put_edits(farm, farm / "farm.gpkg")
    assert [file.name for file in (farm / "reviewed").glob("*.gpkg")] == ["b.gpkg"]
    said = _batch(folder)
    assert "b as edited in farm.gpkg" in said
    assert "c as edited in farm.gpkg" in said
    after = gf.read_farm(farm)
    assert after.status["reviewed"].tolist() == [False, True, True, False]
    assert after["b"].obstacles.geometry.area.max() > 100
    assert "rejected" in set(after["c"].obstacles["status"])


def test_what_lies_in_a_reviewed_plan_comes_along_when_the_overview_is_edited(folder: Path) -> None:
    """A layer of one's own in reviewed/b.gpkg was left in b.gpkg.bak, which the next edit took."""
    farm = folder / "farm"
    geofield("farm", "get", farm, "b", "-o", folder / "b.gpkg")
    geofield("farm", "put", folder / "b.gpkg", farm)
    mine = gpd.GeoDataFrame({"memo": ["wet"]}, geometry=[shapely.Point(500_200, 5_300_050)])
    mine.set_crs(32633).to_file(farm / "reviewed" / "b.gpkg", layer="visits")
    _edit(folder, "obstacles", _tree_grown)
    geofield("farm", "put", farm / "farm.gpkg", farm)
    plans = farm / "reviewed"
    assert gpd.read_file(plans / "b.gpkg", layer="visits")["memo"].tolist() == ["wet"]
    standing = gpd.read_file(plans / "b.gpkg", layer="obstacles")
    assert standing.geometry.area.max() > 100
    assert "visits" not in pyogrio.list_layers(plans / "c.gpkg")[:, 0]


def test_what_lies_in_a_reviewed_plan_comes_along_when_another_is_put_there(folder: Path) -> None:
    """It was left in b.gpkg.bak; what the plan that is put has of that name holds."""
    farm, file = folder / "farm", folder / "b.gpkg"
    geofield("farm", "get", farm, "b", "-o", file)
    geofield("farm", "put", file, farm)
    there = farm / "reviewed" / "b.gpkg"
    mine = gpd.GeoDataFrame({"memo": ["wet"]}, geometry=[shapely.Point(500_200, 5_300_050)])
    mine = mine.set_crs(32633)
    for layer in ("visits", "stones"):
        mine.to_file(there, layer=layer)
    mine.assign(memo="dry").to_file(file, layer="stones")
    table = gpd.read_file(file, layer="obstacles")
    table.assign(status="rejected").to_file(file, layer="obstacles")
    geofield("farm", "put", file, farm)
    assert gpd.read_file(there, layer="visits")["memo"].tolist() == ["wet"]
    assert gpd.read_file(there, layer="stones")["memo"].tolist() == ["dry"]
    assert set(gpd.read_file(there, layer="obstacles")["status"]) == {"rejected"}


def test_an_obstacle_copied_to_another_field_is_of_that_one(folder: Path) -> None:
    def copied(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        row = table[table["field_id"] == "a"].iloc[[0]]
        row = row.set_geometry(row.geometry.translate(170, 20))
        return gpd.GeoDataFrame(gpd.pd.concat([table, row]), crs=table.crs)

    _edit(folder, "obstacles", copied)
    _batch(folder)
    farm = gf.read_farm(folder / "farm")
    assert farm.obstacles["field_id"].value_counts().to_dict() == {"a": 2, "b": 3, "c": 2, "d": 2}
    assert farm["b"].obstacles["obstacle_no"].is_unique


def test_fields_deleted_or_split_in_the_overview_are_told(folder: Path) -> None:
    _sql(folder / "farm" / "farm.gpkg", "DELETE FROM field WHERE field_id = 'a'")
    # Its tracks are nobody's: its neighbours had them as drawn.
    said = " ".join(_batch(folder).split())
    assert "1 field is deleted there (a)" in said
    assert "as edited" not in said

    def split(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        return gpd.GeoDataFrame(gpd.pd.concat([table, table.iloc[[-1]]]), crs=table.crs)

    _edit(folder, "field", split)
    said = " ".join(_batch(folder, code=1).split())
    assert "several outlines of field 'd'" in said


def test_tracks_of_many_parcels_keep_what_was_edited(folder: Path) -> None:
    asked = ("tracks", folder / "parcels.gpkg", "--obstacles", folder / "trees.gpkg")
    geofield(*asked, "--spacing", 6, "-o", folder / "tracks")
    (folder / "farm").rename(folder / "first")
    (folder / "tracks").rename(folder / "farm")
    _edit(folder, "obstacles", _tree_grown)
    said = geofield(*asked, "--spacing", 8, "-o", folder / "farm", "--overwrite")
    assert "c as edited" in said
    assert "rejected" in set(gf.read_farm(folder / "farm")["c"].obstacles["status"])


def test_an_outline_put_back_without_its_tracks_gets_them(folder: Path) -> None:
    geofield("farm", "get", folder / "farm", "a", "-o", folder / "a.gpkg")
    plan = pyogrio.read_dataframe(folder / "a.gpkg", layer="field")
    plan = plan.set_geometry(plan.geometry.scale(0.5, 1))
    pyogrio.write_dataframe(plan, folder / "a.gpkg", layer="field", geometry_name="geom")
    said = geofield("farm", "put", folder / "a.gpkg", folder / "farm")
    assert "planned again" in said
    after = gf.read_farm(folder / "farm")["a"]
    assert after.tracks.segments.within(after.field.polygon.buffer(0.01)).all()
    assert after.field.area_ha == pytest.approx(0.72, abs=0.01)
    # One that was not edited, and in the other format that holds a plan.
    geofield("farm", "get", folder / "farm", "b", "-o", folder / "b.gpkg")
    geofield("export", folder / "b.gpkg", "--format", "turtle", "--out", folder / "ttl")
    assert "planned again" not in geofield(
        "farm", "put", folder / "ttl" / "field.ttl", folder / "farm"
    )
    assert gf.read_plan(folder / "farm" / "reviewed" / "b.gpkg").field.field_id == "b"


def _reviewed_edited(folder: Path, one: str, layer: str, change: Callable[[Any], Any]) -> Path:
    """The reviewed plan of a field, edited where it lies."""
    geofield("farm", "get", folder / "farm", one, "-o", folder / f"{one}.gpkg")
    geofield("farm", "put", folder / f"{one}.gpkg", folder / "farm")
    file = folder / "farm" / "reviewed" / f"{one}.gpkg"
    table = change(pyogrio.read_dataframe(file, layer=layer))
    pyogrio.write_dataframe(table, file, layer=layer, geometry_name="geom")
    return file


def test_a_reviewed_plan_that_was_edited_where_it_lies_is_taken_in(folder: Path) -> None:
    file = _reviewed_edited(
        folder, "a", "field", lambda one: one.set_geometry(one.geometry.translate(7, 0))
    )
    # What is made of the farm before that is told to be without it.
    said = geofield("export", folder / "farm", "--format", "geojson", "--out", folder / "out")
    assert "reviewed/a.gpkg has edits that the farm does not hold yet" in " ".join(said.split())
    said = _batch(folder)
    assert "a as edited in reviewed/a.gpkg" in said
    assert not file.with_suffix(".qgz").exists()
    farm = gf.read_farm(folder / "farm")
    bounds = (500_007.0, 5_300_000.0, 500_127.0, 5_300_120.0)
    assert farm["a"].field.polygon.bounds == pytest.approx(bounds)
    assert farm["a"].tracks.segments.within(farm["a"].field.polygon.buffer(0.01)).all()
    assert gf.read_plan(file) == farm["a"]
    shown = pyogrio.read_dataframe(folder / "farm" / "farm.gpkg", layer="field")
    assert shown.set_index("field_id").geometry["a"].bounds == pytest.approx(bounds)
    # Once, and not again where the file is merely newer.
    file.touch()
    assert "as edited" not in _batch(folder)


def test_edits_of_the_overview_are_told_where_they_are_not_in(folder: Path) -> None:
    export = ("export", folder / "farm", "--format", "geojson", "--out", folder / "out")
    _edit(folder, "obstacles", _tree_grown)
    take = ("farm", "get", folder / "farm", "a", "-o", folder / "a.gpkg")
    for each in (export, take):
        assert "farm.gpkg has edits that the farm does not hold yet" in geofield(*each)
    geofield("farm", "put", folder / "farm" / "farm.gpkg", folder / "farm")
    for each in (export, take):
        assert "has edits" not in geofield(*each, "--overwrite")


def test_an_overview_that_was_left_out_is_renewed_by_the_next_run(folder: Path) -> None:
    _batch(folder, "--no-overview", "--fresh", "--spacing", 12)
    _batch(folder, "--spacing", 12)
    shown = pyogrio.read_dataframe(folder / "farm" / "farm.gpkg", layer="tracks")
    assert len(shown) == len(gf.read_farm(folder / "farm").tracks)


@pytest.mark.parametrize("layer", ["obstacles", "field"])
def test_tracks_of_before_the_edit_do_not_go_back(folder: Path, layer: str) -> None:
    """They differ from the farm's, for another spacing was planned before the edit."""
    farm, file = folder / "farm", folder / "a.gpkg"
    plan = gf.read_farm(farm)["a"]
    save_plan(run_tracks(plan, settings=Settings(tracks={"spacing_m": 9.0})), file)
    table = pyogrio.read_dataframe(file, layer=layer)
    if layer == "field":
        table = table.set_geometry(table.geometry.buffer(-20, join_style="mitre"))
    else:
        tree = shapely.Point(500_060, 5_300_090).buffer(8)
        table = pd.concat([table, gpd.GeoDataFrame(geometry=[tree], crs=table.crs)])
    pyogrio.write_dataframe(table, file, layer=layer, geometry_name="geom")
    with pytest.warns(FieldWarning, match="planned again"):
        put_back(file, farm)
    after = gf.read_farm(farm)["a"]
    assert after.tracks.spacing_m == 9
    assert after.obstacles["status"].notna().all()
    assert after.tracks.segments.within(after.field.polygon.buffer(0.01)).all()
    assert not after.tracks.segments.intersects(after.obstacles.union_all().buffer(-0.01)).any()
    assert (after.field.method == "drawn") == (layer == "field")


def test_a_plan_without_obstacles_goes_back_as_it_is(tmp_path: Path) -> None:
    shape = shapely.box(500_000, 5_000_000, 500_100, 5_000_100)
    field = gf.Field(shape, crs=CRS(32633), field_id="a", name="a")
    tracks = gf.plan_tracks(shape, crs=field.crs, spacing_m=9)
    known = Evidence(outline=outline_record(shape))
    plan = gf.Plan(field, tracks=tracks, settings=Settings(), evidence=known)
    gf.Farm([plan]).write(tmp_path / "farm")
    geofield("farm", "get", tmp_path / "farm", "a", "-o", tmp_path / "a.gpkg")
    assert "planned again" not in geofield("farm", "put", tmp_path / "a.gpkg", tmp_path / "farm")


def test_a_plan_edited_where_it_lies_gets_the_tracks_of_its_farm(folder: Path) -> None:
    geofield("farm", "get", folder / "farm", "a", "-o", folder / "a.gpkg")
    geofield("farm", "put", folder / "a.gpkg", folder / "farm")
    _batch(folder, "--fresh", "--spacing", 12)
    file = folder / "farm" / "reviewed" / "a.gpkg"
    # As QGIS leaves it when it is killed: the edit is in the log alone.
    edit = """
import os, sqlite3, sys
file = sqlite3.connect(sys.argv[1])
for name in ("ST_IsEmpty", "ST_MinX", "ST_MaxX", "ST_MinY", "ST_MaxY"):
    file.create_function(name, 1, lambda shape: 0)
file.execute("PRAGMA journal_mode = WAL")
file.execute("UPDATE obstacles SET status = 'rejected'")
file.commit()
os._exit(0)
"""
    subprocess.run([sys.executable, "-c", edit, str(file)], check=True)
    assert file.with_name("a.gpkg-wal").stat().st_size
    assert "a as edited in reviewed/a.gpkg" in _batch(folder, "--spacing", 12)
    farm = gf.read_farm(folder / "farm")
    assert set(farm["a"].obstacles["status"]) == {"rejected"}
    assert farm["a"].settings.tracks.spacing_m == 12
    assert len(farm["a"].tracks.lines) == len(farm["d"].tracks.lines)
    assert gf.read_plan(file) == farm["a"]


def test_a_track_taken_away_stays_away_in_the_farm(folder: Path) -> None:
    geofield("farm", "get", folder / "farm", "a", "-o", folder / "a.gpkg")
    tracks = pyogrio.read_dataframe(folder / "a.gpkg", layer="tracks")
    tracks = tracks[tracks["track_no"] != 4]
    pyogrio.write_dataframe(tracks, folder / "a.gpkg", layer="tracks", geometry_name="geom")
    assert "planned again" not in geofield("farm", "put", folder / "a.gpkg", folder / "farm")
    for more in ((), ("--fresh",)):
        farm = gf.read_farm(folder / "farm")
        assert 4 not in set(farm["a"].tracks.segments["track_no"])
        assert 4 not in set(farm["a"].tracks.lines["track_no"])
        assert 4 in set(farm["b"].tracks.lines["track_no"])
        _batch(folder, *more)


@pytest.mark.parametrize("door", ["batch", "put"])
def test_tracks_edited_in_the_overview_stand(folder: Path, door: str) -> None:
    """Taken away, drawn and written beside: of the fields where that was done, and of no other."""
    before = {plan.field.field_id: plan for plan in gf.read_farm(folder / "farm")}

    def gone(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        return table[~((table["field_id"] == "b") & (table["track_no"] == 4))]

    _edit(folder, "tracks", gone)
    _edit(folder, "segments", gone)
    _sql(folder / "farm" / "farm.gpkg", "ALTER TABLE segments ADD COLUMN note TEXT")
    _sql(
        folder / "farm" / "farm.gpkg",
        "UPDATE segments SET note = 'wet' WHERE field_id = 'c' AND track_no = 2",
    )
    x, y = before["d"].field.polygon.centroid.coords[0]
    drawn = shapely.LineString([(x - 50, y - 50), (x + 50, y + 45)])

    def and_drawn(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        line = gpd.GeoDataFrame(
            geometry=[shapely.MultiLineString([drawn])], crs=before["d"].field.crs
        )
        return pd.concat([table, line.to_crs(table.crs)], ignore_index=True)

    _edit(folder, "tracks", and_drawn)
    if door == "batch":
        said = _batch(folder)
        assert [one for one in "abcd" if f"{one} as edited" in said] == ["b", "c", "d"]
    else:
        geofield("farm", "put", folder / "farm" / "farm.gpkg", folder / "farm")
    # The overview is written anew, and nothing in it counts as an edit.
    assert "as edited" not in _batch(folder)
    for more in ((), ("--fresh",)):
        after = {plan.field.field_id: plan for plan in gf.read_farm(folder / "farm")}
        assert set(before["b"].tracks.lines["track_no"]) - set(
            after["b"].tracks.lines["track_no"]
        ) == {4}
        noted = after["c"].tracks.segments
        assert set(noted.loc[noted["note"].notna(), "track_no"]) == {2}
        assert "note" not in after["d"].tracks.segments
        (new,) = set(after["d"].tracks.lines["track_no"]) - set(
            before["d"].tracks.lines["track_no"]
        )
        line = after["d"].tracks.lines.set_index("track_no").geometry[new]
        assert line.within(drawn.buffer(0.01))
        assert after["a"].tracks.lines.equals(before["a"].tracks.lines)
        assert "as edited" not in _batch(folder, *more)


@pytest.mark.parametrize("lost", ["emptied", "dropped", "bare"])
def test_segments_of_the_overview_that_lost_their_numbers(folder: Path, lost: str) -> None:
    """They all counted as drawn (42 tracks for 20), or the run was refused."""
    before = {plan.field.field_id: plan for plan in gf.read_farm(folder / "farm")}
    path = folder / "farm" / "farm.gpkg"
    table = pyogrio.read_dataframe(path, layer="segments")
    table = table[~((table["field_id"] == "b") & (table["track_no"] == 4))]
    if lost == "emptied":
        table[["track_no", "segment_no"]] = None
    else:
        table = table[["geometry"] if lost == "bare" else ["field_id", "length_m", "geometry"]]
    pyogrio.write_dataframe(table, path, layer="segments", geometry_name="geom")
    said = _batch(folder)
    assert ("no column track_no, segment_no any more" in said) == (lost != "emptied")
    assert [one for one in "abcd" if f"{one} as edited" in said] == ["b"]
    after = {plan.field.field_id: plan for plan in gf.read_farm(folder / "farm")}
    assert after["b"].track_edits.in_words().endswith(": 4 taken away")
    assert len(after["b"].tracks.lines) == len(before["b"].tracks.lines) - 1
    assert all(after[one] == before[one] for one in "acd")


def _without(number: int) -> Callable[[Any], Any]:
    """Without a track of field a, or of the only one."""

    def gone(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        here = table["field_id"] == "a" if "field_id" in table else True
        return table[~(here & (table["track_no"] == number))]

    return gone


def test_tracks_edited_here_and_changed_in_the_farm_are_refused(folder: Path) -> None:
    farm, path = folder / "farm", folder / "farm" / "farm.gpkg"
    geofield("farm", "get", farm, "a", "-o", folder / "a.gpkg")
    for layer in ("tracks", "segments"):
        table = _without(4)(pyogrio.read_dataframe(folder / "a.gpkg", layer=layer))
        pyogrio.write_dataframe(table, folder / "a.gpkg", layer=layer, geometry_name="geom")
    unedited = path.read_bytes()
    for layer in ("tracks", "segments"):
        _edit(folder, layer, _without(7))
    edited = path.read_bytes()
    said = geofield("farm", "put", folder / "a.gpkg", farm, code=1)
    assert "a is edited in farm.gpkg, too" in " ".join(said.split())
    # Put back while the overview had no edits; it is edited as it was before that.
    path.write_bytes(unedited)
    geofield("farm", "put", folder / "a.gpkg", farm)
    path.write_bytes(edited)
    said = " ".join(_batch(folder, code=1).split())
    assert "a was edited in farm.gpkg, and changed in the farm since" in said
    assert path.read_bytes() == edited
    before = set(gf.read_farm(farm)["b"].tracks.lines["track_no"])
    geofield("farm", "put", path, farm)
    assert set(gf.read_farm(farm)["a"].tracks.lines["track_no"]) == before - {7}
    assert "as edited" not in _batch(folder)


def test_what_stands_beside_tracks_is_no_other_edit_and_stays(folder: Path) -> None:
    """A later edit of the field is not taken for one in two places."""
    path = folder / "farm" / "farm.gpkg"
    _sql(path, "ALTER TABLE tracks ADD COLUMN rate REAL")
    _sql(path, "UPDATE tracks SET rate = 2.5 WHERE field_id = 'c' AND track_no = 2")
    assert "c as edited" in _batch(folder)
    _edit(folder, "obstacles", _tree_grown)
    said = _batch(folder)
    assert "c as edited" in said
    assert "a as edited" not in said
    lines = gf.read_farm(folder / "farm")["c"].tracks.lines.set_index("track_no")
    assert lines["rate"].dropna().to_dict() == {2: 2.5}


@pytest.mark.parametrize(
    "deleted", ["DROP TABLE segments", "DELETE FROM segments", "DELETE FROM tracks"]
)
def test_a_layer_of_tracks_that_is_gone_is_no_word_on_any(folder: Path, deleted: str) -> None:
    before = {plan.field.field_id: plan for plan in gf.read_farm(folder / "farm")}
    _sql(folder / "farm" / "farm.gpkg", deleted)
    assert "as edited" not in _batch(folder)
    for plan in gf.read_farm(folder / "farm"):
        assert plan.tracks.lines.equals(before[plan.field.field_id].tracks.lines)


def _exported(folder: Path) -> str:
    return geofield("export", folder / "farm", "-f", "geojson", "--out", folder / "out")


def test_a_field_of_which_all_obstacles_were_deleted_is_told_by_its_name(folder: Path) -> None:
    _edit(folder, "obstacles", lambda table: table[table["field_id"] != "b"])
    told = _batch(folder)
    assert "Field b, as edited: All 2 obstacles that were driven around are gone" in told
    assert "Field a, as" not in told
    assert len(gf.read_farm(folder / "farm").obstacles) == 6


def _third(status: str) -> Callable[[Any], Any]:
    """With a status for obstacle 3, which stands in field b."""
    return lambda table: table.assign(
        status=table["status"].where(table["obstacle_no"] != 3, status)
    )


def _drawn(table: gpd.GeoDataFrame, *points: tuple[float, float]) -> gpd.GeoDataFrame:
    """A layer with a line that somebody drew, of no number and no field."""
    line = gpd.GeoDataFrame(geometry=[shapely.MultiLineString([points])], crs=table.crs)
    return pd.concat([table, line], ignore_index=True)


def test_tracks_edited_in_a_reviewed_plan_stand(folder: Path) -> None:
    """They were passed over, and gone with the next edit of the field in the overview."""
    farm = folder / "farm"
    file = _reviewed_edited(folder, "a", "segments", lambda t: t[t["track_no"] != 4])
    assert "reviewed/a.gpkg has edits" in _exported(folder)
    said = _batch(folder)
    assert "a as edited in reviewed/a.gpkg" in said
    for plan in (gf.read_plan(file), gf.read_farm(farm)["a"]):
        assert 4 not in set(plan.tracks.lines["track_no"])
    assert "as edited" not in _batch(folder)
    _sql(file, "ALTER TABLE segments ADD COLUMN note TEXT")
    _sql(file, "UPDATE segments SET note = 'wet' WHERE track_no = 2")
    assert "a as edited in reviewed/a.gpkg" in _batch(folder)
    segments = gf.read_farm(farm)["a"].tracks.segments
    assert set(segments["track_no"][segments["note"] == "wet"]) == {2}


def test_edits_of_a_reviewed_plan_are_not_written_over(folder: Path) -> None:
    farm = folder / "farm"
    file = _reviewed_edited(folder, "b", "segments", lambda t: t[t["track_no"] != 4])
    edited = file.read_bytes()
    for plan, status in ((farm / "farm.gpkg", "rejected"), (folder / "b.gpkg", "added")):
        _edit(folder, "obstacles", _third(status))
        said = " ".join(geofield("farm", "put", plan, farm, code=1).split())
        assert "reviewed/b.gpkg has edits that the farm does not hold yet" in said
        assert file.read_bytes() == edited
    geofield("farm", "put", file, farm)
    assert 4 not in set(gf.read_farm(farm)["b"].tracks.lines["track_no"])


def test_a_drawn_track_in_the_place_of_the_last_one(folder: Path) -> None:
    """The layer has as many rows as before, one of them without a number."""
    last = int(gf.read_farm(folder / "farm")["d"].tracks.lines["track_no"].max())
    x = gf.read_farm(folder / "farm")["d"].field.polygon.centroid.x

    def exchanged(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        kept = table[(table["field_id"] != "d") | (table["track_no"] != last)]
        return _drawn(kept, (x - 40, 5_300_010.0), (x + 40, 5_300_100.0))

    _edit(folder, "tracks", exchanged)
    assert "d as edited" in _batch(folder)
    lines = gf.read_farm(folder / "farm")["d"].tracks.lines.set_index("track_no")
    assert last not in lines.index
    assert lines.geometry.loc[last + 1].length > 100


@pytest.mark.parametrize("layer", ["obstacles", "tracks", "field"])
def test_a_layer_in_another_crs_is_refused(folder: Path, layer: str) -> None:
    """What was drawn there went to the first field, for its degrees lie in none."""
    before = gf.read_farm(folder / "farm").obstacles
    _edit(folder, layer, lambda table: table.to_crs(4326))
    farm = folder / "farm"
    for said in (
        _batch(folder, code=1),
        geofield("farm", "put", farm / "farm.gpkg", farm, code=1),
    ):
        assert f"layer '{layer}' is no longer in WGS 84 / UTM zone 33N" in " ".join(said.split())
    assert gf.read_farm(folder / "farm").obstacles.equals(before)


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        ("ALTER TABLE obstacles RENAME TO trees", "the layer 'obstacles' is gone"),
        ("DROP TABLE field", "the layer 'field' is gone"),
        ("DROP TABLE gpkg_metadata", "has no record of what geofield wrote"),
        ("DELETE FROM gpkg_metadata", "has no record of what geofield wrote"),
    ],
)
def test_an_overview_that_lost_a_part_is_told(folder: Path, statement: str, words: str) -> None:
    path = folder / "farm" / "farm.gpkg"
    _sql(path, statement)
    edited = path.read_bytes()
    said = " ".join(_batch(folder, code=1).split())
    assert words in said
    assert "out of the farm" in said
    assert "farm.gpkg has edits" in _exported(folder)
    assert path.read_bytes() == edited
    path.unlink()
    _batch(folder)
    assert path.is_file()


def test_what_is_no_word_is_told(folder: Path) -> None:
    _sql(folder / "farm" / "farm.gpkg", "DELETE FROM tracks WHERE field_id = 'c'")
    assert "no tracks are left of field c" in " ".join(_batch(folder).split())

    def shapeless(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        return table.set_geometry(table.geometry.where(table["obstacle_no"] != 3, None))

    _edit(folder, "obstacles", shapeless)
    said = " ".join(_batch(folder).split())
    assert "layer 'obstacles': 1 row has no shape and is counted as deleted: row " in said
    assert list(gf.read_farm(folder / "farm")["b"].obstacles["obstacle_no"]) == [4]


def test_columns_are_known_in_any_case(folder: Path) -> None:
    path = folder / "farm" / "farm.gpkg"
    _sql(path, "UPDATE obstacles SET status = 'rejected' WHERE obstacle_no = 3")
    _sql(path, "ALTER TABLE obstacles RENAME COLUMN status TO STATUS")
    assert "b as edited" in _batch(folder)
    assert list(gf.read_farm(folder / "farm")["b"].obstacles["status"]) == ["rejected", "added"]


def test_shapes_of_one_part_among_several_are_no_edit(folder: Path) -> None:
    for layer in ("field", "obstacles", "segments"):
        path = folder / "farm" / "farm.gpkg"
        table = pyogrio.read_dataframe(path, layer=layer)
        pyogrio.write_dataframe(table, path, layer=layer, promote_to_multi=True)
    assert "as edited" not in _batch(folder)


@pytest.mark.parametrize("how", ["reprojected", "begun elsewhere"])
def test_layers_that_were_saved_anew_are_no_edit(folder: Path, how: str) -> None:
    """All fields counted as edited and reviewed, and a plan taken out could not be put back."""
    mine = folder / "b.gpkg"
    geofield("farm", "get", folder / "farm", "b", "-o", mine)

    def turned(shape: Any) -> Any:
        ring = shape.exterior.coords[:-1]
        return shapely.Polygon([*ring[3:], *ring[:3]])

    def saved(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        if how == "reprojected":
            return table.to_crs(3857).to_crs(table.crs)
        return table.set_geometry([*map(turned, table.geometry)], crs=table.crs)

    layers = ["field", "obstacles"] + ["tracks", "segments"] * (how == "reprojected")
    for layer in layers:
        _edit(folder, layer, saved)
    geofield("farm", "put", mine, folder / "farm")
    assert "as edited" not in _batch(folder)
    reviewed = gf.read_farm(folder / "farm").status.set_index("field_id")["reviewed"]
    assert reviewed.to_dict() == {"a": False, "b": True, "c": False, "d": False}
    # What was edited besides is.
    for layer in layers:
        _edit(folder, layer, saved)
    _edit(folder, "obstacles", _tree_grown)
    said = _batch(folder)
    assert [one for one in "abcd" if f"{one} as edited" in said] == ["b", "c"]


@pytest.mark.parametrize("door", ["batch", "tracks"])
def test_a_refused_run_leaves_an_overview_of_what_it_took_in(folder: Path, door: str) -> None:
    """An edit that was taken back there was passed over without a word."""

    def with_8_m(fresh: bool, code: int) -> str:
        if door == "batch":
            return _batch(folder, "--spacing", 8, *["--fresh"] * fresh, code=code)
        trees = ("--obstacles", folder / "trees.gpkg")
        asked = ("tracks", folder / "parcels.gpkg", *trees, "--spacing", 8, "-o", folder / "farm")
        return geofield(*asked, *["--overwrite"] * fresh, code=code)

    _edit(folder, "obstacles", _third("rejected"))
    refused = with_8_m(fresh=False, code=1)
    assert "b as edited" in refused
    assert "farm of other work" in refused
    assert "or --fresh (of `geofield tracks` --overwrite)" in refused
    _edit(folder, "obstacles", _third("added"))
    assert "b as edited" in with_8_m(fresh=True, code=0)
    assert list(gf.read_farm(folder / "farm")["b"].obstacles["status"]) == ["added", "added"]


def test_an_edit_taken_back_before_the_overview_is_written_is_no_silence(folder: Path) -> None:
    path = folder / "farm" / "farm.gpkg"
    as_it_was, before = path.read_bytes(), gf.read_farm(folder / "farm").obstacles
    _edit(folder, "obstacles", _tree_grown)
    assert "as edited" in _batch(folder, "--no-overview")
    path.write_bytes(as_it_was)
    assert "was edited in farm.gpkg, and changed in the farm" in " ".join(
        _batch(folder, code=1).split()
    )
    geofield("farm", "put", path, folder / "farm")
    after = gf.read_farm(folder / "farm").obstacles
    assert after.geometry.area.to_list() == pytest.approx(before.geometry.area.to_list())
    assert "as edited" not in _batch(folder)


@pytest.mark.parametrize("door", ["page", "command", "python"])
def test_settings_said_of_a_field_stand_when_the_farm_is_planned_again(
    folder: Path, door: str
) -> None:
    """A reviewed field turned back from 0 degrees to 88 with the next --fresh, without a word."""
    file, farm_folder = folder / "reviewed" / "field.gpkg", folder / "farm"
    if door == "page":
        session = Session(gf.read_farm(farm_folder)["b"])
        said = {"direction": "30", "headland_m": 10, "spacing_m": 9}
        session.do({"do": "tracks", "settings": said})
        session.plan.write(file.parent, formats=["gpkg"])
    else:
        if door == "python":
            gf.read_farm(farm_folder)["b"].write(file.parent, formats=["gpkg"])
        else:
            file.parent.mkdir()
            geofield("farm", "get", farm_folder, "b", "-o", file)
            # What the farm is planned with meanwhile was said by nobody who had the plan.
            _batch(folder, "--fresh", "--min-segment", 9)
        geofield("tracks", file, "--spacing", 9, "--direction", 30, "--headland", 10,
                 "-o", file, "--overwrite")  # fmt: skip
    geofield("farm", "put", file, farm_folder)
    _batch(folder, "--fresh")
    farm = gf.read_farm(folder / "farm")
    tracks, settings = farm["b"].tracks, farm["b"].settings.tracks
    assert tracks.heading_deg == pytest.approx(30.0, abs=0.01)
    assert (settings.headland_m, settings.spacing_m) == (10.0, 6.0)
    assert settings.min_segment_m == farm["a"].settings.tracks.min_segment_m
    notes = farm.status.set_index("field_id")["notes"]
    assert "as set for this field: --direction 30, --headland 10" in notes["b"]
    assert "--spacing 6 as said now, no longer --spacing 9" in notes["b"]
    assert not notes["a"]
