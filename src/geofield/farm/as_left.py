"""What a person left of a farm's overview: its layers as they are now, and geofield's record."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pyproj import CRS

from geofield import schema
from geofield.errors import FormatError, FormatWarning
from geofield.farm.layers import FIELD_ID
from geofield.formats import origin
from geofield.formats.gpkg_read import in_own_terms, record_of, tell_lost_columns
from geofield.notes import warn

if TYPE_CHECKING:
    import geopandas as gpd

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
    absent = int((table.geometry.isna() | table.geometry.is_empty).sum())
    if absent and of is not schema.FIELD:
        words = f"{absent} row(s) of layer {of.name!r} have no geometry, and count as deleted"
        tell(f"{overview.name}: {words}.")
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


def tell(words: str) -> None:
    """Warn of what was left and cannot be taken in."""
    warn(words, FormatWarning, stacklevel=4)
