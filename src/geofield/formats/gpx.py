"""GPX 1.1: one ``trk`` per track with one ``trkseg`` per segment, a waypoint per obstacle."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import shapely

from geofield import schema
from geofield.formats.arrow import exact_geometry, to_lonlat
from geofield.formats.origin import imagery_day, lineage
from geofield.formats.terminal import avoided
from geofield.formats.xml import node, write_xml
from geofield.model import Dataset

GPX = "http://www.topografix.com/GPX/1/1"
_SCHEMA = "http://www.w3.org/2001/XMLSchema-instance"
DECIMALS = 9


def write(dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]) -> list[Path]:
    """Write ``{stem}.gpx``."""
    day = imagery_day(dataset)
    metadata = [node("name", dataset.name), node("desc", lineage(dataset))]
    metadata += [node("time", f"{day}T00:00:00Z")] if day is not None else []
    about = {
        "version": "1.1",
        "creator": dataset.provenance.software or "geofield",
        "xmlns": GPX,
        "xmlns:xsi": _SCHEMA,
        "xsi:schemaLocation": f"{GPX} {GPX}/gpx.xsd",
    }
    root = node("gpx", about, node("metadata", *metadata), *_waypoints(dataset), *_tracks(dataset))
    path = folder / f"{stem}.gpx"
    write_xml(root, path)
    return [path]


def _waypoints(dataset: Dataset) -> Iterator[ET.Element]:
    obstacles = avoided(dataset)
    centres = shapely.centroid(np.asarray(obstacles.geometry.to_numpy(), dtype=object))
    places = shapely.get_coordinates(to_lonlat(centres, dataset.crs))
    for row, (lon, lat) in zip(obstacles.to_dict("records"), places, strict=True):
        name = node("name", f"Obstacle {row['obstacle_no']}")
        yield node("wpt", _position(lon, lat), name, node("desc", _describe(row)))


def _tracks(dataset: Dataset) -> Iterator[ET.Element]:
    table = dataset.table(schema.TRACKS.name)
    shapes = to_lonlat(exact_geometry(schema.TRACKS, table), dataset.crs)
    for number, shape in zip(table["track_no"], shapes, strict=True):
        segments = (
            node("trkseg", *(node("trkpt", _position(lon, lat)) for lon, lat in part.coords))
            for part in shape.geoms
        )
        yield node("trk", node("name", f"Track {number}"), node("number", str(number)), *segments)


def _position(lon: float, lat: float) -> dict[str, str]:
    # GPX has no longitude 180, only -180.
    lon = (round(lon, DECIMALS) + 180.0) % 360.0 - 180.0
    return {"lat": f"{lat:.{DECIMALS}f}", "lon": f"{lon:.{DECIMALS}f}"}


def _describe(row: Mapping[str, Any]) -> str:
    words = [str(row["kind"]) if isinstance(row["kind"], str) else "obstacle"]
    if np.isfinite(row["radius_m"]):
        words.append(f"radius {row['radius_m']:.2f} m")
    if np.isfinite(row["buffer_m"]):
        words.append(f"safety margin {row['buffer_m']:.2f} m")
    return ", ".join(words)
