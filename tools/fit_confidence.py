"""Fit the verifier of the obstacle detector and write its tables.

    python tools/fit_confidence.py [nir|rgb|grey ...]

Fitted on the pictures of `training_pictures.py`. Needs LightGBM (`pip install lightgbm`), which
the package itself does not: the fitted trees are written as JSON and evaluated with numpy.
Prints the cross-validated figures, sites held out: nothing that is judged saw the site it is
judged on, but for one thing: the decision's trees were fitted on scores of other sites, and
those scores' own trees had seen the site. ``--nested`` repeats that with scores that had not.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import lightgbm as lgb
import numpy as np
from scipy.spatial import cKDTree
from training_pictures import COPY, FIELD, REAL, Picture, chips, pictures
from verifier_tables import forest_table, write

from geofield.obstacles.auto import (
    LEAST_SCORE,
    Measured,
    cheap_measures,
    detections,
    measure,
    picture_channels,
)
from geofield.obstacles.channels import VARIANTS, Channels, Variant
from geofield.obstacles.features import FeatureTable
from geofield.obstacles.verifier import Verifier

TABLES = Path(__file__).resolve().parent.parent / "src/geofield/obstacles/tables"
FOLDS = 3
SEED = 7
HIT_PX = 10.0
STRICT_PX = 6.0
NEAR_PX = 3.5
GATE_LOSS = 0.01
SPACING_SHARE, SPACING_PX = 0.8, (6.0, 14.0)
WEIGHT = {REAL: 1.0, COPY: 0.5, FIELD: 0.5}
COMMON = {
    "bagging_fraction": 0.6,
    "bagging_freq": 1,
    "lambda_l2": 5.0,
    "max_bin": 63,
    "num_threads": 1,
    "verbose": -1,
    "seed": SEED,
    "deterministic": True,
    "force_row_wise": True,
}
SCORE = COMMON | {
    "objective": "cross_entropy",
    "learning_rate": 0.05,
    "num_leaves": 31,
    "min_data_in_leaf": 150,
    "feature_fraction": 0.2,
}
SPACING = SCORE | {
    "objective": "quantile",
    "alpha": 0.35,
    "num_leaves": 8,
    "learning_rate": 0.08,
}
DECISION = COMMON | {
    "objective": "binary",
    "learning_rate": 0.04,
    "num_leaves": 12,
    "min_data_in_leaf": 100,
    "feature_fraction": 0.2,
}
SCORE_TREES, SPACING_TREES, DECISION_TREES = 400, 50, 200
FIRST_TREES = 100


class Sample:
    """Candidates of many pictures with their distance to the nearest tree."""

    def __init__(self, variant: Variant, gate: Verifier) -> None:
        parts: list[tuple[np.ndarray, ...]] = []
        self.trees: list[np.ndarray] = []
        kinds, sites = [], []
        for picture in pictures(SEED):
            got = measure(channels_of(picture, variant), gate, picture.region)
            xy = np.column_stack([got.x_px, got.y_px])
            number = np.full(len(xy), len(self.trees))
            parts.append((got.table.values, xy, *labels(xy, picture), number))
            self.names = got.table.names
            self.trees.append(picture.trees)
            kinds.append(picture.kind)
            sites.append(picture.site)
        joined = [np.concatenate(column) for column in zip(*parts, strict=True)]
        self.values, self.xy, self.distance, self.spacing, self.picture = joined
        self.kind = np.array(kinds)
        self.start = np.searchsorted(self.picture, np.arange(len(kinds) + 1))
        order = np.random.default_rng(SEED).permutation(max(sites) + 1)
        self.picture_fold = order[np.array(sites)] % FOLDS
        self.fold = self.picture_fold[self.picture]
        self.weight = np.array([WEIGHT[k] for k in kinds])[self.picture]
        self.near = np.exp(-((self.distance / NEAR_PX) ** 2) / 2) * (self.distance < 9)

    def rows(self, picture: int) -> slice:
        """Return which candidates are of a picture."""
        return slice(int(self.start[picture]), int(self.start[picture + 1]))


def channels_of(picture: Picture, variant: Variant) -> Channels:
    f = picture.bands.astype(np.float32)
    luma = (0.298 * f[0] + 0.587 * f[1] + 0.114 * f[2]).astype(np.float32)
    rgb = None if variant == "grey" else (f[0], f[1], f[2])
    return picture_channels(luma, rgb, f[3] if variant == "nir" else None)


def labels(xy: np.ndarray, picture: Picture) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance to the nearest tree, and from there to the next where it is known."""
    distance, spacing = np.full(len(xy), 99.0), np.full(len(xy), np.nan)
    trees = picture.trees
    if len(trees):
        tree = cKDTree(trees)
        distance, nearest = tree.query(xy)
        if len(trees) > 1:
            apart = np.minimum(tree.query(trees, k=2)[0][:, 1], 40)
            # Next to the picture's border the nearest tree may not be in it.
            rows, cols = picture.bands.shape[1:]
            room = np.minimum(xy, [cols, rows] - xy).min(axis=1)
            known = (distance < 5) & (room > 8)
            spacing[known] = apart[nearest[known]]
    return distance, spacing


def fit_gate(variant: Variant) -> dict[str, Any]:
    """Fit the logistic model on every fifth chip."""
    tables, near = [], []
    for picture in list(chips())[::5]:
        got = cheap_measures(channels_of(picture, variant))
        tables.append(got.table.values)
        near.append(labels(np.column_stack([got.x_px, got.y_px]), picture)[0])
        names = got.table.names
    cheap = [name for name in names if not name.startswith("dark_")]
    values = np.concatenate(tables)[:, [names.index(name) for name in cheap]].astype(float)
    distance = np.concatenate(near)
    mean, scale = values.mean(axis=0), values.std(axis=0) + 1e-6
    z = np.clip((values - mean) / scale, -5, 5)
    weight = logistic(z, distance < 4, 200.0)
    total = z @ weight[:-1]
    threshold = float(np.quantile(total[distance < 3], GATE_LOSS))
    print(f"  gate keeps {np.mean(total >= threshold):.2f} of the candidates")
    return {
        "features": cheap,
        "mean": np.round(mean, 4).tolist(),
        "scale": np.round(scale, 4).tolist(),
        "weight": np.round(weight[:-1], 4).tolist(),
        "threshold": round(threshold, 4),
    }


def logistic(z: np.ndarray, target: np.ndarray, ridge: float) -> np.ndarray:
    """Fit a logistic model by Newton's method; the last weight is the offset."""
    z = np.column_stack([z, np.ones(len(z))])
    weight = np.zeros(z.shape[1])
    penalty = np.eye(z.shape[1]) * ridge
    for _ in range(20):
        p = 1 / (1 + np.exp(-z @ weight))
        hessian = (z * (p * (1 - p))[:, None]).T @ z + penalty
        weight += np.linalg.solve(hessian, z.T @ (target - p) - penalty @ weight)
    return weight


def fit_scores(sample: Sample, rows: np.ndarray) -> tuple[lgb.Booster, lgb.Booster]:
    """Fit score and spacing on some candidates."""

    def train(settings: dict[str, Any], target: np.ndarray, at: np.ndarray, trees: int) -> Any:
        data = lgb.Dataset(sample.values[at], target[at], weight=sample.weight[at])
        return lgb.train(settings, data, trees)

    score = train(SCORE, sample.near, rows, SCORE_TREES)
    known = rows & ~np.isnan(sample.spacing)
    return score, train(SPACING, sample.spacing, known, SPACING_TREES)


def held_out_scores(sample: Sample, without: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return score and spacing of every candidate by trees that did not see its site.

    ``without`` is a fold that no trees see and that gets no scores.
    """
    score, spacing = np.full(len(sample.near), -np.inf), np.zeros(len(sample.near))
    for k in set(range(FOLDS)) - {without}:
        seen = (sample.fold != k) & (sample.fold != (k if without is None else without))
        a, b = fit_scores(sample, seen)
        at = sample.fold == k
        score[at] = a.predict(sample.values[at], raw_score=True)
        spacing[at] = b.predict(sample.values[at])
        print(f"  scored fold {k} without {without}", flush=True)
    return score, spacing


class Decided:
    """The detections of all pictures: what is known of each and whether it hits a tree."""

    def __init__(
        self, sample: Sample, score: np.ndarray, spacing: np.ndarray, rules: Verifier
    ) -> None:
        values, hit, strict, picture, at = [], [], [], [], []
        for number, trees in enumerate(sample.trees):
            rows = sample.rows(number)
            x, y = sample.xy[rows].T
            table = FeatureTable(sample.names, sample.values[rows])
            measured = Measured(None, None, x, y, table)  # type: ignore[arg-type]
            chosen, found = detections(measured, score[rows], spacing[rows], rules)
            self.names = found.names
            values.append(found.values)
            hit.append(hits(sample.xy[rows][chosen], trees, HIT_PX))
            strict.append(hits(sample.xy[rows][chosen], trees, STRICT_PX))
            picture.append(np.full(len(chosen), number))
            at.append(rows.start + chosen)
        self.values = np.concatenate(values)
        self.hit, self.strict = np.concatenate(hit), np.concatenate(strict)
        self.picture, self.at = np.concatenate(picture), np.concatenate(at)
        self.kind = sample.kind[self.picture]
        self.fold = sample.picture_fold[self.picture]
        self.weight = sample.weight[self.at]

    def fit(self, rows: np.ndarray) -> lgb.Booster:
        """Fit the decision on some detections."""
        data = lgb.Dataset(self.values[rows], self.hit[rows], weight=self.weight[rows])
        return lgb.train(DECISION, data, DECISION_TREES)


def hits(xy: np.ndarray, trees: np.ndarray, limit: float) -> np.ndarray:
    """Match the strongest first: whether it is a hit must not depend on weaker ones."""
    hit = np.zeros(len(xy), dtype=bool)
    free = np.ones(len(trees), dtype=bool)
    for i, point in enumerate(xy):
        distance = np.where(free, np.hypot(*(trees - point).T), np.inf) if len(trees) else [np.inf]
        nearest = int(np.argmin(distance))
        if distance[nearest] <= limit:
            hit[i], free[nearest] = True, False
    return hit


def judge(sample: Sample, decided: Decided, decision: np.ndarray) -> dict[str, float]:
    """Return the figures of each fold with curve and threshold of the other folds."""
    found = np.zeros(len(decision), dtype=bool)
    p = np.zeros(len(decision))
    for k in range(FOLDS):
        rest, at = decided.fold != k, decided.fold == k
        curve, threshold = settle(sample, decided, decision, rest)
        p[at] = 1 / (1 + np.exp(-(curve[0] * decision[at] + curve[1])))
        found[at] = p[at] >= threshold
    figures: dict[str, float] = {}
    for name, kind in (("", REAL), ("_simulated", FIELD)):
        at = decided.kind == kind
        truth = sum(len(t) for t, k in zip(sample.trees, sample.kind, strict=True) if k == kind)
        for label, hit in (("10px", decided.hit), ("6px", decided.strict)):
            value = 2 * (hit & found & at).sum() / ((found & at).sum() + truth)
            figures[f"f1_{label}{name}"] = round(float(value), 3)
    real = decided.kind == REAL
    figures["expected_calibration_error"] = calibration_error(p[real], decided.hit[real])
    figures["sites"] = int((sample.kind == REAL).sum())
    return figures


def settle(
    sample: Sample, decided: Decided, decision: np.ndarray, rows: np.ndarray
) -> tuple[list[float], float]:
    """Fit the logistic curve (J. Platt, 1999) and choose the threshold of the best F1."""
    rows = rows & (decided.kind == REAL)
    s, hit = decision[rows], decided.hit[rows]
    slope, offset = (round(float(v), 4) for v in logistic(s[:, None], hit, 1e-6))
    folds = set(decided.fold[rows].tolist())
    truth = sum(
        len(trees)
        for trees, kind, fold in zip(sample.trees, sample.kind, sample.picture_fold, strict=True)
        if kind == REAL and fold in folds
    )
    p = 1 / (1 + np.exp(-(slope * s + offset)))
    grid = np.arange(0.25, 0.6, 0.01)
    f1 = [2 * hit[p >= t].sum() / ((p >= t).sum() + truth) for t in grid]
    # The curve is flat at its top: its middle, not the luckiest place on it.
    smooth = np.convolve(f1, np.ones(5) / 5, mode="valid")
    return [slope, offset], round(float(grid[2 + int(np.argmax(smooth))]), 2)


def calibration_error(p: np.ndarray, hit: np.ndarray) -> float:
    bins = np.clip((p * 10).astype(int), 0, 9)
    parts = [
        abs(p[bins == k].mean() - hit[bins == k].mean()) * np.mean(bins == k)
        for k in range(10)
        if np.any(bins == k)
    ]
    return round(float(sum(parts)), 3)


def early(sample: Sample, score: lgb.Booster) -> list[float]:
    """Return the sum after the first trees below which hardly any detection begins."""
    some = slice(0, None, 7)
    first = score.predict(sample.values[some], raw_score=True, num_iteration=FIRST_TREES)
    final = score.predict(sample.values[some], raw_score=True)
    least = float(np.quantile(first[final > LEAST_SCORE], 0.002))
    print(f"  {np.mean(first >= least):.2f} of the candidates see all trees")
    return [FIRST_TREES, round(least, 4)]


def fit(variant: Variant, nested: bool) -> None:
    start = time.time()
    print(f"{variant}:")
    empty: dict[str, Any] = {"features": [], "trees": []}
    table: dict[str, Any] = {
        "variant": variant,
        "gate": fit_gate(variant),
        "score": empty,
        "spacing": empty,
        "decision": empty,
        "calibration": [1, 0],
        "spacing_share": SPACING_SHARE,
        "spacing_px": SPACING_PX,
        "threshold": 0.35,
    }
    rules = Verifier.read(table)
    sample = Sample(variant, rules)
    print(f"  {len(sample.xy)} candidates measured in {time.time() - start:.0f} s", flush=True)
    score, spacing = held_out_scores(sample)
    decided = Decided(sample, score, spacing, rules)
    decision = np.zeros(len(decided.hit))
    for k in range(FOLDS):
        at = decided.fold == k
        model = decided.fit(~at)
        decision[at] = model.predict(decided.values[at], raw_score=True)
    figures = judge(sample, decided, decision)
    table["calibration"], table["threshold"] = settle(
        sample, decided, decision, np.ones(len(decision), dtype=bool)
    )
    print(f"  threshold {table['threshold']}: {figures}", flush=True)
    if nested:
        strict = judge(sample, decided, nested_decision(sample, rules, decided))
        print(f"  nested: {strict}", flush=True)
    everything = np.ones(len(sample.near), dtype=bool)
    a, b = fit_scores(sample, everything)
    c = decided.fit(np.ones(len(decision), dtype=bool))
    table["score"] = forest_table(a, sample.names) | {"early": early(sample, a)}
    table["spacing"] = forest_table(b, sample.names)
    table["decision"] = forest_table(c, decided.names)
    table["cross_validation"] = figures
    table["fitted_on"] = (
        "200 chips of 'Urban Tree Detection Data' (J. Ventura et al., CC BY 4.0; imagery USDA "
        "NAIP), disturbed copies of them, simulated fields"
    )
    check(table, sample, decided, a, c)
    write(table, TABLES / f"verifier_{variant}.json")
    print(f"  {time.time() - start:.0f} s", flush=True)


def nested_decision(sample: Sample, rules: Verifier, decided: Decided) -> np.ndarray:
    """Decide on each fold by trees fitted on scores that never saw it either."""
    decision = np.zeros(len(decided.hit))
    for k in range(FOLDS):
        inner = Decided(sample, *held_out_scores(sample, without=k), rules)
        model = inner.fit(inner.fold != k)
        at = decided.fold == k
        decision[at] = model.predict(decided.values[at], raw_score=True)
    return decision


def check(
    table: dict[str, Any], sample: Sample, decided: Decided, score: Any, decision: Any
) -> None:
    """Print how far the tables are from LightGBM."""
    rules = Verifier.read(table)
    for name, forest, names, values, model in (
        ("score", rules.score, sample.names, sample.values[::50], score),
        ("decision", rules.decision, decided.names, decided.values[::5], decision),
    ):
        ours = forest.evaluate(FeatureTable(names, values))
        theirs = model.predict(values, raw_score=True)
        hopeful = np.isfinite(ours)
        difference = np.abs(ours - theirs)[hopeful].max()
        lost = np.mean(~hopeful & (theirs > LEAST_SCORE))
        print(f"  {name} against LightGBM: {difference:.1e}; {lost:.4f} left out early")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("variants", nargs="*", default=VARIANTS)
    parser.add_argument("--nested", action="store_true")
    given = parser.parse_args()
    for variant in given.variants:
        fit(variant, given.nested)


if __name__ == "__main__":
    main()
