"""Outlines against their truth, and against four other ways, in one run.

    python benchmarks/field.py [--fields 51] [--peers 12] [--seeds 10] [--seed-fields 10]

Real fields are those of `field_truth.csv` beside the project; without it only simulated
ones are measured.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
import platform
import resource
import statistics
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path

import numpy as np
import shapely
from rasterio.features import rasterize
from scipy import ndimage

from geofield.errors import GeofieldError
from geofield.field import extract_field
from geofield.imagery import read_scene
from geofield.model import Scene
from geofield.simulate import SimulationSettings, simulate_field, simulate_fields

SHARED = Path(os.environ.get("GEOFIELD_SHARED", Path(__file__).parents[2] / "shared"))
RESULTS = Path(__file__).parent / "results" / "field.md"
#: Simulation seed of the 51 fields; the weights of `auto` were learned on other seeds.
SEED = 7
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


def overlap_mask(mask: np.ndarray, truth: shapely.Polygon) -> float:
    true = rasterize([(truth, 1)], mask.shape).astype(bool)
    mask = ndimage.binary_fill_holes(mask)
    return float((mask & true).sum() / max((mask | true).sum(), 1))


def overlap(found: shapely.Polygon, truth: shapely.Polygon) -> float:
    return found.intersection(truth).area / found.union(truth).area


def real() -> Iterator[tuple[str, Scene, float, float, shapely.Polygon]]:
    folder = SHARED / "data" / "trees"
    table = folder / "field_truth.csv"
    if not table.is_file():
        return
    with table.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            scene = read_scene(folder / f"{row['image']}.tif")
            x, y = float(row["seed_x_px"]), float(row["seed_y_px"])
            truth = shapely.Polygon(json.loads(row["polygon_px"]))
            yield f"{row['image']} ({x:.0f}, {y:.0f})", scene, x, y, truth


def simulated(count: int) -> Iterator[tuple[str, Scene, float, float, shapely.Polygon]]:
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fields", type=int, default=51)
    parser.add_argument("--peers", type=int, default=12, help="simulated fields for the peers")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--seed-fields", type=int, default=10)
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
    for name, scene, x, y, truth in real():
        row = {"auto": overlap(auto(scene, x, y)[0], truth)}
        row["study"] = overlap(study(scene, x, y)[0], truth)
        row |= {peer: overlap_mask(run(scene, x, y), truth) for peer, run in PEERS.items()}
        for each in names:
            table[each].append(row[each])
        say(f"| {name} | " + " | ".join(f"{row[each]:.3f}" for each in names) + " |")
    if table["auto"]:
        means = " | ".join(f"{np.mean(table[each]):.3f}" for each in names)
        say(f"| **mean** | {means} |")
    say()
    say(f"## {options.fields} simulated fields, 640 x 640 px (peers: the first {options.peers})")
    say()
    say("| method | mean | median | worst | equal brightness, mean | seconds |")
    say("|---|---|---|---|---|---|")
    scores: dict[str, list[float]] = {name: [] for name in names}
    equal: dict[str, list[float]] = {name: [] for name in names}
    seconds: dict[str, list[float]] = {name: [] for name in names}
    silent = 0
    for index, (name, scene, x, y, truth) in enumerate(simulated(options.fields)):
        for each in names if index < options.peers else ["auto", "study"]:
            start = time.process_time()
            if each in PEERS:
                score = overlap_mask(PEERS[each](scene, x, y), truth)
            else:
                polygon, trusted = (auto if each == "auto" else study)(scene, x, y)
                score = overlap(polygon, truth)
                silent += each == "auto" and trusted and score < 0.9
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
    say(f"Outlines of `auto` below 0.9 that were not flagged: {silent} of {options.fields}.")
    say()
    say(f"## {options.seeds} random seeds (also on crowns) in each of {options.seed_fields} fields")
    say()
    rng = np.random.default_rng(1)
    means, every = [], []
    for _, scene, _, _, truth in simulated(options.seed_fields):
        got = [
            overlap(auto(scene, x, y)[0], truth) for x, y in random_seeds(truth, options.seeds, rng)
        ]
        means.append(float(np.mean(got)))
        every += got
    say("| | mean | median | worst |")
    say("|---|---|---|---|")
    say(f"| mean of a field | {summary(means)} |")
    say(f"| single seeds | {summary(every)} |")
    say()
    say(f"Seeds at or above 0.95: {np.mean(np.array(every) >= 0.95):.0%}.")
    say()
    say("## A large picture")
    say()
    big = simulate_field(3, SimulationSettings(width_px=4000, height_px=4000, resolution_m=0.2))
    x, y = big.scene.grid.from_lonlat(big.lon, big.lat)
    start = time.process_time()
    polygon, _ = auto(big.scene, x, y)
    spent = time.process_time() - start
    score = overlap(polygon, big.field.polygon_px(big.scene.grid))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    say(
        f"4000 x 4000 px: {spent:.1f} s, overlap {score:.3f}; peak memory of the whole run, "
        f"simulation included, {peak:.2f} GiB."
    )
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
