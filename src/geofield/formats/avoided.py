"""The obstacles that machines must be told of: all that nobody rejected, each with a number."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from geofield import schema
from geofield.model import Dataset

if TYPE_CHECKING:
    import geopandas as gpd


def avoided(dataset: Dataset) -> gpd.GeoDataFrame:
    """The rows of layer `obstacles` that are not rejected.

    Rows that a person drew and nobody numbered yet get the next free numbers.
    """
    table = dataset.table(schema.OBSTACLES.name)
    numbers = table["obstacle_no"].to_numpy(dtype="float64", na_value=np.nan)
    missing = np.isnan(numbers)
    if missing.any():
        first = int(np.nanmax(numbers, initial=0)) + 1
        numbers[missing] = np.arange(first, first + int(missing.sum()))
        table = table.assign(obstacle_no=pd.array(numbers.astype("int64"), dtype="Int64"))
    return table[table["status"] != "rejected"].reset_index(drop=True)
