"""Origin: provenance, grid and picture, read back from the nodes that tell them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from affine import Affine

from geofield.crs import parse_crs
from geofield.errors import FormatError
from geofield.formats.rdf.namespaces import CC, DC, DCAT, DCTERMS, GF, LABEL, PROV
from geofield.formats.rdf.parse import Graph
from geofield.grid import Grid
from geofield.model.dataset import Provenance
from geofield.model.scene import ImagerySource


def read_provenance(graph: Graph, plan: str | None) -> Provenance:
    """Software, picture, settings and evidence of the run behind the data.

    Parameters
    ----------
    graph : Graph
    plan : str or None
        The track plan whose run is meant, where there are several.
    """
    run = _run(graph, plan)
    software = ""
    if run is not None:
        agent = graph.value(run, PROV + "wasAssociatedWith")
        software = (graph.value(agent, LABEL) if agent else None) or ""
    return Provenance(
        software,
        _source(graph),
        _json(graph, run, GF + "settings", {}),
        _json(graph, run, GF + "evidence", {}),
    )


def read_grid(graph: Graph) -> Grid | None:
    """The grid of the picture, None where the file does not tell it."""
    picture = _picture(graph)
    if picture is None:
        return None
    width = graph.value(picture, GF + "widthInPixels")
    height = graph.value(picture, GF + "heightInPixels")
    transform = graph.value(picture, GF + "geoTransform")
    crs = graph.value(picture, GF + "gridCrs")
    if width is None or height is None or transform is None or crs is None:
        return None
    try:
        return Grid(int(width), int(height), Affine(*map(float, transform.split())), parse_crs(crs))
    except (ValueError, TypeError) as error:
        raise FormatError(f"<{picture}>: its grid cannot be understood ({error}).") from error


def read_scene_path(graph: Graph, folder: Path) -> Path | None:
    """The picture's file beside the data, where it is there."""
    picture = _picture(graph)
    name = graph.value(picture, GF + "fileName") if picture else None
    # Only a name: a path in somebody else's file must not lead anywhere.
    if name is None or Path(name).name != name:
        return None
    path = folder / name
    return path if path.is_file() else None


def _run(graph: Graph, plan: str | None) -> str | None:
    generated = graph.value(plan, PROV + "wasGeneratedBy") if plan else None
    if generated is not None:
        return generated
    for owner in (*graph.of_type(DCAT + "Dataset"), *graph.of_type(GF + "TrackPlan")):
        run = graph.value(owner, PROV + "wasGeneratedBy")
        if run is not None:
            return run
    return None


def _picture(graph: Graph) -> str | None:
    for owner in (*graph.of_type(DCAT + "Dataset"), *graph.of_type(GF + "Field")):
        picture = graph.value(owner, PROV + "wasDerivedFrom")
        if picture is not None:
            return picture
    return None


def _source(graph: Graph) -> ImagerySource:
    picture = _picture(graph)
    if picture is None:
        return ImagerySource()
    zoom = graph.value(picture, GF + "zoom")
    details = _json(graph, picture, GF + "details", [])
    return ImagerySource(
        graph.value(picture, LABEL) or "",
        graph.value(picture, DCTERMS + "created"),
        graph.value(picture, CC + "attributionName") or "",
        graph.value(picture, DC + "rights") or "",
        graph.value(picture, GF + "mayDerive") != "false",
        graph.value(picture, GF + "mayCache") != "false",
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
        raise FormatError(f"<{subject}>: <{predicate}> is not JSON ({error}).") from error
    return value if isinstance(value, type(default)) else default
