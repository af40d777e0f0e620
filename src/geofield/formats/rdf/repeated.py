"""Repeated: the many nodes of one shape, written and read by the pattern of one.

Tens of thousands of track points are told in the same words with other values. A serialiser
writes one of them and all else, pyoxigraph reads two of each run and all else; the others follow
their pattern, in a third of the time.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import groupby, islice
from pathlib import Path
from typing import IO, Any, Final
from xml.sax.saxutils import escape, unescape

import pyoxigraph as ox

from geofield.errors import FormatError
from geofield.formats.rdf import jsonld
from geofield.formats.rdf.graph import Graph
from geofield.formats.rdf.guard import check_json, check_xml
from geofield.formats.rdf.namespaces import DOUBLE, INTEGER, TYPE, node
from geofield.formats.rdf.triples import Group, Nodes, Texts, Values, single, triples

#: Fewer nodes than this are not worth it.
_MANY: Final = 200
#: So many groups of fewer nodes are told at a time.
_FEW: Final = 500
#: Larger files are read as a stream.
_MAX_BYTES: Final = 1 << 28
#: So many characters may tell one feature and its geometry.
_MAX_SAMPLE: Final = 10_000
#: Values that other nodes have in another form are none of the pattern.
_IRI: Final = r"(https?://[A-Za-z0-9.-]+(?::[0-9]+)?/[A-Za-z0-9._~:/@!$*+,;=()-]*)"
_NUMBER: Final = r"([0-9]+)"
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


@dataclass(frozen=True, slots=True)
class _Form:
    """A syntax as geofield writes it.

    Attributes
    ----------
    value : str
        Values in the text of a node; the first group is the node's own name.
    between, end : str
        What stands between lines, and after the last node.
    text, unescape
        A text on one line, as a group, and what it means.
    """

    value: str
    between: str = "\n"
    end: str = "\n"
    text: str = _TEXT
    unescape: Callable[[str], str] = str


_FORMS: Final = {
    ox.RdfFormat.RDF_XML: _Form(
        r' rdf:about="([^"]*)| rdf:resource="([^"]*)|>([^<\n]+)<',
        end="\n</rdf:RDF>",
        text=_XML_TEXT,
        unescape=unescape,
    ),
    ox.RdfFormat.TURTLE: _Form(
        r'(?m)^<([^>]*)>| <([^>]*)>(?= [;.])|"([^"\n]*)"|(?<= )([0-9]+)(?= [;.])'
    ),
    ox.RdfFormat.N_TRIPLES: _Form(r'(?m)^<([^>]*)>|(?<!#type>) <([^>]*)>(?= \.)|"([^"\n]*)"'),
    ox.RdfFormat.JSON_LD: _Form(
        r'(?m)^\{"@id": "([^"]*)"|(?<!"@type": )"([^"\n]*)"(?=[,}])', ",\n", jsonld.END
    ),
}


def write_repeated(
    groups: Iterable[Group], file: IO[bytes], syntax: ox.RdfFormat, prefixes: dict[str, str]
) -> None:
    """Write groups of nodes in a syntax, as they come."""

    def told(groups: Iterable[Group]) -> str:
        if syntax == ox.RdfFormat.JSON_LD:
            return jsonld.lines(groups)
        text = ox.serialize(triples(groups), None, syntax, prefixes=prefixes) or b""
        return text.decode().removeprefix(head).removesuffix(end)

    head = end = ""
    if syntax == ox.RdfFormat.JSON_LD:
        head, end = jsonld.head(prefixes), jsonld.END
    elif syntax == ox.RdfFormat.RDF_XML:
        head, end = re.split("(?=\n</rdf:RDF>)", told([]))
    else:  # Turtle begins with its prefixes where anything is told
        head = told([single(_PLACE, "rdf:Property")]).partition(f"<{_PLACE}")[0]
    file.write(head.encode())
    comma = ","
    for many, some in groupby(groups, lambda group: len(group[0].subjects) >= _MANY):
        # Few at a time, so that a farm's fields stream.
        while batch := list(islice(some, 1 if many else _FEW)):
            columns: list[list[str]] = []
            if many:
                batch[0], columns = _one(batch[0], is_xml=syntax == ox.RdfFormat.RDF_XML)
            text = told(batch)
            if columns:
                places = [int(a or b) for a, b in _PLACES.findall(text)]
                pattern = _PLACES.sub("%s", text.replace("%", "%%"))
                rows = zip(*(columns[number] for number in places), strict=True)
                text = "".join(map(pattern.__mod__, rows))
            # Before the first node of JSON there is no comma.
            file.write(text.removeprefix(comma).encode())
            comma = "" if text else comma
    file.write(end.encode())


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
    """The graph of a file that ends in many nodes of one shape; None for any other file."""
    form = _FORMS[syntax]
    try:
        text = path.read_bytes().decode("utf-8") if path.stat().st_size <= _MAX_BYTES else ""
        short, runs, values, columns = _parted(form, text)
        if any(each in short for each in _HIDING):
            return None
        if syntax == ox.RdfFormat.JSON_LD:
            check_json(short, path.name)
        elif syntax == ox.RdfFormat.RDF_XML:
            check_xml(io.BytesIO(short.encode()), path.name)
        rest = [(s.value, p.value, o) for s, p, o, _ in ox.parse(short, syntax)]
    except (OSError, UnicodeError, LookupError, SyntaxError, FormatError):
        return None
    one = rest[-len(values) :]
    found, rest = _without(rest, [*one, *one])
    # With one of their class that is told otherwise, only the parser knows their order.
    classes = {o for _, p, o in one if p == TYPE}
    if found != runs or any(p == TYPE and o in classes for _, p, o in rest):
        return None
    others = {s for s, _, _ in rest}
    graph = Graph()
    graph.add((s, p, o.value) for s, p, o in rest)
    subject, subjects = "", [""]
    for (s, p, o), (is_subject, value), column in zip(one, values, columns, strict=True):
        # A name that is no whole IRI may be another one in another place.
        named = re.fullmatch(_IRI, value) is not None
        if is_subject:
            subject, subjects = value, column
            pairs, known = dict.fromkeys(column, o.value), named and p == TYPE
            known = known and others.isdisjoint(column)
        else:
            pairs = dict(zip(subjects, column, strict=False))
            known = (named or isinstance(o, ox.Literal)) and o.value == value
        if not known or s != subject or len(pairs) != len(column):
            return None
        graph.merge(Graph({p: pairs}))
    return graph


def _without(triples: list[Any], pair: list[Any]) -> tuple[int, list[Any]]:
    """How often triples stand among others, and the others."""
    found, others, place = 0, [], 0
    while place < len(triples):
        if triples[place] == pair[0] and triples[place : place + len(pair)] == pair:
            found, place = found + 1, place + len(pair)
        else:
            others.append(triples[place])
            place += 1
    return found, others


def _parted(form: _Form, text: str) -> tuple[str, int, list[tuple[bool, str]], list[list[str]]]:
    """A text with two nodes in place of each run, how many runs, the values of one, and of all.

    The nodes of a run follow each other without anything between, and differ in values that
    stand in any place as they are: what the first two mean there, all of them mean.

    Raises
    ------
    LookupError
        When there are not many such nodes.
    """
    end = max(text.rfind(form.end), 0)
    # Back to a line like the last one: a point and its geometry are one sample.
    *lines, line = text[max(end - _MAX_SAMPLE, 0) : end].split(form.between)
    last, _ = _pattern(form, line)
    count = next((n for n, each in enumerate([*lines[:0:-1], line]) if re.fullmatch(last, each)))
    sample = form.between.join(["", *lines[len(lines) - count :], line])
    shape, values = _pattern(form, sample)
    width = len(values) + 1
    parts = re.split(shape, text)
    *before, tail = parts[::width]
    starts = [n for n, each in enumerate(before) if each or not n]
    if len(before) < _MANY * max(len(starts), 1) or width == 1 or tail != text[end:]:
        raise LookupError(shape)
    # Texts that lie side by side are looked up faster than those of the parts.
    told = form.unescape
    columns = [told("\n".join(parts[index::width])).split("\n") for index in range(1, width)]
    short = "".join(f"{before[n]}{sample}{sample}" for n in starts) + tail
    return short, len(starts), [(is_subject, told(value)) for is_subject, value in values], columns


def _pattern(form: _Form, sample: str) -> tuple[str, list[tuple[bool, str]]]:
    """What nodes like a sample match, a group for each value; whether it is a subject, and it."""
    values: list[tuple[bool, str]] = []
    shape, place, own = "", 0, 0
    for found in re.finditer(form.value, sample):
        begin, stop = found.span(found.lastindex or 0)
        value, is_subject = sample[begin:stop], found.lastindex == 1
        kind = next((k for k in (_IRI, _NUMBER) if re.fullmatch(k, value)), form.text)
        again = is_subject and own and values[own - 1][1] == value
        shape += re.escape(sample[place:begin]) + (f"(?:\\{own})" if again else kind)
        place = stop
        if not again:
            values.append((is_subject, value))
            own = len(values) if is_subject else own
    return shape + re.escape(sample[place:]), values
