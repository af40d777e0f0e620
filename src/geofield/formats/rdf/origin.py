"""Origin: provenance, grid and picture, read back from the nodes that tell them."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

from affine import Affine

from geofield.crs import parse_crs
from geofield.errors import FormatError
from geofield.formats.rdf.graph import Graph
from geofield.formats.rdf.scope import Scope
from geofield.grid import Grid
from geofield.model.dataset import Provenance
from geofield.model.scene import ImagerySource

_ANEW = "Export the plan anew, or take that statement out of the file."


def read_provenance(graph: Graph, scope: Scope) -> Provenance:
    """Software, picture, settings and evidence of the run behind the survey and plan meant."""
    owners = (scope.plan, scope.survey, *graph.of_type("dcat:Dataset", "gf:TrackPlan"))
    run = _first(graph, owners, "prov:wasGeneratedBy")
    return Provenance(
        graph.value(run, "prov:wasAssociatedWith", "rdfs:label") or "",
        _source(graph, _picture(graph, scope)),
        _json(graph, run, "gf:settings", {}),
        _json(graph, run, "gf:evidence", {}),
    )


def read_grid(graph: Graph, scope: Scope) -> Grid | None:
    """The grid of the picture, None where the file does not tell it."""
    picture = _picture(graph, scope)
    width = graph.value(picture, "gf:widthInPixels")
    height = graph.value(picture, "gf:heightInPixels")
    transform = graph.value(picture, "gf:geoTransform")
    crs = graph.value(picture, "gf:gridCrs")
    if width is None or height is None or transform is None or crs is None:
        return None
    try:
        return Grid(int(width), int(height), Affine(*map(float, transform.split())), parse_crs(crs))
    except (ValueError, TypeError) as error:
        raise FormatError(
            f"<{picture}>: its grid cannot be understood ({error}).", hint=_ANEW
        ) from error


def read_scene_name(graph: Graph, scope: Scope) -> str | None:
    """The name of the picture's file, None where the file does not tell it."""
    return graph.value(_picture(graph, scope), "gf:fileName")


def _picture(graph: Graph, scope: Scope) -> str | None:
    owners = (scope.survey, *graph.of_type("dcat:Dataset"), *graph.of_type("gf:Field"))
    return _first(graph, owners, "prov:wasDerivedFrom")


def _first(graph: Graph, owners: Iterable[str | None], predicate: str) -> str | None:
    return next((v for v in (graph.value(owner, predicate) for owner in owners) if v), None)


def _source(graph: Graph, picture: str | None) -> ImagerySource:
    if picture is None:
        return ImagerySource()
    zoom = graph.value(picture, "gf:zoom")
    details = _json(graph, picture, "gf:details", [])
    return ImagerySource(
        graph.value(picture, "rdfs:label") or "",
        graph.value(picture, "dcterms:created"),
        graph.value(picture, "cc:attributionName") or "",
        graph.value(picture, "dc:rights") or "",
        graph.value(picture, "gf:mayDerive") != "false",
        graph.value(picture, "gf:mayCache") != "false",
        int(zoom) if zoom and zoom.isdecimal() else None,
        tuple((str(key), str(value)) for key, value in details),
    )


def _json(graph: Graph, subject: str | None, predicate: str, default: Any) -> Any:
    text = graph.value(subject, predicate) if subject else None
    if text is None:
        return default
    try:
        value = json.loads(text)
    except ValueError as error:
        raise FormatError(
            f"<{subject}>: <{predicate}> is not JSON ({error}).", hint=_ANEW
        ) from error
    return value if isinstance(value, type(default)) else default
