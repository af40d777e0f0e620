"""Edits made in a farm's overview are kept: by batch, by put, with tracks planned again."""

from __future__ import annotations

import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import geopandas as gpd
import pyogrio
import pytest
import shapely
import shapely.affinity

import geofield as gf

SIDE_M = 120.0


def geofield(*arguments: object, code: int = 0) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "geofield", *map(str, arguments)],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
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
    columns = {row[1] for row in sqlite3.connect(path).execute(f"PRAGMA table_info({layer})")}
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
    pyogrio.write_dataframe(fields.assign(sown="May"), path, layer="field", geometry_name="geom")
    _edit(folder, "obstacles", _tree_grown)
    for more in ((), ("--fresh",)):
        said = _batch(folder, *more)
        assert "columns sown of layer 'field' are not the farm's" in said or more
        kept = pyogrio.read_dataframe(path, layer="notes")[["text", "geometry"]]
        assert kept.equals(notes[["text", "geometry"]])


def _sql(path: Path, statement: str) -> None:
    subprocess.run(["ogrinfo", "-q", path, "-sql", statement], check=True, capture_output=True)


def _parcels(folder: Path, change: Callable[[gpd.GeoDataFrame], gpd.GeoDataFrame]) -> None:
    change(gpd.read_file(folder / "parcels.gpkg")).to_file(folder / "parcels.gpkg")


def test_names_and_columns_of_a_person_stay_with_other_settings(folder: Path) -> None:
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
    _edit(folder, "obstacles", _tree_grown)
    _batch(folder)

    def moved(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        shapes = table.geometry.to_numpy(copy=True)
        shapes[1] = shapely.affinity.translate(shapes[1], 0, 3000)
        shapes[2] = shapely.affinity.scale(shapes[2], 0.9, 1)
        return table.set_geometry(gpd.GeoSeries(shapes, crs=table.crs))

    _parcels(folder, moved)
    _batch(folder, "--fresh")
    status = gf.read_farm(folder / "farm").status.set_index("field_id")
    assert status["status"].to_dict() == {"a": "done", "b": "failed", "c": "done", "d": "done"}
    assert "reviewed as 'b' is of a field elsewhere" in status["error"]["b"]
    assert status["notes"]["c"] == (
        "The reviewed outline stands; that of the places differs by 0.14 ha."
    )


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
