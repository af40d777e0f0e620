"""Whose a row is: what a person drew, copied or moved in a farm's overview finds its field."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import shapely

from geofield.farm.layers import FIELD_ID

if TYPE_CHECKING:
    import geopandas as gpd


def obstacles_with_owners(
    obstacles: gpd.GeoDataFrame, fields: gpd.GeoDataFrame, known: Mapping[str, str]
) -> gpd.GeoDataFrame:
    """Obstacles that a person drew or moved belong to the field that they stand in.

    One that stands in none stays with the field that it names, or else is of the nearest.
    """
    outlines, ids = fields.geometry.to_numpy(), pd.Index(fields[FIELD_ID])
    shapes, owners = obstacles.geometry.to_numpy(), obstacles[FIELD_ID].to_numpy(dtype=object)
    if not len(ids) or not len(shapes):
        return obstacles
    tree, at = shapely.STRtree(outlines), ids.get_indexer(owners)
    stands = np.isin(np.arange(len(shapes)), tree.query(shapes, predicate="intersects")[0])
    elsewhere = (at >= 0) & stands & shapely.disjoint(outlines[at], shapes)
    nameless = ~np.isin(owners.astype(str), list(known))
    other = (elsewhere | nameless) & ~shapely.is_missing(shapes) & ~shapely.is_empty(shapes)
    if not other.any():
        return obstacles
    nearest = tree.nearest(shapely.centroid(shapes[other]))
    owners = owners.copy()
    owners[other] = ids.to_numpy(dtype=object)[nearest]
    return obstacles.assign(**{FIELD_ID: owners})


def lines_with_owners(
    table: gpd.GeoDataFrame, fields: gpd.GeoDataFrame, written: Collection[str]
) -> gpd.GeoDataFrame:
    """Lines that a person drew belong to the field that they lie in, or to the nearest.

    Those of a field that was `written` and is deleted there are nobody's.
    """
    shapes = table.geometry.to_numpy()
    known = table[FIELD_ID].isin(fields[FIELD_ID]).to_numpy()
    gone = table[FIELD_ID].isin(list(written)).to_numpy() & ~known
    new = ~known & ~gone & ~shapely.is_missing(shapes) & ~shapely.is_empty(shapes)
    if not new.any() or not len(fields):
        return table[known]
    tree = shapely.STRtree(fields.geometry.to_numpy())
    first = shapely.get_geometry(shapes[new], 0)
    nearest = tree.nearest(shapely.line_interpolate_point(first, 0.5, normalized=True))
    owners = table[FIELD_ID].to_numpy(dtype=object).copy()
    owners[new] = fields[FIELD_ID].to_numpy(dtype=object)[nearest]
    return table.assign(**{FIELD_ID: owners})[known | new]
