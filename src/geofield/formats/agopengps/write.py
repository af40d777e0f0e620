"""Writing the folder of a field for AgOpenGPS. Not tried on a tractor."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from geofield import schema
from geofield.crs import ground_areas_m2
from geofield.formats.agopengps.plane import FloatArray, LocalPlane, densified, ring_headings
from geofield.formats.agopengps.read import HOLE
from geofield.formats.arrow import exact_geometry, to_lonlat
from geofield.formats.names import safe_name
from geofield.formats.terminal import (
    are_bent,
    avoided,
    main_field,
    outline_of,
    pieces_in,
    terminal_obstacles,
)
from geofield.model import Dataset
from geofield.model.track_statistics import SHARED_EDGE_M

#: Largest distance of boundary vertices in metres, by area in hectares.
_STEPS = ((20.0, 1.1), (40.0, 2.2), (float("inf"), 3.3))
_RED = 0
_STRAIGHT, _CURVE = 2, 4
#: Largest distance of a curve's points, metres.
_CURVE_STEP_M = 1.0
_NAME_CHARACTERS = 60


def write(dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]) -> list[Path]:
    """Write the text files of ``agopengps/Fields/<name>/``."""
    polygon = outline_of(dataset, "AgOpenGPS")
    start = to_lonlat(np.array([polygon.representative_point()], dtype=object), dataset.crs)[0]
    # The file holds the start point with seven decimals: measure from what is written.
    plane = LocalPlane(round(start.y, 7), round(start.x, 7))
    name = safe_name(dataset.name, length=_NAME_CHARACTERS)
    out = folder / "agopengps" / "Fields" / name
    area_ha = float(ground_areas_m2([polygon], dataset.crs)[0]) / 10_000.0
    step = next(step for limit, step in _STEPS if area_ha < limit)
    rings = [polygon.exterior, *polygon.interiors]
    rings += [each.shape.exterior for each in terminal_obstacles(dataset, polygon)]
    files = {
        "Field.txt": _field(dataset.name, plane, dataset.provenance.source.day),
        "Boundary.txt": _boundary(_on_plane(rings, dataset, plane), step),
        "Headland.txt": _headland(main_field(dataset, polygon), rings, dataset, plane, step),
        "TrackLines.txt": _track_lines(dataset, plane),
        "Flags.txt": _flags(dataset, polygon, plane),
    }
    out.mkdir(parents=True)
    written = []
    for file, lines in files.items():
        path = out / file
        path.write_bytes("".join(f"{line}\r\n" for line in lines).encode())
        written.append(path)
    return written


def _field(name: str, plane: LocalPlane, day: str | None) -> list[str]:
    return [
        # The program passes over this line.
        f"{day} 00:00:00" if day else "imagery undated",
        "$FieldDir",
        # One line, whatever is in it: the next one would be taken for the offsets.
        " ".join(re.split(r"[\x00-\x20\x7f\x85\u2028\u2029]+", name)).strip(),
        "$Offsets",
        "0,0",
        "Convergence",
        "0",
        "StartFix",
        f"{plane.lat:.7f},{plane.lon:.7f}",
    ]


def _boundary(rings: list[FloatArray], step: float) -> list[str]:
    lines = ["$Boundary"]
    for number, ring in enumerate(rings):
        # False: nothing drives through this ring.
        lines += ["False", *_ring(ring, step if number == 0 else step / 2)]
    return lines


def _headland(
    parts: list[Any], rings: list[Any], dataset: Dataset, plane: LocalPlane, step: float
) -> list[str]:
    """The line at which machines turn, for each ring of the boundary; 0 where there is none."""
    lines = ["$Headland"]
    if not parts:
        return lines
    main = parts[0]
    placed = _on_plane([main.exterior, *main.interiors], dataset, plane)
    lines += _ring(placed[0], step)
    for ring in rings[1:]:
        around = [
            edge
            for inner, edge in zip(main.interiors, placed[1:], strict=True)
            # Without a strip around a hole its own ring is there, rounded.
            if shapely.Polygon(inner).buffer(-2 * SHARED_EDGE_M).covers(ring)
        ]
        lines += _ring(around[0], step / 2) if around else ["0"]
    return lines


def _on_plane(rings: list[Any], dataset: Dataset, plane: LocalPlane) -> list[FloatArray]:
    """Open rings (n, 2) in the plane; the first clockwise, the others not, as in the program."""
    found = []
    for number, ring in enumerate(to_lonlat(np.array(rings, dtype=object), dataset.crs)):
        placed = plane.to_plane(*shapely.get_coordinates(ring)[:-1].T)
        is_ccw = shapely.is_ccw(shapely.LinearRing(placed))
        found.append(placed[::-1] if is_ccw == (number == 0) else placed)
    return found


def _ring(ring: FloatArray, step: float) -> list[str]:
    vertices = np.round(densified(ring, step), 3)
    return [str(len(vertices)), *_rows(vertices, ring_headings(vertices))]


def _rows(vertices: FloatArray, headings: FloatArray) -> list[str]:
    placed = np.column_stack([vertices, headings])
    return [f"{east:.3f},{north:.3f},{heading:.5f}" for east, north, heading in placed]


def _track_lines(dataset: Dataset, plane: LocalPlane) -> list[str]:
    lines = ["$TrackLines"]
    tracks = dataset.table(schema.TRACKS.name)
    shapes = exact_geometry(schema.TRACKS, tracks)
    placed = to_lonlat(shapes, dataset.crs)
    for number, bent, shape in zip(tracks["track_no"], are_bent(shapes), placed, strict=True):
        way = plane.to_plane(*shapely.get_coordinates(shape).T)
        a, b = way[0], way[-1]
        heading = np.arctan2(b[0] - a[0], b[1] - a[1]) % (2 * np.pi)
        curve = _curve(way) if bent else []
        lines += [
            f"Track {number}",
            f"{heading:.8f}",
            f"{a[0]:.3f},{a[1]:.3f}",
            f"{b[0]:.3f},{b[1]:.3f}",
            "0",
            str(_CURVE if curve else _STRAIGHT),
            "True",
            str(len(curve)),
            *curve,
        ]
    return lines


def _curve(way: FloatArray) -> list[str]:
    """The points of a line with bends, as a person may draw one, and the heading at each."""
    points = shapely.get_coordinates(shapely.segmentize(shapely.LineString(way), _CURVE_STEP_M))
    ahead = np.gradient(points, axis=0)
    return _rows(points, np.arctan2(ahead[:, 0], ahead[:, 1]) % (2 * np.pi))


def _flags(dataset: Dataset, polygon: shapely.Polygon, plane: LocalPlane) -> list[str]:
    """Flags that tell what the rings in the field are: holes of it, or obstacles.

    An obstacle has one in each part that lies in the field, at its centre where that is in it.
    """
    obstacles = avoided(dataset)
    places, notes = [], []
    for number, radius, shape in zip(
        obstacles["obstacle_no"], obstacles["radius_m"], obstacles.geometry, strict=True
    ):
        for piece in pieces_in(polygon, shape):
            centred = piece.covers(shape.centroid)
            places.append(shape.centroid if centred else piece.representative_point())
            notes.append(f"Obstacle {number}" + (f" radius {radius:.2f} m" if radius > 0 else ""))
    for number, ring in enumerate(polygon.interiors, start=1):
        places.append(shapely.Polygon(ring).representative_point())
        notes.append(f"{HOLE} {number}")
    lonlat = shapely.get_coordinates(to_lonlat(np.array(places, dtype=object), dataset.crs))
    placed = plane.to_plane(lonlat[:, 0], lonlat[:, 1])
    lines = ["$Flags", str(len(notes))]
    for number, ((lon, lat), (east, north), note) in enumerate(
        zip(lonlat, placed, notes, strict=True), start=1
    ):
        lines.append(f"{lat:.9f},{lon:.9f},{east:.3f},{north:.3f},0,{_RED},{number},{note}")
    return lines
