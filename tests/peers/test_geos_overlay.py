"""Tracks are clipped as GEOS overlays lines with the free area: same pieces, lengths, ends."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon

from geofield.model.obstacles import ObstacleShapes
from geofield.tracks.clip import SNAP_M
from geofield.tracks.frame import TrackFrame
from geofield.tracks.layout import track_positions
from geofield.tracks.planner import clip_shapes
from geofield.tracks.shapes import FIELD, polygon_edges
from geofield.tracks.tables import segment_ends

# Shorter pieces and gaps are touching points and the rounding of corners.
SLIVER_M = 1e-6


@st.composite
def star_polygons(draw: st.DrawFn) -> Polygon:
    """Concave outlines around a centre, some with very short radii (slivers)."""
    count = draw(st.integers(4, 24))
    radii = draw(st.lists(st.floats(2.0, 150.0), min_size=count, max_size=count))
    turn = draw(st.floats(0.0, 1.0))
    angle = (np.arange(count) + turn) * 2.0 * np.pi / count
    ring = np.column_stack((np.cos(angle), np.sin(angle))) * np.array(radii)[:, None]
    return Polygon(ring)


@st.composite
def grid_polygons(draw: st.DrawFn) -> Polygon:
    """Unions of whole-metre cells: edges on tracks, tracks through vertices, holes."""
    rows, columns = draw(st.integers(2, 6)), draw(st.integers(2, 6))
    cells = draw(st.lists(st.booleans(), min_size=rows * columns, max_size=rows * columns))
    boxes = [
        shapely.box(4.0 * c, 2.0 * r, 4.0 * c + 4.0, 2.0 * r + 2.0)
        for r in range(rows)
        for c in range(columns)
        if cells[r * columns + c]
    ]
    union = shapely.union_all(boxes) if boxes else shapely.box(0, 0, 8, 6)
    return max(shapely.get_parts(union), key=lambda part: part.area)


@st.composite
def fields(draw: st.DrawFn) -> Polygon:
    """Any of these, some with a hole cut out."""
    polygon = draw(st.one_of(star_polygons(), grid_polygons()))
    if draw(st.booleans()):
        x0, y0, x1, y1 = polygon.bounds
        hole = shapely.box(
            x0 + 0.3 * (x1 - x0), y0 + 0.3 * (y1 - y0), x0 + 0.6 * (x1 - x0), y0 + 0.5 * (y1 - y0)
        )
        rest = shapely.difference(polygon, hole)
        parts = [part for part in shapely.get_parts(rest) if part.area > 1.0]
        if parts:
            polygon = max(parts, key=lambda part: part.area)
    return polygon


@st.composite
def obstacle_sets(draw: st.DrawFn, polygon: Polygon) -> list[Polygon]:
    """Polygonal obstacles in, across and outside a field, overlapping and abutting."""
    x0, y0, x1, y1 = polygon.bounds
    found: list[Polygon] = []
    for _ in range(draw(st.integers(0, 6))):
        x = draw(st.floats(x0 - 5.0, x1 + 5.0))
        y = draw(st.floats(y0 - 5.0, y1 + 5.0))
        if draw(st.booleans()):
            x, y = float(np.rint(x)), float(np.rint(y))
            found.append(
                shapely.box(x, y, x + draw(st.integers(1, 8)), y + draw(st.integers(1, 8)))
            )
        else:
            size = draw(st.floats(0.1, 20.0))
            found.append(shapely.Point(x, y).buffer(size, quad_segs=draw(st.integers(1, 8))))
    return found


def ours(
    polygon: Polygon, obstacles: list[Polygon], angle: float, spacing_m: float, offset_m: float
) -> tuple[list[np.ndarray], list[np.ndarray], TrackFrame]:
    """Pieces (start, end) by track, and the pieces' ends as GEOS would give them."""
    frame = TrackFrame.of((0.0, 0.0), (np.cos(angle), np.sin(angle)))
    edges = polygon_edges(polygon, frame, FIELD)
    positions = track_positions(
        edges.va.min(), edges.va.max(), spacing_m, first_m=edges.va.min() + offset_m
    )
    shapes = ObstacleShapes(
        np.empty((0, 3)),
        np.empty(0, np.int64),
        np.array(obstacles, dtype=object),
        np.arange(1, len(obstacles) + 1),
    )
    pieces, _ = clip_shapes(positions, edges, shapes, frame)
    # Both sides must follow the same line, so ends go through the CRS and back.
    ends = segment_ends(pieces, positions, frame)
    u, _ = frame.to_frame(ends[..., 0], ends[..., 1])
    mine = [u[pieces.track == k] for k in range(len(positions))]
    theirs = overlay(polygon, obstacles, frame, positions)
    return mine, theirs, frame


def overlay(
    polygon: Polygon, obstacles: list[Polygon], frame: TrackFrame, positions: np.ndarray
) -> list[np.ndarray]:
    """The same by GEOS: each line with the free area, joined where noding split it."""

    # The free area in the frame itself: rotating the tracks instead would move them off vertices.
    if not len(positions):
        return []

    def turn(xy: np.ndarray) -> np.ndarray:
        u, v = frame.to_frame(xy[:, 0], xy[:, 1])
        # Whether a track runs along an edge or 1e-16 m beside it is rounding: for both, a vertex
        # within a nanometre of a track is on it.
        nearest = positions[np.abs(positions[:, None] - v).argmin(axis=0)]
        return np.column_stack((u, np.where(np.abs(nearest - v) <= SNAP_M, nearest, v)))

    free: Any = shapely.transform(polygon, turn)
    if obstacles:
        blocked = shapely.union_all([shapely.transform(each, turn) for each in obstacles])
        free = shapely.difference(free, blocked)
        # Where edges coincide but for rounding, overlay leaves parts of 1e-16 m width.
        free = shapely.MultiPolygon([p for p in shapely.get_parts(free) if p.area > 1e-6])
    reach = shapely.get_coordinates(shapely.transform(polygon, turn))[:, 0]
    low, high = reach.min() - 1.0, reach.max() + 1.0
    lines = [shapely.LineString([(low, v), (high, v)]) for v in positions]
    result = []
    for piece in shapely.intersection(lines, free):
        parts = [
            p for p in shapely.get_parts(piece) if p.geom_type == "LineString" and p.length > 0.0
        ]
        found = np.array([sorted((p.coords[0][0], p.coords[-1][0])) for p in parts])
        result.append(joined(found.reshape(-1, 2)))
    return result


def joined(pieces: np.ndarray) -> np.ndarray:
    """Without slivers, and with pieces joined that only touch."""
    pieces = pieces[np.argsort(pieces[:, 0])]
    out: list[list[float]] = []
    for start, end in pieces:
        if out and start - out[-1][1] <= SLIVER_M:
            out[-1][1] = max(out[-1][1], end)
        else:
            out.append([start, end])
    return np.array([p for p in out if p[1] - p[0] > SLIVER_M]).reshape(-1, 2)


def assert_same(mine: list[np.ndarray], theirs: list[np.ndarray], ends_m: float = 1e-6) -> None:
    total = abs(sum(float(np.diff(p).sum()) for p in theirs))
    length = abs(sum(float(np.diff(p).sum()) for p in mine))
    assert length == pytest.approx(total, rel=1e-9, abs=1e-6)
    for track, (raw, b) in enumerate(zip(mine, theirs, strict=True)):
        a = joined(raw)
        assert len(a) == len(b), f"track {track}: {a} against {b}"
        if len(a):
            assert np.abs(a - b).max() <= ends_m, f"track {track}: {a} against {b}"


@pytest.fixture
def parcels(shared: Path) -> gpd.GeoDataFrame:
    """Real parcels with real holes, from beside the project."""
    return gpd.read_file(shared / "data" / "fields" / "fields.gpkg")


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_random_fields_and_obstacles(data: st.DataObject) -> None:
    polygon = data.draw(fields())
    obstacles = data.draw(obstacle_sets(polygon))
    angle = data.draw(st.sampled_from([0.0, np.pi / 2]) | st.floats(0.0, np.pi))
    spacing = data.draw(st.sampled_from([1.0, 2.0, 4.0]) | st.floats(0.7, 30.0))
    offset = data.draw(st.sampled_from([0.0, 0.5, 1.0]) | st.floats(0.0, 1.0)) * spacing
    mine, theirs, _ = ours(polygon, obstacles, angle, spacing, offset)
    assert_same(mine, theirs)


@pytest.mark.real
@pytest.mark.parametrize("spacing_m", [2.0, 7.5])
def test_real_parcels(parcels: gpd.GeoDataFrame, spacing_m: float) -> None:
    assert len(parcels) == 42
    rng = np.random.default_rng(5)
    pieces = 0
    for row, epsg in enumerate(parcels["utm"]):
        polygon = parcels.geometry.iloc[[row]].to_crs(int(epsg)).iloc[0]
        centre = polygon.centroid
        x0, y0 = np.rint(centre.x), np.rint(centre.y)
        polygon = shapely.transform(polygon, partial(np.add, (-x0, -y0)))
        west, south, east, north = polygon.bounds
        places = rng.uniform((west, south), (east, north), (25, 2))
        obstacles = list(
            shapely.buffer(shapely.points(places), rng.uniform(1.0, 12.0, 25), quad_segs=8)
        )
        for angle in (0.0, float(rng.uniform(0.0, np.pi))):
            for standing in ([], obstacles):
                mine, theirs, _ = ours(polygon, standing, angle, spacing_m, spacing_m / 2.0)
                assert_same(mine, theirs)
                pieces += sum(map(len, mine))
    assert pieces > 10_000


def test_true_circles_are_the_limit_of_fine_polygons() -> None:
    """The overlay knows no circles: polygons of ever more corners approach ours."""
    rng = np.random.default_rng(3)
    polygon = shapely.box(0.0, 0.0, 200.0, 120.0)
    circles = np.column_stack(
        (rng.uniform(0, 200, 30), rng.uniform(0, 120, 30), rng.uniform(1, 9, 30))
    )
    frame = TrackFrame.of((100.0, 60.0), (0.8, 0.6))
    edges = polygon_edges(polygon, frame, FIELD)
    positions = np.arange(edges.va.min() + 1.0, edges.va.max(), 2.0)
    shapes = ObstacleShapes(
        circles, np.arange(1, 31), np.empty(0, dtype=object), np.empty(0, np.int64)
    )
    pieces, _ = clip_shapes(positions, edges, shapes, frame)
    length = float((pieces.end - pieces.start).sum())
    errors = []
    for corners in (16, 64, 256):
        # Corners on the circle: the polygon blocks less than the circle does.
        fine = shapely.buffer(shapely.points(circles[:, :2]), circles[:, 2], quad_segs=corners)
        theirs = overlay(polygon, list(fine), frame, positions)
        errors.append(sum(float(np.diff(p).sum()) for p in theirs) - length)
    assert errors[0] > errors[1] > errors[2] > 0.0
    assert errors[1] / errors[2] == pytest.approx(16.0, rel=0.25)
