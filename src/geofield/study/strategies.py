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
from geofield.study.accumulator import evenly
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
    sensitivity, method
        See :func:`geofield.study.phase_code.find_circles`.
    smoothed_radius_px : (low, high) or None
        Radii of a second pass on the edge map smoothed by 3 x 3; None for no second pass.
    """

    radius_px: tuple[float, float]
    sensitivity: float = DEFAULT_SENSITIVITY
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
            sensitivity=self.sensitivity,
            method=self.method,
        )


@dataclass(frozen=True, slots=True)
class StrategyResult:
    """What a strategy found and how it chose.

    Attributes
    ----------
    circles : Circles
        From the corner of the top-left pixel on; inside the region, each once.
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
    edge_method: EdgeMethod | None = None,
    threshold: float | None = None,
    threshold_range: ThresholdRange | None = None,
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
    edge_method : str, optional
        Default Sobel for ``single`` and ``t_range``, all four otherwise.
    threshold : float, optional
        ``single``: the edge threshold; default the method's own.
    threshold_range : (start, stop, step), optional
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
    if edge_method is not None:
        refuse_unknown(ObstacleError, "edge method", edge_method, EDGE_METHODS)
        methods: tuple[EdgeMethod, ...] = (edge_method,)
    else:
        methods = ("sobel",) if strategy in ("single", "t_range") else EDGE_METHODS
    plan: list[tuple[EdgeMethod, float | None]] = []
    for method in methods:
        if strategy in ("single", "max_of_all"):
            plan.append((method, threshold if strategy == "single" else None))
        else:
            span = DEFAULT_RANGES[method] if threshold_range is None else threshold_range
            plan.extend((method, float(t)) for t in thresholds(span))

    counts: dict[str, list[tuple[float, int]]] = {}
    best = StrategyResult(Circles(), None, None, counts)
    seen: list[Circles] = []
    for done, (method, at, circles) in enumerate(_scanned(grey, region, plan, how), start=1):
        counts.setdefault(method, []).append((at, len(circles)))
        # Strictly more: of equal counts the smallest threshold, the first method, stays.
        if best.method is None or len(circles) > len(best.circles):
            best = StrategyResult(circles, method, at, counts)
        if len(circles):
            seen.append(circles)
        if progress is not None:
            progress(done, len(plan), f"{method} {at:.3f}")
    if strategy == "consensus":
        circles = _agreed(seen, min_share)
        return StrategyResult(circles, None, None, counts, circles.strength)
    return best


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
    return evenly(start, stop, step)


def first_of_duplicates(circles: Circles, tolerance_px: float = 0.5) -> NDArray[np.bool_]:
    """Return which circles are no repetition of an earlier one with the same centre.

    The study compares centres for equality; found on two maps of one picture they differ by
    rounding, so centres within ``tolerance_px`` count as one.
    """
    keep = np.ones(len(circles), dtype=bool)
    if len(circles) < 2:
        return keep
    centres = np.column_stack([circles.x_px, circles.y_px])
    pairs = cKDTree(centres).query_pairs(tolerance_px, output_type="ndarray")
    for first, second in pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].tolist():
        if keep[first]:
            keep[second] = False
    return keep


def _agreed(seen: list[Circles], min_share: float) -> Circles:
    """Merge circles of many settings; keep those that enough settings saw: the strength."""
    if not seen:
        return Circles()
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
    rows: list[list[float]] = []
    for i in np.lexsort((-strength, -votes)).tolist():
        if not alive[i]:
            continue
        members = np.asarray(near[i])
        members = members[alive[members]]
        share = np.unique(setting[members]).size / len(seen)
        if share >= min_share:
            rows.append([*(float(np.median(each[members])) for each in (x, y, radius)), share])
        alive[members] = False
        wide = tree.query_ball_point([x[i], y[i]], float(radius[i]))
        alive[np.asarray(wide)] = False
    return Circles(*np.array(rows).reshape(-1, 4).T)
