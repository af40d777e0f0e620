"""A new detection joined with an earlier table of obstacles, in which a person's word stands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from geofield import schema
from geofield.model.obstacles import next_number
from geofield.model.written import Written, matches, shapes_of_plain
from geofield.wording import counted

if TYPE_CHECKING:
    import geopandas as gpd


@dataclass(frozen=True, slots=True)
class Changes:
    """What a detection changed in the table of obstacles."""

    #: Rows that are a person's word.
    kept: int = 0
    #: found_again, new, gone: other rows that were there before and are found again; that were not;
    #: that no longer are.
    found_again: int = 0
    new: int = 0
    gone: int = 0
    #: Detections left out because a person took the obstacle away.
    stay_deleted: int = 0

    def in_words(self) -> str:
        """One line for people."""
        kept = f"{counted(self.kept, 'obstacle')} of yours kept"
        words = [kept, f"{self.found_again} found again"]
        for count, what in ((self.new, "new"), (self.gone, "gone")):
            words += [f"{count} {what}"] if count else []
        if self.stay_deleted:
            words.append(f"{self.stay_deleted} you took away not taken up again")
        return ", ".join(words)


def merge(
    detected: gpd.GeoDataFrame, previous: gpd.GeoDataFrame, written: Written
) -> tuple[gpd.GeoDataFrame, Written, Changes]:
    """Join a new detection with an earlier table, in which a person's word stands.

    Rows that are a person's word stay as they are; a detection of the same object gives way to
    them. What a person took away is not found again. Other detections keep the number and the
    user's own columns that they had before where they are found again; new ones get fresh numbers.

    `previous` is in the same CRS, and `written` its record, both as :func:`reconcile` returned
    them.
    """
    record = written.by_number
    kept = np.array([record[number].kept for number in previous["obstacle_no"]], dtype=bool)
    word, earlier = previous[kept], previous[~kept].reset_index(drop=True)
    known = matches(detected.geometry, word.geometry) >= 0
    fresh = detected[~known].reset_index(drop=True)
    # What was taken away competes with what is still there: a neighbour stays itself.
    places = np.concatenate([earlier.geometry.to_numpy(), shapes_of_plain(written.removed)])
    match = matches(fresh.geometry, places)
    taken_away = match >= len(earlier)
    fresh, match = fresh[~taken_away].reset_index(drop=True), match[~taken_away]
    again = (match >= 0) & ~pd.Series(match).duplicated().to_numpy()
    numbers = np.zeros(len(fresh), dtype=np.int64)
    old = earlier["obstacle_no"].to_numpy(dtype=np.int64)
    numbers[again] = old[match[again]]
    numbers[~again] = next_number(previous) + np.arange((~again).sum())
    fresh["obstacle_no"] = pd.array(numbers, dtype="Int64")
    source = np.where(again, match, -1)
    for name in schema.own_columns(schema.OBSTACLES, previous):
        fresh[name] = _taken(earlier[name], source)
    parts = [part for part in (word, fresh) if len(part)]
    joined = pd.concat(parts) if parts else fresh
    result = schema.conform(schema.OBSTACLES, joined, extras=True)
    result.attrs.update(detected.attrs)
    stays = result["obstacle_no"].isin(word["obstacle_no"]).to_numpy(bool)
    changes = Changes(
        kept=len(word),
        found_again=int(again.sum()),
        new=int((~again).sum()),
        gone=len(earlier) - int(again.sum()),
        stay_deleted=int(taken_away.sum()),
    )
    return result, Written.of(result, stays, written.removed), changes


def _taken(series: pd.Series[Any], rows: NDArray[np.int64]) -> Any:
    """The values of rows; missing ones for -1."""
    # Whole numbers and truth values stay what they are beside missing ones.
    values = series.convert_dtypes() if series.dtype.kind in "iub" else series
    return pd.api.extensions.take(values.array, rows, allow_fill=True)
