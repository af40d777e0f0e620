"""Stage 3 from a scene to a table of obstacles."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, cast, get_args

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage

from geofield import schema
from geofield.errors import ObstacleError, ObstacleWarning
from geofield.model.field import Field
from geofield.model.obstacles import from_circles_px, from_polygons
from geofield.model.scene import Scene
from geofield.obstacles.accumulator import otsu_threshold
from geofield.obstacles.auto import WORKING_RESOLUTION_M, picture_channels
from geofield.obstacles.checks import (
    GREY_LIMIT,
    dark_enough,
    disc_means,
    first_of_duplicates,
    inside,
    relative_grey_limit,
)
from geofield.obstacles.circles import Circles, checked_range
from geofield.obstacles.edges import EdgeMethod
from geofield.obstacles.phase_code import CircleMethod, find_circles
from geofield.obstacles.shapes import footprints
from geofield.obstacles.strategies import (
    EdgeCircles,
    StrategyResult,
    StudyStrategy,
    ThresholdRange,
    run_strategy,
)
from geofield.obstacles.verifier import load_verifier
from geofield.obstacles.windows import detect_trees, variant_of
from geofield.obstacles.working import working_factor, working_picture

if TYPE_CHECKING:
    import geopandas as gpd

Strategy = Literal[
    "auto",
    "single",
    "t_range",
    "max_of_all",
    "dlc",
    "consensus",
    "study_text",
    "study_listing",
    "study_dlc",
]
STRATEGIES: tuple[Strategy, ...] = get_args(Strategy)
GreyCheck = Literal["none", "absolute", "relative"]
Progress = Callable[[int, int, str], None]

MIN_RADIUS_PX = 2.0
STUDY_RADIUS_PX = (4.0, 18.0)
STUDY_SMOOTHED_RADIUS_PX = (4.0, 16.0)
STUDY_EDGE_THRESHOLD = 0.27


def detect_obstacles(
    scene: Scene,
    field: Field | None = None,
    *,
    strategy: Strategy = "auto",
    radius_m: tuple[float, float] = (2.0, 9.0),
    buffer_m: float = 1.0,
    polarity: Literal["dark", "bright", "both"] = "both",
    min_confidence: float | None = None,
    others: bool = True,
    edge_method: EdgeMethod | None = None,
    threshold: float | None = None,
    threshold_range: ThresholdRange | None = None,
    circle_method: CircleMethod = "phase_code",
    sensitivity: float = 0.85,
    grey_check: GreyCheck | float | None = None,
    min_share: float = 0.1,
    progress: Progress | None = None,
) -> gpd.GeoDataFrame:
    """Find the obstacles in a field.

    Parameters
    ----------
    scene : Scene
    field : Field, optional
        Only obstacles with their centre inside its outer ring are returned; holes do not
        count, since a tree that the outline was cut around still stands in the way. The
        whole scene when not given.
    strategy : str
        One of :data:`STRATEGIES`.
    radius_m : (low, high)
        Radii to look for, metres on the ground.
    buffer_m : float
        Safety margin added around each footprint, metres.
    polarity : {"dark", "bright", "both"}
        ``auto``: keep only crowns that are darker, or brighter, than their surroundings.
    min_confidence : float, optional
        ``auto``: the confidence from which a detection is an obstacle; default the one with
        the best F1 in cross-validation. Lower it to miss less.
    others : bool
        ``auto`` in a field: also return what is in the field, not field and not round, as
        polygons of kind `other`.
    edge_method : str, optional
        Edge method of the study's strategies; see :func:`run_strategy`.
    threshold : float, optional
        Edge threshold of ``single``.
    threshold_range : (start, stop, step), optional
        Thresholds of ``t_range``, ``dlc`` and ``consensus``.
    circle_method : {"phase_code", "two_stage"}
    sensitivity : float
        Of the circle search, 0..1.
    grey_check : {"none", "absolute", "relative"} or float, optional
        Drop discs brighter than 127.37, than the field's mean, or than a grey level.
    min_share : float
        ``consensus``: the share of the settings that must see a circle.
    progress : callable, optional
        Called with (done, total, what).

    Returns
    -------
    GeoDataFrame
        The layer ``obstacles`` in the metric CRS, ordered by row and column of the centre;
        ``attrs["detection"]`` says how they were found.

    Raises
    ------
    ObstacleError
        For an impossible radius range, margin, strategy or method.
    """
    low_m, high_m = checked_range(radius_m)
    if not (np.isfinite(buffer_m) and buffer_m >= 0):
        raise ObstacleError(f"The safety margin {buffer_m:g} m is negative or not finite.")
    if strategy not in STRATEGIES:
        raise ObstacleError(
            f"Unknown strategy {strategy!r}.", hint=f"Choose one of {', '.join(STRATEGIES)}."
        )
    region = search_region(scene, field)
    notes: list[str] = []
    detection: dict[str, Any] = {"strategy": strategy, "radius_m": [low_m, high_m]}
    resolution = scene.grid.ground_resolution_m
    radius_px = (low_m / resolution, high_m / resolution)
    grey = filled(scene.grey, scene.valid)

    confidence: NDArray[np.float64] | None = None
    shapes: list[shapely.Polygon] = []
    if strategy == "auto":
        circles, confidence = _auto(
            scene, region, (low_m, high_m), polarity, min_confidence, detection, notes, progress
        )
        if field is not None and others:
            shapes = _others(scene, field, circles)
    elif strategy == "study_listing":
        circles = find_circles(
            grey / 255,
            STUDY_RADIUS_PX,
            polarity="dark",
            sensitivity=sensitivity,
            method=circle_method,
            warn=False,
        )
        circles = circles.take(inside(circles, region))
        circles = circles.take(first_of_duplicates(circles))
        detection["method"] = circle_method
    else:
        result = _study(
            grey, region, strategy, radius_px, edge_method, threshold, threshold_range,
            circle_method, sensitivity, min_share, progress,
        )  # fmt: skip
        circles, confidence = result.circles, result.share
        detection |= {
            "method": result.method,
            "threshold": result.threshold,
            "counts": {name: [list(row) for row in rows] for name, rows in result.counts.items()},
        }
    if grey_check is not None and grey_check != "none":
        limit = _grey_limit(grey_check, grey, region)
        dark = dark_enough(grey, circles, limit, scene.valid)
        circles = circles.take(dark)
        confidence = None if confidence is None else confidence[dark]
        detection["grey_limit"] = limit
    order = np.lexsort((circles.x_px, circles.y_px))
    circles = circles.take(order)
    crs = scene.grid.metric_crs if field is None else field.crs
    table = from_circles_px(
        circles.x_px + 0.5,
        circles.y_px + 0.5,
        circles.radius_px,
        scene.grid,
        buffer_m=buffer_m,
        confidence=None if confidence is None else confidence[order],
        crs=crs,
    )
    if shapes:
        table = _with_shapes(table, shapes, scene, buffer_m)
    detection["notes"] = notes
    table.attrs["detection"] = detection
    return table


def _auto(
    scene: Scene,
    region: NDArray[np.bool_],
    radius_m: tuple[float, float],
    polarity: str,
    min_confidence: float | None,
    detection: dict[str, Any],
    notes: list[str],
    progress: Progress | None,
) -> tuple[Circles, NDArray[np.float64]]:
    """Run the default detector; circles in pixel-index coordinates of the scene."""
    if polarity not in ("dark", "bright", "both"):
        raise ObstacleError(f"Unknown polarity {polarity!r}.", hint="Choose dark, bright or both.")
    if min_confidence is not None and not 0 <= min_confidence <= 1:
        raise ObstacleError(f"The confidence {min_confidence:g} is outside 0 to 1.")
    variant = variant_of(scene)
    verifier = load_verifier(variant)
    least = verifier.threshold if min_confidence is None else min_confidence
    resolution = scene.grid.ground_resolution_m
    detection |= {"method": f"evidence_{variant}", "threshold": least}
    if radius_m[0] / resolution < MIN_RADIUS_PX:
        message = (
            f"The picture is coarse ({resolution:.2f} m per pixel) for radii from "
            f"{radius_m[0]:g} m: small trees span too few pixels to be seen."
        )
        notes.append(message)
        warnings.warn(message, ObstacleWarning, stacklevel=3)
    factor = working_factor(resolution, WORKING_RESOLUTION_M)
    if factor != 1.0:
        notes.append(f"Resampled from {resolution:.2f} m to {resolution * factor:.2f} m per pixel.")
    trees = detect_trees(
        scene, region, verifier, factor=factor, min_confidence=least, progress=progress
    )
    found = Circles(trees.x_px, trees.y_px, trees.radius_px, trees.confidence)
    # A crown measured a little outside the range is still the tree that was asked for.
    measured_m = found.radius_px * resolution
    keep = (measured_m >= 0.6 * radius_m[0]) & (measured_m <= 1.4 * radius_m[1])
    if polarity != "both":
        keep &= _is_bright(scene, found) == (polarity == "bright")
    keep &= inside(found, region)
    found = found.take(keep)
    radius = np.clip(found.radius_px * resolution, *radius_m) / resolution
    return Circles(found.x_px, found.y_px, radius, found.strength), found.strength


def _others(scene: Scene, field: Field, circles: Circles) -> list[shapely.Polygon]:
    """Return footprints of what is not round, pixel coordinates with the corner as origin."""
    outline = field.polygon_px(scene.grid).bounds
    margin = 8
    # Only the field counts here; a crop of it keeps memory bounded on large pictures.
    c0, r0 = (max(int(v) - margin, 0) for v in outline[:2])
    width = min(int(outline[2]) + margin, scene.grid.width_px) - c0
    height = min(int(outline[3]) + margin, scene.grid.height_px) - r0
    if width < 1 or height < 1:
        return []
    part = scene.crop(c0, r0, width, height)
    resolution = scene.grid.ground_resolution_m
    factor = working_factor(resolution, WORKING_RESOLUTION_M)
    picture = working_picture(part, search_region(part, field), factor)
    found = picture_channels(picture.luma, picture.rgb, picture.nir)
    near = Circles(
        (circles.x_px - c0 + 0.5) / factor - 0.5,
        (circles.y_px - r0 + 0.5) / factor - 0.5,
        circles.radius_px / factor,
        circles.strength,
    )
    polygons = footprints(found, picture.region, near, resolution * factor)
    return [shapely.transform(p, lambda c: c * factor + np.array([c0, r0])) for p in polygons]


def _with_shapes(
    table: gpd.GeoDataFrame, shapes: list[shapely.Polygon], scene: Scene, buffer_m: float
) -> gpd.GeoDataFrame:
    """Append polygons of kind `other`, numbered on in the order of their rows."""
    import pandas as pd

    crs = table.crs

    def to_metric(c: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.column_stack(scene.grid.to_crs(c[:, 0], c[:, 1], crs))

    order = sorted(shapes, key=lambda shape: (shape.centroid.y, shape.centroid.x))
    metric = shapely.transform(np.asarray(order, dtype=object), to_metric)
    rows = from_polygons(metric, crs, buffer_m=buffer_m, grid=scene.grid, first_no=len(table) + 1)
    joined = pd.concat([table, rows]) if len(table) else rows
    return schema.conform(schema.OBSTACLES, joined)


def _is_bright(scene: Scene, circles: Circles) -> NDArray[np.bool_]:
    """Return which discs are brighter than the ring around them."""
    grey = scene.grey
    inner = disc_means(grey, circles, scene.valid)
    wide = Circles(circles.x_px, circles.y_px, 1.6 * circles.radius_px, circles.strength)
    return inner > disc_means(grey, wide, scene.valid)


def search_region(scene: Scene, field: Field | None) -> NDArray[np.bool_]:
    """Return the pixels (rows, cols) on which an obstacle's centre may lie."""
    if field is None:
        return scene.valid
    return field.mask(scene.grid, holes=False) & scene.valid


def filled(grey: NDArray[np.floating], valid: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return a picture whose missing pixels repeat the nearest one, so that they add no edge."""
    picture: NDArray[np.float64] = grey.astype(np.float64)
    if valid.all() or not valid.any():
        return picture
    nearest = ndimage.distance_transform_edt(~valid, return_distances=False, return_indices=True)
    return cast("NDArray[np.float64]", picture[tuple(nearest)])


def _grey_limit(
    check: GreyCheck | float, grey: NDArray[np.float64], region: NDArray[np.bool_]
) -> float:
    if check == "absolute":
        return GREY_LIMIT
    if check == "relative":
        return relative_grey_limit(grey, region)
    if isinstance(check, int | float):
        return float(check)
    raise ObstacleError(
        f"Unknown grey check {check!r}.", hint="Choose absolute, relative or a grey level."
    )


def _study(
    grey: NDArray[np.float64],
    region: NDArray[np.bool_],
    strategy: Strategy,
    radius_px: tuple[float, float],
    edge_method: EdgeMethod | None,
    threshold: float | None,
    threshold_range: ThresholdRange | None,
    circle_method: CircleMethod,
    sensitivity: float,
    min_share: float,
    progress: Progress | None,
) -> StrategyResult:
    """Run one of the study's strategies or presets."""
    if strategy == "study_text":
        smooth = ndimage.median_filter(grey, 3)
        values = smooth[region]
        level = 255 * otsu_threshold(values / 255)
        circles = find_circles(
            smooth <= level,
            STUDY_RADIUS_PX,
            polarity="bright",
            sensitivity=sensitivity,
            edge_threshold=STUDY_EDGE_THRESHOLD,
            method=circle_method,
            warn=False,
        )
        circles = circles.take(inside(circles, region))
        return StrategyResult(circles.take(first_of_duplicates(circles)), None, None)
    preset = strategy == "study_dlc"
    how = EdgeCircles(
        STUDY_RADIUS_PX if preset else radius_px,
        sensitivity=sensitivity,
        method=circle_method,
        smoothed_radius_px=STUDY_SMOOTHED_RADIUS_PX if preset else None,
    )
    ranges: dict[EdgeMethod, ThresholdRange] | None = None
    if threshold_range is not None:
        ranges = {"sobel": threshold_range, "prewitt": threshold_range}
        ranges |= {"roberts": threshold_range, "canny": threshold_range}
    return run_strategy(
        grey / 255,
        region,
        "dlc" if preset else cast("StudyStrategy", strategy),
        how,
        methods=None if edge_method is None else (edge_method,),
        threshold=threshold,
        ranges=ranges,
        min_share=min_share,
        progress=progress,
    )
