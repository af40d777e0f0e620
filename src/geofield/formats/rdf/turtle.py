"""Turtle: the syntax for people; one block a node, prefixes, IRIs relative to the base."""

from __future__ import annotations

from typing import Any

from geofield.formats.rdf.namespaces import BOOLEAN, INTEGER, RDFS, STRING
from geofield.formats.rdf.nodes import IRI, Nodes, join_values, joined
from geofield.formats.rdf.ntriples import escape_literal
from geofield.formats.rdf.serialise import Serialiser, escaped


class Turtle(Serialiser):
    """RDF 1.1 Turtle."""

    def head(self) -> str:
        """The base and the prefixes."""
        lines = [f"@base <{self.base}> ."]
        lines += [f"@prefix {prefix}: <{iri}> ." for prefix, iri in self.prefixes.items()]
        return "\n".join(lines) + "\n\n"

    def rows(self, nodes: Nodes) -> list[Any]:
        """A block of predicates per node."""
        subject = self.relative(nodes.iris)
        parts: list[Any] = []
        if nodes.member_of:
            member = self.name(RDFS + "member")
            parts += [f"<{nodes.member_of}> {member} <", subject, "> .\n"]
        parts += ["<", subject, ">"]
        separator = "\n    "
        if nodes.types:
            types = ", ".join(self.name(type_) for type_ in nodes.types)
            parts.append(f"\n    a {types}")
            separator = " ;\n    "
        for prop in nodes.properties:
            quoted = [self._value(column, prop.datatype) for column in escaped(prop, self._escape)]
            values = join_values(quoted, ", ")
            parts.append(joined(f"{separator}{self.name(prop.predicate)} ", values))
            separator = " ;\n    "
        parts.append(" .\n\n")
        return parts

    def name(self, iri: str) -> str:
        """An IRI of the schema: prefixed where it can be."""
        return self.compact(iri) or f"<{iri}>"

    def _escape(self, text: str) -> str:
        return escape_literal(text)

    def _value(self, column: Any, datatype: str) -> Any:
        if datatype == IRI:
            return self._iris(column)
        if datatype in (INTEGER, BOOLEAN):
            return column
        if datatype == STRING:
            return joined('"', column, '"')
        return joined('"', column, f'"^^{self.name(datatype)}')

    def _iris(self, column: Any) -> Any:
        import pyarrow as pa

        distinct = column.unique().to_pylist() if len(column) else []
        if len(distinct) <= 8:
            # Few different ones: code list values and classes, worth a prefixed name.
            names = {iri: self.compact(iri) for iri in distinct if iri is not None}
            if all(names.values()):
                return pa.array([names.get(iri) for iri in column.to_pylist()], pa.string())
        return joined("<", self.relative(column), ">")
