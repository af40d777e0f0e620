"""What a person changed in the obstacles stands, whatever program they used and runs next."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from changed_plans import Frame, at, geofield, plan_in, rewritten, rows, run, there_and_back
from shapely.affinity import translate

from geofield.crs import ground_scale_of
from geofield.errors import FormatWarning
from geofield.simulate import SimulatedField
from geofield_command import run_geofield


def rearranged(table: Frame) -> Frame:
    """The same shapes as some editors leave them: in parts, turned, begun elsewhere."""

    def other(shape: shapely.Polygon) -> shapely.MultiPolygon:
        ring = shape.exterior.coords[:-1]
        turned = [*ring[7:], *ring[:7]][::-1]
        return shapely.MultiPolygon([shapely.Polygon(turned, [r.coords for r in shape.interiors])])

    columns = [*reversed([name for name in table if name != "geometry"]), "geometry"]
    return table.set_geometry([other(s) for s in table.geometry], crs=table.crs)[columns]


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
    said += "1 you confirmed not found (8), "  # it was moved to where nothing stands
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


@pytest.mark.parametrize("arrange", [rearranged, there_and_back])
def test_only_edited_rows_are_a_persons_word(
    folder: Path, made: SimulatedField, arrange: Callable[[Frame], Frame]
) -> None:
    before = plan_in(folder)
    rewritten(folder / "out/field.gpkg", "obstacles", arrange)
    told = geofield("tracks", folder / "out/field.gpkg", "-o", folder / "out/field.gpkg")
    assert "obstacles" not in told
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
            "kind = 'Baum' WHERE obstacle_no > 5 AND obstacle_no < 10",
        ):
            connection.execute(f"UPDATE obstacles SET {change}")
    told = run(folder, made, "--overwrite")
    assert "'maybe' is none of detected" in told
    assert "and 3 more: kind 'Baum' is none of tree, other" in told
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
    grown = drawn.buffer(2 * ground_scale_of(drawn, after.crs), quad_segs=500)
    assert new["geometry"].area == pytest.approx(grown.area, rel=5e-5)
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


def test_a_border_that_crosses_itself(folder: Path, made: SimulatedField) -> None:
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    west, south, east, north = before.geometry[1].bounds
    corners = [(west, south), (east, north), (east, south), (west, north)]
    bow = shapely.Polygon([*corners, (west - 1, north), corners[-1]])  # with a spur

    def cross(table: Frame) -> Frame:
        table.loc[at(table, 1), "geometry"] = bow
        return table

    rewritten(file, "obstacles", cross)
    run(folder, made, "--overwrite")
    after = rows(plan_in(folder))
    assert len(after) == len(before) + 1
    parts = after.geometry[[1, len(before) + 1]]
    assert parts.is_valid.all()
    assert parts.area.sum() == pytest.approx(shapely.make_valid(bow).area)
    assert after["radius_m"][parts.index].isna().all()
    assert after["status"][parts.index].tolist() == ["confirmed", "added"]


def test_a_status_chosen_before_stands_when_the_shape_is_changed_later(folder: Path) -> None:
    from geofield.model.review import reconcile

    plan = plan_in(folder)
    table, written = plan.obstacles, plan.evidence.written
    assert table is not None
    table, written = reconcile(table.assign(status="possible"), written)
    moved = table.set_geometry([translate(s, 1.5) for s in table.geometry], crs=table.crs)
    with pytest.warns(FormatWarning, match=r"All 11 .* by up to 1\.5 m"):
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


def test_a_size_typed_for_a_copy_or_beside_another_shape_counts(folder: Path) -> None:
    """As in QGIS: copied, pasted, moved, and typed over; each row's shape is of its columns."""
    from geofield.model.review import reconcile

    plan = plan_in(folder)
    table, written = rows(plan).reset_index(drop=True), plan.evidence.written
    radius, margin = (float(table.loc[at(table, 2), n].iloc[0]) for n in ("radius_m", "buffer_m"))
    assert margin > 0
    shape = table.loc[at(table, 2), "geometry"].iloc[0]
    copies = [table[at(table, 2)].assign(geometry=translate(shape, 15 * n)) for n in (1, 2, 3)]
    table = pd.concat([table, *copies], ignore_index=True)
    wide, far, _ = table.index[-3:]
    table.loc[wide, "radius_m"] = 6.0
    table.loc[far, "buffer_m"] = 6.0
    table.loc[at(table, 3), "geometry"] = [shapely.box(0, 0, 5, 4)]
    table.loc[at(table, 3), "buffer_m"] += 2
    (file := folder / "edited.gpkg").unlink(missing_ok=True)
    table.to_file(file)
    after, _ = reconcile(gpd.read_file(file), written, plan.grid)
    after = after.set_index("obstacle_no")
    last = int(after.index.max())
    sizes = after.loc[[last - 2, last - 1, last], ["radius_m", "buffer_m"]].to_numpy()
    assert sizes == pytest.approx(np.array([[6, margin], [radius, 6], [radius, margin]]))
    areas = (
        after.geometry.area.loc[[last - 2, last - 1, last]] / ground_scale_of(shape, table.crs) ** 2
    )
    assert areas.to_numpy() == pytest.approx(np.pi * sizes.sum(axis=1) ** 2, rel=0.01)
    grown = 2 * float(ground_scale_of(shapely.box(0, 0, 5, 4), table.crs))
    round_cornered = 5 * 4 + 2 * (5 + 4) * grown + np.pi * grown**2
    assert after.geometry.area[3] == pytest.approx(round_cornered, rel=2e-4)
    assert np.isnan(after["radius_m"][3])


def test_a_row_copied_in_place_is_no_further_obstacle(folder: Path) -> None:
    """What a copy says is said of its original; both stood, and "rejected" did nothing."""
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))

    def paste(table: Frame) -> Frame:
        table.loc[at(table, 4), "status"] = "confirmed"
        table["mine"] = "as it was"
        copies = table[table["obstacle_no"].isin([1, 2, 3, 4])].copy()
        copies.loc[at(copies, 1) | at(copies, 4), "status"] = "Rejected"
        copies.loc[at(copies, 1), ["mine", "obstacle_no"]] = ["seen", None]
        copies.loc[at(copies, 2), "radius_m"] = 7.0
        return pd.concat([table, copies])

    rewritten(file, "obstacles", paste)
    told = geofield("tracks", file, "-o", file)
    assert (
        "(obstacle 1): what was changed in one of them holds (status rejected, mine seen)" in told
    )
    assert "(obstacle 2): what was changed in one of them holds (radius_m 7.0)" in told
    assert "(obstacle 3): they are alike and count once" in told
    assert "(obstacle 4): they contradict each other (status confirmed; status rejected)" in told
    after = rows(plan_in(folder))
    assert after.index.tolist() == before.index.tolist()
    assert after["status"][[1, 2, 3, 4]].tolist() == [
        "rejected",
        "confirmed",
        before["status"][3],
        "confirmed",
    ]
    assert after["radius_m"][2] == 7.0
    assert after["mine"][[1, 2]].tolist() == ["seen", "as it was"]
    assert "Rows copied in place" not in geofield("tracks", file, "-o", file)


def test_numbers_that_none_can_have(folder: Path) -> None:
    """They stood, as numbers that a person gave, and what was detected became added."""
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))

    def numbered(table: Frame) -> Frame:
        numbers = table["obstacle_no"].replace({1: -5, 2: 10**12}).astype("Int64")
        table["obstacle_no"] = numbers.mask(numbers == 3)
        drawn = table[at(table, -5)].assign(obstacle_no=0)
        return pd.concat([table, drawn.set_geometry(drawn.translate(15), crs=table.crs)])

    rewritten(file, "obstacles", numbered)
    told = geofield("tracks", file, "-o", file)
    assert "obstacle_no -5, 0, 1000000000000 is no whole number from 1 to" in told
    after = rows(plan_in(folder))
    assert after.index.tolist() == [*before.index, before.index.max() + 1]
    assert after["status"][before.index].equals(before["status"])
    assert after.geometry[before.index].geom_equals_exact(before.geometry, 1e-3).all()


def test_points_and_lines_drawn_among_the_obstacles_are_avoided(folder: Path) -> None:
    """Of another program, whose table takes any shape: none is lost, each has a width."""
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    middle = plan_in(folder).field.polygon.representative_point()
    x, y = middle.x, middle.y
    fence = shapely.LineString([(x - 30, y - 12), (x + 20, y + 9)])
    flat = shapely.Polygon([(x, y - 20), (x + 8, y - 12), (x + 4, y - 16)])
    drawn = [middle, translate(middle, 20, -20), fence, translate(fence, 0, 9), flat]

    def draw(table: Frame) -> Frame:
        table.loc[at(table, 1), "geometry"] = translate(before.geometry[1].centroid, 3)
        table.loc[at(table, 2), "geometry"] = before.geometry[2].centroid
        more = {"radius_m": [4.0, None, None, None, None], "buffer_m": [1.0, None, None, 2.0, None]}
        return pd.concat([table, gpd.GeoDataFrame(more, geometry=drawn, crs=table.crs)])

    rewritten(file, "obstacles", draw)
    found = run_geofield("validate", file).stderr
    assert "row 12: is a point: a circle of radius_m (2 m where empty) and buffer_m" in found
    assert "row 14: is a line: a strip of radius_m (at least 0.05 m) and buffer_m" in found
    assert "runs through an obstacle that was drawn" in found
    told = geofield("tracks", file, "-o", file)
    assert "One point among the obstacles without radius_m: taken for circles of 2 m" in told
    assert "among the obstacles without buffer_m: taken for strips of 0.1 m" in told
    plan = plan_in(folder)
    after = rows(plan)
    assert after["status"][[1, 2]].tolist() == ["confirmed", "detected"]
    assert after.geometry[1].equals_exact(translate(before.geometry[1], 3), 0.01)
    new = after[after.index > len(before)]
    assert set(new["status"]) == {"added"}
    assert new["radius_m"].tolist()[:2] == [4.0, 2.0]
    size = float(ground_scale_of(fence, new.crs))
    assert new.geometry.area.iloc[0] == pytest.approx(np.pi * (5 * size) ** 2, rel=0.01)
    strip = translate(fence, 0, 9).buffer(2.05 * size)
    assert new.geometry.iloc[3].hausdorff_distance(strip) < 0.02
    assert plan.tracks is not None
    driven = shapely.union_all(plan.tracks.segments.geometry)
    assert all(new.geometry.intersects(shape).any() for shape in drawn)
    assert not any(driven.intersects(shape) for shape in drawn)


def test_a_table_that_lost_its_columns_is_known_by_its_shapes(
    folder: Path, made: SimulatedField
) -> None:
    """Every row was new, and what was deleted was found again; a status of before was no word."""
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))

    def bare(table: Frame) -> Frame:
        table.loc[at(table, 1), "status"] = "rejected"
        table.loc[at(table, 2), "geometry"] = before.geometry[2].buffer(3)
        return table[~at(table, 6)][["status", "geometry"]]

    rewritten(file, "obstacles", bare)
    told = run(folder, made, "--overwrite")
    assert "has no column obstacle_no, kind, radius_m, buffer_m any more" in told
    after = rows(plan_in(folder))
    kept = [number for number in before.index if number != 6]
    assert sorted(after.index) == kept
    assert after["status"][[1, 2]].tolist() == ["rejected", "confirmed"]
    assert set(after["status"][kept[2:]]) == set(before["status"][kept[2:]])
    same = ["kind", "radius_m", "buffer_m"]
    assert after.loc[kept[2:], same].equals(before.loc[kept[2:], same])

    rewritten(file, "obstacles", lambda table: table.rename(columns={"status": "state"}))
    assert "no column status any more" in geofield("tracks", file, "-o", file)
    assert rows(plan_in(folder))["status"][1] == "rejected"
