"""N-Triples: one triple a line, nothing abbreviated; the syntax for big data and for diff."""

from __future__ import annotations

import re
from typing import Any

from geofield.formats.rdf.namespaces import RDFS, STRING, TYPE
from geofield.formats.rdf.nodes import IRI, Nodes, joined
from geofield.formats.rdf.serialise import Serialiser, escaped

_ESCAPES = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t"}
_TO_ESCAPE = re.compile(r'[\x00-\x1f\x7f\\"]')


def escape_literal(text: str) -> str:
    """A literal's text between double quotes, in N-Triples and Turtle."""
    return _TO_ESCAPE.sub(lambda m: _ESCAPES.get(m[0], f"\\u{ord(m[0]):04X}"), text)


class NTriples(Serialiser):
    """RDF 1.1 N-Triples."""

    def head(self) -> str:
        """Nothing."""
        return ""

    def rows(self, nodes: Nodes) -> list[Any]:
        """One line per triple."""
        parts: list[Any] = []
        if nodes.member_of:
            parts += [f"<{nodes.member_of}> <{RDFS}member> <", nodes.iris, "> .\n"]
        for type_ in nodes.types:
            parts += ["<", nodes.iris, f"> <{TYPE}> <{type_}> .\n"]
        for prop in nodes.properties:
            opening, closing = "<", "> .\n"
            if prop.datatype != IRI:
                opening = '"'
                closing = '" .\n' if prop.datatype == STRING else f'"^^<{prop.datatype}> .\n'
            for column in escaped(prop, escape_literal):
                line = joined("<", nodes.iris, f"> <{prop.predicate}> {opening}", column, closing)
                parts.append(line)
        return parts
