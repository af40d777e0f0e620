"""Read: RDF of either profile, by geofield or another program, back to a dataset."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from pyproj import CRS

from geofield import schema
from geofield.crs import LONLAT, is_metric, metric_crs, transformer
from geofield.errors import FormatError, FormatWarning
from geofield.formats.arrow import TYPE_IDS, promoted
from geofield.formats.picture_beside import picture_beside
from geofield.formats.rdf.complete import complete
from geofield.formats.rdf.describe import PRODUCTS
from geofield.formats.rdf.geosparql import geometries_of, known_crs, split_literal
from geofield.formats.rdf.graph import Graph, number
from geofield.formats.rdf.layers import (
    YES_NO,
    LayerMap,
    layer_map,
    layer_maps,
    value_iri,
)
from geofield.formats.rdf.namespaces import expand
from geofield.formats.rdf.origin import read_grid, read_provenance, read_scene_name
from geofield.formats.rdf.parse import SYNTAXES, parse
from geofield.formats.rdf.repeated import repeated
from geofield.formats.rdf.scope import Scope, choose, fields_of, tracks_of
from geofield.model.dataset import Dataset
from geofield.model.obstacles import circle_polygons
from geofield.notes import warn

if TYPE_CHECKING:
    import geopandas as gpd

_DEFAULT = "geo:hasDefaultGeometry"


def read(path: Path, *, plan: str | None = None) -> Dataset:
    """A dataset from a file, or from the RDF/XML files of a plan that lie side by side.

    Parameters
    ----------
    path : Path
        ``.rdf``, ``.ttl``, ``.jsonld`` or ``.nt``. The files ``field.rdf``, ``obstacles.rdf`` and
        ``tracks.rdf`` of one field are read together whichever is named.
    plan : str, optional
        Which track plan, where the file holds several: the end of its IRI. The field's own
        when not given.

    Raises
    ------
    FormatError
        When the file is hostile, not valid, holds several fields, or nothing of a field.
    """
    graph = load(path)
    _add_siblings(graph, path)
    dataset = from_graph(graph, plan=plan, path=path)
    if not any(dataset.has(layer.name) for layer in schema.LAYERS):
        raise FormatError(
            f"{path.name} holds no field, obstacle or track.",
            hint="geofield reads its own vocabulary and the study's; see `geofield formats`.",
        )
    return dataset


def load(path: Path) -> Graph:
    """The triples of a file; many nodes of one shape by their pattern."""
    syntax = SYNTAXES.get(path.suffix.lower())
    graph = repeated(path, syntax) if syntax else None
    return Graph.of(parse(path)) if graph is None else graph


def from_graph(graph: Graph, *, plan: str | None = None, path: Path | None = None) -> Dataset:
    """A dataset from triples, as of several files merged; its picture lies beside `path`."""
    scope, crs = choose(graph, plan), _metric_crs(graph)
    grid, provenance = read_grid(graph, scope), read_provenance(graph, scope)
    tables: dict[str, gpd.GeoDataFrame] = {}
    for layer in layer_maps():
        subjects = scope.rows(graph, layer, graph.of_type(*layer.known_as))
        if subjects or not layer.layer.optional:
            pixel_m = None if grid is None else grid.ground_resolution_m
            tables[layer.layer.name] = _Rows(graph, scope, layer, subjects).table(crs, pixel_m)
    complete(tables, crs, grid)
    names = tables["field"]["name"].dropna().tolist()
    return Dataset(
        tables,
        crs,
        str(names[0]) if names else "field",
        provenance,
        grid,
        path and picture_beside(path, read_scene_name(graph, scope), provenance.source),
    )


def _add_siblings(graph: Graph, path: Path) -> None:
    """Take in the other files of the same plan, as `write_rdfxml` names them."""
    own = [name for name in PRODUCTS if path.suffix == ".rdf" and path.stem.endswith(name)]
    fields = fields_of(graph)
    for other in PRODUCTS if own else ():
        sibling = path.with_name(f"{path.stem.removesuffix(own[0])}{other}.rdf")
        if sibling == path or not sibling.is_file():
            continue
        more = load(sibling)
        theirs = fields_of(more)
        if not fields or not theirs or fields & theirs:
            graph.merge(more)
            continue
        warn(f"{sibling.name} is of another field than {path.name}: not read.", FormatWarning)


def _metric_crs(graph: Graph) -> CRS:
    """As the dataset says, else of a geometry, else the UTM zone of the first position."""
    for name in graph.everywhere("gf:metricCrs"):
        return known_crs(name)
    for wkt in graph.everywhere("gf:metricCrsWkt"):
        return CRS.from_wkt(wkt)
    literals = list(graph.pairs("geo:asWKT"))
    for _, text in literals:
        name = split_literal(text)[0]
        if "/EPSG/" in name and is_metric(known_crs(name)):
            return known_crs(name)
    for iri, text in literals:
        point = shapely.get_coordinates(geometries_of([text], [iri], LONLAT)[0])[0]
        return metric_crs(float(point[0]), float(point[1]))
    for lon, lat in (("wgs84:long", "wgs84:lat"), ("gml:long", "gml:lat")):
        for x, y in zip(graph.everywhere(lon), graph.everywhere(lat), strict=False):
            east, north = number(x), number(y)
            if east is not None and north is not None:
                return metric_crs(east, north)
    return LONLAT


class _Rows:
    """The rows of one layer, as their nodes tell them."""

    def __init__(self, graph: Graph, scope: Scope, layer: LayerMap, subjects: list[str]) -> None:
        self.graph, self.scope, self.layer, self.subjects = graph, scope, layer, subjects
        self.is_field = layer.layer.name == "field"
        if self.is_field:
            # One row, told by the field, its survey and (its heading) its plan.
            known = [scope.field or "", *subjects]
            self.subjects = [iri for iri in known if graph.has(iri)][:1]

    def table(self, crs: CRS, pixel_m: float | None) -> gpd.GeoDataFrame:
        """All columns and geometries; what nothing tells is missing."""
        of = self.layer.layer
        if not self.subjects:
            return schema.empty(of, crs)
        data: dict[str, Any] = {}
        for column, _ in self.layer.properties():
            told = self.told(self.subjects, self.layer.names(column.name))
            data[column.name] = self.typed(column, told)
        for link in self.layer.links:
            target = layer_map(link.target)
            names = [*target.names(target.layer.key[-1]), *self.layer.names(link.column)]
            data[link.column] = self.typed(
                of.column(link.column), self.linked(link.predicate, names)
            )
        geometry = self.promoted(self.geometry(data, crs, pixel_m))
        return schema.conform(of, schema.table(of, data, geometry, crs))

    def told(self, subjects: Sequence[str | None], names: Sequence[str]) -> list[str | None]:
        """Of each subject the first value of any of some properties."""
        found = self.graph.told(subjects, names)
        if self.is_field and found == [None]:
            plan = [self.scope.plan] if "heading" in names[0] else []
            others = self.graph.told([self.scope.survey, *plan], names)
            found = [next((each for each in others if each is not None), None)]
        return found

    def linked(self, predicate: str, names: list[str]) -> list[str | None]:
        """The number of the thing a link points to, or the number told directly."""
        link = self.graph.column(predicate)
        targets: list[str | None] = list(map(link.get, self.subjects))
        if predicate == "gf:onTrack":
            targets = tracks_of(self.graph, self.subjects)
        # Few things, pointed to by many.
        things = list(dict.fromkeys(targets))
        numbers = dict(zip(things, self.told(things, names), strict=True))
        for thing in things:
            if thing is not None and numbers[thing] is None:
                # A file of points alone: the number is the last part of the thing's name.
                tail = thing.rstrip("/").rsplit("/", 1)[-1]
                numbers[thing] = tail if tail.isdecimal() else None
        direct = self.told(self.subjects, names)
        found = map(numbers.__getitem__, targets)
        return [own if new is None else new for own, new in zip(direct, found, strict=True)]

    def typed(self, column: schema.Column, texts: list[str | None]) -> list[Any]:
        """Texts as the values of a column."""
        if column.type in ("int", "float"):
            kind = int if column.type == "int" else float
            # All at once: one by one takes a tenth longer to read a plan.
            with suppress(ValueError, OverflowError):
                values = [None if text is None else kind(text) for text in texts]
                if all(map(math.isfinite, filter(None, values))):
                    return values
            numbers = [number(text, kind) for text in texts]
            for text, value, subject in zip(texts, numbers, self.subjects, strict=True):
                if text is not None and value is None:
                    what = "whole" if kind is int else "finite"
                    raise FormatError(
                        f"<{subject}>: {column.name} is {text[:40]!r}, not a {what} number.",
                        hint="`geofield validate` lists everything that is wrong.",
                    )
            return numbers
        meaning = {expand(value_iri(value)): value for value in column.values}
        if column.values == YES_NO:
            meaning = {"true": "yes", "false": "no", "1": "yes", "0": "no"}
        return [None if t is None else meaning.get(t, t) for t in texts]

    def geometry(self, data: dict[str, Any], crs: CRS, pixel_m: float | None) -> Any:
        """Of each row: its literal, or what its position and radius tell."""
        if self.layer.layer.geometry == "Point":
            columns = (schema.Column(name, "float", "", "") for name in ("easting", "northing"))
            told = [self.typed(c, self.told(self.subjects, [f"gf:{c.name}"])) for c in columns]
            exact = np.array(told, float)
            if not np.isnan(exact).any():
                return shapely.points(*exact)
        places = [(self.scope.survey or s) if self.is_field else s for s in self.subjects]
        texts = self.literals(places, crs)
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

    def literals(self, places: list[str], crs: CRS) -> list[str | None]:
        """The WKT of each place; where it has only a default geometry, that one's at once."""
        wkt, default = self.graph.column("geo:asWKT"), self.graph.column(_DEFAULT)
        several = set(self.graph.column("geo:hasGeometry"))
        several.update(*(self.graph.more.get(expand(n), {}) for n in ("geo:asWKT", _DEFAULT)))
        return [
            self.best_wkt(iri, crs) if iri in several else wkt.get(default.get(iri, iri))
            for iri in places
        ]

    def best_wkt(self, iri: str, crs: CRS) -> str | None:
        """The literal in the metric CRS, else that of the default geometry, else any."""
        graph = self.graph
        links = (_DEFAULT, "geo:hasGeometry")
        nodes = [each for link in links for each in graph.values(iri, link)]
        texts = [text for node in (*nodes, iri) for text in graph.values(node, "geo:asWKT")]
        for text in texts:
            name = split_literal(text)[0]
            if "/EPSG/" in name and known_crs(name) == crs:
                return text
        return texts[0] if texts else None

    def promoted(self, geometry: Any) -> Any:
        """Geometries of the layer's type: multi ones from single ones, and back."""
        of = self.layer.layer
        geometry = promoted(of, geometry)
        for index in np.flatnonzero(shapely.get_type_id(geometry) != TYPE_IDS[of.geometry])[:1]:
            raise FormatError(
                f"<{self.subjects[index]}> is a {geometry[index].geom_type}; the layer "
                f"{of.name!r} holds geometries of type {of.geometry}.",
                hint="Correct its geo:asWKT, or its class.",
            )
        return geometry


def _footprint_radius(data: dict[str, Any], rows: Any, pixel_m: float | None) -> Any:
    """Radius and margin of obstacles without a geometry, metres."""
    radius = np.asarray(data["radius_m"], float)[rows]
    pixels = np.asarray(data["radius_px"], float)[rows] * (pixel_m or np.nan)
    radius = np.where(np.isnan(radius), pixels, radius)
    if np.isnan(radius).any():
        raise FormatError(
            "An obstacle has neither a geometry nor a radius in metres, and nothing tells "
            f"how large a pixel of <{expand('svg:r')}> is.",
            hint=f"Add gf:radiusInMetres to it (<{expand('obstacle:no')}> names it).",
        )
    return radius + np.nan_to_num(np.asarray(data["buffer_m"], float)[rows])
