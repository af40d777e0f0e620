"""GeoSPARQL functions in Python, for stores that have none: pyoxigraph and rdflib.

Relations compare planar shapes in CRS84; distances, lengths and areas are measured on the
WGS 84 ellipsoid, so that they are metres on the ground wherever the field lies.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
import pyoxigraph as ox
import shapely
from pyproj import Geod

from geofield.crs import LONLAT, transformer, utm_crs
from geofield.errors import FormatError
from geofield.formats.rdf.namespaces import BOOLEAN, CRS84, DOUBLE, GEO, GEOF, UNIT
from geofield.formats.rdf.wkt import geometries_of

WKT = GEO + "wktLiteral"
_GEOD = Geod(ellps="WGS84")
#: Units of measure that `geof:distance` and `geof:buffer` take.
METRE_IRIS = (
    "http://www.opengis.net/def/uom/OGC/1.0/metre",
    UNIT + "M",
)

Value = str | float | bool | None


@lru_cache(maxsize=4096)
def _shape(literal: str) -> Any:
    """A WKT literal as a geometry in longitude and latitude."""
    return geometries_of([literal], ["the literal"], LONLAT)[0]


def _local(shape: Any) -> Any:
    """A geometry in metres around its own place, and back."""
    west, south, east, north = shapely.bounds(shape).tolist()
    crs = utm_crs((west + east) / 2, (south + north) / 2)
    there, back = transformer(LONLAT, crs), transformer(crs, LONLAT)
    return (
        shapely.transform(shape, lambda c: np.column_stack(there.transform(c[:, 0], c[:, 1]))),
        lambda s: shapely.transform(s, lambda c: np.column_stack(back.transform(c[:, 0], c[:, 1]))),
    )


def _literal(shape: Any) -> str:
    return f"<{CRS84}> {shapely.to_wkt(shape, rounding_precision=9)}"


def _need_metres(unit: str) -> None:
    if unit not in METRE_IRIS:
        raise FormatError(f"Unit <{unit}> is not known here.", hint=f"Use <{METRE_IRIS[0]}>.")


def distance(first: str, second: str, unit: str = METRE_IRIS[0]) -> float:
    """`geof:distance`: shortest way between two geometries, metres on the ellipsoid."""
    _need_metres(unit)
    near = shapely.shortest_line(_shape(first), _shape(second))
    (lon0, lat0), (lon1, lat1) = shapely.get_coordinates(near).tolist()
    return float(_GEOD.inv(lon0, lat0, lon1, lat1)[2])


def metric_length(literal: str) -> float:
    """`geof:metricLength`: metres on the ellipsoid."""
    return float(_GEOD.geometry_length(_shape(literal)))


def metric_area(literal: str) -> float:
    """`geof:metricArea`: square metres on the ellipsoid."""
    return abs(float(_GEOD.geometry_area_perimeter(shapely.orient_polygons(_shape(literal)))[0]))


def buffer(literal: str, radius: float, unit: str = METRE_IRIS[0]) -> str:
    """`geof:buffer`: grown by a radius in metres."""
    _need_metres(unit)
    metres, back = _local(_shape(literal))
    return _literal(back(shapely.buffer(metres, float(radius), quad_segs=16)))


def _relation(name: str) -> Callable[[str, str], bool]:
    test = getattr(shapely, name)
    return lambda first, second: bool(test(_shape(first), _shape(second)))


def _operation(name: str) -> Callable[[str, str], str]:
    work = getattr(shapely, name)
    return lambda first, second: _literal(work(_shape(first), _shape(second)))


#: Local name in the `geof:` namespace to function and datatype of the result.
FUNCTIONS: dict[str, tuple[Callable[..., Value], str]] = {
    "sfEquals": (_relation("equals"), BOOLEAN),
    "sfDisjoint": (_relation("disjoint"), BOOLEAN),
    "sfIntersects": (_relation("intersects"), BOOLEAN),
    "sfTouches": (_relation("touches"), BOOLEAN),
    "sfCrosses": (_relation("crosses"), BOOLEAN),
    "sfWithin": (_relation("within"), BOOLEAN),
    "sfContains": (_relation("contains"), BOOLEAN),
    "sfOverlaps": (_relation("overlaps"), BOOLEAN),
    "distance": (distance, DOUBLE),
    "metricLength": (metric_length, DOUBLE),
    "metricArea": (metric_area, DOUBLE),
    "buffer": (buffer, WKT),
    "intersection": (_operation("intersection"), WKT),
    "union": (_operation("union"), WKT),
    "difference": (_operation("difference"), WKT),
    "envelope": (lambda literal: _literal(shapely.envelope(_shape(literal))), WKT),
    "convexHull": (lambda literal: _literal(shapely.convex_hull(_shape(literal))), WKT),
}


def oxigraph_functions() -> dict[ox.NamedNode, Callable[..., Any]]:
    """The functions for `pyoxigraph.Store.query(custom_functions=...)`."""
    return {
        ox.NamedNode(GEOF + name): _for_oxigraph(function, datatype)
        for name, (function, datatype) in FUNCTIONS.items()
    }


def _for_oxigraph(function: Callable[..., Value], datatype: str) -> Callable[..., Any]:
    def call(*arguments: Any) -> Any:
        try:
            value = function(*(argument.value for argument in arguments))
        except (FormatError, TypeError, ValueError):
            # In SPARQL a function that fails leaves its value unbound.
            return None
        return ox.Literal(_lexical(value), datatype=ox.NamedNode(datatype))

    return call


def register_in_rdflib() -> None:
    """Make the functions known to rdflib's SPARQL engine, for this process."""
    import rdflib
    from rdflib.plugins.sparql.operators import register_custom_function
    from rdflib.plugins.sparql.sparql import SPARQLError

    def adapted(function: Callable[..., Value], datatype: str) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            try:
                value = function(*(str(argument) for argument in arguments))
            except (FormatError, TypeError, ValueError) as error:
                raise SPARQLError(str(error)) from error
            return rdflib.Literal(_lexical(value), datatype=rdflib.URIRef(datatype))

        return call

    for name, (function, datatype) in FUNCTIONS.items():
        register_custom_function(
            rdflib.URIRef(GEOF + name), adapted(function, datatype), override=True
        )


def _lexical(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
