"""Writing ISOXML: customers, farms and fields with boundary, obstacles and guidance.

Version 4 has guidance groups; version 3 knows guidance only as lines of the field. None has
been tried on a physical terminal.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import shapely
from numpy.typing import NDArray

from geofield import __version__, schema
from geofield.angles import apart_deg
from geofield.crs import GEOD, ground_areas_m2, ground_scale_of
from geofield.errors import FormatError, refuse_unknown
from geofield.formats.arrow import to_lonlat
from geofield.formats.isoxml.codes import (
    DECIMALS,
    DESIGNATOR,
    DESKTOP,
    EXTEND_NONE,
    REPEAT_BOTH,
    REPEAT_NONE,
    Guidance,
    LineType,
    PointType,
    PolygonType,
)
from geofield.formats.many import last_imagery_day, owner_of
from geofield.formats.names import cut_name, line_names
from geofield.formats.terminal import are_bent, main_field, outline_of, terminal_obstacles
from geofield.formats.xml import node, write_xml
from geofield.formats.zipped import archived
from geofield.model import Dataset

#: Behind the name of a boundary that a person should look at first.
_DOUBTED = " (check)"
#: Tracks whose directions differ by less are of one pattern, degrees.
_SAME_DEG = 0.1


def _write(
    datasets: Sequence[Dataset],
    folder: Path,
    *,
    stem: str,
    options: Mapping[str, Any],
    version: int,
) -> list[Path]:
    """Write ``TASKDATA/TASKDATA.XML`` in ``isoxml`` or ``isoxml-v3``: one file for all fields.

    Options: ``customer`` and ``farm``, names for the terminal where the field has no columns of
    these names; ``zip`` (true: the folder TASKDATA in one archive); of version 4 ``headland``
    (``line``: its inner edge as AgOpenGPS reads it, or ``strip``: the area).
    """
    name = "isoxml" if version == 4 else "isoxml-v3"
    below = folder / name
    path = below / "TASKDATA" / "TASKDATA.XML"
    write_xml(_task_data(datasets, version, options), path)
    if not options.get("zip"):
        return [path]
    day = last_imagery_day(datasets)
    return [archived([path], folder / f"{stem}_{name}.zip", day=day, below=below)]


#: Version 4.3.
write_v4 = partial(_write, version=4)
#: Version 3.3.
write_v3 = partial(_write, version=3)


def _task_data(datasets: Sequence[Dataset], version: int, options: Mapping[str, Any]) -> ET.Element:
    software = datasets[0].provenance.software or f"geofield {__version__}"
    maker, _, number = software.partition(" ")
    root = ET.Element(
        "ISO11783_TaskData",
        VersionMajor=str(version),
        VersionMinor="3",
        ManagementSoftwareManufacturer=maker[:DESIGNATOR],
        ManagementSoftwareVersion=(number or "0")[:DESIGNATOR],
        DataTransferOrigin="1",
    )
    named = [owner_of(each, options) for each in datasets]
    owners = [(customer or "Customer", farm or "Farm") for customer, farm in named]
    names = dict.fromkeys(customer for customer, _ in owners)
    customers = {customer: f"CTR{place}" for place, customer in enumerate(names, start=1)}
    farms = {owner: f"FRM{place}" for place, owner in enumerate(dict.fromkeys(owners), start=1)}
    for customer, own in customers.items():
        ET.SubElement(root, "CTR", A=own, B=cut_name(customer, DESIGNATOR))
    for (customer, farm), own in farms.items():
        ET.SubElement(root, "FRM", A=own, B=cut_name(farm, DESIGNATOR), I=customers[customer])
    groups = itertools.count(1)
    for place, (dataset, owner) in enumerate(zip(datasets, owners, strict=True), start=1):
        polygon = outline_of(dataset, "ISOXML")
        part = ET.SubElement(
            root,
            "PFD",
            A=f"PFD{place}",
            C=cut_name(dataset.name, DESIGNATOR),
            D=str(round(float(ground_areas_m2([polygon], dataset.crs)[0]))),
            E=customers[owner[0]],
            F=farms[owner],
        )
        _add_polygons(part, dataset, polygon, version, options)
        if version == 4:
            _add_guidance_groups(part, dataset, groups)
        else:
            _add_guidance_lines(part, dataset)
    return root


def _add_polygons(
    part: ET.Element, dataset: Dataset, polygon: Any, version: int, options: Mapping[str, Any]
) -> None:
    doubts = dataset.table(schema.FIELD.name)["doubts"].iloc[0]
    # A designator has no room for reasons; that there are some must be seen on the terminal.
    mark = _DOUBTED if isinstance(doubts, str) and doubts else ""
    name = cut_name(dataset.name, DESIGNATOR - len(mark)) + mark
    obstacles = terminal_obstacles(dataset, polygon)
    # Some readers pass over the holes of a boundary: each is an obstacle of its own, too.
    holes = [shapely.orient_polygons(shapely.Polygon(ring)) for ring in polygon.interiors]
    shapes = [(PolygonType.BOUNDARY, name, polygon)]
    shapes += [(PolygonType.OBSTACLE, each.name, each.shape) for each in obstacles]
    shapes += [
        (PolygonType.OBSTACLE, f"Hole {number}", hole) for number, hole in enumerate(holes, start=1)
    ]
    if version == 4:
        shapes += [
            (PolygonType.HEADLAND, f"Headland {number}", shape)
            for number, shape in enumerate(_headland(dataset, polygon, options), start=1)
        ]
    placed = np.array([shape for _, _, shape in shapes], dtype=object)
    areas_m2 = ground_areas_m2(placed, dataset.crs)
    rows = zip(shapes, areas_m2, to_lonlat(placed, dataset.crs), strict=True)
    part.extend(_polygon(kind, each, area_m2, lonlat) for (kind, each, _), area_m2, lonlat in rows)
    trees = [tree for each in obstacles for tree in each.trees] if version == 4 else []
    centres = to_lonlat(np.array([centre for _, centre in trees], dtype=object), dataset.crs)
    for (number, _), centre in zip(trees, centres, strict=True):
        place = (centre.x, centre.y)
        part.append(_point(PointType.OBSTACLE, place, B=f"Obstacle {number}"))


def _headland(dataset: Dataset, polygon: Any, options: Mapping[str, Any]) -> list[Any]:
    """The polygons that stand for the headland.

    AgOpenGPS, the one program known to read them, takes the exterior ring for the line at which
    machines turn: the headland's inner edge. As the standard's words have it, the strip itself.
    """
    wanted = options.get("headland", "line")
    refuse_unknown(FormatError, "headland", wanted, ("line", "strip"))
    if wanted == "strip":
        return list(dataset.table("headland").explode(ignore_index=True).geometry)
    return [shapely.Polygon(part.exterior) for part in main_field(dataset, polygon)]


def _polygon(kind: PolygonType, name: str, area_m2: float, lonlat: Any) -> ET.Element:
    rings = [(LineType.EXTERIOR, lonlat.exterior)]
    rings += [(LineType.INTERIOR, ring) for ring in lonlat.interiors]
    lines = (node("LSG", {"A": role}, *_points(ring)) for role, ring in rings)
    return node("PLN", *lines, A=kind, B=cut_name(name, DESIGNATOR), C=str(round(area_m2)))


def _add_guidance_groups(part: ET.Element, dataset: Dataset, numbers: Iterator[int]) -> None:
    """One group per line: some readers look at the first pattern of a group only."""
    pattern = _pattern(dataset)
    width = _width(pattern)
    if pattern is not None:
        lonlat = to_lonlat(np.array([pattern.line], dtype=object), dataset.crs)[0]
        # The terminal may lay the same pattern itself from this one line.
        how = {"E": REPEAT_BOTH}
        sides = {"N": str(pattern.count(-1)), "O": str(pattern.count(1))}
        part.append(_group(next(numbers), "Reference AB", lonlat, width, how, sides))
    for name, lonlat in _lines(dataset):
        how = {"E": REPEAT_NONE, "F": EXTEND_NONE}
        part.append(_group(next(numbers), name, lonlat, width, how, {}))


def _group(
    number: int,
    name: str,
    lonlat: Any,
    width: Mapping[str, str],
    how: Mapping[str, str],
    sides: Mapping[str, str],
) -> ET.Element:
    inner = len(lonlat.coords) - 2
    straight = {} if inner else {"G": f"{_heading_deg(lonlat):.4f}"}
    kinds = [PointType.GUIDANCE_A, *[PointType.GUIDANCE_POINT] * inner, PointType.GUIDANCE_B]
    line = node("LSG", {"A": LineType.GUIDANCE}, width, *map(_point, kinds, lonlat.coords))
    pattern = node(
        "GPN",
        {"A": f"GPN{number}", "B": name, "C": Guidance.CURVE if inner else Guidance.AB},
        how,
        straight,
        {"I": DESKTOP},
        sides,
        line,
    )
    return node("GGP", pattern, A=f"GGP{number}", B=name)


def _add_guidance_lines(part: ET.Element, dataset: Dataset) -> None:
    width = _width(_pattern(dataset))
    for name, lonlat in _lines(dataset):
        part.append(node("LSG", {"A": LineType.GUIDANCE, "B": name}, width, *_points(lonlat)))


def _lines(dataset: Dataset) -> Iterator[tuple[str, Any]]:
    """The names of the segments, and their lines in longitude and latitude."""
    segments = dataset.table(schema.SEGMENTS.name)
    placed = to_lonlat(np.asarray(segments.geometry.to_numpy(), dtype=object), dataset.crs)
    names = (cut_name(name, DESIGNATOR) for name in line_names(segments))
    return zip(names, placed, strict=True)


def _points(line: Any) -> Iterator[ET.Element]:
    return (_point(PointType.OTHER, place) for place in line.coords)


def _point(kind: PointType, place: tuple[float, float], **name: str) -> ET.Element:
    lon, lat = place
    position = {"C": f"{lat:.{DECIMALS}f}", "D": f"{lon:.{DECIMALS}f}"}
    return node("PNT", {"A": kind}, name, position)


def _heading_deg(line: Any) -> float:
    """True heading from A to B, degrees clockwise from north, 0 to 360."""
    (lon0, lat0), (lon1, lat1) = line.coords
    azimuth, _, _ = GEOD.inv(lon0, lat0, lon1, lat1)
    return round(float(azimuth) % 360.0, 4) % 360.0


@dataclass(frozen=True, slots=True)
class _Pattern:
    """What a terminal may lay itself from one line."""

    #: The first track that has the field's direction, straight.
    line: shapely.LineString
    #: How far the others lie right of it, metres on the ground.
    right_m: NDArray[np.float64]
    #: Distance of neighbouring tracks; None of a single one that nobody planned.
    spacing_m: float | None

    def count(self, side: int) -> int:
        """How many lines fit in on the right (1) or left (-1), none beyond the last track."""
        if not self.spacing_m:
            return 0
        return int(max(0.0, float((side * self.right_m).max()) / self.spacing_m) + 0.01)


def _pattern(dataset: Dataset) -> _Pattern | None:
    """The pattern that the tracks were laid in: not the lines that a person drew across it."""
    tracks = dataset.table(schema.TRACKS.name)
    shapes = np.asarray(tracks.geometry.to_numpy(), dtype=object)
    headings = tracks["heading_deg"].to_numpy(dtype=np.float64)
    known = np.sort(headings[np.isfinite(headings)])
    if not len(known):
        return None
    turned = apart_deg(headings, known[len(known) // 2])
    kept = shapes[(turned < _SAME_DEG) & ~are_bent(shapes)]
    if not len(kept):
        return None
    ends = np.array([shapely.get_coordinates(line)[[0, -1]] for line in kept])
    start, end = ends[0]
    along = (end - start) / np.hypot(*(end - start))
    scale = ground_scale_of(dataset.table(schema.FIELD.name).geometry.iloc[0], dataset.crs)
    right_m = (ends.mean(axis=1) - start) @ (along[1], -along[0]) / scale
    # Where a person took tracks away, neighbours are farther apart than the pattern.
    spacing_m = dataset.provenance.evidence.get("tracks", {}).get("spacing_m")
    if spacing_m is None:
        steps = np.diff(np.sort(right_m))
        spacing_m = float(np.median(steps[steps > 0.01])) if (steps > 0.01).any() else None
    return _Pattern(shapely.LineString([start, end]), right_m, spacing_m)


def _width(pattern: _Pattern | None) -> dict[str, str]:
    """The distance of neighbouring tracks, whole millimetres, as C; nothing where it is unknown."""
    spacing_m = None if pattern is None else pattern.spacing_m
    return {"C": str(round(spacing_m * 1000))} if spacing_m else {}
