"""Tracks on ground that obstacles enclose: no machine gets there without crossing one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon, STRtree

from geofield.errors import TrackWarning
from geofield.model.obstacles import ObstacleShapes, polygons_around
from geofield.model.tracks import Tracks
from geofield.notes import warn

_QUARTER_CORNERS = 4
"""Of the polygon around a circle: gaps below some hundredths of its radius count as closed."""


def tell_enclosed(tracks: Tracks) -> Tracks:
    """Add a note where segments lie on ground that obstacles and holes of the field enclose."""
    if tracks.outline is None or tracks.shapes is None:
        return tracks
    ground = _enclosed(tracks.outline, tracks.shapes)
    if not len(ground):
        return tracks  # segments become a table when they are looked at
    lines = np.asarray(tracks.segments.geometry.to_numpy(), dtype=object)
    middles = shapely.line_interpolate_point(lines, 0.5, normalized=True)
    there = np.unique(STRtree(ground).query(middles, predicate="within")[0])
    if not len(there):
        return tracks
    length_m = float(tracks.segments["length_m"].iloc[there].sum())
    lie = "segment ({:.3g} m) lies" if len(there) == 1 else "segments ({:.3g} m) lie"
    note = (
        f"{len(there)} {lie.format(length_m)} on ground that obstacles enclose: no machine gets "
        "there without crossing one."
    )
    warn(note, TrackWarning)
    return replace(tracks, notes=(*tracks.notes, note))


def _enclosed(outline: Polygon, shapes: ObstacleShapes) -> NDArray[np.object_]:
    """The holes in what bars the way; those of a field alone enclose nothing."""
    if not len(shapes.circle_no) + len(shapes.polygon_no):
        return np.empty(0, dtype=object)
    polygons = np.array([*shapes.polygons, *map(Polygon, outline.interiors)], dtype=object)
    x, y, radius = shapes.circles.T
    boxes = np.concatenate(
        (shapely.box(x - radius, y - radius, x + radius, y + radius), shapely.envelope(polygons))
    )
    # Of circles a ring takes three, with a polygon two; alone only a polygon is one.
    met = np.bincount(STRtree(boxes).query(boxes)[0], minlength=len(boxes))
    may = met > (2 if not len(polygons) else 1)
    may[len(x) :] |= shapely.get_num_interior_rings(polygons) > 0
    circles = polygons_around(shapes.circles[may[: len(x)]], _QUARTER_CORNERS)
    solid = shapely.union_all([*circles, *polygons[may[len(x) :]]])
    holes = [Polygon(ring) for part in shapely.get_parts(solid) for ring in part.interiors]
    return np.array(holes, dtype=object)
