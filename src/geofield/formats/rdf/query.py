"""Queries: SPARQL that comes with the package, over files, with GeoSPARQL functions."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import pyoxigraph as ox

from geofield.errors import FormatError
from geofield.formats.rdf.geosparql import oxigraph_functions
from geofield.formats.rdf.guard import check_query
from geofield.formats.rdf.namespaces import BOOLEAN, DOUBLE, INTEGER, SCHEMA_PREFIXES, XSD
from geofield.formats.rdf.parse import parse

#: A parameter is a variable with one value, which stands in the query and can be replaced.
_PARAMETER = re.compile(
    r'VALUES \?(?P<name>\w+) \{ (?P<value>"(?P<text>[^"]*)"(?:\^\^xsd:(?P<kind>\w+))?|-?\d+) \}'
)
#: By datatype what a literal's text means.
_VALUES: dict[str, Callable[[str], Any]] = {
    BOOLEAN: "true".__eq__,
    **dict.fromkeys((INTEGER, XSD + "int"), int),
    **dict.fromkeys((DOUBLE, XSD + "decimal", XSD + "float"), float),
}


@dataclass(frozen=True, slots=True)
class Query:
    """A query of the package: SPARQL without prefixes, with words for people.

    `parameters` are the variables that stand for values, with defaults as a person writes them.
    """

    name: str
    title: str
    description: str
    text: str
    parameters: Mapping[str, str]

    @property
    def needs(self) -> str:
        """What a store must have for it beyond SPARQL 1.1, in words; empty for nothing."""
        functions = sorted(set(re.findall(r"\bgeof:\w+", self.text)))
        if not functions:
            return ""
        return (
            f"Needs a store with {', '.join(functions)} of GeoSPARQL, answering in metres on the "
            "ellipsoid. `geofield query` has them; for rdflib `register_in_rdflib()` and for "
            "pyoxigraph `custom_functions=oxigraph_functions()`, both of "
            "`geofield.formats.rdf.geosparql`, bring them."
        )

    @property
    def sparql(self) -> str:
        """The text with its prefixes, and what it needs: to paste into any store."""
        words = [f"# {line}" for line in textwrap.wrap(self.needs, 96)]
        used = {prefix: iri for prefix, iri in SCHEMA_PREFIXES.items() if f"{prefix}:" in self.text}
        prefixes = [f"PREFIX {prefix}: <{iri}>" for prefix, iri in used.items()]
        return "\n".join([*words, *prefixes, self.text])

    def with_values(self, values: Mapping[str, str]) -> str:
        """The text with other values of its parameters."""
        unknown = set(values) - set(self.parameters)
        if unknown:
            raise FormatError(
                f"The query {self.name!r} has no parameter {min(unknown)!r}.",
                hint=f"Parameters: {', '.join(self.parameters) or 'none'}.",
            )

        def replaced(match: re.Match[str]) -> str:
            value = values.get(match["name"])
            if value is None:
                return match[0]
            return f"VALUES ?{match['name']} {{ {_literal(match, value)} }}"

        return _PARAMETER.sub(replaced, self.text)


@dataclass(frozen=True, slots=True)
class Answer:
    """A table of answers, in Python's values: text (of IRIs too), int, float, bool or None."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]


def queries() -> dict[str, Query]:
    """All queries of the package, by name."""
    folder = files(__package__) / "queries"
    names = sorted(each.name for each in folder.iterdir() if each.name.endswith(".rq"))
    return {
        name[:-3]: _parsed(name[:-3], (folder / name).read_text(encoding="utf-8")) for name in names
    }


def open_store(paths: Iterable[Path]) -> ox.Store:
    """A store in memory with the triples of files, merged; refuses hostile and invalid ones."""
    store = ox.Store()
    for path in paths:
        store.bulk_extend(parse(Path(path)))
    return store


def ask(store: ox.Store, query: Query | str, values: Mapping[str, str] | None = None) -> Answer:
    """The answers of a query of the package, or of SPARQL in which geofield's prefixes are known.

    Raises
    ------
    FormatError
        When the query is not SPARQL or asks for data elsewhere (SERVICE, LOAD, FROM), or a
        parameter is unknown or of the wrong kind.
    """
    text = query.with_values(values or {}) if isinstance(query, Query) else query
    check_query(text)
    try:
        functions = oxigraph_functions()
        result = store.query(text, prefixes=SCHEMA_PREFIXES, custom_functions=functions)
        if not isinstance(result, ox.QuerySolutions):
            raise FormatError("Only SELECT queries are answered here.", hint="Ask with SELECT.")
        columns = tuple(variable.value for variable in result.variables)
        rows = tuple(tuple(_python(row[column]) for column in columns) for row in result)
    except (SyntaxError, ValueError) as error:
        raise FormatError(
            f"The query is not valid SPARQL: {error}.",
            hint="Begin with one that comes along: `geofield query --list`.",
        ) from error
    except (RuntimeError, OSError) as error:
        raise FormatError(
            f"The query cannot be answered: {error}.", hint="Ask for less at a time."
        ) from error
    return Answer(columns, rows)


def _parsed(name: str, text: str) -> Query:
    words = [line[1:].strip() for line in text.splitlines() if line.startswith("#")]
    parameters = {
        m["name"]: m["value"] if m["text"] is None else m["text"] for m in _PARAMETER.finditer(text)
    }
    return Query(name, words[0], " ".join(words[1:]), text, parameters)


def _literal(match: re.Match[str], value: str) -> str:
    """A value as a person writes it, in the kind of the parameter's default."""
    kind = match["kind"] or ("integer" if match["text"] is None else "string")
    try:
        if kind == "integer":
            return str(int(value))
        if kind == "double":
            return f'"{float(value)!r}"^^xsd:double'
    except ValueError as error:
        raise FormatError(
            f"{match['name']} is {value!r}, not a number.",
            hint="Write it like 12, without a unit.",
        ) from error
    # The engine's own writing of the text: no value breaks out of its literal.
    return str(ox.Literal(value))


def _python(term: Any) -> Any:
    if term is None:
        return None
    kind = term.datatype.value if isinstance(term, ox.Literal) else ""
    return _VALUES.get(kind, str)(term.value)
