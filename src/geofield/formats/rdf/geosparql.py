"""GeoSPARQL: WKT literals with their CRS, and functions for stores that have none.

Literals are read with their axes put into geofield's order. The stores are pyoxigraph and rdflib;
relations compare planar shapes in CRS84; distances, lengths and areas are measured on the WGS 84
ellipsoid, so that they are metres on the ground wherever the field lies.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import lru_cache, partial
from typing import Any

import numpy as np
import pyoxigraph as ox
import shapely
from numpy.typing import NDArray
from pyproj import CRS
from pyproj.exceptions import CRSError
from shapely.errors import ShapelyError

from geofield.crs import GEOD, LONLAT, northing_first, reproject, utm_crs
from geofield.errors import FormatError
from geofield.formats.antimeridian import joined, split
from geofield.formats.rdf.namespaces import BOOLEAN, CRS84, DOUBLE, EPSG, GEOF, expand, node

#: Units of measure that `geof:distance` and `geof:buffer` take.
METRE_IRIS = ("http://www.opengis.net/def/uom/OGC/1.0/metre", expand("unit:M"))
_CORRECT = "Correct its geo:asWKT."

Value = str | float | bool | None


def split_literal(text: str) -> tuple[str, str]:
    """The CRS's IRI (CRS84 where none is named, as GeoSPARQL has it) and the WKT."""
    iri, found, wkt = text.partition(">")
    return (iri.lstrip()[1:], wkt) if found and iri.lstrip()[:1] == "<" else (CRS84, text)


@lru_cache(maxsize=64)
def known_crs(iri: str) -> CRS:
    """The CRS of an OGC identifier; refuses any other."""
    if iri == CRS84:
        return CRS.from_user_input("OGC:CRS84")
    code = iri.removeprefix(EPSG)
    if code != iri and code.isdecimal():
        with suppress(CRSError):
            crs = CRS.from_epsg(int(code))
            if crs.is_geographic or crs.is_projected:  # no heights alone, no geocentric ones
                return crs
    raise FormatError(
        f"The coordinate reference system <{iri}> is not known.",
        hint=f"Use <{CRS84}> or <{EPSG}...>.",
    )


def geometry_of(text: str, subject: str) -> tuple[Any, CRS]:
    """One WKT literal as a geometry (x before y) and its CRS; errors name the subject."""
    iri, wkt = split_literal(text)
    try:
        return _shapes(iri, wkt)
    except ShapelyError as error:
        raise FormatError(
            f"<{subject}>: {wkt[:60]!r} is not WKT ({error}).", hint=_CORRECT
        ) from error
    except FormatError as error:
        raise FormatError(f"<{subject}>: {error.message}", hint=error.hint) from error


def _shapes(iri: str, wkt: Any) -> tuple[Any, CRS]:
    """One WKT or many in the CRS of an IRI as geometries, and that CRS."""
    shapes = shapely.from_wkt(wkt)
    crs = known_crs(iri)
    if not np.isfinite(shapely.get_coordinates(shapes)).all():
        raise FormatError("a coordinate is not a finite number.", hint=_CORRECT)
    return in_order(shapes, crs), crs


def in_order(geometry: Any, crs: CRS) -> Any:
    """Geometries between geofield's order of axes and the authority's, either way."""
    if northing_first(crs):
        return shapely.transform(geometry, lambda xy: xy[:, ::-1])
    return geometry


def geometries_of(
    texts: Sequence[str | None], subjects: Sequence[str], target: CRS
) -> NDArray[np.object_]:
    """WKT literals as geometries in one CRS; None stays None."""
    result = np.full(len(texts), None, dtype=object)
    heads = [None if text is None else text[: text.find(">") + 1] for text in texts]
    for head in dict.fromkeys(each for each in heads if each is not None):
        rows = [row for row, each in enumerate(heads) if each == head]
        known = [texts[row] or "" for row in rows]
        try:
            iri, _ = split_literal(known[0])
            shapes, crs = _shapes(iri, [text[len(head) :] for text in known])
        except (ShapelyError, FormatError):
            # One by one, to name the one that is at fault.
            for text, row in zip(known, rows, strict=True):
                geometry_of(text, subjects[row])
            raise
        # What is cut at 180 is one shape where no meridian is in the way.
        whole = shapes if target.is_geographic else joined(shapes, crs)
        result[rows] = reproject(whole, crs, target)
    lost = ~np.isfinite(shapely.bounds(result)).all(axis=1) & ~shapely.is_missing(result)
    for row in np.flatnonzero(lost).tolist():
        words = (
            "geometry is empty" if result[row].is_empty else "coordinates are not a place on earth"
        )
        raise FormatError(f"<{subjects[row]}>: its {words}.", hint=_CORRECT)
    return result


# -- functions ----------------------------------------------------------------------------------


@lru_cache(maxsize=4096)
def _shape(literal: str) -> Any:
    """A WKT literal as a geometry in longitude and latitude; across 180 those go on beyond."""
    return joined(geometries_of([literal], ["the literal"], LONLAT), LONLAT)[0]


def _side_by_side(literals: Sequence[str]) -> list[Any]:
    """Geometries, all on the side of 180 where the first one is."""
    first, *others = map(_shape, literals)
    return [first, *(_moved(each, beside=first) for each in others)]


def _moved(shape: Any, *, beside: Any) -> Any:
    apart = shapely.bounds(beside)[0] - shapely.bounds(shape)[0]
    turn = 0.0 if np.isnan(apart) else 360.0 * np.rint(apart / 360.0)
    return shapely.transform(shape, lambda xy: np.add(xy, (turn, 0.0))) if turn else shape


def _literal(shape: Any) -> str:
    if (np.abs(shapely.bounds(shape)[[0, 2]]) > 180.0).any():
        shape = shapely.transform(
            shape, lambda xy: np.column_stack([(xy[:, 0] + 180.0) % 360.0 - 180.0, xy[:, 1]])
        )
    (shape,) = split(np.array([shape]))
    return f"<{CRS84}> {shapely.to_wkt(shape, rounding_precision=9)}"


def _need_metres(unit: str) -> None:
    if unit not in METRE_IRIS:
        raise FormatError(f"Unit <{unit}> is not known here.", hint=f"Use <{METRE_IRIS[0]}>.")


def distance(first: str, second: str, unit: str = METRE_IRIS[0]) -> float:
    """`geof:distance`: shortest way between two geometries, metres on the ellipsoid."""
    _need_metres(unit)
    near = shapely.shortest_line(*_side_by_side([first, second]))
    (lon0, lat0), (lon1, lat1) = shapely.get_coordinates(near).tolist()
    return float(GEOD.inv(lon0, lat0, lon1, lat1)[2])


def metric_length(literal: str) -> float:
    """`geof:metricLength`: metres on the ellipsoid."""
    return float(GEOD.geometry_length(_shape(literal)))


def metric_area(literal: str) -> float:
    """`geof:metricArea`: square metres on the ellipsoid."""
    return abs(float(GEOD.geometry_area_perimeter(shapely.orient_polygons(_shape(literal)))[0]))


def buffer(literal: str, radius: float, unit: str = METRE_IRIS[0]) -> str:
    """`geof:buffer`: grown by a radius in metres, in the UTM zone of the place."""
    _need_metres(unit)
    west, south, east, north = shapely.bounds(_shape(literal)).tolist()
    crs = utm_crs((west + east) / 2, (south + north) / 2)
    grown = shapely.buffer(reproject(_shape(literal), LONLAT, crs), float(radius), quad_segs=16)
    return _literal(reproject(grown, crs, LONLAT))


def _relation(name: str) -> tuple[Callable[..., Value], str]:
    test = getattr(shapely, name)
    return lambda *literals: bool(test(*_side_by_side(literals))), BOOLEAN


def _operation(name: str) -> tuple[Callable[..., Value], str]:
    work = getattr(shapely, name)
    return lambda *literals: _literal(work(*_side_by_side(literals))), expand("geo:wktLiteral")


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
