"""Guidance lines of ISOXML: patterns of version 4, and lines of the field itself.

AB lines and curves are lines as they stand. An A+ line has one point and a heading: it is drawn
through the field. A pivot has a centre and a radius: it is an arc or a circle.
"""

from __future__ import annotations

import math
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import shapely

from geofield.crs import GEOD
from geofield.errors import FormatError
from geofield.formats.isoxml.codes import (
    CLOCKWISE,
    COUNTER_CLOCKWISE,
    REPEAT_NONE,
    Guidance,
    LineType,
    PointType,
)
from geofield.wording import counted

#: Steps of an arc, degrees: 2 mm between arc and chord at 50 m.
_ARC_STEP_DEG = 1.0
#: Half the length of an A+ line where there is no field to draw it through, metres.
_REACH_M = 500.0


def guidance_lines(field: ET.Element, outline: Any) -> tuple[list[dict[str, Any]], list[str]]:
    """The lines to drive in a field (a PFD), and what was drawn or left out, for people.

    A line that a terminal is to repeat is left out where explicit lines are there. The outline
    and the lines, a row each, are in degrees.
    """
    rows: list[dict[str, Any]] = []
    repeated: list[dict[str, Any]] = []
    notes: list[str] = []
    for pattern in field.iter("GPN"):
        name = pattern.get("B") or ""
        for line in pattern.findall("LSG"):
            shape, note = _pattern_line(pattern, line, outline)
            if shape is None:
                notes.append(f"guidance {name!r} left out: {note}")
                continue
            notes += [f"guidance {name!r}: {note}"] if note else []
            into = rows if pattern.get("E", REPEAT_NONE) == REPEAT_NONE else repeated
            into.append({"name": name, "geometry": shape})
    for line in field.findall("LSG"):
        shape = polyline(line)
        if line.get("A") == LineType.GUIDANCE and shape is not None:
            rows.append({"name": line.get("B") or "", "geometry": shape})
    if rows and repeated:
        names = ", ".join(row["name"] for row in repeated[:3])
        notes.append(
            f"{counted(len(repeated), 'line')} to be repeated left out, others being there: {names}"
        )
    return rows or repeated, notes


def position(point: ET.Element) -> tuple[float, float]:
    """Longitude and latitude of a PNT, degrees."""
    return figure(point, "D", ""), figure(point, "C", "")


def figure(element: ET.Element, attribute: str, usual: str) -> float:
    """A figure of an element, which is finite."""
    text = element.get(attribute, usual)
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise FormatError(
            f"{element.tag} {attribute}={text!r} is no number.",
            hint="Export the task data again from the terminal or farm program.",
        )
    return number


def _pattern_line(pattern: ET.Element, line: ET.Element, outline: Any) -> tuple[Any, str]:
    """The shape of a pattern, and what to tell of it; None where it cannot be drawn."""
    kind = pattern.get("C")
    if kind == Guidance.PIVOT:
        return _pivot(pattern, line)
    shape = polyline(line)
    if kind == Guidance.A_PLUS and shape is None:
        return _through(pattern, line, outline)
    return shape, "" if shape is not None else "fewer than two points"


def polyline(line: ET.Element) -> Any:
    """An LSG as it stands; None of fewer than two points."""
    positions = [position(point) for point in line.findall("PNT")]
    return shapely.LineString(positions) if len(positions) >= 2 else None


def _through(pattern: ET.Element, line: ET.Element, outline: Any) -> tuple[Any, str]:
    """A line through one point along a heading, as far as the field reaches."""
    points = line.findall("PNT")
    if not points or pattern.get("G") is None:
        return None, "an A+ line without a point or heading"
    lon, lat = position(points[0])
    heading_deg = figure(pattern, "G", "")
    reach_m = _REACH_M
    if not outline.is_empty:
        corners = shapely.get_coordinates(outline)
        start = np.full(len(corners), lon), np.full(len(corners), lat)
        reach_m = float(np.max(GEOD.inv(*start, corners[:, 0], corners[:, 1])[2]))
    both = (GEOD.fwd(lon, lat, heading_deg + turn, reach_m) for turn in (180.0, 0.0))
    # On across 180, where the outline goes on, too.
    ends = [(lon + (x - lon + 180.0) % 360.0 - 180.0, y) for x, y, _ in both]
    whole = shapely.LineString([ends[0], (lon, lat), ends[1]])
    parts = shapely.get_parts(shapely.intersection(whole, outline))
    inside = [part for part in parts if part.geom_type == "LineString"]
    if inside:
        xy = shapely.get_coordinates(inside)
        return shapely.LineString([xy[0], xy[-1]]), "an A+ line, drawn through the field"
    return shapely.LineString(ends), "an A+ line, drawn as far as the field reaches"


def _pivot(pattern: ET.Element, line: ET.Element) -> tuple[Any, str]:
    """The arc that a pivot's outer end draws, or its circle."""
    by_kind = {point.get("A"): position(point) for point in line.findall("PNT")}
    centre = by_kind.get(PointType.GUIDANCE_CENTRE)
    ends = [by_kind.get(kind) for kind in (PointType.GUIDANCE_A, PointType.GUIDANCE_B)]
    if centre is None:
        return None, "a pivot without a centre"
    azimuths, distances = [], []
    for end in ends:
        if end is not None:
            azimuth, _, distance = GEOD.inv(*centre, *end)
            azimuths.append(azimuth)
            distances.append(distance)
    # H is in millimetres; without it the first point lies on the arc.
    radius_m = figure(pattern, "H", "0") / 1000.0 or (distances[0] if distances else 0.0)
    if radius_m <= 0.0:
        return None, "a pivot without a radius"
    start, turn = (azimuths[0] if azimuths else 0.0), 360.0
    direction = pattern.get("D")
    if len(azimuths) == 2 and direction in (CLOCKWISE, COUNTER_CLOCKWISE):
        turn = (azimuths[1] - azimuths[0]) % 360.0 or 360.0
        turn = turn if direction == CLOCKWISE else turn - 360.0
    angles = start + np.linspace(0.0, turn, max(int(abs(turn) / _ARC_STEP_DEG), 8) + 1)
    here = np.full(len(angles), centre[0]), np.full(len(angles), centre[1])
    lon, lat, _ = GEOD.fwd(here[0], here[1], angles, np.full(len(angles), radius_m))
    return shapely.LineString(np.column_stack([lon, lat])), f"a pivot of {radius_m:.1f} m"
