"""Large pictures: overlapping windows, each measured alone.

Everything that is measured at a candidate comes from less than the overlap around it, and
windows start at multiples of the coarsest grid used inside, so that a window gives the same
figures as the whole picture away from the picture's own borders. A window decides over its
overlap too but keeps its core, so neighbours agree on what lies at their common border.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geofield.model.scene import Scene
from geofield.obstacles.auto import (
    Trees,
    decide,
    measure,
    picture_channels,
)
from geofield.obstacles.channels import Variant
from geofield.obstacles.verifier import FloatArray, Verifier, strongest
from geofield.obstacles.working import working_picture

Progress = Callable[[int, int, str], None]
CORE_PX = 1024
"""Side of a window without its overlap, working pixels."""
OVERLAP_PX = 128
"""More than twice the window of the background median and its deviation."""
_ALIGN_PX = 16


@dataclass(frozen=True, slots=True)
class Window:
    """A part of the scene: what is read, and the core whose candidates count (scene pixels)."""

    col: int
    row: int
    width: int
    height: int
    core: tuple[float, float, float, float]


def variant_of(scene: Scene) -> Variant:
    """Return which verifier a scene's bands allow."""
    if not scene.is_colour:
        return "grey"
    return "nir" if scene.nir is not None else "rgb"


def windows_over(
    region: NDArray[np.bool_], factor: float, core_px: int = CORE_PX, overlap_px: int = OVERLAP_PX
) -> Iterator[Window]:
    """Yield windows that cover the region, aligned to the working grid of the whole scene.

    Windows without any pixel of the region are left out.
    """
    rows, cols = region.shape
    step = core_px * factor
    # A whole number of scene pixels and of working blocks, where the factor allows it.
    for j in range(max(int(np.ceil(rows / step)), 1)):
        for i in range(max(int(np.ceil(cols / step)), 1)):
            x0, x1 = i * step, min((i + 1) * step, cols)
            y0, y1 = j * step, min((j + 1) * step, rows)
            if not region[int(y0) : int(np.ceil(y1)), int(x0) : int(np.ceil(x1))].any():
                continue
            c0 = _aligned(x0 / factor - overlap_px, factor)
            r0 = _aligned(y0 / factor - overlap_px, factor)
            c1 = min(int(np.ceil(x1 + overlap_px * factor)), cols)
            r1 = min(int(np.ceil(y1 + overlap_px * factor)), rows)
            yield Window(c0, r0, c1 - c0, r1 - r0, (x0, y0, x1, y1))


def _aligned(start_px: float, factor: float) -> int:
    """Return a start (working pixels) as scene pixels, on a block of the coarsest grid."""
    block = max(int(np.floor(start_px / _ALIGN_PX)), 0) * _ALIGN_PX
    return round(block * factor)


def detect_trees(
    scene: Scene,
    region: NDArray[np.bool_],
    verifier: Verifier,
    *,
    factor: float,
    min_confidence: float,
    core_px: int = CORE_PX,
    progress: Progress | None = None,
) -> Trees:
    """Find the trees of a scene window by window.

    Parameters
    ----------
    scene : Scene
    region : bool array (rows, cols)
        Where a centre may lie.
    verifier : Verifier
    factor : float
        Scene pixels per working pixel.
    min_confidence : float
    core_px : int
        Side of a window without overlap, working pixels.
    progress : callable, optional

    Returns
    -------
    Trees
        Positions and radii in pixel-index coordinates of the scene.
    """
    parts: list[FloatArray] = []
    todo = list(windows_over(region, factor, core_px))
    for done, window in enumerate(todo):
        part = scene.crop(window.col, window.row, window.width, window.height)
        rows = slice(window.row, window.row + window.height)
        cols = slice(window.col, window.col + window.width)
        picture = working_picture(part, region[rows, cols], factor)
        found = picture_channels(picture.luma, picture.rgb, picture.nir)
        trees = decide(measure(found, verifier, picture.region), verifier, min_confidence)
        x = picture.to_scene_px(trees.x_px) + window.col
        y = picture.to_scene_px(trees.y_px) + window.row
        x0, y0, x1, y1 = window.core
        own = (x >= x0) & (x < x1) & (y >= y0) & (y < y1)
        columns = (
            x - 0.5,
            y - 0.5,
            trees.radius_px * factor,
            trees.confidence,
            trees.reach_px * factor,
        )
        parts.append(np.column_stack(columns)[own])
        if progress is not None:
            progress(done + 1, len(todo), "obstacles")
    table = np.concatenate(parts) if parts else np.empty((0, 5))
    x, y, radius, confidence, reach = table.T
    # Two windows may see one tree on different sides of their common border.
    keep = strongest(x, y, confidence, 0.5 * reach)
    return Trees(x[keep], y[keep], radius[keep], confidence[keep], reach[keep])
