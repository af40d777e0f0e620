"""Repeated: the many nodes of one shape at the end of an RDF/XML file, read as columns.

Tens of thousands of track points are told in the same words with other values. The parser reads
one of them and all else; the others are read by its pattern, in a third of the time.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final
from xml.sax.saxutils import unescape

import pyoxigraph as ox

from geofield.formats.rdf.graph import Graph
from geofield.formats.rdf.guard import MAX_PLAIN_BYTES

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
