"""Learn which of the outlines of a search is taken, and what that certainty is worth.

    python tools/train_ranking.py CACHE [CACHE ...] [--write] [--processes 1] [--add FIGURE]

Learned from all fields drawn by eye, each searched with the network and the ranking that were
learned without its site, and from simulated ones: the curves over the figures of the outlines make
beliefs as likely as their overlaps with the truth say. Every other search is asked on with points,
each where the outline that is taken errs most, as people correct it.

What is shipped (`learned/outline_ranking.json`) is learned from all. `left_out/outline_ranking_K`
is learned from no outline of fold K, though behind the networks of the other folds, which have seen
them. What certainty is worth is learned from the outlines that such tables take of their own folds,
in table K from those of the other folds. These are also what the printed figures tell of.

The tables that are shipped were learned by points where the outline with the best score erred. With
tables learned by one round of points where the taken one did, three and four points had .917 and
.934 (by the shipped ones .920, .924; 90 fields, sites left out), and one of the seven fields of
`field_truth.csv` fell to .786. A figure for how much farther the border goes from the last point
than it was took .879, .903 and .913 with two, three and four points where it is .875, .901 and .912
without (303 fields), and lost a simulated field whose border is clicked 3 px aside.

CACHE keeps the searches. These follow the tables that are there, and a ranking sees other outlines
where it has led the search itself: so learn and write, search into one more CACHE, learn from both
and write.

The ground with the largest expected overlap, put together from all outlines instead of taken from
one, was .750 where the choice was .748 on the picture of the search (fields left out, four bands).

Curves of their own for outlines that points corrected, which also count how deep the last point
lies in the piece that it changes and how large that is, took .836, .872 and .893 with two, three
and four points where the common ones take .831, .865 and .885 (the best there are .906, .921,
.930; 552 fields, folds left out): too little for a second table. Both were measured behind an
earlier network.

Nine figures are all that a ranking needs: with 63 of them (strengths, strips beside the border,
what is rough, uneven or strange inside, shape) outlines taken of fields left out overlap by .824,
after one, two and three points by .871, .903 and .911; with these by .825, .872, .902 and .911, all
measured in squares of 5 px. Pixel by pixel, as today, these have .826, .874, .897 and .908.
Superpixels merged into a tree, minimum cuts, and outlines redrawn along their long sides made many
more outlines: the best of all had .884 (.855 without), what was taken .825 as well; after none to
three points .869, .896, .917 and .925 where without them it was .872, .905, .915 and .930 (46
fields, by the curves of before). Outlines that change by one piece, where the answer to the last
point differs from what was taken, make the best there a little better (.919, .935 and .946 with
two to four points for .915, .932 and .944) and what is taken hardly (+.002, standard error .001,
two to six points, 170 fields).

Sides beside a point put where the picture changes most beyond it, as further outlines, changed
nothing: with two to ten points -.003 to +.001, standard errors .001 to .003 (119 fields).

Certainty is told no better by what else can be asked: whether the answers from six other places in
the ground, or from the picture mirrored, are the same ground, and whether those from ground beside
it take it in. Bad outlines (below .8) are told from good ones (from .88 on) with an area under the
curve of .871 to .881, .875 without (552 fields, folds left out).
"""

from __future__ import annotations

import argparse
import json
import math
import pickle
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from learned_with import LEARNED, LEFT_OUT, learned_with
from outline_cases import FOLDS, TABLES, left_out
from outline_searches import Searched, all_searched
from scipy.optimize import minimize

from geofield.field.likely import MOST_CERTAIN, Candidate, evidence_of
from geofield.field.quality import TRUSTED
from geofield.field.ranking import (
    BEND,
    END,
    SAME_GROUND,
    WEIGHED,
    Ranking,
    agreement,
    asked,
    bends,
    exact,
    expected_overlaps,
    trained,
)

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
#: What a simulated picture counts against a real one, and outlines that points correct against
#: those without.
SIMULATED_COUNTS, CORRECTED_COUNTS = 4.0, 0.5
#: Overlap from which an outline is right, by what is asked.
RIGHT = {"field": 0.85, "ground": 0.70, "border": 0.93}
#: Overlaps of outlines to be warned of, and of good ones.
BAD, GOOD = 0.8, 0.88
#: What certainty is told from.
EVIDENCE = (
    "expected_overlap",
    "belief_alike",
    "network_overlap",
    "network_fit_of_area",
    "strength_25_above_inside",
    "inside_95_above_border",
    "network_missed",
    "long_sides_share",
    "vertices",
    "corrections",
)


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


def exact_lessons(
    known: Sequence[Searched], mean: np.ndarray, spread: np.ndarray
) -> Iterator[Lesson]:
    """Where it ends: of each search, the outlines of the ground that was taken."""
    for weight, one in zip(weights(known), known, strict=True):
        overlap = one.overlap[one.ground]
        regret = np.minimum(overlap.max() - overlap, WORST)
        belief = np.exp(-EXACT_SHARPNESS * regret)
        share = (overlap.max() - EXACT_FROM) / (EXACT_WHOLE - EXACT_FROM)
        own = bent(one, mean, spread)[one.ground]
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
    answer = one.figures[order, one.names.index("network_overlap")]
    answered = agreement(answer, one.corrections)
    return order, *expected_overlaps([one.polygons[k] for k in order], score[order], answered)


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


def calibrated(some: Sequence[Chosen]) -> dict[str, dict[str, dict[str, float]]]:
    """Weights of the evidence for an outline being right, of first outlines and of corrected ones.

    First outlines of sites left out are told with an error of .024 (other pictures of them .018)
    by weights of their own, of .031 (.043) by common ones.
    """
    kind = np.array([asked(one.of.corrections) for one in some])
    x = np.array([[one.evidence[name] for name in EVIDENCE] for one in some])
    overlap = np.array([one.overlap for one in some])
    return {
        one: regressed(x[kind == one], overlap[kind == one]) for one in dict.fromkeys(kind.tolist())
    }


def regressed(evidence: np.ndarray, overlap: np.ndarray) -> dict[str, dict[str, float]]:
    """Weights of what differs at all, by what is asked (logistic regression, ridge)."""
    told = np.ptp(evidence, axis=0) > 0
    names = [name for name, differs in zip(EVIDENCE, told.tolist(), strict=True) if differs]
    x = evidence[:, told]
    mean, spread = x.mean(axis=0), x.std(axis=0)
    z = np.column_stack([(x - mean) / spread, np.ones(len(x))])
    found = {}
    for what, least in RIGHT.items():
        right = (overlap >= least).astype(float)

        def loss(w: np.ndarray, right: np.ndarray = right) -> tuple[float, np.ndarray]:
            t = z @ w
            p = 1 / (1 + np.exp(-t))
            total = np.sum(np.logaddexp(0, t) - right * t) + CALM * float(w[:-1] @ w[:-1])
            return float(total), z.T @ (p - right) + 2 * CALM * np.append(w[:-1], 0.0)

        w = minimize(loss, np.zeros(z.shape[1]), jac=True, method="L-BFGS-B").x
        slope = w[:-1] / spread
        table = dict(zip(names, slope.round(5).tolist(), strict=True))
        found[what] = {**table, "constant": round(float(w[-1] - slope @ mean), 5)}
    return found


def coarse(known: Sequence[Searched]) -> Ranking:
    """What is learned of which ground is meant; of where it ends nothing yet."""
    every = np.concatenate([one.figures for one in known])
    mean, spread = every.mean(axis=0).round(5), (every.std(axis=0) + 1e-5).round(5)
    slope = rounded(SURER * learn(list(lessons(known, mean, spread)), RIDGE))
    return Ranking(known[0].names, mean, spread, slope, np.zeros_like(slope), {})


def with_edges(ranking: Ranking, known: Sequence[Searched]) -> Ranking:
    """The ranking with what is learned of where the ground ends."""
    some = list(exact_lessons(known, ranking.mean, ranking.spread))
    return replace(ranking, edge=rounded(learn(some, EXACT_RIDGE)))


def rounded(slopes: np.ndarray) -> np.ndarray:
    return slopes.round(4)


def rankings_of(
    known: Sequence[Searched], added: Sequence[str] = ()
) -> tuple[list[Ranking], Ranking, list[Chosen]]:
    """Without each fold, and of all; and what those without take of their own folds.

    By the figures of the shipped table, and some that it does not have yet.
    """
    names = tuple(dict.fromkeys((*trained().names, *added)))
    at = [known[0].names.index(name) for name in names]
    for one in known:
        one.figures = one.figures[:, at]
        one.names = names
    folds = [[one for one in known if one.fold != k] for k in range(FOLDS)]
    grounds = [coarse(some) for some in folds]
    for one in known:
        order, _, expected, overlap = weighed(one, grounds[one.fold])
        one.ground = order[overlap[int(np.argmax(expected))] >= SAME_GROUND]
    without = [with_edges(one, some) for one, some in zip(grounds, folds, strict=True)]
    taken = [chosen(one, without[one.fold]) for one in known]
    real = [one for one in taken if not simulated(one)]
    without = [
        replace(ranking, calibration=calibrated([one for one in real if one.of.fold != k]))
        for k, ranking in enumerate(without)
    ]
    whole = replace(with_edges(coarse(known), known), calibration=calibrated(real))
    return without, whole, taken


def write(ranking: Ranking, file: Path, folds: Sequence[int]) -> None:
    """Write a table that was learned from some folds, one figure per line."""
    rows = [
        {
            "name": name,
            "mean": float(ranking.mean[n]),
            "spread": float(ranking.spread[n]),
            "slope": ranking.slope[:, n].tolist(),
            "edge": ranking.edge[:, n].tolist(),
        }
        for n, name in enumerate(ranking.names)
    ]
    steps = product(folds, ("", "_points"))
    networks = [LEFT_OUT / f"outline_{fold}{step}.onnx" for fold, step in steps]
    table = {
        "learned_by": "tools/train_ranking.py",
        "learned_with": learned_with([*networks, *(table for _, table, _ in TABLES)]),
        "bend_end": [BEND, END],
        "calibration": ranking.calibration,
        "figures": rows,
    }
    text = json.dumps(table).replace('{"name"', '\n{"name"')
    file.write_text(text + "\n", encoding="utf-8")


def simulated(one: Chosen) -> bool:
    return one.of.mark.startswith("simulated")


def report(taken: Sequence[Chosen], without: Sequence[Ranking]) -> None:
    """Print what tables take of their own folds: overlaps by kind of case, and certainty."""
    marks = [one.of.mark for one in taken]
    for mark in dict.fromkeys(marks):
        some = [one for one in taken if one.of.mark == mark]
        got = np.array([one.overlap for one in some])
        best = np.array([one.of.overlap.max() for one in some])
        print(
            f"{mark:24s} {len(some):4d} best {best.mean():.3f} taken {got.mean():.3f} "
            f">=.88 {np.mean(got >= 0.88):.2f} tenth {np.quantile(got, 0.1):.2f}"
        )
    plain = {mark for mark, _, _ in TABLES}
    first = [one for one in taken if not (one.of.corrections or simulated(one))]
    for kind, own in (("as they are", True), ("as other pictures", False)):
        some = [one for one in first if (one.of.mark in plain) == own]
        print(f"fields {kind}: {certainty(some, without)}")


def certainty(some: Sequence[Chosen], without: Sequence[Ranking]) -> str:
    """How far off certainty is, and how many good and bad outlines it alone warns of."""
    overlap = np.array([one.overlap for one in some])
    told = np.array([without[one.of.fold].certainty("field", one.evidence) for one in some])
    told = np.minimum(told, MOST_CERTAIN)
    right = overlap >= RIGHT["field"]
    bins = np.clip((told * 5).astype(int), 0, 4)
    error = sum(
        abs(float((told[bins == number] - right[bins == number]).sum())) for number in range(5)
    )
    warned = told < TRUSTED
    bad, good = overlap < BAD, overlap >= GOOD
    return (
        f"certainty {error / len(some):.3f} off; warned of {np.sum(warned & bad)} of {bad.sum()} "
        f"below {BAD}, {np.sum(warned & good)} of {good.sum()} from {GOOD} on"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("caches", type=Path, nargs="+", metavar="CACHE")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--write", action="store_true")
    parser.add_argument(
        "--add", nargs="*", default=(), metavar="FIGURE", help="not yet in the table"
    )
    options = parser.parse_args()
    for fold in range(FOLDS):
        left_out(fold)  # one that is missing is told before the long work
    known: list[Searched] = []
    for cache in options.caches:
        if not cache.is_file():
            cache.write_bytes(pickle.dumps(list(all_searched(options.processes))))
        known += pickle.loads(cache.read_bytes())
    without, whole, taken = rankings_of(known, options.add)
    report(taken, without)
    if options.write:
        every = range(FOLDS)
        write(whole, LEARNED / "outline_ranking.json", every)
        for k, ranking in enumerate(without):
            others = [fold for fold in every if fold != k]
            write(ranking, LEFT_OUT / f"outline_ranking_{k}.json", others)


if __name__ == "__main__":
    main()
