"""The verifier: from measured candidates to trees with a calibrated confidence.

Four small models, read from one JSON table per set of bands (``tables/verifier_*.json``,
written by ``tools/fit_confidence.py``): a *gate* (logistic, cheap features) that drops what
is clearly nothing; a *score* (boosted trees) of how near a tree's centre a candidate is; a
*spacing* (boosted trees) of how far the next tree will be, which decides how wide a detection
suppresses others; and a *decision* (boosted trees) on the detections that are left, which
sees what is around each. The confidence is the decision put through a logistic curve that was
fitted to hits and misses on sites it had not seen.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from geofield.errors import ObstacleError
from geofield.obstacles.channels import Variant
from geofield.obstacles.features import FeatureTable
from geofield.obstacles.forest import Forest

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Gate:
    """A logistic model on standardised features."""

    features: tuple[str, ...]
    mean: FloatArray
    scale: FloatArray
    weight: FloatArray
    threshold: float

    def evaluate(self, measured: FeatureTable) -> FloatArray:
        """Return how much each candidate looks like a crown, on a logistic scale."""
        position = {name: i for i, name in enumerate(measured.names)}
        total = np.zeros(measured.values.shape[0])
        for name, mean, scale, weight in zip(
            self.features, self.mean, self.scale, self.weight, strict=True
        ):
            value = np.clip((measured.values[:, position[name]] - mean) / scale, -5, 5)
            total += weight * value
        return total

    def passes(self, value: FloatArray) -> NDArray[np.bool_]:
        """Return which candidates are worth measuring fully."""
        return np.asarray(value >= self.threshold)


@dataclass(frozen=True, slots=True)
class Verifier:
    """All that was fitted for one set of bands."""

    variant: Variant
    gate: Gate
    score: Forest
    spacing: Forest
    decision: Forest
    calibration: tuple[float, float]
    spacing_share: float
    spacing_px: tuple[float, float]
    threshold: float

    @classmethod
    def read(cls, table: Mapping[str, Any]) -> Verifier:
        """Build a verifier from its JSON form."""
        gate = table["gate"]
        low, high = table["spacing_px"]
        slope, offset = table["calibration"]
        return cls(
            table["variant"],
            Gate(
                tuple(gate["features"]),
                np.asarray(gate["mean"], float),
                np.asarray(gate["scale"], float),
                np.asarray(gate["weight"], float),
                float(gate["threshold"]),
            ),
            Forest.read(table["score"]),
            Forest.read(table["spacing"]),
            Forest.read(table["decision"]),
            (float(slope), float(offset)),
            float(table["spacing_share"]),
            (float(low), float(high)),
            float(table["threshold"]),
        )

    def reach_px(self, spacing: FloatArray) -> FloatArray:
        """Return how far candidates with this spacing suppress weaker ones, working pixels."""
        low, high = self.spacing_px
        return np.clip(self.spacing_share * spacing, low, high)

    def confidence(self, decision: FloatArray) -> FloatArray:
        """Return the probability that a detection with this decision is a tree."""
        slope, offset = self.calibration
        return 1 / (1 + np.exp(-np.clip(slope * decision + offset, -30, 30)))


@cache
def load_verifier(variant: Variant) -> Verifier:
    """Return the verifier that ships with the package.

    Raises
    ------
    ObstacleError
        When its table is missing or cannot be read.
    """
    file = resources.files("geofield.obstacles") / "tables" / f"verifier_{variant}.json"
    try:
        return Verifier.read(json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError) as error:
        raise ObstacleError(
            f"The verifier's table {file.name} cannot be read: {error}.",
            hint="Install geofield again.",
        ) from None


def strongest(
    x_px: FloatArray, y_px: FloatArray, score: FloatArray, reach_px: FloatArray
) -> NDArray[np.intp]:
    """Return the candidates that no stronger kept one within its reach suppresses.

    Strongest first; equal scores in the order of rows and columns, so that the result does
    not depend on the order of the input.
    """
    order = np.lexsort((x_px, y_px, -score))
    if order.size == 0:
        return order
    points = np.column_stack([x_px, y_px])[order]
    near = cKDTree(points).query_ball_point(points, reach_px[order])
    alive = np.ones(order.size, dtype=bool)
    keep: list[int] = []
    for i in range(order.size):
        if alive[i]:
            keep.append(i)
            alive[near[i]] = False
    return order[np.asarray(keep, dtype=np.intp)]
