"""Many fields: places and parcels per core-hour, restarts, memory, the scheduler, faults.

python benchmarks/farm.py [--only PART ...] [--faults 50]

Parts: parcels, places, scheduler, faults. Each writes its own table, kept from earlier runs
where a part is left out.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import psutil
import shapely

from common import DATA, RESULTS, machine, write_page

GEOFIELD = str(Path(sys.executable).with_name("geofield"))
KEPT = RESULTS / "farm.json"
CORES = 2
PARCELS, PLACES, SIMULATED = 10_000, 24, 1_000_000
_ONE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "GDAL_NUM_THREADS"), "1")


class Run:
    """A command, its wall time, and what its processes held and used."""

    def __init__(self, *arguments: object) -> None:
        line = [GEOFIELD, *map(str, arguments)]
        begun = time.perf_counter()
        self.process = subprocess.Popen(
            line, stderr=subprocess.PIPE, text=True, env={**os.environ, **_ONE}
        )
        self.worker_mb = self.main_mb = 0.0
        self._cpu: dict[int, float] = {}
        watcher = threading.Thread(target=self._watch)
        watcher.start()
        _, self.said = self.process.communicate()
        self.seconds = time.perf_counter() - begun
        watcher.join()
        if self.process.returncode:
            raise SystemExit(self.said)

    @property
    def cpu_s(self) -> float:
        """Processor time of all its processes."""
        return sum(self._cpu.values())

    def _watch(self) -> None:
        main = psutil.Process(self.process.pid)
        while self.process.poll() is None:
            try:
                for one in (main, *main.children(recursive=True)):
                    held = one.memory_info().rss / 1e6
                    times = one.cpu_times()
                    self._cpu[one.pid] = times.user + times.system
                    if one.pid == main.pid:
                        self.main_mb = max(self.main_mb, held)
                    else:
                        self.worker_mb = max(self.worker_mb, held)
            except psutil.Error:
                pass
            time.sleep(0.1)


def many_parcels(count: int, path: Path) -> None:
    """The real parcels again and again, each turned and moved, with columns of a register."""
    real = gpd.read_file(DATA / "fields" / "fields.gpkg").to_crs(3035)
    rng = np.random.default_rng(1)
    shapes = []
    for number in range(count):
        shape = real.geometry.iloc[number % len(real)]
        middle = shape.centroid
        turned = shapely.affinity.rotate(shape, float(rng.uniform(0, 360)), origin=middle)
        east, north = divmod(number, 100)
        shapes.append(
            shapely.affinity.translate(
                turned, 4_300_000 + 900 * east - middle.x, 2_900_000 + 900 * north - middle.y
            )
        )
    frame = gpd.GeoDataFrame(
        {"id": range(count), "crop": ["rye", "oats"] * (count // 2), "year": 2026},
        geometry=shapes,
        crs=3035,
    )
    frame.to_file(path)


def parcels(folder: Path) -> list[str]:
    many_parcels(PARCELS, folder / "parcels.gpkg")
    line = ("batch", folder / "parcels.gpkg", "--spacing", 4, "--workers", CORES)
    out = ("--out", folder / "farm")
    first = Run(*line, *out, "--no-overview")
    again = Run(*line, *out, "--no-overview")
    overview = Run(*line, *out)
    parts = list((folder / "farm").rglob("*.parquet"))
    size = sum(each.stat().st_size for each in parts) / PARCELS
    return [
        f"{PARCELS} real parcels turned and moved, spacing 4 m, {CORES} workers on "
        f"{CORES} cores, load of the machine before: {os.getloadavg()[0]:.1f}.",
        "",
        "| work | seconds | goal |",
        "| --- | --- | --- |",
        f"| {PARCELS} parcels to the dataset | {first.seconds:.0f} "
        f"({first.cpu_s:.0f} of processor time) | 60 |",
        f"| restart with all of them done | {again.seconds:.1f} | 10 |",
        f"| the same with the overview for QGIS written | {overview.seconds:.0f} | |",
        "",
        f"Per parcel {1000 * first.cpu_s / PARCELS:.1f} ms of processor time and {size:.0f} bytes; "
        f"at most {first.worker_mb:.0f} MB per worker, {first.main_mb:.0f} MB in the main process.",
    ]


def places(folder: Path) -> list[str]:
    from geofield.imagery import write_scene
    from geofield.simulate import SimulationSettings, simulate_field

    pictures = folder / "pictures"
    pictures.mkdir()
    rows: list[dict[str, Any]] = []
    for seed in range(PLACES):
        settings = SimulationSettings(width_px=480, height_px=480, obstacles=15)
        made = simulate_field(seed, settings)
        write_scene(made.scene, pictures / f"{seed:03}.tif")
        rows.append({"id": seed, "lat": made.lat, "lon": made.lon})
    # All simulated fields lie at one place: each is a farm's picture of its own in the loop.
    loop = folder / "loop.py"
    loop.write_text(
        "import json, sys, time, cv2\n"
        "cv2.setNumThreads(1)\n"
        "from geofield import plan_field\n"
        "rows, took, cpu = json.load(open(sys.argv[1])), [], []\n"
        "for one in rows:\n"
        "    begun, used = time.perf_counter(), time.process_time()\n"
        "    plan_field(one['path'], lat=one['lat'], lon=one['lon'], size_m=400).to_dataset()\n"
        "    took.append(time.perf_counter() - begun)\n"
        "    cpu.append(time.process_time() - used)\n"
        "print(sum(took[1:]) / len(took[1:]), sum(cpu[1:]) / len(cpu[1:]))\n"
    )
    for seed, row in enumerate(rows):
        row["path"] = str(pictures / f"{seed:03}.tif")
    first = rows[0]
    same = [{**first, "id": number} for number in range(PLACES)]
    (folder / "rows.json").write_text(json.dumps(same))
    pd.DataFrame(same)[["id", "lat", "lon"]].to_csv(folder / "places.csv", index=False)
    done = subprocess.run(
        [sys.executable, loop, folder / "rows.json"], check=True, capture_output=True, text=True,
        env={**os.environ, **_ONE},
    )  # fmt: skip
    bare_s, bare_cpu_s = map(float, done.stdout.split())
    found, each_s = {}, {}
    for workers in (1, CORES):
        found[workers] = Run(
            "batch", folder / "places.csv", first["path"], "--size-m", 400, "--no-overview",
            "--workers", workers, "--out", folder / f"farm{workers}",
        )  # fmt: skip
        each_s[workers] = _steady_s(folder / f"farm{workers}")
    one = found[1]
    return [
        f"{PLACES} places of 480 x 480 px with outline, obstacles and tracks; load of the machine "
        f"before: {os.getloadavg()[0]:.1f}. The first place of each worker, which loads libraries "
        "and networks, is left out; so is the loop's. Seconds of processor time hang less on other "
        "work than those of the clock.",
        "",
        "| work | figure | goal |",
        "| --- | --- | --- |",
        f"| places per core-hour, in a worker | {3600 / each_s[1]:.0f} | 2500 |",
        f"| a bare loop of `plan_field` | {3600 / bare_s:.0f} per hour; "
        f"{3600 / bare_cpu_s:.0f} per hour of processor time, {bare_cpu_s:.2f} s each | |",
        f"| a place in a worker over the bare loop | "
        f"{100 * (each_s[1] / bare_s - 1):+.1f} % of the clock's time | 5 % |",
        f"| {CORES} workers | {CORES * each_s[1] / each_s[CORES]:.2f} x 1 worker | 1.85 x |",
        f"| whole command, 1 worker and {CORES} | {one.seconds:.0f} s, "
        f"{found[CORES].seconds:.0f} s, beginning included | |",
        f"| memory per worker | {max(each.worker_mb for each in found.values()):.0f} MB | 600 MB |",
    ]


def _steady_s(farm: Path) -> float:
    """Mean seconds of a place, without the first one of each worker."""
    status = gpd.read_parquet(farm / "status")
    return float(status[status.duplicated("worker")]["seconds"].mean())


def scheduler(folder: Path) -> list[str]:
    """A million places of no work through the scheduler of Dask."""
    from distributed import Client, LocalCluster

    from geofield.farm import read_places
    from geofield.farm.chunk import Orders, Task
    from geofield.farm.cluster import Cluster
    from geofield.farm.store import Store
    from geofield.farm.work import Job
    from geofield.settings import Settings

    rng = np.random.default_rng(2)
    table = pd.DataFrame(
        {
            "id": np.arange(SIMULATED),
            "lat": rng.uniform(47, 54, SIMULATED),
            "lon": rng.uniform(7, 14, SIMULATED),
            "crop": "rye",
        }
    )
    table.to_parquet(folder / "million.parquet")
    del table
    begun = time.perf_counter()
    found = read_places(folder / "million.parquet")
    order = found.order()
    ready = time.perf_counter() - begun
    size = 250
    chunks = -(-len(found) // size)
    orders = Orders(Store.of(folder / "none"), Job(Settings()))
    tasks = (Task(n, list(found.take(order[n * size : (n + 1) * size]))) for n in range(chunks))
    with LocalCluster(n_workers=CORES, threads_per_worker=1, dashboard_address=None) as machines:
        cluster = Cluster(Client(machines, set_as_default=False), no_work)
        begun = time.perf_counter()
        done = sum(one.counts["done"] for one in cluster.run(tasks, orders, threading.Event()))
        took = time.perf_counter() - begun
        cluster.close()
    held = psutil.Process().memory_info().rss / 1e6
    return [
        f"{done} places in {chunks} chunks of {size}, {CORES} workers, no work in them; load of "
        f"the machine before: {os.getloadavg()[0]:.1f}.",
        "",
        "| what | figure | goal |",
        "| --- | --- | --- |",
        f"| read a million places and put them in order | {ready:.1f} s | |",
        f"| through the scheduler | {took:.0f} s: {chunks / took:.0f} chunks, "
        f"{done / took:.0f} places per second | |",
        f"| memory of the main process, the scheduler in it | {held:.0f} MB | 1000 MB |",
    ]


def no_work(task: Any, orders: Any) -> Any:
    """What a worker does with a chunk when only the scheduler is measured."""
    from geofield.farm.chunk import Done

    return Done(task.chunk, {"done": len(task.places)})


def faults(folder: Path, count: int) -> list[str]:
    """SIGKILL of the main process, its workers, or all of them, at random moments."""
    many_parcels(1500, folder / "parcels.gpkg")
    line = ("batch", folder / "parcels.gpkg", "--workers", CORES, "--out")
    begun = time.perf_counter()
    Run(*line, folder / "right" / "farm")
    alone = time.perf_counter() - begun
    chance, hits = random.Random(3), {"main": 0, "worker": 0, "all": 0}
    rounds = 0
    differing = lost = 0
    while sum(hits.values()) < count:
        rounds += 1
        # The same name: it stands in the catalogue.
        target = folder / f"wrong{rounds}" / "farm"
        finished = False
        while not finished:
            process = subprocess.Popen(
                [GEOFIELD, *map(str, line), str(target)],
                stderr=subprocess.DEVNULL, env={**os.environ, **_ONE},
            )  # fmt: skip
            while process.poll() is None:
                time.sleep(chance.uniform(0.2, 0.5 * alone))
                if sum(hits.values()) >= count or process.poll() is not None:
                    process.wait()
                    break
                whom = chance.choice(list(hits))
                hits[whom] += _kill(process.pid, whom, chance)
            finished = process.wait() == 0
        differing += _differing(folder / "right" / "farm", target)
        status = gpd.read_parquet(target / "status")
        lost += int((status["status"] != "done").sum()) + abs(len(status) - 1500)
    return [
        f"{sum(hits.values())} times SIGKILL at random moments ({hits['main']} the main process, "
        f"{hits['worker']} a worker, {hits['all']} all at once) in {rounds} "
        "runs over 1500 parcels, each started again until it was done.",
        "",
        "| what | figure | goal |",
        "| --- | --- | --- |",
        f"| fields lost or double | {lost} | 0 |",
        f"| files that differ from an undisturbed run, or are left over | {differing} | 0 |",
    ]


def _kill(main: int, whom: str, chance: random.Random) -> int:
    """End a process; 1 where there was one."""
    try:
        tree = psutil.Process(main).children(recursive=True)
        # One that still loads has nothing to lose.
        targets = {"main": [main], "all": [main, *(each.pid for each in tree)]}.get(whom)
        if targets is None:
            workers = [each for each in tree if each.memory_info().rss > 1.5e8]
            targets = [chance.choice(workers).pid] if workers else []
        for pid in targets:
            os.kill(pid, signal.SIGKILL)
        return int(bool(targets))
    except (psutil.Error, ProcessLookupError):
        return 0


def _differing(right: Path, wrong: Path) -> int:
    """How many files differ, or are too many, but for the status, which tells seconds."""

    def of(farm: Path) -> dict[str, bytes]:
        return {
            str(file.relative_to(farm)): file.read_bytes()
            for file in farm.rglob("*")
            if file.is_file() and file.relative_to(farm).parts[0] != "status"
        }

    one, other = of(right), of(wrong)
    return sum(one.get(name) != other.get(name) for name in one.keys() | other.keys())


def main() -> None:
    parser = argparse.ArgumentParser()
    names = ("parcels", "places", "scheduler", "faults")
    parser.add_argument("--only", nargs="+", choices=names, default=names)
    parser.add_argument("--faults", type=int, default=50)
    asked = parser.parse_args()
    if not (DATA / "fields").is_dir():
        print("no real parcels beside the project: nothing measured")
        return
    kept: dict[str, list[str]] = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    for name in asked.only:
        with tempfile.TemporaryDirectory() as text:
            folder = Path(text)
            measure = {"parcels": parcels, "places": places, "scheduler": scheduler}
            kept[name] = faults(folder, asked.faults) if name == "faults" else measure[name](folder)
        KEPT.write_text(json.dumps(kept, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    titles = dict(zip(names, ("Parcels", "Places with detection", "The scheduler", "Faults"),
                      strict=True))  # fmt: skip
    lines = machine("pyarrow", "distributed")
    lines += [
        "",
        "Each part says the load of the machine when it began. Beyond the number of cores wall "
        "times are no measure of geofield, and processor time is up to three times too high.",
    ]
    for name in names:
        if name in kept:
            lines += ["", f"## {titles[name]}", "", *kept[name]]
    write_page("farm", "Many fields", lines)


if __name__ == "__main__":
    main()
