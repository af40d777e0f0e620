"""The obstacles that machines must be told of, each with a number."""

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
