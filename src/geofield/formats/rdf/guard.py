"""Guard: refuse hostile files and questions before a parser works on them.

A look at the bytes only: nothing is expanded, fetched or opened. RDF/XML must not define
entities that grow, name external ones, or nest deeper than any honest file does (RDF/XML
parsers take minutes over that). JSON-LD must not ask for a context on the network, SPARQL for
data elsewhere.
"""

from __future__ import annotations

import json
import re
from typing import IO, Any, NoReturn
from xml.parsers import expat

from geofield.errors import FormatError
from geofield.formats.rdf.names import NOT_IN_IRI
from geofield.formats.rdf.namespaces import RDF
from geofield.strangers import XmlGuard

#: Entities such as ``<!ENTITY owl "http://www.w3.org/2002/07/owl#">``, as Protege writes them.
MAX_ENTITIES = 100
MAX_ENTITY_CHARACTERS = 256
_IRI_ATTRIBUTES = frozenset({RDF + name for name in ("about", "resource", "datatype")})
_JSON_ID = re.compile(r'"@(?:id|type)"\s*:\s*"((?:[^"\\]|\\.)*)"')
_JSON_CONTEXT = re.compile(r'"@(?:context|import)"\s*:\s*\[?\s*"((?:[^"\\]|\\.)*)"')
_FORBIDDEN = "holds a space or another forbidden character"
_BLANK = r"(?:\s|\#[^\r\n]*[\r\n])*"
_NAME = r"(?:<[^>]*>|[?$]\w+|[\w.-]*:[^\s{]*?)"
#: What reaches beyond the files that were named: other hosts, and data that is not in them.
#: Looked for in the raw text, texts and comments too: no second reading of SPARQL's syntax can
#: then differ from the engine's and let one through.
_OUTWARD = re.compile(
    rf"(?<![?$])(SERVICE){_BLANK}(?:SILENT{_BLANK})?{_NAME}{_BLANK}\{{"
    rf"|(?<![?$\w:])(FROM|LOAD){_BLANK}(?:(?:NAMED|SILENT){_BLANK})?(?:<[^>]*>|[\w.-]*:)",
    re.IGNORECASE,
)


def check_query(text: str) -> None:
    """Refuse SPARQL that would reach for other hosts or other data; names keyword and line."""
    found = _OUTWARD.search(text)
    if found:
        raise FormatError(
            f"The query, line {_line(text, found.start())}: {(found[1] or found[2]).upper()} asks "
            "for data elsewhere. geofield answers from the files that you name, and opens no "
            "connection.",
            hint="Take it out; give the other data as a file of RDF.",
        )


def check_json(text: str, name: str) -> None:
    """Refuse JSON-LD that needs the network or whose IRIs a parser would drop; names the line."""
    remote = _JSON_CONTEXT.search(text)
    if remote:
        raise FormatError(
            f"{name}, line {_line(text, remote.start())}: its context {remote[1]!r:.120} lies "
            "outside the file, and geofield does not fetch it.",
            hint="Put the context itself into the file.",
        )
    for match in _JSON_ID.finditer(text):
        if NOT_IN_IRI.search(_unescaped(match[1])):
            raise FormatError(
                f"{name}, line {_line(text, match.start())}: the IRI {match[1][:120]!r} "
                f"{_FORBIDDEN}.",
                hint="Percent-encode it: a space is %20.",
            )


def check_xml(file: IO[bytes], name: str) -> None:
    """Refuse RDF/XML that is hostile or not well-formed; names file, line and reason."""
    guard = _RdfGuard(name)
    try:
        guard.parser.ParseFile(file)
    except expat.ExpatError as error:
        guard.refuse(f"it is not well-formed XML ({expat.ErrorString(error.code)})")
    except (LookupError, ValueError) as error:
        guard.refuse(f"its encoding is not known ({error})")


class _RdfGuard(XmlGuard):
    """Small entities are honest here, deep nesting is not; IRIs hold nothing that is dropped."""

    #: An honest file needs about 4, generous nesting 20.
    max_depth = 100
    entities = 0

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        super().start(tag, attributes)
        for attribute, value in attributes.items():
            if attribute in _IRI_ATTRIBUTES and NOT_IN_IRI.search(value):
                self.refuse(f"the IRI {value[:120]!r} {_FORBIDDEN}")

    def entity(self, name: str, is_parameter: bool, value: str | None, *_: Any) -> None:
        self.entities += 1
        if is_parameter or value is None:
            self.refuse(f"it defines the external or parameter entity {name!r:.40}")
        if set(value) & set("&%<"):
            self.refuse(f"it defines the entity {name!r:.40} by other entities or markup")
        if self.entities > MAX_ENTITIES or len(value) > MAX_ENTITY_CHARACTERS:
            self.refuse(f"it defines too many or too long entities ({name!r:.40})")

    def refuse(self, reason: str) -> NoReturn:
        raise FormatError(
            f"{self.name}, line {self.parser.CurrentLineNumber}: {reason}.",
            hint="Nothing was read from it. Ask its maker for plain RDF/XML.",
        )


def _unescaped(text: str) -> str:
    try:
        return str(json.loads(f'"{text}"')) if "\\" in text else text
    except ValueError:
        return text


def _line(text: str, position: int) -> int:
    return text.count("\n", 0, position) + 1
