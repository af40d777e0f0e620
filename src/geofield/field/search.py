"""Search: possible outlines around the points, each with its score; kept for further points.

The ground that the network takes for the field becomes straight outlines. What the points say is
obeyed by every outline. What was measured is kept, so that a further point costs the network's
answer to it and a few new outlines: it corrects what was found before it, and what was right there
should stay.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon

from geofield.errors import FieldError
from geofield.field.answer import ANSWER, doubtful, network_outlines
from geofield.field.border import measure
from geofield.field.clearing import clear
from geofield.field.evidence import channels, whiten
from geofield.field.frame import Frame, covered
from geofield.field.learned import Learned, shipped
from geofield.field.likely import Candidate, Likely, likeliest
from geofield.field.looks import Seen, seen
from geofield.field.mend import forced, mended
from geofield.field.morphology import part_at
from geofield.field.points import obeys, without_last
from geofield.field.ranking import Figures
from geofield.field.said import Said
from geofield.field.straight import ring
from geofield.model import Scene

Points = tuple[tuple[float, float], ...]
BoolArray = NDArray[np.bool_]

#: The search works on a picture reduced to at most this many pixels a side.
COARSE_PX = 400
#: How far from the seed open ground is looked for, pixels.
_STRAY_PX = 20
#: A picture of fewer pixels a side shows nothing.
_SMALLEST_PX = 6


@dataclass(frozen=True, eq=False)
class Held:
    """What is known of an outline without the points; figures are None for a scrap."""

    polygon: Polygon
    holes: BoolArray
    mask: NDArray[np.uint8]
    figures: Figures | None


@dataclass(frozen=True, eq=False)
class WindowSearch:
    """A scene made ready for outlines around a seed, and what was measured so far.

    It can be pickled, and asked again with further points.

    Attributes
    ----------
    factor : int
        Pixels of the scene along one of the searched picture.
    layers : float32 array (rows, columns, channels)
        Whitened channels of the searched picture, small things painted over.
    things : bool array (rows, columns)
        What was painted over.
    frame : Frame
        Where the searched picture ends.
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
        By the points of each question the outline that was taken, and the best by its score.
    told : dict
        The last question and what the network told of it.
    answered : dict
        The last question, its candidates, and the one that was taken.
    """

    factor: int
    layers: NDArray[np.float32]
    things: BoolArray
    frame: Frame
    seen: Seen
    seed_px: tuple[float, float]
    moved: bool
    learned: Learned = field(default_factory=shipped)
    known: dict[Polygon, Held] = field(default_factory=dict)
    taken: dict[tuple[Points, Points], list[Polygon]] = field(default_factory=dict)
    told: dict[tuple[Points, Points], NDArray[np.float32]] = field(default_factory=dict)
    answered: dict[tuple[Points, Points], tuple[list[Candidate], Likely | None]] = field(
        default_factory=dict
    )

    def place(self, x_px: float, y_px: float) -> tuple[float, float]:
        """Pixel coordinates of the scene in the searched picture."""
        return x_px / self.factor, y_px / self.factor

    def likely(self, include: Points = (), exclude: Points = ()) -> NDArray[np.float32]:
        """How likely each pixel of the searched picture belongs to the field."""
        if (include, exclude) not in self.told:
            self.told.clear()
            self.told[include, exclude] = self._likely(include, exclude)
        return self.told[include, exclude]

    def _likely(
        self, include: Points, exclude: Points, *, once: bool = False
    ) -> NDArray[np.float32]:
        points = (self.seed_px, *include), exclude
        likely = self.seen.probability(*points, self.frame.shape, self.factor, once=once)
        return likely if self.frame.inside is None else likely * self.frame.inside

    def answer(
        self, include: Points = (), exclude: Points = ()
    ) -> tuple[list[Candidate], Likely | None]:
        """Outlines that obey the points, the best first, and the one that is taken.

        None where nothing stands out. Where none can obey, for two points of both kinds share a
        pixel of the reduced picture, those found without the last point: they are cut at full size.

        Parameters
        ----------
        include, exclude : tuple of (float, float)
            Further points that belong and that do not, pixel coordinates of the searched
            picture.
        """
        asked = include, exclude
        if asked in self.answered:
            return self.answered[asked]
        shorter = without_last(*asked)
        found = self._found(*asked, self._before(shorter))
        taken = likeliest(found, self.learned.ranking) if found else None
        if taken is not None:
            best = taken.candidate.polygon, found[0].polygon
            self.taken[asked] = list(dict.fromkeys(best))
        elif shorter:
            return self.answer(*shorter[0])
        self.answered.clear()
        self.answered[asked] = found, taken
        return found, taken

    def imagined(self) -> list[Candidate]:
        """Outlines as they would be if a person spoke of the most doubtful ground, either way.

        They hold the seed alone, for nobody has spoken. On 80 fields of left-out sites the nearest
        of them and the network's own ground has .874 of the truth in common, where that has .855;
        .876 by two looks at each. Two to four places of either kind instead of one offer nothing
        nearer (150 fields).
        """
        likely = self.likely()
        holes: dict[Polygon, BoolArray] = {}
        for place, belongs in doubtful(likely, part_at(likely > ANSWER[0], *self.seed_px)):
            include, exclude = ((place,), ()) if belongs else ((), (place,))
            answer = self._likely(include, exclude, once=True)
            holes |= network_outlines(answer, self.seed_px, ANSWER)
        # Not kept: what further points find does not hang on whether this was asked.
        held = [self._measured(polygon, one) for polygon, one in holes.items()]
        some = [one for one in held if obeys(one.polygon, (self.seed_px,), ())]
        return [
            Candidate(one.polygon, one.holes, figures, score)
            for one, figures, score in self._scored(some, Said(likely))
        ]

    def _found(
        self, include: Points, exclude: Points, before: Sequence[Polygon]
    ) -> list[Candidate]:
        """Outlines that obey the points, best first, after some taken without the last one."""
        likely = self.likely(include, exclude)
        points = (self.seed_px, *include), exclude
        taken = self.known[before[0]].mask if before else None
        said = Said(likely, (*include, *exclude), taken)
        found: dict[Polygon, Candidate] = {}

        def add(outlines: Mapping[Polygon, BoolArray]) -> None:
            """Outlines with what was filled in them: those that obey the points get scores."""
            new = [polygon for polygon in outlines if polygon not in found]
            obeying = np.array(new)[obeys(np.array(new), *points)] if new else ()
            held = [self._held(polygon, outlines[polygon]) for polygon in obeying]
            for one, figures, score in self._scored(held, said):
                found[one.polygon] = Candidate(one.polygon, one.holes, figures, score)

        add({polygon: one.holes for polygon, one in self.known.items()})
        holes = network_outlines(likely, self.seed_px)
        add(holes)
        holes = {polygon: self.known[polygon].holes for polygon in before} | holes
        for polygon in holes:
            changed = mended(polygon, *points, self.frame)
            add(dict.fromkeys(changed, holes[polygon]))
        if not found:
            # A strip to a point is no field: only where nothing else obeys.
            for polygon in holes:
                add(dict.fromkeys(forced(polygon, *points), holes[polygon]))
        return sorted(found.values(), key=lambda one: -one.score)

    def _before(self, shorter: Sequence[tuple[Points, Points]]) -> list[Polygon]:
        """What was taken before the last of the points; none without points."""
        if not shorter:
            return []
        asked = next((one for one in shorter if one in self.taken), shorter[0])
        if asked not in self.taken:
            self.answer(*asked)
        return self.taken.get(asked, [])

    def _scored(self, held: Sequence[Held], said: Said) -> Iterator[tuple[Held, Figures, float]]:
        """Outlines that are no scraps, with all their figures and their scores."""
        some = [
            (one, {**one.figures, **said.figures(one.polygon, one.mask)})
            for one in held
            if one.figures is not None
        ]
        if some:
            scores = self.learned.ranking.scores([figures for _, figures in some]).tolist()
            yield from ((*one, score) for one, score in zip(some, scores, strict=True))

    def _held(self, polygon: Polygon, holes: BoolArray) -> Held:
        """What is known of an outline; it is measured once."""
        if polygon not in self.known:
            self.known[polygon] = self._measured(polygon, holes)
        return self.known[polygon]

    def _measured(self, polygon: Polygon, holes: BoolArray) -> Held:
        mask = covered(ring(polygon), self.frame.shape)
        return Held(polygon, holes, mask, measure(self.layers, polygon, self.frame))


def search_field(
    scene: Scene,
    x_px: float,
    y_px: float,
    *,
    learned: Learned | None = None,
    looks: Seen | None = None,
) -> WindowSearch:
    """Make a scene ready.

    Parameters
    ----------
    scene : Scene
    x_px, y_px : float
        The seed, pixel coordinates.
    learned : Learned, optional
        The network and the ranking to ask; those of this package unless given.
    looks : Seen, optional
        The scene as that network sees it, where it was looked at before.

    Raises
    ------
    FieldError
        When the picture is too small.
    """
    if min(scene.grid.shape) < _SMALLEST_PX:
        raise FieldError("The picture is too small to find a field in.")
    learned = learned or shipped()
    looks = looks or seen(scene, learned.network)
    factor = max(1, math.ceil(max(scene.grid.shape) / COARSE_PX))
    seed = (x_px / factor, y_px / factor)
    frame = Frame.of(scene, factor, seed, looks.times)
    raw, inside = channels(scene, factor), frame.inside
    whitened = whiten(raw, seed, inside)
    stack, things = clear(whitened, scene.grid.ground_resolution_m * factor)
    footing = open_ground(things, seed)
    return WindowSearch(
        factor,
        np.ascontiguousarray(np.moveaxis(stack, 0, -1)),
        things,
        frame,
        looks,
        footing,
        footing != seed,
        learned,
    )


def open_ground(things: BoolArray, seed_px: tuple[float, float]) -> tuple[float, float]:
    """The seed, or the nearest place on open ground where it is on a crown or the like."""
    x, y = int(seed_px[0]), int(seed_px[1])
    if not things[y, x]:
        return seed_px
    top, left = max(y - _STRAY_PX, 0), max(x - _STRAY_PX, 0)
    free = ~things[top : y + _STRAY_PX + 1, left : x + _STRAY_PX + 1]
    if not free.any():
        return seed_px
    row, column = np.indices(free.shape)
    distance = np.hypot(row + top - y, column + left - x)
    down, right = np.unravel_index(np.argmin(np.where(free, distance, np.inf)), free.shape)
    return (float(left + right) + 0.5, float(top + down) + 0.5)
