"""Points: what a person says of the ground, obeyed by every outline whatever else speaks.

Searched outlines that disobey are left out long before; here the last ones are cut or grown,
where straightening or the border's exact place has moved a side across a point.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from geofield.errors import FieldError

Points = Sequence[tuple[float, float]]
Some = tuple[tuple[float, float], ...]

#: How near an outline keeps to the border it was found at where a point needs it, pixels.
EXACT_PX = 1.0
#: What is cut off or added at a point that an outline disobeys is this wide, pixels.
_AROUND_PX = 3.0


def obeys(
    polygons: Polygon | NDArray[np.object_], include: Points, exclude: Points
) -> NDArray[np.bool_]:
    """Whether outlines hold all points that belong and none of those that do not."""
    good = shapely.is_valid(polygons) & ~shapely.is_empty(polygons)
    for x, y in include:
        good &= shapely.contains_xy(polygons, x, y)
    for x, y in exclude:
        good &= ~shapely.intersects_xy(polygons, x, y)
    return np.asarray(good)


def without_last(include: Some, exclude: Some) -> list[tuple[Some, Some]]:
    """Points that belong and that do not, less the last one; of which kind it was is not known."""
    shorter = [(include, exclude[:-1])] if exclude else []
    return [*shorter, (include[:-1], exclude)] if include else shorter


def drawn(
    draw: Callable[..., Polygon], tolerances_px: Iterable[float], include: Points, exclude: Points
) -> Polygon:
    """An outline drawn as roughly as the points allow: the last drawing where none obeys them.

    Parameters
    ----------
    draw : callable
        Called with ``tolerance_px=``.
    tolerances_px : iterable of float
        At least one, the largest first.
    include, exclude : sequence of (float, float)
    """
    polygon = Polygon()
    for tolerance_px in tolerances_px:
        polygon = draw(tolerance_px=tolerance_px)
        if obeys(polygon, include, exclude):
            break
    return polygon


def obeying(polygon: Polygon, include: Points, exclude: Points) -> Polygon:
    """An outline made to hold the points that belong and none of those that do not.

    Parameters
    ----------
    polygon : Polygon
    include, exclude : sequence of (float, float)
        In the polygon's coordinates, pixels; the first one is the seed.

    Raises
    ------
    FieldError
        When points contradict each other.
    """
    apart = min(
        (shapely.distance(shapely.Point(a), shapely.Point(b)) for a in include for b in exclude),
        default=float("inf"),
    )
    if apart < 0.5:
        raise FieldError(
            "A point is said to belong to the field and not to belong to it.",
            hint="Leave one of the two out.",
        )
    if obeys(polygon, include, exclude):
        return polygon
    around = min(_AROUND_PX, apart / 3)
    barred = shapely.union_all([shapely.Point(one).buffer(around) for one in exclude])
    wide = shapely.union_all([shapely.Point(one).buffer(1.5 * around) for one in exclude])
    seed = shapely.Point(include[0])
    shape = shapely.union(polygon, seed.buffer(around / 4)).difference(barred)
    for point in map(shapely.Point, include):
        for start in (_part_at(shape, seed), seed):
            if shapely.contains(_part_at(shape, seed), point):
                break
            way = _way(shapely.shortest_line(start, point), point, wide, around / 4)
            shape = shapely.union(shape, way).difference(barred)
    return _part_at(shape, seed)


def _way(
    line: shapely.LineString, point: shapely.Point, wide: shapely.Geometry, width: float
) -> shapely.Geometry:
    """A line to a point as a strip; round what does not belong."""
    crossed = [one for one in shapely.get_parts(wide) if one.intersects(line)]
    around = shapely.boundary(shapely.union_all(crossed))
    rest = shapely.difference(line, wide)
    return shapely.union_all([rest, around, point]).buffer(width)


def _part_at(shape: shapely.Geometry, seed: shapely.Point) -> Polygon:
    """The part of a shape that holds the seed, or is nearest to it."""
    parts = [one for one in shapely.get_parts(shape) if isinstance(one, Polygon)]
    return min(parts, key=lambda part: (shapely.distance(part, seed), -part.area))
