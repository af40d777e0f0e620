"""Outlines against their truth, and against four other ways, in one run.

    python benchmarks/field.py [--fields 51] [--peers 12] [--seeds 10] [--seed-fields 51]

Real fields are those of `field_truth.csv` beside the project; without it only simulated
ones are measured.
"""

from __future__ import annotations

import argparse
import math
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from scipy import ndimage

from common import DATA, RESULTS, digitised, overlap, overlap_mask
from geofield.errors import GeofieldError
from geofield.field import extract_field
from geofield.imagery import write_scene
from geofield.model import Scene
from geofield.simulate import SimulationSettings, simulate_field, simulate_fields

#: Simulation seed of the 51 fields; the weights of `auto` were learned on other seeds.
SEED, CROWDED_SEED = 7, 4000
KINDS = {
    "plain": "640 x 640 px, 3 to 25 crowns",
    "crowded": "480 x 480 px, 10 to 60 crowns",
}
Case = tuple[str, Scene, float, float, shapely.Polygon]
Say = Callable[..., None]
Method = Callable[[Scene, float, float], np.ndarray]


def at(labels: np.ndarray, x: float, y: float) -> np.ndarray:
    return labels == labels[int(y), int(x)]


def otsu(scene: Scene, x: float, y: float) -> np.ndarray:
    from skimage.filters import threshold_otsu

    bright = scene.grey > threshold_otsu(scene.grey)
    bright = bright if bright[int(y), int(x)] else ~bright
    return at(ndimage.label(bright, np.ones((3, 3)))[0], x, y)


def flood(scene: Scene, x: float, y: float) -> np.ndarray:
    from skimage.segmentation import flood as fill

    smooth = ndimage.median_filter(scene.grey, 5)
    return fill(smooth, (int(y), int(x)), tolerance=0.5 * smooth.std())


def felzenszwalb(scene: Scene, x: float, y: float) -> np.ndarray:
    from skimage.segmentation import felzenszwalb as segment

    return at(segment(scene.rgb, scale=600, sigma=1.0, min_size=400), x, y)


def random_walker(scene: Scene, x: float, y: float) -> np.ndarray:
    """A disc at the seed against the picture's frame, at half the resolution."""
    from skimage.segmentation import random_walker as walk

    half = scene.rgb[::2, ::2].astype(float)
    markers = np.zeros(half.shape[:2], int)
    markers[[0, -1], :] = markers[:, [0, -1]] = 2
    row, column = np.indices(markers.shape)
    markers[np.hypot(row - y / 2, column - x / 2) < 6] = 1
    found = walk(half, markers, beta=800, mode="cg_j", tol=1e-3, channel_axis=-1) == 1
    large = np.repeat(np.repeat(found, 2, 0), 2, 1)
    return large[: scene.grid.height_px, : scene.grid.width_px]


PEERS: dict[str, Method] = {
    "Otsu + components": otsu,
    "scikit-image flood": flood,
    "felzenszwalb + seed": felzenszwalb,
    "random walker": random_walker,
}


def ours(method: str) -> Callable[[Scene, float, float], tuple[shapely.Polygon, bool]]:
    def run(scene: Scene, x: float, y: float) -> tuple[shapely.Polygon, bool]:
        lon, lat = scene.grid.to_lonlat(x, y)
        try:
            field = extract_field(scene, lat=lat, lon=lon, method=method, holes="fill")
        except GeofieldError:
            return shapely.Polygon(), False
        return field.polygon_px(scene.grid), field.quality is None or field.quality.trusted

    return run


def crowded(count: int) -> Iterator[Case]:
    """Small fields full of crowns."""
    rng = np.random.default_rng(CROWDED_SEED)
    for index in range(count):
        settings = SimulationSettings(
            width_px=480,
            height_px=480,
            obstacles=int(rng.integers(10, 61)),
            equal_brightness=index % 3 == 0,
        )
        one = simulate_field(CROWDED_SEED + index, settings)
        x, y = one.scene.grid.from_lonlat(one.lon, one.lat)
        kind = "equal" if index % 3 == 0 else "other"
        yield f"{kind} {index}", one.scene, x, y, one.field.polygon_px(one.scene.grid)


def simulated(count: int) -> Iterator[Case]:
    for index, one in enumerate(simulate_fields(count, SEED)):
        x, y = one.scene.grid.from_lonlat(one.lon, one.lat)
        kind = "equal" if index % 3 == 0 else "other"
        yield f"{kind} {index}", one.scene, x, y, one.field.polygon_px(one.scene.grid)


def summary(values: list[float]) -> str:
    if not values:
        return "- | - | -"
    return f"{np.mean(values):.3f} | {statistics.median(values):.3f} | {min(values):.3f}"


def random_seeds(truth: shapely.Polygon, count: int, rng: np.random.Generator) -> list[tuple]:
    x0, y0, x1, y1 = truth.bounds
    found: list[tuple[float, float]] = []
    while len(found) < count:
        x, y = rng.uniform(x0, x1), rng.uniform(y0, y1)
        if truth.buffer(-5).contains(shapely.Point(x, y)):
            found.append((x, y))
    return found


def compare(kind: str, fields: Iterable[Case], options: argparse.Namespace, say: Say) -> None:
    """Simulated fields: every method's overlaps, and which wrong outlines were not flagged."""
    say(f"## {options.fields} simulated fields, {KINDS[kind]} (peers: the first {options.peers})")
    say()
    say("| method | mean | median | worst | equal brightness, mean | seconds |")
    say("|---|---|---|---|---|---|")
    names = ["auto", "study", *PEERS]
    scores: dict[str, list[float]] = {name: [] for name in names}
    equal: dict[str, list[float]] = {name: [] for name in names}
    seconds: dict[str, list[float]] = {name: [] for name in names}
    wrong = silent = flagged = 0
    for index, (name, scene, x, y, truth) in enumerate(fields):
        for each in names if index < options.peers else ["auto", "study"]:
            start = time.process_time()
            if each in PEERS:
                score = overlap_mask(PEERS[each](scene, x, y), truth)
            else:
                polygon, trusted = ours(each)(scene, x, y)
                score = overlap(polygon, truth)
                if each == "auto":
                    wrong += score < 0.9
                    silent += trusted and score < 0.9
                    flagged += not trusted and score >= 0.9
            seconds[each].append(time.process_time() - start)
            scores[each].append(score)
            if name.startswith("equal"):
                equal[each].append(score)
    for each in names:
        say(
            f"| {each} | {summary(scores[each])} | {np.mean(equal[each] or [math.nan]):.3f} | "
            f"{statistics.median(seconds[each]):.2f} |"
        )
    say()
    say(
        f"Outlines of `auto` below 0.9: {wrong}, of them not flagged: {silent}; flagged though "
        f"0.9 or better: {flagged}."
    )
    say()


def seeds(options: argparse.Namespace, say: Say) -> None:
    """Whether it matters where in the field the point is."""
    say(f"## {options.seeds} random seeds (also on crowns) in each of {options.seed_fields} fields")
    say()
    rng = np.random.default_rng(1)
    means, every = [], []
    for _, scene, _, _, truth in simulated(options.seed_fields):
        got = [
            overlap(ours("auto")(scene, x, y)[0], truth)
            for x, y in random_seeds(truth, options.seeds, rng)
        ]
        means.append(float(np.mean(got)))
        every += got
    say("| | mean | median | worst |")
    say("|---|---|---|---|")
    say(f"| mean of a field | {summary(means)} |")
    say(f"| single seeds | {summary(every)} |")
    say()
    say(
        f"Fields with a mean at or above 0.95: {np.mean(np.array(means) >= 0.95):.0%}; single "
        f"seeds: {np.mean(np.array(every) >= 0.95):.1%}."
    )
    say()


CHILD = """
import sys, time
from pathlib import Path
from geofield.field import extract_field
from geofield.imagery import read_scene
scene = read_scene(sys.argv[1])
before = time.process_time()
field = extract_field(scene, lat=float(sys.argv[2]), lon=float(sys.argv[3]))
spent = time.process_time() - before
# Not ru_maxrss: that begins with the parent's.
status = Path("/proc/self/status").read_text().splitlines()
peak = next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))
print(spent, peak / 2**20)
print(field.polygon_px(scene.grid).wkt)
"""


def large(say: Say) -> None:
    """Time and memory of a large picture, in a process of its own."""
    say("## A large picture")
    say()
    big = simulate_field(3, SimulationSettings(width_px=4000, height_px=4000, resolution_m=0.2))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.tif"
        write_scene(big.scene, path)
        told = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", CHILD, path, str(big.lat), str(big.lon)],
            capture_output=True,
            text=True,
            check=True,
        ).stdout.splitlines()
    spent, peak = map(float, told[0].split())
    outline: Any = shapely.from_wkt(told[1])
    score = overlap(outline, big.field.polygon_px(big.scene.grid))
    say(
        f"4000 x 4000 px: {spent:.1f} s, overlap {score:.3f}; peak memory of the process that "
        f"reads the picture and finds the field, {peak:.2f} GiB."
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fields", type=int, default=51)
    parser.add_argument("--peers", type=int, default=12, help="simulated fields for the peers")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--seed-fields", type=int, default=51)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    lines: list[str] = [
        "# Field outlines",
        "",
        f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, "
        f"scikit-image {version('scikit-image')}, SciPy {version('scipy')}. Overlap is "
        "intersection over union with holes filled; times are processor seconds of one "
        "thread, medians.",
        "",
    ]

    def say(line: str = "") -> None:
        print(line, flush=True)
        lines.append(line)

    auto, study = ours("auto"), ours("study")
    say("## Real fields, digitised by eye (+-2 px)")
    say()
    names = ["auto", "study", *PEERS]
    say("| field | " + " | ".join(names) + " |")
    say("|---" * (len(names) + 1) + "|")
    table: dict[str, list[float]] = {name: [] for name in names}
    flagged = 0
    for image, scene, x, y, truth in digitised(DATA / "trees" / "field_truth.csv", "trees"):
        name = f"{image} ({x:.0f}, {y:.0f})"
        polygon, trusted = auto(scene, x, y)
        row = {"auto": overlap(polygon, truth)}
        flagged += not trusted
        row["study"] = overlap(study(scene, x, y)[0], truth)
        row |= {peer: overlap_mask(run(scene, x, y), truth) for peer, run in PEERS.items()}
        for each in names:
            table[each].append(row[each])
        say(f"| {name} | " + " | ".join(f"{row[each]:.3f}" for each in names) + " |")
    if table["auto"]:
        means = " | ".join(f"{np.mean(table[each]):.3f}" for each in names)
        say(f"| **mean** | {means} |")
        say()
        say(
            "`auto` learned from these sites, too; `field_unseen.md` has figures of models that "
            f"have not seen the site. Flagged: {flagged}."
        )
    say()
    for kind, fields in (("plain", simulated), ("crowded", crowded)):
        compare(kind, fields(options.fields), options, say)
    seeds(options, say)
    large(say)
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "field.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
