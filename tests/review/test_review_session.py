"""Edits of a plan, undo and redo, and the journal that survives a kill."""

from __future__ import annotations

import json
import shutil
import sqlite3
from contextlib import closing, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
import shapely
from click.testing import CliRunner

from geofield.cli.main import cli
from geofield.cli.review import end_session
from geofield.errors import ChangedError, GeofieldError
from geofield.formats import read_dataset
from geofield.model.tracks import Tracks
from geofield.pipeline import run_tracks
from geofield.plan import Plan, read_plan
from geofield.plan_files import save_plan
from geofield.review import Session, apply_command
from geofield.review.desk import Desk
from geofield.review.plans import journal_path
from geofield.review.session import planned
from geofield.review.shelf import Shelf
from geofield.review.shown import tracks_of
from geofield.settings import with_values
from geofield.tracks import route
from geofield_command import run_geofield

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def plan(plan_path: Path) -> Plan:
    return read_plan(plan_path)


def row(plan: Plan, number: int):
    assert plan.obstacles is not None
    return plan.obstacles.set_index("obstacle_no").loc[number]


def test_a_rejected_obstacle_gives_its_track_back(plan: Plan) -> None:
    session = Session(plan)
    assert plan.tracks is not None
    before = plan.tracks.statistics
    lost = {loss.obstacle_no: loss.length_m for loss in before.losses}[8]
    session.do({"do": "status", "no": 8, "status": "rejected"})
    after = session.plan.tracks.statistics
    assert after.length_m > before.length_m + 0.9 * lost > before.length_m
    assert row(session.plan, 8)["status"] == "rejected"
    session.undo()
    assert session.plan.tracks.statistics.length_m == before.length_m
    session.redo()
    assert session.plan.tracks.statistics.length_m == after.length_m


def test_a_moved_obstacle_stands_where_it_was_put(plan: Plan) -> None:
    old = row(plan, 8)
    moved = row(Session(plan).do({"do": "move", "no": 8, "dx_m": 3.0, "dy_m": -2.0}).plan, 8)
    shift = np.subtract(moved.geometry.centroid.coords[0], old.geometry.centroid.coords[0])
    assert shift == pytest.approx([3.0, -2.0], abs=1e-6)
    assert moved["status"] == "confirmed"
    # The columns say the same place.
    assert plan.grid is not None
    assert moved["x_px"] - old["x_px"] == pytest.approx(3.0 / 0.6, abs=0.01)
    assert moved["lon"] > old["lon"]
    assert moved["lat"] < old["lat"]


def test_another_radius_grows_the_circle_and_its_margin_stays(plan: Plan) -> None:
    old = row(plan, 8)
    new = row(apply_command(plan, {"do": "radius", "no": 8, "radius_m": 7.0}), 8)
    assert new["radius_m"] == 7.0
    assert new["buffer_m"] == old["buffer_m"]
    assert new.geometry.area == pytest.approx(np.pi * (7.0 + old["buffer_m"]) ** 2, rel=0.005)
    assert new["radius_px"] / old["radius_px"] == pytest.approx(7.0 / old["radius_m"])


def test_an_obstacle_drawn_anew_is_avoided_as_drawn(plan: Plan) -> None:
    x, y = row(plan, 8).geometry.centroid.coords[0]
    ring = [[x - 3, y - 3], [x + 4, y - 2], [x + 2, y + 5]]
    session = Session(plan)
    session.do({"do": "reshape", "no": 8, "ring": ring})
    session.do({"do": "status", "no": 3, "status": "rejected"})  # planned once more
    drawn = row(session.plan, 8)
    assert drawn.geometry.symmetric_difference(shapely.Polygon(ring)).area < 1e-6
    assert (drawn["status"], drawn["kind"]) == ("confirmed", "other")
    assert np.isnan(drawn["radius_m"])


def test_what_a_person_draws_is_driven_around(plan: Plan) -> None:
    session = Session(plan)
    x, y = plan.field.polygon.representative_point().coords[0]
    session.do({"do": "circle", "x": x, "y": y, "radius_m": 5.0})
    session.do({"do": "polygon", "ring": [[x + 20, y], [x + 30, y], [x + 30, y + 8]]})
    after = session.plan
    assert after.obstacles is not None
    added = after.obstacles[after.obstacles["status"] == "added"]
    assert list(added["kind"]) == ["tree", "other"]
    assert after.tracks is not None
    drive = shapely.union_all(after.tracks.segments.geometry.to_numpy())
    assert drive.distance(shapely.Point(x, y)) >= 5.99
    for shape in added.geometry:
        assert drive.intersection(shape.buffer(-0.01)).length == 0


def test_deleting_forgets_what_a_person_drew_and_rejects_what_was_found(plan: Plan) -> None:
    x, y = plan.field.polygon.representative_point().coords[0]
    drawn = apply_command(plan, {"do": "circle", "x": x, "y": y, "radius_m": 3.0})
    assert drawn.obstacles is not None
    assert plan.obstacles is not None
    number = int(drawn.obstacles["obstacle_no"].max())
    gone = apply_command(drawn, {"do": "delete", "no": number})
    assert len(gone.obstacles) == len(plan.obstacles)  # type: ignore[arg-type]
    assert row(apply_command(plan, {"do": "delete", "no": 8}), 8)["status"] == "rejected"


def test_tracks_turn_with_a_dragged_line(plan: Plan) -> None:
    session = Session(plan)
    x, y = plan.field.polygon.representative_point().coords[0]
    session.do({"do": "direction", "a": [x, y], "b": [x + 50, y + 50]})
    assert session.plan.tracks is not None
    # North of the grid is not true north there, by less than two degrees.
    assert session.plan.tracks.heading_deg == pytest.approx(45.0, abs=2.0)


def test_an_outline_drawn_anew_keeps_what_was_cut_out_of_it(plan: Plan) -> None:
    """The pond was field again, without a word, while the map went on showing it."""
    field = plan.field.polygon
    middle = field.representative_point()
    pond, well = middle.buffer(9), shapely.Point(middle.x, middle.y - 40).buffer(4)
    cut: Any = field - pond - well
    session = Session(replace(plan, field=replace(plan.field, polygon=cut)))
    x0, y0, x1, y1 = pond.buffer(20).bounds
    corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
    assert not shapely.box(x0, y0, x1, y1).intersects(well)
    session.do({"do": "outline", "ring": corners})
    drawn = session.plan.field.polygon
    assert drawn.equals(shapely.box(x0, y0, x1, y1) - pond)
    assert session.plan.field.method == "drawn"
    # A border across the pond goes around it; one that leaves pieces only is refused.
    session.do({"do": "outline", "ring": [[middle.x, y0], [x1, y0], [x1, y1], [middle.x, y1]]})
    assert session.plan.field.polygon.disjoint(pond.buffer(-0.01))
    session.undo()
    y = middle.y
    with pytest.raises(GeofieldError, match="no single piece"):
        session.do({"do": "outline", "ring": [[x0, y - 2], [x1, y - 2], [x1, y + 2], [x0, y + 2]]})
    assert session.plan.field.polygon.equals(drawn)


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ({"do": "dance"}, "no edit"),
        ({"do": "outline", "rings": [[[0, 0], [90, 0], [90, 90]]]}, "outside the picture"),
        (
            {"do": "outline", "rings": [[[553430, 3881500], [553530, 3881500], [553530, 3881600]]]},
            "outside the picture",
        ),
        ({"do": "status", "no": 999, "status": "rejected"}, "no obstacle 999"),
        ({"do": "status", "no": 8, "status": "maybe"}, "no status"),
        ({"do": "status", "status": "rejected"}, "needs a value"),
        ({"do": "circle", "x": 0, "y": 0, "radius_m": 4}, "outside the picture"),
        ({"do": "radius", "no": 8, "radius_m": -1}, "outside 0.1 to 200"),
        ({"do": "radius", "no": 8, "radius_m": "wide"}, "not a number"),
        ({"do": "outline", "rings": [[[0, 0], [10, 10], [10, 0], [0, 10]]]}, "crosses itself"),
        ({"do": "outline", "rings": [[[0, 0], [10, 10]]]}, "three corners"),
        ({"do": "outline", "rings": "all"}, "no ring"),
        ({"do": "tracks", "settings": {"spacing_m": -2}}, "spacing_m"),
        ({"do": "tracks", "settings": {"spacing_m": 5000}}, "larger than the field"),
        ({"do": "tracks", "settings": {"colour": "red"}}, "no setting"),
        ({"do": "tracks", "settings": [1]}, "by their names"),
        ({"do": ["status"]}, "no edit"),
        ({"do": "status", "no": [8], "status": "rejected"}, "not a whole number"),
        ({"do": "delete", "no": True}, "not a whole number"),
        ({"do": "choose", "no": "two"}, "not a whole number"),
    ],
)
def test_bad_edits_are_refused_in_words_and_change_nothing(
    plan: Plan, command: dict[str, object], words: str
) -> None:
    session = Session(plan)
    before = session.step
    with pytest.raises(GeofieldError, match=words):
        session.do(command)
    assert session.step is before


def test_each_note_of_the_tracks_is_told_once(plan: Plan) -> None:
    """After an edit the page and QGIS told those of the planner twice."""
    step = Session(plan).do({"do": "tracks", "settings": {"headland_m": 6.5}})
    assert step.plan.tracks is not None
    notes = tracks_of(step.plan, step.notes)["notes"]
    assert sum("leaves a strip of 2.50 m" in note for note in notes) == 1


@pytest.mark.parametrize(
    "command",
    [
        {"do": "move", "no": 8, "dx_m": 3.0, "dy_m": -2.0},
        {"do": "radius", "no": 8, "radius_m": 7.0},
        {"do": "tracks", "settings": {"spacing_m": 7.0, "headland_m": 8.0}},
    ],
)
def test_what_is_shown_in_a_drag_are_the_tracks_of_its_end(
    plan: Plan, command: dict[str, object]
) -> None:
    session = Session(plan)
    shown = session.preview(command).tracks
    assert session.plan is plan
    made = session.do(command).plan.tracks
    assert shown is not None
    assert made is not None
    assert shown.segments.geometry.equals(made.segments.geometry)
    assert shown.statistics == made.statistics


def test_edits_come_back_after_a_kill(plan_path: Path) -> None:
    desk = Desk(plan_path)
    desk.edit({"do": "status", "no": 3, "status": "rejected"})
    desk.edit({"do": "move", "no": 8, "dx_m": 1.0, "dy_m": 0.0})
    desk.edit({"do": "status", "no": 4, "status": "confirmed"})
    desk.edit({"do": "undo"})
    # The process dies while it writes a line.
    with journal_path(plan_path).open("a", encoding="utf-8") as file:
        file.write('{"do": "sta')
    again = Desk(plan_path)
    assert again.brought_back == "4 edits of a session that ended without saving were brought back."
    assert again.session.plan == desk.session.plan
    again.save()
    # Killed after saving: nothing is left to be brought back.
    assert Desk(plan_path).brought_back is None
    assert not journal_path(plan_path).exists()
    saved = read_plan(plan_path)
    assert row(saved, 3)["status"] == "rejected"
    assert row(saved, 4)["status"] == "detected"
    assert row(saved, 8)["status"] == "confirmed"


def test_edits_are_made_again_on_another_version_where_they_fit(plan_path: Path) -> None:
    """They were put aside in a file that no command read."""
    desk = Desk(plan_path)
    x, y = desk.session.plan.field.polygon.representative_point().coords[0]
    desk.edit({"do": "status", "no": 3, "status": "rejected"})
    desk.edit({"do": "circle", "x": x, "y": y, "radius_m": 2.0})
    drawn = max(each["no"] for each in desk.opening()["obstacles"])
    desk.edit({"do": "radius", "no": drawn, "radius_m": 3.0})
    desk.edit({"do": "status", "no": 4, "status": "confirmed"})
    desk.edit({"do": "status", "no": 5, "status": "rejected"})
    desk.edit({"do": "undo"})
    # Killed here; then somebody else rejects one of these, and draws one that takes the number.
    other = apply_command(read_plan(plan_path), {"do": "status", "no": 4, "status": "rejected"})
    other = apply_command(other, {"do": "circle", "x": x + 20, "y": y, "radius_m": 1.0})
    save_plan(planned(other, None).plan, plan_path, read_from=plan_path)
    again = Desk(plan_path)
    told = str(again.brought_back)
    assert "3 of its 4 edits were made again" in told
    assert "Make these by hand: status: obstacle 4 is not there as it was. All are kept in" in told
    assert plan_path.with_name("field.gpkg.review.jsonl.1").read_text().count("\n") == 7
    plan = again.session.plan
    assert [row(plan, no)["status"] for no in (3, 4, 5)] == ["rejected", "rejected", "detected"]
    assert [row(plan, no)["radius_m"] for no in (drawn, drawn + 1)] == [1.0, 3.0]
    # They are noted anew.
    assert str(Desk(plan_path).brought_back).startswith("3 edits")


def test_the_same_plan_in_other_bytes_has_its_edits(plan_path: Path) -> None:
    Desk(plan_path).edit({"do": "status", "no": 3, "status": "rejected"})
    before = plan_path.read_bytes()
    with closing(sqlite3.connect(plan_path)) as file:  # as QGIS may
        file.execute("PRAGMA journal_mode=wal")
        file.execute("SELECT count(*) FROM obstacles")
    assert plan_path.read_bytes() != before
    assert str(Desk(plan_path).brought_back).startswith("1 edit of")


@pytest.mark.parametrize(("line", "left"), [(0, 0), (1, 0), (3, 2)])
def test_a_damaged_line_takes_no_other_along(plan_path: Path, line: int, left: int) -> None:
    """One damaged line deleted the notes of four edits without a word."""
    desk, numbers = Desk(plan_path), (3, 4, 5, 6)
    for number in numbers:
        desk.edit({"do": "status", "no": number, "status": "rejected"})
    notes = journal_path(plan_path)
    lines = notes.read_bytes().splitlines(keepends=True)
    lines[line] = lines[line][1:]
    notes.write_bytes(b"".join(lines))
    again = Desk(plan_path)
    assert "damaged" in str(again.brought_back)
    assert "field.gpkg.review.jsonl.1" in str(again.brought_back)
    assert plan_path.with_name("field.gpkg.review.jsonl.1").read_bytes() == b"".join(lines)
    statuses = [row(again.session.plan, number)["status"] for number in numbers]
    assert statuses == ["rejected"] * left + ["detected"] * (4 - left)
    assert str(Desk(plan_path).brought_back).startswith(f"{left} edits" if left else "None")


@pytest.mark.parametrize(
    "words",
    [("tracks", "{}", "-o", "{}"), ("export", "{}", "-f", "kml", "--out", "{}.kml"),
     ("refresh", "{}")],
)  # fmt: skip
def test_commands_tell_of_edits_that_were_not_saved(plan_path: Path, words: list[str]) -> None:
    desk = Desk(plan_path)
    desk.edit({"do": "status", "no": 3, "status": "rejected"})
    line = [word.format(plan_path) for word in words]
    told = " ".join(CliRunner().invoke(cli, line).output.split())
    assert f"Bring them back: geofield review {plan_path}" in told
    journal_path(plan_path).unlink()
    desk = Desk(plan_path)
    desk.edit({"do": "status", "no": 3, "status": "rejected"})
    desk.save()
    assert "not saved" not in CliRunner().invoke(cli, line).output


def test_a_session_that_loses_edits_does_not_end_well(plan_path: Path) -> None:
    first, second, third = Desk(plan_path), Shelf(plan_path), Shelf(plan_path)
    first.edit({"do": "status", "no": 3, "status": "rejected"})
    second.desk.edit({"do": "status", "no": 9, "status": "rejected"})
    with pytest.raises(GeofieldError, match="are lost"):
        end_session(second, plan_path)
    third.desk.edit({"do": "status", "no": 9, "status": "rejected"})
    third.desk.save("mine")
    assert third.end() == [f"Edits of {plan_path} were saved as mine.gpkg."]
    assert not third.lost


def test_a_file_that_another_program_changed_is_not_overwritten(plan_path: Path) -> None:
    desk = Desk(plan_path)
    desk.edit({"do": "status", "no": 3, "status": "rejected"})
    other = Desk(plan_path)
    other.session.do({"do": "status", "no": 5, "status": "confirmed"})
    other.save()
    with pytest.raises(ChangedError, match="Another program changed"):
        desk.save()
    assert row(read_plan(plan_path), 5)["status"] == "confirmed"
    assert desk.save("mine")["saved_as"] == "mine.gpkg"
    assert row(read_plan(plan_path.with_name("mine.gpkg")), 3)["status"] == "rejected"
    for name in ("../up", "a/b", "", ".hidden"):
        with pytest.raises(GeofieldError, match="no plain file name"):
            desk.save(name)
    with pytest.raises(GeofieldError, match="there already"):
        desk.save("mine")


def test_ground_that_was_clicked_is_obeyed_undone_and_remembered(plan_path: Path) -> None:
    desk = Desk(plan_path)
    before = desk.session.plan
    # Ground beyond the northern border, by the road.
    left, _, right, top = before.field.polygon.bounds
    place = [(left + right) / 2 + 60, top + 3]
    assert not before.field.polygon.covers(shapely.Point(place))
    desk.edit({"do": "ground", "place": place, "belongs": True})
    wider = desk.session.plan
    assert wider.field.polygon.covers(shapely.Point(place))
    assert wider.settings is not None
    assert len(wider.settings.field.include) == 1
    desk.edit({"do": "ground", "place": place, "belongs": False})
    assert not desk.session.plan.field.polygon.covers(shapely.Point(place))
    desk.edit({"do": "undo"})
    assert desk.session.plan.field.polygon.equals(wider.field.polygon)
    desk.save()
    saved = read_plan(plan_path)
    assert saved.field.polygon.covers(shapely.Point(place))
    # Nobody drew it: a later run searches again, with the same points.
    assert not saved.outline_edited
    assert saved.settings is not None
    assert saved.settings.field.include == wider.settings.field.include


def test_settings_of_the_page_stand_in_later_runs(plan_path: Path) -> None:
    """Tracks turned by hand turned back from 90.3 to 8.7 degrees with the next run."""
    desk = Desk(plan_path)
    said = {"direction": "30", "headland_m": 8, "spacing_m": 6}
    desk.edit({"do": "tracks", "settings": said})
    desk.edit({"do": "tracks", "settings": {"direction": "90.3"}})
    desk.save()
    sample = ROOT / "sample_data" / "field_1.tif"
    done = run_geofield(
        "run", sample, "--lat", "35.075373", "--lon", "33.531142", "--spacing", 4, "--format",
        "gpkg", "--overwrite", "--out", plan_path.parent, check=True,
    )  # fmt: skip
    again = read_plan(plan_path)
    assert again.tracks is not None
    assert again.settings is not None
    assert again.tracks.heading_deg == pytest.approx(90.3)
    assert (again.settings.tracks.headland_m, again.settings.tracks.spacing_m) == (8.0, 4.0)
    assert "as set for this field: --direction 90.3, --headland 8" in done.stderr
    assert "--spacing 4 as said now, no longer --spacing 6" in done.stderr
    # A word that a later command took back is none any more.
    assert set(again.evidence.said_tracks) == {"direction", "headland_m"}
    turned = run_tracks(again, settings=with_values(again.settings, direction="10"))
    assert turned.evidence.said_tracks == ("headland_m",)


def test_a_picture_of_another_place_is_told_and_not_shown(plan_path: Path, tmp_path: Path) -> None:
    """The map ended where that picture did: an empty page, without field and without a word."""
    away = tmp_path / "away.tif"
    with rasterio.open(plan_path.with_name("scene.tif")) as here:
        profile = {**here.profile, "driver": "GTiff", "crs": "EPSG:32610"}
        with rasterio.open(away, "w", **profile) as there:
            there.write(here.read())
    shown = Desk(plan_path, away).opening()
    assert shown["picture"] is None
    assert "away.tif is of another place" in shown["brought_back"]
    left, bottom, right, top = shown["bounds"]
    assert shapely.box(left, bottom, right, top).contains(read_plan(plan_path).field.polygon)


def test_a_picture_without_data_is_told(plan_path: Path) -> None:
    """All lay on blank ground, without a word."""
    scene = plan_path.with_name("scene.tif")
    with rasterio.open(scene) as here:
        profile = {**here.profile, "driver": "GTiff", "nodata": 0}
        blank = np.zeros_like(here.read())
    scene.unlink()
    with rasterio.open(scene, "w", **profile) as there:
        there.write(blank)
    desk = Desk(plan_path)
    assert desk.opening()["brought_back"] == "The picture scene.tif holds no data at this field."
    exported = desk.export("html")
    assert any("scene.tif holds no data" in note for note in exported["notes"])
    assert "data:image/" not in (plan_path.parent / exported["files"][0]).read_text()
    told = run_geofield("export", plan_path, "-f", "html", "--out", plan_path.parent / "e").stderr
    assert "The picture scene.tif holds no data" in told


def test_a_picture_that_is_cut_off_stops_no_review(plan_path: Path) -> None:
    """There was no page at all, and what a session before it had noted could not be reached."""
    Desk(plan_path).edit({"do": "status", "no": 3, "status": "rejected"})
    scene = plan_path.with_name("scene.tif")
    scene.write_bytes(scene.read_bytes()[:3000])
    shown = Desk(plan_path).opening()
    assert "The picture is not shown: The picture scene.tif cannot be" in shown["brought_back"]
    assert shown["brought_back"].startswith("1 edit of a session")
    assert shown["picture"] is None
    with pytest.raises(GeofieldError, match="truncated or damaged"):
        Desk(plan_path, scene)  # asked for by name


def test_tracks_of_which_nothing_is_known_are_told_to_be_planned_anew(plan_path: Path) -> None:
    """Those that had been imported were replaced by the first saving, without a word."""
    assert Desk(plan_path).opening()["brought_back"] is None
    back = plan_path.with_name("back.gpkg")
    folder = plan_path.with_name("kml")
    for words in (
        ["export", plan_path, "-f", "kml", "--out", folder],
        ["import", folder / "field.kml", "-o", back],
    ):
        done = run_geofield(*words)
        assert done.returncode == 0, done.stderr
    told = Desk(back).opening()["brought_back"]
    assert "back.gpkg has no record of how its tracks were planned" in told
    assert "to save replaces those in the file" in told


def test_another_outline_is_chosen(doubtful_path: Path) -> None:
    desk = Desk(doubtful_path)
    outlines = desk.session.plan.field.alternatives
    assert len(outlines) == 2
    desk.edit({"do": "choose", "no": len(outlines)})
    assert desk.session.plan.field.polygon.equals(outlines[-1].polygon)
    with pytest.raises(GeofieldError, match="no outline 9"):
        desk.edit({"do": "choose", "no": 9})
    desk.save()
    saved = read_plan(doubtful_path)
    assert (saved.field.method, saved.outline_edited) == ("chosen", False)
    # A point is a later word on an outline that was found.
    left, _, right, top = outlines[0].polygon.bounds
    desk.edit({"do": "ground", "place": [(left + right) / 2 + 60, top + 3], "belongs": True})
    assert desk.session.plan.field.method == "auto"


@pytest.mark.parametrize(
    ("method", "told"),
    [
        pytest.param("drawn", "drawn by hand", id="drawn"),
        pytest.param("boundary", "a parcel of your own", id="parcel"),
    ],
)
def test_a_click_at_the_ground_loses_no_outline_of_a_persons_own(
    plan_path: Path, method: str, told: str
) -> None:
    """A corner moved by hand was back where the search had it after a click elsewhere."""
    if method == "boundary":
        plan = read_plan(plan_path)
        given = replace(plan.field, method=method, quality=None, alternatives=())
        save_plan(replace(plan, field=given), plan_path, read_from=plan_path)
    desk = Desk(plan_path)
    (x, y), *rest = desk.session.plan.field.polygon.exterior.coords[:-1]
    if method == "drawn":
        desk.edit({"do": "outline", "rings": [[[x + 5, y - 6], *rest]]})
    before = desk.opening()
    assert before["field"]["method"] == method
    middle = desk.session.plan.field.polygon.centroid
    place = [0.9 * x + 0.1 * middle.x, 0.9 * y + 0.1 * middle.y]
    with pytest.raises(GeofieldError, match=told):
        desk.edit({"do": "ground", "place": place, "belongs": False})
    assert desk.opening() == before


def test_what_was_saved_can_be_undone_also_after_a_kill(plan_path: Path) -> None:
    desk = Desk(plan_path)
    desk.edit({"do": "status", "no": 3, "status": "rejected"})
    desk.save()
    desk.edit({"do": "status", "no": 4, "status": "confirmed"})
    desk.save()
    desk.edit({"do": "status", "no": 5, "status": "confirmed"})
    for _ in range(3):
        desk.edit({"do": "undo"})
    assert row(desk.session.plan, 3)["status"] == "detected"
    assert desk.session.edited
    again = Desk(plan_path)
    assert str(again.brought_back).startswith("4 edits")
    assert again.session.plan == desk.session.plan
    assert again.session.edited
    for _ in range(2):
        again.edit({"do": "redo"})
    assert not again.session.edited
    assert again.session.plan == read_plan(plan_path)
    again.edit({"do": "undo"})
    again.save()
    saved = read_plan(plan_path)
    assert (row(saved, 3)["status"], row(saved, 4)["status"]) == ("rejected", "detected")
    again.end()
    left = {path.name for path in plan_path.parent.iterdir()}
    assert left == {"field.gpkg", "field.gpkg.bak", "field.qgz", "scene.tif"}


def test_an_edit_that_the_disk_does_not_take_is_kept_and_noted_later(plan_path: Path) -> None:
    desk = Desk(plan_path)
    desk.edit({"do": "status", "no": 3, "status": "rejected"})
    noted = journal_path(plan_path).read_bytes()
    journal_path(plan_path).unlink()
    journal_path(plan_path).mkdir()
    state = desk.edit({"do": "status", "no": 4, "status": "confirmed"})
    assert "directory" in state["unnoted"].lower()
    statuses = {each["no"]: each["status"] for each in state["obstacles"]}
    assert (statuses[3], statuses[4]) == ("rejected", "confirmed")
    with pytest.raises(GeofieldError, match="would be lost"):
        desk.reload()
    journal_path(plan_path).rmdir()
    journal_path(plan_path).write_bytes(
        noted + b'{"do": "st'
    )  # half of a line, as a full disk leaves
    assert desk.edit({"do": "status", "no": 5, "status": "confirmed"})["unnoted"] is None
    again = Desk(plan_path)
    assert str(again.brought_back).startswith("3 edits")
    assert again.session.plan == desk.session.plan


@pytest.mark.parametrize("killed", [False, True])
def test_half_a_copy_of_the_opened_plan_stops_no_review(
    plan_path: Path, monkeypatch: pytest.MonkeyPatch, killed: bool
) -> None:
    def half(source: Path, target: Path) -> None:
        target.write_bytes(source.read_bytes()[:500_000])
        raise OSError(28, "No space left on device")

    desk = Desk(plan_path)
    desk.edit({"do": "status", "no": 3, "status": "rejected"})
    monkeypatch.setattr(shutil, "copyfile", half)
    with pytest.raises(GeofieldError, match="No space left"):
        desk.save()
    monkeypatch.undo()
    if killed:
        with suppress(OSError):
            half(plan_path, desk.journal.opened)
    desk.save()
    desk.edit({"do": "status", "no": 4, "status": "rejected"})
    # Killed here.
    again = Desk(plan_path)
    assert [row(again.session.plan, number)["status"] for number in (3, 4)] == ["rejected"] * 2


def test_notes_that_are_gone_are_written_again(plan_path: Path) -> None:
    """A session whose notes another one had forgotten told that they lie there; they were gone."""
    first = Desk(plan_path)
    first.edit({"do": "status", "no": 3, "status": "rejected"})
    second = Desk(plan_path)
    second.edit({"do": "status", "no": 4, "status": "rejected"})
    assert first.edit({"do": "status", "no": 5, "status": "rejected"})["unnoted"]
    second.save()
    assert second.end() is None
    # What both said is no conflict.
    told = first.reload()["brought_back"]
    assert "2 of your 2 edits were made again" in told
    journal_path(plan_path).unlink()
    assert "lie in" in str(first.end())
    plan = Desk(plan_path).session.plan
    assert [row(plan, no)["status"] for no in (3, 4, 5)] == ["rejected"] * 3


def test_notes_follow_a_plan_that_was_renamed(plan_path: Path) -> None:
    Desk(plan_path).edit({"do": "status", "no": 3, "status": "rejected"})
    # Killed here. Notes of a plan that is still there are its own.
    copy = shutil.copy(plan_path, plan_path.with_name("Kopie.gpkg"))
    assert Desk(Path(copy)).brought_back is None
    renamed = plan_path.rename(plan_path.with_name("Nord.gpkg"))
    assert str(Desk(renamed).brought_back).startswith("1 edit of")
    assert not journal_path(plan_path).exists()


def test_edits_without_notes_can_be_left_when_they_were_saved_elsewhere(plan_path: Path) -> None:
    first, second = Desk(plan_path), Desk(plan_path)
    second.edit({"do": "status", "no": 4, "status": "rejected"})
    assert first.edit({"do": "status", "no": 5, "status": "rejected"})["unnoted"]
    with pytest.raises(GeofieldError, match="would be lost"):
        first.reload()
    first.save("mine")
    first.reload()
    assert [row(first.session.plan, no)["status"] for no in (4, 5)] == ["rejected", "detected"]


def test_a_second_session_on_a_plan_takes_no_notes_of_the_first_away(plan_path: Path) -> None:
    first, second, idle = Desk(plan_path), Desk(plan_path), Desk(plan_path)
    for number in (3, 4):
        first.edit({"do": "status", "no": number, "status": "rejected"})
    told = second.edit({"do": "status", "no": 9, "status": "rejected"})["unnoted"]
    assert "another review of this plan" in told
    idle.end()
    assert first.edit({"do": "status", "no": 5, "status": "rejected"})["unnoted"] is None
    assert "are lost" in str(second.end())
    # The first one is killed here.
    assert str(Desk(plan_path).brought_back).startswith("3 edits")


def test_a_plan_edited_elsewhere_opens_with_tracks_of_what_it_holds(plan_path: Path) -> None:
    assert Desk(plan_path).opening()["brought_back"] is None
    with closing(sqlite3.connect(plan_path)) as file, file:
        triggers = file.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'").fetchall()
        for (trigger,) in triggers:
            file.execute(f'DROP TRIGGER "{trigger}"')
        file.execute("UPDATE obstacles SET obstacle_no = NULL, status = NULL WHERE obstacle_no = 3")
        file.execute(
            "UPDATE obstacles SET kind = NULL, status = NULL, radius_m = NULL, buffer_m = NULL "
            "WHERE obstacle_no = 4"
        )
        file.execute("DELETE FROM obstacles WHERE obstacle_no > 10")
    desk = Desk(plan_path)
    opening = desk.opening()
    json.dumps(opening, allow_nan=False)  # a browser reads no NaN
    assert len(opening["obstacles"]) == 10
    assert {row["status"] for row in opening["obstacles"]} <= {"detected", "confirmed", "added"}
    assert "planned anew" in opening["brought_back"]
    again = planned(read_plan(plan_path), None).plan.tracks
    assert again is not None
    assert opening["figures"]["length_m"] == pytest.approx(again.statistics.length_m, abs=0.01)
    assert not desk.save()["edited"]
    assert desk.end() is None
    assert Desk(plan_path).opening()["brought_back"] is None


def test_edits_are_saved_elsewhere_while_another_program_holds_the_file(plan_path: Path) -> None:
    desk = Desk(plan_path)
    desk.edit({"do": "status", "no": 3, "status": "rejected"})
    with closing(sqlite3.connect(plan_path)) as other:
        other.execute("BEGIN EXCLUSIVE")
        with pytest.raises(GeofieldError, match="open in another program"):
            desk.save()
        assert desk.save("mine")["saved_as"] == "mine.gpkg"
    mine = plan_path.with_name("mine.gpkg")
    assert row(read_plan(mine), 3)["status"] == "rejected"
    assert read_dataset(mine).scene_path == plan_path.with_name("scene.tif")


def test_exports_show_the_picture_and_do_not_replace_those_of_another_plan(
    plan_path: Path, tmp_path: Path
) -> None:
    (folder := tmp_path / "several").mkdir()
    for name in ("scene.tif", "field.gpkg", "other.gpkg"):
        source = plan_path.with_name(name) if name != "other.gpkg" else plan_path
        shutil.copy(source, folder / name)
    shelf = Shelf(folder)
    assert "gpkg" not in [name for name, _ in shelf.desk.opening()["formats"]]
    first = shelf.desk.export("shapefile")
    assert first["files"] == ["export/field/shapefile"]
    assert "cannot carry gaps" in first["notes"][0]
    pages = []
    for picture in (None, plan_path.with_name("scene.tif"), folder / "scene.tif"):
        desk = Desk(folder / "other.gpkg", picture)
        (page,) = desk.export("html")["files"]
        pages.append((folder / page).read_text())
        assert desk.export("shapefile")["files"] == ["export/other/shapefile"]
    assert all("data:image/" in page for page in pages)
    assert (folder / "export" / "field" / "shapefile" / "guidance.shp").exists()


def test_what_the_page_exports_is_what_the_command_does(plan_path: Path) -> None:
    """Linked data had another IRI of the dataset, the report no picture."""
    desk = Desk(plan_path)
    desk.edit({"do": "status", "no": 3, "status": "rejected"})
    desk.edit({"do": "move", "no": 7, "dx_m": 4.0, "dy_m": -2.5})
    desk.save()
    names = ["ntriples", "report", "map-svg", "dxf", "agopengps", "study-xml", "shapefile"]
    for name in names:
        desk.export(name)
    desk.end()
    out = plan_path.parent / "command"
    run_geofield("export", plan_path, "-f", ",".join(names), "--out", out, check=True)
    files = [file for file in sorted(out.rglob("*")) if file.is_file()]
    assert len(files) > 20
    for file in files:
        own = plan_path.parent / "export" / "field" / file.relative_to(out)
        assert own.read_bytes() == file.read_bytes(), file


def test_an_export_does_not_replace_another_whose_files_are_called_alike(plan_path: Path) -> None:
    plain, study = "export/field/obstacles.rdf", "export/field/rdf-study"
    folder, desk = plan_path.parent, Desk(plan_path)
    for _ in range(2):
        assert plain in desk.export("rdf")["files"]
        content = (folder / plain).read_bytes()
        assert desk.export("rdf-study")["files"] == [study]
        assert (folder / plain).read_bytes() == content
    assert b"DLC.org" in (folder / study / "obstacles.rdf").read_bytes()


def test_edits_wait_for_no_route_and_what_is_written_has_it(
    plan_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With 300 obstacles each edit took 11 s, for a route that the next edit forgot."""
    asked, plan_route = [], route.plan_route

    def counted(*given: Any, **settings: Any) -> Tracks:
        asked.append(settings["pattern"])
        return plan_route(*given, **settings)

    monkeypatch.setattr(route, "plan_route", counted)
    desk = Desk(plan_path)
    first = desk.edit({"do": "tracks", "settings": {"route": "boustrophedon"}})
    assert (len(asked), bool(first["route"]), first["route_waits"]) == (1, True, False)  # asked for
    edit = {"do": "status", "no": 3, "status": "rejected"}
    desk.preview(edit)
    told = desk.edit(edit)
    assert (len(asked), told["route"], told["route_waits"]) == (1, [], True)
    assert desk.export("geojson")["state"]["route_waits"] is False
    assert (plan_path.parent / "export/field/geojson/route.geojson").exists()
    assert desk.edit({"do": "undo"})["route"] == first["route"]
    redone = desk.edit({"do": "redo"})
    assert (len(asked), redone["route_waits"]) == (2, False)  # it was planned for the export
    whole = planned(desk.session.plan, None).plan
    desk.edit({**edit, "no": 4})
    desk.edit({"do": "undo"})
    saved = desk.save()
    assert (saved["route"], saved["edited"]) == (redone["route"], False)
    assert read_plan(plan_path) == whole
    desk.edit({**edit, "no": 6})
    desk.save()
    desk.edit({"do": "undo"})
    saved = desk.save()
    desk.edit({**edit, "no": 5})
    planned_before = len(asked)
    # Killed here: what was saved last is as it was, what was not waits again.
    again = Desk(plan_path)
    assert (len(asked) - planned_before, again.opening()["route_waits"]) == (2, True)
    back = again.edit({"do": "undo"})
    assert (back["route"], back["edited"]) == (saved["route"], False)
    again.edit({"do": "redo"})
    again.save("mine")
    mine = read_plan(plan_path.with_name("mine.gpkg"))
    assert mine == planned(mine, None).plan
    assert mine.settings is not None
    assert (mine.settings.tracks.route, mine.evidence.said_tracks) == ("boustrophedon", ("route",))


def test_what_lies_in_the_file_is_not_written_again(plan_path: Path) -> None:
    """The earlier plan, which `geofield undo` brings back, gave way to the same one."""
    desk, kept = Desk(plan_path), plan_path.with_name("field.gpkg.bak")
    desk.edit({"do": "status", "no": 3, "status": "rejected"})
    desk.save()
    earlier = kept.read_bytes()
    assert desk.save()["saved_as"] == "field.gpkg"
    assert kept.read_bytes() == earlier
    # Tracks that are shown and do not lie in the file are not saved yet.
    save_plan(replace(desk.session.plan, tracks=None), plan_path, read_from=plan_path)
    again = Desk(plan_path)
    assert (again.opening()["edited"], Shelf(plan_path).noted) == (True, False)
    again.save()
    assert read_plan(plan_path).tracks == again.session.plan.tracks
    assert again.end() is None
