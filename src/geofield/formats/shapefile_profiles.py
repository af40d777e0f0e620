"""Shapefiles as people and two families of farm terminals want them.

Each profile yields the Shapefiles to write. None has been tried on a physical terminal.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from geofield import schema
from geofield.crs import ground_areas_m2
from geofield.formats.arrow import cut_lonlat
from geofield.formats.names import line_names, safe_name
from geofield.formats.shapefile_layer import Column, ShapefileLayer, schema_layer
from geofield.formats.terminal import avoided
from geofield.model import Dataset

if TYPE_CHECKING:
    import geopandas as gpd

Shapefiles = Iterator[ShapefileLayer]
_FLAT = Path("shapefile")

#: Layer by file name of the generic profile. Obstacles that tracks run through lie in files
#: of their own: a terminal takes whatever `obstacles.shp` holds for an obstacle.
GENERIC = {
    "boundary": schema.FIELD,
    "obstacles": schema.OBSTACLES,
    **{f"obstacles_{status}": schema.OBSTACLES for status in schema.NOT_AVOIDED},
    "guidance": schema.SEGMENTS,
}


def generic(dataset: Dataset, customer: str, farm: str) -> Shapefiles:
    """All columns under short names; a file more per status that is not driven around."""
    table = dataset.table("field")
    # The boundary import of several farm platforms asks for these three.
    named = {"CLIENT": customer, "FARM": farm, "FIELD": dataset.name}
    before: dict[str, Column] = {key: ("str", [text] * len(table)) for key, text in named.items()}
    told = [name for name in table.columns if str(name).lower() in ("customer", "farm")]
    field = table.drop(columns=told)
    yield schema_layer(dataset, _FLAT / "boundary", schema.FIELD, field, before)
    yield schema_layer(dataset, _FLAT / "obstacles", schema.OBSTACLES, avoided(dataset))
    obstacles = dataset.table("obstacles")
    rest = obstacles[obstacles["status"].isin(schema.NOT_AVOIDED)]
    for status, part in rest.groupby("status", sort=True):
        place, table = _FLAT / f"obstacles_{status}", part.reset_index(drop=True)
        yield schema_layer(dataset, place, schema.OBSTACLES, table)
    yield schema_layer(dataset, _FLAT / "guidance", schema.SEGMENTS, dataset.table("segments"))


def tracklead(dataset: Dataset, customer: str, farm: str) -> Shapefiles:
    """TRACK-Leader (Mueller-Elektronik): flat files that begin with the field's name."""
    stem = safe_name(dataset.name)
    field, segments = dataset.table("field"), dataset.table("segments")
    names: dict[str, Column] = {"name": ("str", [dataset.name] * len(field))}
    yield _layer(dataset, _FLAT / f"{stem}_boundary", "Polygon", field, names)
    obstacles = avoided(dataset)
    columns = _obstacle_columns(obstacles)
    yield _layer(dataset, _FLAT / f"{stem}_obstacles", "Point", obstacles, columns)
    columns = {"name": ("str", line_names(segments))}
    yield _layer(dataset, _FLAT / f"{stem}_guidancepath", "LineString", segments, columns)
    if dataset.has("headland"):
        parts = dataset.table("headland").explode(ignore_index=True)
        columns = {"id": ("int", range(1, len(parts) + 1))}
        yield _layer(dataset, _FLAT / f"{stem}_headland", "Polygon", parts, columns)


def aggps(dataset: Dataset, customer: str, farm: str) -> Shapefiles:
    """Trimble: ``AgGPS/Data/<Client>/<Farm>/<Field>/`` with boundary, swaths and features."""
    folder = Path(
        "AgGPS",
        "Data",
        safe_name(customer or "Client"),
        safe_name(farm or "Farm"),
        safe_name(dataset.name),
    )
    field, segments = dataset.table("field"), dataset.table("segments")
    columns: dict[str, Column] = {
        "id": ("int", range(1, len(field) + 1)),
        "Name": ("str", [dataset.name] * len(field)),
        "Area": ("float", list(ground_areas_m2(field.geometry.to_numpy(), dataset.crs))),
    }
    yield _layer(dataset, folder / "boundary", "Polygon", field, columns)
    bends = shapely.get_num_points(np.asarray(segments.geometry.to_numpy(), dtype=object)) > 2
    columns = {
        # 0 is a straight line, 1 a curve.
        "id": ("int", [int(bend) for bend in bends]),
        "Name": ("str", line_names(segments)),
        "Length": ("float", list(segments["length_m"])),
    }
    yield _layer(dataset, folder / "swaths", "LineString", segments, columns)
    obstacles = avoided(dataset)
    is_round = obstacles["radius_m"].notna().to_numpy(dtype=bool)
    for name, kind, part in (
        ("AreaFeature", "Polygon", obstacles[~is_round]),
        ("PointFeature", "Point", obstacles[is_round]),
    ):
        yield _layer(dataset, folder / name, kind, part, _obstacle_columns(part))


def _obstacle_columns(obstacles: gpd.GeoDataFrame) -> dict[str, Column]:
    return {
        "id": ("int", list(obstacles["obstacle_no"])),
        "name": ("str", [f"Obstacle {number}" for number in obstacles["obstacle_no"]]),
        "radius_m": ("float", list(obstacles["radius_m"])),
        "buffer_m": ("float", list(obstacles["buffer_m"])),
    }


def _layer(
    dataset: Dataset,
    path: Path,
    geometry: str,
    frame: gpd.GeoDataFrame,
    columns: Mapping[str, Column],
) -> ShapefileLayer:
    """A Shapefile of a table's geometries, or of their centres where it holds points."""
    shapes = np.asarray(frame.geometry.to_numpy(), dtype=object)
    if geometry == "Point":
        shapes = shapely.centroid(shapes)
    return ShapefileLayer(path, geometry, columns, cut_lonlat(shapes, dataset.crs))


#: By the name the user writes.
PROFILES: dict[str, Callable[[Dataset, str, str], Shapefiles]] = {
    "generic": generic,
    "tracklead": tracklead,
    "aggps": aggps,
}
