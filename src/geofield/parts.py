"""Single shapes of those that are several, as files of others have them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

if TYPE_CHECKING:
    import geopandas as gpd

#: From multi-points to collections, as shapely counts types.
_SEVERAL = range(4, 8)


def single_parts(shapes: Any) -> tuple[NDArray[Any], NDArray[np.intp]]:
    """The single shapes, and whose each is; a collection may hold multi-part shapes, or others.

    >>> ground = shapely.from_wkt("GEOMETRYCOLLECTION (MULTIPOINT (1 1, 2 2), POINT EMPTY)")
    >>> single_parts([shapely.Point(0, 0), ground])[1].tolist()
    [0, 1, 1]
    """
    single, whose = shapely.get_parts(shapes, return_index=True)
    while np.isin(shapely.get_type_id(single), _SEVERAL).any():
        single, at = shapely.get_parts(single, return_index=True)
        whose = whose[at]
    there = ~shapely.is_empty(single)
    return single[there], whose[there]


def in_parts(frame: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """A table with a row for each single shape, which keeps the index of its row."""
    single, whose = single_parts(frame.geometry.to_numpy())
    return frame.iloc[whose].set_geometry(single, crs=frame.crs)
