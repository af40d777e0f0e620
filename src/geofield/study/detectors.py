"""The study's detectors on a scene: its strategies, its three presets, its grey check."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from geofield.errors import ObstacleError, is_number
from geofield.model.circles import Circles, disc_means, inside
from geofield.model.scene import Scene
from geofield.raster import gaps_filled
from geofield.study.accumulator import otsu_threshold
from geofield.study.edges import EdgeMethod
from geofield.study.phase_code import CircleMethod, find_circles
from geofield.study.strategies import (
    EdgeCircles,
    Progress,
    StrategyResult,
    StudyStrategy,
    ThresholdRange,
    first_of_duplicates,
    run_strategy,
)

GreyCheck = Literal["none", "absolute", "relative"]
StudyDetector = StudyStrategy | Literal["study_text", "study_listing", "study_dlc"]

STUDY_RADIUS_PX = (4.0, 18.0)
STUDY_SMOOTHED_RADIUS_PX = (4.0, 16.0)
STUDY_EDGE_THRESHOLD = 0.27
GREY_LIMIT = 127.37
"""Mean grey level (0..255) above which the study calls a detection false."""


@dataclass(frozen=True, slots=True)
class StudyOptions:
    """What can be varied; see :func:`geofield.obstacles.detect_obstacles`."""

    edge_method: EdgeMethod | None = None
    threshold: float | None = None
    threshold_range: ThresholdRange | None = None
    circle_method: CircleMethod = "phase_code"
    sensitivity: float = 0.85
    grey_check: GreyCheck | float | None = None
    min_share: float = 0.1


def detect_by_study(
    scene: Scene,
    region: NDArray[np.bool_],
    strategy: StudyDetector,
    radius_px: tuple[float, float],
    progress: Progress | None = None,
    **varied: Any,
) -> tuple[Circles, NDArray[np.float64] | None, dict[str, Any]]:
    """Run one of the study's detectors; what is varied are the fields of :class:`StudyOptions`.

    Returns
    -------
    circles : Circles
    share : float64 array or None
        ``consensus``: the share of the settings that saw each circle.
    detection : dict
        The winning setting, the counts per threshold, the grey limit.
    """
    options = StudyOptions(**varied)
    grey = gaps_filled(scene.grey.astype(np.float64), scene.valid)
    if strategy == "study_listing":
        result = _listing(grey, region, options)
    elif strategy == "study_text":
        result = _text(grey, region, options)
    else:
        result = _scan(grey, region, strategy, radius_px, options, progress)
    circles, share = result.circles, result.share
    detection: dict[str, Any] = {
        "method": result.method or options.circle_method,
        "threshold": result.threshold,
        "counts": {name: [list(row) for row in rows] for name, rows in result.counts.items()},
    }
    if options.grey_check is not None and options.grey_check != "none":
        limit = _grey_limit(options.grey_check, grey, region)
        dark = disc_means(grey, circles, scene.valid) <= limit
        circles = circles.take(dark)
        share = None if share is None else share[dark]
        detection["grey_limit"] = limit
    return circles, share, detection


def _listing(
    grey: NDArray[np.float64], region: NDArray[np.bool_], options: StudyOptions
) -> StrategyResult:
    """The study's first listing: dark circles on the grey picture."""
    circles = find_circles(
        grey / 255,
        STUDY_RADIUS_PX,
        polarity="dark",
        sensitivity=options.sensitivity,
        method=options.circle_method,
    )
    return _checked(circles, region)


def _text(
    grey: NDArray[np.float64], region: NDArray[np.bool_], options: StudyOptions
) -> StrategyResult:
    """The study's text: bright circles on the inverted binary field."""
    smooth = ndimage.median_filter(grey, 3)
    values = smooth[region]
    level = 255 * otsu_threshold(values / 255)
    circles = find_circles(
        smooth <= level,
        STUDY_RADIUS_PX,
        polarity="bright",
        sensitivity=options.sensitivity,
        edge_threshold=STUDY_EDGE_THRESHOLD,
        method=options.circle_method,
    )
    return _checked(circles, region)


def _checked(circles: Circles, region: NDArray[np.bool_]) -> StrategyResult:
    circles = circles.take(inside(circles, region))
    return StrategyResult(circles.take(first_of_duplicates(circles)), None, None)


def _scan(
    grey: NDArray[np.float64],
    region: NDArray[np.bool_],
    strategy: StudyDetector,
    radius_px: tuple[float, float],
    options: StudyOptions,
    progress: Progress | None,
) -> StrategyResult:
    """One of the strategies on edge maps, or the study's DLC listing with its second pass."""
    preset = strategy == "study_dlc"
    how = EdgeCircles(
        STUDY_RADIUS_PX if preset else radius_px,
        sensitivity=options.sensitivity,
        method=options.circle_method,
        smoothed_radius_px=STUDY_SMOOTHED_RADIUS_PX if preset else None,
    )
    return run_strategy(
        grey / 255,
        region,
        "dlc" if preset else cast("StudyStrategy", strategy),
        how,
        edge_method=options.edge_method,
        threshold=options.threshold,
        threshold_range=options.threshold_range,
        min_share=options.min_share,
        progress=progress,
    )


def _grey_limit(
    check: GreyCheck | float, grey: NDArray[np.float64], region: NDArray[np.bool_]
) -> float:
    """The mean grey level above which a disc is none: the study's, the field's, or a given one."""
    if check == "absolute":
        return GREY_LIMIT
    if check == "relative":
        return float(grey[region].mean()) if region.any() else GREY_LIMIT
    if is_number(check):
        return float(check)
    raise ObstacleError(
        f"Unknown grey check {check!r}.", hint="Choose absolute, relative or a grey level."
    )
