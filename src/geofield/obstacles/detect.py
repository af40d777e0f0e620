"""Stage 3 from a scene to a table of obstacles."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
import shapely

from geofield import schema
from geofield.errors import (
    FARTHEST_M,
    FieldError,
    ImageryError,
    ObstacleError,
    refuse_no_number,
    refuse_other,
    refuse_unknown,
)
from geofield.grid import Grid
from geofield.methods import STUDY_STRATEGIES, Strategy, method
from geofield.model.circles import checked_range
from geofield.model.field import MAKE_ONE, Field
from geofield.model.obstacles import from_circles_px, from_polygons
from geofield.model.scene import OPEN_IT, Scene
from geofield.model.upright import Turn
from geofield.obstacles.costs import thresholds
from geofield.obstacles.default import Found, Polarity, Progress, detect_by_default
from geofield.obstacles.picture import Picture, search_region

if TYPE_CHECKING:
    import geopandas as gpd

    from geofield.study.detectors import GreyCheck
    from geofield.study.edges import EdgeMethod
    from geofield.study.phase_code import CircleMethod
    from geofield.study.strategies import ThresholdRange

RADIUS_M = (1.0, 15.0)
STUDY_RADIUS_M = (2.0, 9.0)
STRATEGIES: tuple[Strategy, ...] = get_args(Strategy)


def detect_obstacles(
    scene: Picture,
    field: Field | None = None,
    *,
    strategy: Strategy = "auto",
    radius_m: tuple[float, float] | None = None,
    buffer_m: float = 1.5,
    polarity: Polarity = "both",
    cost_missed: float = 30.0,
    careful: bool = False,
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

    >>> scene = gf.read_scene("sample_data/field_1.tif")
    >>> field = gf.read_plan("sample_data/field_1.gpkg").field
    >>> len(gf.detect_obstacles(scene, field)) > 10
    True

    Parameters
    ----------
    scene : Scene or reader
        A reader (`geofield.imagery.SceneReader`) is read window by window by ``auto``, so that
        pictures of any size fit into memory; the study's strategies read all of it.
    field : Field, optional
        Only obstacles that reach over its outer ring are returned, a crown that leans in
        from outside too; holes do not count, since a tree that the outline was cut around
        still stands in the way. The study's strategies ask for the centre inside. The
        whole scene when not given.
    strategy : str
        One of :data:`STRATEGIES`.
    radius_m : (low, high)
        Radii to look for, metres on the ground, up to 1000; 1 to 15 for ``auto``, 2 to 9 for
        the study's strategies by default.
    buffer_m : float
        Safety margin added around each footprint, metres, up to 1000.
    polarity : {"dark", "bright", "both"}
        ``auto``: keep only crowns that are darker, or brighter, than their surroundings.
    cost_missed : float
        ``auto``: what driving into a thing costs, against a look at one place of the map. It
        decides from which confidence a thing is `detected`, and from which it is `possible`:
        :func:`geofield.obstacles.costs.thresholds`.
    careful : bool
        ``auto``: drive around what is possible, too: it becomes `detected`.
    min_confidence : float, optional
        ``auto``: the confidence from which a thing is `detected`, instead of the one that
        follows from the cost.
    others : bool
        ``auto`` in a field: also return what stands there and is no tree, as polygons of
        kind `other`.
    edge_method : str, optional
        Edge method of the study's strategies; see :mod:`geofield.study.strategies`.
    threshold : float, optional
        Edge threshold of ``single``.
    threshold_range : (start, stop, step), optional
        Thresholds of ``t_range``, ``dlc`` and ``consensus``.
    circle_method : {"phase_code", "two_stage"}
    sensitivity : float
        Of the circle search, 0..1.
    grey_check : {"none", "absolute", "relative"} or float, optional
        The study's strategies: drop discs brighter than 127.37, than the field's mean, or
        than a grey level.
    min_share : float
        ``consensus``: the share of the settings that must see a circle.
    progress : callable, optional
        Called with (done, total, what).

    Returns
    -------
    GeoDataFrame
        The layer ``obstacles`` in the metric CRS, ordered by row and column of the centre in the
        picture with north above; ``attrs["detection"]`` says how they were found.

    Raises
    ------
    ObstacleError
        For an impossible radius range, margin, strategy or method.
    FieldError
        When `field` is a shape without a CRS.
    ImageryError
        When `scene` is a path.
    """
    refuse_no_number(ObstacleError, "metres", buffer_m=buffer_m)
    refuse_no_number(ObstacleError, "above zero", cost_missed=cost_missed)
    refuse_no_number(ObstacleError, "0 to 1", none_too=True, min_confidence=min_confidence)
    refuse_no_number(ObstacleError, "0 to 1", sensitivity=sensitivity, min_share=min_share)
    refuse_no_number(ObstacleError, none_too=True, threshold=threshold)
    if not 0 <= buffer_m <= FARTHEST_M:
        raise ObstacleError(f"The safety margin {buffer_m:g} m is outside 0 to {FARTHEST_M:g} m.")
    if not 0 <= min_share <= 1:
        raise ObstacleError(f"The share of settings {min_share:g} is outside 0 to 1.")
    refuse_unknown(ObstacleError, "strategy", strategy, STRATEGIES)
    refuse_other(scene, Picture, "scene", OPEN_IT, ImageryError)
    refuse_other(field, Field | None, "field", MAKE_ONE, FieldError)
    usual_m = RADIUS_M if strategy == "auto" else STUDY_RADIUS_M
    low_m, high_m = checked_range(usual_m if radius_m is None else radius_m)
    if high_m > FARTHEST_M:
        raise ObstacleError(f"The largest radius, {high_m:g} m, is above {FARTHEST_M:g} m.")
    crs = scene.grid.metric_crs if field is None else field.crs
    table_of = partial(from_circles_px, grid=scene.grid, buffer_m=buffer_m, crs=crs)
    detection: dict[str, Any] = {"strategy": strategy, "radius_m": [low_m, high_m], "notes": []}
    if strategy == "auto":
        limits = thresholds(cost_missed) if min_confidence is None else _limits(min_confidence)
        detected = limits[1] if careful else limits[0]
        found = detect_by_default(
            scene,
            field,
            (low_m, high_m),
            polarity=polarity,
            least=min(limits),
            others=others,
            progress=progress,
        )
        trees = found.trees
        table = table_of(trees.x_px, trees.y_px, trees.radius_px, confidence=trees.strength)
        table = _with_others(table, found, scene.grid, buffer_m, detected)
        detection |= {"threshold": detected, "possible_from": min(limits)} | found.detection
    else:
        whole = scene if isinstance(scene, Scene) else scene.read()
        turn = Turn.upright(whole.grid)
        whole = turn.scene(whole)
        resolution = whole.grid.ground_resolution_m
        circles, share, told = method(STUDY_STRATEGIES, strategy)(
            whole,
            search_region(whole, field),
            strategy,
            (low_m / resolution, high_m / resolution),
            progress,
            edge_method=edge_method,
            threshold=threshold,
            threshold_range=threshold_range,
            circle_method=circle_method,
            sensitivity=sensitivity,
            grey_check=grey_check,
            min_share=min_share,
        )
        order = np.lexsort((circles.x_px, circles.y_px))
        share = None if share is None else share[order]
        circles = turn.circles_back(circles.take(order))
        table = table_of(circles.x_px, circles.y_px, circles.radius_px, confidence=share)
        detection |= told
    table.attrs["detection"] = detection
    return table


def _limits(min_confidence: float) -> tuple[float, float]:
    """Return the thresholds of a confidence that a person chose: nothing below is possible."""
    if not 0 <= min_confidence <= 1:
        raise ObstacleError(f"The confidence {min_confidence:g} is outside 0 to 1.")
    return min_confidence, min_confidence


def _with_others(
    table: gpd.GeoDataFrame, found: Found, grid: Grid, buffer_m: float, detected: float
) -> gpd.GeoDataFrame:
    """Trees, and what is none as polygons of kind `other`, numbered on; detected or possible."""
    import pandas as pd

    crs = table.crs
    if found.shapes:
        rows = from_polygons(
            shapely.transform(
                found.shapes, lambda px: np.column_stack(grid.to_crs(px[:, 0], px[:, 1], crs))
            ),
            crs,
            buffer_m=buffer_m,
            grid=grid,
            confidence=found.shape_confidence,
            first_no=len(table) + 1,
        )
        joined = pd.concat([table, rows]) if len(table) else rows
        table = schema.conform(schema.OBSTACLES, joined)
    unsure = table["confidence"].to_numpy(dtype="float64") < detected
    return table.assign(status=table["status"].mask(unsure, "possible"))
