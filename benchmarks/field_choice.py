"""Learn the curves with which `auto` scores outlines; says how well they do elsewhere.

    python benchmarks/field_choice.py [--fields 24] [--cache FILE] [--write]

Learned from simulated fields (other seeds than those of `benchmarks/field.py`), the real
fields of `field_truth.csv` and 35 more that were digitised by eye for this purpose
(`field_labels.csv` here; pictures beside the project), each with and without near infrared.
The curves make the beliefs over a picture's outlines as likely as their overlaps with the
truth say. "Left out" figures come from curves that never saw the site.
"""

from __future__ import annotations

import argparse
import json
import math
import pickle
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from rasterio.features import rasterize
from scipy.optimize import minimize

from common import DATA, digitised
from geofield.field import auto, choice
from geofield.field.refine import carried
from geofield.model import Scene
from geofield.simulate import SimulationSettings, simulate_field, simulate_fields

HERE = Path(__file__).parent
TABLE = Path(choice.__file__).parent / "tables" / "outline.json"
RESULTS = HERE / "results" / "field_choice.md"
SIMULATION_SEED = 11
#: Simulated small fields full of trees, which tear outlines.
CROWDED_SEED, CROWDED_PX, CROWNS = 9000, 480, (10, 60)
#: Pull towards zero.
RIDGE = 1e-2
#: How much likelier an outline is believed to be for its overlap; less than half is nothing.
SHARPNESS, WORST = 30.0, 0.5
#: Weight of a simulated picture against a real one.
SIMULATED = 0.35
FOLDS = 8


@dataclass
class Case:
    """A picture, a seed and the truth."""

    name: str
    site: str
    scene: Scene
    x_px: float
    y_px: float
    truth: shapely.Polygon


@dataclass
class Examples:
    """Outlines of a case: figures (outlines, names), overlaps with the truth, polygons."""

    name: str
    site: str
    figures: np.ndarray
    overlap: np.ndarray
    polygons: np.ndarray

    @property
    def real(self) -> bool:
        """Whether the picture is no simulation."""
        return not self.site.startswith("simulated")


def colours(scene: Scene) -> Scene:
    """The scene without its near infrared."""
    return replace(scene, bands=scene.bands[:3], roles=scene.roles[:3])


def grey(scene: Scene) -> Scene:
    """The scene without its colours."""
    band = np.clip(np.rint(scene.grey), 0, 255).astype(np.uint8)
    return replace(scene, bands=band[None], roles=("grey",))


def labelled() -> Iterator[Case]:
    tables = (
        ("truth", DATA / "trees" / "field_truth.csv", "trees"),
        ("own", HERE / "field_labels.csv", None),
    )
    for mark, table, folder in tables:
        for image, scene, x, y, truth in digitised(table, folder):
            place, _, number = image.rpartition("_")
            site = f"{place.rpartition('_')[0]} {number}"
            yield Case(f"{mark} {image} ({x:.0f}, {y:.0f})", site, scene, x, y, truth)


def simulated(count: int) -> Iterator[Case]:
    rng = np.random.default_rng(CROWDED_SEED)
    crowded = (
        simulate_field(
            CROWDED_SEED + index,
            SimulationSettings(
                width_px=CROWDED_PX,
                height_px=CROWDED_PX,
                obstacles=int(rng.integers(*CROWNS)),
                equal_brightness=index % 3 == 0,
            ),
        )
        for index in range(count)
    )
    plain = simulate_fields(count, SIMULATION_SEED)
    for kind, fields in (("plain", plain), ("crowded", crowded)):
        for index, one in enumerate(fields):
            x, y = one.scene.grid.from_lonlat(one.lon, one.lat)
            truth = one.field.polygon_px(one.scene.grid)
            site = f"simulated {index % 4}"
            yield Case(f"{kind} {index}", site, one.scene, x, y, truth)


def cases(fields: int) -> Iterator[Case]:
    """All cases: two seeds each, near infrared also left out, once also colour."""
    rng = np.random.default_rng(0)
    for case in labelled():
        for one in (case, reseeded(case, rng)):
            yield one
            yield replace(one, name=f"{one.name} rgb", scene=colours(one.scene))
        yield replace(case, name=f"{case.name} grey", scene=grey(case.scene))
    for index, case in enumerate(simulated(fields)):
        yield case
        other = reseeded(case, rng)
        yield replace(other, scene=colours(other.scene)) if index % 2 else other


def reseeded(case: Case, rng: np.random.Generator) -> Case:
    row, column = np.nonzero(rasterize([(case.truth.buffer(-5), 1)], case.scene.grid.shape))
    at = int(rng.integers(len(row)))
    return replace(case, name=f"{case.name} moved", x_px=column[at] + 0.5, y_px=row[at] + 0.5)


def examples(case: Case, rng: np.random.Generator, curves: choice.Curves | None) -> Examples | None:
    """Outlines that a search may meet: good ones, random ones, and what it now takes for good."""
    factor = auto.reduction(case.scene)
    seed = (case.x_px / factor, case.y_px / factor)
    surface, regions, ground = auto.prepared(case.scene, factor, seed)
    truth = shapely.transform(case.truth, lambda c: c / factor)
    found = choice.first_outlines(surface, regions, None)
    if not found:
        return None
    overlap = [_overlap(one.polygon, truth) for one in found]
    tried: set[int] = set()
    for _ in range(3):
        order = np.argsort(overlap)[::-1]
        chosen = {*order[:2].tolist(), *rng.choice(order[: 2 + len(order) // 2], 2).tolist()}
        if curves is not None:
            score = curves.score(np.array([one.figures for one in found]))
            chosen |= set(np.argsort(-score)[:3].tolist())
        for at in sorted(chosen - tried):
            tried.add(at)
            more = choice.redrawn_outlines(surface, found[at], ground)
            for one in (more[k] for k in rng.permutation(len(more))[:25]):
                found.append(one)
                overlap.append(_overlap(one.polygon, truth))
    figures = np.array([one.figures for one in found], np.float32)
    polygons = np.array([one.polygon for one in found])
    return Examples(case.name, case.site, figures, np.array(overlap), polygons)


def _overlap(one: shapely.Polygon, other: shapely.Polygon) -> float:
    common = one.intersection(other).area
    return common / (one.area + other.area - common)


def learn(known: list[Examples]) -> choice.Curves:
    """Curves under which beliefs follow overlaps (cross entropy, ridge; convex)."""
    every = np.concatenate([one.figures for one in known]).astype(float)
    usual, spread = every.mean(axis=0), every.std(axis=0) + 1e-9
    # A site counts by the root of its pictures: years and seeds of one site are much alike.
    often = Counter(one.site for one in known)
    share = np.array([(1 if one.real else SIMULATED) / often[one.site] ** 0.5 for one in known])
    share /= share.sum()
    bent, wanted = [], []
    for one in known:
        parts = choice.bends((one.figures - usual) / spread)
        bent.append(np.concatenate(list(parts), axis=1))
        regret = np.minimum(one.overlap.max() - one.overlap, WORST)
        belief = np.exp(-SHARPNESS * regret)
        wanted.append(belief / belief.sum())

    def loss(slope: np.ndarray) -> tuple[float, np.ndarray]:
        total, gradient = RIDGE * float(slope @ slope), 2 * RIDGE * slope
        for weight, figures, target in zip(share, bent, wanted, strict=True):
            score = figures @ slope
            score -= score.max()
            belief = np.exp(score)
            mass = belief.sum()
            total += weight * (math.log(mass) - float(target @ score))
            gradient = gradient + weight * (figures.T @ (belief / mass - target))
        return total, gradient

    size = bent[0].shape[1]
    found = minimize(loss, np.zeros(size), jac=True, method="L-BFGS-B", options={"maxiter": 400})
    return choice.Curves(usual, spread, found.x.reshape(3, -1))


def folds(known: list[Examples]) -> tuple[dict[str, int], list[choice.Curves]]:
    """To which fold a site belongs, and curves that saw no site of each fold."""
    sites = sorted({one.site for one in known})
    order = np.random.default_rng(1).permutation(len(sites))
    fold = {site: int(at) % FOLDS for site, at in zip(sites, order, strict=True)}
    curves = [learn([one for one in known if fold[one.site] != number]) for number in range(FOLDS)]
    return fold, curves


def searched(case: Case, curves: choice.Curves) -> tuple[float, float]:
    """Expected and true overlap of what `auto` finds with these curves."""
    factor = auto.reduction(case.scene)
    seed = (case.x_px / factor, case.y_px / factor)
    surface, regions, ground = auto.prepared(case.scene, factor, seed)
    outlines, score = choice.search(surface, regions, ground, curves)
    if not outlines:
        return 0.0, 0.0
    best, expected = choice.choose([one.polygon for one in outlines], score)
    mask = carried(case.scene, outlines[best].polygon, factor, seed)
    truth = rasterize([(case.truth, 1)], mask.shape) > 0
    return expected, float((mask & truth).sum() / (mask | truth).sum())


def trusting(expected: np.ndarray, true: np.ndarray, weight: np.ndarray) -> tuple[float, float]:
    """The logistic curve from expected overlap to the share of good outlines."""
    z = np.column_stack([choice.odds(expected), np.ones_like(expected)])
    good = true >= choice.GOOD

    def loss(line: np.ndarray) -> float:
        odds = z @ line
        return float(weight @ (np.logaddexp(0, odds) - good * odds)) + 1e-3 * float(line @ line)

    slope, offset = minimize(loss, np.array([1.0, 0.0])).x
    return float(slope), float(offset)


def report(
    known: list[Examples], curves: choice.Curves, fields: int
) -> tuple[choice.Curves, list[str]]:
    """The curves with what their doubt is worth, and a page on how well they choose."""
    page = [
        "# The choice of an outline",
        "",
        "Overlap (intersection over union) of the best of the outlines learned from, and of the "
        "choice of `auto` with curves that never saw the site. Real fields were "
        "digitised by eye; each with two points in it, also without near infrared (rgb) and "
        "colour (grey).",
        "",
    ]
    fold, elsewhere = folds(known)
    best = {one.name: float(one.overlap.max()) for one in known}
    rows: dict[str, list[tuple[float, float, float]]] = {}
    for case in cases(fields):
        if case.name not in best:
            continue
        hope, overlap = searched(case, elsewhere[fold[case.site]])
        mark = case.name.partition(" ")[0] + _bands(case.name)
        rows.setdefault(mark, []).append((best[case.name], overlap, hope))
    page.append("| cases | best outline | chosen, site left out | worst | below 0.88 |")
    page.append("|---|---|---|---|---|")
    for mark, values in rows.items():
        top, overlaps, _ = np.array(values).T
        page.append(
            f"| {mark} ({len(values)}) | {top.mean():.3f} | {overlaps.mean():.3f} "
            f"| {overlaps.min():.3f} | {np.mean(overlaps < 0.88):.0%} |"
        )
    every = np.array([row for values in rows.values() for row in values])
    real = np.array(
        [mark.startswith(("truth", "own")) for mark, values in rows.items() for _ in values]
    )
    overlaps, hopes = every[:, 1], every[:, 2]
    curves = replace(curves, trust=trusting(hopes, overlaps, np.where(real, 1.0, 0.15)))
    certain = np.array([curves.certainty(hope) for hope in hopes])
    page.append("")
    page.append("| certainty (real, left out) | cases | mean | share good | mean overlap |")
    page.append("|---|---|---|---|---|")
    for low, high in ((0, 0.3), (0.3, 0.5), (0.5, 0.7), (0.7, 0.85), (0.85, 1.01)):
        at = real & (certain >= low) & (certain < high)
        if at.any():
            page.append(
                f"| {low} to {min(high, 1)} | {at.sum()} | {certain[at].mean():.2f} "
                f"| {np.mean(overlaps[at] >= choice.GOOD):.2f} | {overlaps[at].mean():.3f} |"
            )
    return curves, page


def _bands(name: str) -> str:
    return next((end for end in (" rgb", " grey") if name.endswith(end)), "")


def write(curves: choice.Curves) -> None:
    rows = [
        json.dumps(
            {
                "name": name,
                "usual": round(float(usual), 4),
                "spread": round(float(spread), 4),
                "slope": round(float(slope), 4),
                "above": round(float(above), 4),
                "below": round(float(below), 4),
            }
        )
        for name, usual, spread, (slope, above, below) in zip(
            choice.NAMES, curves.usual, curves.spread, curves.slope.T, strict=True
        )
    ]
    trust = [round(value, 4) for value in curves.trust]
    text = f'{{"learned_by": "benchmarks/field_choice.py", "trust": {trust}, "figures": [\n'
    TABLE.parent.mkdir(exist_ok=True)
    TABLE.write_text(text + ",\n".join(rows) + "\n]}\n", encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fields", type=int, default=24, help="simulated fields of each kind")
    parser.add_argument("--cache", type=Path, help="keep the examples in this file")
    parser.add_argument("--afresh", action="store_true", help="with no help of the present table")
    parser.add_argument("--write", action="store_true", help="write tables/outline.json")
    options = parser.parse_args()
    if options.cache and options.cache.is_file():
        known = pickle.loads(options.cache.read_bytes())
    else:
        rng = np.random.default_rng(2)
        curves = choice.learned() if TABLE.is_file() and not options.afresh else None
        known = []
        for case in cases(options.fields):
            if (one := examples(case, rng, curves)) is not None:
                known.append(one)
            if len(known) % 20 == 0:
                print(f"{len(known)} cases", flush=True)
        if options.cache:
            options.cache.write_bytes(pickle.dumps(known))
    curves = learn(known)
    curves, page = report(known, curves, options.fields)
    print("\n".join(page))
    if options.write:
        write(curves)
        RESULTS.write_text("\n".join(page) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
