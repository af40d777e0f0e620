"""Features: the rows of a layer as GeoSPARQL features with their geometries."""

from __future__ import annotations

import math
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
from geofield.formats.antimeridian import split
from geofield.formats.rdf.geosparql import in_order
from geofield.formats.rdf.layers import CODE_LISTS, YES_NO, LayerMap, layer_map, value_iri
from geofield.formats.rdf.names import Names
from geofield.formats.rdf.namespaces import CRS84, crs_iri, node
from geofield.formats.rdf.triples import Column, Group, Nodes, Texts, Values, date_term, term

if TYPE_CHECKING:
    import geopandas as gpd

#: Decimals of CRS84 coordinates beside an exact geometry in the metric CRS: 0.1 mm.
LONLAT_DECIMALS = 9
#: Decimals of a track point, whose place is told once: a centimetre.
POINT_DECIMALS = 7
_OBSTACLES_IN_CAUSE = re.compile(r"obstacles?\s+([0-9][0-9,\s]*)")


def row_iris(layer: LayerMap, frame: gpd.GeoDataFrame, names: Names) -> Texts:
    """The IRIs of a layer's rows (or of the rows that the same key columns point to)."""
    owner = names.plan if layer.in_plan else names.survey
    if not layer.path:
        return Texts([owner] * len(frame))
    keys = re.findall(r"\{(\w+)\}", layer.path)
    path = f"{owner}/{re.sub(r'{.*?}', '{}', layer.path)}".format
    iris = Texts(map(path, *(frame[key].tolist() for key in keys)))
    for row in np.flatnonzero(frame[keys].isna().any(axis=1)).tolist():
        iris[row] = None
    return iris


def feature_group(
    layer: LayerMap,
    frame: gpd.GeoDataFrame,
    names: Names,
    types: Values,
    columns: Sequence[Column],
    accuracy_m: float | None = None,
) -> Group:
    """A layer's rows: each feature, its CRS84 geometry, its geometry in the metric CRS.

    `frame` is in the metric CRS and has no missing keys; `accuracy_m` (metres) is that of the
    geometries.
    """
    iris = row_iris(layer, frame, names)
    geometry = np.asarray(frame.geometry.to_numpy(), dtype=object)
    nodes, links = _geometries(iris, geometry, CRS(frame.crs), accuracy_m)
    told: list[Column] = [(node("rdf:type"), types)]
    if layer.label:
        rows = frame[list(layer.layer.key)].to_dict("records")
        told.append((node("rdfs:label"), [term(layer.label.format(**row)) for row in rows]))
    told += columns
    if layer.layer.geometry in ("Polygon", "MultiPolygon"):
        # GeoSPARQL's own property, square metres, beside the layer's columns.
        areas = ground_areas_m2(geometry, CRS(frame.crs)).tolist()
        told.append((node("geo:hasMetricArea"), Texts(map(repr, areas), "xsd:double")))
    return Nodes(iris, [*told, *links]), *nodes


def point_group(frame: gpd.GeoDataFrame, names: Names) -> Group:
    """Track points: number, segment and place, each told once; the rest follows from them."""
    layer = layer_map(schema.TRACK_POINTS.name)
    iris = row_iris(layer, frame, names)
    segments = row_iris(layer_map(schema.SEGMENTS.name), frame, names)
    places = Texts(f"{iri}/geometry" for iri in iris)
    positions = zip(frame["lon"].tolist(), frame["lat"].tolist(), strict=True)
    wkt = [
        f"<{CRS84}> POINT ({lon:.{POINT_DECIMALS}f} {lat:.{POINT_DECIMALS}f})"
        for lon, lat in positions
    ]
    point: list[Column] = [
        (node("rdf:type"), node("gf:TrackPoint")),
        (node("gf:pointNo"), Texts(map(str, frame["point_no"].tolist()), "xsd:integer")),
        (node("gf:onSegment"), segments),
        (node("geo:hasDefaultGeometry"), places),
    ]
    place: list[Column] = [
        (node("rdf:type"), node("sf:Point")),
        (node("geo:asWKT"), Texts(wkt, "geo:wktLiteral")),
    ]
    return Nodes(iris, point), Nodes(places, place)


def column_terms(layer: str, column: schema.Column, name: str, series: pd.Series[Any]) -> Values:
    """The terms of a column; refuses numbers that are infinite."""
    values = series.astype(object).where(series.notna(), None).tolist()
    if column.type == "float":
        wrong = [row for row, v in enumerate(values) if v is not None and not math.isfinite(v)]
        if wrong:
            raise FormatError(
                f"Layer {layer!r}, row {wrong[0]}: {column.name} is infinite.",
                hint="Correct the value, or leave it empty.",
            )
        return Texts([None if v is None else repr(float(v)) for v in values], "xsd:double")
    if column.type == "int":
        return Texts([None if v is None else str(int(v)) for v in values], "xsd:integer")
    texts = [None if value is None else str(value) for value in values]
    if name in CODE_LISTS and all(t in column.values for t in texts if t is not None):
        return [None if t is None else node(value_iri(t)) for t in texts]
    if column.values == YES_NO:
        return [None if t is None else term(t == "yes") for t in texts]
    literal = date_term if column.type == "date" else term
    return [None if text is None else literal(text) for text in texts]


def link_properties(layer: LayerMap, frame: gpd.GeoDataFrame, names: Names) -> list[Column]:
    """A layer's links to other rows as properties."""
    result: list[Column] = []
    for link in layer.links:
        target = layer_map(link.target)
        pointing = frame.assign(**{target.layer.key[-1]: frame[link.column]})
        result.append((node(link.predicate), row_iris(target, pointing, names)))
    if layer.layer.name == schema.GAPS.name:
        result.append((node("gf:causedBy"), [_causes(text, names) for text in frame["cause"]]))
    return result


def _causes(text: Any, names: Names) -> tuple[ox.NamedNode, ...]:
    """The obstacles that a gap's cause names."""
    match = None if pd.isna(text) else _OBSTACLES_IN_CAUSE.search(str(text))
    numbers = re.findall(r"\d+", match[1]) if match else []
    return tuple(ox.NamedNode(f"{names.survey}/obstacle/{int(number)}") for number in numbers)


# -- geometries ---------------------------------------------------------------------------------


def _geometries(
    iris: Texts, geometry: Any, crs: CRS, accuracy_m: float | None
) -> tuple[list[Nodes], list[Column]]:
    """The geometries' nodes, and the links from their features to them."""
    identifier = crs_iri(crs)
    # Cut at 180: rings that jump there would go round the earth.
    told = [("", CRS84, split(reproject(geometry, crs, LONLAT)))]
    if identifier:
        exact = in_order(geometry, crs)
        told.append((f"/EPSG-{identifier.rpartition('/')[2]}", identifier, exact))
    nodes = []
    for name, iri, shapes in told:
        rounded = identifier is not None and iri == CRS84
        wkt = shapely.to_wkt(shapes, rounding_precision=LONLAT_DECIMALS if rounded else -1)
        kinds = [(node(f"sf:{shape.geom_type}"), node("geo:Geometry")) for shape in shapes]
        columns: list[Column] = [
            (node("rdf:type"), kinds),
            (node("geo:asWKT"), Texts([f"<{iri}> {text}" for text in wkt], "geo:wktLiteral")),
        ]
        if accuracy_m is not None:
            columns.append((node("geo:hasMetricSpatialAccuracy"), term(float(accuracy_m))))
        nodes.append(Nodes(Texts(f"{each}/geometry{name}" for each in iris), columns))
    every = list(zip(*(map(ox.NamedNode, each.subjects) for each in nodes), strict=True))
    return nodes, [
        (node("geo:hasDefaultGeometry"), nodes[0].subjects),
        (node("geo:hasGeometry"), every),
    ]
