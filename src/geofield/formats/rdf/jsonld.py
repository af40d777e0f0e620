"""JSON-LD 1.1: one node a line under the context that the package ships.

pyoxigraph writes JSON-LD without a context; people read this one. The context stands inside
each file, so that readers need no network.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from functools import cache
from itertools import chain
from json.encoder import encode_basestring as _quoted
from typing import IO, Any

import pyoxigraph as ox

from geofield.formats.rdf.namespaces import CONTEXT_TERMS, GF, STRING, TYPE, compact, expand
from geofield.formats.rdf.triples import Group, Nodes, Typed
from geofield.formats.rdf.triples import terms as terms_of

_KINDS = {"": STRING, "@id": "@id"}
#: Short names by predicate and kind of value.
_TERMS = {
    (expand(entry["@id"]), _KINDS.get(kind) or expand(kind)): name
    for name, entry in CONTEXT_TERMS.items()
    if isinstance(entry, dict)
    for kind in [entry.get("@type", "")]
}


def write_jsonld(groups: Iterable[Group], file: IO[bytes], prefixes: dict[str, str]) -> None:
    """Write groups of nodes as a flat graph, as they come."""
    whole = json.dumps({**CONTEXT_TERMS, **prefixes}, indent=1, ensure_ascii=False)
    file.write(f'{{\n"@context": {whole},\n"@graph": ['.encode())
    separator = "\n"
    for group in groups:
        told = [_lines(nodes) for nodes in group]
        if told[0]:
            rows = chain.from_iterable(zip(*told, strict=True))
            file.write((separator + ",\n".join(rows)).encode())
            separator = ",\n"
    file.write(b"\n]\n}\n")


def _lines(nodes: Nodes) -> list[str]:
    """Each node as a line of JSON."""
    names = [f'"@id": "{subject.value}"' for subject in nodes.subjects]
    columns = [_told(predicate.value, values) for predicate, values in nodes.columns]
    return [f"{{{', '.join(filter(None, row))}}}" for row in zip(names, *columns, strict=True)]


def _told(iri: str, values: Sequence[Any]) -> list[str]:
    """Of each row the predicate's short name with its value or values; empty for none."""
    # All alike: one look-up for the column.
    if isinstance(values, Typed) and None not in values:
        name, before, after = _frame(iri, values.datatype.value)
        return [f'"{name}": {before}{_quoted(text)}{after}' for text in values]
    values = terms_of(values)
    if set(map(type, values)) == {ox.NamedNode}:
        name, before, after = _frame(iri, "@id")
        return [f'"{name}": {before}{_short(iri, each.value)}{after}' for each in values]
    return ["" if value is None else _entry(iri, value) for value in values]


def _entry(iri: str, value: Any) -> str:
    """A predicate's short name with a value, or with a list of them."""
    name, told = "", []
    for each in value if isinstance(value, tuple) else (value,):
        kind = "@id" if isinstance(each, ox.NamedNode) else each.datatype.value
        name, before, after = _frame(iri, kind)
        text = _short(iri, each.value) if kind == "@id" else _quoted(each.value)
        told.append(f"{before}{text}{after}")
    listed = f"[{', '.join(told)}]" if isinstance(value, tuple) else told[0]
    return f'"{name}": {listed}' if told else ""


def _short(iri: str, text: str) -> str:
    return f'"{compact(text) if iri == TYPE or text.startswith(GF) else text}"'


@cache
def _frame(iri: str, kind: str) -> tuple[str, str, str]:
    """A predicate's short name, and what stands around a value of a kind."""
    if iri == TYPE:
        return "@type", "", ""
    if (iri, kind) in _TERMS:
        return _TERMS[iri, kind], "", ""
    if kind == "@id":
        return compact(iri), '{"@id": ', "}"
    typed = "" if kind == STRING else f'"@type": "{compact(kind)}", '
    return compact(iri), f'{{{typed}"@value": ', "}"
