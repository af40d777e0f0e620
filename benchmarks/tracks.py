"""Tracks: our sweep beside GEOS overlays of the same fields, and whole routes with turns.

Run as ``python benchmarks/tracks.py``; ``--all`` adds the overlay of the largest field in one
piece, which takes minutes.
"""

from __future__ import annotations

import argparse
import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from statistics import median
from typing import Any

import numpy as np
import shapely
from shapely import Polygon

from common import machine, write_page
from geofield.model.obstacles import ObstacleShapes
from geofield.tracks import plan_route, plan_tracks
from geofield.tracks.frame import TrackFrame
from geofield.tracks.planner import clip_shapes
from geofield.tracks.shapes import FIELD, polygon_edges
from geofield.tracks.tables import segment_ends

CRS = 32633
ORIGIN = np.array([500_000.0, 5_600_000.0])
SPACING_M = 2.0


@dataclass(frozen=True)
class Case:
    """A field, its obstacles, and whether they are holes of it."""

    name: str
    polygon: Polygon
    obstacles: list[Polygon]
    goal_ms: float


def field(width: float, height: float, seed: int) -> Polygon:
    """A field of uneven border, about this large."""
    rng = np.random.default_rng(seed)
    ring = shapely.get_coordinates(shapely.segmentize(shapely.box(0, 0, width, height), 60.0))[:-1]
    ring = ring + rng.normal(0.0, 2.0, ring.shape) + ORIGIN
    return Polygon(ring)


def scattered(
    polygon: Polygon, count: int, radius: tuple[float, float], seed: int
) -> list[Polygon]:
    """Round obstacles of 32 corners, apart from each other and from the border."""
    rng = np.random.default_rng(seed)
    west, south, east, north = polygon.bounds
    step = np.sqrt((east - west) * (north - south) / (count * 1.6))
    columns, rows = int((east - west) / step) - 1, int((north - south) / step) - 1
    x, y = np.meshgrid(np.arange(1, columns + 1), np.arange(1, rows + 1))
    chosen = rng.permutation(x.size)[:count]
    places = np.column_stack((x.ravel()[chosen], y.ravel()[chosen])) * step + (west, south)
    jitter = max(0.0, step / 2.0 - radius[1] - 0.1)
    places += rng.uniform(-jitter, jitter, places.shape)
    return list(
        shapely.buffer(shapely.points(places), rng.uniform(*radius, len(places)), quad_segs=8)
    )


def holed(polygon: Polygon, count: int, radius: tuple[float, float], seed: int) -> Polygon:
    """The same obstacles as holes of the field."""
    free = shapely.difference(polygon, shapely.union_all(scattered(polygon, count, radius, seed)))
    return max(shapely.get_parts(free), key=lambda part: part.area)


def cases() -> list[Case]:
    """The three sizes."""
    return [
        Case("20 ha, 40 holes", holed(field(560, 360, 1), 40, (2.0, 6.0), 2), [], 1.0),
        Case("200 ha, 400 holes", holed(field(1800, 1110, 3), 400, (2.0, 6.0), 4), [], 6.0),
        _large(),
    ]


def _large() -> Case:
    polygon = field(3000, 3000, 5)
    return Case(
        "9 km2, 10 000 obstacles", polygon, scattered(polygon, 10_000, (2.0, 5.0), 6), 150.0
    )


def positions_of(edges: Any) -> np.ndarray:
    return np.arange(edges.va.min() + SPACING_M / 2.0, edges.va.max(), SPACING_M)


def ours(case: Case, shapes: ObstacleShapes, frame: TrackFrame) -> np.ndarray:
    """From geometries to an array of segment ends."""
    edges = polygon_edges(case.polygon, frame, FIELD)
    positions = positions_of(edges)
    pieces, _ = clip_shapes(positions, edges, shapes, frame)
    return segment_ends(pieces, positions, frame)


def track_lines(case: Case, frame: TrackFrame) -> np.ndarray:
    """The same tracks as lines from end to end of the field, made before any clock runs."""
    edges = polygon_edges(case.polygon, frame, FIELD)
    v = positions_of(edges)
    low, high = edges.ua.min() - 1.0, edges.ua.max() + 1.0
    start = np.column_stack(frame.to_crs(np.full(len(v), low), v))
    end = np.column_stack(frame.to_crs(np.full(len(v), high), v))
    return np.asarray(shapely.linestrings(np.stack((start, end), axis=1)))


def one_overlay(case: Case, lines: np.ndarray) -> np.ndarray:
    """All tracks with the free area in one overlay."""
    free: Any = case.polygon
    if case.obstacles:
        free = shapely.difference(free, shapely.union_all(case.obstacles))
    return shapely.get_parts(shapely.intersection(shapely.MultiLineString(list(lines)), free))


def indexed_overlay(case: Case, lines: np.ndarray) -> np.ndarray:
    """Track by track, each with the obstacles that an index finds on it."""
    inside = shapely.intersection(lines, case.polygon)
    if not case.obstacles:
        return shapely.get_parts(inside)
    obstacles = np.array(case.obstacles, dtype=object)
    track, obstacle = shapely.STRtree(obstacles).query(inside, predicate="intersects")
    first = np.searchsorted(track, np.arange(len(lines) + 1))
    blocked = [
        shapely.multipolygons(obstacles[obstacle[a:b]]) for a, b in itertools.pairwise(first)
    ]
    return shapely.get_parts(shapely.difference(inside, blocked))


def timed(work: Callable[[], Any], *, seconds: float = 0.5, most: int = 40) -> tuple[float, Any]:
    """Median of milliseconds of the processor, and the result.

    Processor time of one thread, because the machine is shared: waiting does not count.
    """
    begin = time.process_time()
    result = work()
    once = time.process_time() - begin
    # The first run warms caches; of long ones it is a measurement all the same.
    taken: list[float] = [once] if once > seconds else []
    while not taken or (sum(taken) < seconds and len(taken) < most):
        begin = time.process_time()
        result = work()
        taken.append(time.process_time() - begin)
    return 1e3 * median(taken), result


def length_of(lines: np.ndarray) -> float:
    return float(shapely.length(lines).sum())


def tracks_table(everything: bool) -> list[str]:
    lines = [
        "| field, 2 m spacing | pieces | arrays of ends | goal | all tables | GEOS, one overlay "
        "| GEOS, indexed | GEOS / ours | lengths differ by |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for case in cases():
        centre = case.polygon.centroid
        frame = TrackFrame.of((centre.x, centre.y), (0.96, 0.28))
        shapes = ObstacleShapes(
            np.empty((0, 3)),
            np.empty(0, np.int64),
            np.array(case.obstacles, dtype=object),
            np.arange(1, len(case.obstacles) + 1),
        )
        rows = track_lines(case, frame)
        mine, ends = timed(partial(ours, case, shapes, frame))
        full, _ = timed(
            partial(
                plan_tracks,
                case.polygon,
                case.obstacles or None,
                crs=CRS,
                spacing_m=SPACING_M,
                direction=73.74,
            )
        )
        whole = None
        if everything or not case.obstacles:
            whole, _ = timed(partial(one_overlay, case, rows))
        indexed, theirs = timed(partial(indexed_overlay, case, rows))
        length = float(np.hypot(*(ends[:, 1] - ends[:, 0]).T).sum())
        peer = min(indexed, whole if whole is not None else np.inf)
        lines.append(
            f"| {case.name} | {len(ends)} | {mine:.2f} ms | {case.goal_ms:g} ms | {full:.2f} ms "
            f"| {'-' if whole is None else f'{whole:.1f} ms'} | {indexed:.1f} ms "
            f"| {peer / mine:.0f} x | {abs(length / length_of(theirs) - 1.0):.0e} |"
        )
    return lines


def growth_table() -> list[str]:
    lines = [
        "| pieces | arrays of ends | per 1000 pieces |",
        "| ---: | ---: | ---: |",
    ]
    polygon = field(3000, 3000, 5)
    for count in (1250, 5000, 10_000):
        case = Case("", polygon, scattered(polygon, count, (2.0, 5.0), 6), 0.0)
        frame = TrackFrame.of((polygon.centroid.x, polygon.centroid.y), (0.96, 0.28))
        shapes = ObstacleShapes(
            np.empty((0, 3)), np.empty(0, np.int64), np.array(case.obstacles, dtype=object),
            np.arange(1, count + 1),
        )  # fmt: skip
        mine, ends = timed(partial(ours, case, shapes, frame))
        lines.append(f"| {len(ends)} | {mine:.1f} ms | {1e3 * mine / len(ends):.2f} ms |")
    return lines


def route_table() -> list[str]:
    polygon = field(700, 560, 7)
    obstacles = scattered(polygon, 40, (2.0, 7.0), 8)
    tracks = plan_tracks(
        polygon, obstacles, crs=CRS, spacing_m=1.32, headland_m=15.0, direction=90.0
    )
    lines = [
        f"{len(tracks.segments)} segments, {len(obstacles)} obstacles, turning radius 5 m, "
        "headland 15 m.",
        "",
        "| order | turns | time | drive between segments | do not fit |",
        "| --- | --- | ---: | ---: | ---: |",
    ]
    for pattern in ("boustrophedon", "skip", "shortest"):
        for curve in ("dubins", "reeds_shepp"):
            taken, planned = timed(
                partial(
                    plan_route, tracks, pattern=pattern, skip=7, turning_radius_m=5.0, curve=curve
                ),
                most=3,
            )
            turns = planned.turns
            lines.append(
                f"| {pattern} | {curve} | {taken / 1e3:.2f} s | {turns['length_m'].sum():.0f} m "
                f"| {(turns['fits'] == 'no').sum()} of {len(turns)} |"
            )
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--all", action="store_true", help="the slow overlay of the largest field")
    everything = parser.parse_args().all
    write_page(
        "tracks",
        "Tracks",
        [
            *machine("geopandas", "pandas"),
            f"GEOS {shapely.geos_version_string}. Medians of processor time, one thread.",
            "",
            "## Clipping",
            "",
            "Arrays of ends: from geometries to the ends of all segments. All tables: "
            "`plan_tracks` with its GeoDataFrames, gaps and their causes. GEOS, one overlay: all "
            "tracks with the free area; indexed: each track with the obstacles an index finds; "
            "lines are made before the clock runs.",
            "",
            *tracks_table(everything),
            "",
            "## Growth",
            "",
            *growth_table(),
            "",
            "## Routes",
            "",
            *route_table(),
        ],
    )


if __name__ == "__main__":
    main()
