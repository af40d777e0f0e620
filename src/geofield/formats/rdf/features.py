"""Features: the rows of a layer as GeoSPARQL features with their geometries."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pyoxigraph as ox
import shapely
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT, ground_areas_m2, reproject
from geofield.errors import FormatError
from geofield.formats.rdf.layers import (
    CANDIDATE,
    CODE_LISTS,
    YES_NO,
    LayerMap,
    layer_map,
    value_iri,
)
from geofield.formats.rdf.names import Names
from geofield.formats.rdf.namespaces import CRS84, crs_iri, node
from geofield.formats.rdf.triples import (
    Column,
    Group,
    Nodes,
    Typed,
    date_term,
    named,
    term,
    text_term,
)
from geofield.formats.rdf.wkt import in_order
from geofield.model.obstacles import active

if TYPE_CHECKING:
    import geopandas as gpd

#: Decimals of CRS84 coordinates beside an exact geometry in the metric CRS: 0.1 mm.
LONLAT_DECIMALS = 9
#: Decimals of a track point, whose place is told once: a centimetre.
POINT_DECIMALS = 7
_OBSTACLES_IN_CAUSE = re.compile(r"obstacles?\s+([0-9][0-9,\s]*)")
_ALSO = {"gf:Survey": ("prov:Entity",), "gf:Obstacle": ("sosa:FeatureOfInterest",)}


def row_iris(layer: LayerMap, frame: gpd.GeoDataFrame, names: Names) -> list[str | None]:
    """The IRIs of a layer's rows (or of the rows that the same key columns point to)."""
    owner = names.plan if layer.in_plan else names.survey
    if not layer.path:
        return [owner] * len(frame)
    keys = re.findall(r"\{(\w+)\}", layer.path)
    path = f"{owner}/{re.sub(r'{.*?}', '{}', layer.path)}".format
    iris: list[str | None] = list(map(path, *(frame[key].tolist() for key in keys)))
    for row in np.flatnonzero(frame[keys].isna().any(axis=1)).tolist():
        iris[row] = None
    return iris


def feature_group(
    layer: LayerMap,
    frame: gpd.GeoDataFrame,
    names: Names,
    *,
    extra: Sequence[Column] = (),
    columns: Sequence[Column] | None = None,
    types: Sequence[Any] | None = None,
    accuracy_m: float | None = None,
) -> Group:
    """A layer's rows: each feature, its CRS84 geometry, its geometry in the metric CRS.

    Parameters
    ----------
    layer : LayerMap
    frame : GeoDataFrame
        In the metric CRS, with the layer's columns and no missing keys.
    names : Names
    extra : sequence of Column
        Further properties of the features.
    columns : sequence of Column, optional
        Instead of those of the layer's own columns.
    types : sequence, optional
        The classes of each row, where they are not the layer's own.
    accuracy_m : float, optional
        Of the geometries, metres.
    """
    iris = row_iris(layer, frame, names)
    geometry = np.asarray(frame.geometry.to_numpy(), dtype=object)
    nodes, links = _geometries(iris, geometry, CRS(frame.crs), accuracy_m)
    return (
        Nodes(
            named(iris),
            [
                (node("rdf:type"), row_types(layer, frame) if types is None else types),
                *_label(layer, frame),
                *(column_properties(layer, frame) if columns is None else columns),
                *_links(layer, frame, names),
                *extra,
                *_area(layer, frame),
                *links,
            ],
        ),
        *nodes,
    )


def point_group(frame: gpd.GeoDataFrame, names: Names) -> Group:
    """Track points: number, segment and place, each told once; the rest follows from them."""
    layer = layer_map(schema.TRACK_POINTS.name)
    iris = row_iris(layer, frame, names)
    places = [f"{iri}/geometry" for iri in iris]
    keys = list(zip(frame["track_no"].tolist(), frame["segment_no"].tolist(), strict=True))
    segments = {
        key: ox.NamedNode(f"{names.plan}/track/{key[0]}/segment/{key[1]}") for key in set(keys)
    }
    positions = zip(frame["lon"].tolist(), frame["lat"].tolist(), strict=True)
    wkt = [
        f"<{CRS84}> POINT ({lon:.{POINT_DECIMALS}f} {lat:.{POINT_DECIMALS}f})"
        for lon, lat in positions
    ]
    places_of, count = named(places), len(frame)
    return (
        Nodes(
            named(iris),
            [
                (node("rdf:type"), [node("gf:TrackPoint")] * count),
                (node("gf:pointNo"), Typed(map(str, frame["point_no"].tolist()), "xsd:integer")),
                (node("gf:onSegment"), list(map(segments.__getitem__, keys))),
                (node("geo:hasDefaultGeometry"), places_of),
            ],
        ),
        Nodes(
            places_of,
            [
                (node("rdf:type"), [node("sf:Point")] * count),
                (node("geo:asWKT"), Typed(wkt, "geo:wktLiteral")),
            ],
        ),
    )


def row_types(layer: LayerMap, frame: gpd.GeoDataFrame) -> list[tuple[ox.NamedNode, ...]]:
    """The classes of each row; obstacles that are not driven around are candidates."""
    own = tuple(map(node, (layer.cls, *_ALSO.get(layer.cls, ()), "geo:Feature")))
    if layer.layer.name != schema.OBSTACLES.name:
        return [own] * len(frame)
    avoided = set(active(frame)["obstacle_no"].tolist())
    other = (node(CANDIDATE), *own[1:])
    return [own if number in avoided else other for number in frame["obstacle_no"].tolist()]


def column_properties(layer: LayerMap, frame: gpd.GeoDataFrame) -> list[Column]:
    """A layer's columns as properties."""
    return [
        (node(name), _column_terms(layer.layer.name, column, name, frame[column.name]))
        for column, name in layer.properties()
        if column.name in frame.columns
    ]


def _column_terms(
    layer: str, column: schema.Column, name: str, series: pd.Series[Any]
) -> list[Any]:
    values = [None if pd.isna(value) else value for value in series.tolist()]
    if column.type == "float":
        for row, value in enumerate(values):
            if value is not None and not np.isfinite(value):
                raise FormatError(
                    f"Layer {layer!r}, row {row}: {column.name} is infinite.",
                    hint="Correct the value, or leave it empty.",
                )
        return Typed([None if v is None else repr(float(v)) for v in values], "xsd:double")
    if column.type == "int":
        return Typed([None if v is None else str(int(v)) for v in values], "xsd:integer")
    texts = [None if value is None else str(value) for value in values]
    if name in CODE_LISTS and all(t in column.values for t in texts if t is not None):
        return [None if t is None else node(value_iri(t)) for t in texts]
    if column.values == YES_NO:
        return [None if t is None else term(t == "yes") for t in texts]
    literal = date_term if column.type == "date" else text_term
    return [None if text is None else literal(text) for text in texts]


def _label(layer: LayerMap, frame: gpd.GeoDataFrame) -> list[Column]:
    if not layer.label:
        return []
    rows = frame[list(layer.layer.key)].to_dict("records")
    return [(node("rdfs:label"), [text_term(layer.label.format(**row)) for row in rows])]


def _links(layer: LayerMap, frame: gpd.GeoDataFrame, names: Names) -> list[Column]:
    result: list[Column] = []
    for link in layer.links:
        pointing = frame
        if link.target_key != link.column:
            pointing = frame.assign(**{link.target_key: frame[link.column]})
        targets = row_iris(layer_map(link.target), pointing, names)
        result.append((node(link.predicate), named(targets)))
    if layer.layer.name == schema.GAPS.name:
        result.append((node("gf:causedBy"), [_causes(text, names) for text in frame["cause"]]))
    return result


def _causes(text: Any, names: Names) -> tuple[ox.NamedNode, ...]:
    """The obstacles that a gap's cause names."""
    match = None if pd.isna(text) else _OBSTACLES_IN_CAUSE.search(str(text))
    numbers = re.findall(r"\d+", match[1]) if match else []
    return tuple(ox.NamedNode(f"{names.survey}/obstacle/{int(number)}") for number in numbers)


def _area(layer: LayerMap, frame: gpd.GeoDataFrame) -> list[Column]:
    """Square metres of polygons: GeoSPARQL's own property beside the layer's columns."""
    if layer.layer.geometry not in ("Polygon", "MultiPolygon"):
        return []
    areas_m2 = ground_areas_m2(frame.geometry.to_numpy(), CRS(frame.crs))
    return [(node("geo:hasMetricArea"), list(map(term, np.asarray(areas_m2, float).tolist())))]


# -- geometries ---------------------------------------------------------------------------------


def _geometries(
    iris: list[str | None], geometry: Any, crs: CRS, accuracy_m: float | None
) -> tuple[list[Nodes], list[Column]]:
    """The geometries' nodes, and the links from their features to them."""
    default = [f"{iri}/geometry" for iri in iris]
    identifier = crs_iri(crs)
    lonlat = reproject(geometry, crs, LONLAT)
    decimals = LONLAT_DECIMALS if identifier else -1
    nodes = [_geometry_nodes(default, lonlat, CRS84, decimals, accuracy_m)]
    if identifier:
        code = identifier.rpartition("/")[2]
        metric = [f"{iri}/EPSG-{code}" for iri in default]
        nodes.append(_geometry_nodes(metric, in_order(geometry, crs), identifier, -1, accuracy_m))
    every = list(zip(*(each.subjects for each in nodes), strict=True))
    return nodes, [
        (node("geo:hasDefaultGeometry"), nodes[0].subjects),
        (node("geo:hasGeometry"), every),
    ]


def _geometry_nodes(
    iris: list[str], geometry: Any, crs: str, decimals: int, accuracy_m: float | None
) -> Nodes:
    wkt = shapely.to_wkt(geometry, rounding_precision=decimals)
    kinds = [node(f"sf:{shape.geom_type}") for shape in geometry]
    columns: list[Column] = [
        (node("rdf:type"), [(kind, node("geo:Geometry")) for kind in kinds]),
        (node("geo:asWKT"), Typed([f"<{crs}> {text}" for text in wkt], "geo:wktLiteral")),
    ]
    if accuracy_m is not None:
        accuracy = term(float(accuracy_m))
        columns.append((node("geo:hasMetricSpatialAccuracy"), [accuracy] * len(iris)))
    return Nodes([ox.NamedNode(iri) for iri in iris], columns)
