"""The study's detectors on a scene: its strategies, its three presets, its grey check."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from geofield.errors import ObstacleError, is_number
from geofield.model.circles import Circles, disc_means, inside
from geofield.model.scene import Scene
from geofield.raster import gaps_filled
from geofield.study.accumulator import otsu_threshold
from geofield.study.phase_code import DEFAULT_SENSITIVITY, CircleMethod, find_circles
from geofield.study.strategies import (
    EdgeCircles,
    Progress,
    StrategyResult,
    StudyStrategy,
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


def detect_by_study(
    scene: Scene,
    region: NDArray[np.bool_],
    strategy: StudyDetector,
    radius_px: tuple[float, float],
    progress: Progress | None = None,
    *,
    circle_method: CircleMethod = "phase_code",
    sensitivity: float = DEFAULT_SENSITIVITY,
    grey_check: GreyCheck | float | None = None,
    **scan: Any,
) -> tuple[Circles, NDArray[np.float64] | None, dict[str, Any]]:
    """Run one of the study's detectors.

    What can be varied is told by :func:`geofield.obstacles.detect_obstacles`; `scan` goes to
    :func:`geofield.study.strategies.run_strategy`.

    Returns
    -------
    circles : Circles
    share : float64 array or None
        ``consensus``: the share of the settings that saw each circle.
    detection : dict
        The winning setting, the counts per threshold, the grey limit.
    """
    grey = gaps_filled(scene.grey.astype(np.float64), scene.valid)
    find = partial(find_circles, sensitivity=sensitivity, method=circle_method)
    if strategy == "study_listing":
        # The study's first listing: dark circles on the grey picture.
        result = _checked(find(grey / 255, STUDY_RADIUS_PX, polarity="dark"), region)
    elif strategy == "study_text":
        result = _checked(_of_text(grey, region, find), region)
    else:
        # The study's listing of DLC has a second pass.
        preset = strategy == "study_dlc"
        how = EdgeCircles(
            STUDY_RADIUS_PX if preset else radius_px,
            sensitivity=sensitivity,
            method=circle_method,
            smoothed_radius_px=STUDY_SMOOTHED_RADIUS_PX if preset else None,
        )
        name = "dlc" if preset else cast("StudyStrategy", strategy)
        result = run_strategy(grey / 255, region, name, how, progress=progress, **scan)
    circles, share = result.circles, result.share
    detection: dict[str, Any] = {
        "method": result.method or circle_method,
        "threshold": result.threshold,
        "counts": {name: [list(row) for row in rows] for name, rows in result.counts.items()},
    }
    if grey_check is not None and grey_check != "none":
        limit = _grey_limit(grey_check, grey, region)
        dark = disc_means(grey, circles, scene.valid) <= limit
        circles = circles.take(dark)
        share = None if share is None else share[dark]
        detection["grey_limit"] = limit
    return circles, share, detection


def _of_text(
    grey: NDArray[np.float64], region: NDArray[np.bool_], find: Callable[..., Circles]
) -> Circles:
    """The study's text: bright circles on the inverted binary field."""
    smooth = ndimage.median_filter(grey, 3)
    level = 255 * otsu_threshold(smooth[region] / 255)
    return find(
        smooth <= level, STUDY_RADIUS_PX, polarity="bright", edge_threshold=STUDY_EDGE_THRESHOLD
    )


def _checked(circles: Circles, region: NDArray[np.bool_]) -> StrategyResult:
    circles = circles.take(inside(circles, region))
    return StrategyResult(circles.take(first_of_duplicates(circles)), None, None)


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
