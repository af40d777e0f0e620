"""Rows of obstacles that another program merged: each thing in them is what it was."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import shapely

from geofield import schema
from geofield.errors import FormatWarning
from geofield.model.obstacles import active, floats
from geofield.model.written import WrittenRow, same_shapes, shapes_of_plain

if TYPE_CHECKING:
    import geopandas as gpd

_WORDS = ("obstacle_no", "kind", "status", "radius_m", "buffer_m")
#: How far a shape may reach out of one that it was merged into, metres.
_OUT_M = 0.01


def unmerged(obstacles: gpd.GeoDataFrame, record: Mapping[int, WrittenRow]) -> gpd.GeoDataFrame:
    """A table in which what was said of one thing is not said of those merged with it.

    A part with the number of another, just as one was written whose number no row has, is that
    one. What such a one became a piece of is driven around if it was. Either is told.

    Parameters
    ----------
    obstacles : GeoDataFrame
        Layer `obstacles`, with areas alone, those of several parts apart.
    record : mapping of int to WrittenRow
        What was written, by number.
    """
    numbers = floats(obstacles, "obstacle_no")
    there = set(numbers.tolist())
    gone = [row for row in record.values() if row.obstacle_no not in there]
    if not gone or np.isnan(numbers).all():
        return obstacles
    table = obstacles.reset_index(drop=True)
    shapes = np.asarray(table.geometry.array, dtype=object)
    written = shapes_of_plain([row.shape for row in gone])
    inner = shapely.buffer(written, -_OUT_M)
    of, row = shapely.STRtree(shapes).query(inner, predicate="covered_by")
    known = np.isin(numbers[row], list(record))
    of, row = of[known], row[known]
    before = shapes_of_plain([record[int(number)].shape for number in numbers[row]])
    merged = ~shapely.covers(before, inner[of])
    apart = merged & same_shapes(shapes[row], written[of])
    driven = merged & ~apart & ~table.index.isin(active(table).index)[row]
    driven &= np.array([gone[i].status not in schema.NOT_AVOIDED for i in of], bool)
    for i, at in zip(of[apart], row[apart], strict=True):
        table.loc[at, list(_WORDS)] = [getattr(gone[i], name) for name in _WORDS]
        table.loc[at, ["confidence", "radius_px"]] = np.nan
    for i, at in zip(of[driven], row[driven], strict=True):
        table.loc[at, "status"] = gone[i].status
    _tell([gone[i] for i in of[apart]], "each counts as it was written, under its own number")
    _tell([gone[i] for i in of[driven]], "all of it is driven around")
    return table


def _tell(rows: list[WrittenRow], words: str) -> None:
    if rows:
        names = ", ".join(str(row.obstacle_no) for row in rows[:20])
        warnings.warn(
            f"Obstacles merged into another row ({names}{', ...' * (len(rows) > 20)}): {words}.",
            FormatWarning,
            stacklevel=4,
        )
