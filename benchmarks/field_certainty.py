"""How far the choice of an outline is to be trusted: learned by `field_choice.py`.

A logistic regression from what `auto` knows of its choice (`Curves.evidence`) to whether the
outline was a good one, on sites that the curves had not seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from field_cases import folds, simulated_one, weights
from geofield.field import scoring

#: Weight of a simulated picture against a real one; pull towards zero; parts of the sites.
SIMULATED, RIDGE, FOLDS = 0.15, 1e-2, 8


@dataclass
class Found:
    """What was chosen: the case's name, mark and site, expected and true overlap, figures."""

    name: str
    mark: str
    site: str
    expected: float
    overlap: float
    figures: np.ndarray


def trusting(found: Sequence[Found], curves: scoring.Curves) -> np.ndarray:
    """Weights of the evidence for a good outline (logistic regression)."""
    evidence = np.array([curves.evidence(one.expected, one.figures) for one in found])
    good = np.array([one.overlap >= scoring.GOOD for one in found])
    weight = weights(found, SIMULATED)

    def loss(line: np.ndarray) -> float:
        odds = evidence @ line
        return float(weight @ (np.logaddexp(0, odds) - good * odds)) + RIDGE * float(line @ line)

    return np.asarray(minimize(loss, np.zeros(evidence.shape[1])).x)


def left_out_certainty(found: Sequence[Found], curves: scoring.Curves) -> np.ndarray:
    """Certainties with weights that were learned without the site."""
    fold = folds(found, FOLDS, seed=4)
    judges = [
        replace(curves, trust=trusting([found[at] for at in np.flatnonzero(fold != k)], curves))
        for k in range(FOLDS)
    ]
    return np.array(
        [
            judges[number].certainty(one.expected, one.figures)
            for number, one in zip(fold, found, strict=True)
        ]
    )


def tables(found: Sequence[Found], certain: np.ndarray) -> list[str]:
    """How well certainties tell good from bad."""
    overlaps = np.array([one.overlap for one in found])
    real = np.array([not simulated_one(one) for one in found])
    page = [
        "| certainty (real, left out) | cases | mean | share good | mean overlap |",
        "|---" * 5 + "|",
    ]
    for low, high in ((0, 0.3), (0.3, 0.5), (0.5, 0.7), (0.7, 0.85), (0.85, 1.01)):
        at = real & (certain >= low) & (certain < high)
        if at.any():
            page.append(
                f"| {low} to {min(high, 1)} | {at.sum()} | {certain[at].mean():.2f} "
                f"| {np.mean(overlaps[at] >= scoring.GOOD):.2f} | {overlaps[at].mean():.3f} |"
            )
    page += ["", "Certainty below 0.5, left out:", ""]
    page += ["| cases | overlap below 0.7 | 0.7 to 0.85 | 0.85 and better |", "|---" * 4 + "|"]
    groups = [one.mark.partition(" ")[0] for one in found]
    for group in dict.fromkeys(groups):
        cells = []
        for low, high in ((0, 0.7), (0.7, scoring.GOOD), (scoring.GOOD, 1.01)):
            at = (np.array(groups) == group) & (overlaps >= low) & (overlaps < high)
            cells.append(f"{(certain[at] < 0.5).sum()} of {at.sum()}" if at.any() else "-")
        page.append(f"| {group} | {' | '.join(cells)} |")
    return page
