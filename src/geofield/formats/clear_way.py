"""Whether the tracks of a plan run where nothing stands, and in the field."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd
import shapely
from numpy.typing import NDArray

from geofield.errors import TrackError, TrackWarning
from geofield.model import Dataset
from geofield.model.obstacles import active
from geofield.model.tracks import Tracks

#: Segments end exactly on a border: so far beyond it is no fault, metres.
_HAIR_M = 0.05
#: The same for what is hardly wider than two of these, as a fence is; more than formats round to.
_THIN_HAIR_M = 0.02
#: So many tracks or obstacles are named.
_MOST = 5


def driven_through(dataset: Dataset) -> list[tuple[int, str]]:
    """Each segment (its row) that runs through an obstacle to be avoided, with its name."""
    obstacles, segments = dataset.table("obstacles"), dataset.table("segments")
    if not len(obstacles) or not len(segments):
        return []
    kept = active(obstacles)
    shapes = np.asarray(kept.geometry.to_numpy(), dtype=object)
    inside = shapely.buffer(shapes, -_HAIR_M)
    thin = shapely.is_empty(inside)
    inside[thin] = shapely.buffer(shapes[thin], -_THIN_HAIR_M)
    tree = shapely.STRtree(segments.geometry.to_numpy())
    hit, where = tree.query(inside, predicate="intersects")
    numbers = kept["obstacle_no"].tolist()
    return [(int(row), _obstacle(numbers[at])) for at, row in zip(hit, where, strict=True)]


def leaving(dataset: Dataset) -> NDArray[np.int64]:
    """The segments (their rows) that leave the field."""
    field, segments = dataset.table("field"), dataset.table("segments")
    if len(field) != 1 or not len(segments):
        return np.empty(0, np.int64)
    outline = shapely.buffer(field.geometry.iloc[0], _HAIR_M)
    return np.flatnonzero(~shapely.covered_by(segments.geometry.to_numpy(), outline))


def tell_blocked(datasets: Iterable[Dataset], *, refuse: bool) -> None:
    """Tell of planned tracks that what was edited since stands in the way of.

    Raises
    ------
    TrackError
        Where `refuse` is true: a machine would follow them.
    """
    for each in datasets:
        blocked = _blocked(each) if "tracks" in each.provenance.evidence else ""
        if blocked and refuse:
            raise TrackError(
                f"{each.name}: {blocked}.",
                hint="Machines follow these lines. Plan the tracks again (`geofield tracks "
                "PLAN.gpkg -o PLAN.gpkg`), then write this anew.",
            )
        if blocked:
            warnings.warn(
                f"{each.name}: {blocked}: plan the tracks again (`geofield tracks`).",
                TrackWarning,
                stacklevel=3,
            )


def _blocked(dataset: Dataset) -> str:
    """What is wrong with the tracks of a plan, in words; empty where nothing is."""
    evidence = dataset.provenance.evidence
    words = []
    if Tracks.lie_in(dataset.tables, evidence):
        emptied = Tracks.from_tables(dataset.tables, evidence["tracks"]).emptied
        words = [f"its layer `{name}` was emptied" for name in emptied]
    through, outside = driven_through(dataset), leaving(dataset)
    if through:
        named = _listed(name for _, name in through)
        words += [f"{_tracks(dataset, [row for row, _ in through])} through {named}"]
    if len(outside):
        words += [f"{_tracks(dataset, outside.tolist())} out of the field"]
    return " and ".join(words)


def _tracks(dataset: Dataset, rows: Sequence[int]) -> str:
    numbers = sorted({int(no) for no in dataset.table("segments")["track_no"].iloc[list(rows)]})
    many = len(numbers) > 1
    return f"track{'s' * many} {_listed(map(str, numbers))} run{'s' * (not many)}"


def _listed(words: Iterable[str]) -> str:
    each = list(dict.fromkeys(words))
    more = [f"{len(each) - _MOST} more"] if len(each) > _MOST else []
    return ", ".join([*each[:_MOST], *more])


def _obstacle(number: Any) -> str:
    return "an obstacle that was drawn" if pd.isna(number) else f"obstacle {number}"
