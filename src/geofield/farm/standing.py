"""Obstacles of a file of their own: what stands in or at each field."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from geofield import schema
from geofield.errors import CRSError, TrackError
from geofield.plan import Plan

if TYPE_CHECKING:
    import geopandas as gpd

LINE_HALF_WIDTH_M = 0.05
"""A fence or wire drawn as a line becomes a strip of this half width."""
#: Points are wider than they look: their radius is only known further on.
_NEAR_M = 100.0


@lru_cache(maxsize=2)
def obstacles_of(path: Path, crs: str | None = None) -> gpd.GeoDataFrame:
    """What to avoid, from any file: its rows, numbered as in the file; longitude and latitude.

    Of a plan, or several in one GeoPackage, their obstacles as they stand. Read once per process,
    however many fields there are.
    """
    from geofield.crs import parse_crs
    from geofield.formats.foreign import read_vector
    from geofield.formats.foreign_tables import NUMBER_COLUMNS, column_like

    frame = read_vector(path, schema.OBSTACLES.name if _holds_obstacles(path) else None)
    if frame.crs is None:
        if crs is None:
            raise CRSError(
                f"{path} does not say its CRS.", hint="Name it: --crs EPSG:4326, for instance."
            )
        frame = frame.set_crs(parse_crs(crs))
    if column_like(frame, NUMBER_COLUMNS) is None:
        frame = frame.assign(obstacle_no=np.arange(1, len(frame) + 1))
    frame = frame[~(frame.geometry.isna() | frame.geometry.is_empty)]
    return frame.explode(ignore_index=True)


def own_obstacles(places: Path) -> Path | None:
    """The file of the places itself, where geofield wrote it with obstacles of theirs."""
    from geofield.formats.gpkg_read import is_own

    mine = _holds_obstacles(places) and is_own(places)
    return places.absolute() if mine else None


def _holds_obstacles(path: Path) -> bool:
    """Whether it is a GeoPackage with a layer of obstacles in which something stands."""
    import pyogrio

    from geofield.formats.foreign import layer_names

    layer = schema.OBSTACLES.name
    if path.suffix.lower() != ".gpkg" or not path.is_file() or layer not in layer_names(path):
        return False
    return bool(pyogrio.read_info(path, layer=layer, force_feature_count=True)["features"])


def with_obstacles(plan: Plan, standing: gpd.GeoDataFrame) -> Plan:
    """A plan with those obstacles of a file that stand in or at its field.

    Raises
    ------
    TrackError
        When the plan has obstacles already.
    """
    from geofield.formats.foreign_tables import obstacle_table

    if plan.obstacles is not None and len(plan.obstacles):
        raise TrackError(
            f"{plan.field.name} has obstacles of its own.",
            hint="Edit those in the plan, or give its outline alone.",
        )
    around = _around(plan, standing)
    mine = standing.iloc[around].to_crs(plan.field.crs)
    line = mine.geometry.geom_type.isin(["LineString", "LinearRing"])
    if line.any():
        strips = mine.geometry.where(~line, mine.geometry.buffer(LINE_HALF_WIDTH_M))
        mine = mine.set_geometry(strips)
    near = mine.geometry.intersects(plan.field.polygon.buffer(_NEAR_M))
    if not near.any() and _swapped_here(standing, plan):
        raise TrackError(
            f"The obstacles lie at {plan.field.name} only with latitude and longitude swapped.",
            hint="Exchange them in the file of obstacles: ogr2ogr -swapXY right.gpkg FILE",
        )
    table = obstacle_table(mine[near].reset_index(drop=True), plan.field.crs, Path("obstacles"))
    reach = table.geometry.intersects(plan.field.polygon)
    return replace(plan, obstacles=table[reach].reset_index(drop=True))


def _around(plan: Plan, standing: gpd.GeoDataFrame) -> np.ndarray:
    """Rows of the file around a field, by its index, in the file's order."""
    import geopandas as gpd

    around = gpd.GeoSeries([plan.field.polygon.buffer(2.0 * _NEAR_M)], crs=plan.field.crs)
    box = shapely.box(*around.to_crs(standing.crs).total_bounds)
    return np.sort(standing.sindex.query(box))


def _swapped_here(standing: gpd.GeoDataFrame, plan: Plan) -> bool:
    """Whether obstacles would stand in the field with their latitude and longitude exchanged."""
    west, south, east, north = plan.field.polygon_lonlat.bounds
    exchanged = shapely.box(south, west, north, east)
    if not standing.crs.is_geographic:
        return False
    there = standing.iloc[standing.sindex.query(exchanged)]
    swapped = shapely.transform(there.geometry.to_numpy(), lambda xy: xy[:, ::-1])
    return bool(shapely.intersects(swapped, plan.field.polygon_lonlat).any())
