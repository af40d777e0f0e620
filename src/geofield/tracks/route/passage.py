"""Where the machine may pass: checks of curves, and shortest ways around what stands between.

Shortest ways are exact: the way around a few shapes alone is never longer than the way around all,
so that once it is free of every shape it is the shortest. Shapes come in only when the way found so
far runs into them (the visibility graph of Lozano-Perez and Wesley 1979, grown lazily), one for
each of its lines at a time. A way turns at a corner only where it grazes the shape there, and no
way of a length reaches a corner from which both ends are farther together: few lines between
corners are looked along.
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

from geofield.model.obstacles import QUARTER_SEGMENTS, ObstacleShapes, polygons_around
from geofield.tracks.frame import FloatArray

TOUCH_M = 2e-3
"""Ways may touch what they go around: checks look this much inside of it."""
_AROUND_M = 0.02
"""Ways keep this distance from corners, so that rounding never takes them inside."""
_STRAIGHT_M = 0.005
"""What strays less from a line has no corner there, as the vertices along a straight border."""
_QUARTER_CORNERS = 4
_SHELL = -1
_FIRST_REACH_M = 10.0
"""Ways are first sought that are no longer than twice the straight line and this."""
_GRAZES = 1e-9
"""Lines along an edge count as grazing its corners, whatever their last digits."""


@dataclass(frozen=True, slots=True)
class _Corners:
    """Places (n, 2) where ways may turn, and the border's directions into and out of each."""

    places: FloatArray
    into: FloatArray
    out: FloatArray

    def at(self, kept: NDArray[np.bool_]) -> _Corners:
        """Some of them."""
        return _Corners(self.places[kept], self.into[kept], self.out[kept])

    def graze(self, others: _Corners) -> NDArray[np.bool_]:
        """Whether the line from each corner (row) to each of others has its shape on one side."""
        (x, y), (into_x, into_y), (out_x, out_y) = self.places.T, self.into.T, self.out.T
        dx, dy = others.places[:, 0] - x[:, None], others.places[:, 1] - y[:, None]
        sides = into_x[:, None] * dy - into_y[:, None] * dx
        sides *= out_x[:, None] * dy - out_y[:, None] * dx
        return np.asarray(sides <= _GRAZES * (dx * dx + dy * dy))


@dataclass(frozen=True, slots=True)
class _Graph:
    """Corners, first the ends of a way, and the lines between them that are free of some shapes.

    Corners that no way of the length asked for reaches are left out.
    """

    corners: _Corners
    #: Indices of the corners that each line joins.
    a: NDArray[np.int64]
    b: NDArray[np.int64]
    around: list[int]
    is_whole: bool = True

    @property
    def lines(self) -> NDArray[np.object_]:
        return _lines(self.corners.places[self.a], self.corners.places[self.b])

    def way(self) -> tuple[FloatArray | None, float]:
        """Shortest way from the first corner to the second, and its length."""
        places = self.corners.places
        # Coincident corners must not make an edge of no length: that would be no edge.
        length = np.maximum(np.hypot(*(places[self.a] - places[self.b]).T), 1e-9)
        graph = csr_matrix((length, (self.a, self.b)), shape=(len(places),) * 2)
        distance, before = dijkstra(graph, directed=False, indices=0, return_predecessors=True)
        if not np.isfinite(distance[1]):
            return None, np.inf
        path = [1]
        while path[-1] != 0:
            path.append(int(before[path[-1]]))
        return places[path[::-1]], float(distance[1])


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
        solid = [*shapes.polygons, *map(Polygon, outline.interiors)]
        round_ones = shapely.buffer(
            circles, np.maximum(radius - TOUCH_M, 0.0), quad_segs=4 * QUARTER_SEGMENTS
        )
        each = np.array(
            [*round_ones, *shapely.buffer(solid, -TOUCH_M, join_style="mitre")], dtype=object
        )
        wide = np.add(shapes.circles, (0, 0, _AROUND_M))
        rings = polygons_around(wide, _QUARTER_CORNERS)
        # The corners of few sides would close what is left beside or between circles.
        others = [*each, *shapely.get_parts(shapely.boundary(self.open_shell))]
        tight = _meets(rings, others) > _meets(round_ones, others)
        rings[tight] = polygons_around(wide[tight], QUARTER_SEGMENTS)
        around = np.array(
            [*rings, *shapely.buffer(solid, _AROUND_M, join_style="mitre")], dtype=object
        )
        # Nothing passes between those that overlap: a row of trees is one shape to go around.
        self._blocks = shapely.get_parts(shapely.union_all(each))
        shapely.prepare(self._blocks)
        self._tree = shapely.STRtree(self._blocks)
        shape, of = self._tree.query(each, predicate="intersects")
        self._corners: dict[int, _Corners] = {
            block: _corners_of(shapely.union_all(around[shape[of == block]]))
            for block in range(len(self._blocks))
        }
        inner = shapely.buffer(shell, margin_m - _AROUND_M, join_style="mitre")
        self._corners[_SHELL] = _corners_of(inner, inward=True)

    def fits(self, lines: NDArray[np.object_]) -> NDArray[np.bool_]:
        """Whether each line stays inside the border and outside every obstacle and hole."""
        return np.asarray(shapely.covers(self.open_shell, lines) & ~self.hits(lines))

    def hits(self, lines: NDArray[np.object_]) -> NDArray[np.bool_]:
        """Whether each line runs into an obstacle or hole."""
        hit = np.zeros(len(lines), dtype=bool)
        if len(lines) and len(self._blocks):
            hit[self._meet(lines)[0]] = True
        return hit

    def _meet(
        self, lines: NDArray[np.object_], around: list[int] | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Which lines meet which shapes, of all or of some: the indices of both.

        A tree prepares the lines, which are short, and not the shapes, which are not.
        """
        line, shape = self._tree.query(lines)
        if around is not None:
            asked = np.isin(shape, around)
            line, shape = line[asked], shape[asked]
        met = shapely.intersects(self._blocks[shape], lines[line])
        return line[met], shape[met]

    def outside_m(self, line: BaseGeometry) -> float:
        """Length of a line beyond the border and its margin."""
        if shapely.covers(self.open_shell, line):
            return 0.0
        return float(shapely.length(shapely.difference(line, self.open_shell)))

    def shortest(self, start: FloatArray, goal: FloatArray) -> FloatArray | None:
        """Find the shortest way between two places in the CRS; None where there is none.

        It is told by its corners (n, 2), both ends among them.
        """
        ends, around = np.stack((start, goal)), list[int]()
        reach = 2.0 * float(np.hypot(*(goal - start))) + _FIRST_REACH_M
        while True:
            way, length, graph = self._within(ends, around, reach)
            if length <= reach or graph.is_whole:
                return way
            around, reach = graph.around, 2.0 * reach

    def _within(
        self, ends: FloatArray, around: list[int], reach: float
    ) -> tuple[FloatArray | None, float, _Graph]:
        """The shortest way, its length and its graph; of less than all corners if it is longer."""
        none = np.zeros((2, 2))  # at the ends there is nothing to graze
        graph = _Graph(_Corners(ends, none, none), np.array([0]), np.array([1]), [])
        way: FloatArray | None = ends
        length = float(np.hypot(*(ends[1] - ends[0])))
        more = around or self._met_by(ends, around)
        while more:
            graph = self._grown(graph, more, reach)
            way, length = graph.way()
            if way is None or (length > reach and not graph.is_whole):
                break
            more = self._met_by(way, graph.around)
        return way, length, graph

    def _grown(self, graph: _Graph, more: list[int], reach: float) -> _Graph:
        """A graph with the corners of more shapes, its lines free of these, too."""
        around, ends = [*graph.around, *more], graph.corners.places[:2]
        found = _joined([self._corners[each] for each in more])
        far = np.hypot(*(found.places[:, None] - ends).T).sum(axis=0)
        found = found.at(far <= reach)
        first, corners = len(graph.corners.places), _joined([graph.corners, found])
        grazing = found.graze(corners)
        grazing[:, first:] &= grazing[:, first:].T
        grazing[:, :first] &= graph.corners.graze(found).T
        # The ends may lie in the narrow strip between a shape and its corners.
        grazing[:, :2] = True
        row, b = np.nonzero(np.tril(grazing, first - 1))
        new = _Graph(corners, row + first, b, around)
        kept, free = self._are_free(graph.lines, more), self._are_free(new.lines, around)
        return _Graph(
            corners,
            np.concatenate((graph.a[kept], new.a[free])),
            np.concatenate((graph.b[kept], new.b[free])),
            around,
            graph.is_whole and len(found.places) == len(far),
        )

    def _are_free(self, lines: NDArray[np.object_], around: list[int]) -> NDArray[np.bool_]:
        """Which lines run into none of some shapes."""
        free = np.ones(len(lines), dtype=bool)
        if around:
            free[self._meet(lines, around)[0]] = False
        if _SHELL in around:
            free &= shapely.covers(self.open_shell, lines)
        return free

    def _met_by(self, way: FloatArray, around: list[int]) -> list[int]:
        """What a way runs into: of shapes on one of its lines, the one that it runs in the longest.

        Around that the others are passed, as a rule: a row of trees by its first and its last one.
        """
        lines = _lines(way[:-1], way[1:])
        line, shape = self._meet(lines)
        new = ~np.isin(shape, around)
        line, shape = line[new], shape[new]
        within_m = shapely.length(shapely.intersection(self._blocks[shape], lines[line]))
        order = np.lexsort((-within_m, line))
        first = np.unique(line[order], return_index=True)[1]
        met = set(shape[order[first]].tolist())
        if _SHELL not in around and not shapely.covers(self.open_shell, lines).all():
            met.add(_SHELL)
        return sorted(met)


def _meets(shapes: NDArray[np.object_], others: list[BaseGeometry]) -> NDArray[np.int64]:
    """How many of others each shape meets."""
    found = shapely.STRtree(others).query(shapes, predicate="intersects")[0]
    return np.bincount(found, minlength=len(shapes))


def _lines(begin: FloatArray, end: FloatArray) -> NDArray[np.object_]:
    return np.asarray(shapely.linestrings(np.stack((begin, end), axis=1)), dtype=object)


def _corners_of(shape: BaseGeometry, *, inward: bool = False) -> _Corners:
    """Corners that stick out of a shape: only there can a shortest way around it turn.

    Or those that stick into it: of the border, within which ways are.
    """
    plain = shapely.simplify(shapely.get_parts(shape), _STRAIGHT_M)
    # Of ground that a shape encloses the ring runs the other way: the shape is on its left, too.
    rings = shapely.get_rings(shapely.orient_polygons(plain))
    return _joined([_turning(shapely.get_coordinates(ring)[:-1], inward=inward) for ring in rings])


def _joined(found: list[_Corners]) -> _Corners:
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
    turns = (into[:, 0] * ahead[:, 1] - into[:, 1] * ahead[:, 0] > 0.0) != inward
    return _Corners(ring[turns], into[turns], ahead[turns])
