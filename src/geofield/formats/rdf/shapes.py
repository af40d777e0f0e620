"""Shapes: the SHACL of ``data/shapes.ttl``, run over pyoxigraph's terms and told in plain words.

pySHACL takes a millisecond for each node and a kilobyte for each triple, and a plan may have
tens of thousands of points; Oxigraph's store, which SPARQL could ask, forgets how numbers are
typed. Here each constraint that the shapes use is a function; tests hold the findings against
pySHACL's.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from itertools import chain
from typing import Any

import pyoxigraph as ox

from geofield.formats.rdf.graph import Columns, label, number
from geofield.formats.rdf.namespaces import SH, SHAPES, XSD, compact, resource
from geofield.formats.rdf.parse import Problem

#: Values are terms; subjects stand as in N-Triples, so that blank nodes are none of the IRIs.
Terms = Columns[Any]
#: Constraints of all values together; the others are of each.
_OF_ALL = ("minCount", "maxCount", "hasValue")
#: Whether values (or one) keep a constraint.
Test = Callable[[Any], object]
#: Predicates one behind another, the constraints of what they lead to, and these in words.
Property = tuple[tuple[str, ...], dict[str, Test], str]
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
    graph = _terms(quads)
    for cls, properties in _properties().items():
        subjects = _members(graph, cls)
        for subject in subjects:
            if not subject.startswith("<"):
                hint = "Name it, or it cannot be merged with other data."
                yield Problem(subject, "nodeKind", "It has no IRI.", hint)
        for path, tests, message in properties:
            some = path[0] in graph.columns
            told = [(s, graph.values(s, *path) if some else []) for s in subjects]
            for name, holds in tests.items():
                if name in _OF_ALL:
                    broken = [(s, None) for s, values in told if not holds(values)]
                else:
                    broken = [(s, v) for s, values in told for v in values if not holds(v)]
                for subject, value in broken:
                    yield _problem(subject, path, name, value, message)


def _terms(quads: Iterable[Any]) -> Terms:
    graph = Terms()
    graph.add((str(s), p.value, o) for s, p, o, _ in quads)
    return graph


def _members(graph: Terms, cls: str) -> list[str]:
    """The subjects of a class, and of those below it where the file has classes of its own."""
    below = [cls]
    for each in below:
        own = (name for name, above in graph.pairs("rdfs:subClassOf") if str(above) == each)
        below += [name for name in own if name not in below]
    return list(dict.fromkeys(chain.from_iterable(graph.types().get(each, ()) for each in below)))


@cache
def _properties() -> dict[str, list[Property]]:
    """What the shapes ask of the members of each class."""
    graph = _terms(ox.parse(resource(SHAPES), ox.RdfFormat.TURTLE))
    asked: defaultdict[str, list[Property]] = defaultdict(list)
    for shape, cls in graph.pairs("sh:targetClass"):
        for prop in map(str, graph.values(shape, "sh:property")):
            told = {p.removeprefix(SH): c[prop] for p, c in graph.columns.items() if prop in c}
            first, message, flags = (told.pop(name, None) for name in ("path", "message", "flags"))
            path = tuple(term.value for term in (_items(graph, first) or [first]))
            tests = {name: _test(graph, name, told[name], flags) for name in told}
            asked[str(cls)].append((path, tests, message.value))
    return asked


def _items(graph: Terms, head: Any) -> list[Any]:
    first = graph.value(str(head), "rdf:first")
    return [] if first is None else [first, *_items(graph, graph.value(str(head), "rdf:rest"))]


def _test(graph: Terms, name: str, value: Any, flags: Any) -> Test:
    """One constraint as a function of values."""
    items, bound = _items(graph, value), number(value.value) or 0.0
    kinds = [kind.value for each in items for kind in graph.values(str(each), "sh:datatype")]
    tests: dict[str, Test] = {
        "minCount": lambda values: len(values) >= bound,
        "maxCount": lambda values: len(values) <= bound,
        "hasValue": lambda values: value in values,
        "nodeKind": lambda term: isinstance(term, ox.NamedNode),
        "datatype": lambda term: _is_of(term, (value.value,)),
        "or": lambda term: _is_of(term, kinds),
        "in": set(items).__contains__,
        "minInclusive": lambda term: _is_of(term, _NUMBERS) and float(term.value) >= bound,
        "maxInclusive": lambda term: _is_of(term, _NUMBERS) and float(term.value) <= bound,
        "pattern": lambda term: re.search(value.value, term.value, re.I if flags else 0),
    }
    return tests[name]


def _is_of(term: Any, kinds: Sequence[str]) -> bool:
    """Whether a term is a literal of one of some datatypes, and its text one."""
    kind = term.datatype.value if isinstance(term, ox.Literal) else ""
    return kind in kinds and re.fullmatch(_LEXICAL.get(kind, "(?s:.*)"), term.value) is not None


def _problem(subject: str, path: tuple[str, ...], name: str, value: Any, rule: str) -> Problem:
    """What is wrong, in plain words; the rule that it breaks as the hint."""
    term = compact(path[0]) if len(path) == 1 else "default geometry"
    named = label(term).lower().removeprefix("has ")
    what = f"{named} ({term})" if named else term
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
    return Problem(subject, f"{name} {term}", message, rule)


def _typed(value: Any) -> str:
    if not isinstance(value, ox.Literal):
        return f"the thing {value}"
    kind = value.datatype.value
    words = "typed" if _is_of(value, (kind,)) else "which is no"
    return f"{value.value[:80]!r}, {words} {compact(kind)}"
