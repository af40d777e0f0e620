"""Choice: which of the nested regions around the seed is the field.

Each merge along the chain asks: did this cross a field's border? A long, straight, coherent
border that stands out of what the region has inside speaks for it; the toll of all merges
so far, and how the region's own outline looks, are its score. The weights were learned by
`benchmarks/field_choice.py` on simulated and real fields; all figures are ratios or come in
units of the surface's own variation, so that they carry over to other pictures.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from geofield.field.choice_weights import OWN_WEIGHTS, TOLL_WEIGHTS
from geofield.field.hierarchy import MergeTree
from geofield.field.superpixels import Borders

BoolArray = NDArray[np.bool_]

#: Regions below this share of the picture are patches of ground, not fields.
SMALLEST_SHARE = 0.006
#: A part below this share of the region joins it without being asked.
_TRIFLE_SHARE = 0.03
#: Openings and notches narrower than twice this are no part of an outline, pixels.
_OPEN_PX, _CLOSE_PX = 5.0, 6.0


@dataclass(frozen=True, eq=False)
class Candidate:
    """One region of the chain.

    Attributes
    ----------
    mask : bool array
        Holes filled, tendrils cut, notches closed.
    holes : bool array
        What was filled.
    figures : dict
        The measures behind its score.
    """

    mask: BoolArray
    holes: BoolArray
    figures: dict[str, float]


def candidates(
    labels: NDArray[np.int32],
    tree: MergeTree,
    lines: Borders,
    pairs: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]],
    seed_px: tuple[float, float],
) -> list[Candidate]:
    """The regions around the seed that may be the field, from small to large, measured."""
    first, second, _, strength = pairs
    count = tree.leaf_count
    rim = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    rim_px = np.bincount(rim, minlength=count).astype(float)
    chain = tree.chain(int(labels[int(seed_px[1]), int(seed_px[0])]))
    found: list[Candidate] = []
    highest = 0.0
    for region, following in pairwise(chain):
        parts = tree.parts[following]
        if parts is None:
            continue
        other = parts[1] if parts[0] == region else parts[0]
        size, joins = tree.size_px[region], tree.size_px[other]
        share = size / labels.size
        if size < 200 or share < SMALLEST_SHARE or (joins < _TRIFLE_SHARE * size and share < 0.9):
            continue
        member = np.zeros(count, bool)
        member[tree.leaves(region)] = True
        raw = member[labels]
        filled: BoolArray = ndimage.binary_fill_holes(raw)
        inside = np.zeros(count, bool)
        inside[labels[filled]] = True
        outline = lines.along(np.where(inside, 1, -1).astype(np.int8))
        if outline is None:
            continue
        side = np.zeros(count, np.int8)
        side[tree.leaves(other)] = -1
        side[member] = 1
        seam = lines.along(side)
        within = strength[member[first] & member[second]]
        i50, i80, i95 = np.quantile(within, [0.5, 0.8, 0.95]) if len(within) else (1.0, 1.0, 1.0)
        frame = float(rim_px[inside].sum())
        around = outline.length_px + frame
        mask = tidy(filled, seed_px)
        straight_strength = outline.strength * outline.straight
        figures = {
            "share": float(filled.mean()),
            "merge": tree.height[following],
            "highest": highest,
            "joins": joins / size,
            "seam": 0.0 if seam is None else float(seam.strength.mean()),
            "seam_straight": 0.0 if seam is None else float(seam.straight.mean()),
            "seam_both": 0.0 if seam is None else float((seam.strength * seam.straight).mean()),
            "i50": max(float(i50), 0.5),
            "i80": max(float(i80), 0.5),
            "i95": max(float(i95), 0.5),
            "outline20": float(np.quantile(outline.strength, 0.2)),
            "outline50": float(np.quantile(outline.strength, 0.5)),
            "outline_low": float(np.quantile(straight_strength, 0.25)),
            "straight": float(outline.straight.mean()),
            "compact": 4 * math.pi * float(filled.sum()) / around**2,
            "tidy": _overlap(mask, filled),
            "frame": frame / around,
        }
        highest = max(highest, tree.height[following])
        found.append(Candidate(mask, filled & ~raw, figures))
    return found


def scores(found: list[Candidate]) -> NDArray[np.float64]:
    """The score of each candidate; only differences mean something."""
    seams, own = features(found)
    toll = np.cumsum(seams @ TOLL_WEIGHTS)
    before = np.concatenate([[0.0], toll[:-1]])
    return np.asarray(own @ OWN_WEIGHTS + before)


def features(found: list[Candidate]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What each candidate's next merge shows, and its own outline, as numbers to weigh."""
    return (
        np.array([_seam(one.figures) for one in found]),
        np.array([_own(one.figures) for one in found]),
    )


def certainty(found: list[Candidate], score: NDArray[np.float64], best: int) -> float:
    """Share of the belief that rests on outlines like the chosen one (overlap above 0.85)."""
    belief = np.exp(score - score.max())
    alike = np.array([_overlap(one.mask, found[best].mask) > 0.85 for one in found])
    return float(belief[alike].sum() / belief.sum())


def _seam(f: dict[str, float]) -> list[float]:
    """What a merge shows, weighted by how much joins."""
    seam, merge = math.log(f["seam"] + 0.3), math.log(f["merge"] + 0.3)
    both = math.log(f["seam_both"] + 0.3)
    i50, i80 = math.log(f["i50"]), math.log(f["i80"])
    weight = math.sqrt(min(1.0, f["joins"] / 0.15))
    values = [
        1.0,
        seam,
        merge,
        both,
        f["seam_straight"],
        i50,
        i80,
        max(seam - 1.0, 0.0),
        max(merge - i80 - 0.6, 0.0),
        max(both - 0.5, 0.0),
        math.log(f["share"] + 0.003),
        max(math.log(f["highest"] + 0.3) - i80 - 0.6, 0.0),
        max(seam - i50 - 0.7, 0.0),
        math.log(f["i95"]),
    ]
    return [weight * value for value in values]


def _own(f: dict[str, float]) -> list[float]:
    """What a region's own outline shows."""
    return [
        f["straight"],
        math.log(f["outline20"] + 0.3),
        math.log(max(f["compact"], 0.02)),
        float(f["share"] > 0.93),
        f["tidy"],
        math.log(f["outline_low"] + 0.2),
    ]


def tidy(mask: BoolArray, seed_px: tuple[float, float]) -> BoolArray:
    """A mask without tendrils and notches: opened, the part at the seed, closed, filled."""
    opened = _grown(_shrunk(mask, _OPEN_PX), _OPEN_PX)
    labels, count = ndimage.label(opened)
    if count == 0:
        return mask
    number = labels[int(seed_px[1]), int(seed_px[0])]
    if number == 0:
        number = 1 + int(np.argmax(np.bincount(labels.ravel())[1:]))
    part = labels == number
    closed = _shrunk(_grown(part, _CLOSE_PX), _CLOSE_PX)
    filled: BoolArray = ndimage.binary_fill_holes(closed | part)
    return filled


def _shrunk(mask: BoolArray, radius: float) -> BoolArray:
    """Erosion by a disc; the picture's edge does not erode."""
    if mask.all():
        return mask
    distance = ndimage.distance_transform_edt(mask)
    return np.asarray(distance > radius)


def _grown(mask: BoolArray, radius: float) -> BoolArray:
    if not mask.any():
        return mask
    return np.asarray(ndimage.distance_transform_edt(~mask) <= radius)


def _overlap(a: BoolArray, b: BoolArray) -> float:
    union = int((a | b).sum())
    return float((a & b).sum()) / union if union else 0.0
