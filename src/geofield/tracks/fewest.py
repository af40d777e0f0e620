"""The heading with the fewest tracks, or the fewest pieces (each piece ends in a turn).

The number of tracks depends on the field's width across them alone, and a convex outline is
narrowest across one of its edges (Freeman and Shapira 1975, "Determining the minimum-area encasing
rectangle", for width: Houle and Toussaint 1988). The candidates are therefore the edges of the
convex hull; those of the outline and every whole degree are added, because pieces, unlike tracks,
depend on notches and holes as well. Each candidate is laid out and clipped, nothing is estimated.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon

from geofield.tracks.clip import clip_tracks
from geofield.tracks.frame import FloatArray, TrackFrame
from geofield.tracks.layout import track_positions
from geofield.tracks.shapes import FIELD, Edges, polygon_edges

#: Directions tried at most before those of the shorter edges are passed over.
_MOST_ANGLES = 600


def fewest_direction(
    polygon: Polygon, spacing: float, *, turns: bool = False, tolerance: float = 1.0
) -> tuple[float, float]:
    """Find the direction, exact over the candidates, as a unit vector in the (metric) CRS.

    `spacing` is in units of the CRS. With `turns` the fewest pieces count first and tracks second,
    instead of the other way round. `tolerance` simplifies the outline before its edges become
    candidates.
    """
    centre = polygon.centroid
    edges = polygon_edges(
        polygon, TrackFrame.of((centre.x, centre.y), (1.0, 0.0), left=True), FIELD
    )
    best: tuple[tuple[float, float, float], float] | None = None
    for angle in candidate_angles(polygon, tolerance):
        turned = _turned(edges, float(angle))
        near, far = float(turned.va.min()), float(turned.va.max())
        positions = track_positions(near, far, spacing, first_m=near + spacing / 2.0)
        pieces, _ = clip_tracks(positions, turned)
        tracks, count = float(len(positions)), float(len(pieces))
        # Of equals, the one across which the field is narrowest.
        score = (count, tracks, far - near) if turns else (tracks, count, far - near)
        if best is None or score < best[0]:
            best = (score, float(angle))
    angle = best[1] if best is not None else 0.0
    return float(np.cos(angle)), float(np.sin(angle))


def candidate_angles(polygon: Polygon, tolerance: float = 1.0) -> FloatArray:
    """Directions to try, radians counter-clockwise from the CRS's x axis, 0 <= angle < pi."""
    outlines = (polygon.simplify(tolerance), polygon.convex_hull)
    rings = [shapely.get_exterior_ring(one) for one in outlines if isinstance(one, Polygon)]
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


def _turned(edges: Edges, angle: float) -> Edges:
    cos, sin = np.cos(angle), np.sin(angle)
    return replace(
        edges,
        ua=edges.ua * cos + edges.va * sin,
        va=edges.va * cos - edges.ua * sin,
        ub=edges.ub * cos + edges.vb * sin,
        vb=edges.vb * cos - edges.ub * sin,
    )
