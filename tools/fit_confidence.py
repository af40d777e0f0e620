"""Fit the verifier of the obstacle detector and write its tables.

    python tools/fit_confidence.py [nir|rgb|grey ...]

Fitted on the 200 labelled chips beside the project (aerial imagery of the US National
Agriculture Imagery Program, cut and labelled by J. Ventura et al., "Urban Tree Detection
Data", CC BY 4.0), on disturbed copies of half of them and on simulated fields. Needs LightGBM
(`pip install lightgbm`), which the package itself does not: the fitted trees are written as
JSON and evaluated with numpy. Prints the cross-validated figures, sites held out.
"""

from __future__ import annotations

import json
import os
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import lightgbm as lgb
import numpy as np
import pandas as pd
import rasterio
from scipy import ndimage
from scipy.spatial import cKDTree

from geofield.obstacles.auto import measure, picture_channels
from geofield.obstacles.channels import VARIANTS, Variant
from geofield.obstacles.features import FeatureTable
from geofield.obstacles.verifier import Gate, Verifier, strongest
from geofield.simulate import CLIMATES, SimulationSettings, simulate_field

HERE = Path(__file__).resolve().parent
TABLES = HERE.parent / "src/geofield/obstacles/tables"
FOLDS = 3
SEED = 7
HIT_PX = 10.0
NEAR_PX = 3.5
GATE_LOSS = 0.01
SPACING_SHARE, SPACING_PX = 0.8, (6.0, 14.0)
SCORE = {
    "objective": "cross_entropy",
    "learning_rate": 0.08,
    "num_leaves": 16,
    "min_data_in_leaf": 150,
    "feature_fraction": 0.2,
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
SCORE_TREES, SPACING_TREES = 220, 50
SPACING = SCORE | {"objective": "quantile", "alpha": 0.35, "num_leaves": 8}


def shared() -> Path:
    return Path(os.environ.get("GEOFIELD_SHARED", HERE.parent.parent / "shared")) / "data"


def split(bands: np.ndarray, variant: Variant) -> tuple[Any, Any, Any]:
    f = bands.astype(np.float32)
    luma = (0.298 * f[0] + 0.587 * f[1] + 0.114 * f[2]).astype(np.float32)
    rgb = None if variant == "grey" else (f[0], f[1], f[2])
    return luma, rgb, f[3] if variant == "nir" else None


def disturbed(bands: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """Another camera, light and scale: what the verifier must not depend on."""
    zoom = float(np.exp(rng.uniform(np.log(0.85), np.log(1.2))))
    f = bands.astype(np.float64)
    f = np.stack([ndimage.zoom(band, zoom, order=1, mode="nearest") for band in f])
    if rng.random() < 0.5:
        f = ndimage.gaussian_filter(f, (0, *[rng.uniform(0.2, 0.8)] * 2))
    f = 255 * (np.clip(f, 0, 255) / 255) ** np.exp(rng.normal(0, 0.2))
    gain, common = np.exp(rng.normal(0, 0.06, len(f))), np.exp(rng.normal(0, 0.12))
    f = f * (gain * common)[:, None, None] + rng.normal(0, 6) + rng.normal(0, 2.0, f.shape)
    return np.clip(np.rint(f), 0, 255).astype(np.uint8), zoom


class Sample:
    """Candidates of many pictures with their distance to the nearest tree."""

    def __init__(self) -> None:
        self.values: list[np.ndarray] = []
        self.xy: list[np.ndarray] = []
        self.distance: list[np.ndarray] = []
        self.spacing: list[np.ndarray] = []
        self.picture: list[np.ndarray] = []
        self.truth: list[np.ndarray] = []
        self.site: list[int] = []
        self.real: list[bool] = []
        self.names: tuple[str, ...] = ()

    def add(
        self,
        bands: np.ndarray,
        truth: np.ndarray,
        variant: Variant,
        gate: Verifier | None,
        *,
        site: int,
        real: bool,
        region: np.ndarray | None = None,
    ) -> None:
        got = measure(picture_channels(*split(bands, variant)), gate, region)
        xy = np.column_stack([got.x_px, got.y_px])
        distance, spacing = np.full(len(xy), 99.0), np.full(len(xy), np.nan)
        if len(truth):
            tree = cKDTree(truth)
            distance, nearest = tree.query(xy)
            if len(truth) > 1:
                apart = np.minimum(tree.query(truth, k=2)[0][:, 1], 40)
                # Next to the picture's border the nearest tree may not be in it.
                rows, cols = bands.shape[1:]
                room = np.minimum(xy, [cols, rows] - xy).min(axis=1)
                known = (distance < 5) & (room > 8)
                spacing[known] = apart[nearest[known]]
        self.names = got.table.names
        self.values.append(got.table.values)
        self.xy.append(xy)
        self.distance.append(distance)
        self.spacing.append(spacing)
        self.picture.append(np.full(len(xy), len(self.truth)))
        self.truth.append(truth)
        self.site.append(site)
        self.real.append(real)

    def close(self) -> None:
        for name in ("values", "xy", "distance", "spacing", "picture"):
            setattr(self, name, np.concatenate(getattr(self, name)))
        self.site = np.asarray(self.site)
        self.real = np.asarray(self.real)


def chips() -> list[tuple[str, np.ndarray, np.ndarray]]:
    folder = shared() / "trees_train"
    labels = pd.read_csv(folder / "trees.csv")
    out = []
    for path in sorted(folder.glob("*.tif")):
        with rasterio.open(path) as data:
            bands = data.read()
        rows = labels[labels.image == path.stem]
        out.append((path.stem, bands, rows[["x_px", "y_px"]].to_numpy(float)))
    return out


def simulated() -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    out = []
    for seed in range(24):
        base = SimulationSettings(width_px=400, height_px=400, equal_brightness=seed % 3 == 0)
        settings = replace(
            base,
            obstacles=0 if seed % 5 == 0 else None,
            climate=CLIMATES[seed % 4],
            radius_m=((2.0, 7.0), (1.6, 4.0), (3.0, 9.0))[seed % 3],
            resolution_m=(0.6, 0.5, 0.7)[(seed // 3) % 3],
        )
        field = simulate_field(910_000 + seed, settings)
        region = field.field.mask(field.scene.grid)
        truth = field.obstacles[["x_px", "y_px"]].to_numpy(float) - 0.5
        out.append((field.scene.bands, truth, region))
    return out


def fit_gate(variant: Variant, data: list[tuple[str, np.ndarray, np.ndarray]]) -> dict[str, Any]:
    sample = Sample()
    for site, (_, bands, truth) in enumerate(data[::5]):
        sample.add(bands, truth, variant, None, site=site, real=True)
    sample.close()
    cheap = [
        name
        for name in sample.names
        if ("@" in name or "~" in name or name.startswith(("support", "crown")))
    ]
    values = sample.values[:, [sample.names.index(name) for name in cheap]].astype(float)
    target = (sample.distance < 4).astype(float)
    mean, scale = values.mean(axis=0), values.std(axis=0) + 1e-6
    z = np.clip((values - mean) / scale, -5, 5)
    z1 = np.column_stack([z, np.ones(len(z))])
    weight = np.zeros(z1.shape[1])
    ridge = np.eye(z1.shape[1]) * 200.0
    for _ in range(12):
        p = 1 / (1 + np.exp(-z1 @ weight))
        hessian = (z1 * (p * (1 - p))[:, None]).T @ z1 + ridge
        weight += np.linalg.solve(hessian, z1.T @ (target - p) - ridge @ weight)
    total = z @ weight[:-1]
    threshold = float(np.quantile(total[sample.distance < 3], GATE_LOSS))
    print(f"  gate keeps {np.mean(total >= threshold):.2f} of the candidates")
    return {
        "features": cheap,
        "mean": np.round(mean, 4).tolist(),
        "scale": np.round(scale, 4).tolist(),
        "weight": np.round(weight[:-1], 4).tolist(),
        "threshold": round(threshold, 4),
    }


def forest_table(model: lgb.Booster, names: tuple[str, ...]) -> dict[str, Any]:
    """Write LightGBM's trees as plain lists, thresholds rounded between the features' steps."""
    used = sorted({i for i, gain in enumerate(model.feature_importance("gain")) if gain > 0})
    index = {old: new for new, old in enumerate(used)}
    trees = []
    for info in model.dump_model()["tree_info"]:
        nodes: list[list[float]] = []
        leaves: list[float] = []

        def walk(branch: dict[str, Any], nodes: Any = nodes, leaves: Any = leaves) -> int:
            if "leaf_value" in branch:
                leaves.append(round(branch["leaf_value"], 5))
                return -len(leaves)
            here = len(nodes)
            nodes.append([index[branch["split_feature"]], round(branch["threshold"], 4), 0, 0])
            nodes[here][2] = walk(branch["left_child"])
            nodes[here][3] = walk(branch["right_child"])
            return here

        walk(info["tree_structure"])
        trees.append({"nodes": nodes, "leaves": leaves})
    return {"features": [names[i] for i in used], "trees": trees}


def hits(xy: np.ndarray, truth: np.ndarray, limit: float) -> np.ndarray:
    """Match the strongest first: whether it is a hit must not depend on weaker ones."""
    hit = np.zeros(len(xy), dtype=bool)
    free = np.ones(len(truth), dtype=bool)
    for i, point in enumerate(xy):
        distance = np.where(free, np.hypot(*(truth - point).T), np.inf) if len(truth) else [np.inf]
        nearest = int(np.argmin(distance))
        if distance[nearest] <= limit:
            hit[i], free[nearest] = True, False
    return hit


def fit(variant: Variant, data: list[Any], fields: list[Any]) -> None:
    start = time.time()
    print(f"{variant}:")
    gate_table = fit_gate(variant, data)
    gate = Gate(
        tuple(gate_table["features"]),
        *(np.asarray(gate_table[k]) for k in ("mean", "scale", "weight")),
        gate_table["threshold"],
    )
    empty = {"features": [], "trees": []}
    table: dict[str, Any] = {
        "variant": variant,
        "gate": gate_table,
        "score": empty,
        "spacing": empty,
        "calibration": [1, 0],
        "spacing_share": SPACING_SHARE,
        "spacing_px": SPACING_PX,
        "threshold": 0.35,
    }
    gated = Verifier.read(table)
    assert gate.features == gated.gate.features
    sample = Sample()
    rng = np.random.default_rng(SEED)
    for site, (_, bands, truth) in enumerate(data):
        sample.add(bands, truth, variant, gated, site=site, real=True)
        if site % 2:
            continue
        other, zoom = disturbed(bands, rng)
        moved = (truth + 0.5) * zoom - 0.5
        sample.add(other, moved, variant, gated, site=site, real=False)
    for site, (bands, truth, region) in enumerate(fields):
        sample.add(bands, truth, variant, gated, site=site, real=False, region=region)
    sample.close()
    print(f"  {len(sample.xy)} candidates measured in {time.time() - start:.0f} s", flush=True)

    near = np.exp(-((sample.distance / NEAR_PX) ** 2) / 2) * (sample.distance < 9)
    is_chip = np.arange(len(sample.truth)) < len(sample.truth) - len(fields)
    weight = np.where(sample.real, 1.0, np.where(is_chip, 0.6, 0.5))[sample.picture]
    order = np.random.default_rng(SEED).permutation(len(data))
    fold = order[sample.site % len(data)][sample.picture] % FOLDS
    spaced = ~np.isnan(sample.spacing)

    def train(rows: np.ndarray) -> tuple[lgb.Booster, lgb.Booster]:
        score = lgb.train(
            SCORE, lgb.Dataset(sample.values[rows], near[rows], weight=weight[rows]), SCORE_TREES
        )
        rows = rows & spaced
        spacing = lgb.train(
            SPACING,
            lgb.Dataset(sample.values[rows], sample.spacing[rows], weight=weight[rows]),
            SPACING_TREES,
        )
        return score, spacing

    score, spacing = np.zeros(len(near)), np.zeros(len(near))
    for k in range(FOLDS):
        a, b = train(fold != k)
        score[fold == k] = a.predict(sample.values[fold == k], raw_score=True)
        print(f"  fold {k} after {time.time() - start:.0f} s", flush=True)
        spacing[fold == k] = b.predict(sample.values[fold == k])
    if os.environ.get("KEEP_SCORES"):
        np.savez_compressed(
            f"{os.environ['KEEP_SCORES']}_{variant}.npz",
            score=score,
            spacing=spacing,
            xy=sample.xy,
            picture=sample.picture,
            real=sample.real,
        )
    print(f"  cross-validated after {time.time() - start:.0f} s", flush=True)

    figures = judge(table, sample, score, spacing, len(fields))
    print(f"  threshold {table['threshold']}: {figures}", flush=True)

    a, b = train(np.ones(len(near), dtype=bool))
    table["score"] = forest_table(a, sample.names)
    table["spacing"] = forest_table(b, sample.names)
    table["cross_validation"] = figures
    table["fitted_on"] = (
        "200 chips of 'Urban Tree Detection Data' (J. Ventura et al., CC BY 4.0; imagery USDA "
        "NAIP), disturbed copies of them, 24 simulated fields"
    )
    check = Verifier.read(table).score.evaluate(FeatureTable(sample.names, sample.values[:2000]))
    difference = np.abs(check - a.predict(sample.values[:2000], raw_score=True)).max()
    print(f"  table against LightGBM: {difference:.1e}; {time.time() - start:.0f} s", flush=True)
    write(table, TABLES / f"verifier_{variant}.json")


def judge(
    table: dict[str, Any], sample: Any, score: np.ndarray, spacing: np.ndarray, fields: int
) -> dict[str, float]:
    """Calibrate on held-out scores, choose the threshold, return the figures."""
    reach = np.clip(SPACING_SHARE * spacing, *SPACING_PX)
    scores: list[np.ndarray] = []
    near: list[np.ndarray] = []
    close: list[np.ndarray] = []
    kind: list[np.ndarray] = []
    count = len(sample.truth)
    for picture, truth in enumerate(sample.truth):
        rows = np.flatnonzero((sample.picture == picture) & (score > -3.5))
        rows = rows[strongest(*sample.xy[rows].T, score[rows], reach[rows])]
        scores.append(score[rows])
        near.append(hits(sample.xy[rows], truth, HIT_PX))
        close.append(hits(sample.xy[rows], truth, 6))
        name = 0 if sample.real[picture] else 1 if picture < count - fields else 2
        kind.append(np.full(len(rows), name))
    s, h10, h6, k = (np.concatenate(part) for part in (scores, near, close, kind))
    real = k == 0
    table["calibration"] = calibrate(s[real], h10[real])
    slope, offset = table["calibration"]
    p = 1 / (1 + np.exp(-(slope * s + offset)))
    labels = sum(len(t) for t, r in zip(sample.truth, sample.real, strict=True) if r)
    trees = sum(len(t) for t in sample.truth[count - fields :])
    grid = np.arange(0.2, 0.6, 0.01)

    def f1(hit: np.ndarray, rows: np.ndarray, truth: int) -> float:
        return float(2 * hit[rows].sum() / max(rows.sum() + truth, 1))

    best = max(grid, key=lambda t: f1(h10, real & (p >= t), labels))
    table["threshold"] = round(float(best), 2)
    return {
        "f1_10px": round(f1(h10, real & (p >= best), labels), 3),
        "f1_6px": round(f1(h6, real & (p >= best), labels), 3),
        "f1_10px_simulated": round(f1(h10, (k == 2) & (p >= best), trees), 3),
        "expected_calibration_error": round(calibration_error(p[real], h10[real]), 3),
        "sites": int(np.sum(sample.real)),
    }


def calibrate(s: np.ndarray, hit: np.ndarray) -> list[float]:
    """Fit the logistic curve from score to the share of hits (J. Platt, 1999)."""
    y = hit.astype(float)
    w = np.zeros(2)
    z = np.column_stack([s, np.ones_like(s)])
    for _ in range(30):
        p = 1 / (1 + np.exp(-z @ w))
        h = (z * (p * (1 - p))[:, None]).T @ z + 1e-6 * np.eye(2)
        w += np.linalg.solve(h, z.T @ (y - p))
    return [round(float(v), 4) for v in w]


def calibration_error(p: np.ndarray, hit: np.ndarray) -> float:
    bins = np.clip((p * 10).astype(int), 0, 9)
    return float(
        sum(
            abs(p[bins == k].mean() - hit[bins == k].mean()) * np.mean(bins == k)
            for k in range(10)
            if np.any(bins == k)
        )
    )


def write(table: dict[str, Any], path: Path) -> None:
    """One tree per line, so that the table can be read and compared."""
    text = json.dumps(table)
    text = (
        text.replace('{"nodes"', '\n{"nodes"')
        .replace('], "', '],\n"')
        .replace('"leaves"', '"leaves"')
    )
    path.parent.mkdir(exist_ok=True)
    path.write_text(text + "\n", encoding="utf-8")
    json.loads(path.read_text(encoding="utf-8"))
    print(f"  {path.name}: {path.stat().st_size / 1024:.0f} KiB")


def main() -> None:
    data, fields = chips(), simulated()
    for variant in sys.argv[1:] or VARIANTS:
        fit(variant, data, fields)  # type: ignore[arg-type]


if __name__ == "__main__":
    main()
