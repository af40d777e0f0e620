"""What a program sees of the command line: lines of JSON, a clean stop, a description."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from geofield.settings import SECTIONS, Settings

GEOFIELD = Path(sys.executable).with_name("geofield")


@pytest.fixture
def started(tmp_path):
    """Start a command as a program does that watches it; its pipes are closed afterwards."""
    processes = []

    def start(*words):
        process = subprocess.Popen(
            [GEOFIELD, *words, "--progress", "json"],
            cwd=tmp_path,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        processes.append(process)
        return process

    yield start
    for process in processes:
        process.kill()
        process.communicate()


def told(lines):
    return [json.loads(line) for line in lines if line.startswith("{")]


def test_progress_is_told_in_lines(started):
    process = started("simulate", "--fields", "3", "--out", "sim")
    text = process.stderr.read()
    assert process.wait(300) == 0
    progress = [each["progress"] for each in told(text.splitlines()) if "progress" in each]
    assert [each["done"] for each in progress] == [1, 2, 3]
    assert all(each["total"] == 3 and each["what"] for each in progress)


@pytest.mark.parametrize("how", ["stdin", pytest.param("SIGTERM", marks=pytest.mark.slow)])
def test_a_stopped_command_leaves_nothing(started, tmp_path, how):
    process = started("simulate", "--fields", "400", "--out", "sim")
    for line in process.stderr:
        if line.startswith('{"progress"'):
            break
    begun = time.monotonic()
    if how == "stdin":
        process.stdin.close()
        process.stdin = None
    else:
        process.send_signal(signal.SIGTERM)
    assert process.wait(30) == 1
    assert time.monotonic() - begun < 10.0  # two on a machine that has nothing else to do
    assert "Stopped" in process.stderr.read()
    assert list(tmp_path.iterdir()) == []


def test_errors_are_told_with_what_helps(started, tmp_path):
    (tmp_path / "text.gpkg").write_text("no plan")
    process = started("tracks", "text.gpkg", "-o", "out.gpkg")
    text = process.stderr.read()
    assert process.wait(60) == 1
    (error,) = [each["error"] for each in told(text.splitlines()) if "error" in each]
    assert "text.gpkg" in error["message"]


def test_every_setting_is_described(tmp_path):
    done = subprocess.run(
        [GEOFIELD, "settings", "--json"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    described = json.loads(done.stdout)
    rows = {(row["section"], row["name"]): row for row in described["settings"]}
    assert set(rows) == {
        (section, name)
        for section in SECTIONS
        for name in Settings.model_fields[section].annotation.model_fields
    }
    assert all(row["description"] for row in rows.values())
    assert rows["tracks", "spacing_m"]["default"] == 2.0
    assert rows["tracks", "spacing_m"]["above"] == 0
    assert rows["tracks", "curve"]["choices"] == ["dubins", "reeds_shepp"]
    for command, about in described["commands"].items():
        for each in about["parameters"]:
            assert "setting" in each or each["description"], (command, each)
    run = described["commands"]["run"]["parameters"]
    assert {"setting": "tracks.spacing_m"} in run
    named = {each["name"]: each for each in run if "name" in each}
    assert (named["lat"]["option"], named["lat"]["required"]) == ("--lat", False)
    assert (named["out"]["option"], named["out"]["required"]) == ("--out", True)
