"""Auto: the field around a point from colour, near infrared and edges.

The picture's channels become surfaces (`evidence`), crowns inside them give way
(`clearing`), superpixels merge into regions around the point (`regions`), and the best
straight outline of many is taken (`choice`) and carried to the picture's own pixels
(`refine`). Where its border leaves doubt, each superpixel is judged by itself (`looks`,
`ground`), and outlines are searched again that also agree with that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from geofield.errors import FieldError
from geofield.field.choice import Judge, Known, Outline, choose, search
from geofield.field.clearing import clear
from geofield.field.evidence import channels, whiten
from geofield.field.ground import Ground, Network
from geofield.field.ground import learned as learned_network
from geofield.field.looks import looks
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
from geofield.field.scoring import Curves, learned
from geofield.field.surface import Surface
from geofield.model import Scene
from geofield.model.segmentation import Segmentation

#: The search works on a picture reduced to at most this many pixels a side.
COARSE_PX = 400
#: How far from the seed open ground is looked for, pixels.
_STRAY_PX = 20
#: A border weaker than this, in units of what the field has inside, is none.
_WEAK = 1.6
#: Borders close inside are told from this strength on, as a share of the outline's own; a
#: crooked course below this share of long sides.
_RIVAL, _CROOKED = 0.75, 0.8
#: Below this certainty the ground is asked, too.
SECOND_OPINION = 0.6
#: How bold beliefs are in the first and in the second opinion: best on sites left out.
_FIRST_BOLDNESS, _SECOND_BOLDNESS = 1.0, 2.0
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
    ready = prepared(scene, factor, seed)
    chosen = opinion(ready, learned())
    if chosen is None:
        # Nothing stands out of anything: one surface fills the picture.
        return Segmentation(scene.valid, ("no border was found anywhere",), (("certainty", 0.0),))
    if chosen.certainty < SECOND_OPINION:
        chosen = opinion(ready, learned(ground=True), learned_network()) or chosen
    mask = carried(scene, chosen.outline.polygon, factor, seed)
    things = plump(chosen.outline.region.holes | ready.surface.things)
    holes = inner(enlarged(things, factor, mask.shape), mask)
    notes, figures = _evidence(chosen)
    if ready.seed_px != seed:
        notes = ("the point lies on something small (a tree, a hut, a track?)", *notes)
    return Segmentation(mask & ~holes & scene.valid, notes, figures)


def reduction(scene: Scene) -> int:
    """How many of the scene's pixels along one of the picture that is searched."""
    return max(1, math.ceil(max(scene.grid.shape) / COARSE_PX))


@dataclass(frozen=True, eq=False)
class Prepared:
    """What a search needs.

    Attributes
    ----------
    surface : Surface
    second : Partition
        Of another look at the same picture.
    regions : list of Region
        Around the seed, of both partitions.
    raw : float32 array (channels, rows, columns)
        The channels as they are.
    seed_px : (float, float)
        Open ground at the seed or beside it, pixel coordinates of the surface.
    known : Known
        What was measured on the surface so far, see `Judge`.
    """

    surface: Surface
    second: Partition
    regions: list[Region]
    raw: NDArray[np.float32]
    seed_px: tuple[float, float]
    known: Known = field(default_factory=dict)

    @cached_property
    def looks(self) -> NDArray[np.float64]:
        """What each superpixel shows, (superpixels, looks)."""
        return looks(self.surface, self.second, self.raw, self.seed_px)


def prepared(scene: Scene, factor: int, seed_px: tuple[float, float]) -> Prepared:
    """A scene made ready for the search.

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
    open_px = footing(surface.parted, things, seed_px)
    # Another look: nothing painted over, and colour alone where there is near infrared.
    second = partition(whitened if len(raw) < 4 else whiten(raw[:3], seed_px))
    found = [*regions(surface.parted, open_px), *regions(second, open_px)]
    return Prepared(surface, second, found, raw, open_px)


@dataclass(frozen=True, eq=False)
class Opinion:
    """An outline, the overlap with the truth that it may expect, how certain a good one is."""

    outline: Outline
    expected: float
    certainty: float


def opinion(ready: Prepared, curves: Curves, network: Network | None = None) -> Opinion | None:
    """The outline that curves choose, where a network is given with it; None without any."""
    ground = None if network is None else Ground(ready.surface, ready.looks, network)
    judge = Judge(ready.surface, curves, ground, ready.known)
    outlines, score = search(judge, ready.regions, ready.seed_px)
    if not outlines:
        return None
    boldness = _FIRST_BOLDNESS if network is None else _SECOND_BOLDNESS
    best, expected = choose([one.polygon for one in outlines], score, boldness)
    return Opinion(outlines[best], expected, curves.certainty(expected, outlines[best].figures))


def footing(
    parted: Partition, things: NDArray[np.bool_], seed_px: tuple[float, float]
) -> tuple[float, float]:
    """The seed, or the nearest place on open ground where it is on a crown or the like.

    That is ground of the surface which the crown stands in, where it is known: beyond a border
    nearby there is other ground.
    """
    labels, tree = parted.labels, parted.tree
    x, y = int(seed_px[0]), int(seed_px[1])
    smallest = max(SMALLEST_PX, SMALLEST_SHARE * labels.size)
    around = tree.surface_around(int(labels[y, x]), smallest)
    if around is None and not things[y, x]:
        return seed_px
    top, left = max(y - _STRAY_PX, 0), max(x - _STRAY_PX, 0)
    near = (slice(top, y + _STRAY_PX + 1), slice(left, x + _STRAY_PX + 1))
    leaves = np.unique(labels[near])
    specks = [leaf for leaf in leaves if tree.surface_around(int(leaf), smallest) is not None]
    free = ~np.isin(labels[near], specks) & ~things[near]
    row, column = np.indices(free.shape)
    distance = np.hypot(row + top - y, column + left - x)
    if around is not None:
        own = free & np.isin(labels[near], tree.leaves(around))
        free = own if own.any() else free
    if not free.any():
        return seed_px
    down, right = np.unravel_index(np.argmin(np.where(free, distance, np.inf)), free.shape)
    return (float(left + right) + 0.5, float(top + down) + 0.5)


def _evidence(found: Opinion) -> tuple[tuple[str, ...], tuple[tuple[str, float], ...]]:
    chosen, certain = found.outline, found.certainty
    contrast = math.exp(chosen.figure("strength_50_above_inside"))
    weakest = math.exp(chosen.figure("strength_25_above_inside"))
    notes = []
    if contrast < _WEAK:
        notes.append("its border hardly differs from what lies inside")
    elif weakest < _WEAK:
        notes.append("a quarter of its border or more is weak")
    if math.exp(chosen.figure("inside_95_above_border")) > _RIVAL:
        notes.append("borders close inside it are nearly as strong as its own")
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
