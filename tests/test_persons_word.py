"""What a person changed in a plan stands, whichever program they used and whatever runs next."""

from __future__ import annotations

import json
import re
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pytest
import shapely
from shapely.affinity import translate

from geofield.crs import ground_scale_of
from geofield.plan import Plan, read_plan
from geofield.simulate import SimulatedField, SimulationSettings, simulate_field

Frame: TypeAlias = gpd.GeoDataFrame


def geofield(*args: object) -> str:
    """Run the command as a process; returns what it told on stderr."""
    command = [sys.executable, "-m", "geofield", *map(str, args)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stderr


@pytest.fixture(scope="module")
def made() -> SimulatedField:
    """A field with eleven trees."""
    return simulate_field(
        11, SimulationSettings(width_px=360, height_px=360, obstacles=11, climate="temperate")
    )


@pytest.fixture(scope="module")
def first(made: SimulatedField, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the picture and a run's products."""
    from geofield.imagery import write_scene

    folder = tmp_path_factory.mktemp("first")
    write_scene(made.scene, folder / "picture.tif")
    run(folder, made)
    return folder


def run(folder: Path, made: SimulatedField, *more: object) -> str:
    place = ["--lat", made.lat, "--lon", made.lon, "--out", folder / "out", "--spacing", 6]
    return geofield("run", folder / "picture.tif", *place, "--format", "gpkg", *more)


@pytest.fixture
def folder(first: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(first, tmp_path / "work"))


def plan_in(folder: Path) -> Plan:
    return read_plan(folder / "out/field.gpkg")


def rows(plan: Plan) -> Frame:
    assert plan.obstacles is not None
    return plan.obstacles.set_index("obstacle_no", drop=False)


def rewritten(file: Path, layer: str, change: Callable[[Frame], Frame], **how: object) -> None:
    """A layer as a program writes it that reads all of it: other layers stay."""
    table = change(gpd.read_file(file, layer=layer))
    table.to_file(file, layer=layer, driver="GPKG", geometry_name="geom", **how)


def rearranged(table: Frame) -> Frame:
    """The same shapes as some editors leave them: in parts, turned, begun elsewhere."""

    def other(shape: shapely.Polygon) -> shapely.MultiPolygon:
        ring = shape.exterior.coords[:-1]
        turned = [*ring[7:], *ring[:7]][::-1]
        return shapely.MultiPolygon([shapely.Polygon(turned, [r.coords for r in shape.interiors])])

    columns = [*reversed([name for name in table if name != "geometry"]), "geometry"]
    return table.set_geometry([other(s) for s in table.geometry], crs=table.crs)[columns]


def at(table: Frame, number: int) -> pd.Series[bool]:
    return table["obstacle_no"] == number


def edited(table: Frame) -> Frame:
    """Every kind of edit, each on a row of its own."""
    table = table[~at(table, 6)].copy()
    shapes = dict(zip(table["obstacle_no"], table.geometry, strict=True))
    table.loc[at(table, 1), "geometry"] = shapes[1].buffer(3)
    table.loc[at(table, 2), "geometry"] = translate(shapes[2], 1.5, 0)
    table.loc[at(table, 3), "status"] = " Confirmed"
    table.loc[at(table, 4), "radius_m"] += 2
    table.loc[at(table, 5), "buffer_m"] = 4.0
    table.loc[at(table, 7), "kind"] = "Other"
    table.loc[at(table, 8), "geometry"] = translate(shapes[8], 12, 9)
    table.loc[at(table, 9), "status"] = "possible"
    table["note"] = [f"row {n}" for n in table["obstacle_no"]]
    table["visits"] = np.arange(len(table))
    return table


def check(before: Frame, after: Frame) -> None:
    """All of :func:`edited` is still there."""
    area = after.geometry.area
    assert area[1] == pytest.approx(before.geometry[1].buffer(3).area, rel=1e-6)
    assert after["radius_m"][1] == pytest.approx(before["radius_m"][1] + 3, abs=0.01)
    shift = after.geometry[2].centroid.distance(before.geometry[2].centroid)
    assert shift == pytest.approx(1.5, abs=1e-6)
    assert area[4] == pytest.approx(
        before.geometry.area[4]
        * ((before["radius_m"][4] + 2 + before["buffer_m"][4]) ** 2)
        / ((before["radius_m"][4] + before["buffer_m"][4]) ** 2),
        rel=1e-4,
    )
    assert after["radius_m"][4] == pytest.approx(before["radius_m"][4] + 2)
    assert after["buffer_m"][5] == 4.0
    assert area[5] > before.geometry.area[5] * 1.5
    assert 6 not in after.index
    assert not after.geometry.intersects(before.geometry[6].centroid).any()
    assert after["kind"][7] == "other"
    shift = after.geometry[8].centroid.distance(before.geometry[8].centroid)
    assert shift == pytest.approx(15, abs=1e-6)
    assert not after.geometry.intersects(before.geometry[8].centroid).any()
    words = dict.fromkeys((1, 2, 3, 4, 5, 7, 8), "confirmed") | {9: "possible"}
    assert after["status"][list(words)].to_dict() == words
    for number in words:
        assert after["confidence"][number] == before["confidence"][number]
    assert after["lon"][2] != before["lon"][2]
    kept = [number for number in before.index if number != 6]
    assert after["note"][kept].tolist() == [f"row {number}" for number in kept]
    assert after["visits"][kept].tolist() == list(range(len(kept)))


@pytest.mark.parametrize("arrange", [lambda table: table, rearranged], ids=["plain", "rearranged"])
def test_every_edit_survives_every_stage(
    folder: Path, made: SimulatedField, arrange: Callable[[Frame], Frame]
) -> None:
    before = rows(plan_in(folder))
    assert len(before) >= 10
    file = folder / "out/field.gpkg"
    rewritten(file, "obstacles", lambda table: arrange(edited(table)))
    rewritten(
        file, "field", lambda table: table.assign(name="Long meadow", crop=["rye"], soil=[41])
    )
    told = run(folder, made, "--overwrite")
    once = plan_in(folder)
    count = len(before)
    said = f"outline as before; 8 obstacles of yours kept, {count - 9} found again, "
    assert said + "2 you took away not taken up again" in told
    assert len(json.loads((folder / "out/report.json").read_text())["changes"]) == 2
    check(before, rows(once))
    assert once.field.name == "Long meadow"
    geofield("obstacles", folder / "picture.tif", file, "-o", file)
    check(before, rows(plan_in(folder)))
    geofield("tracks", file, "--spacing", 6, "-o", file)
    twice = plan_in(folder)
    check(before, rows(twice))
    run(folder, made, "--overwrite")
    again = plan_in(folder)
    pd.testing.assert_frame_equal(rows(again), rows(once), rtol=0, atol=1e-9)
    for name in ("obstacles", "field"):
        types = gpd.read_file(file, layer=name).dtypes
        assert types["visits" if name == "obstacles" else "soil"].kind == "i"
    field = gpd.read_file(file, layer="field").iloc[0]
    assert (field["name"], field["crop"], field["soil"]) == ("Long meadow", "rye", 41)


def test_only_edited_rows_are_a_persons_word(folder: Path, made: SimulatedField) -> None:
    before = plan_in(folder)
    rewritten(folder / "out/field.gpkg", "obstacles", rearranged)
    run(folder, made, "--overwrite")
    after = plan_in(folder)
    assert set(rows(after)["status"]) <= {"detected", "possible"}
    assert rows(after).equals(rows(before))


def test_a_word_in_the_table_alone(folder: Path, made: SimulatedField) -> None:
    """As a database client writes it, with no geometry at hand."""
    before = rows(plan_in(folder))
    with closing(sqlite3.connect(folder / "out/field.gpkg")) as connection, connection:
        # GeoPackage's triggers ask every client for these.
        for function in ("IsEmpty", "MinX", "MaxX", "MinY", "MaxY"):
            connection.create_function(f"ST_{function}", 1, lambda shape: 0)
        for change in (
            "status = 'REJECTED' WHERE obstacle_no = 1",
            "status = NULL WHERE obstacle_no = 2",
            "status = 'maybe' WHERE obstacle_no = 3",
            "radius_m = 7 WHERE obstacle_no = 4",
        ):
            connection.execute(f"UPDATE obstacles SET {change}")
    told = run(folder, made, "--overwrite")
    assert "'maybe' is none of detected" in told
    after = rows(plan_in(folder))
    assert after["status"][[1, 2, 3, 4]].tolist() == [
        "rejected",
        "detected",
        "detected",
        "confirmed",
    ]
    assert after["radius_m"][4] == 7
    assert len(after) == len(before)


def test_deleting_and_drawing_there_again(folder: Path, made: SimulatedField) -> None:
    before = rows(plan_in(folder))
    file = folder / "out/field.gpkg"
    rewritten(file, "obstacles", lambda table: table[~at(table, 6)])
    run(folder, made, "--overwrite")
    assert len(plan_in(folder).obstacles) == len(before) - 1
    drawn = before.geometry[6].buffer(1, cap_style="square").envelope

    def draw(table: Frame) -> Frame:
        row = Frame({"buffer_m": [2.0]}, geometry=[drawn], crs=table.crs)
        return pd.concat([table, row], ignore_index=True)

    rewritten(file, "obstacles", draw)
    run(folder, made, "--overwrite")
    after = rows(plan_in(folder))
    (new,) = after[after["status"] == "added"].to_dict("records")
    # The safety margin that was typed grows what was drawn.
    grown = drawn.buffer(2 * ground_scale_of(drawn, after.crs), quad_segs=8)
    assert new["geometry"].area == pytest.approx(grown.area, rel=1e-6)
    assert new["geometry"].symmetric_difference(grown).area < 0.01
    assert len(after) == len(before)


def test_previous_in_python(folder: Path, made: SimulatedField) -> None:
    from geofield.pipeline import plan_field

    plan = plan_in(folder)
    before = rows(plan)
    assert plan.obstacles is not None
    plan.obstacles.loc[0, "geometry"] = plan.obstacles.geometry[0].buffer(3)
    plan = replace(plan, obstacles=plan.obstacles.drop(index=1))
    again = plan_field(
        made.scene, lat=made.lat, lon=made.lon, settings=plan.settings, previous=plan
    )
    after = rows(again)
    assert after.geometry[1].area == pytest.approx(before.geometry[1].buffer(3).area, rel=1e-6)
    assert 2 not in after.index


def test_a_plan_without_a_record_of_what_was_written(folder: Path, made: SimulatedField) -> None:
    """As the version before wrote it: detected circles tell by themselves what was changed."""
    before = rows(plan_in(folder))
    file = folder / "out/field.gpkg"

    def enlarge(table: Frame) -> Frame:
        table.loc[at(table, 1), "geometry"] = table.geometry[at(table, 1)].buffer(3)
        return table

    rewritten(file, "obstacles", enlarge)
    with closing(sqlite3.connect(file)) as connection, connection:
        done = connection.execute(
            "UPDATE gpkg_metadata SET metadata = json_remove(metadata, '$.evidence.written')"
        )
        assert done.rowcount == 1
    run(folder, made, "--overwrite")
    after = rows(plan_in(folder))
    assert after.geometry[1].area == pytest.approx(before.geometry[1].buffer(3).area, rel=1e-6)
    assert after["status"].tolist() == ["confirmed", *before["status"].tolist()[1:]]


def test_one_generation_back(folder: Path, made: SimulatedField) -> None:
    file = folder / "out/field.gpkg"
    first = plan_in(folder)
    rewritten(file, "obstacles", lambda table: table[~at(table, 6)])
    geofield("tracks", file, "--spacing", 9, "-o", file)
    assert plan_in(folder).tracks != first.tracks
    geofield("undo", file)
    # As the person left it, before the tracks were planned again.
    assert 6 not in rows(plan_in(folder)).index
    assert plan_in(folder).settings == first.settings
    geofield("undo", file)
    later = plan_in(folder)
    assert later.settings is not None
    assert later.settings.tracks.spacing_m == 9
    run(folder, made, "--overwrite")
    assert 6 not in rows(plan_in(folder)).index
    geofield("undo", file)
    assert plan_in(folder) == later


def test_nothing_to_undo(folder: Path) -> None:
    command = [sys.executable, "-m", "geofield", "undo", str(folder / "out/field.gpkg")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "no earlier plan" in done.stderr


def shrunk(table: Frame) -> Frame:
    return table.set_geometry(table.geometry.buffer(-6), crs=table.crs)


def test_a_drawn_outline_stands_above_the_boundary_given(
    folder: Path, made: SimulatedField
) -> None:
    """The same command again, after the outline was moved: the parcels' file says nothing new."""
    file = folder / "out/field.gpkg"
    parcels = folder / "parcels.gpkg"
    shrunk(gpd.read_file(file, layer="field")).assign(name="Parcel 7").to_file(parcels)
    own = ["--boundary", parcels, "--format", "gpkg", "--overwrite"]
    run(folder, made, *own)
    given = plan_in(folder).field
    assert (given.method, given.name) == ("boundary", "Parcel 7")
    rewritten(file, "field", lambda table: table.assign(name="Mine", crop="rye"))
    run(folder, made, *own)
    same = plan_in(folder).field
    assert same.polygon.equals(given.polygon)
    assert (same.name, dict(same.own)) == ("Mine", {"crop": "rye"})
    rewritten(file, "field", shrunk)
    moved = plan_in(folder).field.polygon
    told = run(folder, made, *own)
    assert "the boundary is not used" in told
    assert "your outline kept" in told
    run(folder, made, *own)
    kept = plan_in(folder).field
    assert kept.polygon.equals(moved)
    assert (kept.method, kept.name, dict(kept.own)) == ("drawn", "Mine", {"crop": "rye"})


def test_an_outline_of_which_nobody_recorded_how_it_was_written(
    folder: Path, made: SimulatedField
) -> None:
    """As ogr2ogr copies a GeoPackage: its tables alone."""
    file = folder / "out/field.gpkg"
    rewritten(file, "field", shrunk)
    moved = plan_in(folder).field.polygon
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("DELETE FROM gpkg_metadata")
    for what in ("lost the record", "your outline kept"):
        told = run(folder, made, "--overwrite")
        assert what in told
        assert plan_in(folder).field.polygon.equals(moved)


def test_a_border_that_crosses_itself(folder: Path, made: SimulatedField) -> None:
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    west, south, east, north = before.geometry[1].bounds
    bow = shapely.Polygon([(west, south), (east, north), (east, south), (west, north)])

    def cross(table: Frame) -> Frame:
        table.loc[at(table, 1), "geometry"] = bow
        return table

    rewritten(file, "obstacles", cross)
    run(folder, made, "--overwrite")
    after = rows(plan_in(folder))
    parts = after.geometry[[1, len(before) + 1]]
    assert parts.is_valid.all()
    assert parts.area.sum() == pytest.approx(shapely.make_valid(bow).area)
    assert after["radius_m"][parts.index].isna().all()
    assert after["status"][parts.index].tolist() == ["confirmed", "added"]


def test_a_layer_that_is_gone_is_no_word(folder: Path, made: SimulatedField) -> None:
    file = folder / "out/field.gpkg"
    rewritten(file, "obstacles", lambda table: table[~at(table, 6)])
    geofield("tracks", file, "--spacing", 6, "-o", file)
    subprocess.run(
        ["ogrinfo", "-q", file, "-sql", "ALTER TABLE obstacles RENAME TO trees"], check=True
    )
    written = file.read_bytes()
    where = ["--lat", made.lat, "--lon", made.lon]
    for stage in (
        ["tracks", file, "-o", file],
        ["obstacles", folder / "picture.tif", file, "-o", file],
        ["field", folder / "picture.tif", *where, "-o", file, "--overwrite"],
    ):
        command = [sys.executable, "-m", "geofield", *map(str, stage)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 1
        assert "The layer `obstacles`" in done.stderr
        assert "geofield undo" in done.stderr
    assert file.read_bytes() == written


def test_a_region_does_not_change_a_drawn_outline(folder: Path, made: SimulatedField) -> None:
    file = folder / "out/field.gpkg"
    rewritten(file, "field", shrunk)
    command = [sys.executable, "-m", "geofield", "field", str(folder / "picture.tif")]
    command += ["--lat", str(made.lat), "--lon", str(made.lon), "-o", str(file), "--overwrite"]
    done = subprocess.run([*command, "--region", "1"], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "no region changes it" in done.stderr


def test_an_import_can_be_undone(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    before = plan_in(folder)
    parcels = folder / "parcels.gpkg"
    gpd.read_file(file, layer="field").to_file(parcels)
    geofield("import", parcels, "-o", file, "--overwrite")
    assert plan_in(folder) != before
    geofield("undo", file)
    assert plan_in(folder) == before


def test_a_status_chosen_before_stands_when_the_shape_is_changed_later(folder: Path) -> None:
    from geofield.model.review import reconcile

    plan = plan_in(folder)
    table, written = plan.obstacles, plan.evidence.written
    assert table is not None
    table, written = reconcile(table.assign(status="possible"), written)
    moved = table.set_geometry([translate(s, 1.5) for s in table.geometry], crs=table.crs)
    after, written = reconcile(moved, written)
    assert set(after["status"]) == {"possible"}
    assert all(row.kept for row in written.rows)


def test_obstacles_of_several_parts(folder: Path, made: SimulatedField) -> None:
    """What an editor merged: the parts stay as they are, neither grown again nor made round."""
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    assert before["buffer_m"][2] > 0
    beside = shapely.box(0, 0, 4, 2)
    west, south, *_ = before.geometry[2].bounds
    both = shapely.MultiPolygon([before.geometry[2], translate(beside, west - 9, south)])

    def merge(table: Frame) -> Frame:
        table.loc[at(table, 2), "geometry"] = both
        return table

    rewritten(file, "obstacles", merge)
    for _ in range(2):
        run(folder, made, "--overwrite")
    after = rows(plan_in(folder))
    assert len(after) == len(before) + 1
    assert after.geometry[2].equals_exact(before.geometry[2], 1e-6)
    added = after.loc[len(before) + 1]
    assert added.geometry.area == pytest.approx(8.0)
    assert (added["status"], added["buffer_m"]) == ("added", before["buffer_m"][2])
    assert np.isnan(added["radius_m"])


def test_columns_in_another_case_are_the_same(folder: Path, made: SimulatedField) -> None:
    """For SQL `STATUS` is `status`; some programs write all names in capitals."""
    file = folder / "out/field.gpkg"

    def capitals(table: Frame) -> Frame:
        table.loc[at(table, 3), "status"] = "rejected"
        table["Note"] = "mine"
        return table.rename(columns={n: n.upper() for n in ("status", "radius_m", "obstacle_no")})

    rewritten(file, "obstacles", capitals)
    run(folder, made, "--overwrite")
    after = rows(plan_in(folder))
    assert after["status"][3] == "rejected"
    assert set(after["Note"]) == {"mine"}
    assert "STATUS" not in after


def test_an_empty_column_stays(folder: Path, made: SimulatedField) -> None:
    file = folder / "out/field.gpkg"

    def emptied(table: Frame) -> Frame:
        return table.assign(
            crop=pd.array([None], "string"), dose=[np.nan], sown=pd.to_datetime([None])
        )

    rewritten(file, "field", emptied)
    for _ in range(2):
        run(folder, made, "--overwrite")
    table = gpd.read_file(file, layer="field")
    assert table[["crop", "dose", "sown"]].isna().all(axis=None)
    assert (table["dose"].dtype.kind, table["sown"].dtype.kind) == ("f", "M")
    assert plan_in(folder) == plan_in(folder)


def test_what_a_person_keeps_beside_the_plan(folder: Path, made: SimulatedField) -> None:
    """Layers, tables, styles and projects of theirs in the plan's file outlive every stage."""
    file = folder / "out/field.gpkg"
    shape = plan_in(folder).field.polygon
    places = [shape.centroid, shape.representative_point()]
    lonlat = gpd.GeoDataFrame(
        {"what": ["stone", "é"]}, geometry=places, crs=plan_in(folder).field.crs
    )
    lonlat.to_crs("EPSG:3035").to_file(file, layer='my "stones"', driver="GPKG")
    pyogrio.write_dataframe(pd.DataFrame({"day": [1, 2, 3]}), file, layer="diary", driver="GPKG")
    with closing(sqlite3.connect(file)) as connection, connection:
        for layer, name, default in (
            ("obstacles", "Mine", 1),
            ('my "stones"', "S", 1),
            ("field", "F", 0),
        ):
            connection.execute(
                "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name, "
                "f_geometry_column, styleName, styleQML, useAsDefault) "
                "VALUES ('', '', ?, 'geom', ?, '<qgis/>', ?)",
                (layer, name, default),
            )
        connection.execute(
            "UPDATE layer_styles SET useAsDefault = styleName = 'Mine' "
            "WHERE f_table_name = 'obstacles'"
        )
        connection.execute("INSERT INTO qgis_projects VALUES ('harvest', x'00', x'01')")
    before = dump(file)
    told = run(folder, made, "--overwrite")
    assert "is not geofield's and takes no part in the plan" in told
    geofield("tracks", file, "--spacing", 5, "-o", file)
    assert dump(file) == before
    stones = gpd.read_file(file, layer='my "stones"', bbox=tuple(lonlat.to_crs(3035).total_bounds))
    assert stones["what"].tolist() == ["stone", "é"]
    # Other programs can go on with them: the index and its triggers are there.
    pyogrio.write_dataframe(lonlat.to_crs(3035), file, layer='my "stones"', append=True)
    assert len(gpd.read_file(file, layer='my "stones"')) == 4
    with closing(sqlite3.connect(file)) as connection:
        styles = connection.execute(
            "SELECT f_table_name, styleName, useAsDefault FROM layer_styles "
            "WHERE f_table_name IN ('field', 'obstacles', 'my \"stones\"') ORDER BY 1, 2"
        ).fetchall()
        assert connection.execute("SELECT name FROM qgis_projects").fetchall() == [
            ("field",),
            ("harvest",),
        ]
        assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert not connection.execute("PRAGMA foreign_key_check").fetchall()
    assert styles == [
        ("field", "F", 0), ("field", "Field", 1), ('my "stones"', "S", 1),
        ("obstacles", "Mine", 1), ("obstacles", "Obstacles", 0),
    ]  # fmt: skip


def dump(file: Path) -> dict[str, list[object]]:
    """All that a file holds beside the plan."""
    registers = ("contents", "extensions", "geometry_columns", "ogr_contents")
    theirs = "WHERE table_name IN ('diary', 'my \"stones\"')"
    with closing(sqlite3.connect(file)) as connection:
        found = {
            table: connection.execute(f'SELECT * FROM "{table}"').fetchall()
            for table in ('my ""stones""', "diary", 'rtree_my ""stones""_geom')
        }
        for register in registers:
            query = f"SELECT * FROM gpkg_{register} {theirs} ORDER BY 1"
            found[register] = connection.execute(query).fetchall()
    return found


def test_a_drawn_row_is_seen_before_anything_runs_again(folder: Path) -> None:
    """In a notebook: the plan as it is in the file, with an obstacle that has a shape alone."""
    file = folder / "out/field.gpkg"
    pole = gpd.GeoDataFrame(
        geometry=[plan_in(folder).field.polygon.representative_point().buffer(1.0)],
        crs=plan_in(folder).field.crs,
    )
    rewritten(file, "obstacles", lambda table: pd.concat([table, pole]))
    plan = plan_in(folder)
    page = plan.explore().save(folder / "plan.html").read_text()
    assert re.search(r'"status": ?"added"', page)
    found = plan.to_graph().query("SELECT ?o { ?o a gf:Obstacle }")
    assert len(found) == len(rows(plan))


def test_a_stage_goes_on_with_the_settings_of_the_plan(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    geofield("tracks", file, "--headland", 7, "--direction", 20, "-o", file)
    told = geofield("tracks", file, "--direction", 50, "-o", file)
    assert "As the plan was made: --spacing 6, --headland 7\n" in told
    tracks = plan_in(folder).tracks
    assert tracks is not None
    assert tracks.spacing_m == 6
    assert tracks.heading_deg == pytest.approx(50)
    assert tracks.headland is not None
    geofield("obstacles", folder / "picture.tif", file, "--buffer", 2.5, "-o", file)
    told = geofield("obstacles", folder / "picture.tif", file, "-o", file)
    assert "As the plan was made: --buffer 2.5\n" in told
    assert set(rows(plan_in(folder))["buffer_m"]) == {2.5}


def test_what_was_thought_of_an_outline_that_was_moved_is_not_told_again(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    rewritten(
        file,
        "field",
        lambda table: table.assign(doubts="something").set_geometry(
            [translate(table.geometry.iloc[0], 4, 0)], crs=table.crs
        ),
    )
    geofield("export", file, "-f", "geojson,report", "--out", folder / "x")
    row = gpd.read_file(folder / "x/geojson/field.geojson").iloc[0]
    assert row["method"] == "drawn"
    assert row[["certainty", "doubts"]].isna().all()
    report = json.loads((folder / "x/report.json").read_text())
    assert report["field"]["certainty"] is None


def test_what_was_confirmed_and_moved_later_is_not_found_where_it_was(
    folder: Path, made: SimulatedField
) -> None:
    file = folder / "out/field.gpkg"
    count = len(rows(plan_in(folder)))

    def confirmed(table: Frame) -> Frame:
        table.loc[at(table, 4), "status"] = "confirmed"
        return table

    def moved(table: Frame) -> Frame:
        table.loc[at(table, 4), "geometry"] = translate(
            table.loc[at(table, 4), "geometry"].iloc[0], 14, 9
        )
        return table

    rewritten(file, "obstacles", confirmed)
    run(folder, made, "--overwrite")
    rewritten(file, "obstacles", moved)
    for _ in range(2):
        run(folder, made, "--overwrite")
        assert len(rows(plan_in(folder))) == count
