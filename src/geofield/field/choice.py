"""Choice: which of many outlines around the seed is the field.

The regions around the seed are straightened into outlines, the best of them redrawn along
their own straight sides, the best of those again. An outline's score is a sum of curves,
one for each figure that is measured on it: bent twice, so that a figure can count more on
one side of what is usual than on the other. `benchmarks/field_choice.py` learned them from
simulated and real fields; `tables/outline.json` lists them.

Scores become beliefs (their exponentials, to add up to one). The outline taken is the one
with the largest expected overlap with the others under these beliefs.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.special import expit, logit
from shapely import Polygon

from geofield.errors import FieldError
from geofield.field.border import FIGURES, measure
from geofield.field.outline import rough_outline, straight_outline
from geofield.field.regions import TOLLS, Region
from geofield.field.straight import redrawn
from geofield.field.surface import Surface

FloatArray = NDArray[np.float64]

NAMES = (*FIGURES, *(f"toll_{name}" for name in TOLLS))
"""All figures of an outline: its own, and the tolls of the region it began as."""

#: How far the first outlines may leave their regions' borders, pixels.
_TOLERANCE_PX = 3.0
#: So many of the regions' outlines get well fitted sides.
_FITTED = 6
#: So many outlines are redrawn, so many times.
_BREADTH, _ROUNDS = 5, 3
#: So many of the best are weighed against each other in the end.
_WEIGHED = 300
#: How bold beliefs are: 1 takes scores at their word, less is better on sites left out.
_BOLDNESS = 0.5
#: Side of the picture in which outlines are compared, pixels.
_SMALL_PX = 96
#: An outline with this overlap with the truth is a good one.
GOOD = 0.85
#: What tells good from bad beside the expected overlap: borders inside as strong as its own, a
#: crooked course.
TELLING = ("inside_95_above_border", "long_sides_share")
EVIDENCE = ("expected_overlap", *TELLING, "constant")
#: Where a curve bends, and where it ends, in units of the figure's spread.
BEND, END = 0.5, 4.0


@dataclass(frozen=True, eq=False)
class Outline:
    """A possible outline of the field.

    Attributes
    ----------
    polygon : Polygon
        Pixel coordinates.
    region : Region
        The region that it began as.
    figures : float array (names,)
        In the order of `NAMES`.
    """

    polygon: Polygon
    region: Region
    figures: FloatArray

    def figure(self, name: str) -> float:
        """One of the figures."""
        return float(self.figures[NAMES.index(name)])


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
        return np.array([odds(expected), *np.clip(standard, -END, END), 1.0])


def odds(share: FloatArray | float) -> FloatArray:
    """Logarithm of the odds of a share, within bounds."""
    return np.asarray(logit(np.clip(share, 0.01, 0.995)))


def bends(standard: FloatArray) -> FloatArray:
    """Standardised figures as the three parts of a curve, (3, ...)."""
    standard = np.clip(standard, -END, END)
    return np.stack([standard, np.maximum(standard - BEND, 0), np.maximum(-standard - BEND, 0)])


@cache
def learned() -> Curves:
    """The curves of `tables/outline.json`.

    Raises
    ------
    FieldError
        When the table is not of this version's figures.
    """
    text = (resources.files(__package__) / "tables" / "outline.json").read_text("utf-8")
    table = json.loads(text)
    rows = table["figures"]
    if tuple(row["name"] for row in rows) != NAMES:
        raise FieldError(
            "The table of the outlines' figures is of another version.",
            hint="Run benchmarks/field_choice.py --write.",
        )
    usual, spread = (np.array([row[key] for row in rows]) for key in ("usual", "spread"))
    slope = np.array([[row[key] for row in rows] for key in ("slope", "above", "below")])
    return Curves(usual, spread, slope, np.array([table["trust"][name] for name in EVIDENCE]))


def first_outlines(
    surface: Surface, regions: Sequence[Region], curves: Curves | None
) -> list[Outline]:
    """The regions' own outlines, measured; the best also with well fitted sides.

    Parameters
    ----------
    surface : Surface
    regions : sequence of Region
    curves : Curves or None
        They say which are the best; None fits the sides of all.
    """
    rough = []
    for region in regions:
        rough += _measured(surface, [rough_outline(region.mask)], region)
    best = list(rough)
    if curves is not None and rough:
        score = curves.score(np.array([one.figures for one in rough]))
        best = [rough[at] for at in np.argsort(-score, kind="stable")[:_FITTED]]
    found = list(rough)
    for one in best:
        try:
            fitted = straight_outline(one.region.mask, tolerance_px=_TOLERANCE_PX)
        except FieldError:
            continue
        found += _measured(surface, [Polygon(fitted.exterior)], one.region)
    return found


def redrawn_outlines(
    surface: Surface, outline: Outline, seed_px: tuple[float, float]
) -> list[Outline]:
    """What an outline suggests, measured."""
    others = redrawn(outline.polygon, seed_px, surface.shape)
    return _measured(surface, others, outline.region)


def _measured(surface: Surface, polygons: Sequence[Polygon], region: Region) -> list[Outline]:
    found = []
    for polygon in polygons:
        if polygon.is_empty or not polygon.is_valid:
            continue
        if (figures := measure(surface, polygon)) is not None:
            found.append(Outline(polygon, region, np.concatenate([figures, region.toll])))
    return found


def search(
    surface: Surface,
    regions: Sequence[Region],
    seed_px: tuple[float, float],
    curves: Curves | None = None,
) -> tuple[list[Outline], FloatArray]:
    """Outlines around the seed and their scores, the best first.

    Parameters
    ----------
    surface : Surface
    regions : sequence of Region
    seed_px : (float, float)
        Pixel coordinates of the surface.
    curves : Curves, optional
        The learned ones when None.
    """
    curves = curves or learned()
    found = first_outlines(surface, regions, curves)
    if not found:
        return [], np.zeros(0)
    score = curves.score(np.array([one.figures for one in found]))
    tried: set[int] = set()
    known = {_key(one.polygon) for one in found}
    for _ in range(_ROUNDS):
        best = [at for at in np.argsort(-score)[:_BREADTH].tolist() if at not in tried]
        more: list[Outline] = []
        for at in best:
            tried.add(at)
            for one in redrawn_outlines(surface, found[at], seed_px):
                if (key := _key(one.polygon)) not in known:
                    known.add(key)
                    more.append(one)
        if not more:
            break
        found += more
        score = np.concatenate([score, curves.score(np.array([one.figures for one in more]))])
    order = np.argsort(-score, kind="stable")
    return [found[at] for at in order], score[order]


def _key(polygon: Polygon) -> tuple[float, ...]:
    x, y = polygon.centroid.coords[0]
    return round(polygon.area, 0), round(x, 1), round(y, 1)


def choose(polygons: Sequence[Polygon], score: FloatArray) -> tuple[int, float]:
    """The outline with the largest expected overlap with the truth, and that overlap.

    Parameters
    ----------
    polygons : sequence of Polygon
        The best scored first, as `search` gives them.
    score : float array
    """
    weighed = polygons[:_WEIGHED]
    belief = np.exp(_BOLDNESS * (score[: len(weighed)] - score[0]))
    belief /= belief.sum()
    masks = _small_masks(weighed)
    common = masks @ masks.T
    area = np.diag(common)
    expected = (common / (area[:, None] + area - common)) @ belief
    best = int(np.argmax(expected))
    return best, float(expected[best])


def _small_masks(polygons: Sequence[Polygon]) -> NDArray[np.float32]:
    """Polygons as rows of pixels of a small picture, to compare them all with all."""
    import cv2

    left, top, right, bottom = shapely.total_bounds(np.array(polygons))
    scale = (_SMALL_PX - 1) / max(right - left, bottom - top)
    masks = np.zeros((len(polygons), _SMALL_PX, _SMALL_PX), np.uint8)
    for mask, polygon in zip(masks, polygons, strict=True):
        points = (shapely.get_coordinates(polygon.exterior) - (left, top)) * scale
        cv2.fillPoly(mask, [np.rint(points * 16).astype(np.int32)], 1, shift=4)
    return masks.reshape(len(polygons), -1).astype(np.float32)
