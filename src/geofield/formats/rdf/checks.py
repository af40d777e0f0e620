"""Checks: what shapes cannot say. Duplicate numbers, swapped axes, dangling links, broken WKT."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain
from typing import Any

import numpy as np
import shapely
from pyproj import CRS

from geofield.crs import LONLAT, reproject
from geofield.errors import FormatError
from geofield.formats.antimeridian import unwrapped
from geofield.formats.rdf.geosparql import geometry_of
from geofield.formats.rdf.graph import Graph, number, ontology
from geofield.formats.rdf.layers import classes, layer_maps
from geofield.formats.rdf.namespaces import compact, expand
from geofield.formats.rdf.parse import Problem
from geofield.formats.rdf.scope import tracks_of

#: Farther than this from its field, in degrees (about 10 km), nothing belongs to it.
_FAR_DEG = 0.1
#: A position may lie this far from its geometry, in degrees (about 100 m).
_NEAR_DEG = 0.001
#: A geometry in the metric CRS may differ from the same in CRS84 by this.
_SAME_PLACE_M = 1.0
_AXES = "In CRS84 the longitude comes first."

#: West, south, east and north; east may lie beyond 180.
Bounds = tuple[float, float, float, float]


def check_graph(graph: Graph) -> Iterator[Problem]:
    """Everything that is wrong with a graph as a whole: one file, or the files of one plan."""
    yield from _double_numbers(graph)
    yield from _dangling(graph)
    bounds: dict[str, Bounds] = {}
    for iri, text in graph.column("geo:asWKT").items():
        yield from _geometry(iri, text, bounds)
    yield from _positions(graph, bounds)
    yield from _places(graph, bounds)


def _double_numbers(graph: Graph) -> Iterator[Problem]:
    """Numbers that must be unique: in the survey, in the plan, on the track."""
    for layer in layer_maps()[1:]:
        of = layer.layer
        title = of.column(of.key[-1]).title.lower()
        iris = graph.of_type(*layer.known_as)
        numbers = [graph.told(iris, layer.names(key)) for key in of.key if layer.names(key)]
        seen: dict[Any, str] = {}
        for iri, *key in zip(iris, _owners(graph, of.name, iris), *numbers, strict=True):
            if None not in key[1:] and seen.setdefault(tuple(key), iri) != iri:
                message = f"Has the same {title} number {key[-1]} as <{seen[tuple(key)]}>."
                hint = "Give each its own number."
                yield Problem(f"<{iri}>", "unique-number", message, hint)


def _owners(graph: Graph, layer: str, iris: list[str]) -> list[str | None]:
    """In what each row's number must be unique; points are numbered through the whole plan."""
    if layer == "track_points":
        return graph.told(tracks_of(graph, iris), ["gf:inPlan"])
    on = ["gf:onTrack"] if layer != "route" else []
    return graph.told(iris, [*on, "gf:inPlan", "gf:inSurvey", "gf:inField"])


def _dangling(graph: Graph) -> Iterator[Problem]:
    """Links to things of a class of which the file has some, but not this one."""
    present = {each.cls: set(graph.of_type(*classes(each))) for each in layer_maps()}
    present["gf:Field"] = set(graph.of_type("gf:Field"))
    present["geo:Geometry"] = set(graph.column("geo:asWKT"))
    ranges = {name: compact(cls) for name, cls in ontology().pairs("rdfs:range")}
    # The ontology names two classes; any obstacle is one of the first here.
    ranges[expand("gf:causedBy")] = "gf:Obstacle"
    for name, cls in ranges.items():
        # Things of a class that the file has none of may be in another file.
        if not present.get(cls) and cls != "geo:Geometry":
            continue
        for iri, target in dict.fromkeys(graph.pairs(name)):
            if target not in present[cls]:
                message = f"Points to <{target}>, which is no {cls} of this file."
                yield Problem(f"<{iri}>", "dangling-link", message)


def _geometry(iri: str, text: str, bounds: dict[str, Bounds]) -> Iterator[Problem]:
    """What is wrong with a literal; its bounds in longitude and latitude go into `bounds`."""
    try:
        shape, crs = geometry_of(text, iri)
    except FormatError as error:
        message = error.message.split(">: ", 1)[-1]
        yield Problem(f"<{iri}>", "wkt", message, error.hint or "")
        return
    if shapely.is_empty(shape):
        yield Problem(f"<{iri}>", "wkt", "Its geometry is empty.")
        return
    box = _lonlat_bounds(shape, crs)
    if box is not None:
        bounds[iri] = box
    on_earth = np.abs(shapely.bounds(shape)) <= (180.0, 90.0, 180.0, 90.0)
    if crs.is_geographic and not on_earth.all():
        pair = "{:g} {:g}".format(*shapely.get_coordinates(shape)[0])
        message = f"Its coordinates are not longitudes and latitudes on earth ({pair})."
        hint = "Are they metres, or latitude before longitude?"
        yield Problem(f"<{iri}>", "lonlat-range", message, hint)
    elif not shapely.is_valid(shape):
        message = f"Its shape is not valid: {shapely.is_valid_reason(shape)}."
        yield Problem(f"<{iri}>", "valid-shape", message)


def _lonlat_bounds(shape: Any, crs: CRS) -> Bounds | None:
    # Every vertex: near a pole the corners of a box lie anywhere around what is in it.
    lonlat = shape if crs.is_geographic else reproject(shape, crs, LONLAT)
    (shape,) = unwrapped(np.array([lonlat]))
    west, south, east, north = shapely.bounds(shape).tolist()
    box = (west, south, east, north)
    return box if all(map(math.isfinite, box)) else None


def _positions(graph: Graph, bounds: dict[str, Bounds]) -> Iterator[Problem]:
    """Positions against geometries, and a feature's geometries against each other."""
    for iri, default in graph.column("geo:hasDefaultGeometry").items():
        box = bounds.get(default)
        if box is None:
            continue
        lat, lon = (number(graph.value(iri, f"wgs84:{name}")) for name in ("lat", "long"))
        if lat is not None and lon is not None and not _near(box, lon, lat, _NEAR_DEG):
            swapped = _near(box, lat, lon, _NEAR_DEG)
            words = "has latitude and longitude swapped" if swapped else "is not at its position"
            message = f"Its geometry {words} (lat {lat}, long {lon})."
            rule = "swapped-axes" if swapped else "position"
            yield Problem(f"<{iri}>", rule, message, _AXES if swapped else "")
        for other in graph.values(iri, "geo:hasGeometry"):
            # A field has one for each of its surveys: these need not be one place.
            mine = "/survey/" not in other or other.startswith(default)
            if mine and other in bounds and not _same(box, bounds[other]):
                message = f"Its geometries <{default}> and <{other}> are not the same place."
                hint = "Check CRS and axis order of the second."
                yield Problem(f"<{iri}>", "geometries-agree", message, hint)


def _places(graph: Graph, bounds: dict[str, Bounds]) -> Iterator[Problem]:
    """Features far outside their field."""

    def place(iri: str) -> Bounds | None:
        return bounds.get(graph.value(iri, "geo:hasDefaultGeometry") or "")

    homes = [box for box in map(place, graph.of_type("gf:Field")) if box is not None]
    if len(homes) != 1:
        return
    for iri in graph.of_type(*chain.from_iterable(map(classes, layer_maps()))):
        box = place(iri)
        if box is None or _near(homes[0], box[0], box[1], _FAR_DEG):
            continue
        if _near(homes[0], box[1], box[0], _FAR_DEG):
            message = "Has latitude and longitude swapped."
            yield Problem(f"<{iri}>", "swapped-axes", message, _AXES)
        else:
            yield Problem(f"<{iri}>", "far-outside", "Lies far outside its field.")


def _near(box: Bounds, lon: float, lat: float, margin: float) -> bool:
    west, south, east, north = box
    # Beyond 180 a longitude counts on from -180.
    eastward = (lon - west + margin) % 360.0
    return eastward <= east - west + 2 * margin and south - margin <= lat <= north + margin


def _same(mine: Bounds, theirs: Bounds) -> bool:
    # What is straight in one CRS bends in another one, and is rounded: a tenth of its size.
    size = max(mine[2] - mine[0], mine[3] - mine[1])
    apart = np.abs(np.subtract(mine, theirs))
    apart[[0, 2]] = np.minimum(apart[[0, 2]], 360.0 - apart[[0, 2]])
    return bool((apart <= _SAME_PLACE_M / 111_000.0 + 0.1 * size).all())
