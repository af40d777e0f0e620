"""Review: what a person says of obstacles, and how it survives every re-run.

A person works on the obstacle layer in an editor: sets a status or a size, moves or reshapes
a row, deletes one, draws a new one. :func:`reconcile` reads that word from the difference
between the table and the record of what was written; `geofield.model.merge` joins a new
detection with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
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
from geofield.model.copies import without_copies
from geofield.model.merged_rows import unmerged
from geofield.model.obstacle_numbers import lost_numbers, possible_numbers
from geofield.model.obstacles import FloatArray, floats, from_polygons, still_round
from geofield.model.resized import as_areas, circles, differ, grown, shape_now, widened
from geofield.model.whole_layer import tell_all_reshaped, tell_none_left
from geofield.model.written import (
    SAME_M,
    PlainShape,
    Record,
    Written,
    WrittenRow,
    free_number,
    from_earlier_version,
    matches,
    same_shapes,
    shapes_of_plain,
)
from geofield.notes import warn
from geofield.wording import some_of

if TYPE_CHECKING:
    import geopandas as gpd


#: No obstacle in a field is larger, metres.
_MOST_M = 10_000.0


def reconcile(
    obstacles: gpd.GeoDataFrame, written: Written | None = None, grid: Grid | None = None
) -> tuple[gpd.GeoDataFrame, Written]:
    """Understand what a person changed, and make whole what they left half filled.

    A row that differs from its record in shape, size, kind or status is a person's word and
    keeps its number. A shape that was changed counts as drawn, with the radius that it has now
    (none where it is no circle any more); a typed `radius_m` or `buffer_m` gives the row the
    shape of that size. Rows that were merely `detected` or `possible` become `confirmed` by
    such a change, unless the person chose a status, then or before. A status emptied is no word:
    the one that was written stands.

    A row without a number, or with a number that another row has (a copy of that one), was drawn:
    it becomes `added` (unless another status was chosen) and gets the next free number; a safety
    margin typed for it grows what was drawn, a radius makes it a circle. One that lies exactly
    on its original is no further obstacle (`geofield.model.copies`); of merged rows each is what it
    was (`geofield.model.merged_rows`). Points and lines become
    areas (`geofield.model.resized.widened`). Rows without a shape are dropped.

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
        Every row with number, status and shape.
    Written
        Its record, with what the person took away.

    Raises
    ------
    ObstacleError
        When a radius or safety margin is negative, or larger than any field.
    """
    areas = obstacles if written is None else as_areas(obstacles, written.by_number)
    table = _with_shapes(areas)
    earlier = from_earlier_version(table) if written is None else written
    record = earlier.by_number
    table = without_copies(unmerged(table, record), record)
    rows = _Rows.of(table)
    _fill_lost_numbers(rows, list(record.values()))
    known, before = _known(rows, record)
    _spell(rows, known, before)
    _refuse_sizes(rows)
    changed, elsewhere = _bring_up_to_date(rows, known, before, grid)
    drawn = _drawn(rows, known)
    status = rows.at["status"]
    kept = np.isin(status, schema.REVIEWED) | changed
    kept[known] |= np.array([row.kept for row in before], bool)
    if written is not None:
        # A number that nobody gave: a row that a person brought along.
        brought = ~drawn
        brought[known] = False
        kept |= brought
        status[brought & (status == "detected")] = "added"
    _place(rows, grid)
    stand = np.flatnonzero(~drawn)
    stand = stand[np.argsort(rows.at["obstacle_no"][stand], kind="stable")]
    result, kept = rows.table(stand), kept[stand]
    if drawn.any():
        said = table[drawn].assign(kind=rows.at["kind"][drawn], status=status[drawn])
        said = said.set_geometry(rows.shapes[drawn], crs=table.crs)
        added = _added(said, record, free_number(result, earlier), grid)
        parts = [part for part in (result, added) if len(part)]
        result = schema.conform(schema.OBSTACLES, pd.concat(parts) if parts else added, extras=True)
        kept = np.append(kept, np.ones(len(added), bool))
    tell_none_left(earlier.rows, result)
    left = set(result["obstacle_no"].tolist())
    elsewhere += [row.shape for row in earlier.rows if row.obstacle_no not in left]
    gone = matches(shapes_of_plain(elsewhere), result.geometry) < 0
    removed = [shape for shape, away in zip(elsewhere, gone, strict=True) if away]
    now = Written.of(result, kept, [*earlier.removed, *removed], earlier.last_no)
    # What nobody changed is measured by what was written still, or it would drift.
    same = set(rows.at["obstacle_no"][known[~changed[known]]].tolist())
    measures = (
        one._replace(shape=record[one.obstacle_no].shape) if one.obstacle_no in same else one
        for one in now.rows
    )
    return result, replace(now, rows=tuple(measures))


@dataclass(frozen=True)
class _Rows:
    """The columns of a table as arrays, in which single values are cheap to change."""

    frame: gpd.GeoDataFrame
    crs: CRS
    at: dict[str, Any]
    shapes: NDArray[np.object_]

    @classmethod
    def of(cls, frame: gpd.GeoDataFrame) -> _Rows:
        columns: dict[str, Any] = {}
        for each in schema.OBSTACLES.columns:
            is_number = each.type in ("int", "float")
            values = floats(frame, each.name) if is_number else frame[each.name].tolist()
            columns[each.name] = np.array(values, float if is_number else object)
        return cls(frame, CRS(frame.crs), columns, _plain_polygons(frame.geometry.array))

    def __len__(self) -> int:
        return len(self.shapes)

    def name_of(self, row: int) -> str:
        number = self.frame["obstacle_no"].iloc[row]
        return "An obstacle without a number" if pd.isna(number) else f"Obstacle {number}"

    def table(self, rows: NDArray[np.int64]) -> gpd.GeoDataFrame:
        """Some rows, which all have a number, as a table."""
        columns = {name: values[rows] for name, values in self.at.items()}
        columns["obstacle_no"] = columns["obstacle_no"].astype(np.int64)
        names = schema.own_columns(schema.OBSTACLES, self.frame)
        own = {name: self.frame[name].array[rows] for name in names}
        return schema.table(schema.OBSTACLES, columns, self.shapes[rows], self.frame.crs, own)


def _with_shapes(obstacles: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """The rows that have a shape, all of them areas, their numbers as numbers."""
    shapes = np.asarray(obstacles.geometry.array, dtype=object)
    missing = shapely.is_missing(shapes) | shapely.is_empty(shapes)
    table = obstacles[~missing] if missing.any() else obstacles
    crossed = ~shapely.is_valid(shapes[~missing])
    if crossed.any():
        table = _repaired(table, crossed)
    kinds = table.dtypes
    names = [each.name for each in schema.OBSTACLES.columns if each.type in ("int", "float")]
    if not all(name in kinds and kinds[name].kind in "if" for name in names):
        table = schema.conform(schema.OBSTACLES, table, extras=True)
    # Programs that know no empty number write 0: a pond would be a circle of its margin.
    unsized = table["radius_m"] == 0
    table = table.assign(radius_m=table["radius_m"].mask(unsized)) if unsized.any() else table
    return widened(possible_numbers(table))


def _repaired(obstacles: gpd.GeoDataFrame, crossed: NDArray[np.bool_]) -> gpd.GeoDataFrame:
    """Rows whose border crosses itself made valid; further parts have the same number still."""
    shapes = np.array(obstacles.geometry.array, dtype=object)
    for row in np.flatnonzero(crossed):
        # Of areas and lines the areas are one part.
        parts = shapely.get_parts(shapely.get_parts(shapely.make_valid(shapes[row])))
        areas = [part for part in parts if isinstance(part, shapely.Polygon)]
        # What has no area at all is the line or point that it is: nobody took it away.
        shapes[row] = shapely.MultiPolygon(areas) if areas else shapely.union_all(parts)
    return obstacles.set_geometry(shapes, crs=obstacles.crs).explode(ignore_index=True)


def _plain_polygons(geometry: Any) -> NDArray[np.object_]:
    """Two-dimensional, outer rings counter-clockwise; what has one part is that part."""
    shapes = np.array(shapely.force_2d(np.asarray(geometry, dtype=object)), dtype=object)
    alone = shapely.get_num_geometries(shapes) == 1
    shapes[alone] = shapely.get_geometry(shapes[alone], 0)
    return np.asarray(shapely.orient_polygons(shapes), dtype=object)


def _fill_lost_numbers(rows: _Rows, record: list[WrittenRow]) -> None:
    """Numbers, and with them radii, of rows that lost their number in another program."""
    for row, (one, same) in lost_numbers(rows.shapes, rows.at["obstacle_no"], record).items():
        rows.at["obstacle_no"][row] = one.obstacle_no
        if np.isnan(rows.at["radius_m"][row]) and same and one.radius_m is not None:
            rows.at["radius_m"][row] = one.radius_m


def _known(rows: _Rows, record: Record) -> tuple[NDArray[np.int64], list[WrittenRow]]:
    """The rows that the record is of, and what it says of each.

    Of two rows with one number it is of the one that is unchanged.
    """
    numbers = rows.at["obstacle_no"]
    known = np.flatnonzero([number in record for number in numbers.tolist()])
    if len(np.unique(numbers[known])) < len(known):
        shapes = shapes_of_plain([record[int(number)].shape for number in numbers[known]])
        known = known[np.argsort(~same_shapes(rows.shapes[known], shapes), kind="stable")]
        known = known[np.unique(numbers[known], return_index=True)[1]]
    return known, [record[int(number)] for number in numbers[known]]


def _spell(rows: _Rows, known: NDArray[np.int64], before: list[WrittenRow]) -> None:
    """Write `status` and `kind` as the schema spells them, empty ones as they were written."""
    for name, allowed in (("status", schema.STATUSES), ("kind", schema.KINDS)):
        values = rows.at[name]
        unknown: dict[str, list[str]] = {}
        for row, value in enumerate(values.tolist()):
            word = None if pd.isna(value) else str(value).strip().lower()
            if word and word not in allowed:
                unknown.setdefault(repr(value), []).append(rows.name_of(row))
            values[row] = word if word in allowed else None
        for said, names in unknown.items():
            warn(
                f"{some_of(names, 1)}: {name} {said} is none of {', '.join(allowed)} and is not "
                "used.",
                FormatWarning,
            )
        for row, old in zip(known.tolist(), before, strict=True):
            if values[row] is None:
                values[row] = getattr(old, name)


def _refuse_sizes(rows: _Rows) -> None:
    for name in ("radius_m", "buffer_m"):
        values = rows.at[name]
        for row in np.flatnonzero((values > _MOST_M) | (values < 0)).tolist():
            raise ObstacleError(
                f"{rows.name_of(row)}: {name} is {values[row]:g}.",
                hint="Correct the row, or leave radius_m empty to use the polygon as drawn.",
            )


def _bring_up_to_date(
    rows: _Rows, known: NDArray[np.int64], before: list[WrittenRow], grid: Grid | None
) -> tuple[NDArray[np.bool_], list[PlainShape]]:
    """Make shape, sizes and status of the known rows what a person's changes say.

    Returns which rows were changed, and the former shapes of what was found there and drawn anew.
    """
    changed = np.zeros(len(rows), dtype=bool)
    former: list[PlainShape] = []
    anew: list[int] = []
    shapes = shapes_of_plain([row.shape for row in before])
    was_radius, was_margin = (
        np.array([getattr(row, name) for row in before], float) for name in ("radius_m", "buffer_m")
    )
    margin = rows.at["buffer_m"][known]
    rows.at["buffer_m"][known] = margin = np.where(np.isnan(margin), was_margin, margin)
    chosen = rows.at["status"][known] != np.array([row.status for row in before], object)
    reshaped = ~same_shapes(rows.shapes[known], shapes)
    tell_all_reshaped(before, rows.shapes[known], shapes, reshaped)
    new_radius = differ(rows.at["radius_m"][known], was_radius)
    new_margin = differ(margin, was_margin)
    resized = new_radius | new_margin
    renamed = rows.at["kind"][known] != np.array([row.kind for row in before], object)
    changed[known] = reshaped | resized | renamed | chosen
    for at in np.flatnonzero(reshaped | resized | renamed):
        row = known[at]
        found = before[at].status in ("detected", "possible")
        if reshaped[at] or resized[at]:
            rows.shapes[row], rows.at["radius_m"][row] = shape_now(
                rows.shapes[row], rows.at["radius_m"][row], margin[at], shapes[at], was_margin[at],
                rows.crs, new_radius=bool(new_radius[at]), new_margin=bool(new_margin[at]),
            )  # fmt: skip
            anew.append(row)
        if reshaped[at] and before[at].status != "added":
            former.append(before[at].shape)
        # Of what a person looked at before, the status is their choice, too.
        if found and not chosen[at] and not before[at].kept:
            rows.at["status"][row] = "confirmed"
    if anew:
        size: Any = np.nan
        if grid is not None:
            x, y = shapely.get_coordinates(shapely.centroid(rows.shapes[anew])).T
            size = np.asarray(grid.resolution_at(*grid.from_crs(x, y, rows.crs)))
        rows.at["radius_px"][anew] = rows.at["radius_m"][anew] / size
    return changed, former


def _drawn(rows: _Rows, known: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which rows have no number of their own, or no status."""
    drawn = pd.isna(rows.at["obstacle_no"]) | pd.isna(rows.at["status"])
    order = np.concatenate([known, np.setdiff1d(np.arange(len(rows)), known)])
    _, first = np.unique(rows.at["obstacle_no"][order], return_index=True)
    second = np.ones(len(rows), dtype=bool)
    second[order[first]] = False
    return np.asarray(drawn | second, dtype=bool)


def _added(
    rows: gpd.GeoDataFrame, record: Record, first_no: int, grid: Grid | None
) -> gpd.GeoDataFrame:
    """Drawn rows as obstacles, one of each part."""
    radius, margin = floats(rows, "radius_m"), np.nan_to_num(floats(rows, "buffer_m"))
    shapes = shapely.make_valid(rows.geometry.to_numpy())
    scale = np.asarray(ground_scale_of(shapes, CRS(rows.crs)))
    is_circle = still_round(shapes, (radius + margin) * scale)
    was_radius, was_margin = _copied(rows, record, radius, margin)
    new_margin = differ(margin, was_margin)
    new_size = differ(radius, was_radius)
    new_size |= new_margin & still_round(shapes, (was_radius + was_margin) * scale)
    sized = new_size & np.isfinite(radius) & ~is_circle
    if sized.any():
        x, y = shapely.get_coordinates(shapely.centroid(shapes[sized])).T
        shapes[sized] = circles(x, y, radius[sized] + margin[sized], CRS(rows.crs))
    for row in np.flatnonzero(new_margin & ~sized & ~is_circle):
        shapes[row] = grown(shapes[row], margin[row], was_margin[row], scale[row])
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


def _copied(
    rows: gpd.GeoDataFrame, record: Record, radius: FloatArray, margin: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Radius and margin that drawn rows were copied with; of others what stands in them.

    A row without a number is no copy: all that stands in it was typed for it.
    """
    numbers = floats(rows, "obstacle_no")
    was_radius, was_margin = np.where(np.isnan(numbers), [[np.nan], [0.0]], [radius, margin])
    for row, number in enumerate(numbers.tolist()):
        if number in record:
            one = record[int(number)]
            was_radius[row] = np.nan if one.radius_m is None else one.radius_m
            was_margin[row] = one.buffer_m or 0.0
    return was_radius, was_margin


def _place(rows: _Rows, grid: Grid | None) -> None:
    """Bring the position columns of rows that were moved up to date."""
    x, y = shapely.get_coordinates(shapely.centroid(rows.shapes)).T
    at = rows.at
    recorded = transformer(LONLAT, rows.crs).transform(at["lon"], at["lat"])
    moved = ~(np.hypot(x - recorded[0], y - recorded[1]) <= SAME_M)
    if not moved.any():
        return
    x, y = x[moved], y[moved]
    at["lon"][moved], at["lat"][moved] = transformer(rows.crs, LONLAT).transform(x, y)
    if grid is not None:
        at["x_px"][moved], at["y_px"][moved] = grid.from_crs(x, y, rows.crs)
