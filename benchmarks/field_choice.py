"""Learn the curves with which `auto` scores outlines; says how well they do elsewhere.

    python benchmarks/field_choice.py [--fields 24] [--cache FILE] [--write]

Learned from simulated fields (other seeds than those of `benchmarks/field.py`), the real
fields of `field_truth.csv` and 35 more that were digitised by eye for this purpose
(`field_labels.csv` here; pictures beside the project), each with and without near infrared.
The curves make the beliefs over a picture's outlines as likely as their overlaps with the
truth say. "Left out" figures come from curves that never saw the site.

How far a choice is to be trusted is learned from those left out and from the fields of
`field_labels_unseen.csv`, on many of which nobody would see a plain border.
"""

from __future__ import annotations

import argparse
import json
import math
import pickle
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from rasterio.features import rasterize
from scipy.optimize import minimize

from common import DATA, digitised
from field_certainty import Found, doubted, trusting
from geofield.field import auto, choice, scoring
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


#: Outlines drawn by eye: mark, table, folder of the pictures where the table does not say it.
LEARNED = (
    ("truth", DATA / "trees" / "field_truth.csv", "trees"),
    ("own", HERE / "field_labels.csv", None),
)
UNSEEN = (("unseen", HERE / "field_labels_unseen.csv", None),)


def labelled(tables: Sequence[tuple[str, Path, str | None]]) -> Iterator[Case]:
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
    """All cases learned from: two seeds each, real ones also without near infrared and colour."""
    rng = np.random.default_rng(0)
    yield from varied(labelled(LEARNED), rng)
    for index, case in enumerate(simulated(fields)):
        yield case
        other = reseeded(case, rng)
        yield replace(other, scene=colours(other.scene)) if index % 2 else other


def varied(drawn: Iterable[Case], rng: np.random.Generator) -> Iterator[Case]:
    for case in drawn:
        for one in (case, reseeded(case, rng)):
            yield one
            yield replace(one, name=f"{one.name} rgb", scene=colours(one.scene))
        yield replace(case, name=f"{case.name} grey", scene=grey(case.scene))


def reseeded(case: Case, rng: np.random.Generator) -> Case:
    row, column = np.nonzero(rasterize([(case.truth.buffer(-5), 1)], case.scene.grid.shape))
    at = int(rng.integers(len(row)))
    return replace(case, name=f"{case.name} moved", x_px=column[at] + 0.5, y_px=row[at] + 0.5)


def examples(
    case: Case, rng: np.random.Generator, curves: scoring.Curves | None
) -> Examples | None:
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


def learn(known: list[Examples]) -> scoring.Curves:
    """Curves under which beliefs follow overlaps (cross entropy, ridge; convex)."""
    every = np.concatenate([one.figures for one in known]).astype(float)
    usual, spread = every.mean(axis=0), every.std(axis=0) + 1e-9
    # A site counts by the root of its pictures: years and seeds of one site are much alike.
    often = Counter(one.site for one in known)
    share = np.array([(1 if one.real else SIMULATED) / often[one.site] ** 0.5 for one in known])
    share /= share.sum()
    bent, wanted = [], []
    for one in known:
        parts = scoring.bends((one.figures - usual) / spread)
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
    return scoring.Curves(usual, spread, found.x.reshape(3, -1))


def folds(known: list[Examples]) -> tuple[dict[str, int], list[scoring.Curves]]:
    """To which fold a site belongs, and curves that saw no site of each fold."""
    sites = sorted({one.site for one in known})
    order = np.random.default_rng(1).permutation(len(sites))
    fold = {site: int(at) % FOLDS for site, at in zip(sites, order, strict=True)}
    curves = [learn([one for one in known if fold[one.site] != number]) for number in range(FOLDS)]
    return fold, curves


def searched(case: Case, curves: scoring.Curves) -> Found:
    """What `auto` finds with these curves."""
    mark = case.name.partition(" ")[0] + _bands(case.name)
    factor = auto.reduction(case.scene)
    seed = (case.x_px / factor, case.y_px / factor)
    surface, regions, ground = auto.prepared(case.scene, factor, seed)
    outlines, score = choice.search(surface, regions, ground, curves)
    if not outlines:
        return Found(mark, case.site, 0.0, 0.0, curves.usual)
    best, expected = choice.choose([one.polygon for one in outlines], score)
    mask = carried(case.scene, outlines[best].polygon, factor, seed)
    truth = rasterize([(case.truth, 1)], mask.shape) > 0
    overlap = float((mask & truth).sum() / (mask | truth).sum())
    return Found(mark, case.site, expected, overlap, outlines[best].figures)


def report(
    known: list[Examples], curves: scoring.Curves, fields: int
) -> tuple[scoring.Curves, list[str]]:
    """The curves with what their doubt is worth, and a page on how well they choose."""
    fold, elsewhere = folds(known)
    best: dict[str, list[float]] = {}
    found: list[Found] = []
    top = {one.name: float(one.overlap.max()) for one in known}
    for case in cases(fields):
        if case.name in top:
            found.append(searched(case, elsewhere[fold[case.site]]))
            best.setdefault(found[-1].mark, []).append(top[case.name])
    for case in varied(labelled(UNSEEN), np.random.default_rng(3)):
        seen = case.site in fold  # another field of that site
        found.append(searched(case, elsewhere[fold[case.site]] if seen else curves))
    page = [
        "# The choice of an outline",
        "",
        "Overlap (intersection over union) of the best of the outlines learned from, and of the "
        "choice of `auto` with curves that never saw the site. Real fields were "
        "digitised by eye; each with two points in it, also without near infrared (rgb) and "
        "colour (grey). Nothing but the certainty was learned from the unseen.",
        "",
        "| cases | best outline | chosen, site left out | worst | below 0.88 |",
        "|---|---|---|---|---|",
    ]
    for mark in dict.fromkeys(one.mark for one in found):
        overlaps = np.array([one.overlap for one in found if one.mark == mark])
        page.append(
            f"| {mark} ({len(overlaps)}) "
            f"| {f'{np.mean(best[mark]):.3f}' if mark in best else '-'} | {overlaps.mean():.3f} "
            f"| {overlaps.min():.3f} | {np.mean(overlaps < 0.88):.0%} |"
        )
    return replace(curves, trust=trusting(found, curves)), [*page, "", *doubted(found, curves)]


def _bands(name: str) -> str:
    return next((end for end in (" rgb", " grey") if name.endswith(end)), "")


def write(curves: scoring.Curves) -> None:
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
            scoring.NAMES, curves.usual, curves.spread, curves.slope.T, strict=True
        )
    ]
    weights = dict(
        zip(scoring.EVIDENCE, (round(float(one), 4) for one in curves.trust), strict=True)
    )
    text = '{"learned_by": "benchmarks/field_choice.py",\n'
    text += f'"trust": {json.dumps(weights)},\n"figures": [\n'
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
        curves = scoring.learned() if TABLE.is_file() and not options.afresh else None
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
