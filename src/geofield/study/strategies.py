"""The study's strategies: which edge map to trust when nobody knows the right threshold.

``single`` takes one edge method at one threshold, ``t_range`` the threshold of one method
with the most detections, ``max_of_all`` the method with the most at the default thresholds,
``dlc`` (double layered check) the best of ``t_range`` over the four methods. ``consensus``
keeps what a share of all the scan's settings agree on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from geofield.errors import ObstacleError, plain_number, refuse_unknown
from geofield.model.circles import Circles, inside
from geofield.study.accumulator import Polarity
from geofield.study.checks import first_of_duplicates
from geofield.study.edges import EDGE_METHODS, EdgeMethod, EdgeScan
from geofield.study.phase_code import DEFAULT_SENSITIVITY, CircleMethod, find_circles

StudyStrategy = Literal["single", "t_range", "max_of_all", "dlc", "consensus"]
STUDY_STRATEGIES: tuple[StudyStrategy, ...] = get_args(StudyStrategy)

Progress = Callable[[int, int, str], None]
ThresholdRange = tuple[float, float, float]

DEFAULT_RANGES: dict[EdgeMethod, ThresholdRange] = {
    "sobel": (0.0, 0.3, 0.001),
    "prewitt": (0.0, 0.3, 0.001),
    "roberts": (0.0, 0.3, 0.001),
    # Canny's threshold is relative to the strongest edge, the others' are absolute; the
    # same number of settings for each keeps the comparison fair.
    "canny": (0.0, 0.9999, 0.00333),
}


@dataclass(frozen=True, slots=True)
class EdgeCircles:
    """How circles are taken from an edge map.

    Attributes
    ----------
    radius_px : (low, high)
    polarity, sensitivity, edge_threshold, method
        See :func:`geofield.study.find_circles`.
    smoothed_radius_px : (low, high) or None
        Radii of a second pass on the edge map smoothed by 3 x 3; None for no second pass.
    """

    radius_px: tuple[float, float]
    polarity: Polarity = "bright"
    sensitivity: float = DEFAULT_SENSITIVITY
    edge_threshold: float | None = None
    method: CircleMethod = "phase_code"
    smoothed_radius_px: tuple[float, float] | None = None

    def find(self, edges: NDArray[np.bool_], region: NDArray[np.bool_]) -> Circles:
        """Return the circles whose centre lies in the region, each once."""
        circles = self._pass(edges, self.radius_px)
        if self.smoothed_radius_px is not None:
            smoothed = ndimage.uniform_filter(edges.astype(np.float64), 3, mode="nearest")
            circles = circles.joined(self._pass(smoothed, self.smoothed_radius_px))
        circles = circles.take(inside(circles, region))
        return circles.take(first_of_duplicates(circles))

    def _pass(self, edges: NDArray[np.generic], radius_px: tuple[float, float]) -> Circles:
        if not edges.any():
            return Circles()
        return find_circles(
            edges,
            radius_px,
            polarity=self.polarity,
            sensitivity=self.sensitivity,
            edge_threshold=self.edge_threshold,
            method=self.method,
            warn=False,
        )


@dataclass(frozen=True, slots=True)
class StrategyResult:
    """What a strategy found and how it chose.

    Attributes
    ----------
    circles : Circles
        In pixel-index coordinates, inside the region, each once.
    method, threshold
        The winning setting; for ``consensus`` None.
    counts : dict of method to list of (threshold, detections)
        Every setting that was tried.
    share : float64 array or None
        ``consensus``: the share of the settings that saw each circle.
    """

    circles: Circles
    method: EdgeMethod | None
    threshold: float | None
    counts: dict[str, list[tuple[float, int]]] = field(default_factory=dict)
    share: NDArray[np.float64] | None = None


def run_strategy(
    grey: NDArray[np.generic],
    region: NDArray[np.bool_],
    strategy: StudyStrategy,
    how: EdgeCircles,
    *,
    methods: Iterable[EdgeMethod] | None = None,
    threshold: float | None = None,
    ranges: dict[EdgeMethod, ThresholdRange] | None = None,
    min_share: float = 0.1,
    progress: Progress | None = None,
) -> StrategyResult:
    """Run one of the study's strategies.

    Parameters
    ----------
    grey : array, shape (rows, cols)
    region : bool array, shape (rows, cols)
        The field; only circles with their centre in it count.
    strategy : {"single", "t_range", "max_of_all", "dlc", "consensus"}
    how : EdgeCircles
    methods : iterable of str, optional
        Edge methods; default Sobel for ``single`` and ``t_range``, all four otherwise.
    threshold : float, optional
        ``single``: the edge threshold; default the method's own.
    ranges : dict of method to (start, stop, step), optional
        The thresholds of a scan, stop included; default :data:`DEFAULT_RANGES`.
    min_share : float
        ``consensus``: the share of the settings that find anything which must see a circle.
    progress : callable, optional
        Called with (done, total, what).

    Raises
    ------
    ObstacleError
        For an unknown strategy or method, or an impossible range.
    """
    refuse_unknown(ObstacleError, "strategy", strategy, STUDY_STRATEGIES)
    plan: list[tuple[EdgeMethod, float | None]] = []
    for method in _edge_methods(strategy, methods):
        if strategy in ("single", "max_of_all"):
            plan.append((method, threshold if strategy == "single" else None))
        else:
            steps = thresholds({**DEFAULT_RANGES, **(ranges or {})}[method])
            plan.extend((method, float(t)) for t in steps)

    counts: dict[str, list[tuple[float, int]]] = {}
    best: tuple[int, EdgeMethod, float, Circles] | None = None
    seen: list[Circles] = []
    for done, (method, at, circles) in enumerate(_scanned(grey, region, plan, how)):
        counts.setdefault(method, []).append((at, len(circles)))
        # Strictly more: of equal counts the smallest threshold, the first method, stays.
        if best is None or len(circles) > best[0]:
            best = (len(circles), method, at, circles)
        if len(circles):
            seen.append(circles)
        if progress is not None:
            progress(done + 1, len(plan), f"{method} {at:.3f}")
    if strategy == "consensus":
        circles, share = _agreed(seen, min_share)
        return StrategyResult(circles, None, None, counts, share)
    if best is None:
        return StrategyResult(Circles(), None, None, counts)
    return StrategyResult(best[3], best[1], best[2], counts)


def _edge_methods(
    strategy: StudyStrategy, methods: Iterable[EdgeMethod] | None
) -> tuple[EdgeMethod, ...]:
    """The edge methods that a strategy runs with."""
    one = strategy in ("single", "t_range")
    default: tuple[EdgeMethod, ...] = ("sobel",) if one else EDGE_METHODS
    chosen = default if methods is None else tuple(methods)
    if not chosen or (one and len(chosen) != 1):
        raise ObstacleError(f"Strategy {strategy!r} needs {'one' if one else 'an'} edge method.")
    for method in chosen:
        refuse_unknown(ObstacleError, "edge method", method, EDGE_METHODS)
    return chosen


def _scanned(
    grey: NDArray[np.generic],
    region: NDArray[np.bool_],
    plan: Iterable[tuple[EdgeMethod, float | None]],
    how: EdgeCircles,
) -> Iterator[tuple[EdgeMethod, float, Circles]]:
    """The circles of each method and threshold; without one, at the method's own."""
    scans: dict[EdgeMethod, EdgeScan] = {}
    edges: NDArray[np.bool_] | None = None
    circles = Circles()
    for method, threshold in plan:
        if method not in scans:
            scans[method] = EdgeScan.of(grey, method)
        at = scans[method].default_threshold if threshold is None else threshold
        before, edges = edges, scans[method].at(at)
        # Neighbouring thresholds often give the very same map.
        if before is None or not np.array_equal(before, edges):
            circles = how.find(edges, region)
        yield method, at, circles


def thresholds(span: ThresholdRange) -> NDArray[np.float64]:
    """Return the thresholds of a scan, both ends included.

    Raises
    ------
    ObstacleError
        For a step that is not above zero, or a stop below the start.
    """
    try:
        start, stop, step = map(plain_number, span)
    except (TypeError, ValueError):
        raise ObstacleError(
            f"The thresholds {span!r} are no range.", hint="Give start, stop and step."
        ) from None
    if not step > 0 or stop < start or not np.isfinite([start, stop, step]).all():
        raise ObstacleError(
            f"The thresholds {start:g} to {stop:g} in steps of {step:g} are no range."
        )
    count = int(np.floor((stop - start) / step + 1e-9)) + 1
    return start + step * np.arange(count, dtype=np.float64)


def _agreed(seen: list[Circles], min_share: float) -> tuple[Circles, NDArray[np.float64]]:
    """Merge circles of many settings; keep those that enough settings saw."""
    if not seen:
        return Circles(), np.empty(0)
    setting = np.repeat(np.arange(len(seen)), [len(circles) for circles in seen])
    x = np.concatenate([circles.x_px for circles in seen])
    y = np.concatenate([circles.y_px for circles in seen])
    radius = np.concatenate([circles.radius_px for circles in seen])
    strength = np.concatenate([circles.strength for circles in seen])
    tree = cKDTree(np.column_stack([x, y]))
    reach = np.maximum(2.0, 0.4 * radius)
    near = tree.query_ball_point(np.column_stack([x, y]), reach)
    alive = np.ones(x.size, dtype=bool)
    votes = np.array([np.unique(setting[members]).size for members in near])
    rows: list[tuple[float, float, float, float]] = []
    shares: list[float] = []
    for i in np.lexsort((-strength, -votes)).tolist():
        if not alive[i]:
            continue
        members = np.asarray(near[i])
        members = members[alive[members]]
        share = np.unique(setting[members]).size / len(seen)
        if share >= min_share:
            rows.append(
                (
                    float(np.median(x[members])),
                    float(np.median(y[members])),
                    float(np.median(radius[members])),
                    float(share),
                )
            )
            shares.append(share)
        alive[members] = False
        wide = tree.query_ball_point([x[i], y[i]], float(radius[i]))
        alive[np.asarray(wide)] = False
    if not rows:
        return Circles(), np.empty(0)
    table = np.asarray(rows)
    return Circles(*table.T), np.asarray(shares)
