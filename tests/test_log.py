"""A log file says what a command did, and keeps secrets to itself."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
GEOFIELD = Path(sys.executable).with_name("geofield")


def geofield(*words: object) -> subprocess.CompletedProcess[str]:
    line = [str(each) for each in (GEOFIELD, *words)]
    return subprocess.run(line, capture_output=True, text=True, check=False, cwd=ROOT)


def test_what_was_done_and_where_an_error_came_from(tmp_path: Path) -> None:
    log = tmp_path / "geofield.log"
    plan = ("tracks", "sample_data/field_1.gpkg", "-o", tmp_path / "plan.gpkg")
    done = geofield(*plan, "--spacing", 6, "--log", log)
    assert done.returncode == 0
    assert "DEBUG" not in done.stderr
    first = log.read_text(encoding="utf-8")
    assert "geofield tracks sample_data/field_1.gpkg" in first
    assert done.stderr.strip().splitlines()[0] in first
    failed = geofield(*plan, "--spacing", 6000, "--log", log, "--verbose", "--overwrite")
    assert failed.returncode == 1
    second = log.read_text(encoding="utf-8").removeprefix(first)
    assert "ERROR   A spacing of 6000 m" in second
    assert "Traceback" in second
    assert second.splitlines()[-1].endswith(" s")
    # --verbose shows the steps; what is said to the person stands there once.
    assert "Traceback" in failed.stderr
    assert failed.stderr.count("\nError: A spacing") == 1


def test_keys_are_not_logged(tmp_path: Path) -> None:
    log = tmp_path / "geofield.log"
    geofield("info", "https://me:pw1@host.example/a?API_KEY=hush77&z=1", "--log", log)
    text = log.read_text(encoding="utf-8")
    assert "host.example" in text
    assert "z=1" in text
    for secret in ("hush77", "pw1"):
        assert secret not in text


def test_a_log_that_cannot_be_written_is_wrong_usage(tmp_path: Path) -> None:
    done = geofield("formats", "--log", tmp_path / "no" / "folder.log")
    assert done.returncode == 2
    assert "cannot be written" in done.stderr


def test_a_file_that_is_no_log_is_not_written_to(tmp_path: Path) -> None:
    plan = tmp_path / "plan.gpkg"
    plan.write_bytes((ROOT / "sample_data" / "field_1.gpkg").read_bytes())
    before = plan.read_bytes()
    done = geofield("formats", "--log", plan)
    assert done.returncode == 2
    assert "no log of geofield" in done.stderr
    assert plan.read_bytes() == before


def test_the_shell_completes_commands_and_options() -> None:
    words = {"COMP_WORDS": "geofield run --spa", "COMP_CWORD": "2"}
    done = subprocess.run(
        [GEOFIELD],
        env={**os.environ, **words, "_GEOFIELD_COMPLETE": "bash_complete"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["plain,--spacing"]
