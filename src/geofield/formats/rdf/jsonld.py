"""JSON-LD 1.1: one node a line under the context that the package ships.

pyoxigraph writes JSON-LD without a context; people read this one. The context stands inside
each file, so that readers need no network.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from functools import cache
from json.encoder import encode_basestring
from typing import Any

import pyoxigraph as ox

from geofield.formats.rdf.namespaces import CONTEXT_TERMS, GF, STRING, TYPE, compact, expand
from geofield.formats.rdf.triples import Group, Nodes, terms

_KINDS = {"": STRING, "@id": "@id"}
#: Short names by predicate and kind of value.
_TERMS = {
    (expand(entry["@id"]), _KINDS.get(kind) or expand(kind)): name
    for name, entry in CONTEXT_TERMS.items()
    if isinstance(entry, dict)
    for kind in [entry.get("@type", "")]
}
END = "\n]\n}\n"


def head(prefixes: dict[str, str]) -> str:
    """What stands before the nodes; :data:`END` stands behind them."""
    whole = json.dumps({**CONTEXT_TERMS, **prefixes}, indent=1, ensure_ascii=False)
    return f'{{\n"@context": {whole},\n"@graph": ['


def lines(groups: Iterable[Group]) -> str:
    """The nodes of groups, a line each, with a comma before it."""
    rows = (row for group in groups for row in zip(*map(_nodes, group), strict=True))
    return "".join(f",\n{{{told}}}" for row in rows for told in row)


def _nodes(nodes: Nodes) -> Iterator[str]:
    names = [f'"@id": "{iri}"' for iri in nodes.subjects]
    columns = [
        [_entry(predicate.value, value) for value in terms(values, len(names))]
        for predicate, values in nodes.columns
    ]
    return (", ".join(filter(None, row)) for row in zip(names, *columns, strict=True))


def _entry(iri: str, value: Any) -> str:
    """A predicate's short name with a value, or with a list of them; empty for none."""
    name, told = "", []
    for each in value if isinstance(value, tuple) else (value,):
        if each is not None:
            named = isinstance(each, ox.NamedNode)
            name, before, after = _frame(iri, "@id" if named else each.datatype.value)
            short = named and (iri == TYPE or each.value.startswith(GF))
            text = compact(each.value) if short else each.value
            told.append(f"{before}{encode_basestring(text)}{after}")
    listed = f"[{', '.join(told)}]" if isinstance(value, tuple) else "".join(told)
    return f'"{name}": {listed}' if told else ""


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
