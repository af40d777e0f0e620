"""The detection experiment of notebook 02: one picture, every method and strategy, scored.

A module of its own so that a pool of processes can run it.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import rasterio
import shapely
from scipy.optimize import linear_sum_assignment
from shapely import Polygon

import geofield as gf
from geofield.model import Scene
from geofield.simulate import SimulatedField, SimulationSettings, simulate_field

METHODS = ("canny", "sobel", "prewitt", "roberts")
#: Coarser than the study's steps of 0.001, so that the notebook takes minutes, not hours.
RANGES = {"sobel": (0.0, 0.3, 0.03), "canny": (0.0, 0.95, 0.095)}
CONSENSUS_RANGE = (0.03, 0.3, 0.09)


@dataclass(frozen=True)
class Trial:
    """What came out for one picture.

    `rows`: one dict per strategy with correct, missed, wrong; `scans`: per edge method the
    list of (threshold, detections); `chosen`: method and threshold of DLC.
    """

    name: str
    obstacles: int
    rows: list[dict[str, Any]]
    scans: dict[str, list[tuple[float, int]]] = field(default_factory=dict)
    chosen: tuple[str, float] = ("", 0.0)


def matched(found_px: np.ndarray, truth_px: np.ndarray, radius_px: float) -> int:
    """How many detections hit a tree of their own within a radius (one to one, Hungarian)."""
    if not len(found_px) or not len(truth_px):
        return 0
    distance = np.hypot(*(found_px[:, None] - truth_px[None]).transpose(2, 0, 1))
    # A pair too far apart costs so much that any pair near enough goes first.
    cost = np.where(distance <= radius_px, distance, 1e6)
    row, column = linear_sum_assignment(cost)
    return int((cost[row, column] < 1e6).sum())


def try_all(
    name: str,
    scene: Scene,
    outline: gf.Field | None,
    truth_px: np.ndarray,
    *,
    hit_px: float,
    area_px: Polygon | None = None,
) -> Trial:
    """Run every edge method and strategy on a picture and score it.

    Parameters
    ----------
    scene, outline
        The picture and the field in it; without an outline `area_px` says where to count.
    truth_px : array (n, 2)
        Centres of the true trees, pixels.
    hit_px : float
        Largest distance of a hit.
    """
    rows: list[dict[str, Any]] = []

    def detect(**options: Any) -> tuple[Any, np.ndarray]:
        table = gf.detect_obstacles(scene, outline, radius_m=(2.0, 9.0), **options)
        centres = table[["x_px", "y_px"]].to_numpy(float)
        if area_px is not None:
            centres = centres[shapely.contains_xy(area_px, centres)]
        return table.attrs["detection"], centres

    def score(strategy: str, centres: np.ndarray) -> None:
        correct = matched(centres, truth_px, hit_px)
        rows.append(
            {
                "name": name,
                "strategy": strategy,
                "correct": correct,
                "missed": len(truth_px) - correct,
                "wrong": len(centres) - correct,
            }
        )

    at_default = {}
    for method in METHODS:
        at_default[method] = detect(strategy="single", edge_method=method)[1]
        score(f"{method}, default", at_default[method])
    scans, best = {}, (0, "sobel", 0.0, np.empty((0, 2)))
    for method in METHODS:
        span = RANGES.get(method, RANGES["sobel"])
        how, centres = detect(strategy="t_range", edge_method=method, threshold_range=span)
        scans[method] = [tuple(pair) for pair in how["counts"][method]]
        if len(centres) > best[0]:
            best = (len(centres), method, how["threshold"], centres)
        if method == "sobel":
            score("T-range (Sobel)", centres)
    score("Max-of-All", max(at_default.values(), key=len))
    score("DLC", best[3])
    checked = detect(
        strategy="single", edge_method=best[1], threshold=best[2], grey_check="absolute"
    )[1]
    score("DLC + grey check", checked)
    score("consensus", detect(strategy="consensus", threshold_range=CONSENSUS_RANGE)[1])
    score("auto", detect(strategy="auto")[1])
    return Trial(name, len(truth_px), rows, scans, (best[1], best[2]))


def simulated(number: int, obstacles: int) -> SimulatedField:
    """Draw field `number` of the experiment, with so many trees; crowded ones need room."""
    size = 320 if obstacles <= 60 else 430
    settings = SimulationSettings(width_px=size, height_px=size, obstacles=obstacles)
    return simulate_field(9_000 + number, settings)


def simulated_trial(number: int, obstacles: int) -> Trial:
    """Try everything on field `number`."""
    made = simulated(number, obstacles)
    truth = made.obstacles[["x_px", "y_px"]].to_numpy(float)
    return try_all(f"{number}", made.scene, made.field, truth, hit_px=6.0)


def chip_trial(path: Path, hit_px: float = 10.0) -> Trial:
    """One labelled picture of real trees, inside its area."""
    trees = pd.read_csv(path.parent / "trees.csv")
    areas = pd.read_csv(path.parent / "areas.csv").set_index("image")
    polygon = Polygon(json.loads(areas.loc[path.stem, "area_px"]))
    with rasterio.open(path) as dataset:
        lon, lat = dataset.lnglat()
    scene = gf.read_scene(path, lat=lat, lon=lon)
    centres = trees.loc[trees["image"] == path.stem, ["x_px", "y_px"]].to_numpy(float)
    centres = centres[shapely.contains_xy(polygon, centres)]
    return try_all(path.stem, scene, None, centres, hit_px=hit_px, area_px=polygon)


def run_trials(function: Any, *columns: Iterable[Any], processes: int = 2) -> list[Trial]:
    """Run trials side by side."""
    with ProcessPoolExecutor(processes) as pool:
        return list(pool.map(function, *columns))


def totals(trials: list[Trial]) -> pd.DataFrame:
    """Sums over all pictures with precision, recall and F1, by strategy."""
    frame = pd.DataFrame([row for trial in trials for row in trial.rows])
    table = frame.groupby("strategy", sort=False)[["correct", "missed", "wrong"]].sum()
    table["precision"] = table.correct / (table.correct + table.wrong)
    table["recall"] = table.correct / (table.correct + table.missed)
    table["F1"] = 2 * table.correct / (2 * table.correct + table.wrong + table.missed)
    return table.round(3)
