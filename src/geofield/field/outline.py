"""Outline: a mask of pixels as a polygon with straight borders, sharp corners, few vertices.

The border of a mask is a staircase of pixel sides. Its steps' midpoints lie on the true
border to half a pixel. Douglas and Peucker's method cuts that chain where it turns; a line
fitted to each piece by total least squares, met with its neighbours', gives the corners to
a fraction of a pixel.
"""

from __future__ import annotations

from itertools import pairwise
from typing import cast

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from geofield.errors import FieldError
from geofield.field.straight import Line, meeting

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]

#: How far a corner may move from where the chain turns, in tolerances.
_CORNER_REACH = 2.5
#: Pieces of fewer steps than this, in tolerances, say nothing about a direction.
_SHORT = 4.5
#: Tolerance for a hole at most, in square roots of its area.
_HOLE_SHARE = 0.06
#: Steps from which a piece is long enough to tell its outliers.
_ROBUST_FROM = 16


def mask_polygon(mask: BoolArray) -> Polygon:
    """The largest 4-connected part of a mask as a polygon on pixel corners, with its holes.

    Raises
    ------
    FieldError
        When the mask is empty.
    """
    import cv2
    from affine import Affine
    from rasterio.features import shapes

    down, right = (np.flatnonzero(np.any(mask, axis=axis)) for axis in (1, 0))
    if not len(down):
        raise FieldError("No pixel belongs to the field.", hint="Choose another point or method.")
    top, left = int(down[0]), int(right[0])
    window = np.asarray(mask[top : down[-1] + 1, left : right[-1] + 1], np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(window, connectivity=4)
    part = labels == 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    geometry, _ = next(
        shapes(
            part.view(np.uint8),
            mask=part,
            connectivity=4,
            transform=Affine.translation(left, top),
        )
    )
    shell, *holes = (shapely.linearrings(one) for one in geometry["coordinates"])
    return Polygon(shell, holes)


def largest_valid(polygon: Polygon) -> Polygon:
    """A valid polygon as it is, of an invalid one the largest part."""
    if polygon.is_valid:
        return polygon
    parts = shapely.get_parts(shapely.make_valid(polygon))
    return max((p for p in parts if isinstance(p, Polygon)), key=lambda p: p.area)


def straight_outline(mask: BoolArray, *, tolerance_px: float = 3.0) -> Polygon:
    """A mask's outline in pixel coordinates, straightened.

    Parameters
    ----------
    mask : bool array (rows, columns)
    tolerance_px : float
        How far the outline may leave the mask's border; 0 keeps the staircase. It is
        lowered by itself until the mean distance is below one pixel.

    Returns
    -------
    shapely.Polygon
        Valid; sides on the picture's edge stay exactly there.
    """
    exact = mask_polygon(mask)
    if tolerance_px <= 0:
        return exact
    rows, columns = mask.shape
    tolerance = tolerance_px
    while tolerance >= 0.25:
        polygon = _straighten(exact, tolerance, columns, rows)
        if polygon is not None and mean_deviation_px(polygon, exact) <= 1.0:
            return polygon
        tolerance /= 1.5
    return cast(Polygon, exact.simplify(0.5, preserve_topology=True))


def mean_deviation_px(outline: Polygon, exact: Polygon) -> float:
    """Mean distance of the exact border (staircase) from the outline's border, pixels."""
    ring = shapely.segmentize(exact.exterior, 1.0)
    points = shapely.points(shapely.get_coordinates(ring))
    shapely.prepare(border := outline.exterior)
    return float(np.mean(shapely.distance(points, border)))


def _straighten(exact: Polygon, tolerance: float, width: int, height: int) -> Polygon | None:
    """The polygon with every ring straightened; None when that is not a valid polygon."""
    shell = _straight_ring(shapely.get_coordinates(exact.exterior), tolerance, width, height)
    polygon = Polygon(shell)
    if not polygon.is_valid or polygon.area < 0.5 * exact.area:
        return None
    holes = []
    for ring in exact.interiors:
        # Crowns are round: a tolerance that suits a border would make them lozenges.
        small = min(tolerance, _HOLE_SHARE * Polygon(ring).area ** 0.5)
        holes.append(_straight_ring(shapely.get_coordinates(ring), small, width, height))
    if holes:
        with_holes = Polygon(shell, holes)
        # A straightened hole may cross the border or another hole: cut instead.
        polygon = with_holes if with_holes.is_valid else _cut(polygon, holes)
    return polygon


def _cut(polygon: Polygon, holes: list[FloatArray]) -> Polygon:
    areas = shapely.union_all([shapely.make_valid(Polygon(hole)) for hole in holes])
    parts = shapely.get_parts(polygon.difference(areas))
    return Polygon(max(parts, key=lambda part: part.area))


def _straight_ring(corners: FloatArray, tolerance: float, width: int, height: int) -> FloatArray:
    """Vertices of a straightened ring, three at least: GEOS leaves so many of a closed line."""
    chain = _midpoints(corners)
    if len(chain) < 12:
        return corners[:-1]
    # The point farthest from the centre is surely a turn.
    farthest = int(np.argmax(np.sum((chain - chain.mean(axis=0)) ** 2, axis=1)))
    chain = np.roll(chain, -farthest, axis=0)
    closed = np.vstack([chain, chain[:1]])
    simple = shapely.get_coordinates(shapely.LineString(closed).simplify(tolerance))
    pieces = list(pairwise(_indices(closed, simple)))
    long = [(a, b) for a, b in pieces if b - a >= _SHORT * tolerance]
    if len(long) >= 3:
        pieces = long  # what is left out is the rounding of a corner
    lines = [
        _edge_line(closed[a : b + 1], width, height) or _fit(closed[a : b + 1]) for a, b in pieces
    ]
    vertices = []
    for i, (start, _) in enumerate(pieces):
        turn = 0.5 * (closed[pieces[i - 1][1]] + closed[start])
        vertices.extend(_corner(lines[i - 1], lines[i], turn, _CORNER_REACH * tolerance + 1.0))
    ring = np.clip(np.array(vertices), 0, [width, height])
    # Lines that became one leave vertices that say nothing.
    flat = shapely.LineString(np.vstack([ring, ring[:1]])).simplify(0.3 * tolerance)
    return shapely.get_coordinates(flat)[:-1]


def _midpoints(corners: FloatArray) -> FloatArray:
    """Midpoints of the unit sides of a ring on pixel corners."""
    ring = shapely.get_coordinates(shapely.segmentize(shapely.LineString(corners), 1.0))
    return 0.5 * (ring[:-1] + ring[1:])


def _indices(closed: FloatArray, simple: FloatArray) -> list[int]:
    """Where the simplified chain's vertices stand in the full one, in order."""
    found = [0]
    for x, y in simple[1:-1]:
        rest = closed[found[-1] + 1 :]
        step = int(np.argmax((rest[:, 0] == x) & (rest[:, 1] == y)))
        found.append(found[-1] + 1 + step)
    return [*found, len(closed) - 1]


def _fit(points: FloatArray) -> Line:
    """Total least squares line, robust: a point on it and its direction.

    A crown or a bay beside a straight border pulls no line: points farther from it than
    usual are left out, twice.
    """
    if len(points) > 8:
        points = points[2:-2]  # the ends belong half to the neighbours
    elif len(points) > 4:
        points = points[1:-1]
    centre, direction = _least_squares(points)
    for _ in range(3 if len(points) >= _ROBUST_FROM else 0):
        offset = np.abs((points - centre) @ np.array([-direction[1], direction[0]]))
        near = offset <= max(0.75, 1.5 * float(np.median(offset)))
        centre, direction = _least_squares(points[near])
    return centre, direction


def _least_squares(points: FloatArray) -> Line:
    centre = points.mean(axis=0)
    if len(points) < 3:
        direction = points[-1] - points[0]
    else:
        spread = points - centre
        direction = np.linalg.eigh(spread.T @ spread)[1][:, -1]
    return centre, direction / max(float(np.hypot(*direction)), 1e-12)


def _edge_line(points: FloatArray, width: int, height: int) -> Line | None:
    """The picture's edge, where most of a piece lies on it."""
    limits = np.array([[0.0, 0.0], [width, height]])
    share = np.mean(np.abs(points[:, None] - limits) < 0.25, axis=0)
    far, axis = np.unravel_index(np.argmax(share), share.shape)
    if share[far, axis] <= 0.6:
        return None
    centre, direction = points.mean(axis=0), np.zeros(2)
    centre[axis] = limits[far, axis]
    direction[1 - axis] = 1.0
    return centre, direction


def _corner(before: Line, after: Line, turn: FloatArray, reach: float) -> list[FloatArray]:
    """Where two lines meet; their feet near the turn where they meet too far away."""
    corner = meeting(before, after, turn, reach)
    if corner is not None:
        return [corner]
    (p, u), (q, v) = before, after
    feet = [p + ((turn - p) @ u) * u, q + ((turn - q) @ v) * v]
    if np.hypot(*(feet[0] - feet[1])) < 0.75:
        return [0.5 * (feet[0] + feet[1])]
    return feet
