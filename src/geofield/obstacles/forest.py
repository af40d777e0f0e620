"""Boosted regression trees as a table of numbers: reading and evaluating them with numpy.

A tree has at most 16 leaves, numbered from left to right. A node that sends a candidate to
the right rules out all leaves of its left branch, so the nodes can be asked in any order, for
all candidates at once, and the leaf is the first one that nobody ruled out (C. Lucchese et
al., "QuickScorer", SIGIR 2015).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geofield.errors import ObstacleError
from geofield.obstacles.features import FeatureTable

MAX_LEAVES = 16


@dataclass(frozen=True, slots=True)
class Tree:
    """One tree: a candidate goes left at a node where its feature is at or below the threshold.

    Attributes
    ----------
    feature : intp array (nodes,)
        Index into the forest's features.
    threshold : float32 array (nodes,)
    keep : uint16 array (nodes,)
        The leaves that remain possible after going right.
    leaf : float64 array (leaves,)
        What each leaf adds.
    """

    feature: NDArray[np.intp]
    threshold: NDArray[np.float32]
    keep: NDArray[np.uint16]
    leaf: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Forest:
    """A sum of trees.

    Attributes
    ----------
    features : tuple of str
    trees : tuple of Tree
    base : float
    """

    features: tuple[str, ...]
    trees: tuple[Tree, ...]
    base: float = 0.0

    @classmethod
    def read(cls, table: Mapping[str, Any]) -> Forest:
        """Build a forest from its JSON form.

        Each tree lists its nodes as ``[feature, threshold, left, right]``; a branch that is
        not negative is a node, ``-1 - k`` is leaf k.
        """
        features = tuple(str(name) for name in table["features"])
        trees = tuple(_tree(item["nodes"], item["leaves"]) for item in table["trees"])
        return cls(features, trees, float(table.get("base", 0.0)))

    def evaluate(self, measured: FeatureTable) -> NDArray[np.float64]:
        """Return the sum of the trees for every candidate.

        Raises
        ------
        ObstacleError
            When a feature is missing: table and program do not belong together.
        """
        missing = [name for name in self.features if name not in measured.names]
        if missing:
            raise ObstacleError(
                f"The verifier's table asks for the unknown feature {missing[0]!r}.",
                hint="Fit it again with this version.",
            )
        total = np.full(measured.values.shape[0], self.base)
        position = {name: i for i, name in enumerate(measured.names)}
        columns = np.ascontiguousarray(
            measured.values[:, [position[name] for name in self.features]].T
        )
        first = _FIRST_BIT
        for tree in self.trees:
            possible = np.full(total.size, 0xFFFF, dtype=np.uint16)
            for feature, threshold, drop in zip(
                tree.feature, tree.threshold, ~tree.keep, strict=True
            ):
                # What is dropped times whether it goes right: far quicker than a choice.
                possible &= ~(~(columns[feature] <= threshold) * drop)
            total += tree.leaf[first[possible]]
        return total


def _tree(nodes: Sequence[Sequence[float]], leaves: Sequence[float]) -> Tree:
    if len(leaves) > MAX_LEAVES:
        raise ObstacleError(f"A tree of the verifier has {len(leaves)} leaves; 16 are the limit.")
    order: list[int] = []
    left_leaves: dict[int, list[int]] = {}

    def walk(branch: int) -> list[int]:
        if branch < 0:
            order.append(-1 - branch)
            return [len(order) - 1]
        _, _, left, right = nodes[branch]
        left_leaves[branch] = walk(int(left))
        return left_leaves[branch] + walk(int(right))

    walk(0 if nodes else -1)
    keep = [0xFFFF & ~sum(1 << leaf for leaf in left_leaves[i]) for i in range(len(nodes))]
    return Tree(
        np.array([int(node[0]) for node in nodes], dtype=np.intp),
        np.array([node[1] for node in nodes], dtype=np.float32),
        np.array(keep, dtype=np.uint16),
        np.array([leaves[k] for k in order], dtype=np.float64),
    )


def _first_bits() -> NDArray[np.uint8]:
    values = np.arange(1 << 16, dtype=np.uint32)
    first = np.zeros(values.size, dtype=np.uint8)
    for bit in range(15, -1, -1):
        first[(values >> bit) & 1 == 1] = bit
    return first


_FIRST_BIT = _first_bits()
