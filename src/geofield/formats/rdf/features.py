"""Features: the rows of a layer as GeoSPARQL features with their geometries."""

from __future__ import annotations

import re
import string
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import shapely
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT, ground_areas_m2, transformer
from geofield.errors import FormatError
from geofield.formats.rdf.layers import LayerMap, all_terms, layer_map, value_iri
from geofield.formats.rdf.namespaces import (
    BOOLEAN,
    CRS84,
    DATE,
    DOUBLE,
    GEO,
    GF,
    INTEGER,
    LABEL,
    SF,
    STRING,
    WKT,
    crs_iri,
    expand,
    northing_first,
)
from geofield.formats.rdf.nodes import (
    IRI,
    Group,
    Nodes,
    Property,
    constant,
    float_texts,
    joined,
    strings,
)

if TYPE_CHECKING:
    import geopandas as gpd

#: Decimals of CRS84 coordinates beside an exact geometry in the metric CRS: 0.1 mm.
LONLAT_DECIMALS = 9
#: The values of columns that are truth values.
YES_NO = ("yes", "no")
_DATE = re.compile(r"\d{4}-\d\d-\d\d")
_OBSTACLES_IN_CAUSE = re.compile(r"obstacles?\s+([0-9][0-9,\s]*)")


@dataclass(frozen=True, slots=True)
class Names:
    """The IRIs under which a dataset's rows are named."""

    field: str
    plan: str

    def of(self, layer: LayerMap) -> str:
        """What the layer's paths start with."""
        return self.plan if layer.in_plan else self.field


def row_iris(layer: LayerMap, frame: gpd.GeoDataFrame, names: Names) -> Any:
    """The IRIs of a layer's rows (or of the rows that the same key columns point to)."""
    if not layer.path:
        return constant(names.field, len(frame))
    parts: list[Any] = []
    opening = names.of(layer) + "/"
    for text, key, _, _ in string.Formatter().parse(layer.path):
        parts.append(opening + text)
        opening = ""
        if key:
            parts.append(_int_texts(frame[key]))
    return joined(*parts)


def feature_group(
    layer: LayerMap,
    frame: gpd.GeoDataFrame,
    names: Names,
    *,
    extra: Sequence[Property] = (),
    accuracy_m: float | None = None,
) -> Group:
    """A layer's rows as nodes: the feature, its CRS84 geometry, its metric geometry.

    Parameters
    ----------
    layer : LayerMap
    frame : GeoDataFrame
        In the metric CRS, with the layer's columns and no missing keys.
    names : Names
    extra : sequence of Property
        Further properties of the features.
    accuracy_m : float, optional
        Of the geometries, metres.
    """
    iris = row_iris(layer, frame, names)
    properties = [*_label(layer, frame), *column_properties(layer, frame)]
    properties += _links(layer, frame, names)
    properties += extra
    properties += _measures(layer, frame)
    crs = CRS(frame.crs)
    geometry = np.asarray(frame.geometry.to_numpy(), dtype=object)
    if layer.metric_geometry:
        nodes, links = _geometries(iris, geometry, crs, accuracy_m)
    else:
        properties += _grid_coordinates(geometry)
        nodes, links = _point_geometries(iris, frame)
    feature = Nodes(
        iris,
        (expand(layer.cls), *_FEATURE_TYPES.get(layer.cls, ()), GEO + "Feature"),
        (*properties, *links),
    )
    return (feature, *nodes)


_FEATURE_TYPES = {
    "gf:Field": (expand("s4agri:Parcel"),),
    "gf:Obstacle": (expand("sosa:FeatureOfInterest"),),
}


def column_properties(layer: LayerMap, frame: gpd.GeoDataFrame) -> list[Property]:
    """A layer's columns as properties; columns without any value are left out."""
    result = []
    for column, name in layer.properties():
        if column.name in frame.columns:
            prop = _column_property(layer, column, name, frame[column.name])
            if prop is not None:
                result.append(prop)
    return result


def _column_property(
    layer: LayerMap, column: schema.Column, name: str, series: pd.Series[Any]
) -> Property | None:
    texts, datatype = _column_texts(layer.layer.name, column, name, series)
    if len(texts) and texts.null_count == len(texts):
        return None
    return Property(expand(name), datatype, (texts,), free_text=datatype == STRING)


def _column_texts(
    layer: str, column: schema.Column, name: str, series: pd.Series[Any]
) -> tuple[Any, str]:
    if column.type == "float":
        values = series.to_numpy(dtype="float64", na_value=np.nan)
        if np.isinf(values).any():
            row = int(np.flatnonzero(np.isinf(values))[0])
            raise FormatError(
                f"Layer {layer!r}, row {row}: {column.name} is infinite.",
                hint="Correct the value, or leave it empty.",
            )
        return float_texts(values), DOUBLE
    if column.type == "int":
        return _int_texts(series), INTEGER
    texts = [None if pd.isna(value) else str(value) for value in series]
    term = all_terms().get(name)
    if term is not None and term.is_object and all(t in column.values for t in texts if t):
        return strings(None if t is None else expand(value_iri(t)) for t in texts), IRI
    if column.values == YES_NO:
        words = {"yes": "true", "no": "false"}
        return strings(None if t is None else words.get(t) for t in texts), BOOLEAN
    if column.type == "date" and all(_DATE.fullmatch(t) for t in texts if t is not None):
        return strings(texts), DATE
    return strings(texts), STRING


def _int_texts(series: pd.Series[Any]) -> Any:
    if pd.api.types.is_string_dtype(series):
        return strings(None if pd.isna(v) else str(v) for v in series)
    return pc.cast(pa.array(series.astype("Int64"), pa.int64(), from_pandas=True), pa.string())


def _label(layer: LayerMap, frame: gpd.GeoDataFrame) -> list[Property]:
    if not layer.label:
        return []
    parts: list[Any] = []
    for text, key, _, _ in string.Formatter().parse(layer.label):
        parts += [text, _int_texts(frame[key])] if key else [text]
    return [Property(LABEL, STRING, (joined(*parts),))]


def _links(layer: LayerMap, frame: gpd.GeoDataFrame, names: Names) -> list[Property]:
    result = []
    for link in layer.links:
        pointing = frame
        if link.target_key != link.column:
            pointing = frame.assign(**{link.target_key: frame[link.column]})
        targets = row_iris(layer_map(link.target), pointing, names)
        if targets.null_count < len(targets):
            result.append(Property(expand(link.predicate), IRI, (targets,)))
    if layer.layer.name == "gaps" and len(frame):
        columns = _causes(frame["cause"], names)
        if columns:
            result.append(Property(GF + "causedBy", IRI, columns))
    return result


def _causes(cause: pd.Series[Any], names: Names) -> tuple[Any, ...]:
    """The obstacles that each gap's cause names: first ones, second ones, ..."""
    numbers = [
        [int(n) for n in re.findall(r"\d+", match[1])]
        if not pd.isna(text) and (match := _OBSTACLES_IN_CAUSE.search(str(text)))
        else []
        for text in cause
    ]
    return tuple(
        strings(f"{names.field}/obstacle/{n[k]}" if k < len(n) else None for n in numbers)
        for k in range(max(map(len, numbers), default=0))
    )


def _measures(layer: LayerMap, frame: gpd.GeoDataFrame) -> list[Property]:
    """Square metres of polygons: GeoSPARQL's own property beside the layer's columns."""
    if layer.layer.geometry not in ("Polygon", "MultiPolygon"):
        return []
    areas_m2 = ground_areas_m2(frame.geometry.to_numpy(), CRS(frame.crs))
    return [Property(GEO + "hasMetricArea", DOUBLE, (float_texts(areas_m2),))]


def _grid_coordinates(geometry: Any) -> list[Property]:
    return [
        Property(GF + "easting", DOUBLE, (float_texts(shapely.get_x(geometry)),)),
        Property(GF + "northing", DOUBLE, (float_texts(shapely.get_y(geometry)),)),
    ]


# -- geometries ---------------------------------------------------------------------------------


def _geometries(
    iris: Any, geometry: Any, crs: CRS, accuracy_m: float | None
) -> tuple[list[Nodes], list[Property]]:
    default, metric = joined(iris, "/geometry"), None
    identifier = crs_iri(crs)
    lonlat = _to_lonlat(geometry, crs)
    wkt = shapely.to_wkt(lonlat, rounding_precision=LONLAT_DECIMALS if identifier else -1)
    nodes = [_geometry_nodes(default, geometry, CRS84, wkt, accuracy_m)]
    if identifier:
        metric = joined(default, "/EPSG-" + identifier.rpartition("/")[2])
        swapped = shapely.transform(geometry, _swap) if northing_first(crs) else geometry
        exact = shapely.to_wkt(swapped, rounding_precision=-1)
        nodes.append(_geometry_nodes(metric, geometry, identifier, exact, accuracy_m))
    columns = (default,) if metric is None else (default, metric)
    return nodes, [
        Property(GEO + "hasDefaultGeometry", IRI, (default,)),
        Property(GEO + "hasGeometry", IRI, columns),
    ]


def _point_geometries(iris: Any, frame: gpd.GeoDataFrame) -> tuple[list[Nodes], list[Property]]:
    default = joined(iris, "/geometry")
    wkt = joined(
        "POINT (",
        float_texts(frame["lon"].to_numpy(dtype="float64", na_value=np.nan)),
        " ",
        float_texts(frame["lat"].to_numpy(dtype="float64", na_value=np.nan)),
        ")",
    )
    node = _geometry_nodes(default, None, CRS84, wkt, None)
    return [node], [
        Property(GEO + "hasDefaultGeometry", IRI, (default,)),
        Property(GEO + "hasGeometry", IRI, (default,)),
    ]


def _geometry_nodes(
    iris: Any, geometry: Any, crs: str, wkt: Any, accuracy_m: float | None
) -> Nodes:
    texts = wkt if isinstance(wkt, pa.Array) else pa.array(wkt.tolist(), pa.string())
    # WKT holds nothing to escape, but the CRS stands in angle brackets: XML escapes those.
    properties = [Property(GEO + "asWKT", WKT, (joined(f"<{crs}> ", texts),))]
    if accuracy_m is not None:
        accuracy = constant(repr(float(accuracy_m)), len(texts))
        properties.append(Property(GEO + "hasMetricSpatialAccuracy", DOUBLE, (accuracy,)))
    kinds = {0} if geometry is None else set(shapely.get_type_id(geometry).tolist())
    simple = _SIMPLE.get(int(next(iter(kinds), 0)), "")
    types = (SF + simple, GEO + "Geometry") if len(kinds) == 1 and simple else (GEO + "Geometry",)
    return Nodes(iris, types, tuple(properties))


_SIMPLE = {
    0: "Point",
    1: "LineString",
    3: "Polygon",
    4: "MultiPoint",
    5: "MultiLineString",
    6: "MultiPolygon",
}


def _to_lonlat(geometry: Any, crs: CRS) -> Any:
    project = transformer(crs, LONLAT)
    return shapely.transform(
        geometry, lambda c: np.column_stack(project.transform(c[:, 0], c[:, 1]))
    )


def _swap(coordinates: Any) -> Any:
    return coordinates[:, ::-1]
