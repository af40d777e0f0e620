"""Parse: a file of any of the syntaxes as triples, strictly, without network; what is wrong."""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyoxigraph as ox

from geofield.errors import FormatError, MissingFileError
from geofield.formats.rdf.guard import check_json, check_xml

#: File endings and their syntax; XML and JSON only where the ending says RDF.
SYNTAXES: dict[str, ox.RdfFormat] = {
    ".rdf": ox.RdfFormat.RDF_XML,
    ".owl": ox.RdfFormat.RDF_XML,
    ".ttl": ox.RdfFormat.TURTLE,
    ".jsonld": ox.RdfFormat.JSON_LD,
    ".nt": ox.RdfFormat.N_TRIPLES,
}


def parse(path: Path) -> Iterator[ox.Quad]:
    """The triples of a file, as a stream; its ending tells the syntax.

    Raises
    ------
    FormatError
        When it is not there, hostile, or not valid in its syntax; names the line.
    """
    syntax = SYNTAXES.get(path.suffix.lower())
    if syntax is None:
        raise FormatError(
            f"{path.name} has no ending of an RDF syntax.",
            hint=f"Known endings: {', '.join(SYNTAXES)}.",
        )
    if not path.is_file():
        raise MissingFileError(f"There is no file {path}.", hint="Check the path.")
    if syntax == ox.RdfFormat.RDF_XML:
        with path.open("rb") as file:
            check_xml(file, path.name)
    elif syntax == ox.RdfFormat.JSON_LD:
        check_json(path.read_text(encoding="utf-8", errors="replace"), path.name)
    try:
        with path.open("rb") as file:
            # As editors of Windows put it before a text.
            has_mark = file.read(len(BOM_UTF8)) == BOM_UTF8
            source: dict[str, Any] = {"input": file} if has_mark else {"path": path}
            # A relative name in a file without a base must not become the name of a local file.
            yield from ox.parse(**source, format=syntax, base_iri="https://example.org/no-base/")
    except SyntaxError as error:
        line = f", line {error.lineno}" if error.lineno else ""
        raise FormatError(
            f"{path.name}{line}: {error.msg}.", hint="The file is not valid RDF in its syntax."
        ) from error
    except (OSError, ValueError) as error:
        raise FormatError(
            f"{path.name} cannot be read: {error}.", hint="Is it whole, and may you read it?"
        ) from error


@dataclass(frozen=True, order=True, slots=True)
class Problem:
    """What a validator found wrong with a subject: an IRI in angle brackets, or the file.

    `rule` is a shape's constraint and property, or a check; `hint` what to do about it.
    """

    subject: str
    rule: str
    message: str
    hint: str = ""
