"""Review: what a person says of obstacles, and how it survives every re-run.

A person works on the obstacle layer in an editor: sets a status, moves or reshapes a row,
draws a new one. :func:`complete_review` makes whole what the editor left half filled;
:func:`merge_reviewed` joins a new detection with the person's word.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT, transformer
from geofield.grid import Grid
from geofield.model.obstacles import from_polygons, next_number

if TYPE_CHECKING:
    import geopandas as gpd

#: A row whose recorded position and polygon are farther apart was moved by a person, metres.
_MOVED_M = 0.02


def complete_review(obstacles: gpd.GeoDataFrame, grid: Grid | None = None) -> gpd.GeoDataFrame:
    """Fill in what a person left empty or out of date.

    A row without a number or status, or with a number that another row has, was drawn by
    hand: it becomes `added`, gets the next free number, and its polygon is taken exactly as
    drawn. A row that was moved gets its new position. Rows without a shape are dropped.

    Parameters
    ----------
    obstacles : GeoDataFrame
        Layer `obstacles`, edited or not.
    grid : Grid, optional
        Gives moved and drawn rows their pixel position.
    """
    import pandas as pd

    number, status = obstacles["obstacle_no"], obstacles["status"]
    drawn = (number.isna() | ~status.isin(schema.STATUSES) | number.duplicated()).to_numpy(bool)
    present = ~(obstacles.geometry.isna() | obstacles.geometry.is_empty).to_numpy(bool)
    kept = obstacles[present & ~drawn]
    if drawn.any() or not present.all():
        shapes = shapely.make_valid(obstacles[present & drawn].geometry.to_numpy())
        shapes = shapely.get_parts(shapes)
        shapes = shapes[shapely.get_dimensions(shapes) == 2]
        added = from_polygons(
            shapes,
            obstacles.crs,
            buffer_m=0.0,
            grid=grid,
            status="added",
            first_no=next_number(kept),
        )
        parts = [part for part in (kept, added) if len(part)]
        joined = pd.concat(parts) if parts else added
        obstacles = schema.conform(schema.OBSTACLES, joined)
    return _with_positions(obstacles, grid)


def merge_reviewed(detected: gpd.GeoDataFrame, previous: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """Join a new detection with an earlier table, in which a person's word stands.

    Rows that were confirmed, rejected or added stay as they are; a detection of the same
    object gives way to them. Other detections keep the number they had before where they are
    found again; new ones get fresh numbers.

    Parameters
    ----------
    detected, previous : GeoDataFrame
        Layer `obstacles`, in the same CRS; `previous` complete (see :func:`complete_review`).
    """
    import pandas as pd

    if _crs(detected) != _crs(previous):
        previous = previous.to_crs(detected.crs)
    reviewed = previous[previous["status"].isin(schema.REVIEWED)]
    known = _matches(detected, reviewed)
    fresh = detected[known < 0].reset_index(drop=True)
    earlier = previous[~previous["status"].isin(schema.REVIEWED)]
    again = _matches(fresh, earlier)
    numbers = np.zeros(len(fresh), dtype=np.int64)
    taken: set[int] = set()
    old = earlier["obstacle_no"].to_numpy(dtype=np.int64)
    for row, match in enumerate(again):
        if match >= 0 and int(old[match]) not in taken:
            numbers[row] = old[match]
            taken.add(int(old[match]))
    new = np.flatnonzero(numbers == 0)
    numbers[new] = next_number(previous) + np.arange(len(new))
    fresh["obstacle_no"] = pd.array(numbers, dtype="Int64")
    parts = [part for part in (reviewed, fresh) if len(part)]
    joined = pd.concat(parts) if parts else fresh
    result = schema.conform(schema.OBSTACLES, joined)
    result.attrs.update(detected.attrs)
    return result


def _crs(table: gpd.GeoDataFrame) -> CRS:
    return CRS(table.crs)


def _matches(table: gpd.GeoDataFrame, others: gpd.GeoDataFrame) -> NDArray[np.int64]:
    """For each row the nearest other row that is the same object, by position; -1 for none.

    Two rows are the same object when the centre of one lies in the other.
    """
    result = np.full(len(table), -1, dtype=np.int64)
    if not len(table) or not len(others):
        return result
    mine, theirs = table.geometry.to_numpy(), others.geometry.to_numpy()
    tree = shapely.STRtree(theirs)
    rows, candidates = tree.query(mine, predicate="intersects")
    centre, other = shapely.centroid(mine)[rows], shapely.centroid(theirs)[candidates]
    same = shapely.intersects(centre, theirs[candidates]) | shapely.intersects(other, mine[rows])
    distance = shapely.distance(centre, other)
    for index in np.argsort(distance, kind="stable"):
        if same[index] and result[rows[index]] < 0:
            result[rows[index]] = candidates[index]
    return result


def _with_positions(obstacles: gpd.GeoDataFrame, grid: Grid | None) -> gpd.GeoDataFrame:
    """The table with the position columns of rows that were moved brought up to date."""
    if not len(obstacles):
        return obstacles
    centre = shapely.centroid(obstacles.geometry.to_numpy())
    x, y = shapely.get_x(centre), shapely.get_y(centre)
    recorded = transformer(LONLAT, _crs(obstacles)).transform(
        obstacles["lon"].to_numpy(), obstacles["lat"].to_numpy()
    )
    off = np.hypot(x - recorded[0], y - recorded[1])
    moved = ~(off <= _MOVED_M)
    if not moved.any():
        return obstacles
    result = obstacles.copy()
    lon, lat = transformer(_crs(obstacles), LONLAT).transform(x[moved], y[moved])
    result.loc[moved, "lon"], result.loc[moved, "lat"] = lon, lat
    if grid is not None:
        x_px, y_px = grid.from_crs(x[moved], y[moved], obstacles.crs)
        result.loc[moved, "x_px"], result.loc[moved, "y_px"] = x_px, y_px
    return result
