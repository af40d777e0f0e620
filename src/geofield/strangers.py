"""Files of strangers: what is looked at before a library opens them.

GDAL knows formats that are no data but directions: an OGR VRT, a WFS or a pipeline in a few
lines of XML or JSON, recognised by their content whatever the file is called, and pointing at
any file or host. XML may define entities that fill the memory or name other files. Both are
refused here, for every reader.
"""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import NoReturn
from xml.etree import ElementTree as ET
from xml.parsers import expat

from geofield.errors import FormatError

#: GDAL looks for these in the beginning of a file.
_DIRECTIONS = {
    b"<OGRVRTDataSource": "an OGR VRT",
    b"<OGRWFSDataSource": "a WFS connection",
    b"<OGRCSWDataSource": "a CSW connection",
    b"gdal_streamed_alg": "a GDAL pipeline",
    b"<GDAL_WMS": "a WMS connection",
    b"<GDAL_WMTS": "a WMTS connection",
    b"<VRTDataset": "a VRT",
    b"<WCS_GDAL": "a WCS connection",
}
#: So begin TIFF (BigTIFF, too), PNG, JPEG and JPEG 2000: GDAL would only tell of its drivers.
PICTURES = (
    b"II*\0", b"MM\0*", b"II+\0", b"MM\0+", b"\x89PNG", b"\xff\xd8\xff", b"\0\0\0\x0cjP",
)  # fmt: skip
_HEAD_BYTES = 1 << 18
_HINT = "Nothing was read. Ask its maker for a file without it."
#: Elements inside elements; an honest file needs about 20.
MAX_DEPTH = 200


@contextmanager
def database(path: Path, *, timeout_s: float = 5.0) -> Iterator[sqlite3.Connection]:
    """A SQLite file, for reading alone."""
    uri = f"{path.absolute().as_uri()}?mode=ro"
    with closing(sqlite3.connect(uri, uri=True, timeout=timeout_s)) as connection:
        yield connection


def is_geopackage(path: Path) -> bool:
    """Whether a file is a GeoPackage, by its name or content: earlier plans end in .bak."""
    if not path.is_file():
        return False
    if path.suffix.lower() == ".gpkg":
        return True
    with path.open("rb") as file:
        return file.read(72)[68:] in (b"GPKG", b"GP10", b"GP11")


def unreadable(path: Path, error: Exception) -> FormatError:
    """That a library cannot read a file, in its own words without what programmers may try."""
    reason = re.split("[.;]+ It might help", str(error))[0].rstrip(".")
    hint = "It is a folder: name a file in it." if path.is_dir() else "Is the file whole?"
    return FormatError(f"{path} cannot be read: {reason}.", hint=hint)


class _RootSeenError(Exception):
    """The prolog is over: no entity can be defined behind it."""


def check_vector(path: Path | str) -> None:
    """Refuse a vector file that is empty or only points elsewhere, and a picture.

    XML that defines entities is refused, too.

    Raises
    ------
    FormatError
        Naming file and reason.
    """
    file = Path(path)
    if not file.is_file():
        return
    try:
        with file.open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
    except OSError as error:
        raise FormatError(f"{file} cannot be read: {error.strerror}.") from None
    if not head:
        raise FormatError(f"{file} is empty (0 bytes).", hint="Copy it again.")
    if head.startswith(PICTURES):
        raise FormatError(
            f"{file} is a picture; what is wanted here are shapes (polygons, points, lines).",
            hint="Give the picture to `geofield run` or `geofield field`, which find the outline "
            "in it.",
        )
    for mark, what in _DIRECTIONS.items():
        if mark in head:
            raise FormatError(
                f"{file} holds no data itself: it is {what}, which leads to other files or hosts.",
                hint="Give the data itself, for instance saved from QGIS as a GeoPackage.",
            )
    if b"<" in head[:200] and file.suffix.lower() in (".xml", ".gml", ".kml", ".gpx", ".osm"):
        check_prolog(head, file.name)


def check_prolog(head: bytes, name: str) -> None:
    """Refuse XML that defines entities or names an external document type.

    `head` reaches as far as the root element at least; `name` is for messages.

    Raises
    ------
    FormatError
    """

    def refuse(reason: str) -> NoReturn:
        raise FormatError(f"{name}: {reason}.", hint=_HINT)

    def entity(entity_name: str, *_: object) -> None:
        refuse(f"it defines the XML entity {entity_name!r:.40}")

    def doctype(_: str, system: str | None, public: str | None, internal: bool) -> None:
        if system or public:
            refuse(f"it names an external document type ({(system or public)!r:.80})")

    def root(*_: object) -> NoReturn:
        raise _RootSeenError

    parser = expat.ParserCreate()
    parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)
    parser.EntityDeclHandler = entity
    parser.StartDoctypeDeclHandler = doctype
    parser.StartElementHandler = root
    try:
        parser.Parse(head, False)
    except _RootSeenError:
        return
    except expat.ExpatError:
        return  # not well-formed: its reader says where
    except (LookupError, ValueError):
        return  # an encoding that Python does not know: the reader says so


def parse_xml(body: bytes, name: str) -> ET.Element:
    """The root of a document that defines no entities and is nested like an honest one.

    Raises
    ------
    FormatError
        Hostile.
    xml.etree.ElementTree.ParseError
        Not well-formed; also for an encoding that is not known.
    """
    check_prolog(body, name)
    parser = ET.XMLParser(target=_Nested(name))  # noqa: S314  no entities are left
    try:
        parser.feed(body)
        root: ET.Element = parser.close()
    except (LookupError, ValueError) as error:
        raise ET.ParseError(str(error)) from None
    return root


class _Nested(ET.TreeBuilder):
    """Builds the tree of a document, but no deeper than an honest one is."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name
        self._depth = 0

    def start(self, tag: str, attrs: dict[str, str], /) -> ET.Element:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise FormatError(
                f"{self._name}: its elements are nested deeper than {MAX_DEPTH}.", hint=_HINT
            )
        return super().start(tag, attrs)

    def end(self, tag: str, /) -> ET.Element:
        self._depth -= 1
        return super().end(tag)
