"""Repeated: the many nodes of one shape in RDF/XML, written and read by the pattern of one.

Tens of thousands of track points are told in the same words with other values. pyoxigraph writes
and reads one of them and all else; the others follow its pattern, in a third of the time.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import IO, Any, Final
from xml.sax.saxutils import escape, unescape

import pyoxigraph as ox

from geofield.formats.rdf.graph import Graph
from geofield.formats.rdf.guard import MAX_PLAIN_BYTES
from geofield.formats.rdf.triples import Group, Nodes, Typed, triples

#: Fewer nodes than this are not worth it.
_MANY: Final = 200
#: Values in the text of a node: names of things, and texts.
_VALUE: Final = re.compile(r' rdf:(about|resource)="([^"]*)|>([^<\n]+)<')
#: What the pattern takes in their place: a plain absolute IRI, or a text on one line.
_IRI: Final = r"(https?://[A-Za-z0-9._~:/@!$*+,;=()-]+)"
_TEXT: Final = r"([^\"<>&\r\n]*(?:&(?:lt|gt|amp);[^\"<>&\r\n]*)*)"
#: A file of one element a line and one node after the other: none stands inside another.
_PLAIN: Final = re.compile(
    r'<\?xml version="1\.0" encoding="UTF-8"\?>\n<rdf:RDF(?: xmlns:\w+="[^"<>&]+")+>\n'
    r'(?:\0|\t<([\w:.-]+) rdf:about="[^"<>]*">\n'
    r'(?:\t\t<([\w:.-]+)(?: rdf:[a-z]+="[^"<>]*")?(?:/>|>[^<>]*</\2>)\n)*\t</\1>\n)*</rdf:RDF>\n?'
)
#: A term that stands for a value; the number is that of its column.
_PLACE: Final = "urn:x-place:"
_SEVERAL: Final = {tuple, type(None)}
_QUOTES: Final = {'"': "&quot;", "'": "&apos;"}


def write_xml(groups: Iterable[Group], file: IO[bytes], prefixes: dict[str, str]) -> None:
    """Write groups of nodes as RDF/XML, as they come."""

    def told(groups: Iterable[Group]) -> bytes:
        return ox.serialize(triples(groups), None, ox.RdfFormat.RDF_XML, prefixes=prefixes) or b""

    head, end, tail = told([]).partition(b"</rdf:RDF>")
    file.write(head)
    for group in groups:
        one, columns = _one(group) if len(group[0].subjects) >= _MANY else (group, [])
        text = told([one]).removeprefix(head).removesuffix(end + tail)
        if columns:
            before, *rest = re.split(_PLACE + r"(\d+)\.", text.decode().replace("%", "%%"))
            pattern = "%s".join((before, *rest[1::2]))
            rows = zip(*(columns[int(number)] for number in rest[::2]), strict=True)
            text = "".join(map(pattern.__mod__, rows)).encode()
        file.write(text)
    file.write(end + tail)


def _one(group: Group) -> tuple[Group, list[list[str]]]:
    """The first row with places for its values, and the values; all rows where one differs."""
    columns: list[list[str]] = []

    def place(values: Sequence[Any]) -> Any:
        own = isinstance(values, Typed)
        kinds: set[Any] = {values.datatype} if isinstance(values, Typed) else set(map(type, values))
        if kinds & _SEVERAL or (own and None in values):
            raise ValueError(kinds)
        if kinds == {ox.Literal}:
            kinds = {each.datatype for each in values}
        texts: Sequence[str] = values if own else [each.value for each in values]
        (kind,) = kinds
        alike = texts[0] == texts[-1] and len(set(texts)) == 1
        if not alike:
            columns.append(escape("\0".join(texts), _QUOTES).split("\0"))
        text = texts[0] if alike else f"{_PLACE}{len(columns) - 1}."
        return ox.NamedNode(text) if kind is ox.NamedNode else ox.Literal(text, datatype=kind)

    try:
        one = [
            Nodes(
                [place(each.subjects)], [(name, [place(values)]) for name, values in each.columns]
            )
            for each in group
        ]
    except ValueError:  # terms of several kinds in one column, too
        return group, []
    return tuple(one), columns


def repeated(path: Path) -> Graph | None:
    """The graph of a file that ends in many nodes of one shape; None for any other file."""
    try:
        whole = path.stat().st_size <= MAX_PLAIN_BYTES
        text = path.read_bytes().decode("utf-8") if whole else ""
    except (OSError, UnicodeDecodeError):
        return None
    end = text.rfind("</rdf:RDF>")
    last = text.rfind("\n\t</", 0, max(end, 0)) + 1
    # From the end of the last but one of its class: a point and its geometry are one sample.
    start = text.rfind(text[last:end], 0, last) + end - last
    sample, shape, values, place = text[start:end], "", [], 0
    for found in _VALUE.finditer(sample):
        begin, stop = found.span(found.lastindex or 0)
        shape += re.escape(sample[place:begin]) + (_IRI if found[1] else _TEXT)
        values.append((found[1] == "about", unescape(sample[begin:stop])))
        place = stop
    count = len(values)
    parts = re.split(shape + re.escape(sample[place:]), text) if count > 1 else []
    if len(parts) < _MANY * (count + 1) or parts[-1] != text[end:] or "\0" in text:
        return None
    rest = "\0".join(parts[:: count + 1]).removesuffix(text[end:])
    # With one of them that is told otherwise, only the parser knows their order.
    if sample[: sample.find(" ")] in rest or not _PLAIN.fullmatch(rest + sample + text[end:]):
        return None
    try:
        one = ox.parse(rest.replace("\0", "") + sample + text[end:], ox.RdfFormat.RDF_XML)
        triples = [(s.value, p.value, o.value) for s, p, o, _ in one]
    except SyntaxError:
        return None
    graph = Graph()
    graph.add(triples[:-count])
    for index, (s, p, o) in enumerate(triples[-count:]):
        about, value = values[index]
        column = unescape("\n".join(parts[index + 1 :: count + 1])).split("\n")
        if about:
            subjects, subject = column, value
        told = dict.fromkeys(subjects, o) if about else dict(zip(subjects, column, strict=True))
        if subject != s or (value != o and not about) or len(told) != len(column):
            return None
        graph.merge(Graph({p: told}))
    return graph
