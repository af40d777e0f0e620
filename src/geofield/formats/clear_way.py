"""Whether the tracks of a plan run where nothing stands, and in the field."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd
import shapely
from numpy.typing import NDArray

from geofield.errors import TrackError, TrackWarning
from geofield.model import Dataset
from geofield.model.obstacles import active
from geofield.model.tracks import Tracks
from geofield.notes import warn
from geofield.wording import some_of

#: Segments end exactly on a border: so far beyond it is no fault, metres.
_HAIR_M = 0.05
#: The same for what is hardly wider than two of these, as a fence is; more than formats round to.
_THIN_HAIR_M = 0.02
#: What is driven, by layer: the column with its number, one of it, several.
DRIVEN = {
    "segments": ("track_no", "track", "tracks"),
    "headland_tracks": ("pass_no", "headland pass", "headland passes"),
    "turns": ("turn_no", "turn", "turns"),
}
#: Of these, what stays within the field: turns may leave it.
WITHIN = ("segments", "headland_tracks")
#: So many tracks or obstacles are named.
_MOST = 5


def driven_through(dataset: Dataset, layer: str = "segments") -> list[tuple[int, str]]:
    """Each line of a layer (its row) that runs through an obstacle to be avoided, with its name."""
    if not (dataset.has("obstacles") and dataset.has(layer)):
        return []
    kept, lines = active(dataset.table("obstacles")), dataset.table(layer)
    shapes = np.asarray(kept.geometry.to_numpy(), dtype=object)
    inside = shapely.buffer(shapes, -_HAIR_M)
    thin = shapely.is_empty(inside)
    inside[thin] = shapely.buffer(shapes[thin], -_THIN_HAIR_M)
    tree = shapely.STRtree(lines.geometry.to_numpy())
    hit, where = tree.query(inside, predicate="intersects")
    names = [
        "an obstacle that was drawn" if pd.isna(number) else f"obstacle {number}"
        for number in kept["obstacle_no"].tolist()
    ]
    return [(int(row), names[at]) for at, row in zip(hit, where, strict=True)]


def leaving(dataset: Dataset, layer: str = "segments") -> NDArray[np.int64]:
    """The lines of a layer (their rows) that leave the field."""
    field = dataset.table("field")
    if len(field) != 1 or not dataset.has(layer):
        return np.empty(0, np.int64)
    lines = dataset.table(layer)
    outline = shapely.buffer(field.geometry.iloc[0], _HAIR_M)
    return np.flatnonzero(~shapely.covered_by(lines.geometry.to_numpy(), outline))


def tell_blocked(datasets: Iterable[Dataset], *, refuse: bool) -> None:
    """Tell of planned tracks that what was edited since stands in the way of.

    Raises
    ------
    TrackError
        Where `refuse` is true: a machine would follow them.
    """
    for each in datasets:
        if "tracks" not in each.provenance.evidence:
            continue
        blocked = _blocked(each)
        if blocked and refuse:
            raise TrackError(
                f"{each.name}: {' and '.join(blocked)}.",
                hint="Machines follow these lines. Plan the tracks again (`geofield tracks "
                "PLAN.gpkg -o PLAN.gpkg`), then write this anew.",
            )
        # No terminal is given these: they are told, and refuse nothing.
        blocked += _in_the_way(each, "headland_tracks") + _in_the_way(each, "turns")
        if blocked:
            warn(
                f"{each.name}: {' and '.join(blocked)}: plan the tracks again (`geofield tracks`).",
                TrackWarning,
            )


def _blocked(dataset: Dataset) -> list[str]:
    """What is wrong with the tracks of a plan, in words."""
    evidence = dataset.provenance.evidence
    words = []
    if Tracks.lie_in(dataset.tables, evidence):
        emptied = Tracks.from_tables(dataset.tables, evidence["tracks"]).emptied
        words = [f"its layer `{name}` was emptied" for name in emptied]
    return words + _in_the_way(dataset, "segments")


def _in_the_way(dataset: Dataset, layer: str) -> list[str]:
    """Which lines of a layer run where they must not, in words."""
    words = []
    through = driven_through(dataset, layer)
    outside = leaving(dataset, layer).tolist() if layer in WITHIN else []
    if through:
        named = some_of(list(dict.fromkeys(name for _, name in through)), _MOST)
        words += [f"{_lines(dataset, layer, [row for row, _ in through])} through {named}"]
    if outside:
        words += [f"{_lines(dataset, layer, outside)} out of the field"]
    return words


def _lines(dataset: Dataset, layer: str, rows: Sequence[int]) -> str:
    number, one, several = DRIVEN[layer]
    numbers = sorted({int(no) for no in dataset.table(layer)[number].iloc[list(rows)].dropna()})
    if not numbers:
        return f"a {one} that was drawn runs"
    many = len(numbers) > 1
    return (
        f"{several if many else one} {some_of([*map(str, numbers)], _MOST)} run{'s' * (not many)}"
    )
