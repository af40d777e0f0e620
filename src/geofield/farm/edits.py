"""What a person edited in a farm's overview, taken into the farm before anything is written anew.

``farm.gpkg`` remembers a digest of each field as it was written. A field whose outline, name or
obstacles differ from it was edited: its plan takes the edits in, its tracks are planned again, and
it counts as reviewed from then on, like one put back with ``geofield farm put``.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
import tempfile
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import shapely

from geofield import schema
from geofield.errors import FormatError, FormatWarning, GeofieldError
from geofield.farm.layers import EPSG, FIELD_ID
from geofield.formats import origin
from geofield.formats.gpkg_read import opened
from geofield.pipeline import run_tracks
from geofield.plan import Plan
from geofield.plan_files import save_plan
from geofield.settings import Settings

if TYPE_CHECKING:
    import geopandas as gpd

    from geofield.farm.value import Farm

#: Where the overview keeps the digests, in its evidence.
DIGESTS = "fields_as_written"
#: And whether it has obstacles at all: those of large farms are left out.
DETAILS = "has_obstacles"
#: What a person may change, besides shapes.
_FIELD_WORDS = ("name",)
_OBSTACLE_WORDS = ("obstacle_no", "kind", "status", "radius_m", "buffer_m")


def digests_of(fields: gpd.GeoDataFrame, obstacles: gpd.GeoDataFrame) -> dict[str, str]:
    """A digest per field of what a person may change of it."""
    parts: dict[str, list[bytes]] = {str(one): [] for one in fields[FIELD_ID]}
    for table, words in ((fields, _FIELD_WORDS), (obstacles, _OBSTACLE_WORDS)):
        flat = shapely.orient_polygons(shapely.force_2d(table.geometry.to_numpy()))
        shapes = shapely.to_wkb(flat, byte_order=1)
        told = zip(*(table[name].tolist() for name in words), strict=True)
        for one, shape, row in zip(table[FIELD_ID], shapes, told, strict=True):
            plain = ["" if pd.isna(value) else str(value) for value in row]
            parts.setdefault(str(one), []).append(json.dumps(plain).encode() + (shape or b""))
    return {
        one: hashlib.sha256(b"\0".join(sorted(rows))).hexdigest()[:16]
        for one, rows in parts.items()
    }


def take_edits(farm: Farm, overview: Path) -> list[Plan]:
    """The plans of the fields that a person edited in the overview, their tracks planned again.

    Raises
    ------
    FormatError
        When an edit cannot be understood; says which field and why.
    """
    record = _record(overview)
    written = record[DIGESTS]
    fields, obstacles = (_table(overview, of) for of in (schema.FIELD, schema.OBSTACLES))
    obstacles = _with_owners(obstacles, fields)
    _tell_columns(farm, overview, {schema.FIELD: fields, schema.OBSTACLES: obstacles})
    now = digests_of(fields, obstacles)
    edited = [one for one, digest in now.items() if written.get(one) not in (None, digest)]
    unknown = [one for one in now if one not in written]
    if unknown:
        raise FormatError(
            f"{overview.name} has a field {unknown[0]!r} that the farm does not know.",
            hint="Give it its field_id back; new fields are rows of the places file.",
        )
    standing = obstacles if record[DETAILS] else None
    return [_edited(farm, one, fields, standing) for one in edited if one in farm]


def _tell_columns(
    farm: Farm, overview: Path, tables: Mapping[schema.Layer, gpd.GeoDataFrame]
) -> None:
    """That columns which a person added to the overview do not stay, and what does."""
    for of, table in tables.items():
        known = {*farm.layer(of.name).columns, FIELD_ID, EPSG}
        added = [name for name in schema.own_columns(of, table) if name not in known]
        if added:
            warnings.warn(
                f"{overview.name}: columns {', '.join(added)} of layer {of.name!r} are not the "
                "farm's and do not stay. Add them to the places file, or to a layer of your own.",
                FormatWarning,
                stacklevel=3,
            )


def is_overview(path: Path) -> bool:
    """Whether a file is the overview of a farm."""
    try:
        return bool(_record(path)[DIGESTS])
    except (FormatError, sqlite3.Error):
        return False


def _record(overview: Path) -> dict[str, Any]:
    with opened(overview) as file:
        row = file.execute(
            "SELECT metadata FROM gpkg_metadata WHERE md_standard_uri = ?", (origin.URI,)
        ).fetchone()
    if row is None:
        raise FormatError(f"{overview} was not written by geofield.", hint="Remove it.")
    return {DIGESTS: {}, DETAILS: False, **origin.from_json(row[0]).provenance.evidence}


def _table(overview: Path, of: schema.Layer) -> gpd.GeoDataFrame:
    import pyogrio

    table = pyogrio.read_dataframe(overview, layer=of.name)
    for name in of.column_names:
        if name not in table:
            raise FormatError(
                f"{overview.name}: the column {name!r} of layer {of.name!r} is gone.",
                hint="Undo that in QGIS, or put the edited fields back one by one.",
            )
    owner = table.get(FIELD_ID)
    table = schema.conform(of, table.assign(**{"_owner": owner}), extras=True)
    return table.assign(**{FIELD_ID: table.pop("_owner")})


def _with_owners(obstacles: gpd.GeoDataFrame, fields: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """Obstacles that a person drew belong to the field that they stand in, or nearest to."""
    drawn = obstacles[FIELD_ID].isna().to_numpy(bool)
    if not drawn.any():
        return obstacles
    tree = shapely.STRtree(fields.geometry.to_numpy())
    nearest = tree.nearest(shapely.centroid(obstacles.geometry.to_numpy()[drawn]))
    owners = obstacles[FIELD_ID].to_numpy(dtype=object).copy()
    owners[drawn] = fields[FIELD_ID].to_numpy(dtype=object)[nearest]
    return obstacles.assign(**{FIELD_ID: owners})


def _edited(
    farm: Farm, field_id: str, fields: gpd.GeoDataFrame, obstacles: gpd.GeoDataFrame | None
) -> Plan:
    plan = farm[field_id]
    row = fields[fields[FIELD_ID] == field_id].to_crs(plan.field.crs).iloc[0]
    ours = farm.layer(schema.FIELD.name)
    before = ours[ours[FIELD_ID] == field_id].geometry.iloc[0]
    after = fields[fields[FIELD_ID] == field_id].geometry.iloc[0]
    field = plan.field if pd.isna(row["name"]) else replace(plan.field, name=str(row["name"]))
    if not np.array_equal(shapely.get_coordinates(before), shapely.get_coordinates(after)):
        field = replace(
            field, polygon=_polygon(row.geometry, field_id), method="drawn", quality=None
        )
    standing = plan.obstacles
    if obstacles is not None:
        table = obstacles[obstacles[FIELD_ID] == field_id].to_crs(field.crs)
        table = table.drop(columns=[name for name in (FIELD_ID, EPSG) if name in table])
        standing = schema.conform(schema.OBSTACLES, table, extras=True)
    settings = plan.settings or Settings()
    try:
        return run_tracks(replace(plan, field=field, obstacles=standing), settings=settings)
    except GeofieldError as error:
        raise FormatError(f"Field {field_id}, as edited: {error}", hint=error.hint) from error


def _polygon(shape: Any, field_id: str) -> shapely.Polygon:
    parts = [each for each in shapely.get_parts(shape) if isinstance(each, shapely.Polygon)]
    if len(parts) != 1 or not parts[0].is_valid:
        raise FormatError(
            f"The outline of field {field_id} is no single polygon that does not cross itself.",
            hint="Correct it in QGIS (Vector > Geometry Tools > Check Validity).",
        )
    return parts[0]


def put_edits(folder: Path, overview: Path) -> list[str]:
    """Take the edits of an overview into the farm; the ids of the fields.

    Raises
    ------
    FormatError
        When an edit cannot be understood; the farm is as it was then.
    """
    from geofield.farm.reviewed import put_back
    from geofield.farm.value import read_farm

    if not overview.is_file():
        return []
    plans = take_edits(read_farm(folder), overview)
    with tempfile.TemporaryDirectory(prefix="geofield-") as name:
        for plan in plans:
            file = Path(name) / "field.gpkg"
            save_plan(plan, file, overwrite=True)
            put_back(file, folder)
    return [plan.field.field_id for plan in plans]
