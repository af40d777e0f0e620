"""Regions: the nested regions around the seed that may be the field.

Each merge along the chain asks: did this cross a field's border? What a region has merged
so far, its toll, speaks for or against it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from geofield.field.evidence import gradient
from geofield.field.hierarchy import MergeTree, merge
from geofield.field.morphology import filled, tidy
from geofield.field.superpixels import BorderLine, Borders, borders, superpixels

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]

#: Side of a superpixel's cell, pixels.
STEP_PX = 5
#: Regions below this share of the picture are patches of ground, not fields.
SMALLEST_SHARE = 0.006
#: The same in pixels.
SMALLEST_PX = 200.0
#: A part below this share of the region joins it without being asked.
_TRIFLE_SHARE = 0.03
#: A region of which a smaller share hangs together with the seed is none around the seed.
_OWN_SHARE = 0.2

TOLLS = (
    "merges",
    "seam",
    "merge_height",
    "straight_seam",
    "seam_straightness",
    "inside_50",
    "inside_80",
    "seam_above_1",
    "merge_height_above_inside",
    "straight_seam_above_half",
    "share",
    "highest_above_inside",
    "seam_above_inside",
    "inside_95",
)
"""What each merge adds to the toll; strengths as logarithms, weighted by how much joined."""


@dataclass(frozen=True, eq=False)
class Region:
    """One region of the chain.

    Attributes
    ----------
    mask : bool array
        Holes filled, tendrils cut, notches closed.
    holes : bool array
        What was filled.
    toll : float array (tolls,)
        Of the merges that made it, see `TOLLS`.
    """

    mask: BoolArray
    holes: BoolArray
    toll: FloatArray


@dataclass(frozen=True, eq=False)
class Partition:
    """A picture's superpixels, their borders and how they merge.

    Attributes
    ----------
    labels : int32 array (rows, columns)
    lines : Borders
    pairs : (first, second, length px, strength)
        Neighbours, see `Borders.pairs`.
    tree : MergeTree
    """

    labels: NDArray[np.int32]
    lines: Borders
    pairs: tuple[NDArray[np.int64], NDArray[np.int64], FloatArray, FloatArray]
    tree: MergeTree


def partition(stack: NDArray[np.float32]) -> Partition:
    """Superpixels of whitened channels, merged across their weakest borders first."""
    labels = superpixels(gradient(stack), STEP_PX)
    count = int(labels.max()) + 1
    lines = borders(labels, stack)
    pairs = lines.pairs(count)
    sizes = np.bincount(labels.ravel(), minlength=count).astype(float)
    return Partition(labels, lines, pairs, merge(sizes, *pairs))


def regions(parted: Partition, seed_px: tuple[float, float]) -> list[Region]:
    """The regions around the seed that may be the field, from small to large, no shape twice."""
    labels, tree = parted.labels, parted.tree
    first, second, _, strength = parted.pairs
    found: list[Region] = []
    toll = np.zeros(len(TOLLS))
    highest = 0.0
    for region, following in pairwise(tree.chain(int(labels[int(seed_px[1]), int(seed_px[0])]))):
        other = tree.beside(region)
        size, joins = float(tree.size_px[region]), float(tree.size_px[other])
        share = size / labels.size
        trifle = joins < _TRIFLE_SHARE * size and share < 0.9
        if size < SMALLEST_PX or share < SMALLEST_SHARE or trifle:
            continue
        member = np.zeros(tree.leaf_count, bool)
        member[tree.leaves(region)] = True
        raw = member[labels]
        whole = filled(raw)
        part = tidy(whole, seed_px)
        own = part.sum() >= _OWN_SHARE * whole.sum()
        if own and not (found and np.array_equal(part, found[-1].mask)):
            found.append(Region(part, whole & ~raw, toll))
        side = member.astype(np.int8)
        side[tree.leaves(other)] = -1
        seam = parted.lines.along(side)
        height = float(tree.height[following])
        within = strength[member[first] & member[second]]
        inside = np.quantile(within, [0.5, 0.8, 0.95]) if len(within) else np.ones(3)
        toll = toll + _toll(seam, height, highest, joins / size, float(whole.mean()), inside)
        highest = max(highest, height)
    return found


def _toll(
    seam: BorderLine | None,
    height: float,
    highest: float,
    joins: float,
    share: float,
    inside: FloatArray,
) -> FloatArray:
    """What one merge shows, weighted by how much joins."""
    i50, i80, i95 = np.log(np.maximum(inside, 0.5))
    mean, straight, both = 0.0, 0.0, 0.0
    if seam is not None:
        mean, straight = float(seam.strength.mean()), float(seam.straight.mean())
        both = float((seam.strength * seam.straight).mean())
    strength, merged, along = (math.log(value + 0.3) for value in (mean, height, both))
    values = [
        1.0,
        strength,
        merged,
        along,
        straight,
        i50,
        i80,
        max(strength - 1.0, 0.0),
        max(merged - i80 - 0.6, 0.0),
        max(along - 0.5, 0.0),
        math.log(share + 0.003),
        max(math.log(highest + 0.3) - i80 - 0.6, 0.0),
        max(strength - i50 - 0.7, 0.0),
        i95,
    ]
    return math.sqrt(min(1.0, joins / 0.15)) * np.array(values)
