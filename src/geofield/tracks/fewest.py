"""The heading with the fewest tracks, or the fewest pieces (each piece ends in a turn).

The number of tracks depends on the field's width across them alone, and a convex outline is
narrowest across one of its edges (Freeman and Shapira 1975, "Determining the minimum-area encasing
rectangle", for width: Houle and Toussaint 1988). The candidates are therefore the edges of the
convex hull; those of the outline and every whole degree are added, because pieces, unlike tracks,
depend on notches and holes as well. Each candidate is laid out and clipped, nothing is estimated.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from geofield.tracks.clip import clip_tracks
from geofield.tracks.frame import FloatArray, TrackFrame, true_heading_deg
from geofield.tracks.layout import Strips
from geofield.tracks.shapes import FIELD, Edges, polygon_edges

#: Directions tried at most before those of the shorter edges are passed over.
_MOST_ANGLES = 600
#: Edges are those of the area without what stands out less, metres of the CRS.
_PLAIN_M = 1.0


def fewest_direction(
    area: BaseGeometry,
    strips: Strips,
    *,
    scale: float = 1.0,
    north_deg: float = 0.0,
    through: tuple[float, float] | None = None,
    turns: bool = False,
) -> tuple[float, float]:
    """Find the direction, exact over the candidates, as a unit vector in the (metric) CRS.

    `area` is what tracks are laid in: the field without its headland. `scale` and `north_deg` are
    the CRS's there, `through` a place that a track passes. With `turns` the fewest pieces count
    first and tracks second, instead of the other way round. Obstacles do not count: tracks stay
    where they are when one is found or moved.
    """
    centre = area.centroid
    frame = TrackFrame.of((centre.x, centre.y), (1.0, 0.0), scale=scale)
    edges = polygon_edges(area, frame, FIELD)
    place = None if through is None else frame.to_frame(*through)
    best: tuple[tuple[float, float, float], tuple[float, float]] | None = None
    for angle in candidate_angles(area).tolist():
        # As the heading is told, 0 to 180 degrees: tracks are counted from its left.
        heading = true_heading_deg((math.cos(angle), math.sin(angle)), north_deg)
        turn = math.radians(heading - north_deg)
        along = math.sin(turn), math.cos(turn)
        turned = _turned(edges, along)
        first = None if place is None else float(place[0] * along[1] + place[1] * along[0])
        positions = strips.across(turned, first, asked=True)
        if not len(positions):
            positions = np.array([(turned.va.min() + turned.va.max()) / 2.0])
        # Short ones, too: a heading is not better for what it leaves undriven.
        pieces, _ = clip_tracks(positions, turned)
        tracks, count = float(len(positions)), float(len(pieces))
        width = round(float(turned.va.max() - turned.va.min()), 6)
        # Of equals, the one across which the field is narrowest.
        score = (count, tracks, width) if turns else (tracks, count, width)
        if best is None or score < best[0]:
            best = (score, along)
    return (1.0, 0.0) if best is None else best[1]


def fewest_tracks(area: BaseGeometry, strips: Strips, scale: float = 1.0) -> int:
    """How many tracks the best heading needs: an area is narrowest across an edge of its hull."""
    hull = shapely.convex_hull(area)
    corners = shapely.get_coordinates(hull)
    if len(corners) > _MOST_ANGLES:
        corners = shapely.get_coordinates(hull.simplify(strips.spacing_m / 100.0))
    edges = np.diff(corners, axis=0)
    normals = np.column_stack((-edges[:, 1], edges[:, 0])) / np.hypot(*edges.T)[:, None]
    across = normals @ (corners - corners[0]).T
    return strips.count(float(np.ptp(across, axis=1).min()) / scale)


def candidate_angles(area: BaseGeometry) -> FloatArray:
    """Directions to try, radians counter-clockwise from the CRS's x axis, 0 <= angle < pi."""
    area = shapely.normalize(area)
    parts = shapely.get_parts([area.simplify(_PLAIN_M), area.convex_hull])
    rings = [ring for ring in shapely.get_exterior_ring(parts) if ring is not None]
    edges = np.concatenate([np.diff(shapely.get_coordinates(ring), axis=0) for ring in rings])
    angles = np.arctan2(edges[:, 1], edges[:, 0]) % np.pi
    # Edges first: of equals the first wins, and a driver would rather follow an edge.
    angles = np.concatenate((angles, np.deg2rad(np.arange(180.0))))
    _, first = np.unique(angles.round(9), return_index=True)
    angles = angles[np.sort(first)]
    if len(angles) <= _MOST_ANGLES:
        return np.asarray(angles)
    # Of ever more edges the longest in each half degree says enough.
    lengths = np.append(np.hypot(*edges.T), np.zeros(180))[np.sort(first)]
    by_length = np.argsort(-lengths, kind="stable")
    _, longest = np.unique((angles[by_length] * (360.0 / np.pi)).astype(int), return_index=True)
    return np.asarray(angles[by_length[np.sort(longest)]])


def _turned(edges: Edges, along: tuple[float, float]) -> Edges:
    """Edges in the frame of a direction, v to its right as it is to the right of the x axis."""
    x, y = along
    return replace(
        edges,
        ua=edges.ua * x - edges.va * y,
        va=edges.ua * y + edges.va * x,
        ub=edges.ub * x - edges.vb * y,
        vb=edges.ub * y + edges.vb * x,
    )
