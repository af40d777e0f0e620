"""What a person knows to stand in or at fields, from a file or a table of their own."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely

from geofield import schema
from geofield.crs import DEGREE_M, LONLAT, parse_crs
from geofield.errors import CRSError, FormatError, TrackError
from geofield.finite import refuse_nowhere
from geofield.formats.antimeridian import unwrapped
from geofield.formats.foreign import has_rows, layer_names, read_vector
from geofield.formats.foreign_tables import (
    BUFFER_COLUMNS,
    NUMBER_COLUMNS,
    RADIUS_COLUMNS,
    column_like,
    numbers_like,
    obstacle_table,
)
from geofield.formats.gpkg_read import is_own
from geofield.formats.raw_tables import CSV
from geofield.formats.table_positions import read_table
from geofield.model.field import Field
from geofield.model.obstacles import LINE_HALF_WIDTH_M, POINT_RADIUS_M, idle
from geofield.model.review import reconcile
from geofield.model.written import (
    free_number,
    listed,
    plain,
    shapes_of_plain,
    unlisted,
)
from geofield.parts import in_parts
from geofield.plan import Plan
from geofield.strangers import is_geopackage
from geofield.wording import NAME_CRS, SWAP

#: Outlines, in an array or a list.
Shapes = Sequence[shapely.Geometry] | np.ndarray
#: What a plan was given of such a file, in its evidence.
_GIVEN = "given"
#: Shapes that share so much of the ground of both are one object, moved or measured again.
_SAME_SHARE = 0.25
#: What is left of a shape by the rounding of others.
_ROUNDED_SHARE = 0.01
#: Points are wider than they look; the least that is looked at around a field.
_NEAR_M = 100.0
#: Rows of a file that have no shape, by their numbers from 1.
WITHOUT_SHAPE = "without_shape"
#: The layers that rows are of, where a file has several.
LAYERS = "layers"
#: How far from a field something of the file may stand that reaches into it, metres.
_NEAR = "near_m"
_LINES = ("LineString", "LinearRing")
#: A longitude of -179.9 degrees is one of 180.1, too.
_TURNS: tuple[float, ...] = (-360.0, 0.0, 360.0)


def obstacles_of(path: Path, crs: str | None = None) -> gpd.GeoDataFrame:
    """What to avoid, from any file: its rows, numbered as in the file; longitude and latitude.

    Of a plan, or several in one GeoPackage, their obstacles as they stand; of another file all its
    layers, which its attributes name where they are several. Read once per process, however many
    fields there are, until the file changes. Rows without a shape are left out, and named in its
    attributes.

    Raises
    ------
    FormatError
        For a point whose radius or margin is there and cannot be understood.
    """
    # What a Shapefile says of sizes lies beside it, as does what a GeoPackage took last.
    parts = (path, path.with_suffix(".dbf"), path.with_name(f"{path.name}-wal"))
    stats = [part.stat() for part in parts if part.is_file()]
    return _read(path, crs, tuple((one.st_mtime_ns, one.st_size) for one in stats))


@lru_cache(maxsize=2)
def _read(path: Path, crs: str | None, _stamp: tuple[tuple[int, int], ...]) -> gpd.GeoDataFrame:
    frame, layers = _rows_and_layers(path)
    if frame.crs is None:
        if crs is None:
            raise CRSError(f"{path} does not say its CRS.", hint=NAME_CRS)
        frame = frame.set_crs(parse_crs(crs))
    rows = known_rows(frame, path.name)
    rows.attrs[LAYERS] = layers
    return rows


def known_rows(table: gpd.GeoDataFrame, name: str) -> gpd.GeoDataFrame:
    """The rows of a table of what to avoid, part by part, numbered; those without a shape left out.

    Raises
    ------
    CRSError
        When the table has no CRS.
    FormatError
        For a point whose radius or margin is there and cannot be understood.
    """
    if table.crs is None:
        raise CRSError(f"{name} does not say its CRS.", hint="Set it: table.set_crs(...).")
    if column_like(table, NUMBER_COLUMNS) is None:
        table = table.assign(obstacle_no=np.arange(1, len(table) + 1))
    table = table.reset_index(drop=True)
    empty = np.asarray(table.geometry.isna() | table.geometry.is_empty)
    refuse_nowhere(table.geometry.to_numpy(), name)
    rows = in_parts(table[~empty])
    _understand_lengths(rows, name)
    rows = rows.reset_index(drop=True)
    rows.attrs[WITHOUT_SHAPE] = [int(row) + 1 for row in table.index[empty]]
    rows.attrs[_NEAR] = max(_NEAR_M, 1.1 * float(_reach_m(rows).max(initial=0.0)))
    return rows


def _rows_and_layers(path: Path) -> tuple[gpd.GeoDataFrame, list[str]]:
    """The rows of a file, and of which of several layers they are."""
    if _holds_obstacles(path):
        return read_vector(path, schema.OBSTACLES.name), []
    if path.suffix.lower() in CSV:
        return read_table(path), []
    names = layer_names(path)
    if is_own(path):
        raise FormatError(
            f"{path} is a plan in which no obstacle stands.",
            hint="Leave it out, or search or draw some in it: geofield obstacles, geofield review.",
        )
    several = names if len(names) > 1 else ()
    tables = {name: table for name in several if len(table := read_vector(path, name))}
    if not tables:
        return read_vector(path), []
    crs = next(iter(tables.values())).crs
    alike = [each if each.crs == crs else each.to_crs(crs) for each in tables.values()]
    return pd.concat(alike, ignore_index=True), list(tables) if len(tables) > 1 else []


def _understand_lengths(rows: gpd.GeoDataFrame, name: str) -> None:
    """Make radius and margin of points and lines numbers; refuse what would become smaller."""
    for names in (RADIUS_COLUMNS, BUFFER_COLUMNS):
        said = column_like(rows, names)
        if said is None:
            continue
        lengths_m = numbers_like(rows, names)
        blank = said.isna() | (said.astype(str).str.strip() == "")
        thin = rows.geom_type.isin(["Point", *_LINES])
        wrong = ~blank & thin & ~((lengths_m >= 0) & np.isfinite(lengths_m))
        if wrong.any():
            row, text = rows.index[wrong][0] + 1, str(said[wrong].iloc[0])
            raise FormatError(
                f"{name}, row {row}: {said.name} {text!r} is no length.",
                hint="Write metres as a number, such as 6.5, or leave it empty.",
            )
        rows[said.name] = lengths_m


def own_obstacles(places: Path) -> Path | None:
    """The file of the places itself, where geofield wrote it with obstacles of theirs."""
    mine = _holds_obstacles(places) and is_own(places)
    return places.absolute() if mine else None


def _holds_obstacles(path: Path) -> bool:
    """Whether it is a GeoPackage with a layer of obstacles in which something stands."""
    layer = schema.OBSTACLES.name
    return is_geopackage(path) and layer in layer_names(path) and has_rows(path, layer)


def _at_field(field: Field, standing: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """Those obstacles of a file that stand in or at a field, as its layer."""
    around = _around(field, standing)
    mine = standing.iloc[around].to_crs(field.crs)
    near = mine.geometry.intersects(field.polygon.buffer(standing.attrs[_NEAR]))
    if not near.any() and _swapped_here(standing, field):
        raise TrackError(
            f"The obstacles lie at {field.name} only with latitude and longitude swapped.",
            hint=f"Exchange them in the file of obstacles: {SWAP}",
        )
    table = obstacle_table(mine[near].reset_index(drop=True), field.crs, Path("obstacles"))
    reach = table.geometry.intersects(field.polygon)
    return table[reach].reset_index(drop=True)


def any_reached(standing: gpd.GeoDataFrame, outlines_lonlat: Iterable[Shapes]) -> bool:
    """Whether something of a file, as wide as it is, stands in or at one of the outlines (degrees).

    They come in parts, of which no more are looked at than it takes.
    """
    shapes = unwrapped(standing.to_crs(LONLAT).geometry.to_numpy())
    west, south, east, north = shapely.bounds(shapes).reshape(-1, 4).T
    # Degrees of latitude are up to 0.7 % shorter: what reaches in is never taken for outside.
    wide = 1.007 * _reach_m(standing) / DEGREE_M
    along = wide / np.maximum(np.cos(np.radians(south)), 0.01)
    west, east = west - along, east + along
    boxes = [shapely.box(west + turn, south - wide, east + turn, north + wide) for turn in _TURNS]
    tree = shapely.STRtree(np.concatenate(boxes))
    return any(
        tree.query(unwrapped(np.asarray(part, dtype=object)), predicate="intersects").size
        for part in outlines_lonlat
    )


def _reach_m(standing: gpd.GeoDataFrame) -> np.ndarray:
    """How far each row reaches beyond its own shape."""
    radius_m = numbers_like(standing, RADIUS_COLUMNS)
    margin_m = np.nan_to_num(numbers_like(standing, BUFFER_COLUMNS))
    point, line = standing.geom_type == "Point", standing.geom_type.isin(_LINES)
    half_m = np.where(
        point,
        np.nan_to_num(radius_m, nan=POINT_RADIUS_M),
        np.fmax(radius_m, LINE_HALF_WIDTH_M),
    )
    return np.where(point | line, half_m + margin_m, LINE_HALF_WIDTH_M)


def unsized_points(standing: gpd.GeoDataFrame) -> int:
    """How many points say no radius."""
    sized = numbers_like(standing, RADIUS_COLUMNS) > 0
    return int(np.count_nonzero((standing.geom_type == "Point") & ~sized))


def with_further(plan: Plan, standing: gpd.GeoDataFrame) -> Plan:
    """A plan with those obstacles of `known_rows` that it was not given before.

    What a person took away, moved or rejected of them stays so: an obstacle is taken in once.

    Raises
    ------
    TrackError
        When they would stand there with latitude and longitude swapped.
    """
    return _given(plan, _at_field(plan.field, standing))


def with_given(plan: Plan, before: Plan) -> Plan:
    """A plan with what the farm's plan was given of such a file since this one was taken out."""
    given = before.evidence.farm.get(_GIVEN, ())
    if not given or before.obstacles is None or before.field.crs != plan.field.crs:
        return plan
    shapes = shapes_of_plain([*map(unlisted, given)])
    return _given(plan, before.obstacles[_is_one_of(before.obstacles.geometry, shapes)])


def _given(plan: Plan, table: gpd.GeoDataFrame) -> Plan:
    """A plan with those rows that are new to it."""
    known = list(plan.evidence.farm.get(_GIVEN, ()))
    now = [*map(listed, plain(table.geometry))]
    given = {_GIVEN: [*known, *(one for one in now if one not in known)]}
    evidence = replace(plan.evidence, farm={**plan.evidence.farm, **given})
    if plan.obstacles is None:
        return replace(plan, obstacles=table, evidence=evidence)
    before, written = reconcile(plan.obstacles, plan.evidence.written, plan.grid)
    rejected = before.geometry[before["status"] == "rejected"].to_numpy()
    taken = shapes_of_plain([*map(unlisted, known), *written.removed])
    # What is driven around already is not there twice; what was only possible may be.
    avoided = before.geometry[~idle(before)].to_numpy()
    new = ~_is_one_of(table.geometry, np.concatenate([rejected, taken]))
    new &= ~_is_covered(table.geometry, avoided)
    if not new.any():
        return plan
    return with_rows(replace(plan, evidence=evidence), table[new])


def with_rows(plan: Plan, rows: gpd.GeoDataFrame) -> Plan:
    """A plan with further obstacles, numbered behind its own."""
    table, written = schema.empty(schema.OBSTACLES, plan.field.crs), plan.evidence.written
    if plan.obstacles is not None:
        table, written = reconcile(plan.obstacles, written, plan.grid)
    first = free_number(table, written)
    rows = rows.assign(obstacle_no=np.arange(first, first + len(rows)))
    parts = [part for part in (table, rows) if len(part)]
    joined = schema.conform(schema.OBSTACLES, pd.concat(parts, ignore_index=True), extras=True)
    return replace(plan, obstacles=joined, evidence=replace(plan.evidence, written=written))


def _is_one_of(shapes: Any, others: Any) -> np.ndarray:
    """Whether each is the same object as some other: of the ground of both they share a part."""
    mine, theirs = _sound(shapes), _sound(others)
    row, other = shapely.STRtree(theirs).query(mine, predicate="intersects")
    shared = shapely.area(shapely.intersection(mine[row], theirs[other]))
    either = shapely.area(mine[row]) + shapely.area(theirs[other]) - shared
    return np.isin(np.arange(len(mine)), row[shared >= _SAME_SHARE * either])


def _is_covered(shapes: Any, others: Any) -> np.ndarray:
    """Whether each lies in others but for rounding: a fence through a tree does not."""
    mine, theirs = _sound(shapes), _sound(others)
    row, other = shapely.STRtree(theirs).query(mine, predicate="intersects")
    result = np.zeros(len(mine), bool)
    for at in np.unique(row):
        left = mine[at].difference(shapely.union_all(theirs[other[row == at]]))
        result[at] = left.area <= _ROUNDED_SHARE * mine[at].area
    return result


def _sound(shapes: Any) -> np.ndarray:
    """Shapes of which areas can be asked."""
    array = np.asarray(shapes, dtype=object)
    return np.where(shapely.is_valid(array), array, shapely.make_valid(array))


def _around(field: Field, standing: gpd.GeoDataFrame) -> np.ndarray:
    """Rows of the file around a field, by its index, in the file's order."""
    near = field.polygon.buffer(2.0 * standing.attrs[_NEAR])
    around = gpd.GeoSeries([near], crs=field.crs)
    there = np.asarray(around.to_crs(standing.crs))
    turns: tuple[float, ...] = (0.0,)
    if standing.crs.is_geographic:
        there, turns = unwrapped(there), _TURNS
    west, south, east, north = shapely.total_bounds(there)
    boxes = [shapely.box(west + turn, south, east + turn, north) for turn in turns]
    return np.unique(standing.sindex.query(boxes)[1])


def _swapped_here(standing: gpd.GeoDataFrame, field: Field) -> bool:
    """Whether obstacles would stand in the field with their latitude and longitude exchanged."""
    west, south, east, north = field.polygon_lonlat.bounds
    exchanged = shapely.box(south, west, north, east)
    if not standing.crs.is_geographic:
        return False
    there = standing.iloc[standing.sindex.query(exchanged)]
    swapped = shapely.transform(there.geometry.to_numpy(), lambda xy: xy[:, ::-1])
    return bool(shapely.intersects(swapped, field.polygon_lonlat).any())
