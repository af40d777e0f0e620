"""Read: RDF of either profile, by geofield or another program, back to a dataset."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT, metric_crs, transformer
from geofield.errors import FormatError, FormatWarning
from geofield.formats.rdf.complete import complete
from geofield.formats.rdf.describe import PRODUCTS
from geofield.formats.rdf.layers import (
    YES_NO,
    LayerMap,
    classes,
    layer_map,
    layer_maps,
    value_iri,
)
from geofield.formats.rdf.namespaces import (
    GML,
    STUDY_OBSTACLE,
    STUDY_TREE,
    SVG_CIRCLE,
    expand,
)
from geofield.formats.rdf.origin import read_grid, read_provenance, read_scene_path
from geofield.formats.rdf.parse import Graph, parse
from geofield.formats.rdf.scope import Scope, choose, fields_of, track_of
from geofield.formats.rdf.study import STUDY_OBSTACLE_TERMS, STUDY_POINT_TERMS
from geofield.formats.rdf.wkt import geometries_of, known_crs, split_literal
from geofield.grid import Grid
from geofield.model.dataset import Dataset
from geofield.model.obstacles import circle_polygons

if TYPE_CHECKING:
    import geopandas as gpd

#: Further types by which rows of a layer are known, and further names of their columns.
_STUDY_TYPES = {"obstacles": (STUDY_TREE + "tree",), "track_points": (GML + "point",)}
_STUDY_TERMS = {"obstacles": STUDY_OBSTACLE_TERMS, "track_points": STUDY_POINT_TERMS}


def read(path: Path, *, plan: str | None = None) -> Dataset:
    """A dataset from a file, or from the RDF/XML files of a plan that lie side by side.

    Parameters
    ----------
    path : Path
        ``.rdf``, ``.ttl``, ``.jsonld``, ``.nt``, or a folder with ``field.rdf`` in it. The
        files ``field.rdf``, ``obstacles.rdf`` and ``tracks.rdf`` of one field are read
        together whichever is named.
    plan : str, optional
        Which track plan, where the file holds several: the end of its IRI. The field's own
        when not given.

    Raises
    ------
    FormatError
        When the file is hostile, not valid, holds several fields, or nothing of a field.
    """
    path = Path(path)
    if path.is_dir():
        path = path / "field.rdf"
    graph = Graph()
    graph.add(parse(path))
    _add_siblings(graph, path)
    dataset = from_graph(graph, plan=plan, folder=path.parent)
    if not any(dataset.has(layer.name) for layer in schema.LAYERS):
        raise FormatError(
            f"{path.name} holds no field, obstacle or track.",
            hint="geofield reads its own vocabulary and the study's; see `geofield formats`.",
        )
    return dataset


def from_graph(graph: Graph, *, plan: str | None = None, folder: Path | None = None) -> Dataset:
    """A dataset from triples, for instance of several files merged."""
    scope, crs = choose(graph, plan), _metric_crs(graph)
    grid = read_grid(graph, scope)
    tables: dict[str, gpd.GeoDataFrame] = {}
    for layer in layer_maps():
        subjects = [iri for iri in _subjects(graph, layer) if scope.holds(graph, layer, iri)]
        if subjects or not layer.layer.optional:
            tables[layer.layer.name] = _table(graph, layer, subjects, crs, scope, grid)
    complete(tables, crs, grid)
    names = tables["field"]["name"].dropna().tolist()
    return Dataset(
        tables,
        crs,
        str(names[0]) if names else "field",
        read_provenance(graph, scope),
        grid,
        None if folder is None else read_scene_path(graph, scope, folder),
    )


def _add_siblings(graph: Graph, path: Path) -> None:
    """Take in the other files of the same plan, as `write_rdfxml` names them."""
    for product in PRODUCTS:
        if path.suffix != ".rdf" or not path.stem.endswith(product):
            continue
        stem = path.stem.removesuffix(product)
        fields = fields_of(graph)
        for other in PRODUCTS:
            sibling = path.with_name(f"{stem}{other}.rdf")
            if other == product or not sibling.is_file():
                continue
            more = Graph()
            more.add(parse(sibling))
            theirs = fields_of(more)
            if fields and theirs and not fields & theirs:
                warnings.warn(
                    f"{sibling.name} is of another field than {path.name}: not read.",
                    FormatWarning,
                    stacklevel=3,
                )
                continue
            for subject, node in more.nodes.items():
                mine = graph.nodes.setdefault(subject, {})
                for predicate, values in node.items():
                    mine.setdefault(predicate, []).extend(values)


def _subjects(graph: Graph, layer: LayerMap) -> list[str]:
    if layer.layer.name == "field":
        return graph.of_type("gf:Field") or graph.of_type("gf:Survey")[:1]
    return graph.of_type(*classes(layer), *_STUDY_TYPES.get(layer.layer.name, ()))


def _metric_crs(graph: Graph) -> CRS:
    """As the dataset says, else of a geometry, else the UTM zone of the first position."""
    first: tuple[str, str] | None = None
    for iri, node in graph.nodes.items():
        for name in node.get(expand("gf:metricCrs"), ()):
            return known_crs(name)
        for wkt in node.get(expand("gf:metricCrsWkt"), ()):
            return CRS.from_wkt(wkt)
        for text in node.get(expand("geo:asWKT"), ()):
            if first is None:
                first = (text, iri)
    for iri in graph.of_type("geo:Geometry"):
        name = split_literal(graph.value(iri, "geo:asWKT") or "")[0]
        if "/EPSG/" in name and known_crs(name).is_projected:
            return known_crs(name)
    if first is not None:
        geometry = geometries_of([first[0]], [first[1]], LONLAT)[0]
        point = shapely.get_coordinates(geometry)[0]
        return metric_crs(float(point[0]), float(point[1]))
    return _crs_of_positions(graph)


def _crs_of_positions(graph: Graph) -> CRS:
    pairs = ((expand("wgs84:long"), expand("wgs84:lat")), (GML + "long", GML + "lat"))
    for node in graph.nodes.values():
        for x, y in pairs:
            if x in node and y in node:
                return metric_crs(float(node[x][0]), float(node[y][0]))
    return LONLAT


# -- tables -------------------------------------------------------------------------------------


def _table(
    graph: Graph,
    layer: LayerMap,
    subjects: list[str],
    crs: CRS,
    scope: Scope,
    grid: Grid | None,
) -> gpd.GeoDataFrame:
    if not subjects:
        return schema.empty(layer.layer, crs)
    data: dict[str, Any] = {}
    study = _STUDY_TERMS.get(layer.layer.name, {})
    told = [scope.sources(layer, iri) for iri in subjects]
    for column, name in layer.properties():
        predicates = [name, *study.get(column.name, ())[:1]]
        if column.name == "heading_deg":
            told = [(*each, scope.plan) for each in told]
        data[column.name] = _typed(column, [_first(graph, s, predicates) for s in told], subjects)
    for link in layer.links:
        target = layer_map(link.target)
        own = [name for column, name in target.properties() if column.name == link.target_key]
        own += study.get(link.column, ())[:1]
        texts = [_linked(graph, iri, link.predicate, own) for iri in subjects]
        data[link.column] = _typed(layer.layer.column(link.column), texts, subjects)
    shapes = [scope.survey or iri for iri in subjects] if layer.layer.name == "field" else subjects
    geometry = _geometry(graph, layer, shapes, data, crs, grid)
    return schema.conform(layer.layer, schema.table(layer.layer, data, geometry, crs))


def _first(graph: Graph, sources: Iterable[str | None], predicates: Iterable[str]) -> str | None:
    for predicate in predicates:
        for iri in sources:
            value = graph.value(iri, predicate)
            if value is not None:
                return value
    return None


def _linked(graph: Graph, iri: str, predicate: str, own: list[str]) -> str | None:
    """The number of the thing a link points to, or the number told directly."""
    target = track_of(graph, iri) if predicate == "gf:onTrack" else graph.value(iri, predicate)
    if target is not None:
        number = _first(graph, [target], own)
        if number is not None:
            return number
        # A file of points alone: the number is the last part of the thing's name.
        tail = target.rstrip("/").rsplit("/", 1)[-1]
        if tail.isdecimal():
            return tail
    return _first(graph, [iri], own)


def _typed(column: schema.Column, texts: list[str | None], subjects: list[str]) -> list[Any]:
    if column.type == "float":
        return [
            np.nan if t is None else _number(t, float, column, s)
            for t, s in zip(texts, subjects, strict=True)
        ]
    if column.type == "int":
        return [
            None if t is None else _number(t, int, column, s)
            for t, s in zip(texts, subjects, strict=True)
        ]
    values = {expand(value_iri(value)): value for value in column.values}
    if column.values == YES_NO:
        values = {"true": "yes", "false": "no", "1": "yes", "0": "no"}
    return [None if t is None else values.get(t, t) for t in texts]


def _number(text: str, kind: type, column: schema.Column, subject: str) -> Any:
    try:
        value = kind(text)
    except ValueError as error:
        raise FormatError(
            f"<{subject}>: {column.name} is {text[:40]!r}, not a number.",
            hint="`geofield validate` lists everything that is wrong.",
        ) from error
    if not np.isfinite(value):
        raise FormatError(f"<{subject}>: {column.name} is {text}, not a finite number.")
    return value


def _geometry(
    graph: Graph,
    layer: LayerMap,
    subjects: list[str],
    data: dict[str, Any],
    crs: CRS,
    grid: Grid | None,
) -> Any:
    if layer.layer.geometry == "Point":
        exact = _grid_points(graph, subjects)
        if exact is not None:
            return exact
    texts = [_best_wkt(graph, iri, crs) for iri in subjects]
    geometry = geometries_of(texts, subjects, crs)
    missing = np.array([text is None for text in texts])
    if missing.any() and "lat" in data:
        _from_positions(layer, geometry, missing, data, crs, grid)
    for index in np.flatnonzero([g is None for g in geometry])[:1]:
        raise FormatError(
            f"<{subjects[index]}> has no geometry.",
            hint="It needs geo:hasDefaultGeometry with one geo:asWKT.",
        )
    return _promoted(layer, geometry, subjects)


def _grid_points(graph: Graph, subjects: list[str]) -> Any:
    xs = [graph.value(iri, "gf:easting") for iri in subjects]
    ys = [graph.value(iri, "gf:northing") for iri in subjects]
    if any(v is None for v in xs) or any(v is None for v in ys):
        return None
    column = schema.Column("easting, northing", "float", "", "")
    return shapely.points(
        np.array(_typed(column, xs, subjects)), np.array(_typed(column, ys, subjects))
    )


def _best_wkt(graph: Graph, iri: str, crs: CRS) -> str | None:
    """The literal in the metric CRS, else that of the default geometry, else any."""
    nodes = graph.values(iri, "geo:hasDefaultGeometry") + graph.values(iri, "geo:hasGeometry")
    texts = [text for node in nodes for text in graph.values(node, "geo:asWKT")]
    texts += graph.values(iri, "geo:asWKT")
    for text in texts:
        name = split_literal(text)[0]
        if "/EPSG/" in name and known_crs(name) == crs:
            return text
    return texts[0] if texts else None


def _from_positions(
    layer: LayerMap,
    geometry: Any,
    missing: Any,
    data: dict[str, Any],
    crs: CRS,
    grid: Grid | None,
) -> None:
    """Rows without a geometry: the circle of an obstacle, the position of a point."""
    lon, lat = np.asarray(data["lon"], float), np.asarray(data["lat"], float)
    usable = missing & np.isfinite(lon) & np.isfinite(lat)
    x, y = transformer(LONLAT, crs).transform(lon[usable], lat[usable])
    if layer.layer.name == schema.OBSTACLES.name:
        radius = np.asarray(data["radius_m"], float)[usable]
        margin = np.nan_to_num(np.asarray(data["buffer_m"], float)[usable])
        if np.isnan(radius).any() and grid is not None:
            pixels = np.asarray(data["radius_px"], float)[usable]
            radius = np.where(np.isnan(radius), pixels * grid.ground_resolution_m, radius)
        if np.isnan(radius).any():
            raise FormatError(
                "An obstacle has neither a geometry nor a radius in metres, and nothing tells "
                f"how large a pixel of <{SVG_CIRCLE}r> is.",
                hint=f"Add gf:radiusInMetres to it (<{STUDY_OBSTACLE}no> names it).",
            )
        geometry[usable] = circle_polygons(x, y, radius + margin, crs)
    elif layer.layer.geometry == "Point":
        geometry[usable] = shapely.points(x, y)


_MULTI: dict[str, Callable[[list[Any]], Any]] = {
    "MultiLineString": shapely.multilinestrings,
    "MultiPolygon": shapely.multipolygons,
}


def _promoted(layer: LayerMap, geometry: Any, subjects: list[str]) -> Any:
    """Geometries of the layer's type: single ones as multi, multi ones of one part as single."""
    wanted = layer.layer.geometry
    for index, shape in enumerate(geometry):
        kind = shape.geom_type
        if kind == wanted:
            continue
        if f"Multi{kind}" == wanted:
            geometry[index] = _MULTI[wanted]([shape])
        elif kind == f"Multi{wanted}" and len(shape.geoms) == 1:
            geometry[index] = shape.geoms[0]
        else:
            raise FormatError(
                f"<{subjects[index]}> is a {kind}; the layer {layer.layer.name!r} holds "
                f"geometries of type {wanted}."
            )
    return geometry
