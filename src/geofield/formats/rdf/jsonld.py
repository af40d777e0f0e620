"""JSON-LD 1.1: one node a line under the context that the package ships.

pyoxigraph writes JSON-LD without a context; people read this one. The context stands inside
each file, so that readers need no network.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO, Any

import pyoxigraph as ox

from geofield.formats.rdf.names import NOT_IN_IRI
from geofield.formats.rdf.namespaces import (
    GF,
    SCHEMA_PREFIXES,
    STRING,
    STUDY_PREFIXES,
    TYPE,
    compact,
    expand,
)
from geofield.formats.rdf.resources import context
from geofield.formats.rdf.triples import Column, Group


def write_jsonld(groups: Iterable[Group], file: IO[bytes], prefixes: dict[str, str]) -> None:
    """Write groups of nodes as a flat graph, as they come."""
    terms = {
        (expand(entry["@id"]), _kind(entry.get("@type", ""))): name
        for name, entry in context().items()
        if isinstance(entry, dict)
    }
    whole = json.dumps({**context(), **prefixes}, indent=1, ensure_ascii=False)
    file.write(f'{{\n"@context": {whole},\n"@graph": ['.encode())
    separator = "\n"
    for group in groups:
        written = [[_entries(column, terms) for column in nodes.columns] for nodes in group]
        for index in range(len(group[0].subjects)):
            for nodes, columns in zip(group, written, strict=True):
                node: dict[str, Any] = {"@id": nodes.subjects[index].value}
                for column in columns:
                    node |= column[index]
                file.write((separator + json.dumps(node, ensure_ascii=False)).encode())
                separator = ",\n"
    file.write(b"\n]\n}\n")


def _kind(text: str) -> str:
    return text if text in ("", "@id") else expand(text)


def _entries(column: Column, terms: dict[tuple[str, str], str]) -> list[dict[str, Any]]:
    """For each row, the predicate's short name with its value or values; empty for none."""
    predicate, values = column
    iri = predicate.value
    result: list[dict[str, Any]] = []
    for value in values:
        entry: dict[str, Any] = {}
        if isinstance(value, tuple) and value:
            shown = [_shown(iri, each, terms) for each in value]
            entry[shown[0][0]] = [text for _, text in shown]
        elif value is not None and value != ():
            name, text = _shown(iri, value, terms)
            entry[name] = text
        result.append(entry)
    return result


def _shown(iri: str, value: Any, terms: dict[tuple[str, str], str]) -> tuple[str, Any]:
    """A predicate's short name and the value as it is written under it."""
    text = value.value
    if isinstance(value, ox.NamedNode):
        if iri == TYPE:
            return "@type", compact(text)
        text = compact(text) if text.startswith(GF) else text
        name = terms.get((iri, "@id"))
        return (name, text) if name else (compact(iri), {"@id": text})
    kind = value.datatype.value
    name = terms.get((iri, "" if kind == STRING else kind))
    if name:
        return name, text
    typed = {} if kind == STRING else {"@type": compact(kind)}
    return compact(iri), {**typed, "@value": text}


def flat_triples(path: Path) -> list[tuple[str, str, str]] | None:
    """The triples of a file in exactly the form above, as texts; None for any other file.

    Expanding JSON-LD takes four times as long. What is not as `write_jsonld` writes it, and what
    is hostile, is left to the parser and its guard.
    """
    try:
        document = json.loads(path.read_bytes())
        told, nodes = document.pop("@context"), document.pop("@graph")
        prefixes = {name: iri for name, iri in told.items() if isinstance(iri, str)}
        known = {**SCHEMA_PREFIXES, **STUDY_PREFIXES}
        if document or told != context() | prefixes or not prefixes.items() <= known.items():
            return None
        return list(_flat(nodes, prefixes))
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None


def _flat(nodes: Any, prefixes: dict[str, str]) -> Iterator[tuple[str, str, str]]:
    """What each node says. Raises KeyError or TypeError where it is not plain."""
    known: dict[str, str] = {}
    terms: dict[str, tuple[str, bool]] = {"@type": (TYPE, True)}
    for name, entry in context().items():
        if isinstance(entry, dict):
            terms[name] = (expand(entry["@id"]), entry.get("@type") == "@id")

    def iri(name: str) -> str:
        if name not in known:
            prefix, _, rest = name.partition(":")
            known[name] = name if rest.startswith("//") else prefixes[prefix] + rest
            if NOT_IN_IRI.search(known[name]):
                raise ValueError(name)
        return known[name]

    for node in nodes:
        subject = iri(node.pop("@id"))
        for name, told in node.items():
            term = terms.get(name)
            predicate = term[0] if term else iri(name)
            for value in told if type(told) is list else (told,):
                text, is_thing = (value, term[1]) if term else _valued(value)
                yield subject, predicate, iri(text) if is_thing else text + ""


def _valued(value: dict[str, str]) -> tuple[str, bool]:
    """The text of a value object, and whether it names a thing."""
    if value.keys() == {"@id"}:
        return value["@id"], True
    if not value.keys() <= {"@value", "@type"}:
        raise KeyError("@value")
    return value["@value"], False
