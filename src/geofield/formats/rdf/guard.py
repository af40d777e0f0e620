"""Guard: refuse hostile files before a parser works on them.

A look at the file's bytes only: nothing is expanded, fetched or opened. RDF/XML must not
define entities that grow, name external ones, or nest deeper than any honest file does
(RDF/XML parsers take minutes over that). JSON-LD must not ask for a context on the network.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

from geofield.errors import FormatError
from geofield.formats.rdf.names import NOT_IN_IRI
from geofield.formats.rdf.namespaces import RDF

#: Elements inside elements; an honest file needs about 4, generous nesting 20.
MAX_DEPTH = 100
#: Entities such as ``<!ENTITY owl "http://www.w3.org/2002/07/owl#">``, as Protege writes them.
MAX_ENTITIES = 100
MAX_ENTITY_CHARACTERS = 256
_IRI_ATTRIBUTES = frozenset({RDF + name for name in ("about", "resource", "datatype")})
_JSON_ID = re.compile(r'"@(?:id|type)"\s*:\s*"((?:[^"\\]|\\.)*)"')
_JSON_CONTEXT = re.compile(r'"@(?:context|import)"\s*:\s*\[?\s*"((?:[^"\\]|\\.)*)"')
_BLOCK = 1 << 20


def check_xml(path: Path) -> None:
    """Refuse an RDF/XML file that is hostile or not well-formed.

    Raises
    ------
    FormatError
        Names file, line and reason.
    """
    guard = _XmlGuard(path)
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            guard.feed(block, last=False)
        guard.feed(b"", last=True)


class _XmlGuard:
    """An expat parser that only counts."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.depth = 0
        self.entities = 0
        parser = expat.ParserCreate(namespace_separator="")
        parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)
        parser.buffer_text = True
        parser.StartElementHandler = self.start
        parser.EndElementHandler = self.end
        parser.EntityDeclHandler = self.entity
        parser.StartDoctypeDeclHandler = self.doctype
        parser.ExternalEntityRefHandler = self.external
        self.parser = parser

    def feed(self, block: bytes, *, last: bool) -> None:
        try:
            self.parser.Parse(block, last)
        except expat.ExpatError as error:
            self.refuse(
                f"it is not well-formed XML ({expat.ErrorString(error.code)})", error.lineno
            )

    def start(self, name: str, attributes: dict[str, str]) -> None:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            self.refuse(f"elements are nested deeper than {MAX_DEPTH}")
        for attribute, value in attributes.items():
            if attribute in _IRI_ATTRIBUTES and NOT_IN_IRI.search(value):
                self.refuse(f"the IRI {value[:120]!r} holds a space or another forbidden character")

    def end(self, name: str) -> None:
        self.depth -= 1

    def doctype(self, name: str, system: str | None, public: str | None, internal: bool) -> None:
        if system or public:
            self.refuse(f"it names an external document type ({(system or public)!r:.80})")

    def entity(
        self,
        name: str,
        is_parameter: bool,
        value: str | None,
        base: str | None,
        system: str | None,
        public: str | None,
        notation: str | None,
    ) -> None:
        self.entities += 1
        if is_parameter or value is None:
            self.refuse(f"it defines the external or parameter entity {name!r:.40}")
        if "&" in value or "%" in value or "<" in value:
            self.refuse(f"it defines the entity {name!r:.40} by other entities or markup")
        if self.entities > MAX_ENTITIES or len(value) > MAX_ENTITY_CHARACTERS:
            self.refuse(f"it defines too many or too long entities ({name!r:.40})")

    def external(self, *ignored: object) -> int:
        self.refuse("it refers to an external entity")

    def refuse(self, reason: str, line: int | None = None) -> NoReturn:
        where = self.parser.CurrentLineNumber if line is None else line
        raise FormatError(
            f"{self.path.name}, line {where}: {reason}.",
            hint="Nothing was read from it. Ask its maker for plain RDF/XML.",
        )


def check_json(path: Path) -> None:
    """Refuse a JSON-LD file that needs the network or whose IRIs a parser would drop.

    Raises
    ------
    FormatError
        Names file, line and reason.
    """
    text = path.read_text(encoding="utf-8", errors="replace")
    remote = _JSON_CONTEXT.search(text)
    if remote:
        raise FormatError(
            f"{path.name}, line {_line(text, remote.start())}: its context {remote[1]!r:.120} lies "
            "outside the file, and geofield does not fetch it.",
            hint="Put the context itself into the file.",
        )
    for match in _JSON_ID.finditer(text):
        if NOT_IN_IRI.search(_unescaped(match[1])):
            raise FormatError(
                f"{path.name}, line {_line(text, match.start())}: the IRI {match[1][:120]!r} holds "
                "a space or another forbidden character.",
                hint="Percent-encode it: a space is %20.",
            )


def _unescaped(text: str) -> str:
    if "\\" not in text:
        return text
    try:
        return str(json.loads(f'"{text}"'))
    except ValueError:
        return text


def _line(text: str, position: int) -> int:
    return text.count("\n", 0, position) + 1
