"""Points against points, one to one.

A detection is a hit when it is matched with a true obstacle within a distance; every truth
is matched at most once (H. W. Kuhn's Hungarian method, over all pairs within the distance:
first as many hits as possible, then the smallest sum of distances).

The study calls a missed obstacle "FPE" and a wrong detection "FNE"; here the usual terms
hold: false negative is missed, false positive is wrong.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geofield.errors import ObstacleError, refuse_no_number

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Matches:
    """Who was matched with whom, in one picture.

    Attributes
    ----------
    detected_index, truth_index : intp arrays, shape (hits,)
    distance : float64 array, shape (hits,)
    detected_count, truth_count : int
    """

    detected_index: NDArray[np.intp]
    truth_index: NDArray[np.intp]
    distance: FloatArray
    detected_count: int
    truth_count: int

    @property
    def false_index(self) -> NDArray[np.intp]:
        """Detections that match nothing."""
        return np.setdiff1d(np.arange(self.detected_count), self.detected_index)


def match_points(detected: ArrayLike, truth: ArrayLike, distance: float) -> Matches:
    """Match points one to one within a distance.

    Parameters
    ----------
    detected, truth : array (n, 2), (m, 2)
        In one unit, that of ``distance``.
    distance : float

    Returns
    -------
    Matches
        As many hits as possible, with the smallest sum of distances.

    Raises
    ------
    ObstacleError
        When the distance is not above zero.
    """
    # Every run reports what it may have missed, and matches nothing: not loaded for that.
    from scipy.optimize import linear_sum_assignment
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    refuse_no_number(ObstacleError, "metres, above zero", distance_m=distance)
    if distance <= 0:
        raise ObstacleError(f"The matching distance {distance:g} is not above zero.")
    found = np.asarray(detected, dtype=float).reshape(-1, 2)
    true = np.asarray(truth, dtype=float).reshape(-1, 2)
    first: list[int] = []
    second: list[int] = []
    apart: list[float] = []
    if len(found) and len(true):
        # Only points within the distance can meet: groups of them are matched on their own,
        # so that whole cities fit into memory.
        pairs = cKDTree(found).sparse_distance_matrix(
            cKDTree(true), distance, output_type="coo_matrix"
        )
        rows, cols, gaps = pairs.row, pairs.col, pairs.data
        size = len(found) + len(true)
        graph = coo_matrix((np.ones(len(rows)), (rows, cols + len(found))), shape=(size, size))
        _, group = connected_components(graph, directed=False)
        order = np.argsort(group[rows], kind="stable")
        for part in np.split(order, 1 + np.flatnonzero(np.diff(group[rows][order]))):
            r, i = np.unique(rows[part], return_inverse=True)
            c, j = np.unique(cols[part], return_inverse=True)
            # A pair out of reach costs more than any number of pairs within it.
            cost = np.full((r.size, c.size), 1e3 * distance * (1 + min(r.size, c.size)))
            cost[i, j] = gaps[part]
            a, b = linear_sum_assignment(cost)
            hit = cost[a, b] <= distance
            first.extend(r[a[hit]].tolist())
            second.extend(c[b[hit]].tolist())
            apart.extend(cost[a, b][hit].tolist())
    return Matches(
        np.asarray(first, dtype=np.intp),
        np.asarray(second, dtype=np.intp),
        np.asarray(apart, dtype=float),
        len(found),
        len(true),
    )
