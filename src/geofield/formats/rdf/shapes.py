"""Shapes: the SHACL of ``data/shapes.ttl``, run over pyoxigraph's terms and told in plain words.

pySHACL takes a millisecond for each node and a kilobyte for each triple, and a plan may have
tens of thousands of points. The constraints that the shapes use are compiled to functions once;
tests hold the findings against pySHACL's.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache, lru_cache
from typing import Any

import pyoxigraph as ox

from geofield.errors import FormatError
from geofield.formats.rdf.graph import label
from geofield.formats.rdf.namespaces import SH, SHAPES, TYPE, XSD, compact, expand, resource
from geofield.formats.rdf.parse import Problem

Node = dict[str, list[Any]]
#: The values of a path that break a constraint; None for one that is missing.
Test = Callable[[list[Any]], list[Any]]
#: Predicates one behind another; nothing means the node itself.
PropertyPath = tuple[str, ...]
#: Message, constraint and test.
Rule = tuple[str, str, Test]
#: Texts that are of a datatype.
_LEXICAL = {
    XSD + "double": r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?|[+-]?INF|NaN",
    XSD + "integer": r"[+-]?\d+",
    XSD + "int": r"[+-]?\d{1,10}",
    XSD + "boolean": r"true|false|1|0",
    XSD + "date": r"-?\d{4,}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])(Z|[+-]\d\d:\d\d)?",
}
_LEXICAL |= dict.fromkeys((XSD + "decimal", XSD + "float"), _LEXICAL[XSD + "double"])
_NUMBERS = [XSD + name for name in ("double", "integer", "int", "decimal", "float")]


def shape_problems(quads: Iterable[ox.Quad]) -> Iterator[Problem]:
    """Everything in a graph that breaks a shape of its class or a class above it."""
    nodes = _nodes(quads)
    for subject, node in nodes.items():
        types = _with_parents(node.get(TYPE, ()), nodes)
        for path, rules in _rules_of(tuple(types)):
            values = list(dict.fromkeys([subject] if not path else _values(node, path, nodes)))
            for message, constraint, test in rules:
                for value in test(values):
                    yield _problem(subject, path, constraint, value, message)


def _nodes(quads: Iterable[ox.Quad]) -> dict[Any, Node]:
    """What is said of each subject, by predicate."""
    nodes: dict[Any, Node] = {}
    # A graph is a set: what a file says a thousand times counts once.
    for subject, predicate, value, _ in dict.fromkeys(quads):
        nodes.setdefault(subject, {}).setdefault(predicate.value, []).append(value)
    return nodes


def _with_parents(types: Iterable[Any], nodes: dict[Any, Node]) -> list[str]:
    """Classes, and those above them where the file has classes of its own."""
    found = list(types)
    for each in found:
        above = nodes.get(each, {}).get(expand("rdfs:subClassOf"), ())
        found += [parent for parent in above if parent not in found]
    return [each.value for each in found if isinstance(each, ox.NamedNode)]


def _values(node: Node, path: PropertyPath, nodes: dict[Any, Node]) -> list[Any]:
    values = node.get(path[0], [])
    for predicate in path[1:]:
        values = [v for each in values for v in nodes.get(each, {}).get(predicate, [])]
    return values


@lru_cache(maxsize=256)
def _rules_of(types: tuple[str, ...]) -> list[tuple[PropertyPath, list[Rule]]]:
    """What is asked of a node of some classes, path by path: values are looked up once."""
    by_path: dict[PropertyPath, list[Rule]] = {}
    for each in types:
        for path, rule in _rules().get(each, ()):
            by_path.setdefault(path, []).append(rule)
    return list(by_path.items())


@cache
def _rules() -> dict[str, list[tuple[PropertyPath, Rule]]]:
    """Path and rule of everything that is asked, by the class it is for."""
    graph = _nodes(ox.parse(resource(SHAPES), ox.RdfFormat.TURTLE))
    rules: defaultdict[str, list[tuple[PropertyPath, Rule]]] = defaultdict(list)
    words = "Name it, or it cannot be merged with other data."
    is_named: tuple[PropertyPath, Rule] = ((), (words, "nodeKind", _each(_is_iri)))
    for shape in graph.values():
        for cls in shape.get(SH + "targetClass", ()):
            for prop in shape[SH + "property"]:
                rules[cls.value].extend(_compiled(graph, graph[prop]))
            rules[cls.value] += [is_named] * (SH + "nodeKind" in shape)
    return rules


def _compiled(graph: dict[Any, Node], shape: Node) -> Iterator[tuple[PropertyPath, Rule]]:
    (first,) = shape[SH + "path"]
    path = tuple(term.value for term in (_items(graph, first) or [first]))
    message = shape[SH + "message"][0].value
    for predicate, (value, *_) in shape.items():
        name = predicate.removeprefix(SH)
        if name not in ("path", "message", "flags"):
            yield path, (message, name, _test(graph, name, value, shape))


def _items(graph: dict[Any, Node], head: Any) -> list[Any]:
    items = []
    while expand("rdf:first") in graph.get(head, {}):
        items += graph[head][expand("rdf:first")]
        (head,) = graph[head][expand("rdf:rest")]
    return items


def _test(graph: dict[Any, Node], name: str, value: Any, shape: Node) -> Test:
    """One constraint as a function from values to those that break it."""
    if name == "minCount":
        return lambda values: [] if len(values) >= int(value.value) else [None]
    if name == "maxCount":
        return lambda values: [] if len(values) <= int(value.value) else [None]
    if name == "hasValue":
        return lambda values: [] if value in values else [None]
    if name == "or":
        kinds = [graph[each][SH + "datatype"][0].value for each in _items(graph, value)]
        return _each(lambda term: _is_of(term, kinds))
    if name == "nodeKind":
        return _each(_is_iri)
    if name == "datatype":
        return _each(lambda term: _is_of(term, (value.value,)))
    if name in ("minInclusive", "maxInclusive"):
        sign, bound = (1.0 if name == "minInclusive" else -1.0), float(value.value)
        return _each(
            lambda term: _is_of(term, _NUMBERS) and sign * float(term.value) >= sign * bound
        )
    if name == "in":
        allowed = set(_items(graph, value))
        return _each(lambda term: term in allowed)
    if name == "pattern":
        pattern = re.compile(value.value, re.IGNORECASE if SH + "flags" in shape else 0)
        return _each(lambda term: pattern.search(term.value) is not None)
    raise FormatError(f"The shapes use sh:{name}, which is not known here.")


def _each(test: Callable[[Any], bool]) -> Test:
    return lambda values: [value for value in values if not test(value)]


def _is_iri(term: Any) -> bool:
    return isinstance(term, ox.NamedNode)


def _is_of(term: Any, kinds: Sequence[str]) -> bool:
    """Whether a term is a literal of one of some datatypes, and its text one."""
    kind = term.datatype.value if isinstance(term, ox.Literal) else ""
    return kind in kinds and re.fullmatch(_LEXICAL.get(kind, "(?s:.*)"), term.value) is not None


def _problem(subject: Any, path: PropertyPath, name: str, value: Any, rule: str) -> Problem:
    """What is wrong, in plain words; the rule that it breaks as the hint."""
    shown = f"<{subject.value}>" if isinstance(subject, ox.NamedNode) else f"_:{subject.value}"
    if not path:
        return Problem("It has no IRI.", shown, hint=rule, rule="nodeKind")
    term = compact(path[0]) if len(path) == 1 else "its default geometry"
    what = f"{label(term).lower()} ({term})" if label(term) else term
    found = "" if value is None else value.value[:80]
    words = {
        "minCount": f"Has no {what}.",
        "maxCount": f"Has more than one {what}.",
        "nodeKind": f"Its {what} is {found!r}, which is no IRI.",
        "in": f"Its {what} is {compact(found)!r}, which is not allowed.",
        "minInclusive": f"Its {what} is {found}, out of bounds.",
        "maxInclusive": f"Its {what} is {found}, out of bounds.",
        "pattern": f"Its {what} reads {found!r}.",
        "hasValue": f"Its {what} is not the one expected.",
    }
    message = words.get(name, f"Its {what} is {_typed(value)}.")
    return Problem(message, shown, hint=rule, rule=f"{name} {term}")


def _typed(value: Any) -> str:
    if not isinstance(value, ox.Literal):
        return f"the thing {value}"
    kind = value.datatype.value
    words = "typed" if _is_of(value, (kind,)) else "which is no"
    return f"{value.value[:80]!r}, {words} {compact(kind)}"
