"""Parse: a file of any of the syntaxes as triples, strictly, without network; what is wrong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import pyoxigraph as ox

from geofield.errors import FormatError
from geofield.formats.rdf.guard import check_json, check_xml, plain_xml

#: File endings and their syntax; XML and JSON only where the ending says RDF.
SYNTAXES: dict[str, ox.RdfFormat] = {
    ".rdf": ox.RdfFormat.RDF_XML,
    ".owl": ox.RdfFormat.RDF_XML,
    ".ttl": ox.RdfFormat.TURTLE,
    ".jsonld": ox.RdfFormat.JSON_LD,
    ".nt": ox.RdfFormat.N_TRIPLES,
}


def parse(path: Path) -> Iterator[ox.Quad]:
    """The triples of a file, as a stream.

    Parameters
    ----------
    path : Path
        Its ending tells the syntax.

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
        raise FormatError(f"There is no file {path}.")
    if syntax == ox.RdfFormat.RDF_XML and not plain_xml(path):
        check_xml(path)
    elif syntax == ox.RdfFormat.JSON_LD:
        check_json(path)
    try:
        # A relative name in a file without a base must not become the name of a local file.
        yield from ox.parse(path=path, format=syntax, base_iri="https://example.org/no-base/")
    except SyntaxError as error:
        if syntax == ox.RdfFormat.RDF_XML:
            check_xml(path)  # which knows the line
        line = f", line {error.lineno}" if error.lineno else ""
        raise FormatError(
            f"{path.name}{line}: {error.msg}.", hint="The file is not valid RDF in its syntax."
        ) from error
    except (OSError, ValueError) as error:
        raise FormatError(f"{path.name} cannot be read: {error}.") from error


@dataclass(frozen=True, slots=True)
class Problem:
    """What a validator found.

    Attributes
    ----------
    message : str
        What is wrong, in plain words.
    subject : str
        What it is wrong with: an IRI in angle brackets, or the file.
    line : int or None
        At which the subject is described first, where that is known.
    hint : str
        What to do about it; empty where it is obvious.
    rule : str
        The rule that is broken, for programs: a shape's constraint and property, or a check.
    """

    message: str
    subject: str = ""
    line: int | None = None
    hint: str = ""
    rule: str = ""

    @property
    def place(self) -> str:
        """The line and the subject."""
        return ", ".join(filter(None, (f"line {self.line}" if self.line else "", self.subject)))

    @property
    def words(self) -> str:
        """The message and what to do."""
        return f"{self.message} {self.hint}".strip()

    def __str__(self) -> str:
        return f"{self.place}: {self.words}" if self.place else self.words

    def capital(self) -> Problem:
        """The same with a message that begins as a sentence."""
        return replace(self, message=self.message[0].upper() + self.message[1:])
