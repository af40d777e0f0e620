"""Repeated: the many nodes of one shape, written and read by the pattern of one.

Tens of thousands of track points are told in the same words with other values. pyoxigraph writes
and reads one of them and all else; the others follow its pattern, in a third of the time.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby, islice
from pathlib import Path
from typing import IO, Any, Final
from xml.sax.saxutils import escape, unescape

import pyoxigraph as ox

from geofield.errors import FormatError
from geofield.formats.rdf.graph import Graph
from geofield.formats.rdf.guard import check_json
from geofield.formats.rdf.namespaces import TYPE, node
from geofield.formats.rdf.triples import Group, Nodes, Typed, single, triples

#: Fewer nodes than this are not worth it.
_MANY: Final = 200
#: So many groups of fewer nodes are told at a time.
_FEW: Final = 500
#: Larger files are read as a stream.
_MAX_BYTES: Final = 1 << 28
#: So many characters may tell one feature and its geometry.
_MAX_SAMPLE: Final = 10_000
#: A value that other nodes have in another form is none of the pattern.
_IRI: Final = r"(https?://[A-Za-z0-9.-]+(?::[0-9]+)?/[A-Za-z0-9._~:/@!$*+,;=()-]*)"
_NUMBER: Final = r"([0-9]+)"
_TEXT: Final = r'([^"\\\x00-\x1f]*)'
_XML_WORDS: Final = r"[^\"<>&\x00-\x08\x0b-\x1f\n\ufffe\uffff]*"
_XML_TEXT: Final = rf"({_XML_WORDS}(?:&(?:lt|gt|amp);{_XML_WORDS})*)"
_STRING: Final = r'"[^"\\\n\0]*(?:\\.[^"\\\n\0]*)*"'
#: A term that stands for a value; the number is that of its column.
_PLACE: Final = "urn:x-place:"
#: The same for a whole number, which Turtle writes without quotes.
_PLACE_NUMBER: Final = "718281828459045"
_PLACES: Final = re.compile(rf"{_PLACE}(\d+)\.|{_PLACE_NUMBER}(\d{{3}})")
#: What Turtle may write without quotes, and the texts of it that are all written alike.
_INTEGER, _DOUBLE, _DECIMAL, _BOOLEAN = map(
    node, ("xsd:integer", "xsd:double", "xsd:decimal", "xsd:boolean")
)
_BARE: Final = {_INTEGER: "[0-9\0]*", _DOUBLE: "[^eE]*", _DECIMAL: "(?!)", _BOOLEAN: "(?!)"}
_SEVERAL: Final = {tuple, type(None)}
_QUOTES: Final = {'"': "&quot;", "'": "&apos;"}


@dataclass(frozen=True, slots=True)
class _Form:
    """A syntax as geofield writes it.

    Attributes
    ----------
    value : str
        Values in the text of a node: first of all the name of the node itself.
    plain : str
        A whole file in which every node stands by itself, outside of texts, comments and other
        nodes, as does each NUL: the place of a node that follows the pattern.
    between, end : str
        What stands between lines, and after the last node.
    text, unescape
        A text on one line, as a group, and what it means.
    """

    value: str
    plain: str
    between: str = "\n"
    end: str = "\n"
    text: str = _TEXT
    unescape: Callable[[str], str] = str


_TURTLE_WORDS = rf'(?:{_STRING}(?!")|<[^<>"\n\0]*>|[^"\'<>#.\n\0])*'
_JSON_WORDS = rf'(?:{_STRING}|\{{(?:{_STRING}|[^"{{}}\n\0])*\}}|[^"{{}}\n\0])*'
_FORMS: Final = {
    ox.RdfFormat.RDF_XML: _Form(
        r' rdf:about="([^"]*)| rdf:resource="([^"]*)|>([^<\n]+)<',
        r'<\?xml version="1\.0" encoding="UTF-8"\?>\n<rdf:RDF(?: xmlns:\w+="[^"<>&]+")+>'
        r'(?:\0|\n\t<([\w:.-]+) rdf:about="[^\s"<>{}|^`\\]*">\n'
        r'(?:\t\t<([\w:.-]+)(?: rdf:[a-z]+="[^\s"<>{}|^`\\]*")?'
        r"(?:/>|>(?:[^<>&\x00-\x08\x0b-\x1f\ufffe\uffff]|&[a-z]+;)*</\2>)\n)*\t</\1>)*"
        r"\n</rdf:RDF>\n?",
        end="\n</rdf:RDF>",
        text=_XML_TEXT,
        unescape=unescape,
    ),
    ox.RdfFormat.TURTLE: _Form(
        r'(?m)^<([^>]*)>| <([^>]*)>(?= [;.])|"([^"\n]*)"|(?<= )([0-9]+)(?= [;.])',
        r"(?:@prefix \w+: <[^<>\"\n\0]*> \.\n)*"
        # The study's root is named by its prefix alone: "obstacle: rdfs:member".
        r"(?:\0|\n?(?:<[^<>\"\n\0]*>|[a-z]+:)"
        rf"{_TURTLE_WORDS}(?: ;\n\t{_TURTLE_WORDS})* \.(?=[\n\0]))*\n",
    ),
    ox.RdfFormat.N_TRIPLES: _Form(
        r'(?m)^<([^>]*)>|(?<!#type>) <([^>]*)>(?= \.)|"([^"\n]*)"',
        r"[^\n\0]*(?:\n[^\n\0]*|\0(?=[\n\0]))*",
    ),
    ox.RdfFormat.JSON_LD: _Form(
        r'(?m)^\{"@id": "([^"]*)"|(?<!"@type": )"([^"\n]*)"(?=[,}])',
        r'\{\n"@context": \{(?:\n [^\n\0]*)*\n\},\n"@graph": \['
        rf"(?:\0|,?\n\{{{_JSON_WORDS}\}})*\n\]\n\}}\n",
        between=",\n",
        end="\n]\n}\n",
    ),
}


def write_repeated(
    groups: Iterable[Group], file: IO[bytes], syntax: ox.RdfFormat, prefixes: dict[str, str]
) -> None:
    """Write groups of nodes as RDF/XML, Turtle or N-Triples, as they come."""

    def told(groups: Iterable[Group]) -> bytes:
        return ox.serialize(triples(groups), None, syntax, prefixes=prefixes) or b""

    head, end, tail = told([]).partition(b"</rdf:RDF>")
    if not head:  # Turtle begins with its prefixes where anything is told
        head = told([single(_PLACE, "rdf:Property")]).partition(b"<" + _PLACE.encode())[0]
    file.write(head)
    for many, some in groupby(groups, lambda group: len(group[0].subjects) >= _MANY):
        # Few at a time, so that a farm's fields stream.
        while batch := list(islice(some, 1 if many else _FEW)):
            columns: list[list[str]] = []
            if many:
                batch[0], columns = _one(batch[0], syntax, prefixes)
            text = told(batch).removeprefix(head).removesuffix(end + tail)
            if columns:
                one = text.decode()
                places = [int(a or b) for a, b in _PLACES.findall(one)]
                pattern = _PLACES.sub("%s", one.replace("%", "%%"))
                rows = zip(*(columns[number] for number in places), strict=True)
                text = "".join(map(pattern.__mod__, rows)).encode()
            file.write(text)
    file.write(end + tail)


def _one(
    group: Group, syntax: ox.RdfFormat, prefixes: dict[str, str]
) -> tuple[Group, list[list[str]]]:
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
        text = texts[0]
        if not alike:
            text = f"{_PLACE}{len(columns)}."
            if syntax == ox.RdfFormat.TURTLE and kind == _INTEGER:
                text = f"{_PLACE_NUMBER}{len(columns):03d}"
            columns.append(_written("\0".join(texts), kind, syntax, prefixes).split("\0"))
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


def _written(texts: str, kind: Any, syntax: ox.RdfFormat, prefixes: dict[str, str]) -> str:
    """Texts with a NUL between them as they stand in a file.

    Raises
    ------
    ValueError
        When some may stand there in another form than others: escaped, or shortened.
    """
    if syntax == ox.RdfFormat.RDF_XML:
        return escape(texts, _QUOTES)
    if kind is ox.NamedNode:
        shortened = syntax == ox.RdfFormat.TURTLE and any(
            f"\0{each}" in f"\0{texts}" for each in prefixes.values()
        )
        plain = not shortened
    elif syntax == ox.RdfFormat.TURTLE and kind in _BARE:
        plain = re.fullmatch(_BARE[kind], texts) is not None
    else:
        plain = re.search(r'["\\\x01-\x1f\x7f]', texts) is None
    if not plain:
        raise ValueError(kind)
    return texts


def repeated(path: Path, syntax: ox.RdfFormat) -> Graph | None:
    """The graph of a file that ends in many nodes of one shape; None for any other file."""
    form = _FORMS[syntax]
    try:
        text = path.read_bytes().decode("utf-8") if path.stat().st_size <= _MAX_BYTES else ""
        short, values, columns = _parted(form, text)
        if syntax == ox.RdfFormat.JSON_LD:
            check_json(short, path.name)
        one = [(s.value, p.value, o) for s, p, o, _ in ox.parse(short, syntax)]
    except (OSError, UnicodeDecodeError, LookupError, SyntaxError, FormatError):
        return None
    told, one = one[-len(values) :], one[: -len(values)]
    # With one of their class that is told otherwise, only the parser knows their order.
    classes = {o for _, p, o in told if p == TYPE}
    if len(told) != len(values) or any(p == TYPE and o in classes for _, p, o in one):
        return None
    others = {s for s, _, _ in one}
    graph = Graph()
    graph.add((s, p, o.value) for s, p, o in one)
    subject, subjects = "", [""]
    for (s, p, o), (is_subject, value), column in zip(told, values, columns, strict=True):
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


def _parted(form: _Form, text: str) -> tuple[str, list[tuple[bool, str]], list[list[str]]]:
    """A text with one of its repeated nodes, the values of that one, and those of all.

    Raises
    ------
    LookupError
        When there are not many such nodes, or not all of them stand by themselves.
    """
    end = max(text.rfind(form.end), 0)
    # Back to a line like the last one: a point and its geometry are one sample.
    *lines, line = text[max(end - _MAX_SAMPLE, 0) : end].split(form.between)
    last, _ = _pattern(form, line)
    count = next(n for n, each in enumerate([*lines[:0:-1], line]) if re.fullmatch(last, each))
    sample = form.between.join(["", *lines[len(lines) - count :], line])
    shape, values = _pattern(form, sample)
    width, tail = len(values) + 1, text[end:]
    parts = re.split(shape, text)
    if len(parts) < _MANY * width or parts[-1] != tail or width == 1 or "\0" in text:
        raise LookupError(shape)
    rest = "\0".join(parts[::width]).removesuffix(tail)
    if not re.fullmatch(form.plain, rest + sample + tail):
        raise LookupError(rest)
    told = form.unescape
    # Texts that lie side by side are looked up faster than those of the parts.
    columns = [told("\n".join(parts[index::width])).split("\n") for index in range(1, width)]
    short = rest.replace("\0", "") + sample + tail
    return short, [(is_subject, told(value)) for is_subject, value in values], columns


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
