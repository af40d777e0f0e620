"""A small plan made by hand, and long ones for scale, as datasets."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import shapely
from pyproj import CRS
from shapely.affinity import rotate

from geofield import schema
from geofield.crs import LONLAT, transformer
from geofield.grid import Grid
from geofield.model.dataset import Dataset, Provenance
from geofield.model.field import Field
from geofield.model.obstacles import circle_polygons
from geofield.model.scene import ImagerySource
from geofield.model.tracks import Tracks


def small_plan(
    *,
    crs: CRS | str = "EPSG:32636",
    spacing_m: float = 6.0,
    step_m: float = 5.0,
    name: str = "North",
) -> Dataset:
    """A field with a hole, four obstacles (every status, both kinds), tracks and points."""
    crs = CRS(crs)
    x0, y0 = 548_400.0, 3_881_500.0
    outline = rotate(shapely.box(x0, y0, x0 + 80, y0 + 60), 7, origin=(x0, y0))
    hole = shapely.Point(x0 + 55, y0 + 45).buffer(2.5)
    polygon: Any = outline.difference(hole)
    grid = Grid.web_mercator(lat=35.0756, lon=33.5315, zoom=19, width_px=640, height_px=640)
    field = Field(polygon, crs, name=name, field_id="cy-1", method="auto", licence="CC BY 4.0")
    obstacles = _obstacles(x0, y0, grid, crs)
    tracks = plan_lines(polygon, obstacles, crs, spacing_m=spacing_m, step_m=step_m, grid=grid)
    field_table = schema.table(
        schema.FIELD,
        {
            "field_id": [field.field_id],
            "name": [field.name],
            "area_ha": [field.area_ha],
            "perimeter_m": [field.perimeter_m],
            "longest_edge_m": [80.0],
            "heading_deg": [83.0],
            "method": [field.method],
            "imagery": ['ortho & "drone" <2018>'],
            "imagery_date": ["2018-06-01"],
            "licence": [field.licence],
        },
        [field.polygon],
        crs,
    )
    lines = tracks.lines.copy()
    counts = tracks.points.groupby("track_no").size().reindex(lines["track_no"])
    lines["point_count"] = counts.to_numpy(dtype="int64")
    lines = schema.conform(schema.TRACKS, lines)
    return Dataset(
        {
            "field": field_table,
            "obstacles": obstacles,
            "tracks": lines,
            "segments": tracks.segments,
            "gaps": tracks.gaps,
            "track_points": tracks.points,
            **_driving(field, tracks, crs),
        },
        crs,
        name,
        Provenance(
            "geofield 0.1.0",
            ImagerySource(
                "ortho 2018.tif",
                "2018-06-01",
                "Survey of Somewhere",
                "CC BY 4.0",
                True,
                False,
                19,
                (("fetched", "2026-01-02"),),
            ),
            {"tracks": {"spacing_m": spacing_m, "note": 'a "quoted"\nline'}},
            {"detection": {"strategy": "auto", "counts": [1, 2.5]}},
        ),
        grid,
    )


def _driving(field: Field, tracks: Tracks, crs: CRS):
    """Headland, route and turns: shaped like a planner's, not planned."""
    ring = shapely.get_exterior_ring(field.polygon)
    strip = field.polygon.difference(field.polygon.buffer(-3.0))
    headland = shapely.MultiPolygon(list(shapely.get_parts(strip)))
    segments = tracks.segments
    first, second = segments.geometry.iloc[0], segments.geometry.iloc[1]
    turn = shapely.LineString([first.coords[-1], second.coords[-1]])
    lines = [first, turn, shapely.reverse(second), ring]
    lengths = shapely.length(np.array(lines))
    return {
        "headland": schema.table(
            schema.HEADLAND,
            {"headland_no": [1], "width_m": [3.0], "area_ha": [headland.area / 1e4]},
            [headland],
            crs,
        ),
        "headland_tracks": schema.table(
            schema.HEADLAND_TRACKS,
            {"pass_no": [1], "segment_no": [1], "offset_m": [1.5], "length_m": [ring.length]},
            [shapely.LineString(ring.coords)],
            crs,
        ),
        "route": schema.table(
            schema.ROUTE,
            {
                "sequence": [1, 2, 3, 4],
                "kind": ["work", "turn", "work", "drive"],
                "direction": ["forward", None, "backward", None],
                "track_no": [1, None, 2, None],
                "segment_no": [1, None, 1, None],
                "length_m": lengths,
                "start_m": np.r_[0.0, np.cumsum(lengths)[:-1]],
            },
            [*lines[:3], shapely.LineString(ring.coords)],
            crs,
        ),
        "turns": schema.table(
            schema.TURNS,
            {
                "turn_no": [1, 2],
                "sequence": [2, 4],
                "from_track": [1, 2],
                "to_track": [2, None],
                "kind": ["dubins", "drive"],
                "direction": ["left", "straight"],
                "radius_m": [5.5, np.nan],
                "length_m": [turn.length, ring.length],
                "reverse_m": [0.0, 0.0],
                "outside_m": [0.0, 1.25],
                "fits": ["yes", "no"],
            },
            [turn, shapely.LineString(ring.coords)],
            crs,
        ),
    }


def plan_across_180() -> Dataset:
    """The small plan's field, obstacles and tracks where 180 degrees cut them, without points."""
    return plan_at(180.0, 35.07, "EPSG:32660")


def plan_at(lon: float, lat: float, crs: CRS | str) -> Dataset:
    """The small plan's field, obstacles and tracks at a place, without points."""
    plan, crs = small_plan(), CRS(crs)
    middle = plan.tables["field"].geometry.iloc[0].centroid
    x, y = transformer(LONLAT, crs).transform(lon, lat)
    tables = {
        name: table.set_geometry(table.geometry.translate(x - middle.x, y - middle.y)).set_crs(
            crs, allow_override=True
        )
        for name, table in plan.tables.items()
    }
    centres = shapely.get_coordinates(tables["obstacles"].geometry.centroid)
    lons, lats = transformer(crs, LONLAT).transform(*centres.T)
    tables["obstacles"] = tables["obstacles"].assign(lon=lons, lat=lats)
    return replace(plan, tables=tables, crs=crs, grid=None, points=None)


def _obstacles(x0: float, y0: float, grid: Grid, crs: CRS):
    x = x0 + np.array([20.0, 40.0, 30.0, 60.0])
    y = y0 + np.array([25.0, 40.0, 15.0, 20.0])
    radius = np.array([3.25, 2.5, 4.125, np.nan])
    lon, lat = Grid.to_lonlat(grid, *grid.from_crs(x, y, crs))
    x_px, y_px = grid.from_crs(x, y, crs)
    shapes = list(circle_polygons(x[:3], y[:3], radius[:3] + 1.0, crs))
    shapes.append(shapely.box(58.0 + x0, 18.0 + y0, 62.0 + x0, 22.0 + y0).buffer(1.0))
    return schema.table(
        schema.OBSTACLES,
        {
            "obstacle_no": [1, 2, 3, 7],
            "kind": ["tree", "tree", "tree", "other"],
            "status": ["detected", "confirmed", "rejected", "added"],
            "radius_m": radius,
            "buffer_m": np.ones(4),
            "confidence": [0.9, 0.75, 0.31, np.nan],
            "x_px": x_px,
            "y_px": y_px,
            "radius_px": radius / 0.2444,
            "lat": lat,
            "lon": lon,
        },
        shapes,
        crs,
    )


def plan_lines(polygon, obstacles, crs, *, spacing_m, step_m, grid=None) -> Tracks:
    """Lines along the first edge, cut by hand: enough to describe, not a planner."""
    kept = obstacles[obstacles["status"] != "rejected"]
    free = polygon.difference(shapely.union_all(kept.geometry.to_numpy()))
    left, bottom, right, top = polygon.bounds
    ys = np.arange(bottom + spacing_m / 2, top, spacing_m)
    lines: list[Any] = []
    segments, gaps = [], []
    for y in ys:
        line = shapely.LineString([(left - 1, y), (right + 1, y)])
        parts = shapely.get_parts(line.intersection(free))
        pieces = sorted((p for p in parts if p.length > 0.5), key=lambda p: p.bounds[0])
        if not pieces:
            continue
        number = len(lines) + 1
        lines.append((number, shapely.MultiLineString(pieces), len(pieces)))
        segments += [(number, k, piece) for k, piece in enumerate(pieces, 1)]
        for k, (before, after) in enumerate(itertools.pairwise(pieces), 1):
            gap = shapely.LineString([before.coords[-1], after.coords[0]])
            hit = kept["obstacle_no"][kept.geometry.intersects(gap.buffer(0.01))].tolist()
            gaps.append((number, k, gap, hit))
    words = {0: "border", 1: "obstacle "}
    return Tracks(
        schema.table(
            schema.TRACKS,
            {
                "track_no": [n for n, _, _ in lines],
                "heading_deg": [90.1] * len(lines),
                "segment_count": [c for _, _, c in lines],
                "gap_count": [c - 1 for _, _, c in lines],
                "length_m": [g.length for _, g, _ in lines],
            },
            [g for _, g, _ in lines],
            crs,
        ),
        schema.table(
            schema.SEGMENTS,
            {
                "track_no": [n for n, _, _ in segments],
                "segment_no": [k for _, k, _ in segments],
                "length_m": [p.length for _, _, p in segments],
            },
            [p for _, _, p in segments],
            crs,
        ),
        schema.table(
            schema.GAPS,
            {
                "track_no": [n for n, _, _, _ in gaps],
                "gap_no": [k for _, k, _, _ in gaps],
                "length_m": [g.length for _, _, g, _ in gaps],
                "cause": [
                    words.get(len(hit), "obstacles ") + ", ".join(map(str, hit))
                    for _, _, _, hit in gaps
                ],
                "obstacle_no": [min(hit, default=None) for _, _, _, hit in gaps],
            },
            [g for _, _, g, _ in gaps],
            crs,
        ),
        90.1,
        spacing_m,
        step_m,
        grid,
    )


def long_plan(points: int) -> Dataset:
    """A plan of about a number of points (never fewer), streamed in chunks."""
    crs = CRS("EPSG:32636")
    x0, y0 = 548_400.0, 3_881_500.0
    rows = max(1, round(np.sqrt(points / 10)))
    length = points / rows - 1
    y = y0 + 2.0 * np.arange(rows)
    coordinates = np.stack(
        [np.column_stack([np.full(rows, x0), y]), np.column_stack([np.full(rows, x0 + length), y])],
        axis=1,
    )
    lines: Any = shapely.linestrings(coordinates)
    number = np.arange(1, rows + 1)
    ones = np.ones(rows, dtype=np.int64)
    field = shapely.box(x0 - 5, y0 - 5, x0 + length + 5, y[-1] + 5)
    grid = Grid.web_mercator(lat=35.0756, lon=33.5315, zoom=19, width_px=640, height_px=640)
    tracks = Tracks(
        schema.table(
            schema.TRACKS,
            {"track_no": number, "segment_count": ones, "length_m": shapely.length(lines)},
            shapely.multilinestrings(lines, indices=np.arange(rows)),
            crs,
        ),
        schema.table(
            schema.SEGMENTS,
            {"track_no": number, "segment_no": ones, "length_m": shapely.length(lines)},
            lines,
            crs,
        ),
        schema.empty(schema.GAPS, crs),
        90.0,
        2.0,
        1.0,
        grid,
    )
    table = schema.table(
        schema.FIELD,
        {"field_id": ["long"], "name": ["long"], "area_ha": [field.area / 1e4]},
        [field],
        crs,
    )
    return Dataset(
        {"field": table, "tracks": tracks.lines, "segments": tracks.segments, "gaps": tracks.gaps},
        crs,
        "long",
        Provenance("geofield 0.1.0"),
        grid,
        None,
        lambda: tracks.point_chunks(20_000),
    )
