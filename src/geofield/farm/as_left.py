"""What a person left of a farm's overview: geofield's record, its layers, and whose each row is."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from pyproj import CRS

from geofield import schema
from geofield.errors import FormatError, FormatWarning
from geofield.farm.layers import FIELD_ID
from geofield.formats import origin
from geofield.formats.gpkg_read import in_own_terms, record_of, tell_lost_columns
from geofield.notes import warn
from geofield.wording import without_shape

#: Where the overview keeps the digests, in its evidence.
DIGESTS = "fields_as_written"
#: And whether it has obstacles at all: those of large farms are left out.
DETAILS = "has_obstacles"
#: What stands in columns of a person's own: by layer their names in the file, with those in the
#: farm, and a digest per field.
OWN = "own_as_written"
#: And of the tracks of each field.
TRACKS = "tracks_as_written"
#: What to do where nobody can tell edits any more.
_ANEW = "the next `geofield batch` writes one to edit anew."


def record_in(overview: Path) -> origin.Origin:
    """What geofield noted when it wrote the overview.

    Raises
    ------
    FormatError
        When that is gone.
    """
    record = record_of(overview)
    if record is None:
        raise FormatError(
            f"{overview.name} has no record of what geofield wrote (copies made by other programs "
            "have none), so nobody can tell what was edited there.",
            hint=f"Move it out of the farm: {_ANEW}",
        )
    return record


def table_in(overview: Path, of: schema.Layer, crs: CRS) -> gpd.GeoDataFrame:
    """A layer as it was edited, a column of its rows' fields in it.

    Raises
    ------
    FormatError
        When it is gone, or in another CRS than the overview was written in, or when outlines lack
        a column: what stands in fields is known by its shape.
    """
    import pyogrio

    try:
        table = pyogrio.read_dataframe(overview, layer=of.name)
    except pyogrio.errors.DataLayerError as error:
        raise FormatError(
            f"{overview.name}: the layer {of.name!r} is gone.",
            hint=f"Give it its name back, or move the file out of the farm: {_ANEW}",
        ) from error
    table = in_own_terms(of, table, crs, overview)
    absent = (np.flatnonzero(table.geometry.isna() | table.geometry.is_empty) + 1).tolist()
    if absent and of is not schema.FIELD:
        told = without_shape(absent, "counted as deleted")
        warn(f"{overview.name}: layer {of.name!r}: {told}", FormatWarning)
    tell_lost_columns(of, table, overview)
    for name in of.column_names:
        if name not in table and of is schema.FIELD:
            raise FormatError(
                f"{overview.name}: the column {name!r} of layer {of.name!r} is gone.",
                hint="Undo that in QGIS, or put the edited fields back one by one.",
            )
    owner = table.get(FIELD_ID)
    table = schema.conform(of, table.assign(**{"_owner": owner}), extras=True)
    return table.assign(**{FIELD_ID: table.pop("_owner")})


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
