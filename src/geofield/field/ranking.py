"""Ranking: how much the figures of an outline speak for it, and how far to trust the sum.

An outline's score is a sum of curves, one for each figure that is measured on it: bent twice,
so that a figure can count more on one side of what is usual than on the other. Scores become
beliefs (their exponentials, to add up to one), and the outline with the largest expected overlap
with the others under these beliefs, and with the network's answer, holds the ground that is meant.
Where exactly it ends, curves of their own decide among the outlines of that ground.
`tools/train_ranking.py` learned all curves behind networks, whose answer is among the figures, that
had not seen the field's site.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.special import expit, logit
from shapely import Polygon

from geofield.errors import FieldError
from geofield.learned import facts

FloatArray = NDArray[np.float64]
Figures = Mapping[str, float]

#: Where a curve bends, and where it ends, in units of the figure's spread.
BEND, END = 0.5, 4.0
#: Side of the picture in which outlines are compared, pixels.
_SMALL_PX = 96
#: So many of the best are weighed against each other.
WEIGHED = 200
#: Outlines that overlap as much hold the same ground, and differ in where exactly it ends.
SAME_GROUND = 0.92
#: What overlap with the network's answer counts in what is expected of a first outline: those taken
#: of 552 fields of left-out sites overlap by .770 with it, .761 without and .767 by it alone; of
#: those that points corrected by .840, .857 and .805.
ANSWERED = 0.5
#: Outlines whose exactness differs less are as exact.
_NEARLY = 0.1


def log_odds(share: FloatArray | float) -> FloatArray:
    """Logarithm of the odds of a share, within bounds."""
    return np.asarray(logit(np.clip(share, 0.01, 0.995)))


@dataclass(frozen=True, eq=False)
class Ranking:
    """The learned sum of curves, and what its doubt is worth.

    Attributes
    ----------
    names : tuple of str
        Of the figures that count.
    mean, spread : float array (names,)
        Over the outlines learned from.
    slope, edge : float array (3, names)
        Everywhere; above the upper bend; below the lower one. For which ground is meant; and for
        where exactly it ends.
    calibration : mapping
        By whether points corrected the outline, and by what is asked (see `certainty`): weights
        of named evidence.
    """

    names: tuple[str, ...]
    mean: FloatArray
    spread: FloatArray
    slope: FloatArray
    edge: FloatArray
    calibration: Mapping[str, Mapping[str, Mapping[str, float]]]

    def scores(self, outlines: Sequence[Figures]) -> FloatArray:
        """Scores of outlines; only differences mean something."""
        return self._sums(outlines, self.slope)

    def exactness(self, outlines: Sequence[Figures]) -> FloatArray:
        """How exact outlines of the same ground are; only differences mean something."""
        return self._sums(outlines, self.edge)

    def _sums(self, outlines: Sequence[Figures], slope: FloatArray) -> FloatArray:
        values = np.array([[one[name] for name in self.names] for one in outlines])
        return np.asarray(np.einsum("bon,bn->o", bends((values - self.mean) / self.spread), slope))

    def certainty(self, what: str, evidence: Figures) -> float:
        """Probability that an outline is right, from a logistic regression on left-out sites.

        Parameters
        ----------
        what : str
            ``field`` (overlap with the truth of 85 % or more), ``ground`` (70 %: the right
            piece of ground) or ``border`` (93 %: its border, too).
        evidence : mapping
        """
        weights = self.calibration[asked(evidence["corrections"])][what]
        total = weights["constant"]
        for name, weight in weights.items():
            if name != "constant":
                total += weight * evidence[name]
        return float(expit(total))


def asked(corrections: float) -> str:
    """Of which question an outline is the answer: figures of the two are worth different things."""
    return "corrected" if corrections else "first"


def bends(standard: FloatArray) -> FloatArray:
    """Standardised figures as the three parts of a curve, (3, ...)."""
    standard = np.clip(standard, -END, END)
    return np.stack([standard, np.maximum(standard - BEND, 0), np.maximum(-standard - BEND, 0)])


def trained(name: str = "outline_ranking", folder: Path | None = None) -> Ranking:
    """The ranking of this package, or one that lies in another folder.

    Raises
    ------
    GeofieldError
        When there is no table; a FieldError where it is of another version.
    """
    table = facts(name, folder)
    try:
        rows = table["figures"]
        mean, spread = (np.array([row[key] for row in rows]) for key in ("mean", "spread"))
        # Of each figure a triple of slopes: which ground is meant, and where exactly it ends.
        slope, edge = (np.array([row[key] for row in rows]).T for key in ("slope", "edge"))
        names = tuple(row["name"] for row in rows)
        return Ranking(names, mean, spread, slope, edge, table["calibration"])
    except (KeyError, ValueError) as error:
        raise FieldError(f"The table {name}.json cannot be read.") from error


def exact(
    expected: FloatArray, overlap: FloatArray, exactness: FloatArray, polygons: Sequence[Polygon]
) -> int:
    """Which outline is taken: of those that hold the likeliest ground, the most exact one.

    Of such as are nearly as exact, the one with the fewest corners: a corner that is cut off
    across a crown makes one more, and the picture does not show what lies beneath.

    Parameters
    ----------
    expected, exactness : float array (outlines,)
    overlap : float array (outlines, outlines)
    polygons : sequence of Polygon
    """
    same = overlap[int(np.argmax(expected))] >= SAME_GROUND
    exactness = np.where(same, exactness, -np.inf)
    near: list[int] = np.flatnonzero(exactness >= exactness.max() - _NEARLY).tolist()
    return min(near, key=lambda at: (len(polygons[at].exterior.coords), -exactness[at]))


def expected_overlaps(
    polygons: Sequence[Polygon], scores: FloatArray, answered: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Beliefs, expected overlap of each outline with the truth, overlaps of each with each.

    Parameters
    ----------
    polygons : sequence of Polygon
    scores : float array
    answered : float array, optional
        Overlaps with the network's answer, which count as `ANSWERED`.
    """
    belief = np.exp(scores - scores.max())
    belief /= belief.sum()
    masks = _small_masks(polygons)
    common = masks @ masks.T
    area = np.diag(common)
    overlap = common / np.maximum(area[:, None] + area - common, 1.0)
    expected = np.asarray(overlap @ belief)
    if answered is not None:
        expected = (1.0 - ANSWERED) * expected + ANSWERED * answered
    return belief, expected, overlap


def agreement(answer: FloatArray, corrections: int) -> FloatArray | None:
    """Overlaps with the network's answer, None where points correct what was found before.

    Parameters
    ----------
    answer : float array (outlines,)
        The figure ``network_overlap``, log odds.
    corrections : int
        What the points say of the outline before them counts more than the answer to them.
    """
    return None if corrections else np.asarray(expit(answer))


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
