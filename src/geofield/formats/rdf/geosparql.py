"""GeoSPARQL functions in Python, for stores that have none: pyoxigraph and rdflib.

Relations compare planar shapes in CRS84; distances, lengths and areas are measured on the
WGS 84 ellipsoid, so that they are metres on the ground wherever the field lies.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any

import pyoxigraph as ox
import shapely
from pyproj import Geod

from geofield.crs import LONLAT, reproject, utm_crs
from geofield.errors import FormatError
from geofield.formats.rdf.namespaces import BOOLEAN, CRS84, DOUBLE, GEOF, expand, node
from geofield.formats.rdf.wkt import geometries_of

_GEOD = Geod(ellps="WGS84")
#: Units of measure that `geof:distance` and `geof:buffer` take.
METRE_IRIS = ("http://www.opengis.net/def/uom/OGC/1.0/metre", expand("unit:M"))

Value = str | float | bool | None


@lru_cache(maxsize=4096)
def _shape(literal: str) -> Any:
    """A WKT literal as a geometry in longitude and latitude."""
    return geometries_of([literal], ["the literal"], LONLAT)[0]


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
    """`geof:buffer`: grown by a radius in metres, in the UTM zone of the place."""
    _need_metres(unit)
    west, south, east, north = shapely.bounds(_shape(literal)).tolist()
    crs = utm_crs((west + east) / 2, (south + north) / 2)
    grown = shapely.buffer(reproject(_shape(literal), LONLAT, crs), float(radius), quad_segs=16)
    return _literal(reproject(grown, crs, LONLAT))


def _relation(name: str) -> tuple[Callable[..., Value], str]:
    test = getattr(shapely, name)
    return lambda first, second: bool(test(_shape(first), _shape(second))), BOOLEAN


def _operation(name: str) -> tuple[Callable[..., Value], str]:
    work = getattr(shapely, name)
    return lambda *literals: _literal(work(*map(_shape, literals))), expand("geo:wktLiteral")


_RELATIONS = (
    "equals", "disjoint", "intersects", "touches", "crosses", "within", "contains", "overlaps",
)  # fmt: skip
#: Local name in the `geof:` namespace to function and datatype of the result.
FUNCTIONS: dict[str, tuple[Callable[..., Value], str]] = {
    **{f"sf{name.capitalize()}": _relation(name) for name in _RELATIONS},
    **{name: _operation(name) for name in ("intersection", "union", "difference", "envelope")},
    "convexHull": _operation("convex_hull"),
    "distance": (distance, DOUBLE),
    "metricLength": (metric_length, DOUBLE),
    "metricArea": (metric_area, DOUBLE),
    "buffer": (buffer, expand("geo:wktLiteral")),
}


def _text(function: Callable[..., Value], *arguments: str) -> str | None:
    """A function's answer as a literal's text; None where it fails."""
    try:
        value = function(*arguments)
    except (FormatError, TypeError, ValueError):
        return None
    return str(value).lower() if isinstance(value, bool) else str(value)


def oxigraph_functions() -> dict[ox.NamedNode, Callable[..., Any]]:
    """The functions for `pyoxigraph.Store.query(custom_functions=...)`."""

    def call(function: Callable[..., Value], datatype: str, *arguments: Any) -> Any:
        text = _text(function, *(argument.value for argument in arguments))
        # In SPARQL a function that fails leaves its value unbound.
        return None if text is None else ox.Literal(text, datatype=node(datatype))

    return {node(GEOF + name): partial(call, *each) for name, each in FUNCTIONS.items()}


def register_in_rdflib() -> None:
    """Make the functions known to rdflib's SPARQL engine, for this process."""
    import rdflib
    from rdflib.plugins.sparql.operators import register_custom_function
    from rdflib.plugins.sparql.sparql import SPARQLError

    def call(function: Callable[..., Value], datatype: str, *arguments: Any) -> Any:
        text = _text(function, *map(str, arguments))
        if text is None:
            raise SPARQLError("the function fails")
        return rdflib.Literal(text, datatype=rdflib.URIRef(datatype))

    for name, each in FUNCTIONS.items():
        register_custom_function(rdflib.URIRef(GEOF + name), partial(call, *each), override=True)
