"""Auto: the field around a point from colour, near infrared and edges.

The picture's channels become surfaces (`evidence`), crowns inside them give way
(`clearing`), superpixels merge into regions around the point (`regions`), and the best
straight outline of many is taken (`choice`) and carried to the picture's own pixels
(`refine`).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from geofield.errors import FieldError
from geofield.field.choice import Outline, choose, search
from geofield.field.clearing import clear
from geofield.field.evidence import channels, whiten
from geofield.field.morphology import inner, plump
from geofield.field.refine import carried, enlarged
from geofield.field.regions import (
    SMALLEST_PX,
    SMALLEST_SHARE,
    Partition,
    Region,
    partition,
    regions,
)
from geofield.field.scoring import learned
from geofield.field.segmentation import Segmentation
from geofield.field.surface import Surface
from geofield.model import Scene

#: The search works on a picture reduced to at most this many pixels a side.
COARSE_PX = 400
#: How far from the seed open ground is looked for, pixels.
_STRAY_PX = 20
#: A border weaker than this, in units of what the field has inside, is none.
_WEAK = 1.6
#: Borders close inside are told from this strength on, as a share of the outline's own; a
#: crooked course below this share of long sides.
_RIVAL, _CROOKED = 0.75, 0.8
#: Below this certainty the doubt is told.
_LIKELY = 0.7


def segment(scene: Scene, x_px: float, y_px: float) -> Segmentation:
    """The field around a pixel position.

    Parameters
    ----------
    scene : Scene
    x_px, y_px : float
        The seed, pixel coordinates.
    """
    factor = reduction(scene)
    seed = (x_px / factor, y_px / factor)
    surface, found, ground = prepared(scene, factor, seed)
    outlines, score = search(surface, found, ground)
    if not outlines:
        # Nothing stands out of anything: one surface fills the picture.
        return Segmentation(scene.valid, ("no border was found anywhere",), (("certainty", 0.0),))
    best, expected = choose([one.polygon for one in outlines], score)
    chosen = outlines[best]
    certain = learned().certainty(expected, chosen.figures)
    mask = carried(scene, chosen.polygon, factor, seed)
    things = plump(chosen.region.holes | surface.things)
    holes = inner(enlarged(things, factor, mask.shape), mask)
    notes, figures = _evidence(chosen, certain)
    if ground != seed:
        notes = ("the point lies on something small (a tree, a hut, a track?)", *notes)
    return Segmentation(mask & ~holes & scene.valid, notes, figures)


def reduction(scene: Scene) -> int:
    """How many of the scene's pixels along one of the picture that is searched."""
    return max(1, math.ceil(max(scene.grid.shape) / COARSE_PX))


def prepared(
    scene: Scene, factor: int, seed_px: tuple[float, float]
) -> tuple[Surface, list[Region], tuple[float, float]]:
    """What the search needs: the surface, the regions around the seed, the open ground there.

    Parameters
    ----------
    scene : Scene
    factor : int
        See `reduction`.
    seed_px : (float, float)
        The point, pixel coordinates of the reduced picture.

    Raises
    ------
    FieldError
        When the picture is too small.
    """
    raw = channels(scene, factor)
    whitened = whiten(raw, seed_px)
    stack, things = clear(whitened, scene.grid.ground_resolution_m * factor)
    surface = Surface(stack, partition(stack), things)
    if not len(surface.parted.lines.first):
        raise FieldError("The picture is too small to find a field in.")
    ground = footing(surface.parted, things, seed_px)
    found = regions(surface.parted, ground)
    # A second opinion: nothing painted over, and colour alone where there is near infrared.
    second = partition(whitened if len(raw) < 4 else whiten(raw[:3], seed_px))
    return surface, [*found, *regions(second, ground)], ground


def footing(
    parted: Partition, things: NDArray[np.bool_], seed_px: tuple[float, float]
) -> tuple[float, float]:
    """The seed, or the nearest place on open ground where it is on a crown or the like."""
    labels, tree = parted.labels, parted.tree
    x, y = int(seed_px[0]), int(seed_px[1])
    smallest = max(SMALLEST_PX, SMALLEST_SHARE * labels.size)
    specks: dict[int, bool] = {}

    def on_speck(row: int, column: int) -> bool:
        if things[row, column]:
            return True
        leaf = int(labels[row, column])
        if leaf not in specks:
            specks[leaf] = tree.is_speck(leaf, smallest)
        return specks[leaf]

    if not on_speck(y, x):
        return seed_px
    top, left = max(y - _STRAY_PX, 0), max(x - _STRAY_PX, 0)
    near = labels[top : y + _STRAY_PX + 1, left : x + _STRAY_PX + 1]
    row, column = np.indices(near.shape)
    distance = np.hypot(row + top - y, column + left - x).ravel()
    for place in np.argsort(distance, kind="stable"):
        down, right = divmod(int(place), near.shape[1])
        if not on_speck(top + down, left + right):
            return (left + right + 0.5, top + down + 0.5)
    return seed_px


def _evidence(
    chosen: Outline, certain: float
) -> tuple[tuple[str, ...], tuple[tuple[str, float], ...]]:
    contrast = math.exp(chosen.figure("strength_50_above_inside"))
    weakest = math.exp(chosen.figure("strength_25_above_inside"))
    notes = []
    if contrast < _WEAK:
        notes.append("its border hardly differs from what lies inside")
    elif weakest < _WEAK:
        notes.append("a quarter of its border or more is weak")
    if math.exp(chosen.figure("inside_95_above_border")) > _RIVAL:
        notes.append("borders close inside it are as strong as its own")
    if chosen.figure("long_sides_share") < _CROOKED:
        notes.append("much of its course is crooked")
    if certain < _LIKELY:
        other = "as likely" if certain < 0.5 else "possible"
        notes.append(f"other outlines are {other} (certainty {certain:.0%})")
    return tuple(notes), (
        ("certainty", certain),
        ("border_contrast", contrast),
        ("weakest_quarter", weakest),
        ("straightness", chosen.figure("long_sides_share")),
    )
