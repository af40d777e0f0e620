"""The obstacles that machines must be told of, each with a number.

Those that a person rejected, and those that are merely possible, are not driven around:
formats for machines leave them out, formats for people show them apart.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from geofield import schema
from geofield.model import Dataset
from geofield.model.obstacles import active, numbered

if TYPE_CHECKING:
    import geopandas as gpd


def avoided(dataset: Dataset) -> gpd.GeoDataFrame:
    """The rows of layer `obstacles` that are driven around.

    Rows that a person drew and nobody numbered yet get the next free numbers.
    """
    return active(numbered(dataset.table(schema.OBSTACLES.name))).reset_index(drop=True)


def passed_through(dataset: Dataset) -> dict[str, gpd.GeoDataFrame]:
    """The other rows, by their status; only statuses that there are."""
    table = numbered(dataset.table(schema.OBSTACLES.name))
    rest = table[~table.index.isin(active(table).index)]
    return {
        str(status).strip().lower(): part.reset_index(drop=True)
        for status, part in rest.groupby("status", sort=True)
    }
