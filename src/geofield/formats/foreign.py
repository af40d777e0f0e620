"""Reading tables that other programs made: their geometries, their CRS, and what is what.

Layers with geofield's own columns are taken as they are; `geofield.formats.sorting` finds out
what the others are.
"""

from __future__ import annotations

import warnings
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pyarrow as pa
import shapely
from pyproj import CRS
from pyproj.exceptions import ProjError
from shapely.errors import GEOSException

from geofield import schema
from geofield.crs import LONLAT, metric_crs, parse_crs, refuse_outside, transformer
from geofield.errors import EmptyFileError, FormatError, FormatWarning, SeveralFieldsError
from geofield.finite import refuse_nowhere
from geofield.formats.antimeridian import joined, unwrapped
from geofield.formats.arrow import gdal_config
from geofield.formats.catalogue import PARQUET
from geofield.formats.drawing import drawn, encoding
from geofield.formats.registry import refuse_no_rows
from geofield.formats.row_crs import said_crs
from geofield.formats.sorting import RawLayer, sort_out
from geofield.model import Dataset
from geofield.notes import warn
from geofield.strangers import check_vector, unreadable
from geofield.wording import SWAP, counted, without_shape

if TYPE_CHECKING:
    import geopandas as gpd

__all__ = ["RawLayer", "files_in", "layer_names", "read_foreign", "read_parquet", "read_vector"]

#: Of GDAL's opening a file that has no layer, of dates that are none, of systems in pieces.
_DAMAGED = (IndexError, ValueError, ProjError)
#: Whole numbers, of which pandas makes others beside an empty cell.
_WHOLE = (pa.int8(), pa.int16(), pa.int32(), pa.int64(), pa.uint8(), pa.uint16(), pa.uint32())
#: What GDAL makes of a placemark: what is said of it, and how it looks.
KML_SAID = ("Name", "description", "timestamp", "begin", "end", "snippet")
KML_LOOKS = (*("id", "altitudeMode", "tessellate", "extrude", "visibility", "drawOrder", "icon"),)
#: No coordinate of a metric CRS is larger.
_FAR_M = 1e8


def read_vector(path: Path, layer: str | None = None) -> gpd.GeoDataFrame:
    """A layer of a file that GDAL reads, or a GeoParquet file.

    Raises
    ------
    FormatError
        When the file is damaged or has no geometry.
    """
    import geopandas as gpd
    import pyogrio
    from pyogrio.errors import DataLayerError, DataSourceError

    if path.suffix.lower() in PARQUET:
        refuse_layer(path, layer)
        return read_parquet(path)
    _look_at(path)
    drawing = path.suffix.lower() == ".dxf"
    try:
        letters = gdal_config(**encoding(path)) if drawing else nullcontext()
        with warnings.catch_warnings(), letters:
            # GDAL tells of each ring that is not closed; they are counted below.
            warnings.filterwarnings("ignore", "Non closed ring", RuntimeWarning)
            try:
                frame = pyogrio.read_dataframe(path, layer=layer)
            except GEOSException:
                frame = _mended(path, layer)
    except UnicodeDecodeError as error:
        raise FormatError(
            f"{path}: its text is not in the encoding it claims ({error.reason}).",
            hint="Save it as UTF-8 (a Shapefile with a .cpg file beside it).",
        ) from error
    except (*_DAMAGED, DataSourceError, DataLayerError) as error:
        raise unreadable(path, error) from error
    if not isinstance(frame, gpd.GeoDataFrame):
        raise FormatError(
            f"{path}: {layer or path.stem!r} is a table without geometry.",
            hint="Name a layer with shapes; positions are read from CSV with columns lat and lon.",
        )
    if drawing:
        return drawn(frame, path)
    if frame.crs is not None:
        said = said_crs(path, frame.crs, frame.geometry.to_numpy)
        frame = frame.set_crs(said, allow_override=True)
    return _as_filled(_exact(frame, path, layer), path)


def _exact(frame: gpd.GeoDataFrame, path: Path, layer: str | None) -> gpd.GeoDataFrame:
    """A layer of which the columns have the types that they have in the file.

    Beside an empty cell pandas makes a number with a point of a whole number or truth value, and
    a time of a date: from 2**53 on that is another number.
    """
    import pyogrio

    info = pyogrio.read_info(path, layer=layer)
    kinds = dict(zip(info["fields"], info["ogr_types"], strict=True))
    if "geometry" in kinds:
        warn(
            f"{path.name}: the column 'geometry' of layer {info['layer_name']!r} has the name of "
            "the shapes and is not kept: give it another name.",
            FormatWarning,
        )
    names = [
        name
        for name in frame.columns.drop(frame.geometry.name)
        if kinds[name] in ("OFTDate", "OFTBinary")
        or (kinds[name] in ("OFTInteger", "OFTInteger64") and frame[name].isna().any())
    ]
    if not names:
        return frame
    table = pyogrio.read_arrow(path, layer=layer, columns=names, read_geometry=False)[1]
    types = {pa.bool_(): pd.BooleanDtype(), **dict.fromkeys(_WHOLE, pd.Int64Dtype())}
    exact = table.to_pandas(types_mapper=lambda kind: types.get(kind, pd.ArrowDtype(kind)))
    return frame.assign(**exact.iloc[frame.index])


def _as_filled(frame: gpd.GeoDataFrame, path: Path) -> gpd.GeoDataFrame:
    """A layer without what GDAL makes a column of in every file of its kind, and nobody said."""
    suffix = path.suffix.lower()
    if suffix not in (".kml", ".kmz", ".gpx"):
        return frame
    said = frame.columns.drop(frame.geometry.name)
    made = [name for name in said if suffix == ".gpx" or name in KML_SAID]
    empty = [name for name in made if frame[name].isna().all()]
    looks = KML_LOOKS if suffix != ".gpx" else ()
    return frame.drop(columns=[*empty, *frame.columns.intersection(looks)])


def read_parquet(path: Path) -> gpd.GeoDataFrame:
    """A GeoParquet file, which not every GDAL reads.

    Raises
    ------
    FormatError
        When it is damaged or has no geometry.
    """
    import geopandas as gpd

    try:
        frame = gpd.read_parquet(path)
        if frame.crs is not None:  # only now is it looked at
            parse_crs(frame.crs)
    except (pa.ArrowInvalid, ValueError, OSError, ProjError) as error:
        raise unreadable(path, error) from error
    return frame.drop(columns="bbox", errors="ignore")


def _look_at(path: Path) -> None:
    """Refuse files that lead elsewhere or hold no rows."""
    check_vector(path)
    refuse_no_rows(path)


def _mended(path: Path, layer: str | None) -> Any:
    """A layer with rings closed that are open, which is said; impossible shapes are left out."""
    import pyogrio

    frame = pyogrio.read_dataframe(path, layer=layer, on_invalid="fix")
    plain = pyogrio.read_dataframe(path, layer=layer, on_invalid="ignore").geometry
    # A ring of two points closes to nothing.
    frame = frame[~(frame.geom_type.str.endswith("Polygon") & (frame.geometry.area == 0.0))]
    lost = len(plain) - int(frame.geometry.notna().sum())
    closed = int(plain.isna().sum()) - lost
    words = [f"{closed} with rings that were not closed, closed now"] if closed else []
    words += [f"{lost} without a shape that can be, left out"] if lost else []
    warn(
        f"{path.name}: geometries that are damaged: {'; '.join(words)}. Look at them.",
        FormatWarning,
    )
    return frame


def files_in(path: Path, *suffixes: str) -> list[Path]:
    """A file alone, or all files of a folder with one of the suffixes (lower case)."""
    if not path.is_dir():
        return [path]
    return sorted(file for file in path.iterdir() if file.suffix.lower() in suffixes)


def refuse_layer(path: Path, layer: str | None) -> None:
    """Refuse a layer of a file that is one table, under another name than the file's.

    Raises
    ------
    FormatError
    """
    if layer not in (None, path.stem):
        raise FormatError(
            f"{path} is one table and has no layer {layer!r}.", hint="Leave the layer out."
        )


def layer_names(path: Path) -> list[str]:
    """The layers of a file, in order; without the points of a GPX file's lines."""
    import pyogrio
    from pyogrio.errors import DataLayerError, DataSourceError

    if path.suffix.lower() in PARQUET:
        return [path.stem]
    _look_at(path)
    try:
        names = [str(name) for name, kind in pyogrio.list_layers(path) if kind is not None]
    except (DataLayerError, DataSourceError) as error:
        raise unreadable(path, error) from error
    points = ("route_points", "track_points") if path.suffix.lower() == ".gpx" else ()
    return [name for name in names if name not in points]


def has_rows(path: Path, layer: str) -> bool:
    """Whether a layer of a file holds any row."""
    import pyogrio

    return bool(pyogrio.read_info(path, layer=layer, force_feature_count=True)["features"])


def read_layers(path: Path, *, crs: CRS | None = None) -> Dataset:
    """The dataset in all layers of a file that GDAL opens."""
    layers = [RawLayer(name, read_vector(path, name)) for name in layer_names(path)]
    return read_foreign(layers, path, crs=crs)


def read_foreign(
    layers: list[RawLayer], path: Path, *, crs: CRS | None = None, name: str | None = None
) -> Dataset:
    """A dataset from whatever layers a file has.

    Parameters
    ----------
    layers : list of RawLayer
    path : Path
        For messages and, at last, the field's name.
    crs : CRS, optional
        Of the coordinates, where the file does not say.
    name : str, optional
        The field's name.

    Raises
    ------
    FormatError
        When there is nothing to use, the CRS is in doubt, or there are several fields.
    """
    for each in layers:
        refuse_nowhere(each.frame.geometry.to_numpy(), f"{path.name}: {each.name}")
    read = [(each.name, _read(each.frame, f"{path.name}: {each.name}", crs)) for each in layers]
    present = [RawLayer(name, frame) for name, frame in read if len(frame)]
    if not present:
        rows = sum(len(each.frame) for each in layers)
        raise (FormatError if rows else EmptyFileError)(
            f"{path} holds no geometries.", hint="Open it in QGIS: were its shapes saved?"
        )
    metric = _metric_of(present)
    own: dict[str, list[Any]] = {}
    foreign: list[RawLayer] = []
    notes: list[str] = []
    for each in present:
        frame = each.frame.to_crs(metric)
        # Too far for the projection is infinite, and fails this, too.
        if not (np.abs(shapely.get_coordinates(frame.geometry.to_numpy())) < _FAR_M).all():
            raise FormatError(
                f"{path.name}: {each.name} has coordinates that are no place near its field.",
                hint="Look at it in QGIS: is its CRS the right one, does a shape lie far off?",
            )
        layer = _own_layer(each)
        if layer is not None:
            is_own = frame.geom_type.str.removeprefix("Multi") == layer.geometry.removeprefix(
                "Multi"
            )
            mine, frame = frame[is_own], frame[~is_own]
            if len(mine):
                own.setdefault(layer.name, []).append(_own(layer, mine))
                are = counted(len(mine), "row is", "rows are")
                notes.append(f"{each.name}: {are} geofield's own layer {layer.name}")
        if len(frame):
            foreign.append(RawLayer(each.name, frame))
    tables: dict[str, Any] = {
        name: parts[0]
        if len(parts) == 1
        else schema.conform(schema.layer(name), pd.concat(parts), extras=True)
        for name, parts in own.items()
    }
    made = partial(_sorted, foreign, tables, metric, path, name, notes)
    try:
        return made()
    except SeveralFieldsError as error:
        error.as_obstacles = partial(made, inside=True)
        raise


def _sorted(
    layers: list[RawLayer],
    tables: dict[str, Any],
    metric: CRS,
    path: Path,
    name: str | None,
    notes: list[str],
    *,
    inside: bool = False,
) -> Dataset:
    """The dataset in which what is not geofield's own has its place, too; as of `sort_out`."""
    guessed = sort_out(layers, tables, metric, path, inside=inside)
    # A file of geofield alone leaves nothing to guess.
    notes = notes + guessed if guessed else []
    if not any(len(table) for table in tables.values()):
        raise FormatError(
            f"{path} holds nothing that is a boundary, an obstacle or a line.",
            hint="; ".join(notes),
        )
    named = list(tables["field"]["name"][:1]) if "field" in tables else []
    if name is None and named and isinstance(named[0], str):
        name = named[0]
    return Dataset(tables, metric, name or path.stem, notes=tuple(notes))


def _read(frame: gpd.GeoDataFrame, where: str, crs: CRS | None) -> gpd.GeoDataFrame:
    """The rows with a shape, in a CRS, as one that were cut at the 180th meridian."""
    keep = ~(frame.geometry.isna() | frame.geometry.is_empty)
    if lost := (np.flatnonzero(~keep) + 1).tolist():
        warn(f"{where}: {without_shape(lost, 'left out')}", FormatWarning)
    frame = _with_crs(frame[keep].reset_index(drop=True), where, crs)
    shapes = np.asarray(frame.geometry.to_numpy(), dtype=object)
    return frame.set_geometry(joined(shapes, CRS(frame.crs)), crs=frame.crs)


def _with_crs(frame: gpd.GeoDataFrame, where: str, crs: CRS | None) -> gpd.GeoDataFrame:
    if crs is not None:
        if frame.crs is not None and not CRS(frame.crs).equals(crs, ignore_axis_order=True):
            raise FormatError(
                f"{where} is in {CRS(frame.crs).name} by its own word, not in {crs.name}.",
                hint="Leave out the CRS, or correct the file.",
            )
        return frame.set_crs(crs, allow_override=True)
    if frame.crs is not None:
        return frame
    if not len(frame):
        return frame.set_crs(LONLAT)
    west, south, east, north = frame.total_bounds
    if abs(west) <= 180 and abs(east) <= 180 and abs(south) <= 90 and abs(north) <= 90:
        warn(
            f"{where} does not say its CRS (a Shapefile does in its .prj). Its numbers look like "
            "degrees and are read as WGS 84 longitude and latitude; name the CRS if that is wrong.",
            FormatWarning,
        )
        return frame.set_crs(LONLAT)
    raise FormatError(
        f"{where} does not say its CRS, and x {west:.0f} to {east:.0f}, y {south:.0f} to "
        f"{north:.0f} could be metres or feet of any projection.",
        hint="Name it, for instance --crs EPSG:32633 (UTM zone 33 north).",
    )


def _metric_of(layers: list[RawLayer]) -> CRS:
    first = layers[0].frame
    own = CRS(first.crs)
    places = np.asarray(first.geometry.to_numpy(), dtype=object)
    if own.is_geographic:
        places = unwrapped(np.array([shapely.geometrycollections(places)], dtype=object))
    west, south, east, north = shapely.total_bounds(places)
    lon, lat = transformer(own, LONLAT).transform((west + east) / 2, (south + north) / 2)
    if own.is_geographic and (abs(south) > 90 or abs(north) > 90):
        raise FormatError(
            f"Layer {layers[0].name!r} has latitudes from {south:.4f} to {north:.4f}.",
            hint=f"Latitude and longitude may be swapped (`{SWAP}`), or the "
            "CRS is not the one it says (`ogr2ogr -a_srs EPSG:32633 NAME.gpkg FILE`).",
        )
    refuse_outside(own, lon, lat, what=f"Coordinates of layer {layers[0].name!r}")
    return metric_crs(float(lon), float(lat), own=own)


def _own_layer(layer: RawLayer) -> schema.Layer | None:
    """The layer of geofield's schema that a table is, judged by its name and columns."""
    columns = set(layer.frame.columns)
    for each in schema.LAYERS:
        shared = len(columns & set(each.column_names))
        if layer.name == each.name and set(each.key) <= columns and 2 * shared >= len(each.columns):
            return each
    fitting = [each for each in schema.LAYERS if columns >= set(each.column_names)]
    # A step of a route has all columns of a segment, and more.
    return max(fitting, key=lambda each: len(each.columns), default=None)


def _own(of: schema.Layer, frame: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    if of.geometry in ("Polygon", "LineString"):
        frame = frame.explode(index_parts=False, ignore_index=True)
    return schema.conform(of, frame, extras=True)
