"""Rules of AgOpenGPS's field folder: counts, rings, headings, coordinates."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from geofield.errors import FormatError
from geofield.formats.agopengps.plane import ring_headings
from geofield.formats.agopengps.read import boundary_rings, field_folder
from geofield.formats.validation import Finding
from geofield.wording import counted

#: Headings are written with five decimals of vertices with three.
HEADING_TOLERANCE = 0.01
_EXPECTED = ("Field.txt", "Boundary.txt", "TrackLines.txt")


def check(path: Path) -> Iterator[Finding]:
    """Findings in the folder of a field."""
    folder = field_folder(path)
    for name in _EXPECTED:
        if not (folder / name).is_file():
            yield Finding("warning", folder.name, f"{name} is missing")
    boundary = folder / "Boundary.txt"
    if boundary.is_file():
        yield from _check_boundary(boundary)


def _check_boundary(path: Path) -> Iterator[Finding]:
    first = path.read_text("utf-8-sig", errors="replace").partition("\n")[0]
    if first.strip() != "$Boundary":
        yield Finding("error", path.name, "the first line is not $Boundary")
        return
    outer, where = None, f"{path.name}, ring 1"
    try:
        for number, ring in enumerate(boundary_rings(path), start=1):
            if len(ring) < 3 or any(len(vertex) != 3 for vertex in ring):
                yield Finding("error", where, "fewer than 3 vertices, or one without its 3 figures")
                return
            vertices = np.array(ring)
            yield from _check_ring(vertices, outer, where)
            outer = shapely.Polygon(vertices[:, :2]) if outer is None else outer
            where = f"{path.name}, ring {number + 1}"
    except FormatError:
        yield Finding("error", where, "it breaks off or is damaged")


def _check_ring(
    vertices: NDArray[np.float64], outer: shapely.Polygon | None, where: str
) -> Iterator[Finding]:
    """One ring of easting, northing and heading; `outer` is the first one of its file."""
    ring = vertices[:, :2]
    if np.allclose(ring[0], ring[-1]):
        yield Finding("error", where, "it is closed: the first vertex must not be repeated")
    turned = np.abs((vertices[:, 2] - ring_headings(ring) + np.pi) % (2 * np.pi) - np.pi)
    wrong = int((turned > HEADING_TOLERANCE).sum())
    if wrong:
        yield Finding("error", where, f"{counted(wrong, 'heading does', 'headings do')} not fit")
    polygon = shapely.Polygon(ring)
    if not polygon.is_valid:
        yield Finding("error", where, "it crosses itself")
    elif outer is not None and outer.is_valid and not outer.intersects(polygon):
        yield Finding("error", where, "an inner ring lies outside the field")
