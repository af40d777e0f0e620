"""Quick check: which nodes plainly keep their shapes, so that pySHACL need not visit them.

A plan has tens of thousands of track points, and pySHACL takes a millisecond for each. Here the
simple constraints are compiled once and tried on pyoxigraph's terms. The answer is "sound" or
"not sure": whatever is not plainly sound, and every class with a constraint that is not known
here, goes to pySHACL, which alone says what is wrong.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pyoxigraph as ox
import rdflib
from rdflib.namespace import RDF, SH, XSD

Node = dict[str, list[Any]]
Test = Callable[[list[Any]], bool]

#: Texts that are beyond doubt of a datatype; others are left to pySHACL.
_LEXICAL = {
    str(XSD.double): re.compile(r"-?[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?"),
    str(XSD.integer): re.compile(r"-?[0-9]+"),
    str(XSD.int): re.compile(r"-?[0-9]{1,9}"),
    str(XSD.boolean): re.compile("true|false"),
    str(XSD.date): re.compile(r"[0-9]{4}-(0[1-9]|1[0-2])-(0[1-9]|1[0-9]|2[0-8])"),
    str(XSD.string): re.compile(r".*", re.DOTALL),
    "http://www.opengis.net/ont/geosparql#wktLiteral": re.compile(r".*", re.DOTALL),
}
_IGNORED = {SH.path, SH.message, SH.flags, RDF.type}


class QuickCheck:
    """Compiled shapes.

    Parameters
    ----------
    shapes : rdflib.Graph
        Node shapes with `sh:targetClass` and property shapes.
    """

    def __init__(self, shapes: rdflib.Graph) -> None:
        self._rules: dict[str, list[tuple[tuple[str, ...], list[Test]]] | None] = {}
        for shape, cls in shapes.subject_objects(SH.targetClass):
            rules, more = self._rules.get(str(cls), []), _compiled(shapes, shape)
            self._rules[str(cls)] = None if rules is None or more is None else rules + more

    def unsure(self, nodes: dict[Any, Node]) -> set[Any]:
        """The subjects that pySHACL has to look at.

        Parameters
        ----------
        nodes : dict
            Subject to predicate IRI to terms.
        """
        return {subject for subject, node in nodes.items() if not self._sound(subject, node, nodes)}

    def _sound(self, subject: Any, node: Node, nodes: dict[Any, Node]) -> bool:
        classes = [t.value for t in node.get(str(RDF.type), ()) if isinstance(t, ox.NamedNode)]
        for cls in classes:
            if cls not in self._rules:
                continue
            rules = self._rules[cls]
            if rules is None or not isinstance(subject, ox.NamedNode):
                return False
            for path, tests in rules:
                values = _values(node, path, nodes)
                if not all(test(values) for test in tests):
                    return False
        return True


def _values(node: Node, path: tuple[str, ...], nodes: dict[Any, Node]) -> list[Any]:
    values = node.get(path[0], [])
    for predicate in path[1:]:
        values = [v for each in values for v in nodes.get(each, {}).get(predicate, [])]
    return values


def _compiled(shapes: rdflib.Graph, shape: Any) -> list[tuple[tuple[str, ...], list[Test]]] | None:
    """A shape's rules; None where one of its constraints is not known here."""
    allowed = {SH.targetClass, SH.nodeKind, SH.property, RDF.type}
    if set(shapes.predicates(shape)) - allowed or shapes.value(shape, SH.nodeKind) != SH.IRI:
        return None
    rules = []
    for prop in shapes.objects(shape, SH.property):
        path = _path(shapes, shapes.value(prop, SH.path))
        tests = [_test(shapes, prop, p, o) for p, o in shapes.predicate_objects(prop)]
        if path is None or None in tests:
            return None
        rules.append((path, [test for test in tests if test is not None and test is not _always]))
    return rules


def _path(shapes: rdflib.Graph, path: Any) -> tuple[str, ...] | None:
    steps = [path] if isinstance(path, rdflib.URIRef) else list(shapes.items(path))
    return tuple(map(str, steps)) if steps and all(_is_iri(step) for step in steps) else None


def _always(values: list[Any]) -> bool:
    return True


def _test(shapes: rdflib.Graph, prop: Any, constraint: Any, value: Any) -> Test | None:
    """One constraint as a function of the values; None where it is not known."""
    if constraint in _IGNORED:
        return _always
    if constraint == SH.minCount:
        least = int(value)
        return lambda values: len(values) >= least
    if constraint == SH.maxCount:
        most = int(value)
        return lambda values: len(values) <= most
    if constraint == SH.nodeKind and value == SH.IRI:
        return _each(lambda term: isinstance(term, ox.NamedNode))
    if constraint == SH.datatype:
        return _each(_of_datatype(str(value)))
    if constraint in (SH.minInclusive, SH.maxInclusive):
        sign = 1.0 if constraint == SH.minInclusive else -1.0
        bound = sign * float(value)
        return _each(lambda term: _is_number(term) and sign * float(term.value) >= bound)
    if constraint == SH["in"]:
        allowed = {_key_of_rdflib(item) for item in shapes.items(value)}
        return _each(lambda term: _key(term) in allowed)
    if constraint == SH.pattern:
        flags = re.IGNORECASE if str(shapes.value(prop, SH.flags)) == "i" else 0
        pattern = re.compile(str(value), flags)
        return _each(lambda term: pattern.search(term.value) is not None)
    return None


def _each(test: Callable[[Any], bool]) -> Test:
    return lambda values: all(test(value) for value in values)


def _of_datatype(datatype: str) -> Callable[[Any], bool]:
    lexical = _LEXICAL.get(datatype)

    def test(term: Any) -> bool:
        return (
            lexical is not None
            and isinstance(term, ox.Literal)
            and term.datatype.value == datatype
            and lexical.fullmatch(term.value) is not None
        )

    return test


def _is_number(term: Any) -> bool:
    return isinstance(term, ox.Literal) and bool(_LEXICAL[str(XSD.double)].fullmatch(term.value))


def _is_iri(term: Any) -> bool:
    return isinstance(term, rdflib.URIRef)


def _key(term: Any) -> tuple[str, str]:
    if isinstance(term, ox.NamedNode):
        return ("", term.value)
    return (term.datatype.value, term.value) if isinstance(term, ox.Literal) else ("_", term.value)


def _key_of_rdflib(term: Any) -> tuple[str, str]:
    if isinstance(term, rdflib.URIRef):
        return ("", str(term))
    return (str(getattr(term, "datatype", None) or XSD.string), str(term))
