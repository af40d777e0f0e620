"""WKT literals: geometries with their CRS, axes put into geofield's order."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS, Transformer
from shapely.errors import ShapelyError

from geofield.crs import transformer
from geofield.errors import FormatError
from geofield.formats.rdf.namespaces import CRS84, crs_of_iri, northing_first

_LITERAL = re.compile(r"\s*(?:<([^>]*)>)?\s*(.*)", re.DOTALL)


def split_literal(text: str) -> tuple[str, str]:
    """The CRS's IRI (CRS84 where none is named, as GeoSPARQL has it) and the WKT."""
    match = _LITERAL.fullmatch(text)
    return ((match[1] or CRS84), match[2]) if match else (CRS84, text)


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
    if northing_first(crs):
        geometry = shapely.transform(geometry, lambda c: c[:, ::-1])
    return geometry, crs


def _with(project: Transformer) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    return lambda c: np.column_stack(project.transform(c[:, 0], c[:, 1]))


def geometries_of(
    texts: Sequence[str | None], subjects: Sequence[str], target: CRS
) -> NDArray[np.object_]:
    """WKT literals as geometries in one CRS; None stays None."""
    result = np.full(len(texts), None, dtype=object)
    by_crs: dict[str, list[int]] = {}
    for index, text in enumerate(texts):
        if text is None:
            continue
        geometry, crs = geometry_of(text, subjects[index])
        result[index] = geometry
        if crs != target:
            by_crs.setdefault(crs.to_wkt(), []).append(index)
    for wkt, rows in by_crs.items():
        project = transformer(CRS.from_wkt(wkt), target)
        result[rows] = shapely.transform(result[rows], _with(project))
    for index, text in enumerate(texts):
        if text is not None and not np.isfinite(shapely.get_coordinates(result[index])).all():
            raise FormatError(f"<{subjects[index]}>: its coordinates are not a place on earth.")
    return result
