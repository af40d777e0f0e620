"""Kills, leftovers and several processes on one folder: products are whole, or not there."""

from __future__ import annotations

import errno
import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

from geofield.errors import FormatError, FormatWarning, OutputExistsError
from geofield.plan import read_plan
from geofield.simulate import SimulatedField
from geofield.staging import staged_folder
from geofield_command import run_geofield

GEOFIELD = Path(sys.executable).with_name("geofield")

#: Writes two files that must agree, as often as it is asked to.
WRITER = """
import sys, time
from pathlib import Path
from geofield.errors import GeofieldError
from geofield.staging import staged_folder
target, mark, pause = Path(sys.argv[1]), sys.argv[2], float(sys.argv[3])
try:
    with staged_folder(target, overwrite=True) as folder:
        (folder / "sub").mkdir()
        for name in ("a.txt", "sub/b.txt"):
            (folder / name).write_text(mark * 1000)
            print("staged", flush=True)
            time.sleep(pause)
except GeofieldError as error:
    sys.exit(str(error))
"""


def writer(target: Path, mark: str, pause_s: float) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", WRITER, str(target), mark, str(pause_s)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def kill(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.communicate()


def leftovers(folder: Path) -> list[str]:
    return [path.name for path in folder.glob(".geofield-*")]


def test_leftovers_of_the_dead_are_swept_and_those_of_the_living_stay(tmp_path: Path) -> None:
    dead, living = writer(tmp_path, "d", 60), writer(tmp_path, "l", 60)
    for each in (dead, living):
        assert each.stdout is not None
        each.stdout.readline()
    kill(dead)
    assert len(leftovers(tmp_path)) == 2
    with staged_folder(tmp_path) as folder:
        (folder / "mine.txt").write_text("mine")
        assert len(leftovers(tmp_path)) == 2
    (left,) = leftovers(tmp_path)
    assert (tmp_path / left / "new" / "a.txt").read_text() == "l" * 1000
    kill(living)
    with staged_folder(tmp_path):
        pass
    assert leftovers(tmp_path) == []


@pytest.mark.parametrize("kind", ["SIGKILL", "SIGTERM", "SIGINT"])
def test_a_stop_before_the_lock_is_taken_leaves_nothing_for_longer_than_the_next_start(
    tmp_path: Path, kind: str
) -> None:
    code = WRITER.replace(
        "try:",
        "import os, signal, tempfile\nmake = tempfile.mkdtemp\n"
        "def stop(*_):\n    raise KeyboardInterrupt\n"
        "signal.signal(signal.SIGTERM, stop)\nsignal.signal(signal.SIGINT, stop)\n"
        f"def stopped(**given):\n    made = make(**given)\n"
        f"    os.kill(os.getpid(), signal.{kind})\n    return made\n"
        "tempfile.mkdtemp = stopped\ntry:",
        1,
    )
    done = subprocess.run(
        [sys.executable, "-c", code, tmp_path, "n", "0"], check=False, capture_output=True
    )
    assert done.returncode != 0
    assert not (tmp_path / "a.txt").exists()
    # A stop that can be held back leaves nothing at all.
    assert len(leftovers(tmp_path)) == (1 if kind == "SIGKILL" else 0)
    with staged_folder(tmp_path):
        pass
    assert leftovers(tmp_path) == []


def test_a_move_that_a_kill_cut_is_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("a.txt", "b.txt"):
        (tmp_path / name).write_text("old")
    code = WRITER.replace('"sub/b.txt"', '"b.txt"').replace(
        "try:",
        "import os, signal\nreplace = Path.replace\n"
        "def once(self, place):\n    replace(self, place)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\nPath.replace = once\ntry:",
        1,
    )
    subprocess.run([sys.executable, "-c", code, tmp_path, "n", "0"], check=False)
    assert {(tmp_path / n).read_text()[:3] for n in ("a.txt", "b.txt")} == {"nnn", "old"}
    with staged_folder(tmp_path):
        pass
    assert {(tmp_path / n).read_text()[:3] for n in ("a.txt", "b.txt")} == {"nnn"}
    assert leftovers(tmp_path) == []


#: Writes one of two files that are one product.
LESS = WRITER.replace('("a.txt", "sub/b.txt")', '("a.txt",)').replace(
    "overwrite=True", 'overwrite=True, products=[{target / "a.txt", target / "b.txt"}]'
)


def test_what_a_product_has_no_more_goes_with_the_move(tmp_path: Path) -> None:
    for name in ("b.txt", "mine.txt"):
        (tmp_path / name).write_text("old")
    subprocess.run([sys.executable, "-c", LESS, tmp_path, "n", "0"], check=True)
    assert {file.name for file in tmp_path.iterdir()} == {"a.txt", "mine.txt"}
    (tmp_path / "b.txt").write_text("old")
    with staged_folder(tmp_path, products=[{tmp_path / "a.txt", tmp_path / "b.txt"}]) as folder:
        (folder / "c.txt").touch()
    assert (tmp_path / "b.txt").read_text() == "old"


@pytest.mark.parametrize("moment", ["replace", "unlink"])
def test_what_goes_is_there_until_all_is_in_place(tmp_path: Path, moment: str) -> None:
    (tmp_path / "b.txt").write_text("old")
    fails = (
        f"import errno\nreal = Path.{moment}\ndef full(self, *given, **how):\n"
        f"    Path.{moment} = real\n    raise OSError(errno.EIO, 'broken')\n"
        f"Path.{moment} = full\ntry:"
    )
    done = subprocess.run(
        [sys.executable, "-c", LESS.replace("try:", fails, 1), tmp_path, "n", "0"],
        check=False,
        capture_output=True,
        text=True,
    )
    assert "broken" in done.stderr
    assert {file.name: file.read_text() for file in tmp_path.iterdir()} == {"b.txt": "old"}


def test_what_goes_has_gone_when_a_kill_cut_the_move(tmp_path: Path) -> None:
    (tmp_path / "b.txt").write_text("old")
    kills = (
        "import os, signal\nreplace = Path.replace\ndef once(self, place):\n"
        "    replace(self, place)\n    os.kill(os.getpid(), signal.SIGKILL)\n"
        "Path.replace = once\ntry:"
    )
    line = [sys.executable, "-c", LESS.replace("try:", kills, 1), str(tmp_path), "n", "0"]
    assert subprocess.run(line, check=False).returncode == -signal.SIGKILL
    assert {file.name for file in tmp_path.glob("*.txt")} == {"a.txt", "b.txt"}
    with staged_folder(tmp_path):
        pass
    assert {file.name for file in tmp_path.iterdir()} == {"a.txt"}


def test_of_many_writers_one_wins_and_the_others_say_so(tmp_path: Path) -> None:
    writers = [writer(tmp_path, mark, 0.5) for mark in "abcdef"]
    told = [each.communicate(timeout=120)[1] for each in writers]
    codes = [each.returncode for each in writers]
    assert codes.count(0) >= 1
    assert all("another program" in text for text, code in zip(told, codes, strict=True) if code)
    assert (tmp_path / "a.txt").read_text() == (tmp_path / "sub/b.txt").read_text()
    assert leftovers(tmp_path) == []


def test_an_edit_made_meanwhile_is_kept(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("first")

    def overwrite() -> None:
        with staged_folder(tmp_path, overwrite=True) as folder:
            (folder / "a.txt").write_text("ours")
            (tmp_path / "a.txt").write_text("a person's")

    with pytest.raises(OutputExistsError, match="another program"):
        overwrite()
    assert (tmp_path / "a.txt").read_text() == "a person's"


def test_an_edit_in_the_log_of_a_program_that_died_is_kept(tmp_path: Path) -> None:
    plan = tmp_path / "field.gpkg"
    code = (
        "import os, sqlite3, sys; db = sqlite3.connect(sys.argv[1], isolation_level=None); "
        "db.execute('PRAGMA journal_mode = WAL'); db.execute('CREATE TABLE field (name)'); "
        "db.execute('PRAGMA wal_checkpoint(TRUNCATE)'); print('open', flush=True); "
        "sys.stdin.readline(); db.execute('INSERT INTO field VALUES (1)'); os._exit(0)"
    )
    line = [sys.executable, "-c", code, str(plan)]
    with subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None
        other.stdout.readline()

        def overwrite() -> None:
            with staged_folder(tmp_path, overwrite=True) as folder:
                (folder / plan.name).write_text("ours")
                other.communicate("edit\n")

        with pytest.raises(OutputExistsError, match="another program"):
            overwrite()
    with closing(sqlite3.connect(plan)) as file:
        assert file.execute("SELECT * FROM field").fetchall() == [(1,)]


def test_links_in_the_output_folder_lead_nowhere(tmp_path: Path) -> None:
    outside, target = tmp_path / "outside", tmp_path / "target"
    for folder in (outside, target):
        folder.mkdir()
    (outside / "precious").write_text("mine")
    (target / "a.txt").symlink_to(outside / "precious")
    with (
        pytest.warns(FormatWarning, match="a.txt was a link to .*precious, which stays as it was"),
        staged_folder(target, overwrite=True) as folder,
    ):
        (folder / "a.txt").write_text("new")
    assert (outside / "precious").read_text() == "mine"
    assert (target / "a.txt").read_text() == "new"
    (target / "geojson").symlink_to(outside)

    def through_the_link() -> None:
        with staged_folder(target, overwrite=True) as folder:
            (folder / "geojson").mkdir()
            (folder / "geojson/precious").write_text("new")

    with pytest.raises(FormatError, match="leads out of"):
        through_the_link()
    assert (outside / "precious").read_text() == "mine"


def test_what_is_replaced_keeps_its_mode(tmp_path: Path) -> None:
    # Shared with a group, or with nobody: neither is the next run's to change.
    for name, mode in (("shared.txt", 0o664), ("mine.txt", 0o600)):
        (tmp_path / name).touch()
        (tmp_path / name).chmod(mode)
    with staged_folder(tmp_path, overwrite=True) as folder:
        for name in ("shared.txt", "mine.txt"):
            (folder / name).write_text("new")
    assert (tmp_path / "shared.txt").stat().st_mode & 0o777 == 0o664
    assert (tmp_path / "mine.txt").stat().st_mode & 0o777 == 0o600
    assert (tmp_path / "mine.txt").read_text() == "new"


def test_a_file_that_cannot_be_read_is_told_as_such(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    picture = tmp_path / "scene.tif"
    picture.touch()
    # Root may read all files.
    monkeypatch.setattr(os, "access", lambda _, mode: mode != os.R_OK)

    def read() -> None:
        with staged_folder(tmp_path, overwrite=True):
            raise PermissionError(errno.EACCES, "Permission denied", str(picture))

    with pytest.raises(FormatError, match=r"/scene\.tif cannot be read") as told:
        read()
    assert told.value.hint == "Give yourself the right to read it, then repeat."


@pytest.fixture(scope="module")
def plan(
    simulated: SimulatedField, simulated_tif: Path, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    out = tmp_path_factory.mktemp("kills") / "out"
    line = ["run", simulated_tif, "--lat", simulated.lat, "--lon", simulated.lon, "--out", out]
    run_geofield(*line, "--spacing", 8, check=True)
    return out / "field.gpkg"


def whole(plan: Path) -> None:
    """A GeoPackage that opens, and whose tracks are of one planning."""
    found = read_plan(plan)
    assert found.tracks is not None
    with closing(sqlite3.connect(plan)) as file, file:
        assert file.execute("PRAGMA integrity_check").fetchone() == ("ok",)


@pytest.mark.parametrize("kind", [signal.SIGTERM, signal.SIGKILL, signal.SIGINT])
def test_a_stop_at_any_moment_leaves_products_whole(
    plan: Path, kind: signal.Signals, tmp_path: Path
) -> None:
    dice = random.Random(int(kind))
    for spacing in (5, 6, 7):
        log = tmp_path / f"{spacing}.log"
        line = ["tracks", str(plan), "--spacing", str(spacing), "-o", str(plan), "--log", str(log)]
        with subprocess.Popen([GEOFIELD, *line], stderr=subprocess.PIPE, text=True) as process:
            try:
                # Before that it is Python that stops, in whatever it was loading.
                while not log.exists() and process.poll() is None:
                    time.sleep(0.01)
                time.sleep(dice.uniform(0.0, 2.2))
                process.send_signal(kind)
                _, told = process.communicate(timeout=60)
            except BaseException:
                process.kill()  # it would be waited for without end
                raise
        assert "Traceback" not in told
        whole(plan)
        if kind != signal.SIGKILL:
            assert leftovers(plan.parent) == []
    run_geofield("tracks", plan, "--spacing", 8, "-o", plan, check=True)
    assert leftovers(plan.parent) == []


def test_a_geopackage_that_another_program_edits_is_left_alone(plan: Path) -> None:
    before = plan.read_bytes()
    holder = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "import sqlite3, sys, time; db = sqlite3.connect(sys.argv[1], isolation_level=None); "
            "db.execute('BEGIN IMMEDIATE'); print('held', flush=True); time.sleep(300)",
            plan,
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert holder.stdout is not None
        holder.stdout.readline()
        done = run_geofield("tracks", plan, "--spacing", 4, "-o", plan)
        # It is told before the work: the picture that it needs is not asked for.
        nowhere, at = plan.with_name("no.tif"), ["--lat", 35.075373, "--lon", 33.531142]
        early = [
            run_geofield("run", nowhere, *at, "--out", plan.parent, "--overwrite"),
            run_geofield("field", nowhere, *at, "-o", plan, "--overwrite"),
            run_geofield("obstacles", nowhere, plan, "-o", plan),
        ]
        # What may not be replaced at all is told first: closing it elsewhere would not help.
        parcel = plan.with_name("parcel.geojson")
        parcel.write_text("no parcel")
        taken = [
            run_geofield("field", nowhere, *at, "-o", plan),
            run_geofield("import", parcel, "-o", plan),
            run_geofield("tracks", parcel, "--spacing", 4, "-o", plan),
        ]
        itself = run_geofield("import", plan, "-o", plan, "--overwrite")
    finally:
        kill(holder)
    for each in (done, *early):
        assert each.returncode == 1
        assert "open in another program" in each.stderr
    for each in taken:
        assert each.returncode == 1
        assert f"{plan} is there already." in each.stderr
    assert f"{plan} is an input of this work" in itself.stderr
    assert plan.read_bytes() == before


def test_a_folder_beside_that_vanishes_meanwhile_is_no_matter(tmp_path, monkeypatch):
    gone = tmp_path / "of-another-program"
    gone.mkdir()
    for name in ("scandir", "listdir"):
        real = getattr(os, name)

        def vanished(path=".", real=real):
            if str(path) == str(gone):
                raise FileNotFoundError(path)
            return real(path)

        monkeypatch.setattr(os, name, vanished)
    with staged_folder(tmp_path, overwrite=True) as staging:
        (staging / "product.txt").write_text("whole", encoding="utf-8")
    assert (tmp_path / "product.txt").read_text(encoding="utf-8") == "whole"


def test_a_disk_that_fills_under_a_database_is_told(tmp_path: Path) -> None:
    def write() -> None:
        with (
            staged_folder(tmp_path) as folder,
            closing(sqlite3.connect(folder / "field.gpkg")) as file,
        ):
            file.execute("PRAGMA max_page_count = 1")
            file.execute("CREATE TABLE field (name)")

    with pytest.raises(FormatError, match="The disk is full"):
        write()
    assert not list(tmp_path.iterdir())
