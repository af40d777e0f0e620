"""The default detector on a scene or a reader: trees, then what is not round."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import shapely

from geofield.errors import ObstacleError, ObstacleWarning
from geofield.model.circles import Circles
from geofield.model.field import Field
from geofield.obstacles.auto import WORKING_RESOLUTION_M, picture_channels
from geofield.obstacles.shapes import footprints
from geofield.obstacles.verifier import FloatArray, load_verifier
from geofield.obstacles.windows import (
    Picture,
    Polarity,
    Progress,
    detect_trees,
    overview,
    part_of,
    search_region,
    variant_of,
)
from geofield.obstacles.working import working_factor, working_picture

MIN_RADIUS_PX = 2.0
MAX_SHAPES_MPX = 25.0
"""Fields larger than this (working megapixels) are not searched for polygons."""

_BELOW, _ABOVE = 0.6, 1.4
"""A crown measured this far outside the range of radii is still the tree asked for."""


def detect_by_default(
    picture: Picture,
    field: Field | None,
    radius_m: tuple[float, float],
    *,
    polarity: Polarity,
    min_confidence: float | None,
    others: bool,
    progress: Progress | None,
) -> tuple[Circles, list[shapely.Polygon], dict[str, Any]]:
    """Run the default detector.

    Returns
    -------
    circles : Circles
        Pixel-index coordinates of the scene; the strength is the confidence.
    shapes : list of Polygon
        Pixel coordinates, the corner of the top-left pixel as origin.
    detection : dict
        Method, threshold and notes.

    Raises
    ------
    ObstacleError
        For an unknown polarity or a confidence outside 0 to 1.
    """
    if polarity not in ("dark", "bright", "both"):
        raise ObstacleError(f"Unknown polarity {polarity!r}.", hint="Choose dark, bright or both.")
    if min_confidence is not None and not 0 <= min_confidence <= 1:
        raise ObstacleError(f"The confidence {min_confidence:g} is outside 0 to 1.")
    notes: list[str] = []
    small = overview(picture)
    variant = variant_of(small)
    verifier = load_verifier(variant)
    least = verifier.threshold if min_confidence is None else min_confidence
    resolution = picture.grid.ground_resolution_m
    if radius_m[0] / resolution < MIN_RADIUS_PX:
        message = (
            f"The picture is coarse ({resolution:.2f} m per pixel) for radii from "
            f"{radius_m[0]:g} m: small trees span too few pixels to be seen."
        )
        notes.append(message)
        warnings.warn(message, ObstacleWarning, stacklevel=4)
    factor = working_factor(resolution, WORKING_RESOLUTION_M)
    if factor != 1.0:
        notes.append(f"Resampled from {resolution:.2f} m to {resolution * factor:.2f} m per pixel.")
    trees = detect_trees(
        picture,
        field,
        verifier,
        factor=factor,
        min_confidence=least,
        polarity=polarity,
        scaling=small.scaling,
        progress=progress,
    )
    measured_m = trees.radius_px * resolution
    keep = (measured_m >= _BELOW * radius_m[0]) & (measured_m <= _ABOVE * radius_m[1])
    radius = np.clip(measured_m, *radius_m) / resolution
    found = Circles(trees.x_px, trees.y_px, radius, trees.confidence).take(keep)
    shapes: list[shapely.Polygon] = []
    if others and field is not None:
        shapes = _others(picture, field, found, factor, small.scaling, notes)
    return found, shapes, {"method": f"evidence_{variant}", "threshold": least, "notes": notes}


def _others(
    picture: Picture,
    field: Field,
    trees: Circles,
    factor: float,
    scaling: tuple[float, float] | None,
    notes: list[str],
) -> list[shapely.Polygon]:
    """Return footprints of what is in the field and not round."""
    grid = picture.grid
    left, top, right, bottom = field.polygon_px(grid).bounds
    margin = 8
    c0, r0 = max(int(left) - margin, 0), max(int(top) - margin, 0)
    width = min(int(right) + margin, grid.width_px) - c0
    height = min(int(bottom) + margin, grid.height_px) - r0
    if width < 1 or height < 1:
        return []
    if width * height / factor**2 > MAX_SHAPES_MPX * 1e6:
        notes.append("The field is too large to search it for what is not round.")
        return []
    part = part_of(picture, (c0, r0, width, height), scaling)
    working = working_picture(part, search_region(part, field), factor)
    found = picture_channels(working.luma, working.rgb, working.nir)
    near = Circles(
        (trees.x_px - c0 + 0.5) / factor - 0.5,
        (trees.y_px - r0 + 0.5) / factor - 0.5,
        trees.radius_px / factor,
        trees.strength,
    )

    def to_scene(c: FloatArray) -> FloatArray:
        return np.asarray(c * factor + np.array([c0, r0]), dtype=np.float64)

    polygons = footprints(found, working.region, near, grid.ground_resolution_m * factor)
    return [shapely.transform(polygon, to_scene) for polygon in polygons]
