"""What a person changed in a plan's tables, made whole before other formats tell of it.

In an editor a shape moves, and the columns that say where it is and how large stay as they were;
a drawn row has a shape and nothing else.
"""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import shapely

from geofield import schema
from geofield.crs import LONLAT, ground_areas_m2, ground_lengths_m, transformer
from geofield.errors import TrackWarning
from geofield.formats.many import Joined
from geofield.model import Dataset, Field
from geofield.model.evidence import Evidence
from geofield.model.field import refuse_no_areas
from geofield.model.frame import along_frame, with_outside
from geofield.model.review import reconcile
from geofield.model.tracks import Tracks
from geofield.notes import warn

if TYPE_CHECKING:
    import geopandas as gpd

#: Formats round coordinates: an area or length that differs by less is that of the shape, share.
_SAME = 1e-5
#: The same of positions, degrees: two centimetres.
_SAME_DEG = 2e-7


def made_whole(dataset: Dataset) -> Dataset:
    """A dataset of which names, numbers, statuses, sizes and positions fit the shapes.

    Obstacles are understood as a re-run understands them (`geofield.model.review.reconcile`),
    against the record that the dataset carries; tables of several fields stay as they are.

    Raises
    ------
    ObstacleError
        When a radius or safety margin is negative or infinite.
    FormatError
        When the outline is a line.
    """
    if isinstance(dataset, Joined):
        return dataset
    tables = {name: _plain(table, name) for name, table in dataset.tables.items()}
    if schema.OBSTACLES.name in tables:  # one without rows may be emptied
        obstacles = tables[schema.OBSTACLES.name]
        tables[schema.OBSTACLES.name] = _understood(obstacles, dataset)
    if dataset.has(schema.FIELD.name):
        refuse_no_areas(tables[schema.FIELD.name].geometry.dropna())
        field = _measured(_named(tables[schema.FIELD.name], dataset), dataset)
        tables[schema.FIELD.name] = _judged(field, dataset)
    return _driven(replace(dataset, tables=tables))


def _driven(dataset: Dataset) -> Dataset:
    """A dataset of which all layers of the tracks, and their points, tell the same."""
    evidence = dataset.provenance.evidence
    known = Evidence.from_json(evidence).track_edits
    if not Tracks.lie_in(dataset.tables, evidence):
        return dataset
    tracks = Tracks.from_tables(dataset.tables, evidence["tracks"], grid=dataset.grid)
    # Without the rows that were copied in place: they count once.
    dataset = replace(dataset, tables={**dataset.tables, **tracks.tables()})
    of_before = tracks.edits_since(known) == known
    if of_before and not tracks.partial:
        return dataset
    from geofield.tracks.blocks import obstacle_shapes
    from geofield.tracks.by_hand import as_edited

    shapes = obstacle_shapes(dataset.tables.get(schema.OBSTACLES.name), dataset.crs)
    parts = shapely.get_parts(dataset.table(schema.FIELD.name).geometry.to_numpy())
    outline = parts[0] if len(parts) == 1 else None
    tracks = replace(tracks, shapes=shapes, outline=outline)
    whole = as_edited(tracks, known)
    if whole is tracks:
        return dataset  # columns alone
    if tracks.route is not None and not of_before:
        warn(
            "Tracks were edited since their route was planned: it is of before. Plan it again "
            "(geofield tracks).",
            TrackWarning,
        )
    tables = {**dataset.tables, **whole.tables()}
    has_points = dataset.has(schema.TRACK_POINTS.name)
    return replace(dataset, tables=tables, points=whole.point_chunks if has_points else None)


def _understood(obstacles: gpd.GeoDataFrame, dataset: Dataset) -> gpd.GeoDataFrame:
    shapes = np.asarray(obstacles.geometry.to_numpy(), dtype=object)
    if shapely.is_missing(shapes).any() or shapely.is_empty(shapes).any():
        return obstacles  # writers refuse it, with the row
    written = Evidence.from_json(dataset.provenance.evidence).written
    areal = (shapely.get_dimensions(shapes) == 2).all()
    if written is None and areal and _is_whole(obstacles, dataset):
        return obstacles
    whole = reconcile(obstacles, written, dataset.grid)[0]
    return whole.assign(kind=whole["kind"].where(whole["kind"].notna(), "other"))


def _is_whole(obstacles: gpd.GeoDataFrame, dataset: Dataset) -> bool:
    """Whether every row has a number, a status, and the position of its shape."""
    centres = shapely.get_coordinates(shapely.centroid(obstacles.geometry.to_numpy()))
    lonlat = np.column_stack(transformer(dataset.crs, LONLAT).transform(*centres.T))
    told = obstacles[["lon", "lat"]].to_numpy(dtype="float64", na_value=np.nan)
    return bool(
        obstacles["obstacle_no"].notna().all()
        and obstacles["status"].isin(schema.STATUSES).all()
        and np.allclose(told, lonlat, rtol=0.0, atol=_SAME_DEG)
    )


def _named(field: gpd.GeoDataFrame, dataset: Dataset) -> gpd.GeoDataFrame:
    """The outline with a name and an id, where a person emptied them."""
    texts = field[["name", "field_id"]]
    if not texts.isna().any(axis=None):
        return field
    shapes = shapely.get_geometry(field.geometry.to_numpy(), 0)
    ids = [Field(shape, dataset.crs).field_id for shape in shapes]
    known = pd.DataFrame({"name": dataset.name, "field_id": ids}, index=field.index)
    return field.assign(**texts.fillna(known))


def _measured(field: gpd.GeoDataFrame, dataset: Dataset) -> gpd.GeoDataFrame:
    """The outline with its own area and length, where a person moved it."""
    shapes = np.asarray(field.geometry.to_numpy(), dtype=object)
    rings = shapely.get_exterior_ring(shapely.get_geometry(shapes, 0))
    now = {
        "area_ha": ground_areas_m2(shapes, dataset.crs) / 10_000.0,
        "perimeter_m": ground_lengths_m(rings, dataset.crs),
    }
    for name, values in now.items():
        told = field[name].to_numpy(dtype="float64", na_value=np.nan)
        if not np.allclose(told, values, rtol=_SAME, atol=0.0):
            field = field.assign(**{name: values})
    return field


def _judged(field: gpd.GeoDataFrame, dataset: Dataset) -> gpd.GeoDataFrame:
    """The outline without what was thought of the one that a person replaced."""
    parts = shapely.get_parts(field.geometry.to_numpy())
    if len(parts) != 1 or not Evidence.from_json(dataset.provenance.evidence).moved(parts[0]):
        return field
    along = along_frame(parts[0], dataset.crs, dataset.grid, dataset.provenance.shown_px)
    doubts = "; ".join(with_outside((), parts[0], along))
    return field.assign(method="drawn", certainty=np.nan, doubts=doubts or None)


def _plain(table: gpd.GeoDataFrame, layer: str) -> gpd.GeoDataFrame:
    """A table in which the user's own lists, objects and time spans are text, as files have it."""
    text = {}
    for name in schema.own_columns(schema.layer(layer), table):
        values = table[name]
        if values.dtype.kind == "m":
            text[name] = values.astype("string")
        elif values.dtype == object and not values.map(pd.api.types.is_scalar).all():
            text[name] = values.map(_as_text)
    return table.assign(**text) if text else table


def _as_text(value: Any) -> Any:
    """JSON of a list or object; other values as they are."""
    if pd.api.types.is_scalar(value):
        return value
    plain = value.tolist() if isinstance(value, np.ndarray) else value
    return json.dumps(plain, ensure_ascii=False, default=str)
