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
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn
from urllib.parse import quote
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
#: The file code that every .shp begins with, 9994.
_SHAPEFILE = (9994).to_bytes(4)
_HINT = "Nothing was read. Ask its maker for a file without it."
#: Elements inside elements; an honest file needs about 20.
MAX_DEPTH = 200


@contextmanager
def database(path: Path, *, timeout_s: float = 5.0) -> Iterator[sqlite3.Connection]:
    """A SQLite file, for reading alone."""
    with closing(sqlite3.connect(for_reading(path), uri=True, timeout=timeout_s)) as connection:
        yield connection


def for_reading(path: Path) -> str:
    """The address of a SQLite file that is not written; SQLite knows none with a server in it."""
    plain = path.absolute().as_posix()
    return f"file://{'' if plain.startswith('/') else '/'}{quote(plain, safe='/:')}?mode=ro"


def is_geopackage(path: Path) -> bool:
    """Whether a file is a GeoPackage, by its name or content: earlier plans end in .bak."""
    if not path.is_file():
        return False
    if path.suffix.lower() == ".gpkg":
        return True
    with path.open("rb") as file:
        return file.read(72)[68:] in (b"GPKG", b"GP10", b"GP11")


def picture_file(picture: str | Path) -> Path:
    """The file of a picture: its path, or that in GDAL's name of one among several pictures.

    So are those of a GeoPackage called, ``GPKG:file:table``.
    """
    inner = re.fullmatch("GPKG:(.+):[^:]+", str(picture), re.IGNORECASE)
    return Path(inner[1] if inner else picture)


def unreadable(path: Path, error: Exception) -> FormatError:
    """That a library cannot read a file, in its own words without what programmers may try."""
    reason = re.split("[.;]+ It might help", str(error))[0].rstrip(".")
    hint = "It is a folder: name a file in it." if path.is_dir() else "Is the file whole?"
    if "Geometry type is not supported" in reason:  # of GML with heights and shapes of all kinds
        hint = "Make a file without heights of it: ogr2ogr -dim XY NAME.gpkg FILE"
    return FormatError(f"{path} cannot be read: {reason}.", hint=hint)


class _RootSeenError(Exception):
    """The prolog is over: no entity can be defined behind it."""


def check_vector(path: Path | str) -> None:
    """Refuse a vector file that is empty, a half or only points elsewhere, and a picture.

    XML that defines entities is refused, too, and schemas that GML names are not fetched. Of arcs
    GDAL makes lines of one degree each: with 4, its default, the circle of a pivot of 400 m is
    24 cm too small.

    Raises
    ------
    FormatError
        Naming file and reason.
    """
    import pyogrio

    pyogrio.set_gdal_config_options({"GML_DOWNLOAD_SCHEMA": "NO", "OGR_ARC_STEPSIZE": "1"})
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
    index = (file.with_suffix(suffix) for suffix in (".shx", ".SHX"))
    if head.startswith(_SHAPEFILE) and not any(each.exists() for each in index):
        raise FormatError(
            f"{file.name} lacks its .shx index.", hint="Copy all files of the Shapefile."
        )
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
        # One that is not well-formed, or in an unknown encoding, is told of by its reader.
        with suppress(_RootSeenError, expat.ExpatError, LookupError, ValueError):
            _Prolog(file.name).parser.Parse(head, False)


class XmlGuard:
    """An expat parser that builds nothing: it refuses XML that is hostile.

    That is XML that defines entities, names an external document type, or is nested deeper than
    an honest document is. Who allows more, or less, overrides what is called.
    """

    max_depth = MAX_DEPTH

    def __init__(self, name: str) -> None:
        self.name, self.depth = name, 0
        self.parser = parser = expat.ParserCreate(namespace_separator="")
        parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)
        parser.buffer_text = True
        parser.StartElementHandler = self.start
        parser.EndElementHandler = self.end
        parser.EntityDeclHandler = self.entity
        parser.StartDoctypeDeclHandler = self.doctype

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """An element begins."""
        self.depth += 1
        if self.depth > self.max_depth:
            self.refuse(f"its elements are nested deeper than {self.max_depth}")

    def end(self, tag: str) -> None:
        """An element ends."""
        self.depth -= 1

    def doctype(self, name: str, system: str | None, public: str | None, internal: bool) -> None:
        """A document type is named."""
        if system or public:
            self.refuse(f"it names an external document type ({(system or public)!r:.80})")

    def entity(self, name: str, is_parameter: bool, value: str | None, *_: Any) -> None:
        """An entity is defined; one of another file has no value, and is never asked for."""
        self.refuse(f"it defines the XML entity {name!r:.40}")

    def refuse(self, reason: str) -> NoReturn:
        """Raise what is told."""
        raise FormatError(f"{self.name}: {reason}.", hint=_HINT)


class _Prolog(XmlGuard):
    """The same of what stands before the root element."""

    def start(self, *_: object) -> NoReturn:
        raise _RootSeenError


def parse_xml(body: bytes, name: str) -> ET.Element:
    """The root of a document that defines no entities and is nested like an honest one.

    Raises
    ------
    FormatError
        Hostile.
    xml.etree.ElementTree.ParseError
        Not well-formed; also for an encoding that is not known.
    """
    with suppress(expat.ExpatError, LookupError, ValueError):  # told below
        XmlGuard(name).parser.Parse(body, True)
    try:
        return ET.fromstring(body)  # noqa: S314  no entities are left
    except (LookupError, ValueError) as error:
        raise ET.ParseError(str(error)) from None
