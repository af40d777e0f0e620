"""Nodes: RDF descriptions by the column, so that a million of them stream quickly.

All nodes of one kind have the same shape (types, then properties in one order); only their
values differ. A :class:`Nodes` holds the values as Arrow string columns, and serialisers
join whole columns to text at once instead of visiting triples one by one.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from geofield.formats.rdf.namespaces import BOOLEAN, DOUBLE, INTEGER, STRING

#: The value is an IRI, not a literal.
IRI = ""
#: Datatypes whose text may hold characters that a syntax has to escape.
FREE_TEXT = frozenset({STRING})


@dataclass(frozen=True, slots=True)
class Property:
    """One predicate with a value (or several) for each node.

    Attributes
    ----------
    predicate : str
        Full IRI.
    datatype : str
        Of the literals, full IRI; `IRI` when the values are IRIs.
    columns : tuple of pyarrow string arrays, each (n,)
        Null where a node has no value. Further columns hold further values and may be
        null only where they end.
    free_text : bool
        Whether the texts may need escaping.
    """

    predicate: str
    datatype: str
    columns: tuple[Any, ...]
    free_text: bool = False

    def cut(self, start: int, length: int) -> Property:
        """The rows from `start` on."""
        return replace(self, columns=tuple(c.slice(start, length) for c in self.columns))


@dataclass(frozen=True, slots=True)
class Nodes:
    """`n` descriptions of one shape.

    Attributes
    ----------
    iris : pyarrow string array (n,)
        Subjects.
    types : tuple of str
        Full IRIs, the most specific first.
    properties : tuple of Property
        Each predicate at most once.
    member_of : str
        A node that has each of these as `rdfs:member`; empty for none.
    """

    iris: Any
    types: tuple[str, ...]
    properties: tuple[Property, ...]
    member_of: str = ""

    def __len__(self) -> int:
        return len(self.iris)

    def cut(self, start: int, length: int) -> Nodes:
        """The rows from `start` on."""
        return replace(
            self,
            iris=self.iris.slice(start, length),
            properties=tuple(p.cut(start, length) for p in self.properties),
        )


#: Nodes of equal length that belong together row by row (a feature and its geometries).
Group = tuple[Nodes, ...]


def strings(values: Iterable[str | None]) -> Any:
    """Texts as a column; None is no value."""
    return pa.array(list(values), pa.string())


def constant(value: str, count: int) -> Any:
    """The same text `count` times."""
    return pa.repeat(pa.scalar(value, pa.string()), count)


def float_texts(values: NDArray[np.float64]) -> Any:
    """The shortest texts that read back to the same doubles; NaN is no value."""
    array = pa.array(np.asarray(values, np.float64), from_pandas=True)
    return pc.cast(array, pa.string())


def joined(*parts: Any) -> Any:
    """Texts and columns joined row by row; null where any of them is null."""
    return pc.binary_join_element_wise(*parts, "")


def join_rows(parts: Sequence[Any]) -> Any:
    """Texts and columns joined row by row; a null counts as nothing."""
    return pc.binary_join_element_wise(*parts, "", null_handling="replace", null_replacement="")


def join_values(columns: Sequence[Any], separator: str) -> Any:
    """Several columns of values as lists; null where there is not one value."""
    lists = columns[0]
    for column in columns[1:]:
        # Not `null_handling="skip"`: it loses the rows in which every column is null.
        lists = pc.coalesce(joined(lists, separator, column), lists)
    return lists


def text_of(rows: Any) -> memoryview:
    """A string column's rows, one after the other, as UTF-8: a view, nothing is copied."""
    if not len(rows):
        return memoryview(b"")
    _, offsets, characters = rows.buffers()
    bounds = np.frombuffer(offsets, np.int32)[[rows.offset, rows.offset + len(rows)]]
    return memoryview(characters)[bounds[0] : bounds[1]]


# -- single nodes, for the few descriptions that are not tables --------------------------------


def one(predicate: str, *values: Any, datatype: str | None = None) -> Property | None:
    """A property of a single node from Python values; None where there is no value.

    The datatype follows the value's Python type; pass `IRI` for IRIs.
    """
    kept = [value for value in values if value is not None and value != ""]
    if not kept:
        return None
    first = kept[0]
    if datatype is None:
        kinds: dict[type, str] = {bool: BOOLEAN, int: INTEGER, float: DOUBLE, str: STRING}
        datatype = kinds[type(first)]
    texts = [str(v).lower() if isinstance(v, bool) else str(v) for v in kept]
    columns = tuple(strings([text]) for text in texts)
    return Property(predicate, datatype, columns, free_text=datatype in FREE_TEXT or not datatype)


def node(iri: str, types: Sequence[str], *properties: Property | None) -> Group:
    """A single node; properties that are None are left out."""
    kept = tuple(p for p in properties if p is not None)
    return (Nodes(strings([iri]), tuple(types), kept),)
