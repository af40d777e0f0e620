"""Fields and obstacles for stage 4, from plans or from any file of geometries."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely
from pyproj import CRS
from shapely.geometry.base import BaseGeometry

from geofield.errors import CRSError, TrackError

if TYPE_CHECKING:
    import geopandas as gpd

    from geofield.plan import Plan

LINE_HALF_WIDTH_M = 0.05
"""A fence or wire drawn as a line becomes a strip of this half width."""


def plans_of(path: Path, *, crs: str | None = None) -> tuple[list[tuple[str, Plan]], bool]:
    """The fields of a file, as plans with a name for each one's own file.

    Parameters
    ----------
    path : Path
        A GeoPackage with one field that geofield wrote, or any file of polygons.
    crs : str, optional
        Of polygons that do not say theirs.

    Returns
    -------
    list of (str, Plan)
    bool
        Whether the file was a plan.
    """
    from geofield import schema
    from geofield.crs import LONLAT, metric_crs, transformer
    from geofield.formats.foreign import layer_names
    from geofield.formats.foreign_tables import _ID, _NAME, column_like
    from geofield.model.field import Field
    from geofield.plan import Plan, read_plan
    from geofield.tracks.outline import clean_outline

    own = path.suffix.lower() == ".gpkg" and schema.FIELD.name in layer_names(path)
    frame = _vector(path, crs, schema.FIELD.name if own else None)
    if own and len(frame) == 1:
        return [(path.stem, read_plan(path))], True
    frame = frame[~(frame.geometry.isna() | frame.geometry.is_empty)]
    frame = frame.explode(ignore_index=True)
    frame = frame[frame.geometry.geom_type == "Polygon"].reset_index(drop=True)
    if not len(frame):
        raise TrackError(f"{path} holds no polygons.", hint="Give a file of field outlines.")
    names, ids = column_like(frame, _NAME), column_like(frame, _ID)
    source = frame.crs
    plans: list[tuple[str, Plan]] = []
    taken: set[str] = set()
    for row, geometry in enumerate(frame.geometry):
        place = geometry.representative_point()
        lon, lat = transformer(source, LONLAT).transform(place.x, place.y)
        metric = metric_crs(lon, lat, source)
        polygon = geometry if metric == source else _reprojected(geometry, source, metric)
        polygon, _ = clean_outline(polygon)
        name = path.stem if len(frame) == 1 else f"{path.stem}_{row + 1}"
        if names is not None and names.notna().iloc[row]:
            name = str(names.iloc[row])
        field_id = ""
        if ids is not None and ids.notna().iloc[row]:
            field_id = str(ids.iloc[row])
        field = Field(polygon, metric, name=name, field_id=field_id, method="boundary")
        plans.append((_file_name(name, taken), Plan(field)))
    return plans, False


def obstacles_of(path: Path, *, crs: str | None = None) -> gpd.GeoDataFrame:
    """What to avoid, from any file: its rows, numbered as in the file."""
    from geofield.formats.foreign_tables import _NUMBER, column_like

    frame = _vector(path, crs, None)
    if column_like(frame, _NUMBER) is None:
        frame = frame.assign(obstacle_no=np.arange(1, len(frame) + 1))
    frame = frame[~(frame.geometry.isna() | frame.geometry.is_empty)]
    return frame.explode(ignore_index=True)


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
    mine = standing.to_crs(plan.field.crs)
    line = mine.geometry.geom_type.isin(["LineString", "LinearRing"])
    if line.any():
        strips = mine.geometry.where(~line, mine.geometry.buffer(LINE_HALF_WIDTH_M))
        mine = mine.set_geometry(strips)
    # Points are wider than they look: their radius is only known further on.
    near = mine.geometry.intersects(plan.field.polygon.buffer(100.0))
    if not near.any() and _swapped_here(standing, plan):
        raise TrackError(
            f"The obstacles lie at {plan.field.name} only with latitude and longitude swapped.",
            hint="Exchange them in the file of obstacles: ogr2ogr -swapXY right.gpkg FILE",
        )
    table = obstacle_table(mine[near].reset_index(drop=True), plan.field.crs, Path("obstacles"))
    reach = table.geometry.intersects(plan.field.polygon)
    return replace(plan, obstacles=table[reach].reset_index(drop=True))


def _swapped_here(standing: gpd.GeoDataFrame, plan: Plan) -> bool:
    """Whether obstacles would stand in the field with their latitude and longitude exchanged."""
    lonlat = standing.to_crs(4326).geometry.to_numpy()
    swapped = shapely.transform(lonlat, lambda xy: xy[:, ::-1])
    return bool(shapely.intersects(swapped, plan.field.polygon_lonlat).any())


def _vector(path: Path, crs: str | None, layer: str | None) -> gpd.GeoDataFrame:
    from geofield.crs import parse_crs
    from geofield.formats.foreign import read_vector

    frame = read_vector(path, layer)
    if frame.crs is None:
        if crs is None:
            raise CRSError(
                f"{path} does not say its CRS.", hint="Name it: --crs EPSG:4326, for instance."
            )
        frame = frame.set_crs(parse_crs(crs))
    return frame


def _reprojected(geometry: BaseGeometry, source: CRS, target: CRS) -> BaseGeometry:
    from geofield.crs import transformer

    project = transformer(source, target)
    return shapely.transform(
        shapely.force_2d(geometry), lambda xy: np.column_stack(project.transform(*xy.T))
    )


def _file_name(name: str, taken: set[str]) -> str:
    """A name for a file, unlike all others taken."""
    stem = re.sub(r"[^\w.-]+", "_", name).strip("._") or "field"
    unique, number = stem, 1
    while unique.lower() in taken:
        number += 1
        unique = f"{stem}_{number}"
    taken.add(unique.lower())
    return unique
