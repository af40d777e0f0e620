"""A new detection joined with an earlier table of obstacles, in which a person's word stands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import shapely
from numpy.typing import NDArray
from pyproj import CRS

from geofield import schema
from geofield.grid import Grid
from geofield.model.frame import Shown, ground
from geofield.model.obstacles import active, floats, idle, on_grid
from geofield.model.written import Written, matches, shapes_of_plain
from geofield.wording import counted, some_of

if TYPE_CHECKING:
    import geopandas as gpd

#: Share of a shape outside another from which it is more than that.
_OUTGROWN = 0.3
#: So many times the area of what is driven through, with its margin, the crown of a tree is none of
#: it: of 41 such in pictures of another year 38 were trees, where a car or a shrub had been.
_ANOTHER = 2.0


@dataclass(frozen=True, slots=True)
class Changes:
    """What a detection changed in the table of obstacles."""

    #: Rows that are a person's word.
    kept: int = 0
    #: Numbers of those that a person confirmed, where the picture shows nothing like them.
    unfound: tuple[int, ...] = ()
    #: Numbers of those beside which a larger part of what is found there is driven through.
    outgrown: tuple[int, ...] = ()
    #: Other rows that stay, for the picture does not show where they stand.
    unseen: int = 0
    #: Other rows that were there before and are found again.
    found_again: int = 0
    #: Numbers of rows that were not there before, and of other rows that no longer are.
    new: tuple[int, ...] = ()
    gone: tuple[int, ...] = ()
    #: Detections left out because a person took the obstacle away.
    stay_deleted: int = 0

    def in_words(self) -> str:
        """One line for people."""
        kept = f"{counted(self.kept, 'obstacle')} of yours kept"
        words = [kept, f"{self.found_again} found again"]
        for numbers, what in (
            (self.new, "new"),
            (self.gone, "gone"),
            (self.unfound, "you confirmed not found"),
            (self.outgrown, "of yours smaller than what is found there"),
        ):
            told = some_of([str(number) for number in numbers], 8)
            words += [f"{len(numbers)} {what} ({told})"] if numbers else []
        if self.unseen:
            words.append(f"{self.unseen} left where the picture shows nothing")
        if self.stay_deleted:
            words.append(f"{self.stay_deleted} you took away not taken up again")
        return ", ".join(words)


def merge(
    detected: gpd.GeoDataFrame,
    previous: gpd.GeoDataFrame,
    written: Written,
    outline: shapely.Polygon,
    grid: Grid,
    shown_px: Shown | None = None,
) -> tuple[gpd.GeoDataFrame, Written, Changes]:
    """Join a new detection with an earlier table, in which a person's word stands.

    Rows that are a person's word stay as they are; a detection of the same object gives way to
    them, as does a further one that hardly reaches out of them. What a person took away is not
    found again. Where that, or what they rejected, was far smaller, a tree is another one. Other
    detections keep the number and the user's own columns that they had before where they are found
    again; new ones get fresh numbers. What stands in the field where the picture shows nothing is
    neither found nor gone: it stays.

    `previous` and the field's `outline` are in the same CRS, and `written` is the record, as
    :func:`reconcile` returned them. `grid` is the picture's, `shown_px` where it has data.
    """
    record = written.by_number
    kept = np.array([record[number].kept for number in previous["obstacle_no"]], dtype=bool)
    previous, shapes = on_grid(previous, grid), previous.geometry.to_numpy()
    shown, field = ground(grid, CRS(detected.crs), shown_px), shapely.Polygon(outline.exterior)
    centres = shapely.centroid(shapes)
    seen = shapely.intersects(shown, centres)
    unseen = ~seen & ~kept & shapely.intersects(field, shapes)
    stays = kept | unseen
    word, earlier = previous[stays], previous[~stays].reset_index(drop=True)
    # All that was there competes: a neighbour of what a person looked at stays itself.
    taken = [word.geometry.to_numpy(), shapes_of_plain(written.removed)]
    before = np.concatenate([earlier.geometry.to_numpy(), *taken])
    # What is driven around may have grown; of a shape that is not round nobody knows what it is.
    around = np.append(np.ones(len(earlier), bool), ~idle(word))
    most = _ANOTHER * shapely.area(before)
    most[: len(around)][around] = np.inf
    crown = np.pi * floats(detected, "radius_m") ** 2
    crown[idle(detected)] = 0.0
    match = matches(
        detected.geometry, before, once=True, apart=lambda row, other: crown[row] > most[other]
    )
    further = np.flatnonzero(match < 0)
    match[further] = _mostly_in(detected.geometry.to_numpy()[further], before, len(earlier))
    free = match < len(earlier)
    met = match[~free] - len(earlier)
    # Outside the field nothing is looked for.
    sought = (seen & shapely.intersects(field, centres))[stays]
    confirmed = (word["status"] == "confirmed").to_numpy() & sought
    unfound = np.setdiff1d(np.flatnonzero(confirmed), met)
    fresh, match = detected[free].reset_index(drop=True), match[free]
    again = match >= 0
    numbers = np.zeros(len(fresh), dtype=np.int64)
    old = earlier["obstacle_no"].to_numpy(dtype=np.int64)
    numbers[again] = old[match[again]]
    numbers[~again] = written.last_no + 1 + np.arange((~again).sum())
    fresh["obstacle_no"] = pd.array(numbers, dtype="Int64")
    source = np.where(again, match, -1)
    for name in schema.own_columns(schema.OBSTACLES, previous):
        fresh[name] = _taken(earlier[name], source)
    parts = [part for part in (word, fresh) if len(part)]
    joined = pd.concat(parts) if parts else fresh
    result = schema.conform(schema.OBSTACLES, joined, extras=True)
    is_word = result["obstacle_no"].isin(previous["obstacle_no"][kept]).to_numpy(bool)
    found = detected[~free][met < len(word)]
    changes = Changes(
        kept=int(kept.sum()),
        outgrown=_outgrown(found, word.iloc[met[met < len(word)]], result),
        unfound=tuple(word["obstacle_no"].iloc[unfound].tolist()),
        unseen=int(unseen.sum()),
        found_again=int(again.sum()),
        new=tuple(numbers[~again].tolist()),
        gone=tuple(np.delete(old, match[again]).tolist()),
        stay_deleted=int((met >= len(word)).sum()),
    )
    return result, Written.of(result, is_word, written.removed, written.last_no), changes


def _mostly_in(
    shapes: NDArray[np.object_], others: NDArray[np.object_], first: int
) -> NDArray[np.int64]:
    """For each shape an other, from the `first` on, that it hardly reaches out of; or -1."""
    result = np.full(len(shapes), -1, dtype=np.int64)
    rows, candidates = shapely.STRtree(others[first:]).query(shapes, predicate="intersects")
    out = shapely.area(shapely.difference(shapes[rows], others[first:][candidates]))
    held = out <= _OUTGROWN * shapely.area(shapes[rows])
    result[rows[held]] = first + candidates[held]
    return result


def _outgrown(
    found: gpd.GeoDataFrame, said: gpd.GeoDataFrame, obstacles: gpd.GeoDataFrame
) -> tuple[int, ...]:
    """Numbers of rows that a person `said`, each found as in `found`, that grew out of all."""
    sure = ~idle(found) & said["status"].isin({"confirmed", "added"}).to_numpy(bool)
    found, said = found[sure], said[sure]
    crowns = shapely.buffer(found.geometry.to_numpy(), -floats(found, "buffer_m"))
    some = shapely.area(crowns) * _OUTGROWN
    left = shapely.difference(crowns, said.geometry.to_numpy())
    more = shapely.area(left) > some
    if more.any():
        left[more] = shapely.difference(left[more], shapely.union_all(active(obstacles).geometry))
        more = shapely.area(left) > some
    return tuple(sorted(set(said["obstacle_no"][more].tolist())))


def _taken(series: pd.Series[Any], rows: NDArray[np.int64]) -> Any:
    """The values of rows; missing ones for -1."""
    # Whole numbers and truth values stay what they are beside missing ones.
    values = series.convert_dtypes() if series.dtype.kind in "iub" else series
    return pd.api.extensions.take(values.array, rows, allow_fill=True)
