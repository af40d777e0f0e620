"""Hierarchy: superpixels merge across their weakest border until one region is left.

The regions that contain the seed form a chain from a patch of ground to the whole picture.
The field is one of them (after the ultrametric contour maps of Arbelaez et al. 2011, with
the mean border strength as the height of a merge).
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: Regions below this size merge as if their border were weaker: specks are no parts.
_SPECK_PX = 150.0
#: Border strength around what stands out of a surface; inside surfaces it is 2 to 4.
_STANDS_OUT = 8.0


@dataclass(frozen=True, slots=True)
class MergeTree:
    """A binary tree over regions; the first `leaf_count` are superpixels.

    Attributes
    ----------
    parent : list of int
        -1 for the root.
    height : list of float
        Border strength at which the region's two parts merged.
    parts : list of (int, int) or None
    size_px : list of float
    leaf_count : int
    """

    parent: list[int]
    height: list[float]
    parts: list[tuple[int, int] | None]
    size_px: list[float]
    leaf_count: int

    def chain(self, leaf: int) -> list[int]:
        """The regions that contain a superpixel, from itself to the root."""
        found = [leaf]
        while self.parent[found[-1]] != -1:
            found.append(self.parent[found[-1]])
        return found

    def is_speck(self, leaf: int, smallest_px: float) -> bool:
        """Whether a superpixel belongs to something small that stands out of a large surface.

        A crown, a hut: its region joins a far larger one across a border much stronger than
        any that it has inside.
        """
        region = leaf
        while self.size_px[region] < smallest_px and self.parent[region] != -1:
            up = self.parent[region]
            one, two = self.parts[up] or (region, region)
            other = two if one == region else one
            if self.size_px[other] >= 4 * self.size_px[region] and self.height[up] > max(
                _STANDS_OUT, 2.5 * self.height[region]
            ):
                return True
            region = up
        return False

    def leaves(self, region: int) -> NDArray[np.int64]:
        """The superpixels of a region."""
        stack, found = [region], []
        while stack:
            one = stack.pop()
            parts = self.parts[one]
            if parts is None:
                found.append(one)
            else:
                stack.extend(parts)
        return np.array(found, np.int64)


def merge(
    sizes: NDArray[np.float64],
    first: NDArray[np.int64],
    second: NDArray[np.int64],
    length: NDArray[np.float64],
    strength: NDArray[np.float64],
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
    """
    count = len(sizes)
    neighbours: list[dict[int, tuple[float, float]]] = [{} for _ in range(count)]
    for a, b, size, value in zip(
        first.tolist(), second.tolist(), length.tolist(), strength.tolist(), strict=True
    ):
        neighbours[a][b] = neighbours[b][a] = (size * value, size)
    size_px: list[float] = sizes.tolist()
    parent = [-1] * count
    height = [0.0] * count
    parts: list[tuple[int, int] | None] = [None] * count
    alive = [True] * count

    def cost(a: int, b: int, border: tuple[float, float]) -> float:
        smaller = min(size_px[a], size_px[b])
        speck = 1.0 if smaller >= _SPECK_PX else (smaller / _SPECK_PX) ** 0.5
        return border[0] / border[1] * speck

    queue = [
        (cost(a, b, border), a, b)
        for a in range(count)
        for b, border in neighbours[a].items()
        if a < b
    ]
    heapq.heapify(queue)
    while queue:
        value, a, b = heapq.heappop(queue)
        if not (alive[a] and alive[b]):
            continue
        new = len(parent)
        one, other = neighbours[a], neighbours[b]
        del one[b], other[a]
        if len(one) < len(other):
            one, other = other, one
        for c, (total, size) in other.items():
            known = one.get(c)
            one[c] = (total + known[0], size + known[1]) if known else (total, size)
        alive[a] = alive[b] = False
        alive.append(True)
        parent[a] = parent[b] = new
        parent.append(-1)
        height.append(value)
        parts.append((a, b))
        size_px.append(size_px[a] + size_px[b])
        neighbours.append(one)
        neighbours[a] = neighbours[b] = {}
        for c, border in one.items():
            theirs = neighbours[c]
            theirs.pop(a, None)
            theirs.pop(b, None)
            theirs[new] = border
            heapq.heappush(queue, (cost(c, new, border), c, new))
    return MergeTree(parent, height, parts, size_px, count)
