"""Reading ISOXML of versions 3 and 4: boundary, obstacles and guidance lines."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import shapely

from geofield.crossings import mended
from geofield.errors import FormatError, SeveralFieldsError
from geofield.formats.foreign import RawLayer, read_foreign
from geofield.formats.isoxml.codes import LineType, PointType, PolygonType
from geofield.formats.isoxml.guidance import figure, guidance_lines, polyline, position
from geofield.formats.registry import task_file
from geofield.formats.xml import read_xml
from geofield.model import Dataset
from geofield.wording import counted

#: What no vehicle may enter; a boundary's own holes stay holes.
_STANDING = {
    PolygonType.OBSTACLE,
    PolygonType.WATER,
    PolygonType.BUILDING,
    PolygonType.ROAD,
    PolygonType.WINDBREAK,
}
_STANDING_LINES = {LineType.OBSTACLE, LineType.FENCE}
#: What is in a field, its types, those that are obstacles, and those of which nothing is told.
_PARTS: tuple[tuple[str, str, type[StrEnum], Collection[str], Collection[str]], ...] = (
    ("PLN", "polygon", PolygonType, _STANDING, {PolygonType.BOUNDARY, PolygonType.OBSTACLE}),
    ("LSG", "line", LineType, _STANDING_LINES, {LineType.GUIDANCE, LineType.OBSTACLE}),
    ("PNT", "point", PointType, (), {PointType.OBSTACLE}),
)
_NUMBERS = re.compile(r"^Obstacle (\d+)(?:\+[\d+]*…?)?$")
#: How much of an obstacle's area may differ from a hole that it stands for.
_SAME_AREA = 1e-4


def read(path: Path) -> Dataset:
    """The one field in a ``TASKDATA.XML``, or in the folder that holds it.

    Raises
    ------
    FormatError
        When there is no field or more than one, or the file is damaged.
    """
    file, fields = _fields(path)
    if len(fields) != 1:
        if not fields:
            raise FormatError(
                f"{file} holds no field (PFD).",
                hint="Export the field with the task data from the terminal or farm program.",
            )
        names = ", ".join(str(field.get("C")) for field in fields[:5])
        raise SeveralFieldsError(
            f"{file} holds {len(fields)} fields ({names}); a dataset is one field.",
            hint="Export the one you want from the terminal or farm program alone.",
        )
    return _dataset(fields[0], file)


def several(path: Path) -> list[tuple[str, Callable[[], Dataset]]]:
    """The name of every field in task data, and what reads it."""
    file, fields = _fields(path)
    return [(str(field.get("C")), partial(_dataset, field, file)) for field in fields]


def _fields(path: Path) -> tuple[Path, list[ET.Element]]:
    file = task_file(path)
    root = read_xml(file)
    return file, [*root.iter("PFD"), *_external(root, file.parent)]


def _dataset(field: ET.Element, file: Path) -> Dataset:
    _unwrap(field)
    boundaries = [
        {"name": field.get("C"), "geometry": shape}
        for element in field.findall("PLN")
        if element.get("A") == PolygonType.BOUNDARY
        for shape in _polygons(element)
    ]
    outline = shapely.union_all([_sound(row["geometry"]) for row in boundaries])
    lines, lines_told = guidance_lines(field, outline)
    layers = {
        "boundary": boundaries,
        "obstacles": list(_obstacles(field, outline)),
        "guidance": lines,
    }
    found = [RawLayer.of_rows(name, rows) for name, rows in layers.items() if rows]
    dataset = read_foreign(found, file, name=field.get("C") or file.parent.name)
    return replace(dataset, notes=(*_told(field), *lines_told))


def _external(root: ET.Element, folder: Path) -> list[ET.Element]:
    """Fields in the files that XFR elements name."""
    fields = []
    for reference in root.iter("XFR"):
        name = f"{reference.get('A')}.XML"
        if name.startswith("PFD"):
            matching = [file for file in folder.iterdir() if file.name.upper() == name.upper()]
            if not matching:
                raise FormatError(
                    f"{folder} lacks {name}, to which TASKDATA.XML refers.",
                    hint="Copy the whole folder TASKDATA: its files belong together.",
                )
            fields += list(read_xml(matching[0]).iter("PFD"))
    return fields


def _unwrap(field: ET.Element) -> None:
    """Give the positions of a field across 180 degrees longitudes that go on beyond."""
    points = list(field.iter("PNT"))
    lons = np.array([position(point)[0] for point in points])
    if len(lons) and np.ptp(lons) > 180.0:
        for point, lon in zip(points, lons, strict=True):
            point.set("D", repr(float(lon % 360.0)))


def _told(field: ET.Element) -> Iterable[str]:
    """What was taken for obstacles without the name, and what is left out, for people."""
    for tag, what, types, standing, plain in _PARTS:
        names = {each.value: each.name.lower().replace("_", " ") for each in types}
        found = Counter(str(element.get("A")) for element in field.findall(tag))
        for code, count in sorted(found.items()):
            name = names.get(code, f"type {code}")
            if code in standing and code not in plain:
                yield f"{counted(count, what)} of type {name} taken as obstacles"
            elif code not in plain:
                yield f"{counted(count, what)} left out: {name}"
    zones = len(field.findall("TZN"))
    if zones:
        yield f"{counted(zones, 'treatment zone')} left out"


def _obstacles(field: ET.Element, outline: Any) -> Iterable[dict[str, Any]]:
    """Obstacle polygons and lines, and obstacle points in no polygon of their name or number."""
    points = [
        (point.get("B", ""), shapely.Point(position(point)))
        for point in field.findall("PNT")
        if point.get("A") == PointType.OBSTACLE
    ]
    holes = [
        shapely.Polygon(ring)
        for part in shapely.get_parts(outline)
        if part.geom_type == "Polygon"
        for ring in part.interiors
    ]
    for element in field.findall("PLN"):
        if element.get("A") not in _STANDING:
            continue
        name = element.get("B", "")
        inside = {name, *(f"Obstacle {number}" for number in re.findall(r"\d+", name))}
        if name.endswith("…") and _NUMBERS.match(name):  # cut: any other one may be in it, too
            inside |= {each for each, _ in points if _NUMBERS.match(each)}
        for shape in _polygons(element):
            if any(_same(shape, hole) for hole in holes):
                continue
            ground = _sound(shape)
            here = [each for each in points if each[0] in inside and ground.covers(each[1])]
            points = [each for each in points if each not in here]
            yield {
                "obstacle_no": _number_in(name),
                "kind": "tree" if here else "other",
                "geometry": shape,
            }
    for line in field.findall("LSG"):
        shape = polyline(line)
        if line.get("A") in _STANDING_LINES and shape is not None:
            yield {"radius_m": figure(line, "C", "0") / 2000.0, "kind": "other", "geometry": shape}
    for name, point in points:
        yield {"obstacle_no": _number_in(name), "kind": "tree", "geometry": point}


def _sound(shape: Any) -> Any:
    """A shape to compare with, of one that may cross itself."""
    return shape if shape.is_valid else mended(shape)


def _number_in(name: str) -> int | None:
    """The first number of an obstacle's name."""
    match = _NUMBERS.match(name)
    return None if match is None else int(match.group(1))


def _same(shape: Any, hole: Any) -> bool:
    """Whether an obstacle is there for readers that pass over the holes of a boundary."""
    return bool(
        shape.is_valid
        and hole.is_valid
        and shapely.intersects(shape, hole)
        and shapely.symmetric_difference(shape, hole).area < _SAME_AREA * hole.area
    )


def _polygons(element: ET.Element) -> Iterable[Any]:
    """One polygon per exterior ring; holes go to the ring they lie in."""
    outer: list[Any] = []
    inner: list[Any] = []
    for line in element.findall("LSG"):
        positions = [position(point) for point in line.findall("PNT")]
        if len(positions) >= 3:
            (inner if line.get("A") == LineType.INTERIOR else outer).append(positions)
    for positions in outer:
        shell = shapely.Polygon(positions)
        # Its first corner may lie on the border, a rounding beyond it.
        holes = [
            hole for hole in inner if shell.covers(shapely.Polygon(hole).representative_point())
        ]
        yield shapely.Polygon(positions, holes)
