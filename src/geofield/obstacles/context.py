"""What a detection has around it: the columns that the verifier decides on.

- ``score``, ``reach``: the detection's own score, and how far it suppresses others;
- ``rival_r``: the best score of another candidate within r pixels, ``lead_r`` by how much the
  detection exceeds it;
- ``mass_r``: the nearness to trees, summed over the candidates within r pixels: a tree is seen
  by many candidates, and by none between trees;
- ``off_centre``: how far the detection lies from the middle of the mass within 6 pixels;
- ``stronger_distance``: to the nearest stronger candidate;
- ``neighbour_distance|score``: of the nearest other detection;
- ``neighbours_r``: nearness of the other detections within r pixels, summed;
- ``neighbours_mean``, ``neighbours_reach``: their mean, and mean reach, within 40 pixels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from geofield.obstacles.features import FeatureTable, feature_table

FloatArray = NDArray[np.float64]

_LEAST_SCORE = -4.0
"""Candidates below this do not count."""

_RADII_PX = (3, 6, 10, 15, 25, 40)
_FAR_PX = 41.0
_NONE = -8.0
_USUAL_REACH_PX = 9.0


def context_features(
    x_px: FloatArray,
    y_px: FloatArray,
    score: FloatArray,
    kept: NDArray[np.intp],
    reach_px: FloatArray,
) -> FeatureTable:
    """Describe detections by the candidates and detections around them.

    Parameters
    ----------
    x_px, y_px, score : float64 arrays, shape (n,)
        Of all candidates.
    kept : intp array, shape (m,)
        Which candidates are the detections.
    reach_px : float64 array, shape (m,)
        How far each detection suppresses weaker candidates.

    Returns
    -------
    FeatureTable
        One row per detection.
    """
    count = kept.size
    points = np.column_stack([x_px, y_px])
    others = np.flatnonzero(score > _LEAST_SCORE)
    here, there, distance = _pairs(points[kept], points[others])
    there = others[there]
    near = 1 / (1 + np.exp(-score))
    own = near[kept]
    foreign = kept[here] != there
    here, there, distance = here[foreign], there[foreign], distance[foreign]
    columns: dict[str, NDArray[np.floating]] = {"score": score[kept], "reach": reach_px}
    for r in _RADII_PX:
        within = distance <= r
        mass = _sums(here[within], near[there[within]], count)
        columns[f"mass_{r}"] = mass + own
        if r < _RADII_PX[-1]:
            rival = _extreme(np.maximum, _NONE, here[within], score[there[within]], count)
            columns[f"rival_{r}"] = rival
            if r in (6, 10):
                columns[f"lead_{r}"] = score[kept] - rival
    within = distance <= 6
    weight = near[there[within]]
    shift = [
        _sums(
            here[within], weight * (points[there[within], k] - points[kept[here[within]], k]), count
        )
        for k in (0, 1)
    ]
    columns["off_centre"] = np.hypot(*shift) / columns["mass_6"]
    stronger = score[there] > score[kept[here]]
    columns["stronger_distance"] = _extreme(
        np.minimum, _FAR_PX, here[stronger], distance[stronger], count
    )
    _neighbours(columns, points[kept], score[kept], own, reach_px)
    return feature_table(columns, count)


def _neighbours(
    columns: dict[str, NDArray[np.floating]],
    points: FloatArray,
    score: FloatArray,
    near: FloatArray,
    reach_px: FloatArray,
) -> None:
    """Describe detections by the other detections."""
    count = len(points)
    here, there, distance = _pairs(points, points)
    foreign = here != there
    here, there, distance = here[foreign], there[foreign], distance[foreign]
    columns["neighbour_distance"] = _extreme(np.minimum, _FAR_PX, here, distance, count)
    order = np.lexsort((there, distance, here))
    first = order[np.flatnonzero(np.diff(here[order], prepend=-1))]
    nearest = np.full(count, _NONE)
    nearest[here[first]] = score[there[first]]
    columns["neighbour_score"] = nearest
    for r in (25, 40):
        within = distance <= r
        columns[f"neighbours_{r}"] = _sums(here[within], near[there[within]], count)
    total = _sums(here, near[there], count)
    columns["neighbours_mean"] = total / np.maximum(_sums(here, np.ones(here.size), count), 1)
    reach = _sums(here, near[there] * reach_px[there], count)
    columns["neighbours_reach"] = (reach + 0.1 * _USUAL_REACH_PX) / (total + 0.1)


def _pairs(
    first: FloatArray, second: FloatArray
) -> tuple[NDArray[np.intp], NDArray[np.intp], FloatArray]:
    """Return which points of two sets are near each other, and their distances."""
    if not (len(first) and len(second)):
        none = np.empty(0, dtype=np.intp)
        return none, none, np.empty(0)
    found = cKDTree(first).sparse_distance_matrix(
        cKDTree(second), float(_RADII_PX[-1]), output_type="ndarray"
    )
    return found["i"], found["j"], found["v"]


def _sums(here: NDArray[np.intp], values: FloatArray, count: int) -> FloatArray:
    """Return the sum of values of each point."""
    return np.bincount(here, values, count).astype(np.float64)


def _extreme(
    ufunc: np.ufunc,
    default: float,
    here: NDArray[np.intp],
    values: FloatArray,
    count: int,
) -> FloatArray:
    """Return the largest or smallest value of each point, and a default where there is none."""
    out = np.full(count, default)
    ufunc.at(out, here, values)
    return out
