"""JSON-LD 1.1: one node a line under the context that the package ships.

pyoxigraph writes JSON-LD without a context; people read this one. The context stands inside
each file, so that readers need no network.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import IO, Any

import pyoxigraph as ox

from geofield.formats.rdf.namespaces import GF, STRING, TYPE, compact, expand
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
