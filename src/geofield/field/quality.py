"""Quality: how far an outline can be trusted, from what the picture shows along it."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from geofield.field.plausible import Look, doubts
from geofield.model import FieldQuality, Scene
from geofield.model.frame import NEAR_PX, Shown, along_edge, outside_in_words
from geofield.model.segmentation import Segmentation

BoolArray = NDArray[np.bool_]

#: A field below this is hardly one, square metres.
_SMALL_M2 = 400.0
#: A border is found to a fraction of a pixel: of larger ones that is metres.
_COARSE_M = 3.0
#: From this score on an outline is used without a warning. The score is the probability of a
#: good outline, lowered for what that probability knows nothing of. On 552 fields of sites left out
#: it alone then warns of 88 % of the outlines below .8 of overlap, and of 27 % from .88 on.
TRUSTED = 0.72


def judge(
    scene: Scene,
    look: Look,
    mask: BoolArray,
    outline_px: Polygon,
    found: Segmentation,
    seed_px: tuple[float, float],
    frame_px: Polygon,
    shown_px: Shown | None = None,
) -> FieldQuality:
    """Measure an outline against its picture.

    Parameters
    ----------
    scene : Scene
    look : Look
        Of the scene.
    mask : bool array (rows, columns)
        The field's pixels.
    outline_px : shapely.Polygon
        Its outline, pixel coordinates.
    found : Segmentation
        What the method measured and noted.
    seed_px : (float, float)
        The point, pixel coordinates.
    frame_px : shapely.Polygon
        The frame of the whole picture, of which the scene may be a part.
    shown_px : Polygon or MultiPolygon, optional
        Where the whole picture has data; all of it when not given.
    """
    pixel_m = scene.grid.ground_resolution_m
    area_m2 = outline_px.area * pixel_m**2
    strange, seen = doubts(look, mask)
    touching = edge_share(outline_px, frame_px, shown_px)
    covered = float(mask.sum()) / max(int(scene.valid.sum()), 1)
    reasons = list(found.notes)
    measured = dict(found.figures)
    score = measured.get("certainty", 1.0) - sum(costs for _, costs in strange)
    reasons.extend(words for words, _ in strange)
    if touching > 0.0:
        reasons.append(outside_in_words(touching))
    if covered > 0.95:
        reasons.append("it fills the whole picture")
        score -= 0.6
    if area_m2 < _SMALL_M2:
        reasons.append(f"it has only {area_m2:.0f} m2")
        score -= 0.6
    if pixel_m > _COARSE_M:
        reasons.append(f"the picture is coarse ({pixel_m:.3g} m per pixel): it may be metres off")
    if not outline_px.covers(shapely.Point(seed_px)):
        reasons.append("the point lies on something else (a tree, a road, a roof?)")
        # Alone it is no warning where a person has chosen the region: see `TRUSTED`.
        score -= 1.0 - TRUSTED
    score = max(0.0, score)
    if score < TRUSTED and not reasons:
        reasons.append(f"where it ends is not certain (certainty {score:.0%})")
    figures = (
        ("edge_share", touching),
        ("covered_share", covered),
        ("area_m2", area_m2),
        *seen,
        *found.figures,
    )
    return FieldQuality(score, tuple(reasons), figures, trusted=score >= TRUSTED)


def edge_share(outline_px: Polygon, frame_px: Polygon, shown_px: Shown | None) -> float:
    """Share of an outline's length that lies on the picture's edge."""
    border = outline_px.exterior
    if shown_px is not None:
        along = along_edge(outline_px, shown_px, NEAR_PX)
        return sum(line.length for line in along) / border.length
    inside = shapely.length(border.difference(frame_px.exterior.buffer(0.25)))
    return float(1.0 - inside / border.length) if border.length else 0.0
