"""Where the machine may pass: checks of curves, and shortest ways around what stands between.

Shortest ways are exact: the way around a few shapes alone is never longer than the way around
all, so that once it is free of every shape it is the shortest. Shapes come in only
when the way found so far runs into them (the visibility graph of Lozano-Perez and Wesley 1979,
grown lazily). A way turns at a corner only where it grazes the shape there, so that of all lines
between corners few are looked along.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from geofield.model.obstacles import QUARTER_SEGMENTS, ObstacleShapes
from geofield.tracks.frame import FloatArray

TOUCH_M = 2e-3
"""Ways may touch what they go around: checks look this much inside of it."""
_AROUND_M = 0.02
"""Ways keep this distance from corners, so that rounding never takes them inside."""
_STRAIGHT_M = 0.005
"""What strays less from a line has no corner there, as the vertices along a straight border."""
_CORNERS = 16
_SHELL = -1
_GRAZES = 1e-9
"""Lines along an edge count as grazing its corners, whatever their last digits."""


@dataclass(frozen=True, slots=True)
class _Corners:
    """Places (n, 2) where ways may turn, and the border's directions into and out of each."""

    places: FloatArray
    into: FloatArray
    out: FloatArray

    def graze(self, at: NDArray[np.int64], along: FloatArray) -> NDArray[np.bool_]:
        """Whether lines at corners have the shape there on one side of them."""
        square = np.einsum("ij,ij->i", along, along)
        return np.asarray(
            _cross(self.into[at], along) * _cross(self.out[at], along) <= _GRAZES * square
        )


@dataclass(frozen=True, slots=True)
class _Sight:
    """Straight lines between the corners of two shapes, and which shapes each one meets."""

    a: NDArray[np.int64]
    b: NDArray[np.int64]
    length: FloatArray
    line: NDArray[np.int64]
    shape: NDArray[np.int64]


class Passage:
    """The area open to the machine between segments.

    Holes of the outline are shapes to go around, as obstacles are; beyond the outer border the
    machine may go by `margin_m`.
    """

    def __init__(self, outline: Polygon, shapes: ObstacleShapes, *, margin_m: float = 0.0) -> None:
        shell = Polygon(outline.exterior)
        self.open_shell: BaseGeometry = shapely.buffer(shell, margin_m + TOUCH_M)
        shapely.prepare(self.open_shell)
        circles, radius = shapely.points(shapes.circles[:, :2]), shapes.circles[:, 2]
        holes = [Polygon(ring) for ring in outline.interiors]
        solid = [*shapes.polygons, *holes]
        self._blocks = np.array(
            [
                *shapely.buffer(
                    circles, np.maximum(radius - TOUCH_M, 0.0), quad_segs=4 * QUARTER_SEGMENTS
                ),
                *shapely.buffer(solid, -TOUCH_M, join_style="mitre"),
            ],
            dtype=object,
        )
        self._tree = shapely.STRtree(self._blocks)
        # Corners of a circle's polygon lie so far out that its edges keep clear of the circle.
        out = (radius + _AROUND_M) / np.cos(np.pi / _CORNERS)
        corners = [
            _circle_corners(x, y, r)
            for x, y, r in zip(*shapes.circles[:, :2].T.tolist(), out.tolist(), strict=True)
        ]
        corners += [
            _corners_of(shapely.buffer(each, _AROUND_M, join_style="mitre")) for each in solid
        ]
        self._corners: dict[int, _Corners] = dict(enumerate(corners))
        inner = shapely.buffer(shell, margin_m - _AROUND_M, join_style="mitre")
        self._corners[_SHELL] = _corners_of(inner, inward=True)
        self._sights: dict[tuple[int, int], _Sight] = {}

    def fits(self, lines: NDArray[np.object_]) -> NDArray[np.bool_]:
        """Whether each line stays inside the border and outside every obstacle and hole."""
        return np.asarray(shapely.covers(self.open_shell, lines) & ~self.hits(lines))

    def hits(self, lines: NDArray[np.object_]) -> NDArray[np.bool_]:
        """Whether each line runs into an obstacle or hole."""
        hit = np.zeros(len(lines), dtype=bool)
        if len(lines) and len(self._blocks):
            hit[self._tree.query(lines, predicate="intersects")[0]] = True
        return hit

    def outside_m(self, line: BaseGeometry) -> float:
        """Length of a line beyond the border and its margin."""
        if shapely.covers(self.open_shell, line):
            return 0.0
        return float(shapely.length(shapely.difference(line, self.open_shell)))

    def shortest(self, start: FloatArray, goal: FloatArray) -> FloatArray | None:
        """Find the shortest way between two places in the CRS; None where there is none.

        It is told by its corners (n, 2), both ends among them.
        """
        around: list[int] = []
        while True:
            way, met = self._way_around(start, goal, around)
            new = [shape for shape in met if shape not in around]
            if not new:
                return way
            around = sorted({*around, *new})

    def _way_around(
        self, start: FloatArray, goal: FloatArray, around: list[int]
    ) -> tuple[FloatArray | None, list[int]]:
        """Shortest way around some shapes only, and which shapes it meets."""
        groups = [np.stack((start, goal)), *(self._corners[shape].places for shape in around)]
        first = np.cumsum([0, *map(len, groups)])
        rows, columns, lengths, sights = [], [], [], []
        keys = [None, *around]
        for i, one in enumerate(keys):
            for j in range(i, len(keys)):
                two = keys[j]
                if one is None or two is None:
                    sight = self._look(groups[i], groups[j], *_pairs(groups[i], groups[j], i == j))
                else:
                    sight = self._between(one, two)
                blocked = np.isin(sight.shape, around)
                seen = np.ones(len(sight.a), dtype=bool)
                seen[sight.line[blocked]] = False
                rows.append(sight.a[seen] + first[i])
                columns.append(sight.b[seen] + first[j])
                lengths.append(sight.length[seen])
                sights.append((sight, np.flatnonzero(seen)))
        a, b, length = np.concatenate(rows), np.concatenate(columns), np.concatenate(lengths)
        graph = csr_matrix((length, (a, b)), shape=(first[-1], first[-1]))
        distance, before = dijkstra(graph, directed=False, indices=0, return_predecessors=True)
        if not np.isfinite(distance[1]):
            return None, self._met_by(np.stack((start, goal)), around)
        path = [1]
        while path[-1] != 0:
            path.append(int(before[path[-1]]))
        places = np.concatenate(groups)[path[::-1]]
        return places, self._met_by(places, around)

    def _met_by(self, way: FloatArray, around: list[int]) -> list[int]:
        lines = shapely.linestrings(np.stack((way[:-1], way[1:]), axis=1))
        met = set(np.unique(self._tree.query(lines, predicate="intersects")[1]).tolist())
        if not shapely.covers(self.open_shell, lines).all():
            met.add(_SHELL)
        return sorted(met.difference(around))

    def _between(self, one: int, two: int) -> _Sight:
        """Look between the corners of two shapes; remembered."""
        key = (one, two)
        if key not in self._sights:
            of, to = self._corners[one], self._corners[two]
            a, b = _pairs(of.places, to.places, one == two)
            along = to.places[b] - of.places[a]
            kept = of.graze(a, along) & to.graze(b, along)
            self._sights[key] = self._look(of.places, to.places, a[kept], b[kept])
        return self._sights[key]

    def _look(
        self, one: FloatArray, two: FloatArray, a: NDArray[np.int64], b: NDArray[np.int64]
    ) -> _Sight:
        if not len(a):
            none = np.empty(0, np.int64)
            return _Sight(none, none, np.empty(0), none, none)
        ends = np.stack((one[a], two[b]), axis=1)
        lines = shapely.linestrings(ends)
        line, shape = self._tree.query(lines, predicate="intersects")
        out = np.flatnonzero(~shapely.covers(self.open_shell, lines))
        return _Sight(
            a,
            b,
            # Coincident corners must not make an edge of no length: that would be no edge.
            np.maximum(np.hypot(*(ends[:, 1] - ends[:, 0]).T), 1e-9),
            np.concatenate((line, out)),
            np.concatenate((shape, np.full(len(out), _SHELL))),
        )


def _pairs(
    one: FloatArray, two: FloatArray, same: bool
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Each place of one with each of the other, or each two of the same once."""
    if same:
        return np.triu_indices(len(one), 1)
    a, b = np.indices((len(one), len(two)))
    return a.ravel(), b.ravel()


def _circle_corners(x: float, y: float, radius: float) -> _Corners:
    angle = np.arange(_CORNERS) * 2.0 * np.pi / _CORNERS
    return _turning(np.column_stack((x + radius * np.cos(angle), y + radius * np.sin(angle))))


def _corners_of(shape: BaseGeometry, *, inward: bool = False) -> _Corners:
    """Corners that stick out of a shape: only there can a shortest way around it turn.

    Or those that stick into it: of the border, within which ways are.
    """
    plain = shapely.simplify(shapely.get_parts(shape), _STRAIGHT_M)
    rings = shapely.get_exterior_ring(shapely.orient_polygons(plain))
    found = [_turning(shapely.get_coordinates(ring)[:-1], inward=inward) for ring in rings]
    none = np.empty((0, 2))
    return _Corners(*(
        np.concatenate([none, *(getattr(each, name) for each in found)])
        for name in ("places", "into", "out")
    ))  # fmt: skip


def _turning(ring: FloatArray, *, inward: bool = False) -> _Corners:
    """The corners of a ring at which it turns to the left, or `inward` those to the right."""
    ahead = np.roll(ring, -1, axis=0) - ring
    ahead /= np.maximum(np.hypot(*ahead.T), 1e-12)[:, None]
    into = np.roll(ahead, 1, axis=0)
    turns = (_cross(into, ahead) > 0.0) != inward
    return _Corners(ring[turns], into[turns], ahead[turns])


def _cross(one: FloatArray, two: FloatArray) -> FloatArray:
    return np.asarray(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
