"""Complete: what another program's file leaves out and the rest of it tells."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT, ground_areas_m2, ground_lengths_m, transformer
from geofield.formats.foreign_tables import heading_deg, line_tables
from geofield.grid import Grid
from geofield.model.obstacles import numbered

if TYPE_CHECKING:
    import geopandas as gpd


def complete(tables: dict[str, gpd.GeoDataFrame], crs: CRS, grid: Grid | None) -> None:
    """Fill gaps in the tables of a file; never change a value that is there.

    Lengths, areas and positions come from the geometry, counts from the other tables,
    segments from tracks that have none. An obstacle without a word on its status counts as
    added by a person, so that no re-run drops it.
    """
    for layer in (schema.OBSTACLES, schema.TRACKS, schema.TRACK_POINTS):
        tables[layer.name] = numbered(tables[layer.name], layer.key[-1])
    field, obstacles = tables["field"], tables["obstacles"]
    shapes = field.geometry.to_numpy()
    _fill(field, "area_ha", ground_areas_m2(shapes, crs) / 1e4)
    _fill(field, "perimeter_m", ground_lengths_m(shapely.get_exterior_ring(shapes), crs))
    for column, value in {"kind": "other", "status": "added", "buffer_m": 0.0}.items():
        _fill(obstacles, column, value)
    _positions(obstacles, crs)
    if len(tables["tracks"]) and not len(tables["segments"]):
        tables["segments"] = line_tables(tables["tracks"].explode(ignore_index=True), crs)[1]
    _tracks(tables)
    for name in ("tracks", "segments", "gaps"):
        _fill(tables[name], "length_m", ground_lengths_m(tables[name].geometry.to_numpy(), crs))
    _positions(tables["track_points"], crs)
    if grid is not None:
        points = tables["track_points"]
        x, y = shapely.get_coordinates(points.geometry.to_numpy()).T
        for column, values in zip(("x_px", "y_px"), grid.from_crs(x, y, crs), strict=True):
            _fill(points, column, values)


def _fill(frame: gpd.GeoDataFrame, column: str, values: Any) -> None:
    missing = frame[column].isna()
    if missing.any():
        frame.loc[missing, column] = np.broadcast_to(values, len(frame))[missing.to_numpy()]


def _positions(frame: gpd.GeoDataFrame, crs: CRS) -> None:
    if not frame[["lat", "lon"]].isna().any(axis=None):
        return
    centre = shapely.centroid(frame.geometry.to_numpy())
    lon, lat = transformer(crs, LONLAT).transform(shapely.get_x(centre), shapely.get_y(centre))
    # To 0.1 mm: a place that was written with fewer decimals is that place again.
    _fill(frame, "lon", np.round(lon, 9))
    _fill(frame, "lat", np.round(lat, 9))


def _tracks(tables: dict[str, gpd.GeoDataFrame]) -> None:
    tracks = tables["tracks"]
    if not len(tracks):
        return
    number = tracks["track_no"]
    told = {"segment_count": "segments", "gap_count": "gaps", "point_count": "track_points"}
    for column, layer in told.items():
        if column != "point_count" or len(tables[layer]):
            counts = tables[layer].groupby("track_no").size()
            _fill(tracks, column, counts.reindex(number, fill_value=0).to_numpy())
    if tracks["heading_deg"].isna().any():
        crs = CRS(tracks.crs)
        _fill(tracks, "heading_deg", [heading_deg(line, crs) for line in tracks.geometry])
