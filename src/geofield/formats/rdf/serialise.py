"""Serialiser: what the four syntaxes share, and the stream that feeds them."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from typing import Any

import pyarrow as pa

from geofield.formats.rdf.nodes import Group, Nodes, Property, join_rows, text_of

#: Nodes that are joined to text at once: bounds the memory, whatever the plan's size.
ROWS_AT_ONCE = 8192
_LOCAL_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


class Serialiser(ABC):
    """Text of groups of nodes in one syntax.

    Parameters
    ----------
    base : str
        Data IRIs that start with it may be written relative to it.
    prefixes : dict
        Prefix to namespace.
    """

    def __init__(self, base: str, prefixes: dict[str, str]) -> None:
        self.base = base
        self.prefixes = prefixes

    @abstractmethod
    def head(self) -> str:
        """What comes before the first node."""

    @abstractmethod
    def rows(self, nodes: Nodes) -> list[Any]:
        """Texts and columns that, joined row by row, are the nodes' text."""

    def group_rows(self, group: Group) -> Any:
        """The text of each row of a group: its nodes one after the other."""
        parts = [part for nodes in group for part in self.rows(nodes)]
        return join_rows(parts)

    def tail(self) -> str:
        """What comes after the last node."""
        return ""

    def stream(self, groups: Iterable[Group]) -> Iterator[bytes | memoryview]:
        """The whole document, in pieces."""
        yield self.head().encode()
        for piece in pieces(groups):
            yield text_of(self.group_rows(piece))
        yield self.tail().encode()

    # -- shared by the syntaxes -------------------------------------------------------

    def compact(self, iri: str) -> str | None:
        """The prefixed name of an IRI, None where it has none."""
        for prefix, namespace in self.prefixes.items():
            if iri.startswith(namespace) and _LOCAL_NAME.fullmatch(iri[len(namespace) :]):
                return f"{prefix}:{iri[len(namespace) :]}"
        return None

    def relative(self, iris: Any) -> Any:
        """IRIs with the base cut off where they start with it."""
        return _without_prefix(iris, self.base)


def pieces(groups: Iterable[Group]) -> Iterator[Group]:
    """Groups cut into groups of a bounded number of rows; empty ones are dropped."""
    for group in groups:
        for start in range(0, len(group[0]), ROWS_AT_ONCE):
            yield tuple(nodes.cut(start, ROWS_AT_ONCE) for nodes in group)


def escaped(prop: Property, escape: Any) -> tuple[Any, ...]:
    """A property's columns with a Python function applied to free text."""
    if not prop.free_text:
        return prop.columns
    return tuple(
        pa.array([None if v is None else escape(v) for v in column.to_pylist()], pa.string())
        for column in prop.columns
    )


def _without_prefix(column: Any, prefix: str) -> Any:
    import pyarrow.compute as pc

    starts = pc.starts_with(column, prefix)
    cut = pc.utf8_slice_codeunits(column, len(prefix))
    return pc.if_else(starts, cut, column)
