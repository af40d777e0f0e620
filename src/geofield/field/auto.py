"""Auto: the field around points, from what the picture shows and a network has learned.

A network that sees the points says how likely each place belongs to the field (`looks`). Its ground
at a few levels of likelihood becomes straight outlines (`answer`), what a person said changes those
that were taken before (`mend`; all in `search`). The best is taken by what the picture shows along
them (`border`, `ranking`), and carried to the picture's own pixels (`refine`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from geofield.field.morphology import inner, plump
from geofield.field.ranking import (
    WEIGHED,
    Figures,
    agreement,
    exact,
    expected_overlaps,
    log_odds,
)
from geofield.field.refine import carried, enlarged
from geofield.field.search import Candidate, WindowSearch, search_field
from geofield.model import Scene
from geofield.model.segmentation import Segmentation

Points = Sequence[tuple[float, float]]

#: So many different outlines are offered, which overlap less than this.
ALTERNATIVES, _DIFFERENT = 3, 0.88
#: Outlines that overlap more than this speak for each other's ground.
_ALIKE = 0.85
#: A border weaker than this, in units of what the field has inside, is none.
_WEAK = 1.6
#: Borders close inside are told from this strength on, as a share of the outline's own; a
#: crooked course below this share of long sides.
_RIVAL, _CROOKED = 0.75, 0.8
#: No outline from a picture is told as quite certain, and none as "100 %" in rounded words.
MOST_CERTAIN = 0.99
#: Below this certainty the doubt is told.
_LIKELY = 0.7


def segment(
    scene: Scene,
    x_px: float,
    y_px: float,
    *,
    include: Points = (),
    exclude: Points = (),
    search: WindowSearch | None = None,
) -> Segmentation:
    """The field around points, with the most likely other ones.

    Parameters
    ----------
    scene : Scene
    x_px, y_px : float
        The seed, pixel coordinates.
    include, exclude : sequence of (float, float)
        Further points that belong and that do not, pixel coordinates.
    search : WindowSearch, optional
        Of the same scene and seed, from an earlier call.
    """
    if search is None:
        search = search_field(scene, x_px, y_px)
    belong, apart = (tuple(search.place(*at) for at in one) for one in (include, exclude))
    found = search.candidates(belong, apart)
    if not found:
        # Nothing stands out of anything: one surface fills the picture.
        return Segmentation(scene.valid, ("no border was found anywhere",), (("certainty", 0.0),))
    likely = likely_outlines(found[:WEIGHED], search)
    outlines = [one.candidate.polygon for one in likely]
    points = (search.seed_px, *belong), apart
    masks = carried(scene, outlines, search.factor, *points, times=search.seen.times)
    chosen, *others = (
        _told(scene, search, one, mask) for one, mask in zip(likely, masks, strict=True)
    )
    return replace(chosen, alternatives=tuple(others))


@dataclass(frozen=True, eq=False)
class Likely:
    """An outline with the probabilities that it is the field, the ground, the exact border."""

    candidate: Candidate
    certainty: float
    ground: float
    border: float


def likely_outlines(found: Sequence[Candidate], search: WindowSearch) -> list[Likely]:
    """The most likely different outlines; of the likeliest ground, the most exact one first.

    What the first leaves of certainty is dealt to the others by the beliefs in what is like them.
    """
    scores = np.array([one.score for one in found])
    polygons = [one.polygon for one in found]
    answer = np.array([one.figures["network_overlap"] for one in found])
    answered = agreement(answer, int(found[0].figures["corrections"]))
    belief, expected, overlap = expected_overlaps(polygons, scores, answered)
    ranking = search.learned.ranking
    exactness = ranking.exactness([one.figures for one in found])
    best = exact(expected, overlap, exactness, polygons)
    evidence = evidence_of(found[best], float(expected[best]), belief, overlap[best])
    certain, ground, border = (
        min(ranking.certainty(what, evidence), MOST_CERTAIN)
        for what in ("field", "ground", "border")
    )
    chosen = [Likely(found[best], certain, ground, border)]
    free = overlap[best] < _DIFFERENT
    rest = float(belief[free].sum())
    while len(chosen) < ALTERNATIVES and belief[free].sum() > 0.0:
        own = np.where(free, overlap @ (belief * free), -1.0)
        at = int(np.argmax(own))
        alike = free & (overlap[at] >= _DIFFERENT)
        share = (1.0 - certain) * float(belief[alike].sum()) / rest
        chosen.append(
            Likely(found[at], min(share, certain), min(share, ground), min(share, border))
        )
        free &= ~alike
    return chosen


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


def _told(
    scene: Scene, search: WindowSearch, likely: Likely, mask: NDArray[np.bool_]
) -> Segmentation:
    """An outline on the picture's own pixels, with what is to be told of it."""
    things = plump(likely.candidate.holes | search.things)
    holes = inner(enlarged(things, search.factor, mask.shape), mask)
    figures = likely.candidate.figures
    contrast = math.exp(figures["strength_50_above_inside"])
    weakest = math.exp(figures["strength_25_above_inside"])
    notes = []
    if search.moved:
        notes.append("the point lies on something small (a tree, a hut, a track?)")
    if likely.ground < _LIKELY:
        notes.append(f"other ground may be meant (certainty {likely.certainty:.0%})")
    elif likely.certainty < _LIKELY:
        notes.append(f"where it ends is not certain (certainty {likely.certainty:.0%})")
    if likely.certainty < _LIKELY:
        if contrast < _WEAK:
            notes.append("its border hardly differs from what lies inside")
        elif weakest < _WEAK:
            notes.append("a quarter of its border or more is weak")
        if math.exp(figures["inside_95_above_border"]) > _RIVAL:
            notes.append("borders close inside it are nearly as strong as its own")
        if figures["long_sides_share"] < _CROOKED:
            notes.append("much of its course is crooked")
    return Segmentation(
        mask & ~holes & scene.valid,
        tuple(notes),
        (
            ("certainty", likely.certainty),
            ("ground_certainty", likely.ground),
            ("border_certainty", likely.border),
            ("border_contrast", contrast),
            ("weakest_quarter", weakest),
            ("straightness", figures["long_sides_share"]),
        ),
    )
