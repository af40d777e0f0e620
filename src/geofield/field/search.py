"""Search: possible outlines around the points, each with its score; kept for further points.

The regions around the points become straight outlines, the best of them redrawn along their own
straight sides. What the points say is obeyed by every outline. What was measured is kept, so
that a further point costs the network's answer to it and a few new outlines: it corrects what was
found before it, and what was right there should stay.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon

from geofield.errors import FieldError
from geofield.field.answer import network_outlines
from geofield.field.border import measure
from geofield.field.clearing import clear
from geofield.field.evidence import channels, whiten
from geofield.field.frame import Frame
from geofield.field.learned import Learned, shipped
from geofield.field.looks import Seen, seen
from geofield.field.mend import mended
from geofield.field.outline import rough_outline, straight_outline
from geofield.field.points import EXACT_PX, drawn, obeys
from geofield.field.ranking import SAME_GROUND, WEIGHED, Figures
from geofield.field.regions import (
    SMALLEST_PX,
    SMALLEST_SHARE,
    Partition,
    Points,
    partition,
    regions,
)
from geofield.field.said import Said
from geofield.field.straight import redrawn, ring
from geofield.field.surface import Surface
from geofield.model import Scene

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

#: The search works on a picture reduced to at most this many pixels a side.
COARSE_PX = 400
#: How far from the seed open ground is looked for, pixels.
_STRAY_PX = 20
#: How far the first outlines may leave their regions' borders, pixels.
_TOLERANCE_PX = 3.0
_TOLERANCES_PX = _TOLERANCE_PX, EXACT_PX
#: So many of the regions' outlines get well fitted sides; so many are redrawn, so many times.
_FITTED, _BREADTH, _ROUNDS = 5, 4, 2
#: So many times the most exact one is redrawn once more.
_POLISHED = 2
#: Outlines that overlap more than this are alike.
_ALIKE = 0.95
#: So many earlier outlines are mended at new points.
_MENDED = 4
#: Of what an outline suggests, so many that agree best with the network are measured.
_SUGGESTED = 12


@dataclass(frozen=True, eq=False)
class Candidate:
    """A possible outline of the field.

    Attributes
    ----------
    polygon : Polygon
        Pixel coordinates of the searched picture; no holes.
    holes : bool array
        What was filled in the region that it began as.
    figures : mapping
        What was measured on it, by name.
    score : float
        Only differences mean something.
    """

    polygon: Polygon
    holes: BoolArray
    figures: Figures
    score: float


@dataclass(frozen=True, eq=False)
class Held:
    """What is known of an outline without the points; figures are None for a scrap."""

    polygon: Polygon
    holes: BoolArray
    inside: BoolArray
    figures: Figures | None


@dataclass(frozen=True, eq=False)
class WindowSearch:
    """A scene made ready for outlines around a seed, and what was measured so far.

    It can be pickled, and asked again with further points.

    Attributes
    ----------
    factor : int
        Pixels of the scene along one of the searched picture.
    surface : Surface
    second : Partition
        Of another look at the same picture.
    seen : Seen
    seed_px : (float, float)
        Open ground at the seed or beside it, pixel coordinates of the searched picture.
    moved : bool
        Whether the seed itself lies on something small: a crown, a hut.
    learned : Learned
        The network and the ranking that are asked.
    known : dict
        What was measured, by outline.
    taken : dict
        The best outlines of each question, by its points.
    answered : dict
        The last question and its candidates.
    """

    factor: int
    surface: Surface
    second: Partition
    seen: Seen
    seed_px: tuple[float, float]
    moved: bool
    learned: Learned = field(default_factory=shipped)
    known: dict[Polygon, Held] = field(default_factory=dict)
    taken: dict[tuple[Points, Points], list[Polygon]] = field(default_factory=dict)
    answered: dict[tuple[Points, Points], list[Candidate]] = field(default_factory=dict)

    def place(self, x_px: float, y_px: float) -> tuple[float, float]:
        """Pixel coordinates of the scene in the searched picture."""
        return x_px / self.factor, y_px / self.factor

    def likely(self, include: Points = (), exclude: Points = ()) -> NDArray[np.float32]:
        """How likely each pixel of the searched picture belongs to the field."""
        include = (self.seed_px, *include)
        frame = self.surface.frame
        likely = self.seen.probability(
            include, exclude, frame.shape, self.factor, self.learned.network
        )
        return likely if frame.inside is None else likely * frame.inside

    def candidates(self, include: Points = (), exclude: Points = ()) -> list[Candidate]:
        """Outlines that obey the points, the best first; none where nothing stands out.

        Where none can, for two points of both kinds share a pixel of the reduced picture, those
        found without the last point: they are cut at full size.

        Parameters
        ----------
        include, exclude : tuple of (float, float)
            Further points that belong and that do not, pixel coordinates of the searched
            picture.
        """
        if (include, exclude) in self.answered:
            return self.answered[include, exclude]
        shorter = _shorter(include, exclude)
        found = self._found(include, exclude, self._before(shorter))
        ranked = best_first(found)
        if found:
            self.taken[include, exclude] = list(dict.fromkeys([self._most_exact(found), ranked[0]]))
        elif shorter:
            return self.candidates(*shorter[0])
        self.answered.clear()
        self.answered[include, exclude] = [found[polygon] for polygon in ranked]
        return self.answered[include, exclude]

    def _found(
        self, include: Points, exclude: Points, before: Sequence[Polygon]
    ) -> dict[Polygon, Candidate]:
        """Outlines that obey the points, after some that were taken without the last one."""
        likely = self.likely(include, exclude)
        points = (self.seed_px, *include), exclude
        ground = self.surface.parted.mean(likely)
        said = Said(
            ground,
            self.surface.size_px,
            likely,
            (*include, *exclude),
            self.known[before[0]].inside if before else None,
        )
        earlier = self._earlier(said) if include or exclude else []
        found: dict[Polygon, Candidate] = {}

        def add(outlines: Mapping[Polygon, BoolArray]) -> None:
            """Outlines with what was filled in them: those that obey the points get scores."""
            new = [polygon for polygon in outlines if polygon not in found]
            obeying = np.array(new)[obeys(np.array(new), *points)] if new else ()
            held = [self._held(polygon, outlines[polygon]) for polygon in obeying]
            for one, figures, score in self._scored(held, said):
                found[one.polygon] = Candidate(one.polygon, one.holes, figures, score)

        add({polygon: one.holes for polygon, one in self.known.items()})
        second = self.second.mean(likely)
        around = [
            *regions(self.surface.parted, ground, *points, earlier),
            *regions(self.second, second, *points),
        ]
        rough = {
            drawn(partial(rough_outline, one.mask), _TOLERANCES_PX, *points): one for one in around
        }
        add({polygon: one.holes for polygon, one in rough.items()})
        fitted = {}
        for polygon in self._different([one for one in best_first(found) if one in rough], _FITTED):
            with suppress(FieldError):
                outline = straight_outline(rough[polygon].mask, tolerance_px=_TOLERANCE_PX)
                fitted[Polygon(outline.exterior)] = rough[polygon].holes
        add(fitted)
        add(network_outlines(likely, self.seed_px))
        for polygon in before:
            changed = mended(polygon, *points, self.surface.frame)
            add(dict.fromkeys(changed, self.known[polygon].holes))
        tried: set[Polygon] = set()

        def redraw(best: Iterable[Polygon]) -> None:
            """Add what the best suggest, unless they were asked before."""
            for polygon in [one for one in best if one not in tried]:
                tried.add(polygon)
                others = redrawn(polygon, self.seed_px, self.surface.frame)
                add(dict.fromkeys(self._agreeing(others, ground), found[polygon].holes))

        for _ in range(_ROUNDS):
            redraw(self._different(best_first(found), _BREADTH))
        for _ in range(_POLISHED if found else 0):
            redraw([self._most_exact(found)])
        return found

    def _before(self, shorter: Sequence[tuple[Points, Points]]) -> list[Polygon]:
        """What was taken before the last of the points; none without points."""
        if not shorter:
            return []
        asked = next((one for one in shorter if one in self.taken), shorter[0])
        if asked not in self.taken:
            self.candidates(*asked)
        return self.taken.get(asked, [])

    def _most_exact(self, found: Mapping[Polygon, Candidate]) -> Polygon:
        """Of the outlines that hold much the same ground as the best, the most exact one."""
        size = self.surface.size_px
        ranked = best_first(found)[:WEIGHED]
        inside = np.array([self.known[polygon].inside for polygon in ranked])
        common = inside @ (size * inside[0])
        alike = common >= SAME_GROUND * (inside @ size + size @ inside[0] - common)
        figures = [found[polygon].figures for polygon in ranked]
        exactness = self.learned.ranking.exactness(figures)
        return ranked[int(np.argmax(np.where(alike, exactness, -np.inf)))]

    def _scored(self, held: Sequence[Held], said: Said) -> Iterator[tuple[Held, Figures, float]]:
        """Outlines that are no scraps, with all their figures and their scores."""
        some = [one for one in held if one.figures is not None]
        if not some:
            return
        told = said.figures([one.polygon for one in some], [one.inside for one in some])
        figures = [{**(one.figures or {}), **more} for one, more in zip(some, told, strict=True)]
        scores = self.learned.ranking.scores(figures).tolist()
        yield from zip(some, figures, scores, strict=True)

    def _earlier(self, said: Said) -> list[BoolArray]:
        """The best of what is known, also where it does not obey the points."""
        scored = self._scored(list(self.known.values()), said)
        ranked = sorted(((one.inside, score) for one, _, score in scored), key=lambda one: -one[1])
        return [inside for inside, _ in ranked[:_MENDED]]

    def _different(self, ranked: Sequence[Polygon], most: int) -> list[Polygon]:
        """The first outlines that hold different ground: each gets its well drawn sides."""
        size = self.surface.size_px
        chosen: list[Polygon] = []
        grounds: list[BoolArray] = []
        for polygon in ranked:
            inside = self.known[polygon].inside
            if all(size @ (inside & one) < _ALIKE * (size @ (inside | one)) for one in grounds):
                chosen.append(polygon)
                grounds.append(inside)
            if len(chosen) == most:
                break
        return chosen

    def _agreeing(self, polygons: Sequence[Polygon], ground: FloatArray) -> list[Polygon]:
        """Of many outlines those that agree best with the network: measuring takes longer."""
        if len(polygons) <= _SUGGESTED:
            return list(polygons)
        size = self.surface.size_px
        inside = np.array([self.surface.members(ring(one)) for one in polygons])
        common, area = inside @ (size * ground), inside @ size
        overlap = common / (area + float(size @ ground) - common)
        return [polygons[at] for at in np.argsort(-overlap, kind="stable")[:_SUGGESTED]]

    def _held(self, polygon: Polygon, holes: BoolArray) -> Held:
        """What is known of an outline; it is measured once."""
        if polygon not in self.known:
            inside = self.surface.members(ring(polygon))
            figures = measure(self.surface, polygon, inside)
            self.known[polygon] = Held(polygon, holes, inside, figures)
        return self.known[polygon]


def _shorter(include: Points, exclude: Points) -> list[tuple[Points, Points]]:
    """The points without the last one; which kind that was is not known."""
    shorter = [(include, exclude[:-1])] if exclude else []
    return [*shorter, (include[:-1], exclude)] if include else shorter


def best_first(found: Mapping[Polygon, Candidate]) -> list[Polygon]:
    """The outlines of candidates by score."""
    return sorted(found, key=lambda polygon: -found[polygon].score)


def search_field(
    scene: Scene,
    x_px: float,
    y_px: float,
    *,
    learned: Learned | None = None,
    times: int = 1,
) -> WindowSearch:
    """Make a scene ready.

    Parameters
    ----------
    scene : Scene
    x_px, y_px : float
        The seed, pixel coordinates.
    learned : Learned, optional
        The network and the ranking to ask; those of this package unless given.
    times : int
        So many pixels of the scene were made along one that it came with.

    Raises
    ------
    FieldError
        When the picture is too small.
    """
    factor = max(1, math.ceil(max(scene.grid.shape) / COARSE_PX))
    seed = (x_px / factor, y_px / factor)
    frame = Frame.of(scene, factor, seed, times)
    raw, inside = channels(scene, factor), frame.inside
    whitened = whiten(raw, seed, inside)
    stack, things = clear(whitened, scene.grid.ground_resolution_m * factor)
    surface = Surface(stack, partition(stack, inside), things, frame)
    if not len(surface.parted.lines.first):
        raise FieldError("The picture is too small to find a field in.")
    footing = open_ground(surface.parted, things, seed)
    # Another look: nothing painted over, and colour alone where there is near infrared.
    second = partition(whitened if len(raw) < 4 else whiten(raw[:3], seed, inside), inside)
    return WindowSearch(
        factor,
        surface,
        second,
        seen(scene, times),
        footing,
        footing != seed,
        learned or shipped(),
    )


def open_ground(
    parted: Partition, things: BoolArray, seed_px: tuple[float, float]
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
