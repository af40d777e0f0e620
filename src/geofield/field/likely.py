"""Likely: which of the outlines that were found is taken, how certain that is, what else may be.

An outline that may be the field's is a `Candidate`. The likeliest ground's most exact one is taken;
others that hold other ground are offered for a person to choose. Each adds most to what the nearest
of the offered outlines is expected to have in common with the field that is meant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon

from geofield.field.ranking import (
    WEIGHED,
    Figures,
    Ranking,
    agreement,
    exact,
    expected_overlaps,
    log_odds,
)

#: Outlines that overlap more than this speak for each other's ground.
_ALIKE = 0.85
#: No outline from a picture is told as quite certain, and none as "100 %" in rounded words.
MOST_CERTAIN = 0.99
#: So many different outlines are offered with the one that is taken; they overlap less than this.
_OFFERED, _DIFFERENT = 3, 0.88


@dataclass(frozen=True, eq=False)
class Candidate:
    """A possible outline of the field.

    Attributes
    ----------
    polygon : Polygon
        Pixel coordinates of the searched picture; no holes.
    holes : bool array (rows, columns)
        What was filled in the ground that it began as.
    figures : mapping
        What was measured on it, by name.
    score : float
        Only differences mean something.
    """

    polygon: Polygon
    holes: NDArray[np.bool_]
    figures: Figures
    score: float


@dataclass(frozen=True, eq=False)
class Likely:
    """An outline with the probabilities that it is the field, the ground, the exact border."""

    candidate: Candidate
    certainty: float
    ground: float
    border: float


def likeliest(found: Sequence[Candidate], ranking: Ranking) -> Likely:
    """Of the likeliest ground the most exact outline.

    Parameters
    ----------
    found : sequence of Candidate
        The best first.
    ranking : Ranking
    """
    found = found[:WEIGHED]
    scores = np.array([one.score for one in found])
    polygons = [one.polygon for one in found]
    answer = np.array([one.figures["network_overlap"] for one in found])
    answered = agreement(answer, int(found[0].figures["corrections"]))
    belief, expected, overlap = expected_overlaps(polygons, scores, answered)
    exactness = ranking.exactness([one.figures for one in found])
    best = exact(expected, overlap, exactness, polygons)
    evidence = evidence_of(found[best], float(expected[best]), belief, overlap[best])
    certain, ground, border = (
        min(ranking.certainty(what, evidence), MOST_CERTAIN)
        for what in ("field", "ground", "border")
    )
    return Likely(found[best], certain, ground, border)


def evidence_of(
    one: Candidate, expected: float, belief: np.ndarray, overlap: np.ndarray
) -> Figures:
    """What certainty is judged by: of an outline, its figures, and beliefs in those like it."""
    return {
        **one.figures,
        "expected_overlap": float(log_odds(expected)),
        "belief_alike": float(belief[overlap >= _ALIKE].sum()),
        "belief_same": float(belief[overlap >= 0.95].sum()),
    }


def other_outlines(taken: Likely, found: Sequence[Candidate]) -> list[Likely]:
    """Outlines beside the one that is taken, the likeliest first.

    What that one leaves of certainty is dealt to them by the beliefs in what is like them. On 150
    fields of left-out sites the nearest of all that are offered has .856 of the truth in common
    (the taken one .823), .842 without those that were `imagined`; where the taken one has less
    than .8, .702 and .658.

    Parameters
    ----------
    taken : Likely
    found : sequence of Candidate
        All that may be offered.
    """
    some = [taken.candidate, *(one for one in found if one is not taken.candidate)][:WEIGHED]
    scores = np.array([one.score for one in some])
    belief, _, overlap = expected_overlaps([one.polygon for one in some], scores)
    nearest = overlap[0]
    free = nearest < _DIFFERENT
    rest = float(belief[free].sum())
    others: list[Likely] = []
    while len(others) < _OFFERED - 1 and belief[free].sum() > 0.0:
        gained = np.maximum(overlap - nearest, 0.0) @ belief
        at = int(np.argmax(np.where(free, gained, -1.0)))
        alike = free & (overlap[at] >= _DIFFERENT)
        share = (1.0 - taken.certainty) * float(belief[alike].sum()) / rest
        sure = (min(share, most) for most in (taken.certainty, taken.ground, taken.border))
        others.append(Likely(some[at], *sure))
        nearest = np.maximum(nearest, overlap[at])
        free &= ~alike
    return sorted(others, key=lambda one: -one.certainty)
