"""Resources: the ontology, the shapes and the context that the package ships.

The files in ``data/`` are written by hand and are the source; tests hold the schema's columns
and everything that is written against them.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Any

import pyoxigraph as ox

from geofield.formats.rdf.graph import Graph
from geofield.formats.rdf.namespaces import CONTEXT_TERMS, expand

#: File names in the package's folder ``data``.
ONTOLOGY, SHAPES, CONTEXT = "ontology.ttl", "shapes.ttl", "context.jsonld"


def resource(name: str) -> str:
    """The text of one of the package's files."""
    return (files(__package__) / "data" / name).read_text(encoding="utf-8")


@cache
def ontology() -> Graph:
    """The ontology's triples, in the order of the file."""
    graph = Graph()
    quads = ox.parse(resource(ONTOLOGY), ox.RdfFormat.TURTLE)
    graph.add((s.value, p.value, o.value) for s, p, o, _ in quads)
    return graph


def context() -> dict[str, Any]:
    """The JSON-LD context: prefixes, and a short term with its type for each property."""
    return CONTEXT_TERMS


def label(name: str) -> str:
    """What a property is called; empty for one that the ontology does not explain."""
    return (ontology().value(expand(name), "rdfs:label") or "") if ":" in name else ""
