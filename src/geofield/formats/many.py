"""Several fields in one product: what they have in common, and their tables as one.

A format holds several fields by itself (task data, KML folders, Shapefiles), takes them joined
into one dataset with ``field_id`` in every row, or is written once per field.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import pandas as pd

from geofield import schema
from geofield.crs import LONLAT
from geofield.errors import FormatError
from geofield.formats.names import safe_name, unlike
from geofield.formats.origin import imagery_day
from geofield.model import Dataset, Provenance

if TYPE_CHECKING:
    import geopandas as gpd

FIELD_ID = "field_id"


@dataclass(frozen=True, eq=False)
class Joined(Dataset):
    """Tables of several fields; track points are left to each field's own products.

    Attributes
    ----------
    further : tuple of Layer
        Layers beside those of a field.
    """

    further: tuple[schema.Layer, ...] = ()

    def layers(self, *, working: bool = False) -> list[schema.Layer]:
        """The layers to write: those of a field but its points, and further ones with rows."""
        own = [each for each in super().layers(working=working) if each != schema.TRACK_POINTS]
        return own + [each for each in self.further if self.has(each.name)]

    def has(self, name: str) -> bool:
        """Whether a layer has rows."""
        return name in self.tables and len(self.tables[name]) > 0


def field_ids(datasets: Sequence[Dataset]) -> list[str]:
    """The id of each field, as its table has it.

    Raises
    ------
    FormatError
        When two fields have the same, or one has none.
    """
    found: list[str] = []
    for each in datasets:
        table = each.table(schema.FIELD.name)
        if len(table) != 1 or pd.isna(table[FIELD_ID].iloc[0]):
            raise FormatError(
                f"{each.name} has {len(table)} fields"
                + ("." if len(table) != 1 else " without an id."),
                hint="Each plan needs one outline with a field_id.",
            )
        found.append(str(table[FIELD_ID].iloc[0]))
    for one, dataset in zip(found, datasets, strict=True):
        if found.count(one) > 1:
            raise FormatError(
                f"Two fields have the id {one!r}, one of them is {dataset.name}.",
                hint="Is it the same field twice? Else give one of them another field_id.",
            )
    return found


def joined(datasets: Sequence[Dataset]) -> Joined:
    """The tables of several fields as one dataset, ``field_id`` in every row.

    In the CRS that all share, else in WGS 84; lengths and areas stand in columns and are true
    either way. Rows keep their field's order; track points are left to each field.
    """
    ids = field_ids(datasets)
    crs = datasets[0].crs
    if any(each.crs != crs for each in datasets):
        crs = LONLAT
    tables: dict[str, gpd.GeoDataFrame] = {}
    for layer in schema.LAYERS:
        parts = [
            _named(each.tables[layer.name], one).to_crs(crs)
            for each, one in zip(datasets, ids, strict=True)
            if each.has(layer.name) and layer.name in each.tables and not layer.working
        ]
        if parts:
            tables[layer.name] = pd.concat(parts, ignore_index=True)
    software = datasets[0].provenance.software
    return Joined(tables, crs, "farm", Provenance(software))


def _named(table: gpd.GeoDataFrame, field_id: str) -> gpd.GeoDataFrame:
    return table if FIELD_ID in table.columns else table.assign(**{FIELD_ID: field_id})


def owner_of(dataset: Dataset, options: Mapping[str, Any]) -> tuple[str, str]:
    """Customer and farm of a field: its own columns of these names, else the options', else ''."""
    table = dataset.table(schema.FIELD.name)
    own = {str(name).lower(): name for name in schema.own_columns(schema.FIELD, table)}
    found = []
    for name in ("customer", "farm"):
        value = table[own[name]].iloc[0] if name in own and len(table) else None
        given = options.get(name) or ""
        found.append(str(given if value is None or pd.isna(value) or value == "" else value))
    return found[0], found[1]


def last_imagery_day(datasets: Sequence[Dataset]) -> str | None:
    """The latest day of the imagery, ISO 8601; None where nobody knows any."""
    return max(filter(None, map(imagery_day, datasets)), default=None)


def distinct(datasets: Sequence[Dataset]) -> list[Dataset]:
    """Datasets whose names stay apart as names of files, also where case does not count.

    The second field called North is called ``North 2``, for terminals and folders.
    """
    taken: set[str] = set()
    found = []
    for each in datasets:
        name = unlike(each.name, taken, " ", length=30, key=lambda one: safe_name(one).lower())
        found.append(each if name == each.name else replace(each, name=name))
    return found
