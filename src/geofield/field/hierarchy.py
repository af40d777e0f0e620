"""Hierarchy: superpixels merge across their weakest border until one region is left.

The regions that contain the seed form a chain from a patch of ground to the whole picture.
The field is one of them (after the ultrametric contour maps of Arbelaez et al. 2011, with
the mean border strength as the height of a merge).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Regions below this size merge as if their border were weaker: specks are no parts.
_SPECK_PX = 150.0
#: Border strength around what stands out of a surface; inside surfaces it is 2 to 4.
_STANDS_OUT = 8.0


@dataclass(frozen=True, eq=False, slots=True)
class MergeTree:
    """A binary tree over regions; the first `leaf_count` are superpixels.

    Attributes
    ----------
    parent : int array (regions,)
        -1 for the root.
    height : float array (regions,)
        Border strength at which the region's two parts merged.
    parts : int array (regions, 2)
        -1 for superpixels.
    size_px : float array (regions,)
    leaf_count : int
    order : int array (superpixels,)
        All superpixels so that those of any region stand side by side.
    span : int array (regions, 2)
        Where a region's superpixels begin and end in `order`.
    """

    parent: IntArray
    height: FloatArray
    parts: IntArray
    size_px: FloatArray
    leaf_count: int
    order: IntArray
    span: IntArray

    def chain(self, leaf: int) -> list[int]:
        """The regions that contain a superpixel, from itself to the root."""
        found = [leaf]
        while self.parent[found[-1]] != -1:
            found.append(int(self.parent[found[-1]]))
        return found

    def surface_around(self, leaf: int, smallest_px: float) -> int | None:
        """The large surface that something small stands out of, if a superpixel belongs to such.

        A crown, a hut: its region joins a far larger one across a border much stronger than
        any that it has inside. None for a superpixel of open ground.
        """
        region = leaf
        while self.size_px[region] < smallest_px and self.parent[region] != -1:
            up = int(self.parent[region])
            other = self.beside(region)
            if self.size_px[other] >= 4 * self.size_px[region] and self.height[up] > max(
                _STANDS_OUT, 2.5 * self.height[region]
            ):
                return other
            region = up
        return None

    def beside(self, region: int) -> int:
        """The other part of the region that a region merges into."""
        one, two = self.parts[self.parent[region]]
        return int(two if one == region else one)

    def leaves(self, region: int) -> IntArray:
        """The superpixels of a region."""
        start, end = self.span[region]
        return self.order[start:end]


def merge(
    sizes: FloatArray,
    first: IntArray,
    second: IntArray,
    length: FloatArray,
    strength: FloatArray,
) -> MergeTree:
    """Merge neighbours, weakest common border first.

    Parameters
    ----------
    sizes : float array
        Pixels per superpixel.
    first, second : int array
        Neighbours.
    length, strength : float array
        Of their common border; a longer border's strength is the mean along it.

    Notes
    -----
    In each round every pair merges that is weakest for both its regions: rounds of array
    work instead of a queue of single merges.
    """
    count = len(sizes)
    parent = np.full(2 * count - 1, -1)
    height = np.zeros(2 * count - 1)
    parts = np.full((2 * count - 1, 2), -1)
    size_px = np.concatenate([sizes, np.zeros(count - 1)])
    a, b, total = first, second, length * strength
    made = count
    while len(a):
        speck = np.sqrt(np.minimum(np.minimum(size_px[a], size_px[b]) / _SPECK_PX, 1.0))
        cost = total / length * speck
        # Equal costs must not merge one region twice: order decides.
        rank = np.empty(len(cost), np.int64)
        rank[np.argsort(cost, kind="stable")] = np.arange(len(cost))
        best = np.full(made, len(cost))
        np.minimum.at(best, a, rank)
        np.minimum.at(best, b, rank)
        both = np.flatnonzero((best[a] == rank) & (best[b] == rank))
        both = both[np.argsort(rank[both])]
        new = made + np.arange(len(both))
        parts[new, 0], parts[new, 1] = a[both], b[both]
        parent[a[both]] = parent[b[both]] = new
        height[new] = cost[both]
        size_px[new] = size_px[a[both]] + size_px[b[both]]
        made += len(both)
        name = np.arange(made)
        name[a[both]] = name[b[both]] = new
        one, other = name[a], name[b]
        low, high = np.minimum(one, other), np.maximum(one, other)
        apart = low != high
        keys, index = np.unique(low[apart] * made + high[apart], return_inverse=True)
        total = np.bincount(index, total[apart], len(keys)).astype(float)
        length = np.bincount(index, length[apart], len(keys)).astype(float)
        a, b = keys // made, keys % made
    parts = parts[:made]
    return MergeTree(
        parent[:made], height[:made], parts, size_px[:made], count, *_side_by_side(parts, count)
    )


def _side_by_side(parts: IntArray, leaf_count: int) -> tuple[IntArray, IntArray]:
    """The superpixels in the order of a walk through the tree, and each region's span in it."""
    number = [1] * leaf_count
    pairs = parts[leaf_count:].tolist()
    for one, other in pairs:
        number.append(number[one] + number[other])
    start = [0] * len(parts)
    end = 0
    has_parent = np.zeros(len(parts), bool)
    has_parent[parts[leaf_count:].ravel()] = True
    for root in np.flatnonzero(~has_parent).tolist():  # more than one: parts without a border
        start[root], end = end, end + number[root]
    for region in range(len(parts) - 1, leaf_count - 1, -1):
        one, other = pairs[region - leaf_count]
        start[one] = start[region]
        start[other] = start[region] + number[one]
    order = np.empty(leaf_count, np.int64)
    order[start[:leaf_count]] = np.arange(leaf_count)
    return order, np.column_stack([start, np.add(start, number)])
