"""Learn the weights with which `auto` chooses a region; says how well they do elsewhere.

    python benchmarks/field_choice.py [--fields 24] [--write]

Learned from simulated fields (other seeds than those of `benchmarks/field.py`), the real
fields of `field_truth.csv` and 20 more that were digitised by eye for this purpose
(`field_labels.csv` here; pictures beside the project). The weights maximise the expected
overlap under a softmax over each chain's candidates. "Left out" figures come from weights
that never saw the site.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import shapely
from rasterio.features import rasterize
from scipy.optimize import minimize

from geofield.field import auto, choice
from geofield.field.evidence import channels, gradient, whiten
from geofield.field.hierarchy import merge
from geofield.field.superpixels import borders, superpixels
from geofield.imagery import read_scene
from geofield.model import Scene
from geofield.simulate import simulate_fields

HERE = Path(__file__).parent
SHARED = Path(os.environ.get("GEOFIELD_SHARED", HERE.parents[1] / "shared"))
WEIGHTS = Path(choice.__file__).parent / "choice_weights.py"
SIMULATION_SEED = 11
#: Strength of the pull towards zero.
RIDGE = 3e-4
#: A choice this much worse than the best candidate costs half as much again.
BAD = 0.08

Case = tuple[str, Scene, float, float, shapely.Polygon]


def labelled() -> Iterator[Case]:
    data = SHARED / "data"
    tables = [(data / "trees" / "field_truth.csv", "trees"), (HERE / "field_labels.csv", None)]
    for table, folder in tables:
        if not (data / "trees").is_dir():
            return
        with table.open(newline="", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                scene = read_scene(data / (folder or row["folder"]) / f"{row['image']}.tif")
                place, _, site = row["image"].rpartition("_")
                site = f"{place.rpartition('_')[0]} {site}"
                truth = shapely.Polygon(json.loads(row["polygon_px"]))
                yield site, scene, float(row["seed_x_px"]), float(row["seed_y_px"]), truth


def simulated(count: int) -> Iterator[Case]:
    for index, one in enumerate(simulate_fields(count, SIMULATION_SEED)):
        x, y = one.scene.grid.from_lonlat(one.lon, one.lat)
        yield f"simulated {index % 4}", one.scene, x, y, one.field.polygon_px(one.scene.grid)


def more_seeds(case: Case, count: int, rng: np.random.Generator) -> Iterator[Case]:
    site, scene, *_, truth = case
    yield case
    row, column = np.nonzero(rasterize([(truth.buffer(-5), 1)], scene.grid.shape))
    for at in rng.integers(0, len(row), count):
        yield site, scene, column[at] + 0.5, row[at] + 0.5, truth


def measured(case: Case) -> tuple[np.ndarray, np.ndarray] | None:
    """Candidates' features and overlaps."""
    _, scene, x, y, truth = case
    factor = max(1, math.ceil(max(scene.grid.shape) / auto.COARSE_PX))
    seed = (x / factor, y / factor)
    stack = whiten(channels(scene, factor), seed)
    labels = superpixels(gradient(stack), auto.STEP_PX)
    count = int(labels.max()) + 1
    lines = borders(labels, stack)
    pairs = lines.pairs(count)
    tree = merge(np.bincount(labels.ravel(), minlength=count).astype(float), *pairs)
    found = choice.candidates(labels, tree, lines, pairs, auto.footing(labels, tree, seed))
    if not found:
        return None
    reduced = shapely.transform(truth, lambda c: c / factor)
    true = rasterize([(reduced, 1)], labels.shape).astype(bool)
    overlap = [(one.mask & true).sum() / (one.mask | true).sum() for one in found]
    seams, own = choice.features(found)
    before = np.vstack([np.zeros(seams.shape[1]), np.cumsum(seams, axis=0)[:-1]])
    return np.hstack([before, own]), np.array(overlap)


def learn(
    cases: list[tuple[np.ndarray, np.ndarray]], sites: list[str], tries: int = 3
) -> np.ndarray:
    # Every site counts the same, however many pictures and seeds it has.
    often = Counter(sites)
    share = np.array([(3.0 if s.startswith("sim") else 1.0) / often[s] for s in sites])
    share /= share.sum()

    def loss(weights: np.ndarray) -> tuple[float, np.ndarray]:
        total, slope = 0.0, np.zeros_like(weights)
        for part, (features, overlap) in zip(share, cases, strict=True):
            score = features @ weights
            belief = np.exp(score - score.max())
            belief /= belief.sum()
            worth = overlap - 0.5 * np.maximum(0, overlap.max() - BAD - overlap)
            mean = belief @ worth
            total -= part * mean
            slope -= part * (belief * (worth - mean)) @ features
        return total + RIDGE * weights @ weights, slope + 2 * RIDGE * weights

    found = [
        minimize(
            loss,
            np.random.default_rng(start).normal(0, 0.5, cases[0][0].shape[1]),
            jac=True,
            method="L-BFGS-B",
        )
        for start in range(tries)
    ]
    return min(found, key=lambda one: one.fun).x


def picked(case: tuple[np.ndarray, np.ndarray], weights: np.ndarray) -> float:
    return float(case[1][np.argmax(case[0] @ weights)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fields", type=int, default=24, help="simulated fields")
    parser.add_argument("--write", action="store_true", help="write choice_weights.py")
    options = parser.parse_args()
    rng = np.random.default_rng(0)
    sites, cases = [], []
    for given, extra in ((labelled(), 3), (simulated(options.fields), 1)):
        for case in given:
            for one in more_seeds(case, extra, rng):
                if (row := measured(one)) is not None:
                    sites.append(one[0])
                    cases.append(row)
    scale = np.concatenate([features for features, _ in cases]).std(axis=0) + 1e-9
    cases = [(features / scale, overlap) for features, overlap in cases]
    weights = learn(cases, sites, 6)
    left_out = np.zeros(len(cases))
    for site in sorted(set(sites)):
        kept = [i for i, name in enumerate(sites) if name != site]
        rest = learn([cases[i] for i in kept], [sites[i] for i in kept], 2)
        for index in np.flatnonzero(np.array(sites) == site):
            left_out[index] = picked(cases[index], rest)
    is_real = np.array([not site.startswith("simulated") for site in sites])
    print("| cases | best candidate | chosen | chosen, site left out |\n|---|---|---|---|")
    for name, which in (("real", is_real), ("simulated", ~is_real)):
        if which.any():
            at = np.flatnonzero(which)
            best = np.mean([cases[i][1].max() for i in at])
            chosen = np.mean([picked(cases[i], weights) for i in at])
            print(f"| {name} ({len(at)}) | {best:.3f} | {chosen:.3f} | {left_out[at].mean():.3f} |")
    if options.write:
        count = len(choice.TOLL_WEIGHTS)
        parts = np.split(weights / scale, [count])
        names = (
            ("Of what the merges so far show.", "TOLL_WEIGHTS"),
            ("Of the region's own outline.", "OWN_WEIGHTS"),
        )
        text = (
            '"""Weights of the choice of a region, as `benchmarks/field_choice.py` learned '
            'them."""\n\nimport numpy as np\n'
        )
        for (words, name), values in zip(names, parts, strict=True):
            rows = "".join(f"        {value:.4g},\n" for value in values)
            text += f"\n#: {words}\n{name} = np.array(\n    [\n{rows}    ]\n)\n"
        WEIGHTS.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
