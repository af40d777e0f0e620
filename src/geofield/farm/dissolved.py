"""Rows of a farm's overview that another program merged across fields: each thing is what it was.

Inside one field `geofield.model.merged_rows` and `geofield.model.lost_numbers` see to that, but a
row names one field alone: what was merged into it of others was gone there.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from numpy.typing import NDArray

from geofield import schema
from geofield.crs import metre_in
from geofield.errors import FormatWarning
from geofield.farm.layers import FIELD_ID
from geofield.model.obstacles import active, idle
from geofield.model.written import SAME_M, same_shapes
from geofield.notes import warn
from geofield.wording import counted, some_of

#: What tells the rows of a field apart.
KEYS = {
    schema.OBSTACLES: ("obstacle_no",),
    schema.TRACKS: ("track_no",),
    schema.SEGMENTS: ("track_no", "segment_no"),
}
#: How far a shape may reach out of one that it was merged into, metres.
_OUT_M = 0.01
#: Fields that are told by name.
TOLD = 5

_Mask = NDArray[np.bool_]
_At = NDArray[np.int64]


def undissolved(
    of: schema.Layer, rows: gpd.GeoDataFrame, written: gpd.GeoDataFrame, fields: gpd.GeoDataFrame
) -> tuple[gpd.GeoDataFrame, set[str]]:
    """A layer in which what was merged into rows of other fields is again as it was written.

    A part that is just as a row was written that is gone is that row; so is an obstacle that lost
    its number or its field, with what stands in it now. What else is in a merged row is of the
    field in which it lies. A row that is not driven around is no word on what it took in of other
    fields. Either is told.

    `rows` is one of the layers `KEYS` as it was left, `written` as it is in the farm, in the same
    CRS and with columns of the same names; `fields` are the outlines. The ids that come with the
    layer are those of fields of which something stands in merged rows.
    """
    rows, written = (table.reset_index(drop=True) for table in (rows, written))
    now, before = _names(of, rows), _names(of, written)
    ids: set[str] = set()
    if not len(rows) or np.isin(before, now).all():
        return rows, ids
    unit = metre_in(written.crs)
    (parts, row), apart = _Parts.of(rows), _Parts.of(written)
    pairs = _Pairs.of(parts, row, apart, SAME_M * unit)
    gone, mine = ~np.isin(before, now)[pairs.written], now[pairs.row] == before[pairs.written]
    merged = _merged(pairs, row)[pairs.row]
    alone = ~merged & gone
    alone &= _alone(of, rows, written, pairs, fields) if of is schema.OBSTACLES else False
    found = alone | (merged & gone)
    if found.any():
        found |= merged & mine & np.isin(pairs.row, pairs.row[found])
        back = _as_written(rows, written, apart, pairs.only(found), mine[found], alone[found])
        rest = np.setdiff1d(np.flatnonzero(np.isin(row, pairs.row[found])), pairs.part[found])
        left = _where_it_lies(of, rows.iloc[row[rest]].set_geometry(parts[rest]), fields)
        whole = rows.drop(index=np.unique(pairs.row[found]))
        rows = _stacked(of, whole, left, back)
        again = written.iloc[pairs.written[merged & gone]]
        _tell(of, again, "each counts as it was written")
        ids.update(again[FIELD_ID].astype(str))
    if of is not schema.OBSTACLES:
        return rows, ids
    return _driven_around(rows, written[~np.isin(before, _names(of, rows))], _OUT_M * unit), ids


class _Parts(NamedTuple):
    """The single shapes of a table, and the rows that they are of."""

    shapes: NDArray[np.object_]
    row: _At

    @classmethod
    def of(cls, table: gpd.GeoDataFrame) -> _Parts:
        return cls(*shapely.get_parts(table.geometry.to_numpy(), return_index=True))


class _Pairs(NamedTuple):
    """Parts of rows that are just as parts of rows were written."""

    part: _At
    row: _At
    one: _At
    written: _At

    @classmethod
    def of(cls, parts: Any, row: _At, written: _Parts, tolerance: float) -> _Pairs:
        known, of_row = written
        tree = shapely.STRtree(shapely.centroid(known))
        part, one = tree.query(shapely.centroid(parts), "dwithin", 10 * tolerance)
        same = same_shapes(parts[part], known[one], tolerance)
        part, one = part[same], one[same]
        return cls(part, row[part], one, of_row[one])

    def only(self, some: _Mask) -> _Pairs:
        return _Pairs(*(each[some] for each in self))


def _names(of: schema.Layer, rows: gpd.GeoDataFrame) -> NDArray[np.object_]:
    """What tells rows apart, as text; empty where a part of that is missing."""
    keys = rows[[FIELD_ID, *KEYS[of]]]
    texts = zip(*(keys[name].astype("string").fillna("") for name in keys), strict=True)
    return np.where(keys.notna().all(axis=1), np.array(["\0".join(t) for t in texts], object), "")


def _merged(pairs: _Pairs, row: _At) -> _Mask:
    """Which rows hold parts of several that were written, or of one and what nobody wrote."""
    count = int(row.max()) + 1
    each = np.unique(np.column_stack([pairs.row, pairs.written]), axis=0)[:, 0]
    strange = np.setdiff1d(np.arange(len(row)), pairs.part)
    several = np.bincount(each, minlength=count) + np.isin(np.arange(count), row[strange])
    return (several > 1) & (np.bincount(row, minlength=count) > 1)


def _alone(
    of: schema.Layer, rows: gpd.GeoDataFrame, written: gpd.GeoDataFrame, pairs: _Pairs,
    fields: gpd.GeoDataFrame,
) -> _Mask:  # fmt: skip
    """Which pairs are of rows without a number, or a field, that stand as they were written.

    Where another such row stands in the field otherwise, all are left to be told apart there.
    """
    keys = [FIELD_ID, *KEYS[of]]
    said, known = rows.iloc[pairs.row][keys], written.iloc[pairs.written]
    agree = np.ones(len(pairs.row), bool)
    for name in keys:
        there = said[name].notna().to_numpy(bool)
        agree[there] &= said[name][there].to_numpy() == known[name][there].to_numpy()
    agree &= said.isna().any(axis=1).to_numpy(bool)
    lost = rows[keys].isna().any(axis=1).to_numpy(bool, copy=True)
    lost[pairs.row[agree]] = False
    others = fields.sindex.query(rows.geometry[lost], predicate="intersects")[1]
    elsewhere = fields[FIELD_ID].iloc[np.unique(others)]
    agree &= ~known[FIELD_ID].isin(elsewhere).to_numpy(bool)
    return agree


def _as_written(
    rows: gpd.GeoDataFrame,
    written: gpd.GeoDataFrame,
    apart: _Parts,
    pairs: _Pairs,
    mine: _Mask,
    alone: _Mask,
) -> gpd.GeoDataFrame:
    """The rows that were found, each once; with what now stands in those that say it themselves."""
    at, first = np.unique(pairs.written, return_index=True)
    back = written.iloc[at].reset_index(drop=True)
    said = rows.iloc[pairs.row[first]].reset_index(drop=True)
    for name in rows.columns.drop(rows.geometry.name):
        before = back[name] if name in back else pd.Series([None] * len(back), dtype=object)
        holds = mine[first] | (alone[first] & said[name].notna().to_numpy(bool))
        back[name] = said[name].where(holds, before) if holds.any() else before
    # Of a track perhaps some parts alone are there.
    shapes = back.geometry.to_numpy().copy()
    known, of_row = apart
    there = np.unique(pairs.one)
    for i in np.flatnonzero(np.bincount(of_row[there])[at] < np.bincount(of_row)[at]):
        shapes[i] = shapely.multilinestrings(known[there[of_row[there] == at[i]]])
    return back.set_geometry(shapes, crs=written.crs)


def _where_it_lies(
    of: schema.Layer, parts: gpd.GeoDataFrame, fields: gpd.GeoDataFrame
) -> gpd.GeoDataFrame:
    """What is left of merged rows: obstacles of their field, and what was drawn there or beside."""
    shapes = parts.geometry.to_numpy()
    at = pd.Index(fields[FIELD_ID]).get_indexer(parts[FIELD_ID])
    stays = np.full(len(parts), of is schema.OBSTACLES)
    stays &= (at >= 0) & shapely.intersects(fields.geometry.to_numpy()[at], shapes)
    return _stacked(of, parts[stays], _drawn(of, shapes[~stays], None, parts))


def _driven_around(rows: gpd.GeoDataFrame, gone: gpd.GeoDataFrame, out: float) -> gpd.GeoDataFrame:
    """Obstacles, and what one that is not driven around covers of other fields."""
    gone = active(gone)
    inner = shapely.buffer(gone.geometry.to_numpy(), -out)
    one, row = rows.sindex.query(inner, predicate="covered_by")
    owner = gone[FIELD_ID].to_numpy(dtype=object)[one]
    elsewhere = rows[FIELD_ID].to_numpy(dtype=object)[row] != owner
    taken = idle(rows)[row] & (elsewhere | rows["obstacle_no"].isna().to_numpy(bool)[row])
    if not taken.any():
        return rows
    back = pd.DataFrame({"row": row[taken], "owner": owner[taken]}).drop_duplicates()
    shapes = rows.geometry.to_numpy()[back["row"]]
    _tell(schema.OBSTACLES, gone.iloc[one[taken]], "all of it is driven around there")
    return _stacked(
        schema.OBSTACLES, rows, _drawn(schema.OBSTACLES, shapes, back["owner"].to_numpy(), rows)
    )


def _drawn(of: schema.Layer, shapes: Any, owners: Any, like: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """Rows that say nothing but where they are, and perhaps whose."""
    if of is schema.TRACKS:
        shapes = shapely.multilinestrings(shapes, indices=np.arange(len(shapes)))
    names = schema.own_columns(of, like)
    own = {name: np.full(len(shapes), None, dtype=object) for name in names}
    if owners is not None:
        own[FIELD_ID] = owners
    return schema.table(of, {}, shapes, like.crs, own)


def _stacked(of: schema.Layer, *tables: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    some = [table for table in tables if len(table)]
    return schema.conform(of, pd.concat(some) if some else tables[0], extras=True)


def _tell(of: schema.Layer, gone: gpd.GeoDataFrame, words: str) -> None:
    gone = gone[~gone.index.duplicated()]
    if gone.empty:
        return
    ids = sorted(set(gone[FIELD_ID].astype(str)))
    warn(
        f"Layer {of.name!r}: {counted(len(gone), 'row')} of field {some_of(ids, TOLD)} "
        f"merged into another row: {words}.",
        FormatWarning,
    )
