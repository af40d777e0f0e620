"""Rows of obstacles that another program merged: each thing in them is what it was."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS

from geofield import schema
from geofield.errors import FormatWarning
from geofield.model.obstacles import circle_polygons, floats, idle
from geofield.model.resized import differ
from geofield.model.written import Record, WrittenRow, same_shapes, shapes_of_plain
from geofield.notes import warn
from geofield.wording import counted, some_of

if TYPE_CHECKING:
    import geopandas as gpd

_WORDS = ("obstacle_no", "kind", "status", "radius_m", "buffer_m")
_FOUND = ("confidence", "radius_px")
#: How far a shape may reach out of one that it was merged into, metres.
_OUT_M = 0.01
#: Obstacles that are told by number.
_TOLD = 20

_Mask = NDArray[np.bool_]


def parts_apart(obstacles: gpd.GeoDataFrame, record: Record | None = None) -> gpd.GeoDataFrame:
    """Obstacles of several parts as several obstacles; the further parts have the number still.

    What they are of is known by it: a size in the row is that of the whole, and none to draw
    the part by. Where nobody wrote that number, and what was written under one that no row has
    lies in the row, several were merged: what stands in it is said of none of them. Of other parts
    it is said, which is told where they are not driven around.
    """
    several = shapely.get_num_geometries(obstacles.geometry.to_numpy()) > 1
    if not several.any():
        return obstacles
    record = record or {}
    table = obstacles.reset_index(drop=True).explode(index_parts=False)
    row = table.index.to_numpy()
    table = table.reset_index(drop=True)
    known, taken = _known(table, record), _Taken.of(table, record)
    mixed = several[row] & ~known & np.isin(row, row[taken.at])
    table.loc[mixed, [*_WORDS, *_FOUND]] = None
    _write(table, taken.only(taken.same & mixed[taken.at]))
    further = several[row] & ~mixed & idle(table)
    further[taken.at] = False
    _tell_further(table, row, further)
    return table


def unmerged(obstacles: gpd.GeoDataFrame, record: Record) -> gpd.GeoDataFrame:
    """A table in which what was said of one thing is not said of those merged with it.

    It holds areas alone, those of several parts apart.

    A part with the number of another, just as one was written whose number no row has, is that
    one. What such a one became a piece of is driven around if it was, and no size in the row makes
    it smaller. All that is told, and what the row still says of the one whose number it has.
    """
    table = obstacles.reset_index(drop=True)
    taken = _Taken.of(table, record)
    if not len(taken.at):
        return obstacles
    numbers, known = floats(table, "obstacle_no"), _known(table, record)[taken.at]
    # A row of another number, or in a table that has none, is perhaps the one that it took in.
    merged = known | (np.bincount(taken.at)[taken.at] > 1)
    merged |= np.isnan(numbers)[taken.at] & ~np.isnan(numbers).all()
    own = np.unique(numbers[taken.at[known]])
    _write(table, taken.only(taken.same & known))
    whole = taken.only(~taken.same & merged)
    driven = whole.only(idle(table)[whole.at] & whole.were_driven_around)
    for one, at in zip(driven.rows, driven.at, strict=True):
        table.loc[at, "status"] = one.status
    _tell(driven.rows, "all of it is driven around")
    _keep_sizes(table, whole, record)
    _keep_own(table, [record[int(number)] for number in own])
    return table


class _Taken(NamedTuple):
    """What was written under a number that no row has, and the row that holds its shape now."""

    rows: list[WrittenRow]
    at: NDArray[np.intp]
    #: Whether that row is of its shape.
    same: _Mask

    @classmethod
    def of(cls, table: gpd.GeoDataFrame, record: Record) -> _Taken:
        numbers = floats(table, "obstacle_no")
        there = set(numbers.tolist())
        gone = [row for row in record.values() if row.obstacle_no not in there]
        shapes = np.asarray(table.geometry.array, dtype=object)
        written = shapes_of_plain([row.shape for row in gone])
        inner = shapely.buffer(written, -_OUT_M)
        one, at = shapely.STRtree(shapes).query(inner, predicate="covered_by")
        # A row that held it when it was written took nothing in.
        known = [record.get(int(number)) for number in np.nan_to_num(numbers[at])]
        before = shapes_of_plain([row.shape if row else "POLYGON EMPTY" for row in known])
        new = ~shapely.covers(before, inner[one])
        one, at = one[new], at[new]
        return cls([gone[i] for i in one], at, same_shapes(shapes[at], written[one]))

    @property
    def were_driven_around(self) -> _Mask:
        return np.array([row.status not in schema.NOT_AVOIDED for row in self.rows], bool)

    def only(self, some: _Mask) -> _Taken:
        rows = [row for row, is_one in zip(self.rows, some, strict=True) if is_one]
        return _Taken(rows, self.at[some], self.same[some])


def _known(table: gpd.GeoDataFrame, record: Record) -> _Mask:
    """Which rows have a number that was written."""
    return np.isin(floats(table, "obstacle_no"), list(record))


def _write(table: gpd.GeoDataFrame, taken: _Taken) -> None:
    """What was written, into the rows that have its shape."""
    for one, at in zip(taken.rows, taken.at, strict=True):
        table.loc[at, list(_WORDS)] = [getattr(one, name) for name in _WORDS]
        table.loc[at, list(_FOUND)] = np.nan
    _tell(taken.rows, "each counts as it was written, under its own number")


def _keep_sizes(table: gpd.GeoDataFrame, taken: _Taken, record: Record) -> None:
    """Leave merged rows no radius whose circle does not hold what they took in.

    Programs that merge rows write means and sums into them. A margin without a number is none.
    """
    numbers, radius, margin = (floats(table, name) for name in _WORDS[:1] + _WORDS[3:])
    smaller: list[WrittenRow] = []
    for at in np.unique(taken.at):
        held = [row for row, there in zip(taken.rows, taken.at, strict=True) if there == at]
        own = record.get(int(np.nan_to_num(numbers[at])))
        if own is not None:
            held.append(own)
        elif np.isnan(numbers[at]):
            table.loc[at, "buffer_m"] = np.nan  # it is in the shape
        was = np.nan if own is None or own.radius_m is None else own.radius_m
        if not (np.isfinite(radius[at]) and differ(radius[at], was)):
            continue
        middle = shapely.centroid(table.geometry[at])
        total = radius[at] + np.nan_to_num(margin[at])
        circle = circle_polygons(middle.x, middle.y, total, CRS(table.crs))[0]
        inner = shapely.buffer(shapes_of_plain([row.shape for row in held]), -_OUT_M)
        if not shapely.covers(circle, inner).all():
            table.loc[at, "radius_m"] = np.nan
            smaller += held
    _tell(smaller, "the shape counts, and not radius_m, which leaves some of it out")


def _keep_own(table: gpd.GeoDataFrame, own: list[WrittenRow]) -> None:
    """Make the rows that took others in not smaller themselves, and tell what they now are."""
    numbers = floats(table, "obstacle_no")
    for one in own:
        for at in np.flatnonzero(numbers == one.obstacle_no):
            for name in ("radius_m", "buffer_m"):
                before = getattr(one, name)
                if before is not None and table.loc[at, name] < before:
                    table.loc[at, name] = before
                    _warn(
                        f"Obstacle {one.obstacle_no}, which took in others, keeps {name} {before:g}"
                    )
            if idle(table)[at] and one.status not in schema.NOT_AVOIDED:
                status = table.loc[at, "status"]
                _warn(f"Obstacle {one.obstacle_no}, which took in others, is now {status} itself")


def _tell_further(table: gpd.GeoDataFrame, row: NDArray[np.intp], more: _Mask) -> None:
    """Tell of parts, those that are `more` than one in their row, that are what the row says."""
    for status in table["status"][more].unique():
        some = more & (table["status"] == status).to_numpy(bool)
        count = int(some.sum()) - len(np.unique(row[some]))
        if count:
            parts = counted(count, "further part of them is", "further parts of them are")
            _warn(f"Obstacles of several parts that are {status}: {parts}, too")


def _tell(rows: Iterable[WrittenRow], words: str) -> None:
    numbers = sorted({row.obstacle_no for row in rows})
    if numbers:
        names = [str(number) for number in numbers]
        _warn(f"Obstacles merged into another row ({some_of(names, _TOLD)}): {words}")


def _warn(words: str) -> None:
    warn(f"{words}.", FormatWarning)
