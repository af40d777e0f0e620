"""Edits of all obstacles at once are told: programs make them, and few persons mean them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray

from geofield import schema
from geofield.errors import FormatWarning
from geofield.model.written import WrittenRow, matches, shapes_of_plain
from geofield.notes import warn
from geofield.wording import counted

if TYPE_CHECKING:
    import geopandas as gpd

#: One or two are taken away or drawn anew by hand.
_FEW = 2
_NOT_MEANT = (
    "If that was not meant, go on from the file as it was before; a run with --fresh searches "
    "them anew."
)


def tell_none_left(record: Collection[WrittenRow], left: gpd.GeoDataFrame) -> None:
    """Tell where none is left of the obstacles that were written and driven around."""
    gone = [one for one in record if one.status not in schema.NOT_AVOIDED]
    if len(gone) < _FEW or left["obstacle_no"].isin([one.obstacle_no for one in gone]).any():
        return
    if (matches(shapes_of_plain([one.shape for one in gone]), left.geometry) < 0).all():
        _warn(
            f"All {len(gone)} obstacles that were driven around are gone from the layer: they "
            "count as taken away, and tracks run where they stood."
        )


def tell_all_reshaped(
    before: Sequence[WrittenRow],
    now: NDArray[np.object_],
    was: NDArray[np.object_],
    reshaped: NDArray[np.bool_],
) -> None:
    """Tell where all obstacles are `reshaped`: `now` other than they were written, `was`."""
    if len(before) <= _FEW or not reshaped.all():
        return
    far_m = float(shapely.hausdorff_distance(now, was).max())
    found = sum(one.status in ("detected", "possible") and not one.kept for one in before)
    words = f"; {counted(found, 'that was', 'that were')} found became `confirmed`"
    confirmed = words if found else ""
    _warn(
        f"All {len(before)} obstacles have other shapes than were written, by up to {far_m:.2g} m, "
        f"as where a whole layer is simplified, snapped or shifted: they count as yours{confirmed}."
    )


def _warn(words: str) -> None:
    warn(f"{words} {_NOT_MEANT}", FormatWarning)
