"""Two at once: one command works on a folder or file, the other says so and leaves it alone."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from geofield.plan import read_plan
from geofield.simulate import SimulatedField
from geofield.staging import claimed, staged_folder
from geofield_command import run_geofield as geofield

GEOFIELD = Path(sys.executable).with_name("geofield")
pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="claims need flock")


@pytest.fixture
def point(simulated: SimulatedField) -> list[str]:
    return ["--lat", str(simulated.lat), "--lon", str(simulated.lon)]


@pytest.fixture
def planned(simulated_tif: Path, point: list[str], tmp_path: Path) -> Path:
    done = geofield("run", simulated_tif, *point, "--spacing", 8, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    return tmp_path / "out"


class Asleep(subprocess.Popen[str]):
    """What it said on stderr, when it has ended."""

    told = ""


def between_two_steps(folder: Path) -> bool:
    """Whether somebody makes or moves files in a folder now, which others wait for."""
    import fcntl

    opened = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(opened)
    return False


def reads(plan: Path) -> bool:
    """Whether somebody reads a plan just now, which others wait for before they write."""
    if not plan.is_file():
        return False
    with closing(sqlite3.connect(plan, timeout=0, isolation_level=None)) as file:
        try:
            file.execute("BEGIN EXCLUSIVE")
        except sqlite3.OperationalError:
            return True
        file.execute("ROLLBACK")
    return False


@contextmanager
def asleep(folder: Path, *words: object) -> Iterator[Asleep]:
    """A command that has begun to work on a folder and sleeps until the block is over."""
    line = [str(word) for word in (GEOFIELD, *words)]
    with Asleep(line, stderr=subprocess.PIPE, text=True) as process:
        try:
            until = time.monotonic() + 120
            while not list(folder.glob(".geofield-*/claim")):
                assert process.poll() is None, process.communicate()[1]
                assert time.monotonic() < until
                time.sleep(0.005)
            process.send_signal(signal.SIGSTOP)
            while between_two_steps(folder) or reads(folder / "field.gpkg"):
                process.send_signal(signal.SIGCONT)
                time.sleep(0.005)
                process.send_signal(signal.SIGSTOP)
            yield process
            process.send_signal(signal.SIGCONT)
            process.told = process.communicate(timeout=300)[1]
        except BaseException:
            process.kill()
            raise


def leftovers(folder: Path) -> list[Path]:
    return list(folder.rglob(".geofield-*"))


def state(folder: Path) -> dict[str, tuple[int, int]]:
    return {
        str(each): (each.stat().st_ino, each.stat().st_mtime_ns)
        for each in folder.rglob("*")
        if each.is_file() and ".geofield-" not in str(each)
    }


def refused(done: subprocess.CompletedProcess[str]) -> None:
    assert done.returncode == 1, done.stderr
    assert "Another geofield is working on" in done.stderr
    assert "Repeat when it has finished, or write to another folder." in done.stderr
    assert "Traceback" not in done.stderr


def test_of_two_runs_on_one_folder_the_first_wins(
    planned: Path, simulated_tif: Path, point: list[str]
) -> None:
    def line(spacing_m: int) -> list[object]:
        words = ["run", simulated_tif, *point, "--out", planned, "--overwrite"]
        return [*words, "--spacing", spacing_m]

    before = state(planned)
    with asleep(planned, *line(5)) as first:
        refused(geofield(*line(9)))
        # Each command that would write there is told.
        plan = planned / "field.gpkg"
        refused(geofield("tracks", plan, "--spacing", 6, "-o", plan))
        refused(geofield("export", plan, "-f", "kml", "--out", planned))
        refused(geofield("tiles", simulated_tif, *point, "-o", planned / "scene.tif"))
        refused(geofield("import", planned / "geojson", "-o", plan, "--overwrite"))
        assert state(planned) == before
        # Elsewhere it may work, and read what is there.
        assert geofield("export", plan, "-f", "kml", "--out", planned / "more").returncode == 0
    assert first.returncode == 0, first.told
    tracks = read_plan(planned / "field.gpkg").tracks
    assert tracks is not None
    assert tracks.spacing_m == 5
    assert leftovers(planned) == []


def test_of_two_stages_on_one_file_the_first_wins(planned: Path) -> None:
    plan = planned / "field.gpkg"
    assert geofield("tracks", plan, "--spacing", 7, "-o", plan).returncode == 0
    with asleep(planned, "tracks", plan, "--spacing", 5, "-o", plan) as first:
        refused(geofield("tracks", plan, "--spacing", 9, "-o", plan))
        refused(geofield("undo", plan))
        # Another file of the same folder is nobody's yet.
        other = geofield("tracks", plan, "--spacing", 9, "-o", planned / "other.gpkg")
        assert other.returncode == 0, other.stderr
    assert first.returncode == 0, first.told
    for file, spacing_m in ((plan, 5), (planned / "other.gpkg", 9)):
        tracks = read_plan(file).tracks
        assert tracks is not None
        assert tracks.spacing_m == spacing_m
    assert leftovers(planned) == []


def test_the_claim_of_a_killed_run_holds_nobody_up(
    tmp_path: Path, simulated_tif: Path, point: list[str]
) -> None:
    out = tmp_path / "out"
    line = ["run", simulated_tif, *point, "--spacing", 8, "--out", out]
    with asleep(out, *line) as first:
        first.kill()
    assert leftovers(out)
    # Nor are its leftovers products that would have to be overwritten.
    done = geofield(*line)
    assert done.returncode == 0, done.stderr
    assert leftovers(out) == []


def test_a_claim_is_ones_own_however_the_folder_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "link").symlink_to(tmp_path / "out")
    with claimed(Path("out")):
        for place in (tmp_path / "out", Path("out"), tmp_path / "link"):
            with staged_folder(place, overwrite=True) as folder:
                (folder / "product.txt").write_text(str(place))
    assert leftovers(tmp_path) == []


def test_a_folder_made_for_a_run_that_fails_is_gone(tmp_path: Path, simulated_tif: Path) -> None:
    out = tmp_path / "new" / "out"
    done = geofield("run", simulated_tif, "--lat", 1, "--lon", 1, "--out", out)
    assert done.returncode == 1
    assert not out.parent.exists()


def test_an_edit_saved_while_a_run_works_is_not_lost(
    planned: Path, simulated_tif: Path, point: list[str]
) -> None:
    plan = planned / "field.gpkg"
    line = ["run", simulated_tif, *point, "--spacing", 5, "--out", planned, "--overwrite"]
    with asleep(planned, *line) as run:
        time.sleep(0.05)  # a file system may keep time in steps
        with closing(sqlite3.connect(plan)) as file:
            # As a plain program would: without the functions that its triggers of geometry ask for.
            file.execute("UPDATE gpkg_contents SET description = 'edited by a person'")
            file.commit()
    assert run.returncode == 1
    assert "was written by another program while this one worked" in run.told
    with closing(sqlite3.connect(plan)) as file:
        said = file.execute("SELECT DISTINCT description FROM gpkg_contents").fetchall()
    assert said == [("edited by a person",)]
    assert leftovers(planned) == []
