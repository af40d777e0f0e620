"""Outlines of a case that a search may meet, and its ground, to learn from."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
import shapely

from common import overlap
from field_cases import Case
from geofield.field import auto, choice, ground, scoring
from geofield.field.straight import ring

#: So many of what an outline suggests are learned from.
REDRAWN = 40
#: Superpixels this near the border, pixels, are not learned from.
CLEAR_PX = 2.5
#: Curves that prefer nothing.
LEVEL = scoring.Curves(
    np.zeros(len(scoring.NAMES)), np.ones(len(scoring.NAMES)), np.zeros((3, len(scoring.NAMES)))
)


@dataclass
class Sizes:
    """All that `agreement` asks of a surface."""

    size_px: np.ndarray


@dataclass
class Examples:
    """Outlines of a case, and its ground.

    Outlines have figures (outlines, names), overlaps with the truth, polygons, and the
    superpixels in them, packed; superpixels have looks, pixels, whether they belong to the
    field, and whether they are clear of its border.
    """

    name: str
    site: str
    figures: np.ndarray
    overlap: np.ndarray
    polygons: np.ndarray
    inside: np.ndarray
    looks: np.ndarray
    surface: Sizes
    belongs: np.ndarray
    clear: np.ndarray

    def with_ground(self, network: ground.Network) -> np.ndarray:
        """The outlines' figures, and how well they agree with the ground as a network has it."""
        judged = ground.Ground(self.surface, self.looks, network)
        inside = np.unpackbits(self.inside, axis=1, count=len(self.looks)).astype(bool)
        agreeing = [ground.agreement(judged, one) for one in inside]
        return np.hstack([self.figures.astype(float), agreeing])


def examples(case: Case, curves: scoring.Curves | None) -> Examples | None:
    """Good outlines, random ones, and what curves take for good; None without any."""
    rng = np.random.default_rng(zlib.crc32(case.name.encode()))
    factor = auto.reduction(case.scene)
    ready = auto.prepared(case.scene, factor, (case.x_px / factor, case.y_px / factor))
    truth = shapely.transform(case.truth, lambda c: c / factor)
    judge = choice.Judge(ready.surface, curves or LEVEL)
    found = choice.first_outlines(judge, ready.regions, straightened=None)
    if not found:
        return None
    overlaps = [overlap(one.polygon, truth) for one in found]
    tried: set[int] = set()
    for _ in range(3):
        order = np.argsort(overlaps)[::-1]
        chosen = {*order[:3].tolist(), *rng.choice(order[: 2 + len(order) // 2], 3).tolist()}
        if curves is not None:
            chosen |= set(np.argsort(-judge.scores(found))[:5].tolist())
        for at in sorted(chosen - tried):
            tried.add(at)
            more = choice.redrawn_outlines(judge, found[at], ready.seed_px)
            for one in (more[k] for k in rng.permutation(len(more))[:REDRAWN]):
                found.append(one)
                overlaps.append(overlap(one.polygon, truth))
    surface = ready.surface
    rows, columns = surface.centres
    centres = shapely.points(columns + 0.5, rows + 0.5)
    return Examples(
        case.name,
        case.site,
        np.array([one.figures for one in found], np.float32),
        np.array(overlaps),
        np.array([one.polygon for one in found]),
        np.packbits([surface.members(ring(one.polygon)) for one in found], axis=1),
        ready.looks.astype(np.float32),
        Sizes(surface.size_px),
        np.asarray(shapely.contains(truth, centres)),
        np.asarray(shapely.distance(centres, truth.exterior)) > CLEAR_PX,
    )
