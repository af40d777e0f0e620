"""Figures of matches: precision, recall, F1, radii, and how far confidences keep their word."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geofield.errors import GeofieldError
from geofield.evaluation.matching import FloatArray, Matches


@dataclass(frozen=True, slots=True)
class Score:
    """Figures of one picture, or of several pooled.

    Attributes
    ----------
    hits, detected, truth : int
    precision, recall, f1 : float
        NaN where nothing was detected, or nothing is there.
    radius_bias, radius_error : float
        Mean and mean absolute difference of the radii of hits, detected minus true; NaN
        without radii.
    distance : float
        Mean distance of hits.
    interval : dict of name to (low, high)
        95 % bootstrap intervals of precision, recall, f1 and radius bias.
    """

    hits: int
    detected: int
    truth: int
    precision: float
    recall: float
    f1: float
    radius_bias: float
    radius_error: float
    distance: float
    interval: dict[str, tuple[float, float]] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return plain values, NaN as None."""

        def known(value: Any) -> Any:
            return None if isinstance(value, float) and not np.isfinite(value) else value

        values = {name: known(getattr(self, name)) for name in self.__slots__}
        values["interval"] = {key: [*map(known, pair)] for key, pair in self.interval.items()}
        return values


@dataclass(frozen=True, slots=True)
class Counts:
    """A picture's matches, and by how much each hit's radius is wrong (metres, or NaN)."""

    match: Matches
    radius_difference: FloatArray


def score(rows: Sequence[Counts], *, bootstrap: int = 0, seed: int = 0) -> Score:
    """The figures of pictures together, with intervals from `bootstrap` resamplings."""
    hits = np.array([len(row.match.truth_index) for row in rows])
    detected = np.array([row.match.detected_count for row in rows])
    truth = np.array([row.match.truth_count for row in rows])
    parts = [row.radius_difference[np.isfinite(row.radius_difference)] for row in rows]
    difference = np.concatenate(parts) if parts else np.empty(0)
    distance = np.concatenate([row.match.distance for row in rows]) if rows else np.empty(0)
    figures = _figures(hits.sum(), detected.sum(), truth.sum())
    interval: dict[str, tuple[float, float]] = {}
    if bootstrap > 0:
        interval = _intervals(hits, detected, truth, parts, bootstrap, seed)
    return Score(
        int(hits.sum()),
        int(detected.sum()),
        int(truth.sum()),
        *figures,
        float(difference.mean()) if difference.size else float("nan"),
        float(np.abs(difference).mean()) if difference.size else float("nan"),
        float(distance.mean()) if distance.size else float("nan"),
        interval,
    )


def _figures(hits: float, detected: float, truth: float) -> tuple[float, float, float]:
    precision = hits / detected if detected else float("nan")
    recall = hits / truth if truth else float("nan")
    f1 = 2 * hits / (detected + truth) if detected + truth else float("nan")
    return float(precision), float(recall), float(f1)


def _intervals(
    hits: NDArray[np.int64],
    detected: NDArray[np.int64],
    truth: NDArray[np.int64],
    radii: list[FloatArray],
    bootstrap: int,
    seed: int,
) -> dict[str, tuple[float, float]]:
    rng = np.random.default_rng(seed)
    figures = np.full((bootstrap, 4), np.nan)
    by_picture = hits.size >= 5
    pool = np.concatenate(radii) if radii else np.empty(0)
    # Each obstacle is a hit, a miss or a false detection: these are drawn where pictures are few.
    kinds = np.repeat([0, 1, 2], [hits.sum(), (truth - hits).sum(), (detected - hits).sum()])
    for k in range(bootstrap):
        if by_picture:
            pick = rng.integers(hits.size, size=hits.size)
            figures[k, :3] = _figures(hits[pick].sum(), detected[pick].sum(), truth[pick].sum())
            drawn = np.concatenate([radii[i] for i in pick])
        else:
            count = (
                np.bincount(rng.choice(kinds, kinds.size), minlength=3) if kinds.size else [0] * 3
            )
            figures[k, :3] = _figures(count[0], count[0] + count[2], count[0] + count[1])
            drawn = rng.choice(pool, pool.size) if pool.size else pool
        if drawn.size:
            figures[k, 3] = drawn.mean()
    out: dict[str, tuple[float, float]] = {}
    for name, column in zip(("precision", "recall", "f1", "radius_bias"), figures.T, strict=True):
        known = column[np.isfinite(column)]
        if known.size:
            low, high = np.percentile(known, [2.5, 97.5])
            out[name] = (float(low), float(high))
    return out


def reliability(
    confidence: ArrayLike, hit: ArrayLike, bins: int = 10
) -> tuple[FloatArray, FloatArray, NDArray[np.int64], float]:
    """How far confidences keep their word.

    Parameters
    ----------
    confidence : array (n,)
        0 to 1.
    hit : bool array (n,)
    bins : int
        Of equal width.

    Returns
    -------
    mean_confidence, share_of_hits : float64 arrays, shape (bins,)
        NaN for empty bins.
    count : int array, shape (bins,)
    error : float
        Expected calibration error: the mean gap, weighted by counts; NaN for no detection.
    """
    p, y = np.asarray(confidence, dtype=float), np.asarray(hit, dtype=float)
    if p.shape != y.shape:
        raise GeofieldError(f"{p.size} confidences do not fit {y.size} hits.")
    which = np.clip((p * bins).astype(int), 0, bins - 1)
    count = np.bincount(which, minlength=bins)
    with np.errstate(invalid="ignore"):
        mean = np.bincount(which, weights=p, minlength=bins) / count
        share = np.bincount(which, weights=y, minlength=bins) / count
    error = float(np.nansum(np.abs(mean - share) * count) / p.size) if p.size else float("nan")
    return mean, share, count.astype(np.int64), error
