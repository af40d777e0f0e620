"""Rows of obstacles that were copied and left where they are: one thing, said more than once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import shapely
from numpy.typing import NDArray

from geofield import schema
from geofield.errors import FormatWarning
from geofield.model.obstacles import idle
from geofield.model.written import SAME_M, Record, WrittenRow, same_shapes
from geofield.notes import warn

if TYPE_CHECKING:
    import geopandas as gpd

_WORDS = {"status": schema.STATUSES, "kind": schema.KINDS}
_OURS = (*_WORDS, "radius_m", "buffer_m")
#: What differs in a row from what was written, by column.
_Said = tuple[tuple[str, Any], ...]


def without_copies(obstacles: gpd.GeoDataFrame, record: Record) -> gpd.GeoDataFrame:
    """A table of areas in which no row lies exactly on another of its number, or of none.

    What differs from what was written is a person's word about that thing, in whichever of the
    rows it stands: that row is the obstacle. Of rows that say different things those stand that
    are driven around. Either way it is told.
    """
    first = _first_alike(obstacles)
    copied = np.flatnonzero(np.bincount(first, minlength=len(first)) > 1)
    if not len(copied):
        return obstacles
    stays = np.ones(len(obstacles), dtype=bool)
    numbers = obstacles["obstacle_no"].copy()
    told: dict[str, list[str]] = {}
    for one in copied:
        group = np.flatnonzero(first == one)
        number = next(iter(numbers.iloc[group].dropna()), None)
        written = None if number is None else record.get(int(number))
        stays[group], words = _standing(obstacles.iloc[group], written)
        numbers.iloc[group] = number
        told.setdefault(words, []).append("?" if number is None else str(int(number)))
    for words, names in told.items():
        warn(f"Rows copied in place (obstacle {', '.join(names)}): {words}.", FormatWarning)
    return obstacles.assign(obstacle_no=numbers)[stays]


def _first_alike(obstacles: gpd.GeoDataFrame) -> NDArray[np.int64]:
    """For each row the first of its shape that has its number, or where one has none."""
    numbers = obstacles["obstacle_no"].to_numpy(dtype="float64", na_value=np.nan)
    first = np.arange(len(numbers))
    suspect = np.isnan(numbers) | pd.Series(numbers).duplicated(keep=False).to_numpy()
    if not suspect.any():
        return first
    shapes = np.asarray(obstacles.geometry.array, dtype=object)
    row, other = shapely.STRtree(shapes).query(shapes[suspect])
    row = np.flatnonzero(suspect)[row]
    of_one = np.isnan(numbers[row]) | np.isnan(numbers[other]) | (numbers[row] == numbers[other])
    bounds = shapely.bounds(shapes)
    near = (np.abs(bounds[row] - bounds[other]) <= SAME_M).all(axis=1)
    pair = np.flatnonzero((row != other) & of_one & near)
    pair = pair[same_shapes(shapes[row[pair]], shapes[other[pair]])]
    np.minimum.at(first, np.r_[row[pair], other[pair]], np.r_[other[pair], row[pair]])
    return first


def _standing(rows: gpd.GeoDataFrame, written: WrittenRow | None) -> tuple[NDArray[np.bool_], str]:
    """Which of the rows on one place stand, and what is told of that."""
    said = _said(rows, written)
    different = [each for each in dict.fromkeys(said) if each]
    in_words = "; ".join(", ".join(f"{name} {value}" for name, value in one) for one in different)
    if not different:
        different, words = said[:1], "they are alike and count once"
    elif len(different) == 1:
        words = f"what was changed in one of them holds ({in_words})"
    else:
        avoided = {each for each, passed in zip(said, idle(rows), strict=True) if not passed}
        different = [each for each in different if each in avoided] or different[:1]
        words = f"they contradict each other ({in_words}), and what is driven around holds"
    stand = np.zeros(len(rows), dtype=bool)
    stand[[said.index(each) for each in different]] = True
    return stand, words


def _said(rows: gpd.GeoDataFrame, written: WrittenRow | None) -> list[_Said]:
    """What each row says that was not written; without a record, that the first one does not."""
    names = [*_OURS, *schema.own_columns(schema.OBSTACLES, rows)]
    cells = [
        {name: _cell(name, value) for name, value in zip(names, values, strict=True)}
        for values in rows[names].itertuples(index=False)
    ]
    if written is None:
        of_ours = {}
        plain = next((each for each in cells if each["status"] not in schema.REVIEWED), None)
        plain = plain or {**cells[0], "status": None}
    else:
        of_ours = {name: _cell(name, getattr(written, name)) for name in _OURS}
        plain = next((each for each in cells if {**each, **of_ours} == each), cells[0])
    before = {**plain, **of_ours}
    return [
        tuple((n, value) for n, value in each.items() if value is not None and value != before[n])
        for each in cells
    ]


def _cell(name: str, value: Any) -> Any:
    """A value to compare; None for none, and for words that the schema does not know."""
    if not pd.api.types.is_scalar(value):
        return str(value)
    if pd.isna(value):
        return None
    if name in _WORDS:
        word = str(value).strip().lower()
        return word if word in _WORDS[name] else None
    return round(value, 3) if isinstance(value, float) else value
