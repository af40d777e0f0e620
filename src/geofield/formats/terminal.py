"""What machines are told of a field: what is driven around, and terminals its main part.

Obstacles that a person rejected, and those that are merely possible, are not driven around:
formats for machines leave them out, formats for people show them apart. A terminal subtracts each
obstacle from the field's area, and some refuse shapes that overlap or leave the field: obstacles
are joined where they meet and clipped to the field.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from geofield import schema
from geofield.errors import FormatError
from geofield.formats.arrow import exact_geometry
from geofield.model import Dataset
from geofield.model.obstacles import active
from geofield.model.track_statistics import SHARED_EDGE_M

if TYPE_CHECKING:
    import geopandas as gpd

#: Smaller pieces are left over from clipping, square metres.
_SLIVER_M2 = 0.01
#: How far a straight line's vertices may stray, metres.
_STRAIGHT_M = 0.01


@dataclass(frozen=True, slots=True)
class TerminalObstacle:
    """An area that no machine may enter.

    Attributes
    ----------
    name : str
        With the numbers of all obstacles in it: ``Obstacle 3``, ``Obstacle 3+7``.
    shape : shapely.Polygon
        In the dataset's CRS, inside the field.
    trees : tuple of (int, shapely.Point)
        Numbers and centres of the trees in it.
    """

    name: str
    shape: shapely.Polygon
    trees: tuple[tuple[int, shapely.Point], ...]


def avoided(dataset: Dataset) -> gpd.GeoDataFrame:
    """The rows of layer `obstacles` that are driven around."""
    return active(dataset.table(schema.OBSTACLES.name)).reset_index(drop=True)


def outline_of(dataset: Dataset, program: str) -> shapely.Polygon:
    """The one outline of a plan.

    Raises
    ------
    FormatError
        When there is none, or several: a `program` steers in one field.
    """
    field = dataset.table(schema.FIELD.name)
    if len(field) != 1:
        raise FormatError(
            f"{program} needs one field; there are {len(field)}.",
            hint="Give the plan one outline: `geofield field` finds it.",
        )
    return exact_geometry(schema.FIELD, field)[0]  # type: ignore[no-any-return]


def terminal_obstacles(dataset: Dataset, field: shapely.Polygon) -> list[TerminalObstacle]:
    """The obstacles that tracks go around, joined where they meet and clipped to the field."""
    table = avoided(dataset)
    shapes = exact_geometry(schema.OBSTACLES, table)
    if not len(shapes):
        return []
    numbers = table["obstacle_no"].to_numpy(dtype=np.int64)
    is_tree = table["kind"].to_numpy() == "tree"
    centres = shapely.centroid(shapes)
    group = _groups(shapes)
    found = []
    for each in np.unique(group):
        rows = np.flatnonzero(group == each)
        whole = shapes[rows[0]] if len(rows) == 1 else shapely.union_all(shapes[rows])
        name = "Obstacle " + "+".join(str(number) for number in sorted(numbers[rows]))
        for position, piece in enumerate(pieces_in(field, whole), start=1):
            trees = tuple(
                (int(numbers[row]), centres[row])
                for row in rows
                if is_tree[row] and piece.covers(centres[row])
            )
            tail = f" part {position}" if position > 1 else ""
            found.append(TerminalObstacle(f"{name}{tail}", piece, trees))
    return found


def pieces_in(field: shapely.Polygon, shape: Any) -> list[shapely.Polygon]:
    """The parts of an obstacle's shape that lie in the field."""
    # A post may be small, too: only what clipping leaves over is a sliver.
    least_m2 = 0.0
    if not shapely.covers(field, shape):
        shape, least_m2 = shapely.intersection(shape, field), _SLIVER_M2
    return [
        piece
        for piece in shapely.orient_polygons(shapely.get_parts(shape))
        if piece.geom_type == "Polygon" and piece.area > least_m2
    ]


def main_field(dataset: Dataset, field: shapely.Polygon) -> list[shapely.Polygon]:
    """What the headland leaves of the field, largest first; empty without a headland."""
    if not dataset.has(schema.HEADLAND.name):
        return []
    strip = shapely.union_all(dataset.table(schema.HEADLAND.name).geometry.to_numpy())
    rest = shapely.get_parts(
        shapely.orient_polygons(shapely.difference(field, strip, grid_size=SHARED_EDGE_M))
    )
    parts = [part for part in rest if part.geom_type == "Polygon" and part.area > _SLIVER_M2]
    return sorted(parts, key=lambda part: -float(part.area))


def are_bent(lines: NDArray[np.object_]) -> NDArray[np.bool_]:
    """Which lines, in a metric CRS and whole over their gaps, are not straight from end to end."""
    places, number = shapely.get_coordinates(lines, return_index=True)
    first = np.searchsorted(number, np.arange(len(lines)))
    last = np.append(first[1:], len(places))[: len(lines)] - 1
    whole = shapely.linestrings(places, indices=number)
    straight = shapely.linestrings(np.stack([places[first], places[last]], axis=1))
    return np.asarray(shapely.hausdorff_distance(whole, straight) > _STRAIGHT_M)


def _groups(shapes: NDArray[np.object_]) -> Any:
    """A number for each shape, the same for shapes that hang together."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    one, other = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    links = coo_array((np.ones(len(one), dtype=np.int8), (one, other)), shape=(len(shapes),) * 2)
    return connected_components(links, directed=False)[1]
