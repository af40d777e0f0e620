"""Reading ISOXML of versions 3 and 4: boundary, obstacles and guidance lines."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import shapely

from geofield.crs import LONLAT
from geofield.errors import FormatError
from geofield.formats.foreign import RawLayer, read_foreign
from geofield.formats.isoxml.codes import LineType, PointType, PolygonType
from geofield.formats.xml import read_xml
from geofield.model import Dataset

#: Polygons that no vehicle may enter: obstacle, and the boundary's own holes stay holes.
_OBSTACLE_POLYGONS = (PolygonType.OBSTACLE,)
_NUMBERS = re.compile(r"^(?:Obstacle|Track) (\d+)(?:-(\d+))?$")


def read(path: Path) -> Dataset:
    """The one field in a ``TASKDATA.XML``, or in the folder that holds it.

    Raises
    ------
    FormatError
        When there is no field or more than one, or the file is damaged.
    """
    file = task_file(path)
    root = read_xml(file)
    fields = [*root.iter("PFD"), *_external(root, file.parent)]
    if len(fields) != 1:
        names = ", ".join(str(field.get("C")) for field in fields[:5])
        raise FormatError(
            f"{file} holds {len(fields)} fields ({names}); a dataset is one field.",
            hint="Export the one you want from the terminal or farm program alone.",
        )
    field = fields[0]
    _unwrap(field)
    layers = [
        _layer("boundary", list(_boundaries(field))),
        _layer("obstacles", list(_obstacles(field))),
        _layer("guidance", list(_guidance(field))),
    ]
    found = [layer for layer in layers if layer is not None]
    return read_foreign(found, file, name=field.get("C") or file.parent.name)


def task_file(path: Path) -> Path:
    """The ``TASKDATA.XML`` that a path means: itself, in it, or in its ``TASKDATA`` folder."""
    if path.is_file():
        return path
    for folder in (path, *(p for p in sorted(path.iterdir()) if p.name.upper() == "TASKDATA")):
        for file in sorted(folder.iterdir()):
            if file.name.upper() == "TASKDATA.XML":
                return file
    raise FormatError(f"{path} holds no TASKDATA.XML.")


def _external(root: ET.Element, folder: Path) -> list[ET.Element]:
    """Fields in the files that XFR elements name."""
    fields = []
    for reference in root.iter("XFR"):
        name = f"{reference.get('A')}.XML"
        if name.startswith("PFD"):
            matching = [file for file in folder.iterdir() if file.name.upper() == name.upper()]
            if not matching:
                raise FormatError(f"{folder} lacks {name}, to which TASKDATA.XML refers.")
            fields += list(read_xml(matching[0]).iter("PFD"))
    return fields


def _unwrap(field: ET.Element) -> None:
    """Give the positions of a field across 180 degrees longitudes that go on beyond."""
    points = list(field.iter("PNT"))
    lons = np.array([_position(point)[0] for point in points])
    if len(lons) and np.ptp(lons) > 180.0:
        for point, lon in zip(points, lons, strict=True):
            point.set("D", repr(float(lon % 360.0)))


def _layer(name: str, rows: list[dict[str, Any]]) -> RawLayer | None:
    import geopandas as gpd

    if not rows:
        return None
    return RawLayer(name, gpd.GeoDataFrame(rows, geometry="geometry", crs=LONLAT))


def _boundaries(field: ET.Element) -> Iterable[dict[str, Any]]:
    for element in field.iter("PLN"):
        if element.get("A") == PolygonType.BOUNDARY:
            for shape in _polygons(element):
                yield {"name": field.get("C"), "geometry": shape}


def _obstacles(field: ET.Element) -> Iterable[dict[str, Any]]:
    """Obstacle polygons, and obstacle points where no polygon has the same name."""
    points = {
        point.get("B", f"#{index}"): point
        for index, point in enumerate(field.findall("PNT"))
        if point.get("A") == PointType.OBSTACLE
    }
    for element in field.iter("PLN"):
        if element.get("A") not in _OBSTACLE_POLYGONS:
            continue
        name = element.get("B", "")
        tree = points.pop(name, None) is not None
        for shape in _polygons(element):
            yield {
                "obstacle_no": _number(name, 1),
                "kind": "tree" if tree else "other",
                "geometry": shape,
            }
    for name, point in points.items():
        yield {
            "obstacle_no": _number(name, 1),
            "kind": "tree",
            "geometry": shapely.Point(_position(point)),
        }


def _guidance(field: ET.Element) -> Iterable[dict[str, Any]]:
    """Lines of guidance patterns (version 4) and of the field itself (version 3).

    The one line that a terminal is to repeat is left out where explicit lines are there.
    """
    rows: list[dict[str, Any] | None] = []
    references: list[dict[str, Any] | None] = []
    for pattern in field.iter("GPN"):
        for line in pattern.findall("LSG"):
            row = _line(line, pattern.get("B") or "")
            (references if pattern.get("E", "4") != "4" else rows).append(row)
    rows += [
        _line(line, line.get("B") or "")
        for line in field.findall("LSG")
        if line.get("A") == LineType.GUIDANCE
    ]
    return [row for row in rows or references if row is not None]


def _line(element: ET.Element, name: str) -> dict[str, Any] | None:
    positions = [_position(point) for point in element.findall("PNT")]
    if len(positions) < 2:
        return None
    return {
        "name": name,
        "track_no": _number(name, 1),
        "segment_no": _number(name, 2, default=1),
        "geometry": shapely.LineString(positions),
    }


def _number(name: str, group: int, default: int | None = None) -> int | None:
    match = _NUMBERS.match(name)
    if match is None:
        return None
    return int(match.group(group)) if match.group(group) else default


def _polygons(element: ET.Element) -> Iterable[Any]:
    """One polygon per exterior ring; holes go to the ring they lie in."""
    outer: list[Any] = []
    inner: list[Any] = []
    for line in element.findall("LSG"):
        positions = [_position(point) for point in line.findall("PNT")]
        if len(positions) >= 3:
            (inner if line.get("A") == LineType.INTERIOR else outer).append(positions)
    for positions in outer:
        shell = shapely.Polygon(positions)
        holes = [hole for hole in inner if shell.covers(shapely.Point(hole[0]))]
        yield shapely.Polygon(positions, holes)


def _position(point: ET.Element) -> tuple[float, float]:
    """Longitude and latitude."""
    try:
        return float(point.get("D", "")), float(point.get("C", ""))
    except ValueError as error:
        raise FormatError(
            f"A point's position is not two numbers: C={point.get('C')!r}, D={point.get('D')!r}."
        ) from error
