"""What the tracks must avoid: obstacles in any form as true circles and polygons."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from numpy.typing import NDArray
from pyproj import CRS
from shapely.geometry.base import BaseGeometry

from geofield.crs import ground_scale, ground_scale_of
from geofield.errors import FARTHEST_M, CRSMismatchError, TrackError, TrackWarning
from geofield.finite import MEND_IT, finite
from geofield.model.obstacles import (
    ObstacleShapes,
    active,
    grown_by,
    numbered,
    shapes_of,
    sizes_of,
)
from geofield.notes import warn
from geofield.tracks.outline import in_degrees
from geofield.wording import counted

_POINTS = (shapely.GeometryType.POINT.value, shapely.GeometryType.MULTIPOINT.value)
_LINES = (
    shapely.GeometryType.LINESTRING.value,
    shapely.GeometryType.LINEARRING.value,
    shapely.GeometryType.MULTILINESTRING.value,
)


def obstacle_shapes(
    obstacles: Any, crs: CRS, *, clearance_m: float = 0.0, outline: BaseGeometry | None = None
) -> ObstacleShapes:
    """Understand obstacles in any of the forms a user may have them.

    Tables in another CRS are reprojected; plain geometries are in `crs`, that of the field's
    `outline`, beside which coordinates that look like degrees are refused. Rows whose
    `status` is ``rejected`` or ``possible`` are left out. Points need a column `radius_m`, or a
    clearance, which grows everything by that much. Numbers are those of the column `obstacle_no`,
    else 1, 2, ... in the order given.

    Raises
    ------
    CRSMismatchError
        When shapes without a CRS cannot be in the field's, or latitude and longitude are swapped.
    TrackError
        When a point or line has no width, a geometry is not finite, or the clearance is larger than
        anything reaches.
    ObstacleError
        When a radius or margin is negative or infinite.
    """
    if clearance_m > FARTHEST_M:
        raise TrackError(f"A clearance of {clearance_m:g} m is above {FARTHEST_M:g} m.")
    if obstacles is None:
        none = np.empty(0, np.int64)
        return ObstacleShapes(np.empty((0, 3)), none, np.empty(0, dtype=object), none)
    frame = _as_table(obstacles, crs, outline)
    frame = active(numbered(frame))
    while (mixed := _of_several_kinds(frame.geometry.to_numpy())).any():
        parts = frame[mixed].explode(ignore_index=True)
        frame = pd.concat([frame[~mixed], parts], ignore_index=True)
    geometry = np.asarray(frame.geometry.to_numpy(), dtype=object)
    missing = shapely.is_missing(geometry) | shapely.is_empty(geometry)
    if missing.any():
        _warn(
            f"{counted(int(missing.sum()), 'obstacle has', 'obstacles have')} no geometry and "
            f"{'was' if missing.sum() == 1 else 'were'} left out."
        )
    frame, geometry = frame[~missing], shapely.force_2d(geometry[~missing])
    if not finite(geometry).all():
        raise TrackError("An obstacle has coordinates that are not finite numbers.", hint=MEND_IT)
    broken = ~shapely.is_valid(geometry)
    if broken.any():
        few = "1 obstacle was not valid and has"
        many = f"{int(broken.sum())} obstacles were not valid and have"
        _warn(f"{few if broken.sum() == 1 else many} been repaired.")
        geometry[broken] = shapely.make_valid(geometry[broken], method="structure")
    frame = frame.set_geometry(gpd.GeoSeries(geometry, index=frame.index, crs=crs))
    kind = shapely.get_type_id(geometry)
    point, line = np.isin(kind, _POINTS), np.isin(kind, _LINES)
    shapes = _grown(shapes_of(frame[~(point | line)]), clearance_m, crs)
    if not (point.any() or line.any()):
        return shapes
    return _with_thin(shapes, frame, point, line, clearance_m)


def _as_table(obstacles: Any, crs: CRS, outline: BaseGeometry | None) -> gpd.GeoDataFrame:
    if not isinstance(obstacles, gpd.GeoDataFrame):
        obstacles = gpd.GeoDataFrame(geometry=_plain(obstacles))
    own = obstacles.crs
    if own is None:
        if outline is not None and in_degrees(obstacles.total_bounds, outline):
            raise CRSMismatchError(
                "The obstacles name no CRS and their coordinates look like degrees.",
                hint="Name it: GeoSeries(obstacles, crs=4326), or set_crs(4326) of a table.",
            )
        return obstacles.set_crs(crs)
    if own == crs:
        return obstacles
    placed = obstacles.to_crs(crs)
    if own.is_geographic and outline is not None and not placed.intersects(outline).any():
        xy = shapely.transform(obstacles.geometry.to_numpy(), lambda lonlat: lonlat[:, ::-1])
        if gpd.GeoSeries(xy, crs=own).to_crs(crs).intersects(outline).any():
            raise CRSMismatchError(
                "The obstacles lie in the field only with latitude and longitude swapped.",
                hint="Longitude is x and comes first: geopandas.points_from_xy(lon, lat).",
            )
    return placed


def _plain(obstacles: Any) -> gpd.GeoSeries:
    """Shapes without columns, with the CRS that they say."""
    own = getattr(obstacles, "crs", None)
    if isinstance(obstacles, BaseGeometry):
        obstacles = shapely.get_parts(obstacles)
    shapes = list(obstacles) if isinstance(obstacles, Iterable) else [obstacles]
    for shape in shapes:
        if shape is not None and not isinstance(shape, BaseGeometry):
            raise TrackError(
                f"An obstacle must be a shapely geometry, not {type(shape).__name__}.",
                hint="Give a GeoDataFrame, a list of shapely geometries, or None.",
            )
    return gpd.GeoSeries(shapes, crs=own)


def _with_thin(
    shapes: ObstacleShapes,
    frame: gpd.GeoDataFrame,
    point: NDArray[np.bool_],
    line: NDArray[np.bool_],
    clearance_m: float,
) -> ObstacleShapes:
    """Add points as circles and lines as strips, or say that they have no width."""
    geometry = np.asarray(frame.geometry.to_numpy(), dtype=object)
    number = frame["obstacle_no"].to_numpy(dtype=np.int64)
    radius, margin = sizes_of(frame)
    width = np.nan_to_num(radius) + margin + clearance_m
    width *= ground_scale_of(geometry, CRS(frame.crs))
    bare = np.flatnonzero((point | line) & ~(width > 0.0))
    if len(bare):
        raise TrackError(
            f"Obstacle {number[bare[0]]} is a {geometry[bare[0]].geom_type} without a radius: "
            "it has no width to avoid.",
            hint="Give a column radius_m, or a clearance (--clearance).",
        )
    places, source = shapely.get_coordinates(geometry[point], return_index=True)
    strips = grown_by(geometry[line], width[line])
    return ObstacleShapes(
        np.concatenate((shapes.circles, np.column_stack((places, width[point][source])))),
        np.concatenate((shapes.circle_no, number[point][source])),
        np.concatenate((shapes.polygons, strips)),
        np.concatenate((shapes.polygon_no, number[line])),
    )


def _grown(shapes: ObstacleShapes, clearance_m: float, crs: CRS) -> ObstacleShapes:
    if clearance_m == 0.0:
        return shapes
    circles = shapes.circles.copy()
    circles[:, 2] += clearance_m * ground_scale(crs, circles[:, 0], circles[:, 1])
    polygons = shapes.polygons
    if len(polygons):
        polygons = grown_by(polygons, clearance_m * ground_scale_of(polygons, crs))
    return ObstacleShapes(circles, shapes.circle_no, polygons, shapes.polygon_no)


def _of_several_kinds(geometry: NDArray[np.object_]) -> NDArray[np.bool_]:
    collection = shapely.get_type_id(geometry) == shapely.GeometryType.GEOMETRYCOLLECTION.value
    return np.asarray(collection & ~shapely.is_empty(geometry))


def _warn(message: str) -> None:
    warn(message, TrackWarning)
