"""JSON-LD 1.1: one node a line under the context that the package ships.

The context stands inside each file, so that readers need no network.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from typing import Any

from geofield.formats.rdf.layers import all_terms
from geofield.formats.rdf.namespaces import RDFS, STRING
from geofield.formats.rdf.nodes import IRI, Group, Nodes, Property, join_values, joined, text_of
from geofield.formats.rdf.serialise import Serialiser, escaped, pieces


def json_context(prefixes: dict[str, str]) -> dict[str, object]:
    """The JSON-LD context: prefixes, and a short term with its type for each property."""
    context: dict[str, object] = dict(prefixes)
    for term in all_terms().values():
        entry = {"@id": term.name}
        # Without a type a JSON string is a plain string already.
        if term.range != "xsd:string":
            entry["@type"] = "@id" if term.is_object else term.range
        context[term.name.partition(":")[2]] = entry
    return context


def _escape(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)[1:-1]


class JsonLd(Serialiser):
    """JSON-LD 1.1, flattened: a context and a graph."""

    def __init__(self, base: str, prefixes: dict[str, str]) -> None:
        super().__init__(base, prefixes)
        self.context = json_context(prefixes)
        self._terms = {
            (value["@id"], value.get("@type", "")): term
            for term, value in self.context.items()
            if isinstance(value, dict) and "@id" in value
        }

    def head(self) -> str:
        """The context."""
        context = {"@base": self.base, **self.context}
        text = json.dumps(context, indent=1, ensure_ascii=False)
        return f'{{\n"@context": {text},\n"@graph": [\n'

    def tail(self) -> str:
        """The end of the graph."""
        return "\n]\n}\n"

    def stream(self, groups: Iterable[Group]) -> Iterator[bytes | memoryview]:
        """The document; commas stand before all rows but the first."""
        yield self.head().encode()
        first = True
        for piece in pieces(groups):
            text = text_of(self.group_rows(piece))
            yield text[2:] if first else text
            first = False
        yield self.tail().encode()

    def rows(self, nodes: Nodes) -> list[Any]:
        """A JSON object per node."""
        parts: list[Any] = []
        subject = self.relative(nodes.iris)
        if nodes.member_of:
            member = f'"{self.compact(RDFS + "member")}"'
            parts += [f',\n{{"@id": "{nodes.member_of}", {member}: {{"@id": "', subject, '"}}']
        parts += [',\n{"@id": "', subject, '"']
        if nodes.types:
            names = json.dumps([self.compact(type_) or type_ for type_ in nodes.types])
            parts.append(f', "@type": {names}')
        parts += [self._property(prop) for prop in nodes.properties]
        parts.append("}")
        return parts

    def _property(self, prop: Property) -> Any:
        name = self.compact(prop.predicate) or prop.predicate
        kind = "@id" if prop.datatype == IRI else self.compact(prop.datatype) or prop.datatype
        term = self._terms.get((name, "" if prop.datatype == STRING else kind))
        columns = escaped(prop, _escape)
        if prop.datatype == IRI:
            columns = tuple(self.relative(column) for column in columns)
        opening, closing = '"', '"'
        if term is None and prop.datatype == IRI:
            opening, closing = '{"@id": "', '"}'
        elif term is None and prop.datatype != STRING:
            opening, closing = f'{{"@type": "{kind}", "@value": "', '"}'
        elif term is None:
            opening, closing = '{"@value": "', '"}'
        values = [joined(opening, column, closing) for column in columns]
        before, after = ("[", "]") if len(values) > 1 else ("", "")
        return joined(f', "{term or name}": {before}', join_values(values, ", "), after)
