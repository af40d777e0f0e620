"""WKT literals: geometries with their CRS, axes put into geofield's order."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS
from shapely.errors import ShapelyError

from geofield.crs import northing_first, reproject
from geofield.errors import FormatError
from geofield.formats.rdf.namespaces import CRS84, crs_of_iri


def split_literal(text: str) -> tuple[str, str]:
    """The CRS's IRI (CRS84 where none is named, as GeoSPARQL has it) and the WKT."""
    iri, found, wkt = text.partition(">")
    return (iri.lstrip()[1:], wkt) if found and iri.lstrip()[:1] == "<" else (CRS84, text)


@lru_cache(maxsize=64)
def known_crs(iri: str) -> CRS:
    """The CRS of an IRI.

    Raises
    ------
    FormatError
        When it is not known.
    """
    crs = crs_of_iri(iri)
    if crs is None:
        raise FormatError(
            f"The coordinate reference system <{iri}> is not known.",
            hint=f"Use <{CRS84}> or <http://www.opengis.net/def/crs/EPSG/0/...>.",
        )
    return crs


def geometry_of(text: str, subject: str) -> tuple[Any, CRS]:
    """One WKT literal as a geometry (x before y) and its CRS.

    Raises
    ------
    FormatError
        Names the subject.
    """
    iri, wkt = split_literal(text)
    try:
        geometry = shapely.from_wkt(wkt)
    except ShapelyError as error:
        raise FormatError(f"<{subject}>: {wkt[:60]!r} is not WKT ({error}).") from error
    try:
        crs = known_crs(iri)
    except FormatError as error:
        raise FormatError(f"<{subject}>: {error.message}", hint=error.hint) from error
    if not np.isfinite(shapely.get_coordinates(geometry)).all():
        raise FormatError(f"<{subject}>: a coordinate is not a finite number.")
    return in_order(geometry, crs), crs


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
        iri = split_literal(known[0])[0]
        try:
            crs = known_crs(iri)
            shapes = shapely.from_wkt([text[len(head) :] for text in known])
            finite = bool(np.isfinite(shapely.get_coordinates(shapes)).all())
        except (ShapelyError, FormatError):
            finite = False
        if not finite:
            # One by one, to name the one that is at fault.
            shapes = np.array(
                [geometry_of(t, subjects[r])[0] for t, r in zip(known, rows, strict=True)]
            )
            crs = known_crs(iri)
        else:
            shapes = in_order(shapes, crs)
        result[rows] = reproject(shapes, crs, target)
    lost = ~np.isfinite(shapely.bounds(result)).all(axis=1) & ~shapely.is_empty(result)
    for row in np.flatnonzero(lost & ~shapely.is_missing(result)).tolist():
        raise FormatError(f"<{subjects[row]}>: its coordinates are not a place on earth.")
    return result
