"""What files say of their CRS that readers pass over: rows in another one, GeoJSON of metres."""

from __future__ import annotations

import json
import sqlite3
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from geofield.crs import parse_crs
from geofield.errors import CRSError
from geofield.strangers import database

_GEOJSON = (".geojson", ".json")
#: No longitude is beyond it, also where they go on across 180 degrees.
_ROUND_DEG = 360.0
_HINT = "One file has one CRS: ogr2ogr -t_srs EPSG:4326 {} FILE, for each part by itself."


def said_crs(path: Path, crs: Any, shapes: Callable[[], NDArray[np.object_]]) -> Any:
    """The CRS that a file says, which is `crs` to GDAL.

    A GeoJSON file without a word of it is in degrees by its standard alone: where its `shapes` are
    beyond all degrees it says none.
    """
    if path.suffix.lower() not in _GEOJSON or not path.is_file():
        return crs
    bounds = np.abs(shapely.bounds(shapes()))
    beyond = bool(np.any(bounds[np.isfinite(bounds)] > _ROUND_DEG))
    return None if beyond and b'"crs"' not in path.read_bytes() else crs


def refuse_other_rows(path: Path, layer: str | None, crs: Any) -> None:
    """Refuse a file of which rows say by themselves that they are in another CRS.

    `layer` is one of a GeoPackage; `crs` is what the file says.

    Raises
    ------
    CRSError
    """
    suffix = path.suffix.lower()
    found: tuple[int, str] | None = None
    if suffix in _GEOJSON and path.is_file():
        found = next(_geojson(path, crs), None)
    elif suffix == ".gpkg":
        found = _geopackage(path, layer)
    if found is not None:
        row, name = found
        raise CRSError(
            f"{path.name}: row {row} is in {name} by its own word, and the file in another CRS.",
            hint=_HINT.format(f"right{suffix}"),
        )


def _geojson(path: Path, crs: Any) -> Iterator[tuple[int, str]]:
    """Features with a `crs` of their own (as before RFC 7946), in the feature or its geometry."""
    data = path.read_bytes()
    first = data.find(b'"crs"')
    features = data.find(b'"features"')
    if first < 0 or (first < features and data.find(b'"crs"', first + 1) < 0):
        return  # none, or only the one of the whole
    try:
        content = json.loads(data)
    except ValueError:
        return  # GDAL has its own word for it
    rows = content.get("features") if isinstance(content, dict) else None
    for row, feature in enumerate(rows if isinstance(rows, list) else (), 1):
        for one in (feature, feature.get("geometry")) if isinstance(feature, dict) else ():
            said = one.get("crs") if isinstance(one, dict) else None
            name = said.get("properties", {}).get("name") if isinstance(said, dict) else None
            if name and crs and not _same(str(name), crs):
                yield row, str(name)


def _same(one: str, other: Any) -> bool:
    try:
        return parse_crs(one).equals(parse_crs(other), ignore_axis_order=True)
    except CRSError:
        return False


def _geopackage(path: Path, layer: str | None) -> tuple[int, str] | None:
    """The first row whose geometry names another system than its table."""
    tables = "SELECT table_name, column_name, srs_id FROM gpkg_geometry_columns"
    try:
        with database(path) as file:
            for table, column, own in file.execute(tables).fetchall():
                if layer not in (None, table):
                    continue
                # Magic, version, flags, and then the system: GeoPackage 1.3, 2.1.3.
                head = f'substr("{column}", 4, 5)'
                for (found,) in file.execute(f'SELECT DISTINCT {head} FROM "{table}"').fetchall():  # noqa: S608
                    if found is None or len(found) < 5:
                        continue
                    (said,) = struct.unpack("<i" if found[0] & 1 else ">i", found[1:5])
                    if said > 0 and said != own:
                        rows = file.execute(f'SELECT {head} FROM "{table}"').fetchall()  # noqa: S608
                        return rows.index((found,)) + 1, f"system {said}"
    except sqlite3.Error:
        return None  # GDAL has its own word for it
    return None
