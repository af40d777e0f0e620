"""Tracks at once for another program, by lines of JSON."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from geofield.errors import ChangedError
from geofield.formats import read_dataset
from geofield.pipeline import run_tracks
from geofield.plan import read_plan
from geofield.plan_files import save_plan
from geofield.review.desk import Desk
from geofield.review.live import LivePlans
from geofield.settings import Settings, TrackSettings
from geofield.tracks import route

GEOFIELD = Path(sys.executable).with_name("geofield")
SAMPLE = Path(__file__).parents[2] / "sample_data" / "field_1.gpkg"


@pytest.fixture
def plan(tmp_path):
    return Path(shutil.copy(SAMPLE, tmp_path / "field.gpkg"))


#: As QGIS does: the file stays open, and what is saved lies in the write-ahead log.
EDITOR = """
import sqlite3, sys
connection = sqlite3.connect(sys.argv[1], isolation_level=None)
for name in ("ST_IsEmpty", "ST_MinX", "ST_MaxX", "ST_MinY", "ST_MaxY"):
    connection.create_function(name, 1, lambda shape: 0)
connection.execute("PRAGMA journal_mode = WAL")
print("open", flush=True)
for line in sys.stdin:
    connection.execute("UPDATE obstacles SET status = ?", (line.strip(),))
    print("saved", flush=True)
"""


@contextmanager
def editor(path):
    """Another program that has a plan open; gives what sets the status of all obstacles."""
    command = [sys.executable, "-c", EDITOR, str(path)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "open\n"

        def save(status):
            process.stdin.write(f"{status}\n")
            process.stdin.flush()
            assert process.stdout.readline() == "saved\n"

        yield save
        process.kill()  # it crashes: the log is left


def rows_of(path, **changed):
    table = read_dataset(path).table("obstacles")
    rows = []
    for _, row in table.iterrows():
        values = {
            "obstacle_no": int(row["obstacle_no"]),
            "status": changed.get(f"no_{row['obstacle_no']}", row["status"]),
            "kind": row["kind"],
            "radius_m": float(row["radius_m"]),
            "buffer_m": float(row["buffer_m"]),
            "wkb": row.geometry.wkb_hex,
        }
        rows.append(values)
    return rows


def test_rejecting_what_stands_in_the_way_closes_gaps(plan):
    live = LivePlans()
    before = live.answer({"do": "plan", "file": str(plan)})
    rejected = {f"no_{row['obstacle_no']}": "rejected" for row in rows_of(plan)}
    question = {"do": "plan", "file": str(plan), "obstacles": rows_of(plan, **rejected)}
    after = live.answer(question)
    assert before["figures"]["tracks"] == after["figures"]["tracks"]
    assert len(after["segments"]) < len(before["segments"])
    assert after["figures"]["length_m"] > before["figures"]["length_m"]
    drawn = [*rows_of(plan), {"wkb": rows_of(plan)[0]["wkb"]}]  # no number, no status
    assert "error" not in live.answer({**question, "obstacles": drawn})


def test_tracks_after_an_edit_wait_for_no_route_and_saving_plans_it(plan, monkeypatch):
    tracks = TrackSettings(spacing_m=8, headland_m=8, route="shortest", turning_radius_m=3)
    routed = run_tracks(read_plan(plan), settings=Settings(tracks=tracks))
    save_plan(routed, plan, read_from=plan)
    live, asked = LivePlans(), []

    def routes(tracks, **settings):
        asked.append(settings["pattern"])
        return tracks

    monkeypatch.setattr(route, "plan_route", routes)
    answer = live.answer({"do": "plan", "file": str(plan), "obstacles": rows_of(plan)})
    assert asked == []
    assert len(answer["segments"]) == len(routed.tracks.segments)
    # With all their places, for they are bent.
    assert [len(each) for each in answer["headland_tracks"]] == [
        len(each.coords) for each in routed.tracks.headland_tracks.geometry
    ]
    live.answer({"do": "write", "file": str(plan)})
    assert asked == ["shortest"]
    assert read_plan(plan).settings.tracks.route == "shortest"


def test_the_command_answers_line_by_line_and_writes(plan):
    obstacles = rows_of(plan)
    questions = [
        {"do": "plan", "file": str(plan), "obstacles": obstacles},
        {"do": "nonsense"},
        {"do": "plan", "file": str(plan), "outline": "00"},
        {"do": "write", "file": str(plan)},
    ]
    text = "".join(json.dumps(each) + "\n" for each in questions) + "no json\n"
    done = subprocess.run(
        [GEOFIELD, "live", "--progress", "json"],
        input=text, capture_output=True, text=True, check=True, timeout=120,
    )  # fmt: skip
    first, nonsense, broken, written, last = map(json.loads, done.stdout.splitlines())
    assert first["segments"] == written["segments"]
    assert "nonsense" in nonsense["error"]["message"]
    assert "cannot be understood" in broken["error"]["message"]
    assert "error" in last
    lines = read_dataset(plan).table("segments")
    assert len(lines) == len(written["segments"])
    assert lines["length_m"].sum() == pytest.approx(written["figures"]["length_m"])


def test_edits_in_the_write_ahead_log_are_seen(plan):
    live, question = LivePlans(), {"do": "plan", "file": str(plan)}
    with editor(plan) as save:
        save("confirmed")
        before = live.answer(question)
        main = plan.read_bytes()
        save("rejected")
        assert plan.read_bytes() == main
        after = live.answer(question)
        assert len(after["segments"]) < len(before["segments"])


def test_a_session_does_not_write_over_a_write_ahead_log(plan):
    with editor(plan) as save:
        save("confirmed")
        desk = Desk(plan)
        save("rejected")
    desk.edit({"do": "move", "no": 1, "dx_m": 1.0, "dy_m": 0.0})
    with pytest.raises(ChangedError):
        desk.save()
    desk.reload()
    assert set(desk.session.plan.obstacles["status"]) == {"rejected"}
    # Reading folded the log into the file: that is no change by another program.
    desk.edit({"do": "move", "no": 1, "dx_m": 1.0, "dy_m": 0.0})
    assert desk.save()["saved_as"] == plan.name
