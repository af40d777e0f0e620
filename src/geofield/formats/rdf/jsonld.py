"""JSON-LD 1.1: one node a line under the context that the package ships.

pyoxigraph writes JSON-LD without a context; people read this one. The context stands inside
each file, so that readers need no network.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from json.encoder import encode_basestring as _quoted
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
from geofield.formats.rdf.triples import Group, Nodes, Typed
from geofield.formats.rdf.triples import terms as terms_of

#: Short names by predicate and kind of value.
Terms = dict[tuple[str, str], str]


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
        told = [_lines(nodes, terms) for nodes in group]
        if told[0]:
            rows = chain.from_iterable(zip(*told, strict=True))
            file.write((separator + ",\n".join(rows)).encode())
            separator = ",\n"
    file.write(b"\n]\n}\n")


def _kind(text: str) -> str:
    return text if text in ("", "@id") else expand(text)


def _lines(nodes: Nodes, terms: Terms) -> list[str]:
    """Each node as a line of JSON."""
    names = [f'"@id": "{subject.value}"' for subject in nodes.subjects]
    columns = [_told(predicate.value, values, terms) for predicate, values in nodes.columns]
    return [f"{{{', '.join(filter(None, row))}}}" for row in zip(names, *columns, strict=True)]


def _told(iri: str, values: Sequence[Any], terms: Terms) -> list[str]:
    """Of each row the predicate's short name with its value or values; empty for none."""
    # All alike: one look-up for the column.
    if isinstance(values, Typed) and None not in values:
        name, before, after = _frame(iri, values.datatype.value, terms)
        return [f'"{name}": {before}{_quoted(text)}{after}' for text in values]
    values = terms_of(values)
    if set(map(type, values)) == {ox.NamedNode}:
        name, before, after = _frame(iri, "@id", terms)
        return [f'"{name}": {before}{_short(iri, each.value)}{after}' for each in values]
    return ["" if value is None else _entry(iri, value, terms) for value in values]


def _entry(iri: str, value: Any, terms: Terms) -> str:
    """A predicate's short name with a value, or with a list of them."""
    name, told = "", []
    for each in value if isinstance(value, tuple) else (value,):
        kind = _kind_of(each)
        name, before, after = _frame(iri, kind, terms)
        text = _short(iri, each.value) if kind == "@id" else _quoted(each.value)
        told.append(f"{before}{text}{after}")
    listed = f"[{', '.join(told)}]" if isinstance(value, tuple) else told[0]
    return f'"{name}": {listed}' if told else ""


def _kind_of(term: Any) -> str:
    return "@id" if isinstance(term, ox.NamedNode) else term.datatype.value


def _short(iri: str, text: str) -> str:
    return f'"{compact(text) if iri == TYPE or text.startswith(GF) else text}"'


def _frame(iri: str, kind: str, terms: Terms) -> tuple[str, str, str]:
    """A predicate's short name, and what stands around a value of a kind."""
    if iri == TYPE:
        return "@type", "", ""
    name = terms.get((iri, "" if kind == STRING else kind))
    if name:
        return name, "", ""
    if kind == "@id":
        return compact(iri), '{"@id": ', "}"
    typed = "" if kind == STRING else f'"@type": "{compact(kind)}", '
    return compact(iri), f'{{{typed}"@value": ', "}"


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
