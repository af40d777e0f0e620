"""Large pictures: overlapping windows, each measured alone.

Everything that is measured at a candidate comes from less than the overlap around it, and
windows start at multiples of the coarsest grid used inside, so that a window gives the same
figures as the whole picture away from the picture's own borders. Where shade falls is found
once, for the whole picture. A window decides over its overlap too but keeps its core, so
neighbours agree on what lies at their common border.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon, box

from geofield.grid import Grid
from geofield.model.circles import Circles, disc_means, inside
from geofield.model.field import Field
from geofield.model.scene import Scene
from geofield.obstacles.auto import (
    Trees,
    cheap_measures,
    decide,
    measure,
    picture_channels,
    shade_of,
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
_OVERVIEW_PX = 1024
_SHADE_PLACES = 4
_SHADE_PLACE_PX = 512
"""Where shade falls is found at so many places, working pixels."""
Polarity = Literal["dark", "bright", "both"]


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


@runtime_checkable
class PictureReader(Protocol):
    """A picture that is read window by window, for instance `geofield.imagery.SceneReader`."""

    @property
    def grid(self) -> Grid:
        """Of the whole picture."""

    def read(
        self,
        window: tuple[int, int, int, int] | None = None,
        *,
        shape_px: tuple[int, int] | None = None,
        scaling: tuple[float, float] | None = None,
    ) -> Scene:
        """Read a window (column, row, width, height)."""


Picture = Scene | PictureReader


def overview(picture: Picture) -> Scene:
    """Return a small version of a picture: its bands and, for a reader, its scaling."""
    if isinstance(picture, Scene):
        return picture
    rows, cols = picture.grid.shape
    step = max(rows, cols) / min(max(rows, cols), _OVERVIEW_PX)
    return picture.read(shape_px=(max(int(rows / step), 1), max(int(cols / step), 1)))


def part_of(
    picture: Picture, window: tuple[int, int, int, int], scaling: tuple[float, float] | None
) -> Scene:
    """Return a window (column, row, width, height) of a picture."""
    if isinstance(picture, Scene):
        return picture.crop(*window)
    return picture.read(window, scaling=scaling)


def search_region(scene: Scene, field: Field | None) -> NDArray[np.bool_]:
    """Return the pixels (rows, cols) on which an obstacle's centre may lie."""
    if field is None:
        return scene.valid
    return field.mask(scene.grid, holes=False) & scene.valid


def windows_over(
    grid: Grid,
    field: Field | None,
    factor: float,
    core_px: int = CORE_PX,
    overlap_px: int = OVERLAP_PX,
) -> Iterator[Window]:
    """Yield windows that cover the field, or the picture, aligned to the working grid.

    Windows that the field does not reach are left out.
    """
    rows, cols = grid.shape
    step = core_px * factor
    outline = None if field is None else Polygon(field.polygon_px(grid).exterior)
    for j in range(max(int(np.ceil(rows / step)), 1)):
        for i in range(max(int(np.ceil(cols / step)), 1)):
            x0, x1 = i * step, min((i + 1) * step, cols)
            y0, y1 = j * step, min((j + 1) * step, rows)
            if outline is not None and not outline.intersects(box(x0, y0, x1, y1)):
                continue
            c0 = _aligned(x0 / factor - overlap_px, factor)
            r0 = _aligned(y0 / factor - overlap_px, factor)
            c1 = min(int(np.ceil(x1 + overlap_px * factor)), cols)
            r1 = min(int(np.ceil(y1 + overlap_px * factor)), rows)
            yield Window(c0, r0, c1 - c0, r1 - r0, (x0, y0, x1, y1))


def common_shade(
    picture: Picture,
    field: Field | None,
    verifier: Verifier,
    factor: float,
    scaling: tuple[float, float] | None = None,
) -> complex:
    """Return the votes on where shade falls, from a few places whatever the windows are."""
    windows = list(windows_over(picture.grid, field, factor))
    places = [(w.col, w.row, w.width, w.height) for w in windows]
    if len(windows) > 1:
        step = max(len(windows) // _SHADE_PLACES, 1)
        places = [_middle(w.core, factor) for w in windows[step // 2 :: step][:_SHADE_PLACES]]
    votes = 0j
    for place in places:
        part = part_of(picture, place, scaling)
        working = working_picture(part, part.valid, factor)
        cheap = cheap_measures(picture_channels(working.luma, working.rgb, working.nir))
        votes += shade_of(cheap, verifier.gate.evaluate(cheap.table))
    return votes


def _middle(core: tuple[float, float, float, float], factor: float) -> tuple[int, int, int, int]:
    """Return the middle of a window's core (column, row, width, height)."""
    x0, y0, x1, y1 = core
    width = max(int(min(x1 - x0, _SHADE_PLACE_PX * factor)), 1)
    height = max(int(min(y1 - y0, _SHADE_PLACE_PX * factor)), 1)
    return int((x0 + x1 - width) / 2), int((y0 + y1 - height) / 2), width, height


def _aligned(start_px: float, factor: float) -> int:
    """Return a start (working pixels) as scene pixels, on a block of the coarsest grid."""
    block = max(int(np.floor(start_px / _ALIGN_PX)), 0) * _ALIGN_PX
    return round(block * factor)


def detect_trees(
    picture: Picture,
    field: Field | None,
    verifier: Verifier,
    *,
    factor: float,
    min_confidence: float,
    polarity: Polarity = "both",
    scaling: tuple[float, float] | None = None,
    core_px: int = CORE_PX,
    progress: Progress | None = None,
) -> Trees:
    """Find the trees of a picture window by window.

    Parameters
    ----------
    picture : Scene or PictureReader
    field : Field or None
        Only centres inside its outer ring count.
    verifier : Verifier
    factor : float
        Scene pixels per working pixel.
    min_confidence : float
    polarity : {"dark", "bright", "both"}
        Against the ring around each crown.
    scaling : (float, float), optional
        Of a reader's values.
    core_px : int
        Side of a window without overlap, working pixels.
    progress : callable, optional

    Returns
    -------
    Trees
        Positions and radii in pixel-index coordinates of the scene.
    """
    parts: list[FloatArray] = []
    todo = list(windows_over(picture.grid, field, factor, core_px))
    # One window sees for itself.
    shade = None
    if len(todo) > 1:
        shade = common_shade(picture, field, verifier, factor, scaling)
    for done, window in enumerate(todo):
        part = part_of(picture, (window.col, window.row, window.width, window.height), scaling)
        region = search_region(part, field)
        if region.any():
            parts.append(
                _in_window(part, region, window, verifier, factor, min_confidence, polarity, shade)
            )
        if progress is not None:
            progress(done + 1, len(todo), "obstacles")
    table = np.concatenate(parts) if parts else np.empty((0, 5))
    x, y, radius, confidence, reach = table.T
    # Two windows may see one tree on different sides of their common border.
    keep = strongest(x, y, confidence, 0.5 * reach)
    return Trees(x[keep], y[keep], radius[keep], confidence[keep], reach[keep])


def _in_window(
    part: Scene,
    region: NDArray[np.bool_],
    window: Window,
    verifier: Verifier,
    factor: float,
    min_confidence: float,
    polarity: Polarity,
    shade: complex | None,
) -> FloatArray:
    """Return the trees of a window's core: x, y, radius, confidence, reach."""
    picture = working_picture(part, region, factor)
    found = picture_channels(picture.luma, picture.rgb, picture.nir)
    trees = decide(measure(found, verifier, picture.region, shade), verifier, min_confidence)
    x, y = picture.to_scene_px(trees.x_px), picture.to_scene_px(trees.y_px)
    keep = np.ones(len(trees), dtype=bool)
    if polarity != "both":
        discs = Circles(trees.x_px, trees.y_px, trees.radius_px, trees.confidence)
        wide = Circles(trees.x_px, trees.y_px, 1.6 * trees.radius_px, trees.confidence)
        bright = disc_means(picture.luma, discs) > disc_means(picture.luma, wide)
        keep &= bright == (polarity == "bright")
    # The fit moves centres a little: they must still lie in the field.
    centres = Circles(x - 0.5, y - 0.5, trees.radius_px, trees.confidence)
    keep &= inside(centres, region)
    x, y = x + window.col, y + window.row
    x0, y0, x1, y1 = window.core
    keep &= (x >= x0) & (x < x1) & (y >= y0) & (y < y1)
    size = (trees.radius_px * factor, trees.confidence, trees.reach_px * factor)
    return np.column_stack((x - 0.5, y - 0.5, *size))[keep]
