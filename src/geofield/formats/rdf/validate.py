"""Validate: an RDF file against syntax, shapes and checks, told in plain words."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pyoxigraph as ox
import rdflib
from rdflib.namespace import RDF, SH

from geofield.errors import FormatError
from geofield.formats.rdf.checks import check_graph
from geofield.formats.rdf.graph import as_rdflib
from geofield.formats.rdf.layers import classes, layer_maps
from geofield.formats.rdf.namespaces import (
    GEO,
    GML,
    RDFS,
    STUDY_TREE,
    compact,
)
from geofield.formats.rdf.parse import Graph, parse
from geofield.formats.rdf.problem import Problem
from geofield.formats.rdf.quick import QuickCheck
from geofield.formats.rdf.resources import SHAPES, label, resource
from geofield.formats.validation import Finding

_BASE = re.compile(r'(?:@base\s+<|BASE\s+<|xml:base\s*=\s*"|"@base"\s*:\s*")([^">]*)[">]')

_GEOMETRY_LINKS = frozenset({GEO + "hasGeometry", GEO + "hasDefaultGeometry"})
_SUBCLASS = RDFS + "subClassOf"
_TRIPLES_AT_ONCE = 20_000


def validate(path: Path) -> list[Problem]:
    """Everything that is wrong with a file, in the order of its lines.

    Parameters
    ----------
    path : Path
        RDF/XML, Turtle, JSON-LD or N-Triples.

    Returns
    -------
    list of Problem
        Empty when the file is sound. A file that is hostile or not valid in its syntax has
        one problem: nothing more can be said of it.
    """
    path = Path(path)
    try:
        quads = list(parse(path))
    except FormatError as error:
        line = re.search(r"line (\d+)", error.message)
        message = error.message.split(": ", 1)[-1]
        return [
            Problem(
                message[0].upper() + message[1:],
                path.name,
                int(line[1]) if line else None,
                error.hint or "",
                "syntax",
            )
        ]
    graph = Graph()
    graph.add(quads)
    known = [iri for layer in layer_maps() for iri in classes(layer)]
    known += [STUDY_TREE + "tree", GML + "point"]
    if not graph.of_type(*known):
        return [Problem("It holds no field, obstacle or track.", path.name, rule="empty")]
    problems = [*_shape_problems(quads), *check_graph(graph)]
    return _located(_distinct(problems), path)


def check(path: Path) -> Iterator[Finding]:
    """The problems of a file as findings: what `geofield validate` shows."""
    for problem in validate(path):
        yield Finding("error", problem.place, problem.words)


def _distinct(problems: list[Problem]) -> list[Problem]:
    return list(dict.fromkeys(problems))


# -- SHACL ----------------------------------------------------------------------------------------


def _shape_problems(quads: list[ox.Quad]) -> Iterator[Problem]:
    for batch in _batches(quads):
        yield from _run_shapes(as_rdflib(batch))


def _batches(quads: list[ox.Quad]) -> Iterator[list[ox.Quad]]:
    """What is not plainly sound, in parts that can be checked on their own.

    No shape looks further than from a feature to its geometry, and rdflib needs a kilobyte
    for each triple: a large plan would not fit into memory at once.
    """
    if any(quad.predicate.value == _SUBCLASS for quad in quads):
        # Classes of the file's own: only all triples together tell whose shapes apply.
        yield quads
        return
    nodes: dict[Any, dict[str, list[Any]]] = {}
    for quad in quads:
        node = nodes.setdefault(quad.subject, {})
        node.setdefault(quad.predicate.value, []).append(quad.object)
    unsure = _quick_check().unsure(nodes)
    owners = {
        quad.object: quad.subject for quad in quads if quad.predicate.value in _GEOMETRY_LINKS
    }
    wanted = {owners.get(subject, subject) for subject in unsure}
    parts: dict[Any, list[ox.Quad]] = {}
    for quad in quads:
        owner = owners.get(quad.subject, quad.subject)
        if owner in wanted:
            parts.setdefault(owner, []).append(quad)
    batch: list[ox.Quad] = []
    for part in parts.values():
        batch += part
        if len(batch) >= _TRIPLES_AT_ONCE:
            yield batch
            batch = []
    if batch:
        yield batch


def _run_shapes(data: rdflib.Graph) -> Iterator[Problem]:
    import pyshacl

    conforms, report, _ = pyshacl.validate(
        data, shacl_graph=_shapes(), inference="none", meta_shacl=False, advanced=False
    )
    if conforms:
        return
    if not isinstance(report, rdflib.Graph):
        raise FormatError(f"The shapes could not be run: {report!r}.")
    for result in report.subjects(RDF.type, SH.ValidationResult):
        yield _problem(report, result)


@cache
def _quick_check() -> QuickCheck:
    return QuickCheck(_shapes())


@cache
def _shapes() -> rdflib.Graph:
    return rdflib.Graph().parse(data=resource(SHAPES), format="turtle")


def _problem(report: rdflib.Graph, result: Any) -> Problem:
    focus = report.value(result, SH.focusNode)
    path = report.value(result, SH.resultPath)
    value = report.value(result, SH.value)
    component = str(report.value(result, SH.sourceConstraintComponent)).rpartition("#")[2]
    rule = str(report.value(result, SH.resultMessage) or "")
    name = compact(str(path)) if isinstance(path, rdflib.URIRef) else "its default geometry"
    what = f"{label(name).lower()} ({name})" if label(name) else name
    found = "" if value is None else str(value)[:80]
    words = {
        "MinCountConstraintComponent": f"Has no {what}.",
        "MaxCountConstraintComponent": f"Has more than one {what}.",
        "DatatypeConstraintComponent": f"Its {what} is {_typed(value)}.",
        "NodeKindConstraintComponent": f"Its {what} is {found!r}, which is no IRI.",
        "InConstraintComponent": f"Its {what} is {compact(str(value))!r}, which is not allowed.",
        "MinInclusiveConstraintComponent": f"Its {what} is {found}, out of bounds.",
        "MaxInclusiveConstraintComponent": f"Its {what} is {found}, out of bounds.",
        "PatternConstraintComponent": f"Its {what} reads {found!r}.",
        "HasValueConstraintComponent": f"Its {what} is not the one expected.",
        "OrConstraintComponent": f"Its {what} is {_typed(value)}.",
    }
    message = words.get(component, f"Its {what} is {found!r}.")
    subject = f"<{focus}>" if isinstance(focus, rdflib.URIRef) else f"_:{focus}"
    if path is None and component == "NodeKindConstraintComponent":
        message, rule = "It has no IRI.", "Name it, or it cannot be merged with other data."
    shape = f"{component.removesuffix('ConstraintComponent')} {name}"
    return Problem(message, subject, hint=rule, rule=shape)


def _typed(value: Any) -> str:
    if isinstance(value, rdflib.Literal):
        kind = "untyped" if value.datatype is None else compact(str(value.datatype))
        if value.ill_typed:
            return f"{str(value)[:80]!r}, which is no {kind}"
        return f"{str(value)[:80]!r}, typed {kind}"
    return f"the thing {value}"


# -- where in the file ------------------------------------------------------------------------


def _located(problems: list[Problem], path: Path) -> list[Problem]:
    """The line at which each problem's subject is described first."""
    if not problems:
        return []
    lines = _Lines(path.read_text(encoding="utf-8", errors="replace"))
    placed = [
        Problem(p.message, p.subject, p.line or lines.of(p.subject), p.hint, p.rule)
        for p in problems
    ]
    return sorted(placed, key=lambda p: (p.line is None, p.line or 0, p.subject, p.rule))


class _Lines:
    """Finds the description of an IRI in a file's text, absolute or relative."""

    def __init__(self, text: str) -> None:
        self.text = text
        match = _BASE.search(text[:20_000])
        self.base = match[1] if match else ""
        self.found: dict[str, int | None] = {}

    def of(self, subject: str) -> int | None:
        iri = subject.removeprefix("<").removesuffix(">")
        if iri not in self.found:
            self.found[iri] = self._search(iri)
        return self.found[iri]

    def _search(self, iri: str) -> int | None:
        names = [iri]
        if self.base and iri.startswith(self.base):
            names.insert(0, iri[len(self.base) :])
        names += [f"{p}:{iri[len(n) :]}" for p, n in self._prefixes() if iri.startswith(n)]
        for name in names:
            text = re.escape(name)
            subject = rf'^\s*<{text}>|^\s*{text}\s|about="{text}"|^\s*\{{\s*"@id": *"{text}"'
            for pattern in (subject, rf'[<"\s]{text}[>"\s]'):
                match = re.search(pattern, self.text, re.MULTILINE)
                if match:
                    start = match.start() + len(match[0]) - len(match[0].lstrip())
                    return self.text.count("\n", 0, start) + 1
        return None

    def _prefixes(self) -> list[tuple[str, str]]:
        return re.findall(r"@?prefix\s+([\w-]*):\s*<([^>]*)>", self.text[:20_000], re.IGNORECASE)
