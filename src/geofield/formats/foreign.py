"""Understanding tables that other programs made: which layer is what, in which CRS.

Layers with geofield's own columns are taken as they are. Of others, polygons are the
field's outline or obstacles, points are obstacles, and lines are guidance lines: by the
layer's name where it says so, else by what lies in what.
"""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import shapely
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT, metric_crs, transformer
from geofield.errors import FormatError, FormatWarning
from geofield.formats.foreign_tables import field_table, line_tables, obstacle_table
from geofield.model import Dataset

if TYPE_CHECKING:
    import geopandas as gpd

_OBSTACLE_WORDS = re.compile(
    r"obst|tree|baum|arbre|exclu|hole|interior|inner|areafeature|pointfeature|hindernis|flag", re.I
)
_FIELD_WORDS = re.compile(r"^field|bound|outline|parcel|parzelle|schlag|feld|perimeter", re.I)
_SKIP_WORDS = re.compile(r"headland|turn|route|gap", re.I)


@dataclass(frozen=True, slots=True)
class RawLayer:
    """A table as a file has it: any columns, any CRS, geometries that may be mixed."""

    name: str
    frame: gpd.GeoDataFrame


def read_vector(path: Path, layer: str | None = None) -> gpd.GeoDataFrame:
    """A layer of a file that GDAL reads, without its empty rows.

    Raises
    ------
    FormatError
        When the file is damaged or has no geometry.
    """
    import geopandas as gpd
    import pyogrio
    from pyogrio.errors import DataLayerError, DataSourceError, FeatureError, GeometryError

    try:
        frame = pyogrio.read_dataframe(path, layer=layer)
    except (DataSourceError, DataLayerError, FeatureError, GeometryError) as error:
        raise FormatError(f"{path} cannot be read: {error}.", hint="Is the file whole?") from error
    except UnicodeDecodeError as error:
        raise FormatError(
            f"{path}: its text is not in the encoding it claims ({error.reason}).",
            hint="Save it as UTF-8 (a Shapefile with a .cpg file beside it).",
        ) from error
    if not isinstance(frame, gpd.GeoDataFrame):
        raise FormatError(f"{path}: {layer or path.stem!r} is a table without geometry.")
    return frame


def layer_names(path: Path) -> list[str]:
    """The layers of a file, in order.

    Raises
    ------
    FormatError
        When GDAL cannot open it.
    """
    import pyogrio
    from pyogrio.errors import DataSourceError

    try:
        return [str(name) for name, kind in pyogrio.list_layers(path) if kind is not None]
    except DataSourceError as error:
        raise FormatError(f"{path} cannot be read: {error}.", hint="Is the file whole?") from error


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
    present = [
        RawLayer(each.name, _with_crs(_present(each.frame), f"{path.name}: {each.name}", crs))
        for each in layers
    ]
    present = [each for each in present if len(each.frame)]
    if not present:
        raise FormatError(f"{path} holds no geometries.")
    metric = _metric_of(present)
    tables: dict[str, gpd.GeoDataFrame] = {}
    rest: list[RawLayer] = []
    for each in present:
        frame = each.frame.to_crs(metric)
        own = _own_layer(each)
        if own is not None:
            tables[own.name] = _own(own, frame, path)
        else:
            rest.append(RawLayer(each.name, frame))
    _sort_out(rest, tables, metric, path)
    field = tables.get("field")
    if name is None and field is not None and len(field) and isinstance(field["name"].iloc[0], str):
        name = field["name"].iloc[0]
    return Dataset(tables, metric, name or path.stem)


def _present(frame: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    keep = ~(frame.geometry.isna() | frame.geometry.is_empty)
    return frame[keep].reset_index(drop=True)


def _with_crs(frame: gpd.GeoDataFrame, where: str, crs: CRS | None) -> gpd.GeoDataFrame:
    if crs is not None:
        if frame.crs is not None and not CRS(frame.crs).equals(crs, ignore_axis_order=True):
            raise FormatError(
                f"{where} is in {CRS(frame.crs).name} by its own word, not in {crs.name}.",
                hint="Leave out the CRS, or correct the file.",
            )
        return frame.set_crs(crs, allow_override=True)
    if frame.crs is not None or not len(frame):
        return frame if frame.crs is not None else frame.set_crs(LONLAT)
    west, south, east, north = frame.total_bounds
    if abs(west) <= 180 and abs(east) <= 180 and abs(south) <= 90 and abs(north) <= 90:
        warnings.warn(
            f"{where} does not say its CRS (a Shapefile does in its .prj). Its numbers look like "
            "degrees and are read as WGS 84 longitude and latitude; name the CRS if that is wrong.",
            FormatWarning,
            stacklevel=4,
        )
        return frame.set_crs(LONLAT)
    raise FormatError(
        f"{where} does not say its CRS, and x {west:.0f} to {east:.0f}, y {south:.0f} to "
        f"{north:.0f} could be metres or feet of any projection.",
        hint="Name it, for instance --crs EPSG:32633.",
    )


def _metric_of(layers: list[RawLayer]) -> CRS:
    first = layers[0].frame
    own = CRS(first.crs)
    west, south, east, north = first.total_bounds
    if not np.isfinite([west, south, east, north]).all():
        raise FormatError(f"Layer {layers[0].name!r} has coordinates that are not numbers.")
    lon, lat = transformer(own, LONLAT).transform((west + east) / 2, (south + north) / 2)
    if own.is_geographic and (abs(south) > 90 or abs(north) > 90):
        raise FormatError(
            f"Layer {layers[0].name!r} has latitudes from {south:.4f} to {north:.4f}.",
            hint="Latitude and longitude may be swapped, or the CRS is not the one it says.",
        )
    return metric_crs(float(lon), float(lat), own=own)


def _own_layer(layer: RawLayer) -> schema.Layer | None:
    """The layer of geofield's schema that a table is, judged by its name and columns."""
    columns = set(layer.frame.columns)
    for each in schema.LAYERS:
        shared = len(columns & set(each.column_names))
        if layer.name == each.name and set(each.key) <= columns and 2 * shared >= len(each.columns):
            return each
    for each in schema.LAYERS:
        if len(columns & set(each.column_names)) == len(each.columns):
            return each
    return None


def _own(of: schema.Layer, frame: gpd.GeoDataFrame, path: Path) -> gpd.GeoDataFrame:
    if of.geometry in ("Polygon", "LineString"):
        frame = frame.explode(index_parts=False, ignore_index=True)
    wanted = of.geometry.removeprefix("Multi")
    fits = frame.geom_type.str.removeprefix("Multi") == wanted
    if not fits.all():
        warnings.warn(
            f"{path.name}: {int((~fits).sum())} geometries of {of.name!r} are no {wanted} and are "
            "left out.",
            FormatWarning,
            stacklevel=4,
        )
    return schema.conform(of, frame[fits], extras=True)


def _sort_out(rest: list[RawLayer], tables: dict[str, Any], metric: CRS, path: Path) -> None:
    """Give every foreign geometry its place."""
    outlines: list[Any] = []
    obstacles: list[Any] = []
    lines: list[Any] = []
    unnamed: list[Any] = []
    for each in rest:
        if _SKIP_WORDS.search(each.name):
            continue
        frame = each.frame.explode(index_parts=False, ignore_index=True)
        kind = frame.geom_type
        polygons = frame[kind == "Polygon"]
        lines.append(frame[kind.isin(["LineString", "LinearRing"])])
        obstacles.append(frame[kind == "Point"])
        if _OBSTACLE_WORDS.search(each.name):
            obstacles.append(polygons)
        elif _FIELD_WORDS.search(each.name):
            outlines.append(polygons)
        else:
            unnamed.append(polygons)
    outline, loose = _concat(outlines), _concat(unnamed)
    if loose is not None:
        if outline is None and "field" not in tables:
            outline, inner = _largest_and_inner(loose)
            obstacles.append(inner)
        else:
            obstacles.append(loose)
    if outline is not None and "field" not in tables:
        tables["field"] = field_table(_repaired(outline, path), metric, path)
    found = _concat(obstacles)
    if found is not None and "obstacles" not in tables:
        tables["obstacles"] = obstacle_table(_repaired(found, path), metric, path)
    drawn = _concat(lines)
    if drawn is not None and "tracks" not in tables:
        tables["tracks"], tables["segments"] = line_tables(drawn, metric)
    elif "segments" in tables and "tracks" not in tables:
        tables["tracks"], tables["segments"] = line_tables(tables["segments"], metric)


def _largest_and_inner(frame: gpd.GeoDataFrame) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame]:
    """Split polygons of one layer: those that lie in the largest are its obstacles."""
    largest = int(np.argmax(frame.area.to_numpy()))
    outer = shapely.Polygon(frame.geometry.iloc[largest].exterior)
    inside = np.asarray(shapely.covered_by(frame.geometry.to_numpy(), outer))
    inside[largest] = False
    return frame[~inside], frame[inside]


def _repaired(frame: gpd.GeoDataFrame, path: Path) -> gpd.GeoDataFrame:
    polygons = frame.geom_type == "Polygon"
    bad = polygons & ~frame.geometry.is_valid
    if not bad.any():
        return frame
    warnings.warn(
        f"{path.name}: {int(bad.sum())} polygons cross themselves and were repaired; look at them.",
        FormatWarning,
        stacklevel=4,
    )
    mended = frame.copy()
    mended.loc[bad, mended.geometry.name] = frame.geometry[bad].make_valid()
    mended = mended.explode(index_parts=False, ignore_index=True)
    return mended[mended.geom_type.isin(["Polygon", "Point"])]


def _concat(frames: list[Any]) -> Any:
    full = [frame for frame in frames if len(frame)]
    return pd.concat(full, ignore_index=True) if full else None
