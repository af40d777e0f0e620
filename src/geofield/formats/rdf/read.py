"""Read: RDF of either profile, by geofield or another program, back to a dataset."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
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
from geofield.formats.rdf.namespaces import GML, STUDY_OBSTACLE, STUDY_TREE, SVG_CIRCLE, expand
from geofield.formats.rdf.origin import read_grid, read_provenance, read_scene_path
from geofield.formats.rdf.parse import Graph, parse
from geofield.formats.rdf.scope import Scope, choose, fields_of, track_of
from geofield.formats.rdf.study import STUDY_OBSTACLE_TERMS, STUDY_POINT_TERMS
from geofield.formats.rdf.wkt import geometries_of, known_crs, split_literal
from geofield.model.dataset import Dataset
from geofield.model.obstacles import circle_polygons

if TYPE_CHECKING:
    import geopandas as gpd

#: A further type by which rows of a layer are known, and further names of their columns.
_STUDY = {
    "obstacles": (STUDY_TREE + "tree", STUDY_OBSTACLE_TERMS),
    "track_points": (GML + "point", STUDY_POINT_TERMS),
}


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
        further = _STUDY.get(layer.layer.name, ())[:1]
        subjects = [
            iri
            for iri in graph.of_type(*classes(layer), *further)
            if scope.holds(graph, layer, iri)
        ]
        if subjects or not layer.layer.optional:
            pixel_m = None if grid is None else grid.ground_resolution_m
            tables[layer.layer.name] = _Rows(graph, scope, layer, subjects).table(crs, pixel_m)
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
    own = [name for name in PRODUCTS if path.suffix == ".rdf" and path.stem.endswith(name)]
    fields = fields_of(graph)
    for other in PRODUCTS if own else ():
        sibling = path.with_name(f"{path.stem.removesuffix(own[0])}{other}.rdf")
        if sibling == path or not sibling.is_file():
            continue
        more = Graph()
        more.add(parse(sibling))
        theirs = fields_of(more)
        if not fields or not theirs or fields & theirs:
            graph.merge(more)
            continue
        warnings.warn(
            f"{sibling.name} is of another field than {path.name}: not read.",
            FormatWarning,
            stacklevel=3,
        )


def _metric_crs(graph: Graph) -> CRS:
    """As the dataset says, else of a geometry, else the UTM zone of the first position."""
    for name in graph.everywhere("gf:metricCrs"):
        return known_crs(name)
    for wkt in graph.everywhere("gf:metricCrsWkt"):
        return CRS.from_wkt(wkt)
    literals = list(graph.everywhere("geo:asWKT"))
    for text in literals:
        name = split_literal(text)[0]
        if "/EPSG/" in name and known_crs(name).is_projected:
            return known_crs(name)
    for text in literals:
        point = shapely.get_coordinates(geometries_of([text], ["the literal"], LONLAT)[0])[0]
        return metric_crs(float(point[0]), float(point[1]))
    for lon, lat in (("wgs84:long", "wgs84:lat"), (GML + "long", GML + "lat")):
        for x, y in zip(graph.everywhere(lon), graph.everywhere(lat), strict=False):
            return metric_crs(float(x), float(y))
    return LONLAT


class _Rows:
    """The rows of one layer, as their nodes tell them."""

    def __init__(self, graph: Graph, scope: Scope, layer: LayerMap, subjects: list[str]) -> None:
        self.graph, self.scope, self.layer, self.subjects = graph, scope, layer, subjects
        self.is_field = layer.layer.name == "field"
        if self.is_field:
            # One row, told by the field, its survey and (its heading) its plan.
            known = [scope.field, *subjects]
            self.subjects = [iri for iri in known if iri in graph.nodes][:1]

    def table(self, crs: CRS, pixel_m: float | None) -> gpd.GeoDataFrame:
        """All columns and geometries; what nothing tells is missing."""
        of = self.layer.layer
        if not self.subjects:
            return schema.empty(of, crs)
        data: dict[str, Any] = {}
        study = _STUDY.get(of.name, ("", {}))[1]
        for column, name in self.layer.properties():
            names = [name, *study.get(column.name, ())[:1]]
            data[column.name] = self.typed(column, [self.told(s, names) for s in self.subjects])
        for link in self.layer.links:
            target = layer_map(link.target).properties()
            names = [name for column, name in target if column.name == link.target_key]
            names += study.get(link.column, ())[:1]
            texts = [self.linked(iri, link.predicate, names) for iri in self.subjects]
            data[link.column] = self.typed(of.column(link.column), texts)
        geometry = self.promoted(self.geometry(data, crs, pixel_m))
        return schema.conform(of, schema.table(of, data, geometry, crs))

    def told(self, iri: str, names: Iterable[str]) -> str | None:
        """The first value of any of some properties."""
        survey, plan = self.scope.survey, self.scope.plan
        for name in names:
            sources: tuple[str | None, ...] = (iri,)
            if self.is_field:
                sources = (iri, survey, plan) if "heading" in name else (iri, survey)
            for source in sources:
                value = self.graph.value(source, name)
                if value is not None:
                    return value
        return None

    def linked(self, iri: str, predicate: str, names: list[str]) -> str | None:
        """The number of the thing a link points to, or the number told directly."""
        on_track = predicate == "gf:onTrack"
        target = track_of(self.graph, iri) if on_track else self.graph.value(iri, predicate)
        number = None if target is None else self.told(target, names)
        if number is None and target is not None:
            # A file of points alone: the number is the last part of the thing's name.
            tail = target.rstrip("/").rsplit("/", 1)[-1]
            number = tail if tail.isdecimal() else None
        return number if number is not None else self.told(iri, names)

    def typed(self, column: schema.Column, texts: list[str | None]) -> list[Any]:
        """Texts as the values of a column."""
        if column.type in ("int", "float"):
            kind, none = (int, None) if column.type == "int" else (float, np.nan)
            rows = zip(texts, self.subjects, strict=True)
            return [none if t is None else _number(t, kind, column.name, s) for t, s in rows]
        values = {expand(value_iri(value)): value for value in column.values}
        if column.values == YES_NO:
            values = {"true": "yes", "false": "no", "1": "yes", "0": "no"}
        return [None if t is None else values.get(t, t) for t in texts]

    def geometry(self, data: dict[str, Any], crs: CRS, pixel_m: float | None) -> Any:
        """Of each row: its literal, or what its position and radius tell."""
        if self.layer.layer.geometry == "Point":
            exact = [
                self.typed(
                    schema.Column(name, "float", "", ""),
                    [self.graph.value(iri, f"gf:{name}") for iri in self.subjects],
                )
                for name in ("easting", "northing")
            ]
            if not np.isnan(exact).any():
                return shapely.points(*np.array(exact))
        places = [(self.scope.survey or s) if self.is_field else s for s in self.subjects]
        texts = [self.best_wkt(iri, crs) for iri in places]
        geometry = geometries_of(texts, self.subjects, crs)
        missing = np.array([text is None for text in texts])
        if missing.any() and "lat" in data:
            lon, lat = np.asarray(data["lon"], float), np.asarray(data["lat"], float)
            rows = missing & np.isfinite(lon) & np.isfinite(lat)
            x, y = transformer(LONLAT, crs).transform(lon[rows], lat[rows])
            if self.layer.layer.geometry == "Point":
                geometry[rows] = shapely.points(x, y)
            elif "radius_m" in data:
                radius = _footprint_radius(data, rows, pixel_m)
                geometry[rows] = circle_polygons(x, y, radius, crs)
        for index in np.flatnonzero(shapely.is_missing(geometry))[:1]:
            raise FormatError(
                f"<{self.subjects[index]}> has no geometry.",
                hint="It needs geo:hasDefaultGeometry with one geo:asWKT.",
            )
        return geometry

    def best_wkt(self, iri: str, crs: CRS) -> str | None:
        """The literal in the metric CRS, else that of the default geometry, else any."""
        graph = self.graph
        links = ("geo:hasDefaultGeometry", "geo:hasGeometry")
        nodes = [each for link in links for each in graph.values(iri, link)]
        texts = [text for node in (*nodes, iri) for text in graph.values(node, "geo:asWKT")]
        for text in texts:
            name = split_literal(text)[0]
            if "/EPSG/" in name and known_crs(name) == crs:
                return text
        return texts[0] if texts else None

    def promoted(self, geometry: Any) -> Any:
        """Geometries of the layer's type: multi ones from single ones, and back."""
        wanted = self.layer.layer.geometry
        multi: dict[str, Any] = {
            "MultiLineString": shapely.multilinestrings,
            "MultiPolygon": shapely.multipolygons,
        }
        for index, shape in enumerate(geometry):
            kind = shape.geom_type
            if f"Multi{kind}" == wanted:
                geometry[index] = multi[wanted]([shape])
            elif kind == f"Multi{wanted}" and len(shape.geoms) == 1:
                geometry[index] = shape.geoms[0]
            elif kind != wanted:
                raise FormatError(
                    f"<{self.subjects[index]}> is a {kind}; the layer {self.layer.layer.name!r} "
                    f"holds geometries of type {wanted}."
                )
        return geometry


def _number(text: str, kind: type, column: str, subject: str) -> Any:
    try:
        value = kind(text)
    except ValueError as error:
        raise FormatError(
            f"<{subject}>: {column} is {text[:40]!r}, not a number.",
            hint="`geofield validate` lists everything that is wrong.",
        ) from error
    if not np.isfinite(value):
        raise FormatError(f"<{subject}>: {column} is {text}, not a finite number.")
    return value


def _footprint_radius(data: dict[str, Any], rows: Any, pixel_m: float | None) -> Any:
    """Radius and margin of obstacles without a geometry, metres."""
    radius = np.asarray(data["radius_m"], float)[rows]
    pixels = np.asarray(data["radius_px"], float)[rows] * (pixel_m or np.nan)
    radius = np.where(np.isnan(radius), pixels, radius)
    if np.isnan(radius).any():
        raise FormatError(
            "An obstacle has neither a geometry nor a radius in metres, and nothing tells "
            f"how large a pixel of <{SVG_CIRCLE}r> is.",
            hint=f"Add gf:radiusInMetres to it (<{STUDY_OBSTACLE}no> names it).",
        )
    return radius + np.nan_to_num(np.asarray(data["buffer_m"], float)[rows])
