"""Checks: what shapes cannot say. Duplicate numbers, swapped axes, dangling links, broken WKT."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import shapely
from pyproj import CRS

from geofield.crs import LONLAT, transformer
from geofield.errors import FormatError
from geofield.formats.rdf.layers import LayerMap, classes, layer_maps
from geofield.formats.rdf.namespaces import GEO, GF, GML, STUDY_POINT, expand
from geofield.formats.rdf.parse import Graph
from geofield.formats.rdf.problem import Problem
from geofield.formats.rdf.scope import track_of
from geofield.formats.rdf.wkt import geometry_of

#: Farther than this from its field, in degrees (about 10 km), nothing belongs to it.
_FAR_DEG = 0.1
#: A geometry in the metric CRS may differ from the same in CRS84 by this.
_SAME_PLACE_M = 1.0


def check_graph(graph: Graph) -> Iterator[Problem]:
    """Everything that is wrong with the graph as a whole.

    Parameters
    ----------
    graph : Graph
        Of one file, or of the files of one plan together.
    """
    yield from _unnamed(graph)
    yield from _double_numbers(graph)
    yield from _dangling(graph)
    shapes = _Geometries(graph)
    yield from shapes.problems
    yield from _positions(graph, shapes)
    yield from _places(graph, shapes)


def _unnamed(graph: Graph) -> Iterator[Problem]:
    for layer in layer_maps():
        for iri in graph.of_type(*classes(layer)):
            if ":" not in iri:
                yield Problem(
                    f"A {layer.cls} has no IRI.",
                    f"_:{iri}",
                    hint="Name it, or it cannot be merged with other data.",
                    rule="no-blank-nodes",
                )


def _double_numbers(graph: Graph) -> Iterator[Problem]:
    """Numbers that must be unique: in the field, in the plan, on the track."""
    for layer in layer_maps():
        if not layer.layer.key or layer.layer.name == "field":
            continue
        seen: dict[tuple[Any, ...], str] = {}
        for iri in graph.of_type(*classes(layer)):
            key = _key(graph, layer, iri)
            if key is None:
                continue
            first = seen.setdefault(key, iri)
            if first != iri:
                title = layer.layer.column(layer.layer.key[-1]).title.lower()
                yield Problem(
                    f"Has the same {title} number {key[-1]} as <{first}>.",
                    f"<{iri}>",
                    hint="Give each its own number.",
                    rule="unique-number",
                )
    yield from _double_study_points(graph)


def _double_study_points(graph: Graph) -> Iterator[Problem]:
    seen: dict[str, str] = {}
    for iri in graph.of_type(GML + "point"):
        number = graph.value(iri, STUDY_POINT + "no")
        if number is not None and seen.setdefault(number, iri) != iri:
            yield Problem(
                f"Has the same point number {number} as <{seen[number]}>.",
                f"<{iri}>",
                hint="Give each its own number.",
                rule="unique-number",
            )


def _key(graph: Graph, layer: LayerMap, iri: str) -> tuple[Any, ...] | None:
    """What must be unique: the owner, then the layer's own key numbers."""
    owners = ("gf:onTrack", "gf:inPlan", "gf:inSurvey", "gf:inField")
    owner = next(filter(None, (graph.value(iri, name) for name in owners)), None)
    linked = {link.column for link in layer.links}
    if layer.layer.name == "track_points":
        # Points are numbered through the whole plan, not per track.
        owner = graph.value(track_of(graph, iri), "gf:inPlan")
    elif layer.layer.name == "route":
        owner = graph.value(iri, "gf:inPlan")
    names = {column.name: name for column, name in layer.properties()}
    numbers = [graph.value(iri, expand(names[key])) for key in layer.layer.key if key not in linked]
    if any(number is None for number in numbers):
        return None
    return (owner, *numbers)


def _dangling(graph: Graph) -> Iterator[Problem]:
    """Links to things of a class of which the file has some, but not this one."""
    present = {each.cls: set(graph.of_type(*classes(each))) for each in layer_maps()}
    present["gf:Field"] = set(graph.of_type("gf:Field"))
    present["geo:Geometry"] = {iri for iri, node in graph.nodes.items() if GEO + "asWKT" in node}
    links = {
        GF + "onTrack": "gf:Track", GF + "onSegment": "gf:Segment", GF + "causedBy": "gf:Obstacle",
        GF + "fromTrack": "gf:Track", GF + "toTrack": "gf:Track", GF + "inField": "gf:Field",
        GF + "inSurvey": "gf:Survey", GF + "basedOn": "gf:Survey",
        GEO + "hasDefaultGeometry": "geo:Geometry", GEO + "hasGeometry": "geo:Geometry",
    }  # fmt: skip
    for iri, node in graph.nodes.items():
        for predicate, cls in links.items():
            for target in dict.fromkeys(node.get(predicate, ())):
                known = present[cls]
                own_geometry = cls == "geo:Geometry" and target not in known
                if own_geometry or (known and target not in known):
                    yield Problem(
                        f"Points to <{target}>, which is no {cls} of this file.",
                        f"<{iri}>",
                        rule="dangling-link",
                    )


class _Geometries:
    """Every literal, parsed once; lon/lat bounds for the checks of place."""

    def __init__(self, graph: Graph) -> None:
        self.shapes: dict[str, tuple[Any, CRS]] = {}
        self.problems: list[Problem] = []
        for iri, node in graph.nodes.items():
            for text in node.get(GEO + "asWKT", ())[:1]:
                try:
                    self.shapes[iri] = geometry_of(text, iri)
                except FormatError as error:
                    message = error.message.split(">: ", 1)[-1]
                    self.problems.append(
                        Problem(
                            message[0].upper() + message[1:],
                            f"<{iri}>",
                            hint=error.hint or "",
                            rule="wkt",
                        )
                    )
        for iri, (shape, crs) in self.shapes.items():
            if crs.is_geographic and not _on_earth(shape):
                self.problems.append(
                    Problem(
                        "Its coordinates are not longitudes and latitudes on earth "
                        f"({_first_pair(shape)}).",
                        f"<{iri}>",
                        hint="Are they metres, or latitude before longitude?",
                        rule="lonlat-range",
                    )
                )
            elif not shapely.is_valid(shape):
                self.problems.append(
                    Problem(
                        f"Its shape is not valid: {shapely.is_valid_reason(shape)}.",
                        f"<{iri}>",
                        rule="valid-shape",
                    )
                )

    def bounds_lonlat(self, iri: str) -> tuple[float, float, float, float] | None:
        """West, south, east, north of a geometry; None where nobody can say."""
        if iri not in self.shapes:
            return None
        shape, crs = self.shapes[iri]
        west, south, east, north = shapely.bounds(shape).tolist()
        if not crs.is_geographic:
            project = transformer(crs, LONLAT)
            (west, east), (south, north) = project.transform([west, east], [south, north])
        bounds = (west, south, east, north)
        return bounds if all(map(math.isfinite, bounds)) else None


def _positions(graph: Graph, shapes: _Geometries) -> Iterator[Problem]:
    """Positions against geometries, and a feature's geometries against each other."""
    for iri, node in graph.nodes.items():
        default = node.get(GEO + "hasDefaultGeometry", [None])[0]
        bounds = shapes.bounds_lonlat(default) if default else None
        if bounds is None:
            continue
        lat = _float(node.get(expand("wgs84:lat"), [""])[0])
        lon = _float(node.get(expand("wgs84:long"), [""])[0])
        if lat is not None and lon is not None:
            if not _near(bounds, lon, lat, 0.001) and _near(bounds, lat, lon, 0.001):
                yield Problem(
                    f"Its geometry has latitude and longitude swapped (lat {lat}, long {lon}).",
                    f"<{iri}>",
                    hint="In CRS84 the longitude comes first.",
                    rule="swapped-axes",
                )
            elif not _near(bounds, lon, lat, 0.001):
                yield Problem(
                    f"Its geometry is not at its position (lat {lat}, long {lon}).",
                    f"<{iri}>",
                    rule="position",
                )
        for other in dict.fromkeys(node.get(GEO + "hasGeometry", ())):
            theirs = shapes.bounds_lonlat(other) if other != default else None
            if theirs is not None and not _same(bounds, theirs):
                yield Problem(
                    f"Its geometries <{default}> and <{other}> are not the same place.",
                    f"<{iri}>",
                    hint="Check CRS and axis order of the second.",
                    rule="geometries-agree",
                )


def _places(graph: Graph, shapes: _Geometries) -> Iterator[Problem]:
    """Features far outside their field."""
    fields = {}
    for iri in graph.of_type(GF + "Field"):
        bounds = shapes.bounds_lonlat(graph.value(iri, GEO + "hasDefaultGeometry") or "")
        if bounds is not None:
            fields[iri] = bounds
    if len(fields) != 1:
        return
    ((field, home),) = fields.items()
    for layer in layer_maps():
        for iri in graph.of_type(*classes(layer)):
            bounds = shapes.bounds_lonlat(graph.value(iri, GEO + "hasDefaultGeometry") or "")
            if bounds is None or iri == field or _near(home, bounds[0], bounds[1], _FAR_DEG):
                continue
            swapped = _near(home, bounds[1], bounds[0], _FAR_DEG)
            yield Problem(
                "Has latitude and longitude swapped." if swapped else "Lies far outside its field.",
                f"<{iri}>",
                hint="In CRS84 the longitude comes first." if swapped else "",
                rule="swapped-axes" if swapped else "far-outside",
            )


def _near(bounds: tuple[float, float, float, float], lon: float, lat: float, margin: float) -> bool:
    west, south, east, north = bounds
    return west - margin <= lon <= east + margin and south - margin <= lat <= north + margin


def _same(
    mine: tuple[float, float, float, float], theirs: tuple[float, float, float, float]
) -> bool:
    # Bounds of a reprojected box differ by the grid's rotation: a tenth of its size.
    size = max(mine[2] - mine[0], mine[3] - mine[1])
    slack = _SAME_PLACE_M / 111_000.0 + 0.1 * size
    return bool(np.allclose(mine, theirs, rtol=0.0, atol=slack))


def _on_earth(shape: Any) -> bool:
    west, south, east, north = shapely.bounds(shape).tolist()
    return bool(west >= -180 and east <= 180 and south >= -90 and north <= 90)


def _first_pair(shape: Any) -> str:
    x, y = shapely.get_coordinates(shape)[0].tolist()
    return f"{x:g} {y:g}"


def _float(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
