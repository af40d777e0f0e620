"""Obstacle detection side by side with its peers, in one run.

    python benchmarks/obstacles.py [--quick] [--scan-step 0.05]

Prints Markdown tables and writes ``benchmarks/results/obstacles.md`` and the reliability
plot. Accuracy on the labelled chips beside the project (sites the network never saw) and on
simulated fields; speed on one core. ``--quick`` takes steps of 0.05 in the study's scan and a
third of the simulated fields; ``--scan-step`` sets the step alone, for at 0.001 the scan takes
hours.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pandas as pd
import rasterio
from matplotlib.figure import Figure
from matplotlib.path import Path as Ring
from skimage.feature import canny
from skimage.transform import hough_circle, hough_circle_peaks

import geofield as gf
from common import DATA, RESULTS, machine, write_page
from geofield.evaluation import match_points, reliability
from geofield.model.obstacles import active
from geofield.model.scene import Scene
from geofield.obstacles.crowns import answers
from geofield.obstacles.picture import tone_of, working_bands, working_factor
from geofield.simulate import SimulationSettings, simulate_fields
from geofield.study.phase_code import find_circles

Circles = tuple[np.ndarray, np.ndarray]
Detector = Callable[[Scene], Circles]


def chip(path: Path, bands: int = 4, finer: int = 1) -> Scene:
    """Read a chip: four bands, three, or their brightness; interpolated to smaller pixels."""
    with rasterio.open(path) as data:
        pixels = data.read()
        transform, crs = data.transform, data.crs
    roles: tuple[str, ...] = ("red", "green", "blue", "nir")[:bands]
    if bands == 1:
        grey = np.tensordot((0.298, 0.587, 0.114), pixels[:3].astype(float), 1)
        pixels, roles = np.clip(np.rint(grey), 0, 255).astype(np.uint8)[None], ("grey",)
    if finer > 1:
        size = tuple(n * finer for n in pixels.shape[:0:-1])
        pixels = np.stack([cv2.resize(b, size, interpolation=cv2.INTER_CUBIC) for b in pixels])
        transform = transform * rasterio.Affine.scale(1 / finer)
    pixels = np.ascontiguousarray(pixels[:bands])
    grid = gf.Grid(pixels.shape[2], pixels.shape[1], transform, crs)
    return Scene(grid, pixels, roles, np.ones(grid.shape, bool))


def of_table(table: Any) -> Circles:
    trees = active(table)
    trees = trees[trees["kind"] == "tree"]
    return trees[["x_px", "y_px"]].to_numpy(float), trees["radius_px"].to_numpy(float)


def ours(strategy: Any, **options: Any) -> Detector:
    return lambda scene: of_table(gf.detect_obstacles(scene, strategy=strategy, **options))


def opencv(param2: float, min_distance: float, mode: int = cv2.HOUGH_GRADIENT) -> Detector:
    def run(scene: Scene) -> Circles:
        grey = cv2.medianBlur(np.rint(scene.grey).astype(np.uint8), 3)
        found = cv2.HoughCircles(
            grey, mode, 1, min_distance, param1=80, param2=param2, minRadius=3, maxRadius=15
        )
        if found is None:
            return np.empty((0, 2)), np.empty(0)
        rows = np.asarray(found, dtype=float).reshape(-1, 3)
        return rows[:, :2] + 0.5, rows[:, 2]

    return run


def scikit_image(scene: Scene) -> Circles:
    edges = canny(scene.grey / 255, sigma=1.4)
    radii = np.arange(3, 16)
    space = hough_circle(edges, radii)
    _, x, y, r = hough_circle_peaks(
        space, radii, min_xdistance=4, min_ydistance=4, threshold=0.45, total_num_peaks=400
    )
    return np.column_stack([x + 0.5, y + 0.5]).astype(float), np.asarray(r, float)


def phase_code(scene: Scene) -> Circles:
    found = find_circles(scene.grey / 255, (4, 18), polarity="dark", sensitivity=0.93)
    return np.column_stack([found.x_px, found.y_px]), found.radius_px


BALANCED = 0.25
"""Confidence at which a miss and a false alarm weigh alike: that of the best F1."""


def f1(hits: float, detected: float, truth: float) -> float:
    return 2 * hits / max(detected + truth, 1)


def chips_row(detector: Detector, bands: int = 4, finer: int = 1) -> tuple[float, float, float]:
    """F1 at 6 px and 10 px inside the areas, and the median seconds per megapixel."""
    labels = pd.read_csv(DATA / "trees/trees.csv")
    counts = np.zeros(4)
    seconds = []
    for row in pd.read_csv(DATA / "trees/areas.csv").itertuples():
        scene = chip(DATA / "trees" / f"{row.image}.tif", bands, finer)
        start = time.perf_counter()
        xy = detector(scene)[0] / finer
        seconds.append((time.perf_counter() - start) / scene.valid.size * 1e6)
        # Labels count pixels from their centres, detections from the picture's corner.
        ring = Ring(np.array(json.loads(str(row.area_px))))
        truth = labels[labels.image == row.image][["x_px", "y_px"]].to_numpy(float) + 0.5
        truth = truth[ring.contains_points(truth)] if len(truth) else truth
        xy = xy[ring.contains_points(xy)] if len(xy) else xy
        for k, limit in enumerate((6, 10)):
            counts[k] += len(match_points(xy, truth, limit).truth_index)
        counts[2:] += len(xy), len(truth)
    return f1(counts[0], *counts[2:]), f1(counts[1], *counts[2:]), statistics.median(seconds)


def simulated_row(
    detector: Callable[[object], Circles], fields: int, empty_fields: int
) -> tuple[float, float, float]:
    """F1 at 6 px and radius bias on fields, false detections per tree-free field."""
    counts, bias = np.zeros(3), []
    for field in simulate_fields(fields, 7, SimulationSettings(width_px=400, height_px=400)):
        xy, radius = detector(field)
        true = field.obstacles[["x_px", "y_px"]].to_numpy(float)
        match = match_points(xy, true, 6)
        counts += len(match.truth_index), len(xy), len(true)
        difference = radius[match.detected_index]
        bias.extend(difference - field.obstacles["radius_px"].to_numpy()[match.truth_index])
    empty = SimulationSettings(width_px=400, height_px=400, obstacles=0)
    false = [len(detector(field)[0]) for field in simulate_fields(empty_fields, 8, empty)]
    return f1(*counts), float(np.mean(bias)) if bias else float("nan"), float(np.mean(false))


def in_field(run: Detector) -> Callable[[object], Circles]:
    def detect(field: object) -> Circles:
        xy, radius = run(field.scene)  # type: ignore[attr-defined]
        mask = field.field.mask(field.scene.grid)  # type: ignore[attr-defined]
        keep = mask[np.clip(xy[:, 1].astype(int), 0, mask.shape[0] - 1),
                    np.clip(xy[:, 0].astype(int), 0, mask.shape[1] - 1)]  # fmt: skip
        return xy[keep], radius[keep]

    return detect


def whole_detector(field: object, **options: Any) -> Circles:
    found = gf.detect_obstacles(field.scene, field.field, **options)  # type: ignore[attr-defined]
    # Whatever is driven around counts, polygons too.
    found = active(found)
    return found[["x_px", "y_px"]].to_numpy(float), found["radius_px"].fillna(0).to_numpy(float)


def reliability_row() -> tuple[float, int]:
    """Calibration of the confidence inside the areas, from 0.1 on; draws the plot."""
    labels = pd.read_csv(DATA / "trees/trees.csv")
    confidence, hit = [], []
    for row in pd.read_csv(DATA / "trees/areas.csv").itertuples():
        scene = chip(DATA / "trees" / f"{row.image}.tif")
        found = gf.detect_obstacles(scene, min_confidence=0.1)
        truth = labels[labels.image == row.image][["x_px", "y_px"]].to_numpy(float) + 0.5
        xy = found[["x_px", "y_px"]].to_numpy(float)
        keep = Ring(np.array(json.loads(str(row.area_px)))).contains_points(xy)
        match = match_points(xy, truth, 10)
        good = np.isin(np.arange(len(xy)), match.detected_index)
        confidence.extend(found["confidence"].to_numpy()[keep])
        hit.extend(good[keep])
    RESULTS.mkdir(exist_ok=True)
    mean, share, count, error = reliability(confidence, hit)
    figure = Figure((5, 5))
    axes = figure.subplots()
    axes.axline((0, 0), slope=1, color="gray")
    # Bars: how many detections there are at this confidence.
    axes.bar(np.arange(0.05, 1, 0.1), 0.2 * count / count.max(), 0.08, color="lightgray")
    axes.plot(mean[count > 0], share[count > 0], "o-")
    axes.set(xlabel="confidence", ylabel="share of hits", title=f"calibration error {error:.3f}")
    figure.savefig(RESULTS / "reliability.png")
    return error, len(hit)


def seconds_of(function: Callable[[], object], repeat: int = 3) -> float:
    times = []
    for _ in range(repeat):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def speed_rows() -> list[str]:
    """Seconds on a mosaic of sixteen chips (1024 x 1024 px), median of three."""
    paths = sorted((DATA / "trees").glob("*.tif"))[:16]
    tiles = [chip(path) for path in paths]
    pixels = np.concatenate(
        [np.concatenate([tiles[4 * j + i].bands for i in range(4)], axis=2) for j in range(4)],
        axis=1,
    )
    grid = gf.Grid(1024, 1024, tiles[0].grid.transform, tiles[0].grid.crs)
    scene = Scene(grid, pixels, tiles[0].roles, np.ones(grid.shape, bool))
    bands = working_bands(scene, tone_of(scene), working_factor(grid.ground_resolution_m))
    crop = scene.crop(100, 100, 300, 300)
    rows = [
        ("`auto`, all of it", seconds_of(lambda: gf.detect_obstacles(scene))),
        ("`auto`, the network alone", seconds_of(lambda: answers(bands))),
        ("PhaseCode, one call", seconds_of(lambda: phase_code(scene))),
        ("OpenCV HoughCircles, GRADIENT", seconds_of(lambda: opencv(18, 6)(scene))),
        (
            "OpenCV HoughCircles, GRADIENT_ALT",
            seconds_of(lambda: opencv(0.5, 6, cv2.HOUGH_GRADIENT_ALT)(scene)),
        ),
        ("scikit-image hough_circle", seconds_of(lambda: scikit_image(scene))),
        (
            "DLC, 1204 settings, 300 x 300 px (s per scan)",
            seconds_of(lambda: gf.detect_obstacles(crop, strategy="dlc"), 1),
        ),
    ]
    mega = 1024 * 1024 / 1e6
    out = []
    for name, value in rows:
        shown = value if "DLC" in name else value / mega
        out.append(f"| {name} | {shown:.2f} |")
    return out


def accuracy(quick: bool, step: float) -> list[str]:
    """The tables on real chips and simulated fields."""
    lines = [
        *machine("opencv-python-headless"),
        "",
        "## Real chips, inside their areas (25 chips, 9 sites, none used for fitting)",
        "",
        "| detector | F1 at 6 px | F1 at 10 px | s per megapixel |",
        "| --- | --- | --- | --- |",
    ]
    fields, empty_fields = (17, 8) if quick else (51, 20)
    cases: list[tuple[str, Detector, int] | tuple[str, Detector, int, int]] = [
        ("**auto**, 4 bands", ours("auto", min_confidence=BALANCED), 4),
        ("**auto**, 3 bands", ours("auto", min_confidence=BALANCED), 3),
        ("**auto**, grey", ours("auto", min_confidence=BALANCED), 1),
        ("**auto**, 4 bands, interpolated to 0.3 m", ours("auto", min_confidence=BALANCED), 4, 2),
        ("**auto**, 3 bands, interpolated to 0.3 m", ours("auto", min_confidence=BALANCED), 3, 2),
        ("PhaseCode on grey, dark, 0.93", phase_code, 4),
        ("Sobel, default (`single`)", ours("single", radius_m=(2.4, 10.8)), 4),
        ("OpenCV HoughCircles, param2 8", opencv(8, 8), 4),
        ("OpenCV HoughCircles, param2 11", opencv(11, 8), 4),
        ("OpenCV HoughCircles, param2 14", opencv(14, 6), 4),
        ("scikit-image hough_circle", scikit_image, 4),
        (
            f"study's DLC + grey check, step {step:g}",
            ours("study_dlc", grey_check="absolute", threshold_range=(0.0, 0.3, step)),
            4,
        ),
    ]
    for name, detector, *what in cases:
        six, ten, seconds = chips_row(detector, *what)
        lines.append(f"| {name} | {six:.3f} | {ten:.3f} | {seconds:.2f} |")
        print(lines[-1], flush=True)
    error, count = reliability_row()
    if step > 0.001:
        lines += ["", f"The study scans in steps of 0.001; here {step:g}, for it takes hours."]
    lines += [
        "",
        f"Expected calibration error on these sites: {error:.3f} ({count} detections from "
        "confidence 0.1 on; `results/reliability.png`).",
        "",
        f"## Simulated fields ({fields} with trees, {empty_fields} without; polygons count)",
        "",
        "| detector | F1 at 6 px | radius bias, px | false per tree-free field |",
        "| --- | --- | --- | --- |",
    ]
    for name, run in [
        ("**auto**", whole_detector),
        ("PhaseCode on grey, dark, 0.93", in_field(phase_code)),
        ("OpenCV HoughCircles, param2 14", in_field(opencv(14, 6))),
        ("Sobel, default (`single`)", lambda f: whole_detector(f, strategy="single")),
    ]:
        score, bias, false = simulated_row(run, fields, empty_fields)
        lines.append(f"| {name} | {score:.3f} | {bias:+.2f} | {false:.2f} |")
        print(lines[-1], flush=True)
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--part", choices=("accuracy", "speed", "all"), default="all")
    parser.add_argument("--scan-step", type=float)
    given = parser.parse_args()
    if given.part != "speed":
        step = given.scan_step or (0.05 if given.quick else 0.001)
        write_page("obstacles", "Obstacle detection: accuracy", accuracy(given.quick, step))
    if given.part != "accuracy":
        head = [*machine("opencv-python-headless"), "", "1024 x 1024 px, median of three.", ""]
        table = ["| what | s per megapixel |", "| --- | --- |", *speed_rows()]
        write_page("obstacles_speed", "Obstacle detection: speed", [*head, *table])


if __name__ == "__main__":
    main()
