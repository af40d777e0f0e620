"""Rules of RFC 7946."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from geofield.formats.foreign import files_in
from geofield.formats.validation import Finding


def check(path: Path) -> Iterator[Finding]:
    """Findings in a GeoJSON file, or in all of a folder."""
    for file in files_in(path, ".geojson", ".json"):
        yield from _check_file(file)


def _check_file(file: Path) -> Iterator[Finding]:
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        yield Finding("error", file.name, f"not JSON in UTF-8: {error}")
        return
    if not isinstance(content, dict) or content.get("type") not in ("FeatureCollection", "Feature"):
        yield Finding("error", file.name, "neither a FeatureCollection nor a Feature")
        return
    if "crs" in content:
        yield Finding("error", file.name, "a crs member: RFC 7946 knows WGS 84 only (section 4)")
    features = content.get("features", [content])
    for index, feature in enumerate(features, start=1):
        yield from _check_feature(feature, f"{file.name}, feature {index}")


def _check_feature(feature: Any, where: str) -> Iterator[Finding]:
    if not isinstance(feature, dict) or feature.get("type") != "Feature":
        yield Finding("error", where, "no Feature (section 3.2)")
        return
    geometry = feature.get("geometry")
    if geometry is None:
        yield Finding("warning", where, "no geometry")
        return
    if geometry.get("type") == "GeometryCollection":
        yield Finding("warning", where, "a GeometryCollection: avoid it (section 3.1.8)")
        return
    try:
        shape = shapely.from_geojson(json.dumps(geometry))
    except shapely.errors.GEOSException as error:
        yield Finding("error", where, f"the geometry cannot be read: {error}")
        return
    coordinates = shapely.get_coordinates(shape)
    if np.any(np.abs(coordinates) > [180.0, 90.0]):
        yield Finding(
            "error", where, "positions outside longitude 180, latitude 90: not WGS 84, or swapped"
        )
    for polygon in shapely.get_parts(shape):
        if polygon.geom_type == "Polygon" and not polygon.is_empty:
            inner = any(shapely.is_ccw(ring) for ring in polygon.interiors)
            if inner or not shapely.is_ccw(polygon.exterior):
                words = "rings do not follow the right-hand rule (section 3.1.6)"
                yield Finding("error", where, words)
