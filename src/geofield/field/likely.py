"""Likely: which of the outlines that were found is taken, and how certain that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from geofield.field.candidate import Candidate
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
