"""Graph: triples by predicate: what the readers and the shapes look things up in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import chain
from typing import Any, Generic, TypeVar, cast

import pyoxigraph as ox

from geofield.formats.rdf.namespaces import ONTOLOGY, TYPE, expand, resource

Value = TypeVar("Value")


@dataclass(slots=True)
class Columns(Generic[Value]):
    """Triples as columns. Classes and predicates are asked for by prefixed name or full IRI."""

    #: Predicate to subject to its first value, in the order of the file.
    columns: dict[str, dict[str, Value]] = field(default_factory=dict)
    #: Predicate to subject to its further values, where it has any.
    more: dict[str, dict[str, list[Value]]] = field(default_factory=dict)
    #: Class to subjects, made when first asked for.
    by_type: dict[str, dict[str, None]] = field(default_factory=dict, repr=False)

    @staticmethod
    def of(quads: Iterable[ox.Quad]) -> Graph:
        """The graph of what a parser tells."""
        graph = Graph()
        graph.add((s.value, p.value, o.value) for s, p, o, _ in quads)
        return graph

    def add(self, triples: Iterable[tuple[str, str, Value]]) -> None:
        """Take in triples: subjects, predicates and values."""
        columns, more = self.columns, self.more
        self.by_type.clear()
        for subject, predicate, value in triples:
            column = columns.get(predicate)
            if column is None:
                column = columns[predicate] = {}
            if column.setdefault(subject, value) is not value:
                more.setdefault(predicate, {}).setdefault(subject, []).append(value)

    def merge(self, other: Columns[Value]) -> None:
        """Take in another graph."""
        self.by_type.clear()
        for predicate, column in other.columns.items():
            mine = self.columns.setdefault(predicate, {})
            if mine.keys().isdisjoint(column):
                mine.update(column)
            else:
                self.add((subject, predicate, value) for subject, value in column.items())
        for predicate, further in other.more.items():
            self.add((s, predicate, value) for s, values in further.items() for value in values)

    def column(self, predicate: str) -> dict[str, Value]:
        """Each subject's first value of a predicate."""
        return self.columns.get(expand(predicate), {})

    def pairs(self, predicate: str) -> Iterator[tuple[str, Value]]:
        """Every subject with every value of a predicate."""
        more = self.more.get(expand(predicate), {})
        further = ((subject, value) for subject, values in more.items() for value in values)
        return chain(self.column(predicate).items(), further)

    def everywhere(self, predicate: str) -> Iterator[Value]:
        """The values of a predicate, whatever the subject."""
        return (value for _, value in self.pairs(predicate))

    def has(self, subject: str) -> bool:
        """Whether anything is said of a subject."""
        return any(subject in column for column in self.columns.values())

    def types(self) -> dict[str, dict[str, None]]:
        """The subjects of each class, by its full name."""
        if not self.by_type:
            for iri, each in self.pairs(TYPE):
                self.by_type.setdefault(str(each), {})[iri] = None
        return self.by_type

    def of_type(self, *types: str) -> list[str]:
        """The subjects of any of some classes, in the order of the file."""
        found = [self.types()[name] for name in map(expand, types) if name in self.types()]
        if len(found) < 2:
            return list(*found)
        every = set().union(*found)
        return [iri for iri in self.column(TYPE) if iri in every]

    def values(self, subject: str | None, *predicates: str) -> list[Value]:
        """All distinct values along a path of predicates; none where there is nothing."""
        found: list[Any] = [subject]
        for name in map(expand, predicates):
            first, more = self.columns.get(name, {}), self.more.get(name, {})
            known = [each for each in map(str, found) if each in first]
            found = [value for each in known for value in (first[each], *more.get(each, ()))]
        return found if len(found) < 2 else list(dict.fromkeys(found))

    def value(self, subject: str | None, *predicates: str) -> Value | None:
        """The first value along a path of predicates, None where there is none."""
        value: Any = subject
        for predicate in predicates:
            value = self.columns.get(expand(predicate), {}).get(value or "")
        return cast("Value | None", value)

    def told(self, subjects: Sequence[str | None], names: Iterable[str]) -> list[Value | None]:
        """Of each subject the first value of any of some properties."""
        found: list[Value | None] = [None] * len(subjects)
        for column in filter(None, map(self.column, names)):
            known = [column.get(subject or "") for subject in subjects]
            found = [new if old is None else old for old, new in zip(found, known, strict=True)]
        return found


#: Triples as plain texts.
Graph = Columns[str]


def number(text: str | None, kind: type[int] | type[float] = float) -> float | None:
    """What a text means as a number; None for what is none, or has no end.

    A whole number may be told as a decimal one, as programs do that have no others.
    """
    try:
        value = math.nan if text is None else float(text)
    except ValueError:
        return None
    if not math.isfinite(value) or (kind is int and not value.is_integer()):
        return None
    return kind(value)


@cache
def ontology() -> Graph:
    """The ontology of the package, in the order of its file."""
    return Graph.of(ox.parse(resource(ONTOLOGY), ox.RdfFormat.TURTLE))


def label(name: str) -> str:
    """What a property is called; empty for one that the ontology does not explain."""
    return (ontology().value(expand(name), "rdfs:label") or "") if ":" in name else ""
