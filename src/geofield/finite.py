"""Finite: shapes whose coordinates are all numbers of a place; files may hold NaN and infinity."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from geofield.errors import FormatError

#: What to do about a shape that is nowhere.
MEND_IT = "Mend the shape, or delete its row (QGIS: Check validity finds it)."


def finite(shapes: Any) -> NDArray[np.bool_]:
    """Whether all coordinates of each shape are finite numbers; those without any are.

    >>> finite([shapely.Point(1, 2), shapely.LineString([(0, 0), (np.inf, 1)])]).tolist()
    [True, False]
    """
    shapes = np.asarray(shapes, dtype=object)
    places, of = shapely.get_coordinates(shapes, return_index=True)
    good = np.ones(len(shapes), bool)
    good[of[~np.isfinite(places).all(axis=1)]] = False
    return good


def refuse_nowhere(shapes: Any, where: str) -> None:
    """Refuse a table with a shape that is nowhere: what it stands for would silently be gone.

    Raises
    ------
    FormatError
        Naming the first such row, from 1.
    """
    good = finite(shapes)
    if not good.all():
        raise FormatError(
            f"{where}, row {int(np.argmin(good)) + 1}: coordinates that are no finite numbers.",
            hint=MEND_IT,
        )
