"""Numbers of obstacles that another program lost, or that none can have."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from geofield.errors import FormatWarning
from geofield.model.obstacles import FloatArray, floats
from geofield.model.written import WrittenRow, matches, same_shapes, shapes_of_plain
from geofield.notes import warn

if TYPE_CHECKING:
    import geopandas as gpd

#: Formats that carry whole numbers have no larger ones.
_MOST = 2**31 - 1


def possible_numbers(obstacles: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """The table without numbers that none can have, which is told: such rows have none."""
    numbers = floats(obstacles, "obstacle_no")
    strange = (numbers < 1) | (numbers > _MOST) | (numbers != np.rint(numbers))
    strange &= ~np.isnan(numbers)
    if not strange.any():
        return obstacles
    which = ", ".join(f"{number:.15g}" for number in numbers[strange][:5])
    warn(
        f"obstacle_no {which} is no whole number from 1 to {_MOST}: such rows are known by their "
        "shapes, or get the next numbers.",
        FormatWarning,
    )
    kept = pd.Series(numbers, obstacles.index).mask(strange).astype("Int64")
    return obstacles.assign(obstacle_no=kept)


def lost_numbers(
    shapes: NDArray[np.object_], numbers: FloatArray, record: Sequence[WrittenRow]
) -> dict[int, tuple[WrittenRow, bool]]:
    """What was written of rows without a number, and whether they have the shape of then.

    They are known by where they stand: without that they all were new, and what was deleted would
    be found again. Some must stand just as they were written, or it is a table drawn anew; in a
    table of which others have their numbers (NaN where a row has none), each.
    """
    lost = np.isnan(numbers)
    there = set(numbers.tolist())
    record = [row for row in record if row.obstacle_no not in there]
    if not lost.any() or not record:
        return {}
    written = shapes_of_plain([row.shape for row in record])
    of = np.where(lost, matches(shapes, written), -1)
    same = of >= 0
    same[same] = same_shapes(shapes[same], written[of[same]])
    if not same.any():
        return {}
    if not lost.all():
        of[~same] = -1
    found: dict[int, tuple[WrittenRow, bool]] = {}
    taken: set[int] = set()
    # Of several rows on one place the first that is as it was written; others were drawn.
    for row in np.argsort(~same, kind="stable").tolist():
        if of[row] >= 0 and of[row] not in taken:
            taken.add(of[row])
            found[row] = record[of[row]], bool(same[row])
    return found
