"""A small plan with everything in it that formats tend to lose."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import shapely
from affine import Affine
from pyproj import CRS

from geofield import schema
from geofield.crs import (
    LONLAT,
    ground_areas_m2,
    ground_lengths_m,
    ground_scale,
    transformer,
)
from geofield.grid import Grid
from geofield.model import Dataset, ImagerySource, Provenance, Tracks
from geofield.model.obstacles import circle_polygons

UTM = CRS.from_epsg(32636)
#: South-west corner of the test field, EPSG:32636, on Cyprus.
X0, Y0 = 549_000.0, 3_881_000.0
ORIGIN = np.array([X0, Y0])
#: Units of the zone per metre on the ground: its lengths are 0.037 % short here.
SCALE = ground_scale(UTM, X0 + 60, Y0 + 30)
NAME = "Großer Acker Ñandú 田"


def length_m(line):
    return float(ground_lengths_m([line], UTM)[0])


def area_ha(polygon):
    return float(ground_areas_m2([polygon], UTM)[0]) / 1e4


def make_dataset(*, points: bool = True, optional: bool = False) -> Dataset:
    """A field with a hole, four obstacles and 12 tracks with gaps of both causes."""
    outline = shapely.Polygon(
        [(0, 0), (120, 0), (120, 60), (80, 60), (80, 40), (40, 40), (40, 60), (0, 60)],
        [[(10, 5), (14, 5), (14, 9), (10, 9)]],
    )
    outline = shapely.transform(outline, lambda c: c + ORIGIN)
    centres = np.array([[30.25, 20.25], [70.75, 20.125], [100.0, 45.0]]) + ORIGIN
    radius, margin = np.array([2.5, 3.125, 4.0]), 0.5
    shed = shapely.Polygon(
        [(55, 10), (62, 10), (62, 17), (55, 17)], [[(57, 12), (59, 12), (59, 14), (57, 14)]]
    )
    shapes = [
        *circle_polygons(centres[:, 0], centres[:, 1], radius + margin, UTM),
        shapely.transform(shed, lambda c: c + ORIGIN),
    ]
    middle = np.array([[s.centroid.x, s.centroid.y] for s in shapes])
    lon, lat = transformer(UTM, LONLAT).transform(middle[:, 0], middle[:, 1])
    grid = Grid(700, 400, Affine(0.2, 0, X0 - 10, 0, -0.2, Y0 + 70), UTM)
    x_px, y_px = grid.from_crs(middle[:, 0], middle[:, 1], UTM)
    obstacles = schema.table(
        schema.OBSTACLES,
        {
            "obstacle_no": [1, 2, 3, 4],
            "kind": ["tree", "tree", "tree", "other"],
            "status": ["detected", "confirmed", "rejected", "added"],
            "radius_m": [*radius, np.nan],
            "buffer_m": [margin] * 4,
            "confidence": [0.875, 0.625, 0.3, np.nan],
            "x_px": x_px,
            "y_px": y_px,
            "radius_px": [*(radius / 0.2), np.nan],
            "lat": lat,
            "lon": lon,
        },
        shapes,
        UTM,
    )
    lines, segments, gaps = _tracks(outline, obstacles)
    tracks = Tracks(lines, segments, gaps, 90.0, 5.0, 1.0, grid)
    field = schema.table(
        schema.FIELD,
        {
            "field_id": ["35.0712N33.5371E"],
            "name": [NAME],
            "area_ha": [area_ha(outline)],
            "perimeter_m": [outline.exterior.length / SCALE],
            "longest_edge_m": [120.0 / SCALE],
            "heading_deg": [90.35],
            "method": ["auto"],
            "imagery": ["ortho.tif"],
            "imagery_date": ["2020-06-01"],
            "licence": ["CC BY 4.0"],
        },
        [outline],
        UTM,
    )
    return Dataset(
        {
            "field": field,
            "obstacles": obstacles,
            "tracks": lines,
            "segments": segments,
            "gaps": gaps,
            **(_optional(outline) if optional else {}),
        },
        UTM,
        NAME,
        Provenance(
            "geofield 0.1.0",
            ImagerySource("ortho.tif", "2020-06-01", "© Survey of Ñ", "CC BY 4.0"),
            {"tracks": {"spacing_m": 5.0, "start": None}, "field": {"method": "auto"}},
            {"detection": {"strategy": "auto", "counts": [1, 2]}, "quality": 0.75},
        ),
        grid,
        points=tracks.point_chunks if points else None,
    )


def _optional(outline):
    """Headland, its track, two steps of a route and a turn that does not fit."""
    inner = outline.buffer(-4, join_style="mitre")
    strip = outline.difference(inner)
    ring = shapely.LineString(outline.buffer(-2, join_style="mitre").exterior.coords)
    a, b, c = np.array([(10, 2.5), (50, 2.5), (50, 7.5)]) + ORIGIN
    rows = {
        "headland": (
            {"headland_no": [1], "width_m": [4.0], "area_ha": [area_ha(strip)]},
            strip,
        ),
        "headland_tracks": (
            {
                "pass_no": [1],
                "segment_no": [1],
                "offset_m": [2.0],
                "length_m": [length_m(ring)],
            },
            ring,
        ),
        "route": (
            {"sequence": [1], "kind": ["work"], "direction": ["forward"], "track_no": [1]},
            shapely.LineString([a, b]),
        ),
        "turns": (
            {"turn_no": [1], "kind": ["dubins"], "direction": ["left"], "fits": ["no"]},
            shapely.LineString([b, c]),
        ),
    }
    tables = {}
    for name, (data, shape) in rows.items():
        layer = schema.layer(name)
        many = layer.geometry == "MultiPolygon" and shape.geom_type == "Polygon"
        whole = shapely.multipolygons([shape]) if many else shape
        tables[name] = schema.table(layer, data, [whole], UTM)
    return tables


def _tracks(outline, obstacles):
    kept = obstacles[obstacles["status"] != "rejected"]
    rows: dict[str, list[Any]] = {"tracks": [], "segments": [], "gaps": []}
    shapes: dict[str, list[Any]] = {"tracks": [], "segments": [], "gaps": []}
    for number, offset in enumerate(np.arange(2.5, 60, 5.0), start=1):
        whole = shapely.LineString([(X0 - 5, Y0 + offset), (X0 + 125, Y0 + offset)])
        free = shapely.intersection(whole, outline)
        for geometry in kept.geometry:
            free = shapely.difference(free, geometry)
        parts = sorted(shapely.get_parts(free), key=lambda line: line.coords[0][0])
        for position, part in enumerate(parts, start=1):
            rows["segments"].append((number, position, length_m(part)))
            shapes["segments"].append(shapely.LineString(part.coords))
        for position, (a, b) in enumerate(pairwise(parts), start=1):
            gap = shapely.LineString([a.coords[-1], b.coords[0]])
            hit = [
                int(no)
                for no, shape in zip(kept["obstacle_no"], kept.geometry, strict=True)
                if gap.distance(shape) < 1e-6
            ]
            cause = f"obstacle {hit[0]}" if hit else "border"
            rows["gaps"].append((number, position, length_m(gap), cause, hit[0] if hit else None))
            shapes["gaps"].append(gap)
        rows["tracks"].append(
            (number, 90.35, len(parts), len(parts) - 1, None, sum(map(length_m, parts)))
        )
        shapes["tracks"].append(shapely.multilinestrings(parts))
    return tuple(
        schema.table(
            schema.layer(name),
            dict(
                zip(
                    schema.layer(name).column_names,
                    map(list, zip(*rows[name], strict=True)),
                    strict=True,
                )
            ),
            shapes[name],
            UTM,
        )
        for name in ("tracks", "segments", "gaps")
    )
