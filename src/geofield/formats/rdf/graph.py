"""Graphs of rdflib: what a Python user gets, and what pySHACL is asked with."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import pyoxigraph as ox
import rdflib

from geofield.formats.rdf.namespaces import STRING


def as_rdflib(
    triples: Iterable[ox.Triple | ox.Quad], prefixes: Mapping[str, str] | None = None
) -> rdflib.Graph:
    """Triples as a graph of rdflib; prefixes are bound for its serialisers."""
    graph = rdflib.Graph()
    for prefix, namespace in (prefixes or {}).items():
        graph.bind(prefix, namespace, replace=True)
    with _quiet_rdflib():
        for each in triples:
            graph.add((_term(each.subject), _term(each.predicate), _term(each.object)))
    return graph


def _term(term: Any) -> Any:
    if isinstance(term, ox.NamedNode):
        return rdflib.URIRef(term.value)
    if isinstance(term, ox.BlankNode):
        return rdflib.BNode(term.value)
    if term.language:
        return rdflib.Literal(term.value, lang=term.language)
    if term.datatype.value == STRING:
        return rdflib.Literal(term.value)
    # rdflib must not tidy the text: "01" and "1" are to be told apart.
    return rdflib.Literal(term.value, datatype=rdflib.URIRef(term.datatype.value), normalize=False)


@contextmanager
def _quiet_rdflib() -> Iterator[None]:
    """Rdflib logs a traceback for each ill-typed literal; the shapes tell it in words."""
    logger = logging.getLogger("rdflib.term")
    before, logger.disabled = logger.disabled, True
    try:
        yield
    finally:
        logger.disabled = before
