"""The plugin under Qt 6, as far as it goes without a QGIS that is built for it."""

from __future__ import annotations

import json
import os
import subprocess

import pytest
from plugin_place import CLIENT, PLUGINS, tiny_engine

from real_qgis import PYTHON

ENGINE = """
import json, sys
if sys.argv[1] == "--version":
    print("geofield, version 0.1.0")
elif sys.argv[1] == "count":
    for done in range(3):
        told = {"progress": {"done": done, "total": 2, "what": "counting"}}
        print(json.dumps(told), file=sys.stderr)
    print(json.dumps({"counted": 2}))
else:
    print(json.dumps({"error": {"message": "No field.", "hint": "Click in one."}}), file=sys.stderr)
    sys.exit(1)
"""
OLD = "from qgis.PyQt.QtCore import Qt\nshift = Qt.ShiftModifier\nkey = Qt.Key.Key_R\n"


def test_what_the_plugin_asks_of_qt_is_in_qt_6(tmp_path):
    environment = {
        "QT_QPA_PLATFORM": "offscreen",
        "HOME": str(tmp_path),
        "XDG_RUNTIME_DIR": str(tmp_path),
        "PATH": "/usr/bin:/bin",
        "LC_ALL": "C.UTF-8",
        "PIP_FIND_LINKS": str(tmp_path),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    there = [PYTHON, "-c", "import PyQt6.QtWidgets"]
    if subprocess.run(there, env=environment, capture_output=True, check=False).returncode:
        if os.environ.get("CI"):
            pytest.fail("PyQt6 is missing: apt-get install python3-pyqt6")
        pytest.skip("needs PyQt6: apt-get install python3-pyqt6")
    _, locked = tiny_engine(tmp_path, ENGINE)
    requirements = tmp_path / "requirements.txt"
    requirements.write_text(locked)
    asked = {"plugins": PLUGINS, "requirements": requirements, "folder": tmp_path, "old": OLD}
    done = subprocess.run(
        [PYTHON, CLIENT.with_name("with_qt6.py"), json.dumps(asked, default=str)],
        env=environment,
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    answer = json.loads(done.stdout.splitlines()[-1])
    assert "geofield_qgis.window" in answer["imported"]
    assert answer["asked"] > 30
    assert answer["missing"] == []
    assert answer["of_old"] == ["old.py: Qt.ShiftModifier"]
    work = answer["work"]
    assert work["qt"].startswith("6.")
    assert "is not there" in work["before"]
    assert work["after"].startswith("Ready: "), work["log"]
    assert work["progress"] == [[0, 2, "counting"], [1, 2, "counting"], [2, 2, "counting"]]
    assert work["end"] == {"counted": 2}
    assert work["why"] == "No field. Click in one."
