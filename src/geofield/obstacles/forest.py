"""Boosted regression trees as a table of numbers: reading and evaluating them with numpy.

A tree has at most 32 leaves, numbered from left to right. A node that sends a candidate to
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

MAX_LEAVES = 32
_ALL = 0xFFFFFFFF


@dataclass(frozen=True, slots=True)
class Tree:
    """One tree: a candidate goes left at a node where its feature is at or below the threshold.

    Attributes
    ----------
    feature : intp array (nodes,)
        Index into the forest's features.
    threshold : float32 array (nodes,)
    keep : uint32 array (nodes,)
        The leaves that remain possible after going right.
    leaf : float64 array (leaves,)
        What each leaf adds.
    """

    feature: NDArray[np.intp]
    threshold: NDArray[np.float32]
    keep: NDArray[np.uint32]
    leaf: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Forest:
    """A sum of trees.

    Attributes
    ----------
    features : tuple of str
    trees : tuple of Tree
    base : float
    early : (int, float)
        After so many trees, candidates below this sum are not asked further.
    """

    features: tuple[str, ...]
    trees: tuple[Tree, ...]
    base: float = 0.0
    early: tuple[int, float] = (0, -np.inf)

    @classmethod
    def read(cls, table: Mapping[str, Any]) -> Forest:
        """Build a forest from its JSON form.

        Each tree lists its nodes as ``[feature, threshold, left, right]``; a branch that is
        not negative is a node, ``-1 - k`` is leaf k.
        """
        features = tuple(str(name) for name in table["features"])
        trees = tuple(_tree(item["nodes"], item["leaves"]) for item in table["trees"])
        count, least = table.get("early", (0, -np.inf))
        return cls(features, trees, float(table.get("base", 0.0)), (int(count), float(least)))

    def evaluate(self, measured: FeatureTable) -> NDArray[np.float64]:
        """Return the sum of the trees for every candidate, minus infinity for the hopeless.

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
        position = {name: i for i, name in enumerate(measured.names)}
        columns = measured.values.T[[position[name] for name in self.features]]
        count, least = self.early
        total = self.base + _sum(self.trees[:count], columns)
        hopeful = np.flatnonzero(total >= least)
        total[total < least] = -np.inf
        total[hopeful] += _sum(self.trees[count:], np.take(columns, hopeful, axis=1))
        return total


def _sum(trees: Sequence[Tree], columns: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the sum of trees for candidates, an array (features, candidates)."""
    count = columns.shape[1]
    total = np.zeros(count)
    right, ruled_out = np.empty(count, dtype=np.bool_), np.empty(count, dtype=np.uint32)
    for tree in trees:
        dropped = np.zeros(count, dtype=np.uint32)
        for feature, threshold, drop in zip(tree.feature, tree.threshold, ~tree.keep, strict=True):
            np.greater(columns[feature], threshold, out=right)
            # What is dropped times whether it goes right: far quicker than a choice.
            dropped |= np.multiply(right, drop, out=ruled_out)
        # The lowest leaf that is left: as many as were dropped below it.
        total += tree.leaf[np.bitwise_count(dropped & ~(dropped + np.uint32(1)))]
    return total


def _tree(nodes: Sequence[Sequence[float]], leaves: Sequence[float]) -> Tree:
    if len(leaves) > MAX_LEAVES:
        raise ObstacleError(f"A tree of the verifier has {len(leaves)} leaves; 32 are the limit.")
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
    keep = [_ALL & ~sum(1 << leaf for leaf in left_leaves[i]) for i in range(len(nodes))]
    return Tree(
        np.array([int(node[0]) for node in nodes], dtype=np.intp),
        np.array([node[1] for node in nodes], dtype=np.float32),
        np.array(keep, dtype=np.uint32),
        np.array([leaves[k] for k in order], dtype=np.float64),
    )
