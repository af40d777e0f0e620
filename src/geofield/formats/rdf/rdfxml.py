"""RDF/XML: typed node elements with one property element a line."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Any
from xml.sax.saxutils import escape as _escape_markup

import pyarrow.compute as pc

from geofield.errors import FormatError
from geofield.formats.rdf.namespaces import RDF, RDFS, STRING, WKT
from geofield.formats.rdf.nodes import IRI, Group, Nodes, joined, text_of
from geofield.formats.rdf.serialise import Serialiser, escaped, pieces

#: Control characters cannot stand in XML 1.0, not even escaped.
_NOT_IN_XML = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")


def escape_text(text: str) -> str:
    """Text for an XML element or a double-quoted attribute."""
    text = _NOT_IN_XML.sub("\ufffd", text)
    # A bare carriage return would be read back as a line feed.
    return _escape_markup(text, {'"': "&quot;", "\r": "&#13;"})


def _escape_wkt(column: Any) -> Any:
    # The CRS of a WKT literal stands in angle brackets.
    return pc.replace_substring(pc.replace_substring(column, "<", "&lt;"), ">", "&gt;")


class RdfXml(Serialiser):
    """RDF 1.1 XML Syntax."""

    def head(self) -> str:
        """The root element with its namespaces and base."""
        lines = ['<?xml version="1.0" encoding="UTF-8"?>', "<rdf:RDF"]
        lines += [f'    xmlns:{prefix}="{iri}"' for prefix, iri in self.prefixes.items()]
        return "\n".join(lines) + f'\n    xml:base="{escape_text(self.base)}">\n'

    def tail(self) -> str:
        """The end of the root element."""
        return "</rdf:RDF>\n"

    def stream(self, groups: Iterable[Group]) -> Iterator[bytes | memoryview]:
        """The document; nodes that are members of another are nested in its description."""
        yield self.head().encode()
        inside = ""
        for piece in pieces(groups):
            owner = piece[0].member_of
            if owner != inside:
                yield self._change(inside, owner)
                inside = owner
            yield text_of(self.group_rows(piece))
        yield self._change(inside, "")
        yield self.tail().encode()

    def _change(self, old: str, new: str) -> bytes:
        text = "  </rdf:Description>\n" if old else ""
        if new:
            text += f'  <rdf:Description rdf:about="{escape_text(new)}">\n'
        return text.encode()

    def rows(self, nodes: Nodes) -> list[Any]:
        """A node element per node."""
        names = [self.element(type_) for type_ in nodes.types] or [
            self.element(RDF + "Description")
        ]
        indent = "  "
        parts: list[Any] = []
        if nodes.member_of:
            indent = "      "
            parts.append(f"    <{self.element(RDFS + 'member')}>\n")
        parts += [f'{indent}<{names[0]} rdf:about="', self.relative(nodes.iris), '">\n']
        parts += [f'{indent}  <rdf:type rdf:resource="{type_}"/>\n' for type_ in nodes.types[1:]]
        for prop in nodes.properties:
            name = self.element(prop.predicate)
            for column in escaped(prop, escape_text):
                if prop.datatype == IRI:
                    opening, closing = f'{indent}  <{name} rdf:resource="', '"/>\n'
                    value = self.relative(column)
                else:
                    kind = "" if prop.datatype == STRING else f' rdf:datatype="{prop.datatype}"'
                    opening, closing = f"{indent}  <{name}{kind}>", f"</{name}>\n"
                    value = _escape_wkt(column) if prop.datatype == WKT else column
                parts.append(joined(opening, value, closing))
        parts.append(f"{indent}</{names[0]}>\n")
        if nodes.member_of:
            parts.append(f"    </{self.element(RDFS + 'member')}>\n")
        return parts

    def element(self, iri: str) -> str:
        """The qualified name of a class or property."""
        name = self.compact(iri)
        if name is None:
            raise FormatError(f"{iri} has no prefix, so RDF/XML has no element name for it.")
        return name
