"""Review: what a person says of obstacles, and how it survives every re-run.

A person works on the obstacle layer in an editor: sets a status or a size, moves or reshapes
a row, deletes one, draws a new one. :func:`reconcile` reads that word from the difference
between the table and the record of what was written; `geofield.model.merge` joins a new
detection with it.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import shapely
from numpy.typing import NDArray
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT, ground_scale_of, transformer
from geofield.errors import FormatWarning, ObstacleError
from geofield.grid import Grid
from geofield.model.obstacles import (
    circle_polygons,
    floats,
    from_polygons,
    next_number,
    still_round,
)
from geofield.model.written import (
    PlainShape,
    Written,
    fitted_circles,
    matches,
    plain,
    same_shapes,
    shapes_of_plain,
)

if TYPE_CHECKING:
    import geopandas as gpd

#: A row whose recorded position and polygon are farther apart was moved by a person, metres.
_MOVED_M = 0.02
#: A typed length that differs by more than this from the written one, metres.
_TYPED_M = 1e-4


def reconcile(
    obstacles: gpd.GeoDataFrame, written: Written | None = None, grid: Grid | None = None
) -> tuple[gpd.GeoDataFrame, Written]:
    """Understand what a person changed, and make whole what they left half filled.

    A row that differs from its record in shape, size, kind or status is a person's word and
    keeps its number. A shape that was changed counts as drawn, with the radius that it has now
    (none where it is no circle any more); a typed `radius_m` or `buffer_m` gives the row the
    shape of that size. Rows that were merely `detected` or `possible` become `confirmed` by
    such a change, unless the person chose a status. A status emptied is no word: the one that
    was written stands.

    A row without a number, or with a number that another row has, was drawn: it becomes `added`
    (unless another status was chosen) and gets the next free number; a safety margin typed for
    it grows what was drawn, a radius makes it a circle. Rows without a shape are dropped.

    Parameters
    ----------
    obstacles : GeoDataFrame
        Layer `obstacles`, edited or not; columns of the user's own stay.
    written : Written, optional
        The record of what was written; without one every number and status stands.
    grid : Grid, optional
        Gives moved and drawn rows their pixel position.

    Returns
    -------
    GeoDataFrame
        Every row with number, kind, status and shape.
    Written
        Its record, with what the person took away.

    Raises
    ------
    ObstacleError
        When a radius or safety margin is negative or infinite.
    """
    present = ~(obstacles.geometry.isna() | obstacles.geometry.is_empty).to_numpy(bool)
    table = obstacles[present].reset_index(drop=True)
    table = table.set_geometry(_plain_polygons(table.geometry.to_numpy()), crs=table.crs)
    record = (from_earlier_version(table) if written is None else written).table()
    known = _known(table, record)
    table = _with_words(table, record, known)
    _refuse_sizes(table)
    table, changed, elsewhere = _brought_up_to_date(table, record, known, grid)
    drawn = _drawn(table, known)
    kept = table["status"].isin(schema.REVIEWED).to_numpy(bool) | changed
    kept[known] |= record["kept"].loc[_numbers(table[known])].to_numpy(bool)
    if written is not None:
        # A number that nobody gave: a row that a person brought along.
        brought = ~known & ~drawn
        kept |= brought
        table.loc[brought & (table["status"] == "detected").to_numpy(bool), "status"] = "added"
    table = table.assign(_kept=kept)
    if drawn.any():
        stands = table[~drawn]
        added = _added(table[drawn], next_number(stands), grid).assign(_kept=True)
        parts = [part for part in (stands, added) if len(part)]
        table = pd.concat(parts) if parts else added
    table = schema.conform(schema.OBSTACLES, table, extras=True)
    kept = table.pop("_kept").to_numpy(bool)
    table = _with_positions(table, grid)
    former = [] if written is None else list(written.removed)
    if written is not None:
        left = set(_numbers(table))
        elsewhere += [row.shape for row in written.rows if row.obstacle_no not in left]
    gone = matches(shapes_of_plain(elsewhere), table.geometry) < 0
    former += [shape for shape, away in zip(elsewhere, gone, strict=True) if away]
    return table, Written.of(table, kept, former)


def from_earlier_version(obstacles: gpd.GeoDataFrame) -> Written:
    """The record of a table that was written without one.

    Detected circles are known by their own columns; of other rows nobody can tell what was
    changed.
    """
    radius = floats(obstacles, "radius_m")
    total = radius + np.nan_to_num(floats(obstacles, "buffer_m"))
    number = obstacles["obstacle_no"]
    told = (
        (obstacles["status"] == "detected").to_numpy(bool)
        & (number.notna() & ~number.duplicated()).to_numpy(bool)
        & np.isfinite(total + floats(obstacles, "lat") + floats(obstacles, "lon"))
    )
    if not told.any():
        return Written()
    table = obstacles[told]
    x, y = transformer(LONLAT, CRS(table.crs)).transform(
        table["lon"].to_numpy(), table["lat"].to_numpy()
    )
    circles = circle_polygons(x, y, total[told], CRS(table.crs))
    drawn = np.asarray(table.geometry.to_numpy(), dtype=object)
    # The columns are rounded in some formats: what is near enough is as it was.
    near = shapely.hausdorff_distance(drawn, circles) <= 2 * _MOVED_M
    shapes = np.where(near, drawn, circles)
    return Written.of(table.set_geometry(shapes, crs=table.crs), np.zeros(len(table), bool))


def _plain_polygons(geometry: Any) -> NDArray[np.object_]:
    """Two-dimensional, outer rings counter-clockwise; what has one part is that part."""
    shapes = np.array(shapely.force_2d(np.asarray(geometry, dtype=object)), dtype=object)
    alone = shapely.get_num_geometries(shapes) == 1
    shapes[alone] = shapely.get_geometry(shapes[alone], 0)
    return np.asarray(shapely.orient_polygons(shapes), dtype=object)


def _known(table: gpd.GeoDataFrame, record: pd.DataFrame) -> NDArray[np.bool_]:
    """The rows that the record is of: of two with one number, the one that is unchanged."""
    number = table["obstacle_no"]
    known = np.array(number.isin(record.index), dtype=bool)
    if number[known].duplicated().any():
        rows = np.flatnonzero(known)
        shapes = record["geometry"].loc[_numbers(table[known])].to_numpy()
        differs = ~same_shapes(table.geometry.to_numpy()[rows], shapes)
        rows = rows[np.argsort(differs, kind="stable")]
        second = number.iloc[rows].duplicated().to_numpy(bool)
        known[rows[second]] = False
    return known


def _with_words(
    table: gpd.GeoDataFrame, record: pd.DataFrame, known: NDArray[np.bool_]
) -> gpd.GeoDataFrame:
    """The table with `status` and `kind` as the schema spells them, empty ones as written."""
    table = table.copy()
    for name, allowed in (("status", schema.STATUSES), ("kind", schema.KINDS)):
        words = table[name].astype("string").str.strip().str.lower()
        strange = words.notna() & ~words.isin(allowed) & (words != "")
        for row in np.flatnonzero(strange):
            warnings.warn(
                f"Obstacle {table['obstacle_no'].iloc[row]}: {name} {table[name].iloc[row]!r} is "
                f"none of {', '.join(allowed)} and is not used.",
                FormatWarning,
                stacklevel=3,
            )
        words = words.where(words.isin(allowed))
        result = words.astype(object).where(words.notna(), None)
        if known.any():
            written = record[name].loc[_numbers(table[known])].to_numpy()
            result[known] = np.where(words[known].notna(), result[known], written)
        table[name] = result
    return table


def _refuse_sizes(table: gpd.GeoDataFrame) -> None:
    for name in ("radius_m", "buffer_m"):
        values = floats(table, name)
        for row in np.flatnonzero(np.isinf(values) | (values < 0)):
            raise ObstacleError(
                f"Obstacle {table['obstacle_no'].iloc[row]}: {name} is {values[row]:g}.",
                hint="Correct the row, or leave radius_m empty to use the polygon as drawn.",
            )


def _brought_up_to_date(
    table: gpd.GeoDataFrame, record: pd.DataFrame, known: NDArray[np.bool_], grid: Grid | None
) -> tuple[gpd.GeoDataFrame, NDArray[np.bool_], list[PlainShape]]:
    """Shape, sizes and status of the known rows as a person's changes make them.

    Returns the table, which rows were changed, and the former shapes of detections that were
    drawn anew.
    """
    changed = np.zeros(len(table), dtype=bool)
    former: list[PlainShape] = []
    anew: list[int] = []
    rows = np.flatnonzero(known)
    before = record.loc[_numbers(table.iloc[rows])]
    geometry = np.asarray(table.geometry.to_numpy(), dtype=object).copy()
    radius, margin = floats(table, "radius_m").copy(), floats(table, "buffer_m").copy()
    margin[rows] = np.where(np.isnan(margin[rows]), before["buffer_m"], margin[rows])
    status = table["status"].to_numpy(dtype=object).copy()
    chosen = status[rows] != before["status"].to_numpy()
    reshaped = ~same_shapes(geometry[rows], before["geometry"].to_numpy())
    resized = _differ(radius[rows], before["radius_m"]) | _differ(margin[rows], before["buffer_m"])
    renamed = table["kind"].to_numpy()[rows] != before["kind"].to_numpy()
    changed[rows] = reshaped | resized | renamed | chosen
    for at in np.flatnonzero(reshaped | resized | renamed):
        row, old = rows[at], before.iloc[at]
        found = old["status"] in ("detected", "possible")
        if reshaped[at] or resized[at]:
            geometry[row], radius[row] = _shape_now(
                geometry[row],
                radius[row],
                margin[row],
                old,
                CRS(table.crs),
                reshaped=bool(reshaped[at]),
                resized=bool(resized[at]),
            )
            anew.append(row)
        if found and reshaped[at]:
            former += plain([old["geometry"]])
        if found and not chosen[at]:
            status[row] = "confirmed"
    table = table.assign(status=status, radius_m=radius, buffer_m=margin)
    if anew:
        size: Any = np.nan
        if grid is not None:
            x, y = shapely.get_coordinates(shapely.centroid(geometry[anew])).T
            size = np.asarray(grid.resolution_at(*grid.from_crs(x, y, table.crs)))
        table.loc[anew, "radius_px"] = radius[anew] / size
    return table.set_geometry(geometry, crs=table.crs), changed, former


def _differ(one: Any, other: Any) -> NDArray[np.bool_]:
    """Whether lengths differ; two missing ones do not."""
    one, other = np.asarray(one, float), np.asarray(other, float)
    same = (np.abs(one - other) <= _TYPED_M) | (np.isnan(one) & np.isnan(other))
    return np.asarray(~same, dtype=bool)


def _shape_now(
    shape: shapely.Polygon,
    radius_m: float,
    buffer_m: float,
    old: pd.Series[Any],
    crs: CRS,
    *,
    reshaped: bool,
    resized: bool,
) -> tuple[shapely.Polygon, float]:
    """Shape and radius of a row that a person changed."""
    centre, was = shapely.centroid(shape), old["geometry"]
    scale = float(ground_scale_of(shape, crs))
    if reshaped:
        start = shapely.centroid(was)
        step = np.array([centre.x - start.x, centre.y - start.y])
        only_moved = bool(same_shapes([shapely.transform(was, lambda xy: xy + step)], [shape])[0])
        if not (only_moved and resized):
            typed = np.array([(radius_m + buffer_m) * scale])
            if only_moved or still_round(np.array([shape]), typed)[0]:
                return shape, radius_m
            drawn = fitted_circles([shape])[:, 2]
            now_round = bool(still_round(np.array([shape]), drawn)[0])
            left_m = float(drawn[0]) / scale - buffer_m
            return shape, left_m if now_round and left_m > 0 else np.nan
    if np.isfinite(radius_m):
        if not radius_m + buffer_m > 0:
            raise ObstacleError("An obstacle has no size.", hint="Give it a radius_m above 0.")
        return circle_polygons(centre.x, centre.y, radius_m + buffer_m, crs)[0], radius_m
    grown = shapely.buffer(shape, (buffer_m - old["buffer_m"]) * scale, quad_segs=8)
    if not isinstance(grown, shapely.Polygon) or grown.is_empty:
        raise ObstacleError(
            f"A safety margin of {buffer_m:g} m leaves nothing whole of an obstacle drawn with one "
            f"of {old['buffer_m']:g} m.",
            hint="Draw the obstacle anew, or choose another buffer_m.",
        )
    return grown, radius_m


def _drawn(table: gpd.GeoDataFrame, known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The rows that have no number of their own, or no status."""
    number = table["obstacle_no"]
    order = np.argsort(~known, kind="stable")
    second = np.zeros(len(table), dtype=bool)
    second[order] = number.iloc[order].duplicated().to_numpy(bool)
    return np.asarray(number.isna() | table["status"].isna() | second, dtype=bool)


def _added(rows: gpd.GeoDataFrame, first_no: int, grid: Grid | None) -> gpd.GeoDataFrame:
    """Drawn rows as obstacles, one of each part."""
    radius, margin = floats(rows, "radius_m"), np.nan_to_num(floats(rows, "buffer_m"))
    shapes = shapely.make_valid(rows.geometry.to_numpy())
    scale = np.asarray(ground_scale_of(shapes, CRS(rows.crs)))
    is_circle = still_round(shapes, (radius + margin) * scale)
    fresh = rows["obstacle_no"].isna().to_numpy(bool) & ~is_circle
    sized = fresh & np.isfinite(radius)
    if sized.any():
        x, y = shapely.get_coordinates(shapely.centroid(shapes[sized])).T
        shapes[sized] = circle_polygons(x, y, radius[sized] + margin[sized], CRS(rows.crs))
    grown = fresh & ~sized & (margin > 0)
    shapes[grown] = shapely.buffer(shapes[grown], (margin * scale)[grown], quad_segs=8)
    parts, source = shapely.get_parts(shapes, return_index=True)
    areal = shapely.get_dimensions(parts) == 2
    parts, source = parts[areal], source[areal]
    result = from_polygons(
        parts, rows.crs, buffer_m=0.0, grid=grid, status="added", first_no=first_no
    )
    rows = rows.iloc[source].reset_index(drop=True)
    chosen = (rows["status"].notna() & (rows["status"] != "detected")).to_numpy(bool)
    return result.assign(
        status=np.where(chosen, rows["status"], "added"),
        kind=rows["kind"].where(rows["kind"].notna(), "other"),
        radius_m=np.where((is_circle | sized)[source], radius[source], np.nan),
        buffer_m=margin[source],
        **{name: rows[name] for name in schema.own_columns(schema.OBSTACLES, rows)},
    )


def _numbers(table: gpd.GeoDataFrame) -> list[int]:
    return [int(number) for number in table["obstacle_no"]]


def _with_positions(obstacles: gpd.GeoDataFrame, grid: Grid | None) -> gpd.GeoDataFrame:
    """The table with the position columns of rows that were moved brought up to date."""
    if not len(obstacles):
        return obstacles
    crs = CRS(obstacles.crs)
    centre = shapely.centroid(obstacles.geometry.to_numpy())
    x, y = shapely.get_x(centre), shapely.get_y(centre)
    recorded = transformer(LONLAT, crs).transform(
        obstacles["lon"].to_numpy(), obstacles["lat"].to_numpy()
    )
    moved = ~(np.hypot(x - recorded[0], y - recorded[1]) <= _MOVED_M)
    if not moved.any():
        return obstacles
    result = obstacles.copy()
    lon, lat = transformer(crs, LONLAT).transform(x[moved], y[moved])
    result.loc[moved, "lon"], result.loc[moved, "lat"] = lon, lat
    if grid is not None:
        x_px, y_px = grid.from_crs(x[moved], y[moved], crs)
        result.loc[moved, "x_px"], result.loc[moved, "y_px"] = x_px, y_px
    return result
