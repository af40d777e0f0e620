"""One click and a review by keys in QGIS's real window, under a display of its own."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import shapely
from plugin_place import CLIENT, SAMPLE, tiny_engine

from geofield.crs import LONLAT, transformer
from geofield.formats import read_dataset
from geofield.plan import read_plan

SCRIPT = CLIENT.with_name("in_window.py")
INI = """[PythonPlugins]
geofield_qgis=true
processing=true

[qgis]
showTips=false
enableVersionCheck=false
"""


def in_window(script, environment, folder, variables=None, **asked):
    """What a script saw in the window of a QGIS with a profile of its own."""
    if shutil.which("xvfb-run") is None or not Path("/usr/bin/qgis").exists():
        if os.environ.get("CI"):
            pytest.fail("a display is missing: apt-get install qgis xvfb xauth")
        pytest.skip("needs QGIS and a display: apt-get install qgis xvfb xauth")
    profile = folder / "p" / "profiles" / "default" / "QGIS"
    profile.mkdir(parents=True)
    (profile / "QGIS3.ini").write_text(INI)
    place = {"picture": str(SAMPLE), "lat": 35.075373, "lon": 33.531142, "folder": str(folder)}
    (folder / "asked.json").write_text(json.dumps({**place, **asked}))
    environment = {name: value for name, value in environment.items() if name != "QT_QPA_PLATFORM"}
    done = subprocess.run(
        [
            "xvfb-run", "-a", "-s", "-screen 0 1440x900x24", "/usr/bin/qgis", "--nologo",
            "--noversioncheck", "--profiles-path", folder / "p", "--code", script,
        ],
        env={
            **environment,
            "GEOFIELD_TEST": str(folder / "asked.json"),
            "PYTHONPATH": str(script.parent),
            **(variables or {}),
        },
        capture_output=True,
        text=True,
        timeout=540,
        check=False,
    )  # fmt: skip
    assert (folder / "answer.json").exists(), done.stderr[-3000:]
    answer = json.loads((folder / "answer.json").read_text())
    assert "error" not in answer, answer["error"]
    return answer


@pytest.fixture(scope="module")
def seen(qgis_environment, tmp_path_factory):
    """What the window showed and did, see in_window.py."""
    return in_window(SCRIPT, qgis_environment, tmp_path_factory.mktemp("window"))


def test_from_no_engine_to_the_first_map_in_four_clicks(qgis_environment, tmp_path):
    """What was clicked waits for the engine, and is planned as soon as that is there."""
    command = str(Path(sys.executable).with_name("geofield"))
    _, locked = tiny_engine(
        tmp_path, f"import os, sys\nos.execv({command!r}, [{command!r}, *sys.argv[1:]])"
    )
    requirements = tmp_path / "requirements.txt"
    requirements.write_text(locked)
    answer = in_window(
        CLIENT.with_name("first_map.py"),
        qgis_environment,
        tmp_path,
        {"PATH": "/usr/bin:/bin", "PIP_FIND_LINKS": str(tmp_path)},
        requirements=str(requirements),
    )
    assert answer["engine_before"] is None
    assert answer["waits"] == [True, False]
    assert answer["clicks"] == ["tool", "field", "engine", "install"]
    assert answer["engine"].endswith("/geofield/engine/bin/geofield")
    assert not answer["dialog_open"]
    assert {"Field", "Obstacles", "Tracks"} <= set(answer["layers"])
    assert len(read_plan(answer["plan"]).tracks.lines) > 10


def test_a_click_plans_the_field(seen):
    assert seen["project_crs"] == "EPSG:3857"
    assert 3.5 < seen["area_ha"] < 3.8
    (layers,) = seen["groups"].values()
    assert layers.index("Obstacles") < layers.index("Tracks") < layers.index("Field")
    # Four seconds on a machine that has nothing else to do.
    assert seen["outline_s"] < 60.0


def test_keys_confirm_reject_undo_and_redo(seen):
    assert seen["count_before"] == f"{len(seen['before'])} left to look at"
    assert sorted(seen["decided"].values()) == ["confirmed", "rejected"]
    # The third decision was undone by the layer's own undo.
    assert seen["changed"] == sorted(int(number) for number in seen["decided"])
    assert seen["undo_steps"] == 3
    # It is shown again, and the title says that something is not saved.
    assert seen["undone"] == [seen["third"], "Review of a field *"]
    assert seen["redone"] == ["rejected", "Redo  (Ctrl+Shift+Z)"]
    assert seen["replan_s"] < 15.0  # one on a machine that has nothing else to do


def test_keys_resize_move_and_draw(seen):
    assert seen["larger"] == [pytest.approx(0.25), True, "confirmed"]
    assert seen["moved"][1] > 1.0
    assert seen["drawn"] == 1


def test_saving_plans_again_in_the_open_file(seen):
    saved = seen["saved"]
    assert seen["unsaved"]
    assert seen["while_writing"] == [False, False]
    assert seen["after_writing"]
    assert saved["messages"] == []
    assert saved["provider"] == "ogr"
    assert saved["renderer"] == "QgsRuleBasedRenderer"
    assert saved["rows"] == len(seen["before"]) + 1
    assert sorted(saved["statuses"].values()).count("added") == 1
    for number, status in seen["decided"].items():
        assert saved["statuses"][number] == status
    assert saved["statuses"][str(seen["moved"][0])] == "confirmed"


def test_the_panel_tells_what_the_engine_tells(seen):
    doubts, figures, again = seen["told"]
    assert doubts.strip() == "Hazy."
    assert figures.splitlines()[1:] == ["A strip is left."]
    assert again


def test_a_whole_review_by_keys(seen):
    presses, wall_s = seen["by_keys"]
    assert seen["count_after"].startswith("0 left to look at")
    assert wall_s / presses < 2.0  # thirty in a minute
    statuses = read_dataset(Path(seen["plan"])).table("obstacles")["status"]
    assert not statuses.isin(["detected", "possible"]).any()


def test_shift_adds_ground_and_keeps_what_was_said(seen):
    assert seen["again"] == seen["plan"]
    assert seen["layers_again"] == 1
    plan = read_plan(Path(seen["again"]))
    (place,) = plan.settings.field.include
    assert place == pytest.approx((33.531442, 35.075673), abs=1e-5)
    # What stands where a person saw it stays; the outline may have brought others in.
    assert set(plan.obstacles["status"]) >= {"confirmed", "rejected", "added"}


def test_alt_takes_ground_away(seen):
    assert seen["without"] == seen["plan"]
    plan = read_plan(Path(seen["without"]))
    (place,) = plan.settings.field.exclude
    assert place == pytest.approx(seen["west"], abs=1e-5)
    crs = plan.field.crs
    west = shapely.Point(transformer(LONLAT, crs).transform(*seen["west"]))
    assert not plan.field.polygon.contains(west)
    assert seen["outline_again_s"] < 60.0


def test_the_dialogue_of_batch_mode(seen):
    spacings_m = [
        read_plan(next(Path(place).glob("*.gpkg"))).tracks.spacing_m for place in seen["batch"]
    ]
    assert spacings_m == [5.0, 9.0]


def test_nothing_is_left_after_unloading(seen):
    assert seen["after_reload"] == [1, 1]
    assert seen["after_unload"] == [0, 0]
    assert not seen["engine_left"]
