"""Files as Windows, sticks and network shares have them: emulated, as the tests run on Linux."""

from __future__ import annotations

import errno
import hashlib
import io
import json
import os
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path, PureWindowsPath
from threading import Event
from typing import Any, ClassVar

import pytest

from geofield.errors import FormatError, OutputExistsError
from geofield.farm import pool
from geofield.imagery import reach
from geofield.simulate import SimulatedField
from geofield.staging import claimed, leftovers, staged_folder
from geofield.strangers import for_reading

pytestmark = pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="emulated on Linux")
PROGRAM = Path(__file__).parents[1] / "as_windows.py"
#: Runs the same commands as this system does.
PLAINLY = """
import json, sys
from geofield.cli import main
for words in json.loads(sys.argv[1]):
    try:
        main(words)
    except SystemExit as stop:
        if stop.code:
            raise
"""


def _run(program: list[str], lines: list[list[Any]]) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, *program, json.dumps(lines, default=str)]
    return subprocess.run(line, capture_output=True, text=True, check=False)


def _digests(folder: Path) -> dict[str, str]:
    return {
        str(each.relative_to(folder)): hashlib.sha256(each.read_bytes()).hexdigest()
        for each in folder.rglob("*")
        # How long a field took.
        if each.is_file() and each.relative_to(folder).parts[:2] != ("farm", "status")
    }


def test_the_main_commands_write_there_what_they_write_here(
    simulated: SimulatedField, simulated_tif: Path, sample: Path, tmp_path: Path
) -> None:
    place = ["--lat", simulated.lat, "--lon", simulated.lon]
    made = {}
    for program in ([str(PROGRAM)], ["-c", PLAINLY]):
        out = tmp_path / "out"
        plan, run = out / "field.gpkg", ["run", simulated_tif, *place, "--out", out]
        formats = [word for name in ("gpkg", "fiboa", "dxf", "html") for word in ("--format", name)]
        outlines = ["batch", sample / "field_1.gpkg", "--spacing", 8, "--workers", 1]
        dead = out / ".geofield-dead"
        dead.mkdir(parents=True)
        (dead / "lock").write_text("1\n")  # left by a process that was killed
        lines = [
            [*run, "--spacing", 8, *formats],
            [*run, "--spacing", 9, "--overwrite"],
            ["undo", plan],
            ["tracks", plan, "--spacing", 7, "-o", plan],
            ["refresh", plan],
            ["export", plan, "-f", "isoxml", "-f", "csv", "-f", "study-xml", "--out", out / "ex"],
            [*outlines, "--out", out / "farm"],
        ]
        done = _run(program, [[str(word) for word in line] for line in lines])
        assert done.returncode == 0, done.stderr
        assert "OPEN:" not in done.stderr
        assert not list(out.glob(".geofield-*"))
        made[program[0]] = _digests(out)
        shutil.rmtree(out)
    there, here = made.values()
    assert {"field.gpkg.bak", "report.json", "field.prj", "farm/farm.gpkg"} < here.keys()
    assert there == here


def test_two_commands_at_once_know_of_each_other_there(tmp_path: Path) -> None:
    with claimed(tmp_path):
        words = ["simulate", "--size", "64", "--out", str(tmp_path)]
        done = _run([str(PROGRAM)], [words])
        assert "Another geofield is working on" in done.stderr
        assert [each.name for each in tmp_path.iterdir() if each.suffix] == []
        assert len(list(tmp_path.glob(".geofield-*/claim"))) == 1
    done = _run([str(PROGRAM)], [words])
    assert done.returncode == 0, done.stderr
    assert not list(tmp_path.glob(".geofield-*"))


class _OnWindows(PureWindowsPath):
    """A path there that says where it is."""

    asked: ClassVar[set[str]] = set()

    def absolute(self) -> _OnWindows:
        """Itself."""
        return self

    def resolve(self) -> _OnWindows:
        """Itself, as the server told."""
        self.asked.add(self.drive)
        return self

    def is_dir(self) -> bool:
        """Whether it has no suffix."""
        return not self.suffix


def test_a_server_that_only_a_file_names_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    _OnWindows.asked.clear()
    monkeypatch.setattr(reach, "Path", _OnWindows)
    assert not reach.Reach((r"C:\farm\a.vrt",)).holds(r"\\stranger\share\b.tif")
    assert not reach.Reach((r"C:\farm\a.vrt",)).holds("//stranger/share/b.tif")
    assert _OnWindows.asked == {"C:"}
    assert reach.Reach((r"\\nas\farm\a.vrt",)).holds(r"\\nas\farm\b.tif")
    assert not reach.Reach((r"\\nas\farm\a\a.vrt",)).holds(r"\\nas\farm\b.tif")


def test_ctrl_c_in_a_console_there_is_not_for_the_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[str, Any] = {}

    def started(_: Any, **given: Any) -> None:
        asked.update(given)
        raise OSError("not started")

    monkeypatch.setattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 512, raising=False)
    monkeypatch.setattr(subprocess, "Popen", started)
    monkeypatch.setattr(tempfile, "TemporaryFile", io.BytesIO)  # nobody is there to close it
    with pytest.raises(OSError, match="not started"):
        next(pool.Pool(1).run(iter(["a task"]), "orders", Event()))  # type: ignore[arg-type,list-item]
    assert asked["creationflags"] == 512


@pytest.mark.parametrize(
    ("there", "address"),
    [
        (r"C:\Höfe 1\a#b%.gpkg", "file:///C:/H%C3%B6fe%201/a%23b%25.gpkg?mode=ro"),
        (r"\\server\höfe\a.gpkg", "file:////server/h%C3%B6fe/a.gpkg?mode=ro"),
    ],
)
def test_a_plan_on_a_network_share_has_an_address_that_sqlite_knows(
    there: str, address: str
) -> None:
    assert for_reading(_OnWindows(there)) == address  # type: ignore[arg-type]
    # A server in an address is refused before any file is looked for.
    with pytest.raises(sqlite3.OperationalError, match="unable to open"):
        sqlite3.connect(address, uri=True)


def test_a_product_that_is_open_elsewhere_leaves_all_as_they_were(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = ["a.csv", "b.csv", "c.csv"]
    for name in names:
        (tmp_path / name).write_text("old")
    replace = Path.replace

    def refused(self: Path, place: Path) -> Path:
        if Path(place).name == "b.csv":  # a spreadsheet shows it
            raise PermissionError(errno.EACCES, "Access is denied", str(self), None, str(place))
        return replace(self, place)

    monkeypatch.setattr(Path, "replace", refused)

    def write() -> None:
        with staged_folder(tmp_path, overwrite=True) as staging:
            for name in names:
                (staging / name).write_text("new")

    with pytest.raises(FormatError, match=r"b\.csv cannot be replaced") as told:
        write()
    assert told.value.hint == "Close it in the program that has it open, then repeat."
    assert [(tmp_path / name).read_text() for name in names] == ["old"] * 3


def test_a_share_without_locks_is_cleared_of_what_is_old(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def without(_: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(leftovers, "_hold", without)
    for name, hours in (("old", 2), ("new", 0)):
        folder = tmp_path / f".geofield-{name}"
        folder.mkdir()
        (folder / "lock").write_text("1\n")
        then = time.time() - 3600 * hours
        os.utime(folder, (then, then))
    with staged_folder(tmp_path) as staging:
        (staging / "a.txt").write_text("mine")
    assert sorted(each.name for each in tmp_path.iterdir()) == [".geofield-new", "a.txt"]


def test_a_share_whose_locks_forbid_to_read_has_claims(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / ".geofield-theirs").mkdir()
    said = {"names": None, "process": 1, "since": time.time()}
    (tmp_path / ".geofield-theirs" / "claim").write_text(json.dumps(said))
    (tmp_path / ".geofield-theirs" / "lock").write_text("1\n")
    hold = leftovers._hold

    def denied(file: int) -> None:
        if "theirs" in str(Path(f"/proc/self/fd/{file}").readlink()):
            raise PermissionError(errno.EACCES, "Permission denied")
        hold(file)

    monkeypatch.setattr(leftovers, "_hold", denied)
    with pytest.raises(OutputExistsError, match="Another geofield"), claimed(tmp_path):
        pass


def test_a_file_with_another_inode_was_not_written(tmp_path: Path) -> None:
    """As sticks and shares give them, and a cloud's folder that was filled anew."""
    file = tmp_path / "field.gpkg"
    with closing(sqlite3.connect(file)) as made:
        made.execute("CREATE TABLE field (name)")
    with staged_folder(tmp_path, overwrite=True) as staging:
        shutil.copy2(file, tmp_path / "copy")
        (tmp_path / "copy").replace(file)
        (staging / file.name).write_text("ours")
    assert file.read_text() == "ours"
