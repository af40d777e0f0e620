"""Several fields in one product: what they have in common, and their tables as one.

A format holds several fields by itself (task data, KML folders, Shapefiles), takes them joined
into one dataset with ``field_id`` in every row, or is written once per field.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT, PACIFIC, metric_crs, reproject, transformer
from geofield.errors import FormatError
from geofield.formats.antimeridian import seamless
from geofield.formats.names import safe_name
from geofield.model import Dataset, Provenance
from geofield.model.lost_numbers import numbered
from geofield.wording import counted, unlike

if TYPE_CHECKING:
    import geopandas as gpd

FIELD_ID = "field_id"
#: In every row of several fields: the EPSG code of its field's metric CRS.
UTM_EPSG = "utm_epsg"


@dataclass(frozen=True, eq=False)
class Joined(Dataset):
    """Tables of several fields; track points are left to each field's own products.

    Attributes
    ----------
    further : tuple of Layer
        Layers beside those of a field.
    of_farm : bool
        Whether it is the overview of a farm, which takes in what is edited of tracks, too.
    """

    further: tuple[schema.Layer, ...] = ()
    of_farm: bool = False

    @property
    def tracks_stand(self) -> bool:
        """Whether tracks that are edited in its file stand in a later run."""
        return self.of_farm or super().tracks_stand

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
            what = counted(len(table), "field without an id", "fields")
            raise FormatError(
                f"{each.name} has {what}.",
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


def told_apart(datasets: Sequence[Dataset]) -> list[Dataset]:
    """Datasets with the id of its field in every row."""
    return [
        replace(
            each,
            tables={
                name: table if FIELD_ID in table.columns else table.assign(**{FIELD_ID: one})
                for name, table in each.tables.items()
            },
        )
        for each, one in zip(datasets, field_ids(datasets), strict=True)
    ]


def joined(datasets: Sequence[Dataset]) -> Joined:
    """The tables of several fields as one dataset, ``field_id`` in every row.

    In the CRS that all share, else in one without a seam near them; lengths and areas stand in
    columns and are true either way. Rows keep their field's order; track points are left to each
    field.
    """
    datasets = told_apart(datasets)
    crs = datasets[0].crs
    if any(each.crs != crs for each in datasets):
        outlines = [
            reproject(each.table(schema.FIELD.name).geometry.to_numpy(), each.crs, LONLAT)
            for each in datasets
        ]
        crs = seamless(np.concatenate(outlines))
    tables: dict[str, gpd.GeoDataFrame] = {}
    for layer in schema.LAYERS:
        parts = [
            each.tables[layer.name].to_crs(crs)
            for each in datasets
            if each.has(layer.name) and layer.name in each.tables and not layer.working
        ]
        if parts:
            tables[layer.name] = pd.concat(parts, ignore_index=True)
    software = datasets[0].provenance.software
    return Joined(tables, crs, "farm", Provenance(software))


def apart(dataset: Dataset) -> list[Dataset]:
    """The fields of a dataset that holds several, as :func:`joined` has them; else itself alone.

    Each is in the metric CRS that its row names, or in its UTM zone where they share none.

    Raises
    ------
    FormatError
        When a row is of none of the fields.
    """
    fields = dataset.table(schema.FIELD.name)
    tables = {name: table for name, table in dataset.tables.items() if len(table)}
    ids = fields[FIELD_ID]
    alone = len(fields) < 2 or not ids.is_unique or ids.isna().any()
    if alone or any(FIELD_ID not in table.columns for table in tables.values()):
        return [dataset]
    for name, table in tables.items():
        strange = int((~table[FIELD_ID].isin(ids)).sum())
        if strange:
            raise FormatError(
                f"Layer {name!r} has {counted(strange, 'row')} of none of the {len(ids)} fields.",
                hint="Give each row the field_id of its field.",
            )
    return [_one_of(dataset, tables, row) for row in fields.to_dict("records")]


def _one_of(dataset: Dataset, tables: Mapping[str, Any], row: Mapping[str, Any]) -> Dataset:
    """The rows of one field, without the columns that say which."""
    epsg, field_id, crs = row.get(UTM_EPSG), row[FIELD_ID], dataset.crs
    if epsg is not None and not pd.isna(epsg):
        crs = CRS.from_epsg(int(epsg))
    elif crs in (LONLAT, PACIFIC):
        inside = row["geometry"].representative_point()
        crs = metric_crs(*transformer(crs, LONLAT).transform(inside.x, inside.y))
    found = {}
    for name, table in tables.items():
        layer = schema.layer(name)
        said = [each for each in (FIELD_ID, UTM_EPSG) if each not in layer.column_names]
        mine = table[table[FIELD_ID] == field_id].drop(columns=said, errors="ignore")
        found[name] = mine.to_crs(crs).reset_index(drop=True)
    if schema.TRACKS.name in found and schema.SEGMENTS.name in found:
        segments = numbered(found[schema.TRACKS.name], found[schema.SEGMENTS.name])
        found[schema.SEGMENTS.name] = segments
    label = row["name"] if isinstance(row["name"], str) else str(field_id)
    source = dataset.provenance.source
    return Dataset(found, crs, label, Provenance(dataset.provenance.software, source))


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
    return max(filter(None, (each.provenance.source.day for each in datasets)), default=None)


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
