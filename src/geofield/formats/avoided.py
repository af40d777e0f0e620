"""Which obstacles machines are told of, and which not.

Those that a person rejected, and those that are merely possible, are not driven around:
formats for machines leave them out, formats for people show them apart.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from geofield import schema
from geofield.model import Dataset
from geofield.model.obstacles import active

if TYPE_CHECKING:
    import geopandas as gpd


def avoided(dataset: Dataset) -> gpd.GeoDataFrame:
    """The rows of layer `obstacles` that are driven around."""
    return active(dataset.table(schema.OBSTACLES.name)).reset_index(drop=True)


def passed_through(dataset: Dataset) -> dict[str, gpd.GeoDataFrame]:
    """The other rows, by their status; only statuses that there are."""
    table = dataset.table(schema.OBSTACLES.name)
    rest = table[table["status"].isin(schema.NOT_AVOIDED)]
    return {
        str(status): part.reset_index(drop=True)
        for status, part in rest.groupby("status", sort=True)
    }
