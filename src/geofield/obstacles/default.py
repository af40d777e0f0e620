"""The default detector: a network looks at the picture window by window."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray

from geofield.errors import ObstacleError, ObstacleWarning, refuse_unknown
from geofield.learned import network
from geofield.model.circles import Circles, disc_means, inside
from geofield.model.evidence import UNSEEN
from geofield.model.field import Field
from geofield.model.upright import Turn
from geofield.notes import warn
from geofield.obstacles.crowns import (
    CELL_PX,
    NETWORK,
    OVERLAP_PX,
    answers,
    centres,
    once_each,
)
from geofield.obstacles.cut import Mask, cut_crowns, near_the_end, with_cut
from geofield.obstacles.picture import (
    WHOLE_PX,
    Picture,
    Tone,
    on_working_grid,
    part_of,
    search_region,
    tone_of,
    turned,
    working_bands,
    working_factor,
)
from geofield.obstacles.standing import StandingMap
from geofield.raster import windows

Progress = Callable[[int, int, str], None]
Polarity = Literal["dark", "bright", "both"]
FloatArray = NDArray[np.float64]

CORE_PX = 1728
"""Side of a window without its overlap, working pixels: 1024 px of 0.6 m are one."""
_CORE_PX_READ = 8192
"""The same at most in pixels of the picture: of 2 cm, 1728 working pixels are 31 000."""
_BESIDE_PX = 96
"""So far around what is in reach crowns are looked for, too, working pixels."""
_BELOW, _ABOVE = 0.6, 1.4
"""A crown measured this far outside the range of radii is still the tree asked for."""
MIN_RADIUS_PX = 1.6
"""Smaller crowns are seen by chance, in pixels of the picture."""
_HIDES_M2 = 20.0
"""Gaps of the data on more ground than this hide a tree, however large the field is."""


@dataclass(frozen=True, slots=True)
class Found:
    """What the default detector found.

    Attributes
    ----------
    trees : Circles
        Pixels of the scene, from north to south; the strength is the probability that a tree
        stands there.
    shapes : list of Polygon
        Pixels of the scene, from north to south.
    shape_confidence : float64 array
    detection : dict
        Method, thresholds, doubts and notes.
    """

    trees: Circles
    shapes: list[shapely.Polygon]
    shape_confidence: FloatArray
    detection: dict[str, Any]


def detect_by_default(
    picture: Picture,
    area: Field | None,
    radius_m: tuple[float, float],
    *,
    polarity: Polarity = "both",
    least: float = 0.0,
    others: bool = True,
    progress: Progress | None = None,
) -> Found:
    """Run the default detector; `least` is the least probability of what is returned.

    The other arguments are those of :func:`geofield.obstacles.detect_obstacles`.
    """
    refuse_unknown(ObstacleError, "polarity", polarity, ("dark", "bright", "both"))
    turn = Turn.upright(picture.grid)
    picture = turned(picture, turn)
    resolution = picture.grid.ground_resolution_m
    factor = working_factor(resolution)
    tone = tone_of(picture)
    doubts = _doubts(tone, resolution, radius_m)
    facts = network(NETWORK).facts
    ring = None if area is None else shapely.Polygon(area.polygon_px(picture.grid).exterior)
    standing = outline = None
    if others and ring is not None:
        outline = shapely.transform(ring, lambda c: c / factor)
        standing = StandingMap.over(*np.clip(outline.bounds, 0, None).tolist())
        if standing is None:
            doubts.append("The field is too large to search it for what is no tree.")
    far_px = radius_m[1] / resolution
    reach = None if ring is None else ring.buffer(far_px)
    crowns, seen_px, gaps_px = _look(
        picture, area, reach, far_px, tone, factor, polarity, standing, progress
    )
    if ring is not None:
        doubts += _unseen(ring.area, seen_px, gaps_px, resolution)
    for doubt in doubts:
        warn(doubt, ObstacleWarning)
    crowns = once_each(crowns, **facts["suppression"])
    p = calibrated(crowns.strength, facts["calibration"][tone.bands])
    shapes: list[shapely.Polygon] = []
    shape_confidence = np.empty(0)
    if standing is not None and outline is not None:
        sure = crowns.take(p >= facts["explains"])
        shapes, answers_there = standing.things(outline, sure, facts["standing"]["least"])
        shape_confidence = calibrated(np.array(answers_there), facts["standing"]["calibration"])
        likely = np.flatnonzero(shape_confidence >= least)
        middles = shapely.get_coordinates(shapely.centroid([shapes[i] for i in likely]))
        likely = likely[np.lexsort(middles.T)]
        shapes = [shapely.transform(shapes[i], lambda c: c * factor) for i in likely]
        shape_confidence = shape_confidence[likely]
    measured_m = crowns.radius_px * factor * resolution
    # A doubtful crown is measured too small, and its centre less well: its disc reaches farther.
    surest = facts["calibration"][tone.bands]["probability"][-1]
    wider_m = measured_m + facts["doubt_m"] * (1 - p / surest)
    radius = np.clip(wider_m, *radius_m) / resolution
    trees = Circles(crowns.x_px * factor, crowns.y_px * factor, radius, p)
    keep = (measured_m >= _BELOW * radius_m[0]) & (measured_m <= _ABOVE * radius_m[1])
    if ring is not None:
        shapely.prepare(ring)
        away = shapely.distance(ring, shapely.points(trees.x_px, trees.y_px))
        keep &= np.asarray(away <= trees.radius_px)
    trees = trees.take(keep & (p >= least))
    trees = trees.take(np.lexsort((trees.x_px, trees.y_px)))
    resampled = f"Resampled from {resolution:.2f} m to {resolution * factor:.2f} m per pixel."
    return Found(
        turn.circles_back(trees),
        turn.shapes_back(shapes),
        shape_confidence,
        {
            "method": f"network_{tone.bands}",
            "doubts": doubts,
            "notes": [] if factor == 1.0 else [resampled],
        },
    )


def calibrated(answer: FloatArray, curve: dict[str, list[float]]) -> FloatArray:
    """Return probabilities for the network's answers, by a rising curve of a few points."""
    return np.asarray(np.interp(answer, curve["answer"], curve["probability"]), dtype=np.float64)


def _look(
    picture: Picture,
    area: Field | None,
    reach: shapely.Polygon | None,
    far_px: float,
    tone: Tone,
    factor: float,
    polarity: Polarity,
    standing: StandingMap | None,
    progress: Progress | None,
) -> tuple[Circles, int, int]:
    """Return the candidates of all windows that are within reach, and fill the map.

    The reach and how far it is are in pixels of the picture, candidates are in working pixels.
    Told, too, is how many pixels of the area have data, and how many lie in gaps of the data.
    """
    # Stronger crowns a little farther away may be the same ones as those within reach.
    wide = None if reach is None else reach.buffer(_BESIDE_PX * factor).bounds
    core_px = min(CORE_PX, max(int(_CORE_PX_READ / factor) // WHOLE_PX, 1) * WHOLE_PX)
    todo = list(windows(picture.grid.shape, core_px, OVERLAP_PX, WHOLE_PX, factor, wide))
    if reach is not None:
        todo = [w for w in todo if reach.intersects(shapely.box(*w.core))]
    crowns, seen_px, gaps_px = Circles(), 0, 0
    for done, window in enumerate(todo):
        scene = part_of(picture, (window.col, window.row, window.width, window.height), tone)
        if scene.valid.any():
            bands = working_bands(scene, tone, factor)
            named = answers(bands)
            here = _of_polarity(centres(named), bands, polarity)
            here = here.take(inside(here.scaled(factor), scene.valid))
            start = window.col / factor, window.row / factor
            region = np.zeros(scene.valid.shape, dtype=bool)
            region[window.core_slices] = search_region(scene, area)[window.core_slices]
            if area is not None:
                ends = window.ends_at(picture.grid.shape)
                cut = _cut(bands, scene.valid, region, ends, far_px, factor, polarity)
                here = with_cut(here, cut, **network(NETWORK).facts["suppression"])
            here = here.scaled(1.0, *start)
            in_core = window.in_core(here.x_px * factor, here.y_px * factor)
            crowns = crowns.joined(here.take(in_core))
            seen_px += int(region.sum())
            if area is not None and not scene.valid.all():
                missing = area.mask(scene.grid, holes=False) & ~scene.valid
                gaps_px += int(_opened(missing)[window.core_slices].sum())
            if standing is not None:
                cells = on_working_grid(region, named["other"].shape, factor * CELL_PX)
                standing.fill(named, cells, *(round(each / CELL_PX) for each in start))
        if progress is not None:
            progress(done + 1, len(todo), "obstacles")
    return crowns, seen_px, gaps_px


def _cut(
    bands: dict[str, Any],
    valid: Mask,
    region: Mask,
    ends: tuple[bool, bool, bool, bool],
    far_px: float,
    factor: float,
    polarity: Polarity,
) -> Circles:
    """Return the crowns of a window, working pixels, that the end of the data cuts."""
    shape = bands["red"].shape
    known, field = (on_working_grid(mask, shape, factor) for mask in (valid, region))
    near = near_the_end(known, ends, far_px / factor)

    def look(wide: dict[str, Any]) -> Circles:
        return _of_polarity(centres(answers(wide)), wide, polarity)

    crowns = cut_crowns(bands, known, field, near, look)
    # The last working pixel reaches beyond the last one of the picture.
    last = (n / factor * (1 - 1e-9) for n in valid.shape[::-1])
    x, y = (np.minimum(v, most) for v, most in zip((crowns.x_px, crowns.y_px), last, strict=True))
    return Circles(x, y, crowns.radius_px, crowns.strength)


def _opened(mask: Mask) -> Mask:
    """Return what is at least three pixels wide: neither specks nor the border's own pixels."""
    kernel = np.ones((3, 3), np.uint8)
    return cv2.morphologyEx(mask.view(np.uint8), cv2.MORPH_OPEN, kernel) > 0


def _unseen(field_px: float, seen_px: int, gaps_px: int, resolution_m: float) -> list[str]:
    """The part of a field that the picture does not show, in words."""
    missing, gaps_m2 = field_px - seen_px, gaps_px * resolution_m**2
    # Along its border pixels are counted whole or not at all.
    if missing > max(0.01 * field_px, field_px**0.5):
        share = f"{missing / field_px:.0%}"
    elif gaps_m2 > _HIDES_M2:
        share = f"{gaps_m2:.0f} m2"
    else:
        return []
    return [f"{UNSEEN} {share} of the field: what stands there is not found."]


def _of_polarity(crowns: Circles, bands: dict[str, Any], polarity: Polarity) -> Circles:
    """Return the crowns, working pixels, that are dark or bright against the ring around them."""
    if polarity == "both" or not len(crowns):
        return crowns
    luma = (bands["red"] + bands["green"] + bands["blue"]) / 3
    wide = Circles(crowns.x_px, crowns.y_px, 1.6 * crowns.radius_px, crowns.strength)
    bright = disc_means(luma, crowns) > disc_means(luma, wide)
    return crowns.take(bright == (polarity == "bright"))


def _doubts(tone: Tone, resolution_m: float, radius_m: tuple[float, float]) -> list[str]:
    """What a picture does not allow, in words."""
    doubts = []
    if MIN_RADIUS_PX * resolution_m > radius_m[0]:
        doubts.append(
            f"The picture is coarse ({resolution_m:.2f} m per pixel): crowns below "
            f"{MIN_RADIUS_PX * resolution_m:.1f} m of radius are seen by chance."
        )
    if tone.is_flat:
        doubts.append(
            f"The picture has hardly any contrast ({tone.high - tone.low:.0f} of 255 grey "
            "levels): haze, or ground alone; trees may be missed."
        )
    return doubts
