"""Scoring: how much each figure of an outline speaks for it, and how far to trust the sum.

An outline's score is a sum of curves, one for each figure that is measured on it: bent twice,
so that a figure can count more on one side of what is usual than on the other.
`benchmarks/field_choice.py` learned them from simulated and real fields. There are two sets:
`tables/outline.json` counts what is measured along and within an outline, `tables/opinion.json`
also how well the outline agrees with the `ground`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from geofield.field.border import FIGURES
from geofield.field.ground import AGREEMENT, log_odds
from geofield.field.regions import TOLLS
from geofield.field.table import read_table

FloatArray = NDArray[np.float64]

NAMES = (*FIGURES, *(f"toll_{name}" for name in TOLLS))
"""Figures of an outline: its own, and the tolls of the region it began as."""
WITH_GROUND = (*NAMES, *AGREEMENT)
"""The same and how well it agrees with the ground."""

#: An outline with this overlap with the truth is a good one.
GOOD = 0.85
#: What tells good from bad beside the expected overlap: borders inside as strong as its own, a
#: crooked course.
TELLING = ("inside_95_above_border", "long_sides_share")
EVIDENCE = ("expected_overlap", *TELLING, "constant")
#: Where a curve bends, and where it ends, in units of the figure's spread.
BEND, END = 0.5, 4.0


@dataclass(frozen=True, eq=False)
class Curves:
    """The learned sum of curves.

    Attributes
    ----------
    usual, spread : float array (names,)
        Mean and standard deviation of each figure over the outlines learned from.
    slope : float array (3, names)
        Everywhere; above the upper bend; below the lower one.
    trust : float array (evidence,)
        Weights of the `EVIDENCE` for a good outline, see `certainty`.
    """

    usual: FloatArray
    spread: FloatArray
    slope: FloatArray = field(repr=False)
    trust: FloatArray = field(default_factory=lambda: np.zeros(len(EVIDENCE)))

    def score(self, figures: FloatArray) -> FloatArray:
        """Scores of outlines, figures (outlines, names); only differences mean something."""
        bent = bends((figures - self.usual) / self.spread)
        return np.asarray(np.einsum("bon,bn->o", bent, self.slope))

    def certainty(self, expected: float, figures: FloatArray) -> float:
        """Probability that an outline overlaps the truth by `GOOD` or more.

        Parameters
        ----------
        expected : float
            Its expected overlap, see `choose`.
        figures : float array (names,)
            Its figures.
        """
        return float(expit(self.evidence(expected, figures) @ self.trust))

    def evidence(self, expected: float, figures: FloatArray) -> FloatArray:
        """What the certainty weighs, in the order of `EVIDENCE`.

        The weights are those of a logistic regression (after J. Platt, 1999), on outlines of
        sites that the scores had not been learned from.
        """
        at = [NAMES.index(name) for name in TELLING]
        standard = (figures[at] - self.usual[at]) / self.spread[at]
        return np.array([log_odds(expected), *np.clip(standard, -END, END), 1.0])


def bends(standard: FloatArray) -> FloatArray:
    """Standardised figures as the three parts of a curve, (3, ...)."""
    standard = np.clip(standard, -END, END)
    return np.stack([standard, np.maximum(standard - BEND, 0), np.maximum(-standard - BEND, 0)])


@cache
def learned(*, ground: bool = False) -> Curves:
    """The curves of `tables/outline.json`, or of `tables/opinion.json` that count the ground.

    Raises
    ------
    FieldError
        When the table is not of this version's figures.
    """
    names = WITH_GROUND if ground else NAMES
    table = read_table("opinion" if ground else "outline", "figures", names)
    rows = table["figures"]
    usual, spread = (np.array([row[key] for row in rows]) for key in ("usual", "spread"))
    slope = np.array([[row[key] for row in rows] for key in ("slope", "above", "below")])
    return Curves(usual, spread, slope, np.array([table["trust"][name] for name in EVIDENCE]))
