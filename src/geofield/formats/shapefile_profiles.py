"""Shapefiles as two families of farm terminals want them.

Each profile yields the path (without suffix), the geometry type and the Arrow table of
every Shapefile. None has been tried on a physical terminal.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from geofield.formats.arrow import to_lonlat
from geofield.formats.avoided import avoided
from geofield.formats.names import safe_name
from geofield.model import Dataset

if TYPE_CHECKING:
    import geopandas as gpd
    import pyarrow as pa

Shapefiles = Iterator[tuple[PurePosixPath, str, Any]]


def tracklead(dataset: Dataset, customer: str, farm: str) -> Shapefiles:
    """TRACK-Leader (Mueller-Elektronik): flat files that begin with the field's name."""
    stem = safe_name(dataset.name)
    folder = PurePosixPath("shapefile")
    field, obstacles, segments = _tables(dataset)
    yield folder / f"{stem}_boundary", "Polygon", _table(dataset, field, {"name": [dataset.name]})
    yield (
        folder / f"{stem}_obstacles",
        "Point",
        _table(dataset, obstacles, _obstacle_columns(obstacles), centres=True),
    )
    yield (
        folder / f"{stem}_guidancepath",
        "LineString",
        _table(dataset, segments, {"name": _line_names(segments)}),
    )
    if dataset.has("headland"):
        headland = dataset.table("headland")
        yield (
            folder / f"{stem}_headland",
            "Polygon",
            _table(dataset, headland.explode(ignore_index=True), {}),
        )


def aggps(dataset: Dataset, customer: str, farm: str) -> Shapefiles:
    """Trimble: ``AgGPS/Data/<Client>/<Farm>/<Field>/`` with boundary, swaths and features."""
    folder = PurePosixPath(
        "AgGPS",
        "Data",
        safe_name(customer or "Client"),
        safe_name(farm or "Farm"),
        safe_name(dataset.name),
    )
    field, obstacles, segments = _tables(dataset)
    yield (
        folder / "boundary",
        "Polygon",
        _table(
            dataset,
            field,
            {"id": np.arange(1, len(field) + 1), "Name": [dataset.name], "Area": field.area},
        ),
    )
    yield (
        folder / "swaths",
        "LineString",
        _table(
            dataset,
            segments,
            # 0 is a straight line, 1 a curve.
            {
                "id": (shapely.get_num_points(segments.geometry.to_numpy()) > 2).astype(np.int64),
                "Name": _line_names(segments),
                "Length": segments.length,
            },
        ),
    )
    round_ones = obstacles["radius_m"].notna().to_numpy(dtype=bool)
    areas, points = obstacles[~round_ones], obstacles[round_ones]
    yield folder / "AreaFeature", "Polygon", _table(dataset, areas, _obstacle_columns(areas))
    yield (
        folder / "PointFeature",
        "Point",
        _table(dataset, points, _obstacle_columns(points), centres=True),
    )


def _tables(
    dataset: Dataset,
) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame, gpd.GeoDataFrame]:
    """Field, obstacles that are to be avoided, and segments."""
    return dataset.table("field"), avoided(dataset), dataset.table("segments")


def _obstacle_columns(obstacles: gpd.GeoDataFrame) -> dict[str, Any]:
    return {
        "id": obstacles["obstacle_no"],
        "name": [f"Obstacle {number}" for number in obstacles["obstacle_no"]],
        "radius_m": obstacles["radius_m"],
        "buffer_m": obstacles["buffer_m"],
    }


def _line_names(segments: gpd.GeoDataFrame) -> list[str]:
    return [
        f"Track {track}" if segment == 1 else f"Track {track}-{segment}"
        for track, segment in zip(segments["track_no"], segments["segment_no"], strict=True)
    ]


def _table(
    dataset: Dataset, frame: gpd.GeoDataFrame, columns: dict[str, Any], *, centres: bool = False
) -> pa.Table:
    import pyarrow as pa

    geometry = np.asarray(frame.geometry.to_numpy(), dtype=object)
    geometry = shapely.centroid(geometry) if centres else geometry
    if len(geometry):
        geometry = to_lonlat(geometry, dataset.crs)
    arrays = {name: pa.array(values, from_pandas=True) for name, values in columns.items()}
    if not arrays:
        arrays["id"] = pa.array(np.arange(1, len(frame) + 1))
    return pa.table({**arrays, "geom": pa.array(shapely.to_wkb(geometry), pa.binary())})


#: By the name the user writes.
PROFILES: dict[str, Callable[[Dataset, str, str], Shapefiles]] = {
    "tracklead": tracklead,
    "aggps": aggps,
}
