"""``geofield batch`` as a process: farms, restarts, bad input."""

from __future__ import annotations

import http.server
import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import closing, suppress
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely

import geofield as gf
from geofield.farm import Farm, read_farm
from geofield_command import run_geofield

GEOFIELD = str(Path(sys.executable).with_name("geofield"))
#: What a farm's overview is called that was replaced.
KEPT = "farm.gpkg.bak"
RECTANGLE = ((0, 0), (80, 0), (80, 60), (0, 60))


def batch(*arguments: object, code: int = 0, without: Sequence[str] = ()) -> str:
    """Run the command; its messages."""
    return told_by(run_geofield("batch", *arguments, without=without, timeout_s=500), code)


def batch_alone(*arguments: object, code: int = 0) -> str:
    """The same as a process from the start: in another one, sets have another order."""
    line = [GEOFIELD, "batch", *map(str, arguments)]
    done = subprocess.run(line, capture_output=True, text=True, timeout=500, check=False)
    return told_by(done, code)


def told_by(done: subprocess.CompletedProcess[str], code: int) -> str:
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    return done.stderr


def layers_of(farm: Path) -> dict[str, bytes]:
    """The bytes of all files of a farm but its status, which holds seconds and workers."""
    return {
        str(file.relative_to(farm)): file.read_bytes()
        for file in sorted(farm.rglob("*"))
        if file.is_file() and file.relative_to(farm).parts[0] != "status"
    }


def parcels(path: Path, count: int = 60, **columns: object) -> Path:
    """Parcels of many shapes side by side, in two zones."""
    rng = np.random.default_rng(5)
    shapes = []
    for number in range(count):
        row, column = divmod(number, 10)
        corners = rng.uniform(0, 12, (4, 2)) + np.array(RECTANGLE)
        x, y = 11.99 + column * 0.002, 50.0 + row * 0.002
        shapes.append(shapely.Polygon(corners / [71_000, 111_000] + [x, y]))
    frame = gpd.GeoDataFrame(
        {"id": [f"p{n}" for n in range(count)], "crop": ["rye", "oats"] * (count // 2), **columns},
        geometry=shapes,
        crs=4326,
    )
    frame.to_file(path)
    return path


@pytest.fixture(scope="module")
def farm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A farm of parcels made by one worker, beside its places."""
    folder = tmp_path_factory.mktemp("batch")
    batch_alone(parcels(folder / "parcels.gpkg"), "--spacing", 5, "--out", folder / "farm",
                "--workers", 1)  # fmt: skip
    return folder / "farm"


def test_a_farm_holds_every_place(farm: Path) -> None:
    whole = read_farm(farm)
    assert len(whole) == 60
    assert set(whole.status["status"]) == {"done"}
    assert set(whole.fields["crop"]) == {"rye", "oats"}
    assert set(whole.fields["utm_epsg"]) == {32632, 32633}
    assert whole["p7"].settings.tracks.spacing_m == 5.0
    assert sorted(farm.glob("*.csv")) == []
    alone = next(
        plan
        for plan in gf.plan_fields(farm.parent / "parcels.gpkg", spacing_m=5)
        if plan.field.field_id == "p7"
    )
    assert whole["p7"] == alone


def test_a_restart_does_only_what_is_missing(farm: Path, tmp_path: Path) -> None:
    before = layers_of(farm)
    mark = farm / "status" / "chunk=0001" / "part-0.parquet"
    kept = farm / "status" / "chunk=0000" / "part-0.parquet"
    stamp = kept.stat().st_mtime_ns
    mark.unlink()
    (farm / "tracks" / "chunk=0001" / "part-0.parquet").write_bytes(b"half")
    said = batch(farm.parent / "parcels.gpkg", "--spacing", 5, "--out", farm)
    assert "60 done" in said
    assert mark.exists()
    assert kept.stat().st_mtime_ns == stamp
    assert layers_of(farm) == before


def test_two_workers_give_the_same_bytes(farm: Path, tmp_path: Path) -> None:
    told = batch_alone(farm.parent / "parcels.gpkg", "--spacing", 5, "--out", tmp_path / "farm",
                       "--workers", 2)  # fmt: skip
    assert "2 workers on this machine" in told
    assert layers_of(tmp_path / "farm") == layers_of(farm)


def test_other_work_is_refused_and_fresh_does_it(farm: Path, tmp_path: Path) -> None:
    places = parcels(tmp_path / "parcels.gpkg", 20)
    batch(places, "--spacing", 5, "--out", tmp_path / "farm")
    before = layers_of(tmp_path / "farm")
    said = batch(places, "--spacing", 6, "--out", tmp_path / "farm", code=1)
    assert "spacing_m was 5.0 and is 6.0" in said
    assert "--fresh" in said
    assert layers_of(tmp_path / "farm") == before
    batch(places, "--spacing", 6, "--fresh", "--out", tmp_path / "farm")
    assert {p.settings.tracks.spacing_m for p in read_farm(tmp_path / "farm")} == {6.0}


def test_pictures_are_searched_for_outlines_and_obstacles(sample: Path, tmp_path: Path) -> None:
    text = (sample / "seeds.csv").read_text().splitlines()[:2]
    text += ["far,x,x,36.5,33.5,0,1", "edge,x,x,35.07,33.53,0,1"]
    (tmp_path / "seeds.csv").write_text("\n".join(text))
    said = batch(tmp_path / "seeds.csv", sample / "field_1.tif", "--spacing", 4,
                 "--out", tmp_path / "farm")  # fmt: skip
    assert "2 places have no plan" in said
    whole = read_farm(tmp_path / "farm")
    assert whole.ids == ["field_1"]
    assert len(whole.obstacles) > 5
    status = whole.status.set_index("field_id")
    assert status.loc["field_1", "status"] in ("done", "doubtful")
    assert status.loc["far", "status"] == "failed"
    assert "outside" in status.loc["far", "error"]
    # The reasons and columns are in a file of places again.
    again = pd.read_csv(tmp_path / "farm" / "failed.csv").set_index("field_id")
    assert set(again.index) == {"far", "edge"}
    assert again.loc["far", "image"] == "x"
    assert "outside" in str(again.loc["far", "error"])
    said = batch(tmp_path / "farm" / "failed.csv", sample / "field_1.tif", "--out",
                 tmp_path / "again", code=1)  # fmt: skip
    assert "None of the 2 places" in said
    assert not (tmp_path / "again").exists()


def test_failed_parcels_are_parcels_again(tmp_path: Path) -> None:
    places = parcels(tmp_path / "p.gpkg", 4, spacing_m=[5.0, 900.0, 5.0, 900.0])
    batch(places, "--out", tmp_path / "farm")
    assert len(read_farm(tmp_path / "farm")) == 2
    mended = pd.read_csv(tmp_path / "farm" / "failed.csv")
    assert list(mended["field_id"]) == ["p1", "p3"]
    mended["spacing_m"] = 9.0
    mended.to_csv(tmp_path / "mended.csv", index=False)
    batch(tmp_path / "mended.csv", "--out", tmp_path / "second")
    second = read_farm(tmp_path / "second")
    assert sorted(second.ids) == ["p1", "p3"]
    assert second["p1"].tracks.spacing_m == 9.0


def test_obstacles_of_a_file_are_avoided(tmp_path: Path) -> None:
    places = parcels(tmp_path / "p.gpkg", 10)
    middle = gpd.read_file(places).to_crs(32632).centroid.buffer(6.0)
    gpd.GeoDataFrame(geometry=middle, crs=32632).to_file(tmp_path / "ponds.shp")
    batch(places, "--obstacles", tmp_path / "ponds.shp", "--spacing", 4, "--out", tmp_path / "farm")
    whole = read_farm(tmp_path / "farm")
    assert len(whole.obstacles) == 10
    assert set(whole.gaps["cause"].str.startswith("obstacle")) == {True}


def test_another_file_of_obstacles_is_other_work(tmp_path: Path) -> None:
    """One called `trees[1].gpkg` counted as the same, whatever was in it."""
    places, trees = parcels(tmp_path / "p.gpkg", 10), tmp_path / "trees[1].gpkg"
    asked = (places, "--obstacles", trees, "--spacing", 8, "--out", tmp_path / "farm")
    middle = gpd.read_file(places).to_crs(32632).centroid
    for radius_m, code in ((6.0, 0), (7.0, 1)):
        gpd.GeoDataFrame(geometry=middle.buffer(radius_m), crs=32632).to_file(trees)
        told = batch(*asked, code=code)
    assert "the pictures or obstacles differ" in told


def test_a_file_of_obstacles_is_what_stands_in_it(tmp_path: Path) -> None:
    """One that QGIS had open to edit was another work; one that was edited there was none."""
    places, trees = parcels(tmp_path / "p.gpkg", 10), tmp_path / "trees.gpkg"
    asked = (places, "--obstacles", trees, "--spacing", 8, "--out", tmp_path / "farm")
    middle = gpd.read_file(places).to_crs(32632).centroid
    sized = gpd.GeoDataFrame(geometry=middle, crs=32632).assign(radius_m=6.0)
    sized.to_file(trees, SPATIAL_INDEX="NO")  # whose triggers SQLite alone does not know
    batch(*asked)
    with closing(sqlite3.connect(trees, isolation_level=None)) as opened:
        opened.execute("PRAGMA journal_mode = WAL")
        assert "Pace" not in batch(*asked)
        opened.execute("UPDATE trees SET radius_m = 7.0 WHERE fid = 3")
        assert "the pictures or obstacles differ" in batch(*asked, code=1)


def test_what_of_obstacles_and_options_is_not_used_is_told(tmp_path: Path) -> None:
    places = parcels(tmp_path / "p.gpkg", 2)
    middle = gpd.read_file(places).to_crs(32632).centroid
    trees = gpd.GeoDataFrame(geometry=middle, crs=32632)
    trees.to_crs(32633).set_crs(32632, allow_override=True).to_file(tmp_path / "away.gpkg")
    said = batch(places, "--obstacles", tmp_path / "away.gpkg", "--buffer", 5, "--strategy",
                 "single", "--spacing", 4, "--out", tmp_path / "farm")  # fmt: skip
    said = " ".join(said.split())
    assert "--buffer changes nothing without IMAGERY: polygons of --obstacles are avoided" in said
    assert "--strategy changes nothing without IMAGERY" in said
    assert "none of the 2 obstacles in it stands at a field that was planned" in said
    assert "2 points have no radius_m; they are circles of 2 m" in said
    trees.assign(radius_m="6.5 m").to_file(tmp_path / "text.gpkg")
    said = batch(places, "--obstacles", tmp_path / "text.gpkg", "--out", tmp_path / "no", code=1)
    assert "text.gpkg, row 1: radius_m '6.5 m' is no length" in said
    assert not (tmp_path / "no").exists()


def test_nothing_of_a_farm_stays_beside_one_that_is_written_over_it(
    farm: Path, tmp_path: Path
) -> None:
    """Its catalogue, its failed places and its overview were those of the other fields."""
    there, one = shutil.copytree(farm, tmp_path / "farm"), Farm([next(iter(read_farm(farm)))])
    (there / "failed.csv").touch()
    one.write(there, overwrite=True)
    one.write(tmp_path / "new")
    names = {path.name for path in there.iterdir() if not path.name.startswith(".")}
    assert names == {path.name for path in (tmp_path / "new").iterdir()} | {"farm.qgz", KEPT}
    assert (there / KEPT).read_bytes() == (farm / "farm.gpkg").read_bytes()
    for command in ("info", "validate"):
        assert "is a farm without its overview" in told_by(run_geofield(command, there), 1)


def test_ctrl_c_finishes_what_is_begun_and_the_rest_comes_later(farm: Path, tmp_path: Path) -> None:
    line = [GEOFIELD, "batch", str(farm.parent / "parcels.gpkg"), "--spacing", "5", "--out",
            str(tmp_path / "farm"), "--workers", "1"]  # fmt: skip
    process = subprocess.Popen(line, stderr=subprocess.PIPE, text=True)
    work = tmp_path / "farm" / ".work"
    until = time.monotonic() + 120
    while not list(work.glob("*.marks")) and time.monotonic() < until:
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=200)
    assert process.returncode == 1
    assert "What is begun is finished" in said
    assert "The same command does what is missing" in said
    done = len(read_farm(tmp_path / "farm"))
    assert 0 < done < 60
    batch(*line[2:])
    assert layers_of(tmp_path / "farm") == layers_of(farm)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_run_that_is_ended_at_once_goes_on_later(
    number: signal.Signals, farm: Path, tmp_path: Path
) -> None:
    line = [GEOFIELD, "batch", str(farm.parent / "parcels.gpkg"), "--spacing", "5", "--out",
            str(tmp_path / "farm"), "--workers", "2"]  # fmt: skip
    process = subprocess.Popen(line, stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + 120
    while not list((tmp_path / "farm" / ".work").glob("*.marks")) and time.monotonic() < until:
        time.sleep(0.005)
    process.send_signal(number)
    process.communicate(timeout=60)
    assert process.returncode in (1, -signal.SIGKILL)
    assert len(read_farm(tmp_path / "farm")) < 60
    batch(*line[2:])
    assert layers_of(tmp_path / "farm") == layers_of(farm)


def test_a_worker_killed_while_it_writes_leaves_nothing(farm: Path, tmp_path: Path) -> None:
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "sitecustomize.py").write_text(
        "import sys\n"
        "if 'worker' in ' '.join(sys.orig_argv):\n"
        "    import os, pathlib, signal\n"
        "    plain = pathlib.Path.replace\n"
        "    def bad(self, target):\n"
        "        if 'tracks/chunk=0000' in str(target):\n"
        "            os.kill(os.getpid(), signal.SIGKILL)\n"
        "        return plain(self, target)\n"
        "    pathlib.Path.replace = bad\n"
    )
    line = [GEOFIELD, "batch", str(farm.parent / "parcels.gpkg"), "--spacing", "5", "--out",
            str(tmp_path / "farm"), "--workers", "1"]  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "bad")}
    process = subprocess.Popen(line, stderr=subprocess.DEVNULL, env=environment)
    until = time.monotonic() + 120
    while not list(tmp_path.glob("farm/tracks/chunk=0000/.*.tmp")) and time.monotonic() < until:
        time.sleep(0.01)
    process.kill()
    process.wait()
    assert list(tmp_path.glob("farm/tracks/chunk=0000/.*.tmp"))
    (tmp_path / "farm" / ".half.tmp").write_bytes(b"of the record")
    batch(*line[2:])
    assert layers_of(tmp_path / "farm") == layers_of(farm)


def test_a_run_that_fails_leaves_nothing_that_another_worker_was_writing(tmp_path: Path) -> None:
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "sitecustomize.py").write_text(
        "import sys\n"
        "if 'worker' in ' '.join(sys.orig_argv):\n"
        "    import pathlib, time\n"
        "    plain = pathlib.Path.replace\n"
        "    def bad(self, target):\n"
        "        if 'chunk=0001' in str(target):\n"
        "            time.sleep(100)\n"
        "        if 'chunk=0000' not in str(target):\n"
        "            return plain(self, target)\n"
        f"        while not list(pathlib.Path({str(tmp_path)!r}).rglob('chunk=0001/.*.tmp')):\n"
        "            time.sleep(0.01)\n"
        "        raise OSError(28, 'No space left on device')\n"
        "    pathlib.Path.replace = bad\n"
    )
    line = [GEOFIELD, "batch", str(parcels(tmp_path / "p.gpkg")), "--out", str(tmp_path / "farm"),
            "--workers", "2"]  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "bad")}
    done = subprocess.run(line, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 1
    assert "The disk is full" in done.stderr
    assert not list((tmp_path / "farm").rglob("*.tmp"))


def test_a_run_killed_at_its_end_is_finished_by_the_next(farm: Path, tmp_path: Path) -> None:
    import shutil

    from geofield.farm.stac import write_stac
    from geofield.farm.store import Store

    mine = tmp_path / "farm"
    shutil.copytree(farm, mine)
    shutil.copy(farm.parent / "parcels.gpkg", tmp_path)
    line = [tmp_path / "parcels.gpkg", "--spacing", 5, "--out", mine, "--workers", 1]
    # A run that was stopped has a catalogue of a half, a second one is killed where all is done.
    (mine / "status" / "chunk=0001" / "part-0.parquet").unlink()
    write_stac(Store.of(mine))
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "sitecustomize.py").write_text(
        "import sys\n"
        "if 'batch' in sys.orig_argv:\n"
        "    import os, signal\n"
        "    import geofield.farm.finish as module\n"
        "    module.finish = lambda *_, **__: os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "bad")}
    ended = subprocess.run([GEOFIELD, "batch", *map(str, line)], env=environment, check=False)
    assert ended.returncode == -signal.SIGKILL
    assert layers_of(mine) != layers_of(farm)
    batch(*line)
    assert layers_of(mine) == layers_of(farm)
    assert not (mine / ".work").exists()


def test_a_program_sees_how_far_it_is(tmp_path: Path) -> None:
    places = parcels(tmp_path / "p.gpkg", 60)
    said = batch(places, "--out", tmp_path / "farm", "--progress", "json")
    told = [json.loads(line)["progress"] for line in said.splitlines() if '"progress"' in line]
    assert told[0]["done"] == 0
    assert told[-1]["done"] == told[-1]["total"] == 60
    assert {"failed", "per_minute", "left_s", "what"} <= told[-1].keys()


def killing(folder: Path, body: str) -> dict[str, str]:
    """An environment in which a worker does something bad at the field p3."""
    folder.mkdir()
    (folder / "sitecustomize.py").write_text(
        "import sys\n"
        "if sys.argv[-1:] and 'worker' in ' '.join(sys.orig_argv):\n"
        "    import geofield.farm.chunk as chunk\n"
        "    plain = chunk.plan_place\n"
        "    def bad(place, job, previous=None):\n"
        f"        if place.field_id == 'p3':\n            {body}\n"
        "        return plain(place, job, previous)\n"
        "    chunk.plan_place = bad\n"
    )
    return {**os.environ, "PYTHONPATH": str(folder)}


@pytest.mark.parametrize(
    ("body", "options", "status", "words"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", (), "lost", "2 times"),
        ("import time; time.sleep(1000)", ("--time-limit", "2"), "failed", "time limit of 2 s"),
        ("globals().update(x=bytearray(900_000_000)); import time; time.sleep(100)",
         ("--memory-limit", "700"), "failed", "memory limit of 700 MB"),
        ("raise RuntimeError('odd')", (), "failed", "RuntimeError: odd"),
    ],
)  # fmt: skip
def test_a_bad_field_does_not_take_others_with_it(
    body: str, options: tuple[str, ...], status: str, words: str, tmp_path: Path
) -> None:
    places = parcels(tmp_path / "p.gpkg", 10)
    line = [GEOFIELD, "batch", str(places), "--out", str(tmp_path / "farm"), "--workers", "1"]
    done = subprocess.run([*line, *options], capture_output=True, text=True, timeout=300,
                          check=False, env=killing(tmp_path / "bad", body))  # fmt: skip
    assert done.returncode == 0, done.stderr
    whole = read_farm(tmp_path / "farm")
    assert len(whole) == 9
    row = whole.status.set_index("field_id").loc["p3"]
    assert row["status"] == status
    assert words in row["error"]
    # And without what was bad, it is done.
    batch(*line[2:], "--retry")
    assert len(read_farm(tmp_path / "farm")) == 10


def test_what_a_person_put_back_stays(tmp_path: Path) -> None:
    places = parcels(tmp_path / "p.gpkg", 20)
    batch(places, "--spacing", 5, "--out", tmp_path / "farm")
    untouched = layers_of(tmp_path / "farm")
    mine = tmp_path / "p4.gpkg"
    run_geofield("farm", "get", tmp_path / "farm", "p4", "-o", mine, check=True)
    outline = gpd.read_file(mine, layer="field")
    outline.geometry = outline.geometry.buffer(-3.0, join_style="mitre")
    outline.to_file(mine, layer="field", driver="GPKG")
    run_geofield("tracks", mine, "--spacing", 5, "-o", mine, check=True)
    run_geofield("farm", "put", mine, tmp_path / "farm", check=True)
    edited = gf.read_plan(mine)
    whole = read_farm(tmp_path / "farm")
    assert whole["p4"] == edited
    assert len(whole) == 20
    assert bool(whole.status.set_index("field_id").loc["p4", "reviewed"])
    assert layers_of(tmp_path / "farm") != untouched
    # The chunk planned again from the places: the person's word stands.
    (tmp_path / "farm" / "status" / "chunk=0000" / "part-0.parquet").unlink()
    kept = layers_of(tmp_path / "farm")
    batch(places, "--spacing", 5, "--out", tmp_path / "farm")
    now = layers_of(tmp_path / "farm")
    # The overview tells, besides, that the outline is not that of the places.
    assert {**now, "farm.gpkg": kept["farm.gpkg"]} == kept
    notes = read_farm(tmp_path / "farm").status.set_index("field_id")["notes"]
    assert "reviewed outline stands" in notes["p4"]
    # With another spacing the tracks are new, and the outline is theirs.
    batch(places, "--spacing", 8, "--fresh", "--out", tmp_path / "farm")
    again = read_farm(tmp_path / "farm")["p4"]
    assert again.tracks.spacing_m == 8.0
    assert again.field.polygon.equals(edited.field.polygon)


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("none.csv", "--out", "farm"), 2, "no file none.csv"),
        (("empty.csv", "--out", "farm"), 1, "empty"),
        (("points.csv", "--out", "farm"), 1, "points"),
        (("points.csv", "none.tif", "--out", "farm"), 2, "none.tif"),
        (("p.gpkg", "--id-column", "nr", "--out", "farm"), 1, "no column 'nr'"),
        (("p.gpkg", "--id-column", "crop", "--out", "farm"), 1, "more than once"),
        (("p.gpkg", "google", "--out", "farm"), 1, "forbid"),
        (("p.gpkg", "--out", "thesis"), 1, "not empty"),
        (("p.gpkg", "--spacing", "-1", "--out", "farm"), 2, "--spacing: input"),
        (("p.gpkg", "--out", "p.gpkg"), 1, "p.gpkg"),
        (("p.gpkg", "--scheduler", "x", "--workers", "2", "--out", "farm"), 2, "not both"),
        (("two.gpkg", "--out", "farm"), 1, "--layer"),
    ],
)
def test_bad_input_is_told_and_leaves_nothing(
    arguments: tuple[str, ...], code: int, words: str, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GEOFIELD_KEY_GOOGLE", "mine")
    places = parcels(tmp_path / "p.gpkg", 4)
    gpd.read_file(places).to_file("two.gpkg", layer="a")
    gpd.read_file(places).to_file("two.gpkg", layer="b")
    Path("empty.csv").write_text("lat,lon\n")
    Path("points.csv").write_text("lat,lon\n35.07,33.53\n")
    Path("thesis").mkdir()
    Path("thesis/text.txt").write_text("years of work")
    said = batch(*arguments, code=code)
    assert words in said
    left = set(Path("farm").rglob("*")) if Path("farm").exists() else set()
    assert not {path for path in left if path.suffix == ".parquet"}
    assert [each.name for each in Path("thesis").iterdir()] == ["text.txt"]


def test_a_cluster_needs_the_extra(tmp_path: Path) -> None:
    words = (parcels(tmp_path / "p.gpkg", 4), "--scheduler", "tcp://127.0.0.1:9")
    said = batch(*words, "--out", tmp_path / "farm", code=1, without=["distributed"])
    assert "pip install geofield[batch]" in said
    assert not list((tmp_path / "farm").rglob("*"))


def test_parcels_without_shape_fail_alone(tmp_path: Path) -> None:
    frame = gpd.read_file(parcels(tmp_path / "p.gpkg", 4))
    frame.loc[1, "geometry"] = None
    # A point that came along with a parcel is no field.
    third = frame.geometry[2]
    frame.loc[2, "geometry"] = shapely.GeometryCollection([third, third.centroid])
    frame["photo"] = [b"\xff\xd8"] * 4
    frame.to_parquet(tmp_path / "odd.parquet")
    said = batch(
        tmp_path / "odd.parquet", "--spacing", 20, "--workers", 1, "--out", tmp_path / "farm"
    )
    assert "4 of 4: 3 done, 1 failed" in said
    assert "1 place has no plan" in said
    failed = pd.read_csv(tmp_path / "farm" / "failed.csv")
    assert failed["error"].to_list() == ["The row has no position."]
    assert failed["hint"].to_list() == ["Give it a shape, or a latitude and a longitude."]
    assert failed["photo"].to_list() == ["ffd8"]
    overview = tmp_path / "farm" / "farm.gpkg"
    assert [len(gpd.read_file(overview, layer=one)) for one in ("field", "places")] == [3, 3]


def test_parcels_that_overlap_are_told(tmp_path: Path) -> None:
    frame = gpd.read_file(parcels(tmp_path / "p.gpkg", 4))
    frame.loc[1, "geometry"] = shapely.affinity.translate(frame.geometry[0], 0.0003)
    frame.to_file(tmp_path / "over.gpkg")
    said = batch(tmp_path / "over.gpkg", "--out", tmp_path / "farm")
    assert "2 parcels overlap others, such as p0: it overlaps p1 by 0.3" in said
    notes = read_farm(tmp_path / "farm").status.set_index("field_id")["notes"]
    assert "overlaps p0" in notes["p1"]
    assert notes["p3"] == ""


def test_an_overview_of_one_field_is_geofields_own(tmp_path: Path) -> None:
    gpd.read_file(parcels(tmp_path / "p.gpkg", 2)).iloc[:1].to_file(tmp_path / "one.gpkg")
    batch(tmp_path / "one.gpkg", "--spacing", 8, "--out", tmp_path / "farm")
    assert "no fault found" in told_by(run_geofield("validate", tmp_path / "farm"), 0)


def test_two_runs_do_not_write_into_one_farm(tmp_path: Path) -> None:
    from geofield.staging import claimed

    places = parcels(tmp_path / "p.gpkg", 4)
    with claimed(tmp_path / "farm"):
        said = batch(places, "--out", tmp_path / "farm", code=1)
    assert "Another geofield" in said


def test_a_store_that_may_not_be_written_is_told_without_its_key(tmp_path: Path) -> None:
    class Denying(http.server.BaseHTTPRequestHandler):
        def answer(self) -> None:
            self.rfile.read(int(self.headers.get("Content-Length") or 0))
            writes = self.command in ("PUT", "POST")
            body = b"<ListBucketResult><KeyCount>0</KeyCount></ListBucketResult>"
            if writes:
                body = b"<Error><Code>AccessDenied</Code><Message>Denied</Message></Error>"
            self.send_response(403 if writes else 404 if self.command == "HEAD" else 200)
            self.send_header("Content-Type", "application/xml")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            if self.command != "HEAD":
                self.wfile.write(body)

        def log_message(self, *_: object) -> None: ...

    for verb in ("GET", "PUT", "HEAD", "POST", "DELETE"):
        setattr(Denying, f"do_{verb}", Denying.answer)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Denying)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    place = f"127.0.0.1:{server.server_port}"
    said = batch(
        parcels(tmp_path / "p.gpkg", 4), "--out",
        f"s3://key:secret@bucket/farm?scheme=http&endpoint_override={place}", code=1,
    )  # fmt: skip
    server.shutdown()
    server.server_close()
    assert "s3://bucket/farm cannot be written" in said
    assert "permissions" in said
    assert "secret" not in said


@pytest.mark.parametrize(
    ("answers", "words"),
    [
        ({"tcp://a": ("9.9.9", True)}, "has geofield 9.9.9; here it is"),
        ({"tcp://a": (gf.__version__, False)}, "does not see"),
        ({"tcp://a": ModuleNotFoundError("No module named 'geofield'")}, "has no geofield"),
    ],
)
def test_workers_that_cannot_do_the_work_are_refused(
    answers: dict[str, object], words: str, tmp_path: Path
) -> None:
    from geofield.farm.cluster import Cluster
    from geofield.farm.store import Store

    class Client:
        def nthreads(self) -> dict[str, int]:
            return {"tcp://a": 1}

        def run(self, *_: object, **__: object) -> dict[str, object]:
            return answers

    with pytest.raises(gf.GeofieldError, match=words):
        Cluster(Client()).check(Store.of(tmp_path))
    assert not list(tmp_path.rglob("probe*"))


def at_work(farm: Path) -> set[str]:
    """The places that workers are at: the last note on each chunk."""
    notes: set[str] = set()
    for file in (farm / ".work").glob("*.marks"):
        with suppress(FileNotFoundError):
            notes.update(f"{file.name} {line}" for line in file.read_text().splitlines()[-1:])
    return notes


def test_workers_that_are_killed_do_no_harm(farm: Path, tmp_path: Path) -> None:
    import psutil

    line = [GEOFIELD, "batch", str(farm.parent / "parcels.gpkg"), "--spacing", "5", "--out",
            str(tmp_path / "farm"), "--workers", "2"]  # fmt: skip
    process = subprocess.Popen(line, stderr=subprocess.PIPE, text=True)
    killed = 0
    before: set[str] = set()
    while process.poll() is None and killed < 3:
        # A place that ends its worker twice would be lost, as it should be.
        if (now := at_work(tmp_path / "farm")) and now.isdisjoint(before):
            children = psutil.Process(process.pid).children()
            if children:
                children[killed % len(children)].kill()
                killed, before = killed + 1, before | now
                time.sleep(1.0)
        time.sleep(0.005)
    process.communicate(timeout=200)
    assert process.returncode == 0
    assert killed
    assert layers_of(tmp_path / "farm") == layers_of(farm)
