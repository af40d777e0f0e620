"""Learn how `auto` chooses between outlines; says how well it does elsewhere.

    python benchmarks/field_choice.py [--fields 24] [--cache FILE] [--write]

Learned from real and simulated fields (`field_cases.py`), each with and without near infrared.
First opinion: curves over the figures of an outline make the beliefs over a picture's outlines
as likely as their overlaps with the truth say. Second opinion, where the first leaves doubt: a
small network learns which superpixels belong to the field (`field_ground.py`), and other curves
also count how well an outline agrees with it. "Left out" figures come from networks and curves
that never saw the site.
"""

from __future__ import annotations

import argparse
import json
import math
import pickle
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from typing import TypeVar

import numpy as np
from scipy.optimize import minimize

import field_ground
from common import RESULTS, overlap_mask
from field_cases import Case, cases, folds, weights
from field_certainty import Found, left_out_certainty, tables, trusting
from field_examples import Examples, examples
from geofield.field import auto, ground, scoring
from geofield.field.refine import carried

TABLES = Path(scoring.__file__).parent / "tables"
#: Pull towards zero.
RIDGE = 1e-2
#: How much likelier an outline is believed to be for its overlap, in the first and the second
#: opinion; less than half is nothing.
SHARPNESS, WORST = (30.0, 15.0), 0.5
#: Weight of a simulated picture, and of a field of `field_truth.csv`, against another real one.
SIMULATED, TRUTH = 0.7, 4.0
FOLDS = 8
Result = TypeVar("Result")


def shares(known: Sequence[Examples]) -> np.ndarray:
    """What the cases count, to add up to one."""
    share = weights(known, SIMULATED, TRUTH)
    return share / share.sum()


def network_of(known: Sequence[Examples]) -> ground.Network:
    """The network of the second opinion."""
    return field_ground.learn(known, shares(known))


def learn(
    known: Sequence[Examples], figures: Sequence[np.ndarray], sharpness: float
) -> scoring.Curves:
    """Curves under which beliefs follow overlaps (cross entropy, ridge; convex)."""
    every = np.concatenate(figures)
    usual, spread = every.mean(axis=0), every.std(axis=0) + 1e-9
    share = shares(known)
    bent, wanted = [], []
    for one, values in zip(known, figures, strict=True):
        parts = scoring.bends((values - usual) / spread)
        bent.append(np.concatenate(list(parts), axis=1))
        regret = np.minimum(one.overlap.max() - one.overlap, WORST)
        belief = np.exp(-sharpness * regret)
        wanted.append(belief / belief.sum())

    def loss(slope: np.ndarray) -> tuple[float, np.ndarray]:
        total, gradient = RIDGE * float(slope @ slope), 2 * RIDGE * slope
        for weight, part, target in zip(share, bent, wanted, strict=True):
            score = part @ slope
            score -= score.max()
            belief = np.exp(score)
            mass = belief.sum()
            total += weight * (math.log(mass) - float(target @ score))
            gradient = gradient + weight * (part.T @ (belief / mass - target))
        return total, gradient

    size = bent[0].shape[1]
    found = minimize(loss, np.zeros(size), jac=True, method="L-BFGS-B", options={"maxiter": 400})
    return scoring.Curves(usual, spread, found.x.reshape(3, -1))


@dataclass
class Learned:
    """What both opinions need."""

    first: scoring.Curves
    second: scoring.Curves
    network: ground.Network


@dataclass
class LeftOut:
    """What was learned without the sites of each fold."""

    fold: dict[str, int]
    parts: list[Learned]

    def of(self, site: str) -> Learned:
        """What was learned without a site."""
        return self.parts[self.fold[site]]


def leave_out(known: list[Examples]) -> tuple[LeftOut, list[np.ndarray]]:
    """Learn without each fold; also outlines' figures, with networks that never saw the site."""
    fold = folds(known, FOLDS, seed=1)
    others = [np.flatnonzero(fold != number) for number in range(FOLDS)]
    networks = [network_of([known[k] for k in at]) for at in others]
    figures = [one.with_ground(networks[k]) for k, one in zip(fold, known, strict=True)]
    parts = [
        both([known[k] for k in at], [figures[k] for k in at], network)
        for at, network in zip(others, networks, strict=True)
    ]
    return LeftOut({one.site: int(k) for k, one in zip(fold, known, strict=True)}, parts), figures


def both(known: list[Examples], figures: list[np.ndarray], network: ground.Network) -> Learned:
    """Curves of both opinions; `figures` count the agreement with networks of other sites."""
    first = [one.figures.astype(float) for one in known]
    return Learned(learn(known, first, SHARPNESS[0]), learn(known, figures, SHARPNESS[1]), network)


def searched(case: Case, left_out: LeftOut) -> tuple[Found, Found]:
    """Both opinions of those that never saw the site."""
    part = left_out.of(case.site)
    factor = auto.reduction(case.scene)
    seed = (case.x_px / factor, case.y_px / factor)
    ready = auto.prepared(case.scene, factor, seed)
    found = []
    for curves, network in ((part.first, None), (part.second, part.network)):
        opinion = auto.opinion(ready, curves, network)
        if opinion is None:
            found.append(Found(case.name, case.mark, case.site, 0.0, 0.0, curves.usual))
            continue
        mask = carried(case.scene, opinion.outline.polygon, factor, seed)
        shared, figures = overlap_mask(mask, case.truth), opinion.outline.figures
        found.append(Found(case.name, case.mark, case.site, opinion.expected, shared, figures))
    return found[0], found[1]


def report(
    known: list[Examples], left_out: LeftOut, learned: Learned, fields: int
) -> tuple[Learned, list[str]]:
    """What was learned, with what its doubt is worth, and a page on how well it chooses."""
    names = {one.name for one in known}
    with Pool() as pool:
        found = pool.imap(
            partial(searched, left_out=left_out),
            (case for case in cases(fields) if case.name in names),
            chunksize=4,
        )
        firsts, seconds = zip(*progress(found), strict=True)
    certain = left_out_certainty(firsts, learned.first)
    doubtful = np.flatnonzero(certain < auto.SECOND_OPINION)
    asked = [seconds[at] for at in doubtful]
    certain[doubtful] = left_out_certainty(asked, learned.second)
    chosen = list(firsts)
    for at, one in zip(doubtful, asked, strict=True):
        chosen[at] = one
    learned = Learned(
        replace(learned.first, trust=trusting(firsts, learned.first)),
        replace(learned.second, trust=trusting(asked, learned.second)),
        learned.network,
    )
    page = [
        "# The choice of an outline",
        "",
        "Overlap (intersection over union) of the best of the outlines learned from, of both "
        "opinions, and of the choice of `auto`, which asks the second where the first leaves "
        "doubt; all learned without the site. Real fields were digitised by eye (own: with a "
        "plain border; hard: lots, meadows, deserts); each with two points in it, also without "
        "near infrared (rgb) and colour (grey).",
        "",
        "| cases | best outline | first opinion | second | asked | chosen | worst | below 0.88 |",
        "|---" * 8 + "|",
    ]
    top = {one.name: float(one.overlap.max()) for one in known}
    marks = np.array([one.mark for one in firsts])
    columns = [np.array([one.overlap for one in part]) for part in (firsts, seconds, chosen)]
    best = np.array([top[one.name] for one in firsts])
    for mark in dict.fromkeys(marks.tolist()):
        at = marks == mark
        first, second, taken = (column[at] for column in columns)
        page.append(
            f"| {mark} ({at.sum()}) | {best[at].mean():.3f} | {first.mean():.3f} "
            f"| {second.mean():.3f} | {np.isin(np.flatnonzero(at), doubtful).mean():.0%} "
            f"| {taken.mean():.3f} | {taken.min():.3f} | {np.mean(taken < 0.88):.0%} |"
        )
    return learned, [*page, "", *tables(chosen, certain)]


def progress(found: Iterator[Result]) -> Iterator[Result]:
    for number, one in enumerate(found, 1):
        yield one
        if number % 40 == 0:
            print(f"{number} cases", flush=True)


def write(curves: scoring.Curves, names: Sequence[str], table: Path) -> None:
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
            names, curves.usual, curves.spread, curves.slope.T, strict=True
        )
    ]
    trust = dict(zip(scoring.EVIDENCE, (round(float(one), 4) for one in curves.trust), strict=True))
    text = '{"learned_by": "benchmarks/field_choice.py",\n'
    text += f'"trust": {json.dumps(trust)},\n"figures": [\n'
    table.write_text(text + ",\n".join(rows) + "\n]}\n", encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fields", type=int, default=24, help="simulated fields of each kind")
    parser.add_argument("--cache", type=Path, help="keep the examples in this file")
    parser.add_argument("--afresh", action="store_true", help="with no help of the present table")
    parser.add_argument("--write", action="store_true", help="write tables/*.json")
    options = parser.parse_args()
    if options.cache and options.cache.is_file():
        known = pickle.loads(options.cache.read_bytes())
    else:
        curves = None if options.afresh else scoring.learned()
        with Pool() as pool:
            made = pool.imap(partial(examples, curves=curves), cases(options.fields), chunksize=4)
            known = [one for one in progress(made) if one is not None]
        if options.cache:
            options.cache.write_bytes(pickle.dumps(known))
    left_out, figures = leave_out(known)
    learned = both(known, figures, network_of(known))
    learned, page = report(known, left_out, learned, options.fields)
    print("\n".join(page))
    if options.write:
        write(learned.first, scoring.NAMES, TABLES / "outline.json")
        write(learned.second, scoring.WITH_GROUND, TABLES / "opinion.json")
        field_ground.write(learned.network)
        (RESULTS / "field_choice.md").write_text("\n".join(page) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
