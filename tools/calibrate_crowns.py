"""Calibrate the crown network's answers on open, even land of the sites left out.

    python tools/calibrate_crowns.py pictures.npz

Writes ``crowns.json`` beside the network in ``src/geofield/learned``: what an answer is worth as
a probability, for pictures with near infrared, in colour and in grey, and by how much doubtful
crowns are measured too small. Open land is where at most five labelled trees stand in the 58 m
around (15 per hectare), as they do in fields; it gives the curve. It is even where three tenths
of the ground around are without edges: among roofs and parked cars half as many of the doubtful
answers are right, and nobody drives there. There is less of it, so it shifts the curve as a
whole. The error printed is that of curves fitted on four fifths of the sites and judged on even
land of the others.
"""

from __future__ import annotations

import argparse
import json
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from affine import Affine
from crown_pictures import SIMULATED, simulated, site_of, trees_of
from crown_samples import CHIP_RESOLUTION_M, INPUTS, OUTPUTS, Pictures, calm
from crown_targets import CELL_PX
from learned_with import LEARNED, learned_with
from pyproj import CRS
from rasterio.features import rasterize
from scipy import ndimage
from scipy.optimize import isotonic_regression, minimize
from scipy.special import expit
from standing_things import place_things

from geofield.errors import ObstacleWarning
from geofield.evaluation import match_points, reliability
from geofield.grid import Grid
from geofield.learned import network
from geofield.model.circles import Circles
from geofield.model.scene import GREY_WEIGHTS, Scene
from geofield.obstacles.crowns import LEAST_VOTES
from geofield.obstacles.default import detect_by_default

FACTS = LEARNED / "crowns.json"
BANDS = {"nir": ("red", "green", "blue", "nir"), "rgb": ("red", "green", "blue"), "grey": ("grey",)}
HIT_PX = 10.0
OPEN_PX, OPEN_TREES = 96, 5
EVEN = 0.3
CURVE_POINTS, PARTINGS = 24, 8
THINGS, PAINTED_EVERY = 240, 5
TOLD, DETECTED = 0.05, 0.1
SAME = {"answer": [0.0, 1e3], "probability": [0.0, 1e3]}


def scene_of(bands: np.ndarray, kind: str) -> Scene:
    """Return a chip (rows, cols, 4) as a scene with the bands of a kind."""
    pixels = bands.transpose(2, 0, 1)
    if kind == "grey":
        grey = np.tensordot(GREY_WEIGHTS, pixels[:3].astype(float), 1)
        pixels = np.clip(np.rint(grey), 0, 255).astype(np.uint8)[None]
    roles = BANDS[kind]
    pixels = np.ascontiguousarray(pixels[: len(roles)])
    grid = Grid(
        pixels.shape[2],
        pixels.shape[1],
        Affine(CHIP_RESOLUTION_M, 0, 4e5, 0, -CHIP_RESOLUTION_M, 4e6),
        CRS.from_epsg(32611),
    )
    return Scene(grid, pixels, roles, np.ones(grid.shape, bool))


def open_land(trees: np.ndarray, side: int) -> np.ndarray:
    """Return the pixels around which few trees stand."""
    count = np.zeros((side, side))
    at = np.clip(trees[:, :2].astype(int), 0, side - 1)
    np.add.at(count, (at[:, 1], at[:, 0]), 1)
    around = ndimage.uniform_filter(count, OPEN_PX, mode="constant") * OPEN_PX**2
    return np.rint(around) <= OPEN_TREES


def even_land(bands: np.ndarray) -> np.ndarray:
    """Return the pixels around which enough ground is without edges."""
    even = calm(bands.astype(np.float32)).astype(np.float32)
    return ndimage.uniform_filter(even, OPEN_PX, mode="nearest") >= EVEN


def strongest_hits(found: Circles, trees: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which are hits, and the radii of their labels.

    The strongest are matched first: whether one is a hit must not depend on weaker ones.
    """
    hit, radius = np.zeros(len(found), bool), np.full(len(found), np.nan)
    free = np.ones(len(trees), bool)
    for i in np.argsort(-found.strength, kind="stable"):
        if not free.any():
            break
        distance = np.hypot(trees[:, 0] - found.x_px[i], trees[:, 1] - found.y_px[i])
        nearest = int(np.argmin(np.where(free, distance, np.inf)))
        if distance[nearest] <= HIT_PX:
            hit[i], free[nearest] = True, False
            radius[i] = trees[nearest, 2]
    return hit, radius


def curve(answer: np.ndarray, hit: np.ndarray, bin_hits: int) -> dict[str, list[float]]:
    """Fit a rising curve through the shares of hits in bins of equally many hits."""
    order = np.argsort(answer)
    number = np.cumsum(hit[order]) // bin_hits
    parts = [order[number == k] for k in range(int(number[-1]) + 1)]
    parts = [part for part in parts if len(part) >= bin_hits]
    mean = np.array([answer[part].mean() for part in parts])
    # One hit and one miss more: no bin is sure of anything.
    share = np.array([(hit[part].sum() + 0.5) / (len(part) + 1) for part in parts])
    weight = np.array([len(part) for part in parts], float)
    rising = isotonic_regression(share, weights=weight).x
    points = {"answer": [0.0, *mean], "probability": [0.0, *rising]}
    return {name: [round(float(v), 4) for v in values] for name, values in points.items()}


def smooth_curve(answer: np.ndarray, hit: np.ndarray) -> dict[str, list[float]]:
    """Fit a logistic curve over an answer, its logarithm and the squares of both.

    On sites that a curve was not fitted to it errs less than shares of hits in bins, and hardly
    more than chance makes curves err that are right: .036, .035 and .036 in four bands, colour and
    grey where those would by .035, .026 and .028. Without the logarithm's square .041, .036 and
    .036.
    """

    def terms(strength: np.ndarray) -> np.ndarray:
        least = np.maximum(strength, LEAST_VOTES)
        return np.column_stack([np.log(least), np.log(least) ** 2, least, least**2])

    middle, spread = terms(answer).mean(axis=0), terms(answer).std(axis=0)

    def odds(weights: np.ndarray, strength: np.ndarray) -> np.ndarray:
        return weights[0] + (terms(strength) - middle) / spread @ weights[1:]

    def loss(weights: np.ndarray) -> float:
        z = odds(weights, answer)
        return float((np.logaddexp(0, z) - hit * z).sum() + 0.5 * (weights[1:] ** 2).sum())

    weights = minimize(loss, np.zeros(5), method="BFGS").x
    at = np.linspace(LEAST_VOTES, float(answer.max()), CURVE_POINTS)
    rising = np.maximum.accumulate(expit(odds(weights, at)))
    points = {"answer": [0.0, *at], "probability": [0.0, *rising]}
    return {name: [round(float(v), 4) for v in values] for name, values in points.items()}


def shifted(
    fitted: dict[str, list[float]], answer: np.ndarray, hit: np.ndarray
) -> dict[str, list[float]]:
    """Return the curve with its odds multiplied by what makes these answers most likely."""
    p = np.clip(np.interp(answer, fitted["answer"], fitted["probability"]), 1e-3, 1 - 1e-3)
    factors = np.exp(np.linspace(-1, 2, 301))
    moved = factors[:, None] * (p / (1 - p))
    likely = np.where(hit, moved, 1.0) / (1 + moved)
    factor = float(factors[np.log(likely).sum(axis=1).argmax()])
    points = np.array(fitted["probability"])
    points = factor * points / (1 + (factor - 1) * points)
    return fitted | {"probability": [round(float(v), 4) for v in points]}


def calibration_error(
    answer: np.ndarray, hit: np.ndarray, site: np.ndarray, even: np.ndarray
) -> float:
    """Return the expected calibration error of curves that did not see the sites they judge.

    Each is fitted on four fifths of the sites; the mean of several ways to part them, for one is
    off by half a hundredth.
    """
    errors = []
    for seed in range(PARTINGS):
        fifth = np.random.default_rng(seed).integers(0, 5, site.max() + 1)[site]
        p = np.zeros(len(answer))
        for one in range(5):
            seen, other = fifth != one, fifth == one
            fitted = smooth_curve(answer[seen], hit[seen])
            fitted = shifted(fitted, answer[seen & even], hit[seen & even])
            p[other] = np.interp(answer[other], fitted["answer"], fitted["probability"])
        told = even & (p >= TOLD)
        errors.append(reliability(p[told], hit[told])[3])
    return float(np.mean(errors))


def figures(found: list[Circles], trees: list[np.ndarray]) -> dict[str, float]:
    """Return F1 at 6 and 10 px at the threshold that is best at 10 px."""
    best: dict[str, float] = {"f1_10px": -1}
    for threshold in np.arange(0.6, 16.0, 0.2):
        hits, detected = np.zeros(2), 0
        for crowns, truth in zip(found, trees, strict=True):
            xy = np.column_stack([crowns.x_px, crowns.y_px])[crowns.strength >= threshold]
            detected += len(xy)
            hits += [len(match_points(xy, truth[:, :2], r).truth_index) for r in (6, 10)]
        six, ten = 2 * hits / (detected + sum(len(t) for t in trees))
        if ten > best["f1_10px"]:
            best = {"f1_6px": six, "f1_10px": ten, "at": threshold}
    return {name: round(float(v), 3) for name, v in best.items()}


def things() -> tuple[np.ndarray, np.ndarray]:
    """Return answers to what is no tree in simulated fields, and which are right."""
    answer, hit = [], []
    for number in range(THINGS):
        field = simulated(SIMULATED + number)
        rng = np.random.default_rng(number)
        bands = field.scene.bands.transpose(1, 2, 0).astype(np.float32)
        region = field.field.mask(field.scene.grid)
        painted, cover = bands, np.zeros(region.shape)
        if number % PAINTED_EVERY == 0:
            painted, cover, _ = place_things(rng, bands, trees_of(field), region)
        pixels = np.rint(painted).astype(np.uint8).transpose(2, 0, 1)
        found = detect_by_default(replace(field.scene, bands=pixels), field.field, (0.3, 30))
        crowns = np.zeros(region.shape, np.uint8)
        for x, y, radius in trees_of(field):
            cv2.circle(crowns, (int(x), int(y)), round(radius), 1, -1)
        for shape, p in zip(found.shapes, found.shape_confidence, strict=True):
            mask = rasterize([(shape, 1)], cover.shape).astype(bool)
            answer.append(p)
            # Canopy beside a tree's circle is right, its shadow is not.
            hit.append(bool(cover[mask].any() or crowns[mask].mean() >= 0.5))
    return np.array(answer), np.array(hit)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pictures", type=Path)
    parser.add_argument("--share", type=float, default=0.7)
    parser.add_argument("--least-px", type=float, default=6.6)
    given = parser.parse_args()
    warnings.simplefilter("ignore", ObstacleWarning)  # simulated pictures are coarse on purpose
    pictures = Pictures.read(given.pictures)
    which = np.flatnonzero(pictures.left_out)
    sites = np.array([site_of(str(pictures.names[i])) for i in which])
    facts: dict[str, Any] = {
        "inputs": list(INPUTS),
        "outputs": list(OUTPUTS),
        "cell_px": CELL_PX,
        "suppression": {"share": given.share, "least_px": given.least_px},
        "explains": 0.13,
        "standing": {"least": 0.35, "calibration": SAME},
        "calibration": dict.fromkeys(BANDS, SAME),
        "doubt_m": 0.0,
        "left_out": {},
        "left_out_sites": sorted(set(sites.tolist())),
        "learned_with": learned_with([LEARNED / "crowns.onnx"]),
        "learned_on": "Urban Tree Detection Data (J. Ventura et al., CC BY 4.0; imagery USDA "
        "NAIP) without the sites left out; simulated fields; painted things; four pictures of "
        "0.1 m in the package deepforest 2.1.0 (B. G. Weinstein et al., MIT; imagery NEON)",
    }
    FACTS.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
    curves: dict[str, Any] = {}
    short: list[np.ndarray] = []
    numbers = np.unique(sites, return_inverse=True)[1]
    for kind in BANDS:
        parts, everything = [], []
        for i, number in zip(which, numbers, strict=True):
            found = detect_by_default(scene_of(pictures.bands[i], kind), None, (0.3, 30)).trees
            hit, radius = strongest_hits(found, pictures.trees[i])
            at = tuple(np.clip(v.astype(int), 0, 255) for v in (found.y_px, found.x_px))
            keep = open_land(pictures.trees[i], pictures.bands.shape[1])[at]
            even = even_land(pictures.bands[i])[at]
            missing = radius - found.radius_px
            columns = (found.strength, hit, np.full(len(hit), number), even, missing)
            parts.append(np.column_stack(columns)[keep])
            everything.append(found)
        a, b, site, even, missing = np.concatenate(parts).T
        b, even = b.astype(bool), even.astype(bool)
        curves[kind] = shifted(smooth_curve(a, b), a[even], b[even])
        p = np.interp(a, curves[kind]["answer"], curves[kind]["probability"])
        lacking = np.column_stack([1 - p / curves[kind]["probability"][-1], missing])
        short.append(lacking[(p >= DETECTED) & np.isfinite(missing)])
        result = figures(everything, [pictures.trees[i] for i in which])
        result["calibration_error"] = round(calibration_error(a, b, site.astype(int), even), 3)
        facts["left_out"][kind] = result
        print(kind, result, f"{len(a)} answers on open land, {even.sum()} even", flush=True)
    facts["calibration"] = curves
    known = np.concatenate(short)
    slope = float((known[:, 0] * known[:, 1]).sum() / (known[:, 0] ** 2).sum())
    facts["doubt_m"] = round(slope * CHIP_RESOLUTION_M, 2)
    said, right = things()
    print(f"things: {right.sum()} of {len(right)} answers right")
    facts["standing"]["calibration"] = curve(said, right, 8)
    network.cache_clear()
    text = json.dumps(facts, indent=1)
    FACTS.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
