"""``geofield batch --scheduler``: a Dask cluster that somebody else started, and its accidents."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely

import geofield as gf
from geofield.farm import read_farm

BIN = Path(sys.executable).parent
PLACES = 600


class Daskers:
    """A scheduler and workers, as a person starts them in terminals."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.file = folder / "scheduler.json"
        self.scheduler = self.start("scheduler", "--port", "0", "--scheduler-file", self.file)
        until, said = time.monotonic() + 120, ""
        # The file is there before it is written.
        while not said.rstrip().endswith("}") and time.monotonic() < until:
            time.sleep(0.05)
            said = self.file.read_text() if self.file.exists() else ""
        self.address = json.loads(said)["address"]
        self.workers: list[subprocess.Popen[bytes]] = []

    def start(self, *words: object, **environment: str) -> subprocess.Popen[bytes]:
        line: list[str | Path] = [BIN / "dask", *map(str, words), "--no-dashboard"]
        return subprocess.Popen(
            line, cwd=self.folder, env={**os.environ, **environment},
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def hire(self, **environment: str) -> subprocess.Popen[bytes]:
        """One more worker, without a nanny that starts it again."""
        words = ("worker", self.address, "--nthreads", "1", "--no-nanny")
        self.workers.append(self.start(*words, **environment))
        return self.workers[-1]

    def close(self) -> None:
        for one in (*self.workers, self.scheduler):
            one.kill()
            one.wait()


@pytest.fixture
def daskers(tmp_path: Path) -> Iterator[Daskers]:
    (tmp_path / "dask").mkdir()
    found = Daskers(tmp_path / "dask")
    yield found
    found.close()


def parcels(path: Path, count: int) -> Path:
    rng = np.random.default_rng(3)
    row, column = np.divmod(np.arange(count), 25)
    corners = rng.uniform(0, 12, (count, 4, 2)) + np.array([[0, 0], [80, 0], [80, 60], [0, 60]])
    corners += np.stack([400_000 + 120 * column, 5_500_000 + 100 * row], axis=1)[:, None]
    frame = gpd.GeoDataFrame({"id": range(count)}, geometry=shapely.polygons(corners), crs=32632)
    frame.to_file(path)
    return path


def batch(*words: object) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [BIN / "geofield", "batch", *map(str, words)], stderr=subprocess.PIPE, text=True
    )


def until_begun(farm: Path) -> None:
    until = time.monotonic() + 120
    while not list(farm.glob("status/*/*.parquet")) and time.monotonic() < until:
        time.sleep(0.01)


def layers_of(farm: Path) -> dict[str, bytes]:
    return {
        str(file.relative_to(farm)): file.read_bytes()
        for file in farm.glob("*/*/*.parquet")
        if file.relative_to(farm).parts[0] != "status"
    }


def test_workers_and_a_scheduler_that_die_do_no_harm(daskers: Daskers, tmp_path: Path) -> None:
    places = parcels(tmp_path / "p.gpkg", PLACES)
    farm, right = tmp_path / "farm", tmp_path / "right"
    alone = batch(places, "--workers", 1, "--out", right)
    words = (places, "--scheduler", daskers.address, "--out", farm)
    daskers.hire()
    run = batch(*words)
    until_begun(farm)
    # Another worker takes over what the first one had begun.
    daskers.workers[0].kill()
    daskers.hire()
    done = len(list(farm.glob("status/*/*.parquet")))
    until = time.monotonic() + 120
    while len(list(farm.glob("status/*/*.parquet"))) == done and time.monotonic() < until:
        time.sleep(0.01)
    daskers.scheduler.send_signal(signal.SIGKILL)
    _, said = run.communicate(timeout=200)
    assert run.returncode == 1, said
    assert "The scheduler has gone" in said
    assert "Traceback" not in said, said[-3000:]
    assert 0 < len(read_farm(farm)) < PLACES
    # On this machine the rest is done, and nobody can tell.
    again = batch(places, "--workers", 1, "--out", farm)
    _, said = again.communicate(timeout=200)
    assert again.returncode == 0, said
    alone.communicate(timeout=200)
    assert layers_of(farm) == layers_of(right)
    assert set(read_farm(farm).status["status"]) == {"done"}


def test_a_worker_with_another_version_is_refused(daskers: Daskers, tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "sitecustomize.py").write_text(
        "import geofield\ngeofield.__version__ = '0.0.9'\n"
    )
    daskers.hire(PYTHONPATH=str(tmp_path / "old"))
    places = parcels(tmp_path / "p.gpkg", 4)
    run = batch(places, "--scheduler", daskers.address, "--out", tmp_path / "farm")
    _, said = run.communicate(timeout=200)
    assert run.returncode == 1, said
    assert "has geofield 0.0.9; here it is" in said
    assert "Traceback" not in said, said[-3000:]
    assert not list((tmp_path / "farm").rglob("*"))


def test_a_farm_stays_whole_where_nobody_can_do_the_work(tmp_path: Path) -> None:
    places = parcels(tmp_path / "p.gpkg", 4)
    farm = tmp_path / "farm"
    batch(places, "--workers", 1, "--spacing", 5, "--out", farm).communicate(timeout=200)
    before = {each: each.read_bytes() for each in farm.rglob("*") if each.is_file()}
    run = batch(places, "--spacing", 6, "--fresh", "--scheduler", "tcp://127.0.0.1:9",
                "--out", farm)  # fmt: skip
    _, said = run.communicate(timeout=200)
    assert run.returncode == 1
    assert "does not answer" in said
    assert {each: each.read_bytes() for each in farm.rglob("*") if each.is_file()} == before
    assert len(read_farm(farm)) == 4


def test_a_given_cluster_is_told_of_in_our_words(daskers: Daskers, tmp_path: Path) -> None:
    """Of the end of a connection Dask says nothing in between, and later what it likes."""
    daskers.hire()
    script = (
        "import logging\n"
        "from geofield.farm.cluster import Cluster, Store\n"
        "said = logging.getLogger('distributed.batched').info\n"
        f"own = Cluster.at({daskers.address!r}, Store({str(tmp_path)!r}))\n"
        "said('a comm is closed')\n"
        "own.close()\n"
        "said('a cluster of somebody else')\n"
    )
    line = [sys.executable, "-c", script]
    done = subprocess.run(line, capture_output=True, text=True, timeout=100, check=True)
    assert "a comm is closed" not in done.stderr
    assert "a cluster of somebody else" in done.stderr


def test_plans_of_a_cluster_are_those_of_this_process(tmp_path: Path) -> None:
    from distributed import Client

    # More than are in the scheduler at a time.
    places = parcels(tmp_path / "parcels.gpkg", 11)
    with Client(
        processes=False, protocol="tcp", host="127.0.0.1", n_workers=1, threads_per_worker=1,
        dashboard_address="127.0.0.1:0", set_as_default=False,
    ) as client:  # fmt: skip
        there = list(gf.plan_fields(places, spacing_m=10, client=client))
    here = {plan.field.field_id: plan for plan in gf.plan_fields(places, spacing_m=10)}
    assert len(there) == len(here) == 11
    assert all(plan == here[plan.field.field_id] for plan in there)
