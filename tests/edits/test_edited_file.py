"""What a person did to a plan's file: what is kept, brought back, understood and refused."""

from __future__ import annotations

import re
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import geopandas as gpd
import pandas as pd
import pyogrio
import pytest
import shapely
from changed_plans import Frame, at, geofield, plan_in, rewritten, rows, run, shrunk

from geofield.simulate import SimulatedField
from geofield_command import run_geofield


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
    done = run_geofield("undo", folder / "out/field.gpkg")
    assert done.returncode == 1
    assert "no earlier plan" in done.stderr


def test_a_layer_that_is_gone_is_no_word(folder: Path, made: SimulatedField) -> None:
    file, rename = folder / "out/field.gpkg", "ALTER TABLE obstacles RENAME TO trees"
    found = shutil.copy(file, folder / "found.gpkg")
    subprocess.run(["ogrinfo", "-q", found, "-sql", rename], check=True)
    # Nobody's work: a search finds them again, but tracks ran through all of them.
    done = run_geofield("tracks", found, "-o", found)
    assert done.returncode == 1
    assert "`obstacles` of" in done.stderr
    assert "that were found" in done.stderr
    rewritten(file, "obstacles", lambda table: table[~at(table, 6)])
    geofield("tracks", file, "--spacing", 6, "-o", file)
    subprocess.run(["ogrinfo", "-q", file, "-sql", rename], check=True)
    written = file.read_bytes()
    where = ["--lat", made.lat, "--lon", made.lon]
    for stage in (
        ["tracks", file, "-o", file],
        ["obstacles", folder / "picture.tif", file, "-o", file],
        ["field", folder / "picture.tif", *where, "-o", file, "--overwrite"],
    ):
        done = run_geofield(*stage)
        assert done.returncode == 1
        assert "The layer `obstacles`" in done.stderr
        assert "geofield undo" in done.stderr
    assert file.read_bytes() == written


def test_an_import_can_be_undone(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    before = plan_in(folder)
    parcels = folder / "parcels.gpkg"
    gpd.read_file(file, layer="field").to_file(parcels)
    geofield("import", parcels, "-o", file, "--overwrite")
    assert plan_in(folder) != before
    geofield("undo", file)
    assert plan_in(folder) == before


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


def test_a_run_tells_which_settings_of_the_plan_give_way(
    folder: Path, made: SimulatedField
) -> None:
    """A direction said for the tracks alone was gone with the next run, without a word."""
    file = folder / "out/field.gpkg"
    geofield("tracks", file, "--direction", 30, "-o", file)
    told = run(folder, made, "--overwrite")
    assert "No longer as in the earlier plan: --direction 30. The defaults hold" in told
    assert "No longer" not in run(folder, made, "--overwrite")
    # Spacing and headland follow from what is said here.
    told = run(folder, made, "--width", 8, "--headland-passes", 2, "--overwrite")
    assert "No longer" not in told


def test_the_stages_behind_an_outline_go_on_with_the_settings_of_the_plan(
    folder: Path, made: SimulatedField
) -> None:
    file, picture = folder / "out/field.gpkg", folder / "picture.tif"
    geofield("obstacles", picture, file, "--buffer", 2.5, "-o", file)
    place = ["--lat", made.lat, "--lon", made.lon]
    geofield("field", picture, *place, "-o", file, "--overwrite")
    assert "--buffer 2.5\n" in geofield("obstacles", picture, file, "-o", file)
    assert "--spacing 6\n" in geofield("tracks", file, "-o", file)
    geofield("field", picture, *place, "-o", file, "--overwrite", "--fresh")
    assert "As the plan was made" not in geofield("tracks", file, "-o", file)


def test_a_layer_of_tracks_that_is_gone_is_planned_again(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("DROP TABLE gaps")
        for table in ("gpkg_contents", "gpkg_geometry_columns"):
            connection.execute(f"DELETE FROM {table} WHERE table_name = 'gaps'")
    assert plan_in(folder).tracks is None
    geofield("export", file, "-f", "html", "--out", folder / "page")
    geofield("tracks", file, "-o", file)
    tracks = plan_in(folder).tracks
    assert tracks is not None
    assert tracks.spacing_m == 6


def test_what_a_crash_left_in_the_log_is_no_other_program(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    crash = (
        "import os, sqlite3, sys; c = sqlite3.connect(sys.argv[1]); "
        "c.execute('PRAGMA journal_mode=WAL'); "
        "c.execute(\"UPDATE gpkg_contents SET description = 'mine'\"); c.commit(); os._exit(0)"
    )
    subprocess.run([sys.executable, "-c", crash, str(file)], check=True)
    assert file.with_name("field.gpkg-wal").stat().st_size > 0
    geofield("tracks", file, "--spacing", 12, "-o", file)
    tracks = plan_in(folder).tracks
    assert tracks is not None
    assert tracks.spacing_m == 12


def test_no_machine_is_steered_through_an_obstacle_drawn_since(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    drawn = plan_in(folder).field.polygon.representative_point().buffer(8.0)
    rock = gpd.GeoDataFrame(geometry=[drawn], crs=plan_in(folder).field.crs)
    rewritten(file, "obstacles", lambda table: pd.concat([table, rock]))
    export = ("export", file, "--out", folder / "x")
    done = run_geofield(*export, "-f", "geojson,isoxml")
    assert done.returncode == 1
    assert f"through obstacle {len(rows(plan_in(folder)))}" in done.stderr
    assert "`geofield tracks PLAN.gpkg -o PLAN.gpkg`" in done.stderr
    assert not (folder / "x").exists()
    # Who looks at a map may see it, and is told.
    assert "plan the tracks again" in geofield(*export, "-f", "geojson")
    rewritten(file, "obstacles", lambda table: table[table["obstacle_no"].notna()])
    # A fence is hardly wider than what ends of segments may be off.
    x, y = drawn.centroid.coords[0]
    fence = shapely.LineString([(x - 20, y - 15), (x + 20, y + 15)])
    wire = gpd.GeoDataFrame(geometry=[fence], crs=rock.crs)
    rewritten(file, "obstacles", lambda table: pd.concat([table, wire]))
    assert "through obstacle" in run_geofield(*export, "-f", "isoxml").stderr
    # So are tracks out of an outline that was drawn smaller.
    rewritten(file, "obstacles", lambda table: table[table["obstacle_no"].notna()])
    rewritten(file, "field", shrunk)
    (folder / "out/isoxml/TASKDATA").mkdir(parents=True)
    (folder / "out/isoxml/TASKDATA/TASKDATA.XML").touch()
    done = run_geofield("refresh", file)
    assert done.returncode == 1
    assert "out of the field" in done.stderr
    geofield("tracks", file, "-o", file)
    geofield("refresh", file)


def test_what_stands_where_machines_turn_is_told(tmp_path: Path) -> None:
    field = shapely.box(500000, 5600000, 500200, 5600100)
    parcel, file = tmp_path / "parcel.gpkg", tmp_path / "plan.gpkg"
    gpd.GeoDataFrame(geometry=[field], crs=32633).to_file(parcel)
    turning = ("--headland", 12, "--route", "boustrophedon", "--turning-radius", 3)
    geofield("tracks", parcel, "--spacing", 6, *turning, "-o", file)
    rock = gpd.GeoDataFrame(geometry=[shapely.box(499999, 5600030, 500010, 5600060)], crs=32633)
    pyogrio.write_dataframe(rock, file, layer="obstacles", append=True)
    export = ("export", file, "-f", "geojson,isoxml", "--out", tmp_path / "x", "--overwrite")
    # None of it goes to a terminal, so that nothing is refused.
    told = geofield(*export)
    assert "headland passes 1, 2 run through obstacle 1 and turns " in told
    found = run_geofield("validate", file).stderr
    assert "headland pass 2, segment 1: runs through" in found
    assert re.search(r"turn \d+: runs through", found)
    # A pass that was drawn has no number.
    drawn = gpd.GeoDataFrame(geometry=[shapely.LineString([(499900, 5600000), (500100, 5600050)])])
    pyogrio.write_dataframe(drawn.set_crs(32633), file, layer="headland_tracks", append=True)
    assert "headland pass that was drawn runs out of the field" in geofield(*export)


def test_columns_of_ones_own_keep_their_types_and_values(folder: Path) -> None:
    """Of all that an editor can add; most cells stay empty."""
    file = folder / "out/field.gpkg"
    own = {
        "cadastre": ("INTEGER", 1234567890123456789),
        "litres": ("REAL", 5.0),
        "sown": ("DATE", "2024-05-01"),
        "stamp": ("DATETIME", "2024-05-01T12:30:00.000Z"),
        "done": ("BOOLEAN", 1),
        "pic": ("BLOB", b"\x89PNG\x00\xff"),
        "code": ("TEXT", "007"),
    }
    layers = ("field", "obstacles", "tracks", "segments")
    with closing(sqlite3.connect(file)) as connection, connection:
        for function in ("IsEmpty", "MinX", "MaxX", "MinY", "MaxY"):
            connection.create_function(f"ST_{function}", 1, lambda shape: 0)
        for layer in layers:
            for name, (kind, _) in own.items():
                connection.execute(f"ALTER TABLE {layer} ADD COLUMN {name} {kind}")
            cells = ", ".join(f"{name} = ?" for name in own)
            first = f"(SELECT min(fid) FROM {layer})"
            values = [value for _, value in own.values()]
            connection.execute(f"UPDATE {layer} SET {cells} WHERE fid = {first}", values)
        connection.execute("ALTER TABLE tracks ADD COLUMN later TEXT")
        connection.execute("ALTER TABLE tracks ADD COLUMN geometry TEXT")
    told = geofield("tracks", file, "--spacing", 6, "-o", file)
    assert "Nothing stands in later of `tracks`" in told
    assert "the column 'geometry' of layer 'tracks' has the name of the shapes" in told
    geofield("tracks", file, "-o", file)
    with closing(sqlite3.connect(file)) as connection:
        for layer in layers:
            types = {row[1]: row[2] for row in connection.execute(f"PRAGMA table_info({layer})")}
            assert {name: types[name] for name in own} == {n: kind for n, (kind, _) in own.items()}
            (row,) = connection.execute(
                f"SELECT {', '.join(own)} FROM {layer} WHERE code IS NOT NULL"
            )
            assert row == tuple(value for _, value in own.values())
