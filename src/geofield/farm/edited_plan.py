"""The plan of a field as a person edited it in a farm's overview."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely

from geofield import schema
from geofield.errors import FormatError, GeofieldError
from geofield.farm import edited_tracks
from geofield.farm.as_written import own_names, text_of
from geofield.farm.layers import EPSG, FIELD_ID
from geofield.known import with_further
from geofield.model import Field
from geofield.model.review import reconcile
from geofield.notes import listening, warn
from geofield.pipeline import run_tracks
from geofield.plan import Plan
from geofield.settings import Settings

#: Outlines that differ by less, in the units of the overview, are the same.
_SAME = 1e-9


@dataclass(frozen=True)
class Edits:
    """What a person edited in an overview."""

    #: By field id: the digests before and after.
    marks: Mapping[str, str]
    fields: gpd.GeoDataFrame
    #: None where the overview has none.
    obstacles: gpd.GeoDataFrame | None
    names: edited_tracks.Names
    #: Tracks and segments, and the fields where these were edited.
    tracks: edited_tracks.Tables
    driven: Collection[str]


def edited_plan(
    plan: Plan, edits: Edits, outlines: gpd.GeoSeries, around: gpd.GeoDataFrame | None
) -> Plan:
    """A plan of the farm as it was edited, with the tracks of before.

    `outlines` are those of the farm by field id, in the CRS of the overview; `around` are obstacles
    of a file of their own: an outline that was moved has those that stand in it now.

    Raises
    ------
    FormatError
        When an edit cannot stand; says of which field.
    """
    field_id = plan.field.field_id
    fields, obstacles = edits.fields, edits.obstacles
    mine = fields[fields[FIELD_ID] == field_id]
    row = mine.to_crs(plan.field.crs).iloc[0]
    called = edits.names.get(schema.FIELD.name, {})
    names = {name: called.get(name, name) for name in own_names(schema.FIELD, fields)}
    own = _own_of(plan.field, row, names)
    field = replace(plan.field, own=own)
    if not pd.isna(row["name"]):
        field = replace(field, name=str(row["name"]))
    reshaped = not shapely.equals_exact(outlines[field_id], mine.geometry.iloc[0], _SAME)
    if reshaped:
        field = replace(
            field, polygon=_polygon(row.geometry, field_id), method="drawn", quality=None
        )
    standing = plan.obstacles
    if obstacles is not None:
        table = obstacles[obstacles[FIELD_ID] == field_id].to_crs(field.crs)
        table = table.drop(columns=[name for name in (FIELD_ID, EPSG) if name in table])
        table = table.rename(columns=edits.names.get(schema.OBSTACLES.name, {}))
        standing = schema.conform(schema.OBSTACLES, table, extras=True)
    if field_id in edits.driven:
        plan = edited_tracks.with_tracks(plan, edits.tracks, edits.names)
    plan = replace(plan, field=field, obstacles=standing)
    with _of_field(field_id):
        if standing is not None:
            standing, written = reconcile(standing, plan.evidence.written, plan.grid)
            plan = replace(
                plan, obstacles=standing, evidence=replace(plan.evidence, written=written)
            )
        return with_further(plan, around) if reshaped and around is not None else plan


def planned(plan: Plan) -> Plan:
    """An edited plan with tracks as its settings say.

    Raises
    ------
    FormatError
        When there can be none; says of which field.
    """
    with _of_field(plan.field.field_id):
        return run_tracks(plan, settings=plan.settings or Settings())


@contextmanager
def said_of(field_id: str) -> Iterator[None]:
    """Tell of which field it is what a block tells."""
    with listening() as heard:
        yield
    for each in heard:
        warn(f"Field {field_id}, as edited: {each}", type(each))


@contextmanager
def _of_field(field_id: str) -> Iterator[None]:
    """Say whose edit it is that was refused."""
    try:
        with said_of(field_id):
            yield
    except GeofieldError as error:
        raise FormatError(
            f"Field {field_id}, as edited: {error.message}", hint=error.hint
        ) from error


def _own_of(
    field: Field, row: pd.Series[Any], names: Mapping[str, str]
) -> tuple[tuple[str, Any], ...]:
    """The columns of a person's own, as they were where the file says the same."""
    own = dict(field.own)
    for there, name in names.items():
        before, value = own.get(name), row[there]
        if text_of(before) == text_of(value) or str(before) == str(value):
            own.setdefault(name, None)
        elif pd.isna(value):
            own[name] = None
        elif isinstance(before, int) and isinstance(value, Real) and float(value).is_integer():
            own[name] = int(float(value))
        else:
            own[name] = value.item() if isinstance(value, np.generic) else value
    return tuple(own.items())


def _polygon(shape: Any, field_id: str) -> shapely.Polygon:
    parts = [each for each in shapely.get_parts(shape) if isinstance(each, shapely.Polygon)]
    if len(parts) != 1 or not parts[0].is_valid:
        raise FormatError(
            f"The outline of field {field_id} is no single polygon that does not cross itself.",
            hint="Correct it in QGIS (Vector > Geometry Tools > Check Validity).",
        )
    return parts[0]
