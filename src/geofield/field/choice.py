"""Choice: which of many outlines around the seed is the field.

The regions around the seed are straightened into outlines, the best of them redrawn along
their own straight sides, the best of those again; `scoring` says how good each is.

Scores become beliefs (their exponentials, to add up to one). The outline taken is the one
with the largest expected overlap with the others under these beliefs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from geofield.errors import FieldError
from geofield.field.border import measure
from geofield.field.ground import Ground, agreement
from geofield.field.outline import rough_outline, straight_outline
from geofield.field.regions import Region
from geofield.field.scoring import WITH_GROUND, Curves
from geofield.field.straight import redrawn, ring
from geofield.field.surface import Surface

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
#: Of polygons (WKB): the superpixels inside, and the figures on the surface, None for a scrap.
Known = dict[bytes, tuple[BoolArray, FloatArray | None]]

#: How far the first outlines may leave their regions' borders, pixels.
_TOLERANCE_PX = 3.0
#: So many of the regions' outlines get well fitted sides.
_FITTED = 6
#: So many outlines are redrawn, so many times.
_BREADTH, _ROUNDS = 5, 2
#: So many of the best are weighed against each other in the end.
_WEIGHED = 300
#: Side of the picture in which outlines are compared, pixels.
_SMALL_PX = 96


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
        In the order of `NAMES`, or of `WITH_GROUND`.
    """

    polygon: Polygon
    region: Region
    figures: FloatArray

    def figure(self, name: str) -> float:
        """One of the figures."""
        return float(self.figures[WITH_GROUND.index(name)])


@dataclass(frozen=True, eq=False)
class Judge:
    """What outlines are judged by.

    Attributes
    ----------
    surface : Surface
        On which they are measured.
    curves : Curves
        That score them.
    ground : Ground or None
        Needed by curves that count how well an outline agrees with it.
    known : Known
        What was measured so far; judges of one surface may share it.
    """

    surface: Surface
    curves: Curves
    ground: Ground | None = None
    known: Known = field(default_factory=dict)

    def measured(self, polygons: Sequence[Polygon], region: Region) -> list[Outline]:
        """Outlines with their figures; scraps are left out."""
        found = []
        for polygon in polygons:
            if polygon.is_empty or not polygon.is_valid:
                continue
            key = polygon.wkb
            if key not in self.known:
                inside = self.surface.members(ring(polygon))
                self.known[key] = inside, measure(self.surface, polygon, inside)
            inside, figures = self.known[key]
            if figures is not None:
                parts = [figures, region.toll]
                if self.ground is not None:
                    parts.append(agreement(self.ground, inside))
                found.append(Outline(polygon, region, np.concatenate(parts)))
        return found

    def scores(self, outlines: Sequence[Outline]) -> FloatArray:
        """Scores of measured outlines; only differences mean something."""
        return self.curves.score(np.array([one.figures for one in outlines]))


def first_outlines(
    judge: Judge, regions: Sequence[Region], straightened: int | None = _FITTED
) -> list[Outline]:
    """The regions' own outlines; so many of the best (None: all) also with well fitted sides."""
    rough = []
    for region in regions:
        rough += judge.measured([rough_outline(region.mask)], region)
    best = list(rough)
    if straightened is not None and rough:
        order = np.argsort(-judge.scores(rough), kind="stable")
        best = [rough[at] for at in order[:straightened]]
    found = list(rough)
    for one in best:
        try:
            fitted = straight_outline(one.region.mask, tolerance_px=_TOLERANCE_PX)
        except FieldError:
            continue
        found += judge.measured([Polygon(fitted.exterior)], one.region)
    return found


def redrawn_outlines(judge: Judge, outline: Outline, seed_px: tuple[float, float]) -> list[Outline]:
    """What an outline suggests."""
    others = redrawn(outline.polygon, seed_px, judge.surface.shape)
    return judge.measured(others, outline.region)


def search(
    judge: Judge, regions: Sequence[Region], seed_px: tuple[float, float]
) -> tuple[list[Outline], FloatArray]:
    """Outlines around the seed and their scores, the best first.

    Parameters
    ----------
    judge : Judge
    regions : sequence of Region
    seed_px : (float, float)
        Pixel coordinates of the surface.
    """
    found = first_outlines(judge, regions)
    if not found:
        return [], np.zeros(0)
    score = judge.scores(found)
    tried: set[int] = set()
    known = {_key(one.polygon) for one in found}
    for _ in range(_ROUNDS):
        best = [at for at in np.argsort(-score)[:_BREADTH].tolist() if at not in tried]
        more: list[Outline] = []
        for at in best:
            tried.add(at)
            for one in redrawn_outlines(judge, found[at], seed_px):
                if (key := _key(one.polygon)) not in known:
                    known.add(key)
                    more.append(one)
        if not more:
            break
        found += more
        score = np.concatenate([score, judge.scores(more)])
    order = np.argsort(-score, kind="stable")
    return [found[at] for at in order], score[order]


def _key(polygon: Polygon) -> tuple[float, ...]:
    x, y = polygon.centroid.coords[0]
    return round(polygon.area, 0), round(x, 1), round(y, 1)


def choose(
    polygons: Sequence[Polygon], score: FloatArray, boldness: float = 1.0
) -> tuple[int, float]:
    """The outline with the largest expected overlap with the truth, and that overlap.

    Parameters
    ----------
    polygons : sequence of Polygon
        The best scored first, as `search` gives them.
    score : float array
    boldness : float
        How bold beliefs are: 1 takes scores at their word.
    """
    weighed = polygons[:_WEIGHED]
    belief = np.exp(boldness * (score[: len(weighed)] - score[0]))
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
