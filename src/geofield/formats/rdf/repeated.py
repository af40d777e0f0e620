"""Repeated: the many nodes of one shape, written and read by the pattern of one.

Tens of thousands of track points are told in the same words with other values. A serialiser
writes one of them and all else, pyoxigraph reads two of each run and all else; the others follow
their pattern, in a third of the time.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterable
from functools import cache
from itertools import groupby, islice
from pathlib import Path
from typing import IO, Any, Final
from xml.sax.saxutils import escape, unescape

import pandas as pd
import pyoxigraph as ox

from geofield import schema
from geofield.errors import FormatError
from geofield.formats.rdf import jsonld
from geofield.formats.rdf.features import point_group
from geofield.formats.rdf.graph import Graph
from geofield.formats.rdf.guard import check_json, check_xml
from geofield.formats.rdf.names import Names
from geofield.formats.rdf.namespaces import DOUBLE, INTEGER, TYPE, node
from geofield.formats.rdf.study import StudyDescription, study_points
from geofield.formats.rdf.triples import Group, Nodes, Texts, Values, single, triples

#: Fewer nodes than this are not worth it.
_MANY: Final = 200
#: So many groups of fewer nodes are told at a time.
_FEW: Final = 500
#: Larger files are read as a stream.
_MAX_BYTES: Final = 1 << 28
#: What is read by the pattern means the same in any place; values in another form do not.
_IRI: Final = r"(https?://[A-Za-z0-9.-]+(?::[0-9]+)?/[A-Za-z0-9._~:/@!$*+,;=()-]*)"
_KINDS: Final = {None: _IRI, node(INTEGER): r"([0-9]+)"}
_TEXT: Final = r'([^"\\\x00-\x1f]*)'
_XML_WORDS: Final = r"[^\"<>&\x00-\x08\x0b-\x1f\n\ufffe\uffff]*"
_XML_TEXT: Final = rf"({_XML_WORDS}(?:&(?:lt|gt|amp);{_XML_WORDS})*)"
#: A term that stands for a value; the number is that of its column.
_PLACE: Final = "urn:x-place:"
#: The same for a whole number, which Turtle writes without quotes.
_PLACE_NUMBER: Final = "718281828459045"
_PLACES: Final = re.compile(rf"{_PLACE}(\d+)\.|{_PLACE_NUMBER}(\d{{3}})")
#: Texts that stand in every syntax as they are, and in Turtle all with quotes or all without.
_PLAIN: Final[dict[Any, str]] = {node(INTEGER): "[0-9\0]*", node(DOUBLE): "[0-9.+\0-]*"}
#: In comments, long texts and what is read as it stands, nodes are none.
_HIDING: Final = ("<!", '"""', "'''")
_UNESCAPED: Final = r'[^"\\\x01-\x1f\x7f]*'
_QUOTES: Final = {'"': "&quot;", "'": "&apos;"}


class _Writer:
    """A syntax and its prefixes; `head` and `end` stand before all nodes and after them."""

    def __init__(self, syntax: ox.RdfFormat, prefixes: dict[str, str]) -> None:
        self.syntax, self.prefixes, self.head, self.end = syntax, prefixes, "", ""
        if syntax == ox.RdfFormat.JSON_LD:
            self.head, self.end = jsonld.head(prefixes), jsonld.END
        elif syntax == ox.RdfFormat.RDF_XML:
            self.head, self.end = re.split("(?=\n</rdf:RDF>)", self.told([]))
        else:  # Turtle begins with its prefixes where anything is told
            self.head = self.told([single(_PLACE, "rdf:Property")]).partition(f"<{_PLACE}")[0]

    def told(self, groups: Iterable[Group]) -> str:
        """The nodes of groups."""
        if self.syntax == ox.RdfFormat.JSON_LD:
            return jsonld.lines(groups)
        text = ox.serialize(triples(groups), None, self.syntax, prefixes=self.prefixes) or b""
        return text.decode().removeprefix(self.head).removesuffix(self.end)


def write_repeated(
    groups: Iterable[Group], file: IO[bytes], syntax: ox.RdfFormat, prefixes: dict[str, str]
) -> None:
    """Write groups of nodes in a syntax, as they come."""
    writer = _Writer(syntax, prefixes)
    file.write(writer.head.encode())
    comma = ","
    for many, some in groupby(groups, lambda group: len(group[0].subjects) >= _MANY):
        # Few at a time, so that a farm's fields stream.
        while batch := list(islice(some, 1 if many else _FEW)):
            columns: list[list[str]] = []
            if many:
                batch[0], columns = _one(batch[0], is_xml=syntax == ox.RdfFormat.RDF_XML)
            text = writer.told(batch)
            if columns:
                places = [int(a or b) for a, b in _PLACES.findall(text)]
                pattern = _PLACES.sub("%s", text.replace("%", "%%"))
                rows = zip(*(columns[number] for number in places), strict=True)
                text = "".join(map(pattern.__mod__, rows))
            # Before the first node of JSON there is no comma.
            file.write(text.removeprefix(comma).encode())
            comma = "" if text else comma
    file.write(writer.end.encode())


def _one(group: Group, *, is_xml: bool) -> tuple[Group, list[list[str]]]:
    """The first row with places for its values, and the values; all rows where one differs."""
    columns: list[list[str]] = []

    def place(values: Values) -> Any:
        if isinstance(values, ox.NamedNode | ox.Literal):
            return values
        if not isinstance(values, Texts) or None in values:
            raise ValueError(values)
        kind, texts = values.datatype, "\0".join(values)
        if not re.fullmatch(_PLAIN.get(kind, "(?s:.*)" if is_xml else _UNESCAPED), texts):
            raise ValueError(kind)
        columns.append((escape(texts, _QUOTES) if is_xml else texts).split("\0"))
        number = len(columns) - 1
        text = f"{_PLACE_NUMBER}{number:03d}" if kind in _PLAIN else f"{_PLACE}{number}."
        one = Texts([text])
        one.datatype = kind
        return one

    try:
        one: Any = [
            Nodes(place(each.subjects), [(name, place(values)) for name, values in each.columns])
            for each in group
        ]
    except ValueError:
        return group, []
    return tuple(one), columns


def repeated(path: Path, syntax: ox.RdfFormat) -> Graph | None:
    """The graph of a file of many track points as geofield writes them; None for any other."""
    try:
        text = path.read_bytes().decode("utf-8") if path.stat().st_size <= _MAX_BYTES else ""
        for point, sample, shape in _points(syntax):
            short, runs, columns = _parted(text, sample, shape)
            if runs and not any(each in short for each in _HIDING):
                if syntax == ox.RdfFormat.JSON_LD:
                    check_json(short, path.name)
                elif syntax == ox.RdfFormat.RDF_XML:
                    check_xml(io.BytesIO(short.encode()), path.name)
                    columns = [unescape("\n".join(each)).split("\n") for each in columns]
                rest = [(s.value, p.value, o) for s, p, o, _ in ox.parse(short, syntax)]
                return _graph(rest, point, runs, columns)
    except (OSError, UnicodeError, SyntaxError, FormatError):
        pass
    return None


@cache
def _points(syntax: ox.RdfFormat) -> list[tuple[Group, str, re.Pattern[str]]]:
    """A track point with places for its values, its text, and what matches any: of each profile."""
    row = pd.DataFrame({column.name: [1] for column in schema.TRACK_POINTS.columns})
    writer = _Writer(syntax, StudyDescription.prefixes)
    told = []
    for point_of in (point_group, study_points):
        one, _ = _one(point_of(row, Names(*[""] * 7)), is_xml=False)
        sample = writer.told([one])
        told.append((one, sample, _shape(one, sample, is_xml=syntax == ox.RdfFormat.RDF_XML)))
    return told


def _shape(one: Group, sample: str, *, is_xml: bool) -> re.Pattern[str]:
    """What nodes like a sample match, with a group for each value."""
    values = [value for each in one for value in (each.subjects, *(v for _, v in each.columns))]
    text = _XML_TEXT if is_xml else _TEXT
    kinds = [_KINDS.get(each.datatype, text) for each in values if isinstance(each, Texts)]
    shape, place, known = "", 0, 0
    for found in _PLACES.finditer(sample):
        number = int(found[1] or found[2])
        shape += re.escape(sample[place : found.start()])
        # A name that is told again is the same one.
        shape += rf"(?:\{number + 1})" if number < known else kinds[number]
        place, known = found.end(), max(known, number + 1)
    return re.compile(shape + re.escape(sample[place:]))


def _parted(text: str, sample: str, shape: re.Pattern[str]) -> tuple[str, int, list[list[str]]]:
    """A text with two samples in place of each run, how many runs, and the values; 0 for few.

    The nodes of a run follow each other without anything between, and differ in values that
    stand in any place as they are: what two samples mean there, all of them mean.
    """
    # What is not there is sought much longer than what is.
    if not all(each in text for each in _PLACES.split(sample)[:: _PLACES.groups + 1]):
        return "", 0, []
    width = shape.groups + 1
    parts = shape.split(text)
    *before, tail = parts[::width]
    starts = [n for n, each in enumerate(before) if each or not n]
    if len(before) < _MANY * max(len(starts), 1):
        return "", 0, []
    short = "".join(f"{before[n]}{sample}{sample}" for n in starts) + tail
    return short, len(starts), [parts[n::width] for n in range(1, width)]


def _graph(
    rest: list[tuple[str, str, Any]], point: Group, runs: int, columns: list[list[str]]
) -> Graph | None:
    """The graph of triples with points in place of their samples; None where those differ."""
    samples = [each for each in rest if each[0].startswith(_PLACE)]
    rest = [each for each in rest if not each[0].startswith(_PLACE)]
    one = [(s.value, p.value, o) for s, p, o in triples([point])]
    # With one of their class that is told otherwise, only the parser knows their order.
    classes = {o for _, p, o in one if p == TYPE}
    if samples != one * 2 * runs or any(p == TYPE and o in classes for _, p, o in rest):
        return None
    others, values = {s for s, _, _ in rest}, iter(columns)
    graph = Graph()
    graph.add((s, p, o.value) for s, p, o in rest)
    for nodes in point:
        subjects = next(values)
        if len(set(subjects)) < len(subjects) or not others.isdisjoint(subjects):
            return None
        for predicate, value in nodes.columns:
            if isinstance(value, ox.NamedNode | ox.Literal):
                pairs = dict.fromkeys(subjects, value.value)
            else:
                pairs = dict(zip(subjects, next(values), strict=True))
            graph.merge(Graph({predicate.value: pairs}))
    return graph
