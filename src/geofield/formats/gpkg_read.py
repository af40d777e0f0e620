"""Reading GeoPackages: our own exactly, with whatever a person changed; others by content."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import shapely
from pyproj import CRS

from geofield import schema
from geofield.errors import FormatError, FormatWarning
from geofield.formats import origin
from geofield.formats.foreign import layer_names, read_layers, read_vector
from geofield.formats.picture_beside import picture_beside
from geofield.model import Dataset
from geofield.model.evidence import Evidence
from geofield.model.merged_rows import parts_apart
from geofield.model.scene import ImagerySource
from geofield.notes import warn
from geofield.strangers import database, is_geopackage
from geofield.wording import counted, without_shape

if TYPE_CHECKING:
    import geopandas as gpd

#: Track points that are read at a time.
BATCH_ROWS = 200_000
#: What is farther from the field is no part of its plan.
_FAR_M = 100_000.0
#: Tables that some readers list as layers without geometry.
_NOT_LAYERS = ("layer_styles", "qgis_projects")


def read(path: Path) -> Dataset:
    """The dataset in a GeoPackage.

    One that geofield wrote comes back as it was, together with the rows, columns, shapes
    and values that a person added or changed. Any other is understood by its layers' names
    and geometries (see `geofield.formats.foreign`).

    Raises
    ------
    FormatError
        When the file is damaged, or an edited layer is in another CRS.
    """
    record = record_of(path)
    layers = [name for name in layer_names(path) if name not in _NOT_LAYERS]
    if record is None:
        return read_layers(path)
    tables: dict[str, gpd.GeoDataFrame] = {}
    crs = record.crs
    with database(path) as connection:
        own = own_layers(connection)
    known = {layer.name: layer for layer in schema.LAYERS if layer.name in own}
    for name in layers:
        if name in known and name != schema.TRACK_POINTS.name:
            tables[name] = _own_table(known[name], read_vector(path, name), crs, path)
    if schema.OBSTACLES.name in tables:
        written = Evidence.from_json(record.provenance.evidence).written
        tables[schema.OBSTACLES.name] = parts_apart(
            tables[schema.OBSTACLES.name], None if written is None else written.by_number
        )
    field = tables.get(schema.FIELD.name)
    alone = field if field is not None and len(field) == 1 else None
    if alone is not None:
        _refuse_far(tables, alone, path)
    for name in layers:
        if name not in own:
            warn(
                f"{path.name}: layer {name!r} is not geofield's and takes no part in the plan.",
                FormatWarning,
            )
    label = None if alone is None else alone["name"].iloc[0]
    has_points = schema.TRACK_POINTS.name in layers
    return Dataset(
        tables,
        crs,
        # A person may have renamed the field in its row.
        label if isinstance(label, str) else record.name,
        record.provenance,
        record.grid,
        picture_beside(path, record.scene, record.provenance.source),
        partial(_points_in, path, crs) if has_points else None,
    )


def _refuse_far(
    tables: Mapping[str, gpd.GeoDataFrame], field: gpd.GeoDataFrame, path: Path
) -> None:
    """Refuse shapes that are no place near the field, as degrees are in a layer of metres."""
    box = shapely.box(*field.total_bounds)
    for name, table in tables.items():
        away = shapely.distance(shapely.envelope(table.geometry.to_numpy()), box)
        far = np.flatnonzero(~(away < _FAR_M))
        if len(far):
            x, y = shapely.get_coordinates(table.geometry.iloc[far[0]])[0]
            raise FormatError(
                f"{path.name}: {counted(len(far), 'row')} of layer {name!r} "
                f"lie{'s' * (len(far) == 1)} nowhere near the field, "
                f"as at x {x:.6g}, y {y:.6g} of {table.crs.name}.",
                hint="Perhaps these are coordinates of another CRS: save the layer anew in that of "
                "the other layers, or delete such rows.",
            )


def _points_in(path: Path, crs: CRS) -> Iterator[gpd.GeoDataFrame]:
    """The track points that stay in their file until they are asked for, a batch at a time."""
    import geopandas as gpd
    from pyogrio.raw import open_arrow

    layer = schema.TRACK_POINTS
    with open_arrow(path, layer=layer.name, batch_size=BATCH_ROWS) as (_, source):
        for batch in pa.RecordBatchReader.from_stream(source):
            if batch.num_rows:
                frame = gpd.GeoDataFrame.from_arrow(batch).rename_geometry("geometry")
                yield _own_table(layer, frame, crs, path)


def scene_beside(path: Path, source: ImagerySource | None = None) -> Path | None:
    """The picture beside a GeoPackage of geofield that belongs to it, where it is there.

    It is of the `source`, by default that of the plan: one of another year shows other trees.
    """
    record = record_of(path)
    if record is None:
        return None
    return picture_beside(path, record.scene, source or record.provenance.source)


def in_own_terms(
    of: schema.Layer, frame: gpd.GeoDataFrame, crs: CRS, path: Path
) -> gpd.GeoDataFrame:
    """A layer as a person left it, in the file's CRS and with columns as geofield spells them.

    Raises
    ------
    FormatError
        When it is in another CRS.
    """
    if frame.crs is None or not CRS(frame.crs).equals(crs, ignore_axis_order=True):
        raise FormatError(
            f"{path.name}: layer {of.name!r} is no longer in {crs.name}.",
            hint="Export the layer in the CRS of the other layers, then repeat.",
        )
    frame = _as_spelled(of, frame.set_crs(crs, allow_override=True))
    # Other programs write a lone part as one of several, which is no edit.
    alone = frame.geom_type.eq(f"Multi{of.geometry}") & frame.count_geometries().eq(1)
    if not alone.any():
        return frame
    shapes = frame.geometry.to_numpy()
    return frame.set_geometry(frame.geometry.mask(alone, shapely.get_geometry(shapes, 0)))


def _own_table(of: schema.Layer, frame: gpd.GeoDataFrame, crs: CRS, path: Path) -> gpd.GeoDataFrame:
    frame = in_own_terms(of, frame, crs, path)
    absent = frame.geometry.isna() | frame.geometry.is_empty
    if absent.any():
        told = without_shape((np.flatnonzero(absent) + 1).tolist(), "left out")
        warn(f"{path.name}: layer {of.name!r}: {told}", FormatWarning)
        frame = frame[~absent]
    _refuse_no_lines(of, frame, path)
    tell_lost_columns(of, frame, path)
    if of is schema.SEGMENTS and (frame.count_geometries() > 1).any():
        warn(
            f"{path.name}: layer 'segments' has rows of several lines: each line counts as the "
            "track on which it was written.",
            FormatWarning,
        )
    if of is schema.HEADLAND_TRACKS:
        frame = _passes_by_offset(frame)
    return schema.conform(of, frame, extras=True)


def _refuse_no_lines(of: schema.Layer, frame: gpd.GeoDataFrame, path: Path) -> None:
    """Refuse points and areas among tracks: borders of areas would be driven."""
    strange = shapely.get_dimensions(frame.geometry.to_numpy()) != 1
    if of in (schema.TRACKS, schema.SEGMENTS) and strange.any():
        raise FormatError(
            f"{path.name}: layer {of.name!r} holds {frame.geom_type[strange].iloc[0]} shapes; "
            "tracks are lines.",
            hint="Draw them as lines, or delete such rows; `geofield undo` brings back the plan "
            "before the last run.",
        )


def tell_lost_columns(of: schema.Layer, frame: gpd.GeoDataFrame, path: Path) -> None:
    """Tell which columns by which rows are known another program dropped, renamed or emptied."""
    words = {
        schema.OBSTACLES.name: ("obstacle_no", "kind", "status", "radius_m", "buffer_m"),
        schema.TRACKS.name: ("track_no",),
        schema.SEGMENTS.name: ("track_no", "segment_no"),
        schema.HEADLAND_TRACKS.name: ("pass_no", "segment_no"),
    }
    lost = [name for name in words.get(of.name, ()) if name not in frame.columns]
    if of is schema.SEGMENTS and not lost and frame["track_no"].notna().any():
        # Rows that were drawn have neither number.
        lost += ["segment_no"] if frame["segment_no"].isna().all() else []
    if lost:
        warn(
            f"{path.name}: layer {of.name!r} has no column {', '.join(lost)} any more: there each "
            "row counts as it was written, and what stands in a column of another name does not.",
            FormatWarning,
        )


def _as_spelled(of: schema.Layer, frame: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """The layer's columns as it spells them: for SQL, and so for editors, case is no difference."""
    known = {name.lower(): name for name in of.column_names if name not in frame.columns}
    names = {name: known[str(name).lower()] for name in frame if str(name).lower() in known}
    return frame.rename(columns=names) if names else frame


def _passes_by_offset(frame: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """Headland tracks whose pass is not told, numbered by how far from the border they run."""
    if "pass_no" in frame.columns or "offset_m" not in frame.columns:
        return frame
    frame = frame.assign(pass_no=frame["offset_m"].rank(method="dense").astype("Int64"))
    if "segment_no" in frame.columns:
        return frame
    return frame.assign(segment_no=frame.groupby("pass_no").cumcount() + 1)


def own_layers(connection: sqlite3.Connection, of: str = "main") -> set[str]:
    """The names of layers that are a plan's in its file, or a farm's.

    What not every plan has is so only where geofield described its columns: a person may keep
    a layer of that name. In a copy without geofield's record all are.
    """
    try:
        described = connection.execute(
            f"SELECT table_name, column_name FROM {of}.gpkg_data_columns WHERE EXISTS "  # noqa: S608
            f"(SELECT 1 FROM {of}.gpkg_metadata WHERE md_standard_uri = ?)",
            (origin.URI,),
        ).fetchall()
    except sqlite3.OperationalError:
        described = []
    return {
        layer.name
        for layer in (*schema.LAYERS, schema.PLACES)
        if not (layer.optional and described)
        or any((layer.name, name) in described for name in layer.column_names)
    }


def is_own(path: Path) -> bool:
    """Whether a file is a GeoPackage that geofield wrote."""
    return is_geopackage(path) and record_of(path) is not None


def record_of(path: Path) -> origin.Origin | None:
    """What geofield noted in a GeoPackage that it wrote; None in any other.

    Raises
    ------
    FormatError
        When the file is damaged.
    """
    try:
        with database(path) as connection:
            row = connection.execute(
                "SELECT metadata FROM gpkg_metadata WHERE md_standard_uri = ? ORDER BY id DESC",
                (origin.URI,),
            ).fetchone()
    except sqlite3.OperationalError as error:
        if "no such table" in str(error):
            return None
        raise FormatError(
            f"{path} cannot be read: {error}.",
            hint="May you read it, and has no other program locked it?",
        ) from error
    except sqlite3.DatabaseError as error:
        raise FormatError(
            f"{path} is not a GeoPackage: {error}.", hint="Is the file whole?"
        ) from error
    return None if row is None else origin.from_json(row[0])
