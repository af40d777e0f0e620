"""Triples: columns of terms as RDF, row by row, so that a million rows stream.

All nodes of one kind have the same predicates in one order; only their values differ. A value
is a term, a tuple of terms, or None where a row has none.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import pyoxigraph as ox

from geofield.formats.rdf.namespaces import BOOLEAN, DOUBLE, INTEGER, node
from geofield.formats.xml import NOT_IN_XML

#: Nodes of equal length that belong together row by row: a feature and its geometries.
Group = tuple["Nodes", ...]
_DAY = re.compile(r"\d{4}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])")
_DATATYPES = {bool: BOOLEAN, int: INTEGER, float: DOUBLE}


class Texts(list[Any]):
    """Texts of one datatype (a prefixed name), IRIs without one; terms when asked for."""

    __slots__ = ("datatype",)

    def __init__(self, texts: Iterable[str | None], datatype: str | None = None) -> None:
        super().__init__(texts)
        self.datatype = node(datatype) if datatype else None


#: Values of a predicate: a term that all rows have, texts, or of each row its value.
Values = ox.NamedNode | ox.Literal | Texts | Sequence[Any] | None
Column = tuple[ox.NamedNode, Values]


@dataclass(frozen=True, slots=True)
class Nodes:
    """Descriptions of one shape: their IRIs, and a column for each predicate."""

    subjects: Texts
    columns: Sequence[Column]


def terms(values: Values, count: int) -> Sequence[Any]:
    """The value of each row."""
    if isinstance(values, Texts):
        kind = values.datatype
        made = ox.NamedNode if kind is None else partial(ox.Literal, datatype=kind)
        return [None if text is None else made(text) for text in values]
    return values if isinstance(values, Sequence) else [values] * count


def triples(groups: Iterable[Group]) -> Iterator[ox.Triple]:
    """The triples of groups, row by row: a feature, then its geometries, then the next."""
    for group in groups:
        count = len(group[0].subjects)
        columns = [
            (subjects, predicate, terms(values, count))
            for each in group
            for subjects in [terms(each.subjects, count)]
            for predicate, values in each.columns
        ]
        for row in range(count):
            for subjects, predicate, values in columns:
                value = values[row]
                for each in value if type(value) is tuple else (value,):
                    if each is not None:
                        yield ox.Triple(subjects[row], predicate, each)


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
    columns: list[Column] = [(node("rdf:type"), [tuple(map(node, types.split()))])]
    for name, value in properties.items():
        if value is not None and value != "":
            columns.append((node(name.replace("_", ":", 1)), [term(value)]))
    return (Nodes(Texts([iri]), columns),)


def term(value: Any) -> Any:
    """A Python value as a term; terms as they are. What XML cannot carry stands in no syntax."""
    kind = _DATATYPES.get(type(value))
    if kind is not None:
        text = str(value).lower() if kind == BOOLEAN else repr(value)
        return ox.Literal(text, datatype=node(kind))
    return ox.Literal(NOT_IN_XML.sub("\ufffd", value)) if isinstance(value, str) else value


def date_term(text: str) -> ox.Literal:
    """A day as a date; a text where only the year or month is known."""
    return ox.Literal(text, datatype=node("xsd:date")) if _DAY.fullmatch(text) else term(text)
