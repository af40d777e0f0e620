"""Read: RDF of either profile, by geofield or another program, back to a dataset."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT, metric_crs, transformer
from geofield.errors import FormatError, FormatWarning
from geofield.formats.rdf.complete import complete
from geofield.formats.rdf.features import YES_NO
from geofield.formats.rdf.layers import LayerMap, layer_map, layer_maps, value_iri
from geofield.formats.rdf.namespaces import (
    GEO,
    GF,
    GML,
    STUDY_OBSTACLE,
    STUDY_TREE,
    SVG_CIRCLE,
    expand,
)
from geofield.formats.rdf.origin import read_grid, read_provenance, read_scene_path
from geofield.formats.rdf.parse import Graph, parse
from geofield.formats.rdf.study import STUDY_OBSTACLE_TERMS, STUDY_POINT_TERMS
from geofield.formats.rdf.wkt import geometries_of, known_crs, split_literal
from geofield.formats.rdf.write import PRODUCTS
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
    field = _field_of(graph)
    scope = _scope(graph, field, plan)
    crs = _metric_crs(graph)
    tables: dict[str, gpd.GeoDataFrame] = {}
    for layer in layer_maps():
        subjects = [iri for iri in _subjects(graph, layer) if scope.holds(graph, layer, iri)]
        if subjects or not layer.layer.optional:
            tables[layer.layer.name] = _table(graph, layer, subjects, crs)
    complete(tables, crs)
    names = tables["field"]["name"].dropna().tolist()
    return Dataset(
        tables,
        crs,
        str(names[0]) if names else "field",
        read_provenance(graph, scope.plan),
        read_grid(graph),
        None if folder is None else read_scene_path(graph, folder),
    )


# -- what belongs together --------------------------------------------------------------------


def _add_siblings(graph: Graph, path: Path) -> None:
    """Take in the other files of the same plan, as `write_rdfxml` names them."""
    for product in PRODUCTS:
        if path.suffix != ".rdf" or not path.stem.endswith(product):
            continue
        stem = path.stem.removesuffix(product)
        fields = _fields(graph)
        for other in PRODUCTS:
            sibling = path.with_name(f"{stem}{other}.rdf")
            if other == product or not sibling.is_file():
                continue
            more = Graph()
            more.add(parse(sibling))
            theirs = _fields(more)
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


def _fields(graph: Graph) -> set[str]:
    named = {v for node in graph.nodes.values() for v in node.get(GF + "inField", ())}
    return named | set(graph.of_type(GF + "Field"))


def _field_of(graph: Graph) -> str | None:
    fields = sorted(_fields(graph))
    if len(fields) > 1:
        raise FormatError(
            f"There are {len(fields)} fields: {', '.join(f'<{iri}>' for iri in fields[:5])}.",
            hint="geofield reads one field at a time: split the file by gf:inField.",
        )
    return fields[0] if fields else None


@dataclass(frozen=True, slots=True)
class _Scope:
    """Which tracks are meant where there are several plans."""

    plan: str | None
    tracks: frozenset[str]

    def holds(self, graph: Graph, layer: LayerMap, iri: str) -> bool:
        if not layer.in_plan or self.plan is None:
            return True
        track = iri if layer.layer.name == "tracks" else graph.value(iri, GF + "onTrack")
        if track is not None:
            return track in self.tracks
        return graph.value(iri, GF + "inPlan") in (None, self.plan)


def _scope(graph: Graph, field: str | None, plan: str | None) -> _Scope:
    tracks: dict[str | None, set[str]] = {}
    for iri in graph.of_type(GF + "Track"):
        tracks.setdefault(graph.value(iri, GF + "inPlan"), set()).add(iri)
    plans = sorted({p for p in tracks if p} | set(graph.of_type(GF + "TrackPlan")))
    if plan is not None:
        chosen = [p for p in plans if p == plan or p.rsplit("/", 1)[-1] == plan]
        if len(chosen) != 1:
            raise FormatError(
                f"There is no one track plan {plan!r}.",
                hint=f"Plans: {', '.join(plans) or 'none'}.",
            )
        return _Scope(chosen[0], frozenset(tracks.get(chosen[0], ())))
    if len(plans) <= 1:
        return _Scope(None, frozenset())
    own = f"{field}/plan"
    choice = own if own in plans else plans[0]
    warnings.warn(
        f"There are {len(plans)} track plans ({', '.join(plans)}): reading <{choice}>. Name "
        "another by its plan.",
        FormatWarning,
        stacklevel=4,
    )
    return _Scope(choice, frozenset(tracks.get(choice, set()) | tracks.get(None, set())))


def _subjects(graph: Graph, layer: LayerMap) -> list[str]:
    return graph.of_type(expand(layer.cls), *_STUDY_TYPES.get(layer.layer.name, ()))


def _metric_crs(graph: Graph) -> CRS:
    """As the dataset says, else of a geometry, else the UTM zone of the first position."""
    first: tuple[str, str] | None = None
    for iri, node in graph.nodes.items():
        for name in node.get(GF + "metricCrs", ()):
            return known_crs(name)
        for wkt in node.get(GF + "metricCrsWkt", ()):
            return CRS.from_wkt(wkt)
        for text in node.get(GEO + "asWKT", ()):
            if first is None:
                first = (text, iri)
    for iri in graph.of_type(GEO + "Geometry"):
        name = split_literal(graph.value(iri, GEO + "asWKT") or "")[0]
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


def _table(graph: Graph, layer: LayerMap, subjects: list[str], crs: CRS) -> gpd.GeoDataFrame:
    if not subjects:
        return schema.empty(layer.layer, crs)
    data: dict[str, Any] = {}
    study = _STUDY_TERMS.get(layer.layer.name, {})
    for column, name in layer.properties():
        predicates = [expand(name)] if ":" in name else [name]
        if column.name in study:
            predicates.append(study[column.name][0])
        texts = [_first(graph, iri, predicates) for iri in subjects]
        data[column.name] = _typed(column, texts, subjects)
    for link in layer.links:
        own = [
            expand(n) for c, n in layer_map(link.target).properties() if c.name == link.target_key
        ]
        own += [study[link.column][0]] if link.column in study else []
        texts = [_linked(graph, iri, expand(link.predicate), own) for iri in subjects]
        data[link.column] = _typed(layer.layer.column(link.column), texts, subjects)
    geometry = _geometry(graph, layer, subjects, data, crs)
    frame = schema.table(layer.layer, data, geometry, crs)
    return schema.conform(layer.layer, frame)


def _first(graph: Graph, iri: str, predicates: Iterable[str]) -> str | None:
    for predicate in predicates:
        value = graph.value(iri, predicate)
        if value is not None:
            return value
    return None


def _linked(graph: Graph, iri: str, predicate: str, own: list[str]) -> str | None:
    """The number of the thing a link points to, or the number told directly."""
    target = graph.value(iri, predicate)
    if target is not None:
        number = _first(graph, target, own)
        if number is not None:
            return number
        # A file of points alone: the number is the last part of the thing's name.
        tail = target.rstrip("/").rsplit("/", 1)[-1]
        if tail.isdecimal():
            return tail
    return _first(graph, iri, own)


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
    graph: Graph, layer: LayerMap, subjects: list[str], data: dict[str, Any], crs: CRS
) -> Any:
    if layer.layer.geometry == "Point":
        exact = _grid_points(graph, subjects)
        if exact is not None:
            return exact
    texts = [_best_wkt(graph, iri, crs) for iri in subjects]
    geometry = geometries_of(texts, subjects, crs)
    missing = np.array([text is None for text in texts])
    if missing.any() and "lat" in data:
        _from_positions(layer, geometry, missing, data, graph, crs)
    for index in np.flatnonzero([g is None for g in geometry])[:1]:
        raise FormatError(
            f"<{subjects[index]}> has no geometry.",
            hint="It needs geo:hasDefaultGeometry with one geo:asWKT.",
        )
    return _promoted(layer, geometry, subjects)


def _grid_points(graph: Graph, subjects: list[str]) -> Any:
    xs = [graph.value(iri, GF + "easting") for iri in subjects]
    ys = [graph.value(iri, GF + "northing") for iri in subjects]
    if any(v is None for v in xs) or any(v is None for v in ys):
        return None
    column = schema.Column("easting, northing", "float", "", "")
    return shapely.points(
        np.array(_typed(column, xs, subjects)), np.array(_typed(column, ys, subjects))
    )


def _best_wkt(graph: Graph, iri: str, crs: CRS) -> str | None:
    """The literal in the metric CRS, else that of the default geometry, else any."""
    nodes = graph.values(iri, GEO + "hasDefaultGeometry") + graph.values(iri, GEO + "hasGeometry")
    texts = [text for node in nodes for text in graph.values(node, GEO + "asWKT")]
    texts += graph.values(iri, GEO + "asWKT")
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
    graph: Graph,
    crs: CRS,
) -> None:
    """Rows without a geometry: the circle of an obstacle, the position of a point."""
    lon, lat = np.asarray(data["lon"], float), np.asarray(data["lat"], float)
    usable = missing & np.isfinite(lon) & np.isfinite(lat)
    x, y = transformer(LONLAT, crs).transform(lon[usable], lat[usable])
    if layer.layer.name == schema.OBSTACLES.name:
        radius = np.asarray(data["radius_m"], float)[usable]
        margin = np.nan_to_num(np.asarray(data["buffer_m"], float)[usable])
        grid = read_grid(graph)
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
