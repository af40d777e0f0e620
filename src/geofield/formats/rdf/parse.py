"""Parse: a file of any of the syntaxes as triples, strictly, without network."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pyoxigraph as ox

from geofield.errors import FormatError
from geofield.formats.rdf.guard import check_json, check_xml
from geofield.formats.rdf.namespaces import TYPE

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
    if syntax == ox.RdfFormat.RDF_XML:
        check_xml(path)
    elif syntax == ox.RdfFormat.JSON_LD:
        check_json(path)
    try:
        # A relative name in a file without a base must not become the name of a local file.
        yield from ox.parse(path=path, format=syntax, base_iri="https://example.org/no-base/")
    except SyntaxError as error:
        line = f", line {error.lineno}" if error.lineno else ""
        raise FormatError(
            f"{path.name}{line}: {error.msg}.", hint="The file is not valid RDF in its syntax."
        ) from error
    except (OSError, ValueError) as error:
        raise FormatError(f"{path.name} cannot be read: {error}.") from error


@dataclass(slots=True)
class Graph:
    """Triples by subject and predicate, as plain texts: what the readers look things up in.

    Attributes
    ----------
    nodes : dict
        Subject to predicate to values, in the order of the file.
    """

    nodes: dict[str, dict[str, list[str]]] = field(default_factory=dict)

    def add(self, quads: Iterable[ox.Quad]) -> None:
        """Take in triples."""
        nodes = self.nodes
        for quad in quads:
            node = nodes.setdefault(quad.subject.value, {})  # type: ignore[union-attr]
            values = node.setdefault(quad.predicate.value, [])
            values.append(quad.object.value)  # type: ignore[union-attr]

    def of_type(self, *types: str) -> list[str]:
        """The subjects of any of some classes, in the order of the file."""
        wanted = set(types)
        return [iri for iri, node in self.nodes.items() if wanted.intersection(node.get(TYPE, ()))]

    def values(self, subject: str, predicate: str) -> list[str]:
        """All distinct values; none where there is nothing."""
        return list(dict.fromkeys(self.nodes.get(subject, {}).get(predicate, ())))

    def value(self, subject: str, predicate: str) -> str | None:
        """The first value, None where there is none."""
        node = self.nodes.get(subject)
        values = node.get(predicate) if node else None
        return values[0] if values else None
