"""Reading the folder of a field from AgOpenGPS."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from geofield.errors import FormatError
from geofield.formats.agopengps.plane import LocalPlane
from geofield.formats.foreign import RawLayer, read_foreign
from geofield.model import Dataset

#: Vertices that lie so near the line between their neighbours came from densifying, metres.
COLLINEAR_M = 0.002
#: Kinds of tracks: straight from A to B, and around a centre; all others go by their points.
_STRAIGHT, _PIVOT = 2, 64
#: What the program writes where the field's name would stand: its folder has it.
_NAMELESS = "FieldNew"
#: What a flag of ours in a hole of the field says before its number.
HOLE = "Hole"
#: What helps where a file is not as the program writes it.
_AGAIN = "Open and save the field in AgOpenGPS, then copy its whole folder again."
_FLAG = re.compile(rf"Obstacle (\d+)|{HOLE} \d+$")


def read(path: Path) -> Dataset:
    """The field in a folder of AgOpenGPS, or in the folder of one of its files.

    The first ring is the field. Rings in it are obstacles, the program having no other word
    for them; where flags of ours stand, those that have none as an obstacle are holes.

    Raises
    ------
    FormatError
        When a file is missing or does not follow the format.
    """
    folder = field_folder(path)
    name, plane = _field(folder)
    layers = []
    boundary = folder / "Boundary.txt"
    found = list(boundary_rings(boundary)) if boundary.exists() else []
    rings = [_lonlat_polygon(ring, plane) for ring in found if len(ring) >= 3]
    if rings:
        holes, obstacles = _sorted_rings(rings[1:], _flags(folder, plane))
        outline = shapely.Polygon(rings[0].exterior, [hole.exterior for hole in holes])
        layers.append(RawLayer.of_rows("boundary", [{"name": name, "geometry": outline}]))
        if obstacles:
            layers.append(RawLayer.of_rows("obstacles", obstacles))
    tracks, told = _lines(folder)
    lines = [
        {"name": track, "geometry": shapely.LineString(plane.to_lonlat(*points.T))}
        for track, points in tracks
    ]
    if lines:
        layers.append(RawLayer.of_rows("guidance", lines))
    dataset = read_foreign(layers, folder, name=name)
    return replace(dataset, notes=(*dataset.notes, *told))


def field_folder(path: Path) -> Path:
    """The folder that holds ``Field.txt``: the path, its parent, or its only field."""
    start = path if path.is_dir() else path.parent
    if (start / "Field.txt").is_file():
        return start
    found = sorted(file.parent for file in start.rglob("Field.txt"))
    if len(found) != 1:
        names = ", ".join(folder.name for folder in found)
        raise FormatError(
            f"{path} holds {len(found)} AgOpenGPS fields{f' ({names})' if names else ''}.",
            hint="Name the folder of one field, the one with Field.txt in it.",
        )
    return found[0]


def _field(folder: Path) -> tuple[str, LocalPlane]:
    lines = _text(folder / "Field.txt")
    try:
        lat, lon = _numbers(lines[lines.index("StartFix") + 1])[:2]
    except (ValueError, IndexError) as error:
        raise FormatError(f"{folder / 'Field.txt'} has no StartFix.", hint=_AGAIN) from error
    after = lines.index("$FieldDir") + 1 if "$FieldDir" in lines else len(lines)
    name = lines[after] if after < len(lines) else ""
    return folder.name if name in ("", _NAMELESS) else name, LocalPlane(lat, lon)


def _flags(folder: Path, plane: LocalPlane) -> list[tuple[Any, int | None]]:
    """The places of our flags, longitude and latitude, and the numbers of those of obstacles."""
    path = folder / "Flags.txt"
    found = []
    for line in _text(path)[2:] if path.exists() else []:
        parts = line.split(",", 7)
        match = _FLAG.match(parts[-1]) if len(parts) == 8 else None
        if match is not None:
            try:
                lat, lon = _numbers(",".join(parts[:2]))
            except ValueError:
                raise FormatError(f"{path}: {line[:60]!r} is no flag.", hint=_AGAIN) from None
            number = None if match.group(1) is None else int(match.group(1))
            placed = plane.to_plane(lon, lat)
            found.append((shapely.Point(plane.to_lonlat(*placed.T)[0]), number))
    return found


def _sorted_rings(
    rings: list[Any], flags: list[tuple[Any, int | None]]
) -> tuple[list[Any], list[dict[str, Any]]]:
    """Holes of the field, and obstacles with their numbers."""
    if not flags:
        return [], [{"geometry": ring} for ring in rings]
    numbered: dict[int, int] = {}
    for point, number in flags:
        if number is None:
            continue
        around = [index for index, ring in enumerate(rings) if ring.covers(point)]
        if around:
            # An obstacle may stand in a hole of the field: its own ring is centred on its flag.
            nearest = min(around, key=lambda index: rings[index].centroid.distance(point))
            # A ring around several has the lowest of their numbers.
            numbered[nearest] = min(number, numbered.get(nearest, number))
    holes = [ring for index, ring in enumerate(rings) if index not in numbered]
    return holes, [
        {"obstacle_no": number, "geometry": rings[index]} for index, number in numbered.items()
    ]


def boundary_rings(path: Path) -> Iterator[list[list[float]]]:
    """The rings of ``Boundary.txt``: easting, northing and heading of each vertex."""
    lines = [line for line in _text(path)[1:] if line]
    position, number = 0, 1
    try:
        while position < len(lines):
            # One or two words (drive-through, and in old files one more), then the count.
            while lines[position] in ("True", "False"):
                position += 1
            count = int(lines[position])
            rows = lines[position + 1 : position + 1 + count]
            ring = [_numbers(row) for row in rows]
            if len(rows) != count or any(len(vertex) < 2 for vertex in ring):
                raise IndexError
            yield ring
            position, number = position + 1 + count, number + 1
    except (ValueError, IndexError) as error:
        raise FormatError(
            f"{path} breaks off or is damaged in ring {number}.", hint=_AGAIN
        ) from error


def _lines(folder: Path) -> tuple[list[tuple[str, np.ndarray]], list[str]]:
    """The tracks of ``TrackLines.txt`` as names and (n, 2) arrays, and what to tell of them."""
    path = folder / "TrackLines.txt"
    told: list[str] = []
    if not path.exists():
        return [], told
    lines = _text(path)[1:]
    while lines and not lines[-1]:
        lines.pop()
    found, position, number = [], 0, 1
    try:
        while position < len(lines):
            name, _, start, end, nudge, mode, _, count = lines[position : position + 8]
            end_row = position + 8 + int(count)
            if not position + 8 <= end_row <= len(lines):
                raise ValueError
            points = [_numbers(row)[:2] for row in lines[position + 8 : end_row]]
            if int(mode) == _STRAIGHT or len(points) < 2:
                points = [_numbers(start)[:2], _numbers(end)[:2]]
            if int(mode) == _PIVOT:
                told.append(f"track {name!r} left out: it goes around a pivot")
            else:
                found.append((name, np.array(points)))
                if any(_numbers(nudge)):
                    told.append(f"track {name!r} taken where it was drawn, not nudged {nudge} m")
            position, number = end_row, number + 1
    except ValueError as error:
        raise FormatError(
            f"{path} breaks off or is damaged in track {number}.", hint=_AGAIN
        ) from error
    return found, told


def _lonlat_polygon(ring: list[list[float]], plane: LocalPlane) -> Any:
    drawn = shapely.Polygon([vertex[:2] for vertex in ring])
    simple = shapely.simplify(drawn, COLLINEAR_M)
    polygon = simple if simple.is_valid and not simple.is_empty else drawn
    return shapely.transform(polygon, lambda c: plane.to_lonlat(c[:, 0], c[:, 1]))


def _numbers(text: str) -> list[float]:
    """The figures of a line; the first two, its place, are finite."""
    numbers = [float(part) for part in text.split(",")]
    if not all(map(math.isfinite, numbers[:2])):
        raise ValueError(text)
    return numbers


def _text(path: Path) -> list[str]:
    try:
        return [line.strip() for line in path.read_text(encoding="utf-8-sig").splitlines()]
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(f"{path} cannot be read: {error}.", hint=_AGAIN) from error
