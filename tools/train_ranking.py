"""Learn which of the outlines of a search is taken, and what that certainty is worth.

    python tools/train_ranking.py CACHE [CACHE ...] [--write] [--processes 1]

Learned from fields drawn by eye on sites that the network has not seen, and from simulated ones:
the curves over the figures of the outlines make beliefs as likely as their overlaps with the
truth say. Every other search is asked on with points, each where its best outline errs most, as
people correct it. Part K of the table is learned without the sites of fold K, and what certainty
is worth from outlines taken by such parts. CACHE keeps the searches. These follow the table that
is there, and a ranking sees other outlines where it has led the search itself: so learn and write,
search into one more CACHE, learn from both and write.

Not the choice among the outlines is what is short, given these beliefs: the ground with the largest
expected overlap, put together from all outlines instead of taken from one, is .750 where the choice
is .748 on the picture of the search (fields left out, four bands); mixed with the network's own
answer, in any share, no more.
"""

from __future__ import annotations

import argparse
import json
import math
import pickle
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from multiprocessing import Pool
from pathlib import Path

import numpy as np
import shapely
from learned_with import LEARNED, learned_with
from outline_cases import (
    FOLDS,
    TABLES,
    Case,
    fold_of,
    middle_of_error,
    other,
    reseeded,
    simulated,
    unseen,
)
from scipy.optimize import minimize

from geofield.field.auto import evidence_of
from geofield.field.ranking import (
    BEND,
    END,
    SAME_GROUND,
    WEIGHED,
    Ranking,
    bends,
    exact,
    expected_overlaps,
    trained,
)
from geofield.field.search import Candidate, search_field

TABLE = LEARNED / "outline_ranking.json"
#: Pull towards zero, of curves and of what certainty is worth.
RIDGE, CALM = 5e-2, 1.0
#: What is learned is believed so much more, as outlines that are much alike are many, and would
#: outweigh a single better one.
SURER = 2.0
#: How much likelier an outline is believed to be for its overlap; less than half is nothing.
SHARPNESS, WORST = 8.0, 0.5
#: The same among outlines of one ground, and the pull towards zero there; from which overlap such
#: a ground teaches anything, and from which it counts whole.
EXACT_SHARPNESS, EXACT_RIDGE, EXACT_FROM, EXACT_WHOLE = 50.0, 1e-3, 0.5, 0.8
#: Simulated pictures, and what one counts against a real one.
SIMULATED, SIMULATED_COUNTS = 20, 4.0
#: Points that correct what was found before; what the outlines with such count against those
#: without.
CORRECTIONS, CORRECTED_COUNTS = 3, 0.5
#: Other pictures of the fields.
OTHERS = ("colour", "grey", "JPEG 40", "colour", "grey", "haze", "contrast")
#: Overlap from which an outline is right, by what is asked.
RIGHT = {"field": 0.85, "ground": 0.70, "border": 0.93}
#: What certainty is told from.
EVIDENCE = (
    "expected_overlap",
    "belief_alike",
    "network_overlap",
    "network_fit_of_area",
    "strength_25_above_inside",
    "inside_95_above_border",
    "frame_share",
    "long_sides_share",
    "corrections",
)


@dataclass
class Searched:
    """The outlines of one search, with their overlaps with the truth."""

    name: str
    mark: str
    site: str
    names: tuple[str, ...]
    figures: np.ndarray
    polygons: list[shapely.Polygon]
    overlap: np.ndarray
    corrections: int

    @property
    def fold(self) -> int:
        return fold_of(self.site, FOLDS)


def searched(case: Case) -> list[Searched]:
    """The search of a case, of every other one again with points where its best outline errs."""
    search = search_field(case.scene, case.x_px, case.y_px, part=fold_of(case.site, FOLDS))
    truth = shapely.transform(case.truth, lambda c: c / search.factor)
    found = []
    include: tuple[tuple[float, float], ...] = ()
    exclude: tuple[tuple[float, float], ...] = ()
    for turn in range(1 + CORRECTIONS):
        candidates = search.candidates(include, exclude)
        if not candidates:
            break
        polygons = [one.polygon for one in candidates]
        common = shapely.area(shapely.intersection(polygons, truth))
        either = shapely.area(polygons) + truth.area - common
        names = tuple(candidates[0].figures)
        values = np.array([[one.figures[name] for name in names] for one in candidates])
        name = f"{case.name} {turn}"
        mark = case.mark if turn == 0 else f"{case.mark} clicked {turn}"
        overlap = common / either
        found.append(Searched(name, mark, case.site, names, values, polygons, overlap, turn))
        wrong = middle_of_error(polygons[0], truth, search.surface.shape)
        if wrong is None or zlib.crc32(case.name.encode()) % 2:
            break
        if wrong[0]:
            include = (*include, wrong[1])
        else:
            exclude = (*exclude, wrong[1])
    return found


def weights(known: Sequence[Searched]) -> np.ndarray:
    """What each counts: a site by the root of its pictures, as its years are much alike."""
    often = Counter(one.site for one in known if not one.corrections)
    share = np.array([counts(one) / often[one.site] ** 0.5 for one in known])
    return share / share.sum()


def counts(one: Searched) -> float:
    """What a search of its kind counts."""
    kind = SIMULATED_COUNTS if one.mark.startswith("simulated") else 1.0
    return kind * (CORRECTED_COUNTS if one.corrections else 1.0)


#: Weight, figures bent (outlines, 3 x names), beliefs that are wanted.
Lesson = tuple[float, np.ndarray, np.ndarray]


def lessons(known: Sequence[Searched], mean: np.ndarray, spread: np.ndarray) -> Iterator[Lesson]:
    """Which ground is meant."""
    for weight, one in zip(weights(known), known, strict=True):
        regret = np.minimum(one.overlap.max() - one.overlap, WORST)
        belief = np.exp(-SHARPNESS * regret)
        yield weight, bent(one, mean, spread), belief / belief.sum()


def exact_lessons(known: Sequence[Searched], rankings: Sequence[Ranking]) -> Iterator[Lesson]:
    """Where it ends: the outlines of the ground that a ranking takes, each judged by its part."""
    for weight, one in zip(weights(known), known, strict=True):
        ranking = rankings[one.fold]
        order, _, expected, overlap = weighed(one, ranking)
        order = order[overlap[int(np.argmax(expected))] >= SAME_GROUND]
        regret = np.minimum(one.overlap[order].max() - one.overlap[order], WORST)
        belief = np.exp(-EXACT_SHARPNESS * regret)
        share = (one.overlap[order].max() - EXACT_FROM) / (EXACT_WHOLE - EXACT_FROM)
        own = bent(one, ranking.mean, ranking.spread)[order]
        yield weight * min(max(share, 0.0), 1.0), own, belief / belief.sum()


def learn(some: Sequence[Lesson], ridge: float) -> np.ndarray:
    """Slopes (3, names) under which beliefs follow lessons (cross entropy, ridge; convex)."""

    def loss(slope: np.ndarray) -> tuple[float, np.ndarray]:
        total, gradient = ridge * float(slope @ slope), 2 * ridge * slope
        for weight, part, target in some:
            score = part @ slope
            score -= score.max()
            belief = np.exp(score)
            mass = belief.sum()
            total += weight * (math.log(mass) - float(target @ score))
            gradient = gradient + weight * (part.T @ (belief / mass - target))
        return total, gradient

    size = some[0][1].shape[1]
    found = minimize(loss, np.zeros(size), jac=True, method="L-BFGS-B", options={"maxiter": 200})
    return found.x.reshape(3, -1)


def bent(one: Searched, mean: np.ndarray, spread: np.ndarray) -> np.ndarray:
    return np.concatenate(list(bends((one.figures - mean) / spread)), axis=1)


@dataclass
class Chosen:
    """The outline that a ranking takes, its overlap and what speaks for it."""

    of: Searched
    overlap: float
    evidence: dict[str, float]


def weighed(
    one: Searched, ranking: Ranking
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The best outlines' order, beliefs in them, their expected overlaps and overlaps."""
    score = bent(one, ranking.mean, ranking.spread) @ ranking.slope.ravel()
    order = np.argsort(-score, kind="stable")[:WEIGHED]
    return order, *expected_overlaps([one.polygons[k] for k in order], score[order])


def chosen(one: Searched, ranking: Ranking) -> Chosen:
    """What a ranking takes of a search."""
    order, belief, expected, overlap = weighed(one, ranking)
    exactness = bent(one, ranking.mean, ranking.spread)[order] @ ranking.edge.ravel()
    best = exact(expected, overlap, exactness, [one.polygons[k] for k in order])
    figures = dict(zip(one.names, one.figures[order[best]].tolist(), strict=True))
    candidate = Candidate(one.polygons[order[best]], None, figures, 0.0)  # type: ignore[arg-type]
    figures["corrections"] = float(one.corrections)
    evidence = evidence_of(candidate, float(expected[best]), belief, overlap[best])
    return Chosen(one, float(one.overlap[order[best]]), dict(evidence))


def calibrated(some: Sequence[Chosen]) -> dict[str, dict[str, float]]:
    """Weights of the evidence for an outline being right (logistic regression, ridge)."""
    x = np.array([[*(one.evidence[name] for name in EVIDENCE), 1.0] for one in some])
    share = weights([one.of for one in some]) * len(some)
    mean, spread = x[:, :-1].mean(axis=0), x[:, :-1].std(axis=0) + 1e-9
    z = np.column_stack([(x[:, :-1] - mean) / spread, np.ones(len(x))])
    found = {}
    for what, least in RIGHT.items():
        right = np.array([one.overlap >= least for one in some], float)

        def loss(w: np.ndarray, right: np.ndarray = right) -> tuple[float, np.ndarray]:
            t = z @ w
            p = 1 / (1 + np.exp(-t))
            total = share @ (np.logaddexp(0, t) - right * t) + CALM * float(w[:-1] @ w[:-1])
            return total, z.T @ (share * (p - right)) + 2 * CALM * np.append(w[:-1], 0.0)

        w = minimize(loss, np.zeros(z.shape[1]), jac=True, method="L-BFGS-B").x
        slope = w[:-1] / spread
        table = dict(zip(EVIDENCE, slope.round(5).tolist(), strict=True))
        found[what] = {**table, "constant": round(float(w[-1] - slope @ mean), 5)}
    return found


def rounded(slopes: np.ndarray) -> np.ndarray:
    return slopes.round(4)


def table_of(known: Sequence[Searched]) -> tuple[dict, list[Chosen]]:
    """The table, and what its parts take on the sites that they have not seen."""
    names = trained().names
    at = [known[0].names.index(name) for name in names]
    for one in known:
        one.figures = one.figures[:, at]
        one.names = names
    every = np.concatenate([one.figures for one in known])
    mean, spread = every.mean(axis=0).round(5), (every.std(axis=0) + 1e-5).round(5)
    left_out = [[one for one in known if one.fold != k] for k in range(FOLDS)]
    slopes = [rounded(SURER * learn(list(lessons(some, mean, spread)), RIDGE)) for some in left_out]
    none = np.zeros_like(slopes[0])
    coarse = [Ranking(names, mean, spread, slope, none, {}) for slope in slopes]
    edges = [rounded(learn(list(exact_lessons(some, coarse)), EXACT_RIDGE)) for some in left_out]
    parts = [replace(one, edge=edge) for one, edge in zip(coarse, edges, strict=True)]
    taken = [chosen(one, parts[one.fold]) for one in known]
    real = [one for one in taken if not one.of.mark.startswith("simulated")]
    calibration = {"all": calibrated(real)}
    for k in range(FOLDS):
        calibration[str(k)] = calibrated([one for one in real if one.of.fold != k])
    rows = [
        {
            "name": name,
            "mean": float(mean[n]),
            "spread": float(spread[n]),
            "slopes": [part[:, n].tolist() for part in slopes],
            "edges": [part[:, n].tolist() for part in edges],
        }
        for n, name in enumerate(names)
    ]
    tables = [table for _, table, _ in TABLES]
    table = {
        "learned_by": "tools/train_ranking.py",
        "learned_with": learned_with([LEARNED / "outline.onnx", *tables]),
        "bend_end": [BEND, END],
        "calibration": calibration,
        "figures": rows,
    }
    return table, taken


def report(taken: Sequence[Chosen]) -> None:
    """Print mean overlaps by kind of case, of the best outline, of the one taken."""
    marks = [one.of.mark for one in taken]
    for mark in dict.fromkeys(marks):
        some = [one for one in taken if one.of.mark == mark]
        got = np.array([one.overlap for one in some])
        best = np.array([one.of.overlap.max() for one in some])
        print(
            f"{mark:24s} {len(some):4d} best {best.mean():.3f} taken {got.mean():.3f} "
            f">=.88 {np.mean(got >= 0.88):.2f} tenth {np.quantile(got, 0.1):.2f}"
        )


def write(table: dict) -> None:
    """Write the table, one figure per line."""
    text = json.dumps(table).replace('{"name"', '\n{"name"')
    TABLE.write_text(text + "\n", encoding="utf-8")


def cases() -> Iterator[Case]:
    """What is learned from: each field as it is and as another picture; simulated ones."""
    for case in unseen():
        yield case
        pick = zlib.crc32(case.name.encode())
        yield other(reseeded(case), OTHERS[pick % len(OTHERS)])
    yield from simulated(SIMULATED)


def all_searched(processes: int) -> Iterator[Searched]:
    """The searches of every case."""
    some = list(cases())
    with Pool(processes) as pool:
        for number, found in enumerate(pool.imap(searched, some, chunksize=4), 1):
            yield from found
            if number % 50 == 0:
                print(f"{number} of {len(some)}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("caches", type=Path, nargs="+", metavar="CACHE")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    known: list[Searched] = []
    for cache in options.caches:
        if not cache.is_file():
            cache.write_bytes(pickle.dumps(list(all_searched(options.processes))))
        known += pickle.loads(cache.read_bytes())
    table, taken = table_of(known)
    report(taken)
    if options.write:
        write(table)


if __name__ == "__main__":
    main()
