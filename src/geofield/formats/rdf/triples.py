"""Triples: columns of terms as RDF, row by row, so that a million rows stream.

All nodes of one kind have the same predicates in one order; only their values differ. A value
is a term, a tuple of terms, or None where a row has none.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, repeat
from typing import Any

import pyoxigraph as ox

from geofield.formats.rdf.namespaces import BOOLEAN, DOUBLE, INTEGER, node
from geofield.formats.xml import NOT_IN_XML

#: Nodes of equal length that belong together row by row: a feature and its geometries.
Group = tuple["Nodes", ...]
#: A value of one row: a term, several, or none.
Value = Any
#: A predicate with a value for each row.
Column = tuple[ox.NamedNode, Sequence[Value]]
_DAY = re.compile(r"\d{4}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])")
_MANY_OR_NONE = {tuple, type(None)}
_DATATYPES = {bool: BOOLEAN, int: INTEGER, float: DOUBLE}


@dataclass(frozen=True, slots=True)
class Nodes:
    """Descriptions of one shape: their subjects, and a column for each predicate."""

    subjects: Sequence[ox.NamedNode]
    columns: Sequence[Column]


class Typed(list[Any]):
    """Texts of one datatype (a prefixed name or IRI), as literals when those are asked for."""

    __slots__ = ("datatype",)

    def __init__(self, texts: Iterable[str | None], datatype: str) -> None:
        super().__init__(texts)
        self.datatype = node(datatype)


def terms(values: Sequence[Value]) -> Sequence[Value]:
    """The terms of a column; None stays none."""
    if not isinstance(values, Typed):
        return values
    kind = values.datatype
    return [None if text is None else ox.Literal(text, datatype=kind) for text in values]


def triples(groups: Iterable[Group]) -> Iterator[ox.Triple]:
    """The triples of groups, row by row: a feature, then its geometries, then the next."""
    triple = ox.Triple
    for group in groups:
        columns = [
            (each.subjects, name, terms(values)) for each in group for name, values in each.columns
        ]
        if not any(_MANY_OR_NONE & set(map(type, values)) for *_, values in columns):
            # One value in every row: no step of Python for each.
            made = (map(triple, s, repeat(p), values) for s, p, values in columns)
            yield from chain.from_iterable(zip(*made, strict=True))
            continue
        for index in range(len(group[0].subjects)):
            for subjects, predicate, values in columns:
                value = values[index]
                for each in value if type(value) is tuple else (value,):
                    if each is not None:
                        yield triple(subjects[index], predicate, each)


def single(iri: str, types: str, **properties: Any) -> Group:
    """One node from Python values; those that are None or empty are left out.

    Parameters
    ----------
    iri : str
    types : str
        Prefixed names, the most specific first, separated by spaces.
    **properties
        Prefixed names with an underscore for the colon: ``gf_inField``.
    """
    columns = [(node("rdf:type"), [tuple(map(node, types.split()))])]
    for name, value in properties.items():
        if value is not None and value != "":
            columns.append((node(name.replace("_", ":", 1)), [term(value)]))
    return (Nodes([ox.NamedNode(iri)], columns),)


def term(value: Any) -> Any:
    """A Python value as a term; terms as they are."""
    kind = _DATATYPES.get(type(value))
    if kind is not None:
        text = str(value).lower() if kind == BOOLEAN else repr(value)
        return ox.Literal(text, datatype=node(kind))
    return text_term(value) if isinstance(value, str) else value


def text_term(text: str) -> ox.Literal:
    """A plain text as a literal; what XML cannot carry stands in no syntax."""
    return ox.Literal(NOT_IN_XML.sub("\ufffd", text))


def date_term(text: str) -> ox.Literal:
    """A day as a date; a text where only the year or month is known."""
    return ox.Literal(text, datatype=node("xsd:date")) if _DAY.fullmatch(text) else text_term(text)


def named(iris: Iterable[str | None]) -> list[Any]:
    """IRIs as terms; None stays none."""
    return [None if iri is None else ox.NamedNode(iri) for iri in iris]
