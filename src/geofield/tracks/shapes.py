"""Field and obstacles as flat arrays in the track frame: directed edges and discs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from geofield.tracks.frame import FloatArray, TrackFrame

IntArray = NDArray[np.int64]

FIELD = -1
"""Owner of an edge that belongs to the field's own outline."""


@dataclass(frozen=True, slots=True)
class Edges:
    """Directed edges of polygons, all polygons in one set of arrays."""

    #: ua, va, ub, vb (n,): ends in the track frame, metres.
    ua: FloatArray
    va: FloatArray
    ub: FloatArray
    vb: FloatArray
    #: Shape (n,): +1 where the ring, as stored, has its polygon's inside on the left of the edge,
    #: -1 where on the right, 0 for a ring without area.
    turn: NDArray[np.int8]
    #: Shape (n,): which obstacle the edge belongs to, or ``FIELD``.
    owner: IntArray

    def __len__(self) -> int:
        return len(self.ua)


@dataclass(frozen=True, slots=True)
class Discs:
    """True circles in the track frame: centres and radii in ground metres, and their obstacle."""

    u: FloatArray
    v: FloatArray
    radius: FloatArray
    owner: IntArray

    def __len__(self) -> int:
        return len(self.u)


def polygon_edges(
    polygons: BaseGeometry | Sequence[BaseGeometry] | NDArray[np.object_],
    frame: TrackFrame,
    owner: int | IntArray,
) -> Edges:
    """Take the edges of valid polygons and multi-polygons in the CRS of the frame.

    `owner` is one number, or one for each polygon.
    """
    if isinstance(polygons, BaseGeometry):
        polygons = [polygons]
    shapes = np.asarray(polygons, dtype=object)
    if (shapely.get_type_id(shapes) == shapely.GeometryType.POLYGON.value).all():
        # Taking parts copies every polygon, which costs more than clipping.
        parts, source = shapes[~shapely.is_empty(shapes)], np.flatnonzero(~shapely.is_empty(shapes))
    else:
        parts, source = shapely.get_parts(shapes, return_index=True)
    if len(parts) == 0:
        empty = np.empty(0)
        return Edges(empty, empty, empty, empty, np.empty(0, np.int8), np.empty(0, np.int64))
    _, coords, (ring_offsets, part_offsets) = shapely.to_ragged_array(parts, include_z=False)
    ring_offsets = np.asarray(ring_offsets, dtype=np.int64)
    u, v = frame.to_frame(coords[:, 0], coords[:, 1])
    ua, va, ub, vb = u[:-1], v[:-1], u[1:], v[1:]
    # The step from one ring's last vertex to the next ring's first is not an edge.
    edge = np.ones(len(ua), dtype=bool)
    edge[ring_offsets[1:-1] - 1] = False
    ua, va, ub, vb = ua[edge], va[edge], ub[edge], vb[edge]
    ring_edges = np.diff(ring_offsets) - 1
    ring_start = np.concatenate(([0], np.cumsum(ring_edges)[:-1]))
    twice_area = np.add.reduceat(ua * vb - ub * va, ring_start)
    ring_turn = np.sign(twice_area)
    # Every ring but the first of a polygon is a hole: its inside is outside of it.
    hole = np.ones(len(ring_turn), dtype=bool)
    hole[np.asarray(part_offsets)[:-1]] = False
    ring_turn[hole] *= -1.0
    turn = np.repeat(ring_turn.astype(np.int8), ring_edges)
    if isinstance(owner, int):
        owners = np.full(len(ua), owner, dtype=np.int64)
    else:
        ring_part = np.repeat(np.arange(len(parts)), np.diff(part_offsets))
        owners = np.repeat(np.asarray(owner, dtype=np.int64)[source[ring_part]], ring_edges)
    return Edges(ua, va, ub, vb, turn, owners)


def join_edges(first: Edges, second: Edges) -> Edges:
    """Put two sets of edges into one."""
    if not len(second):
        return first
    return Edges(
        *(
            np.concatenate((getattr(first, name), getattr(second, name)))
            for name in ("ua", "va", "ub", "vb", "turn", "owner")
        )
    )
