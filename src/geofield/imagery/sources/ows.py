"""Capabilities documents of WMS and WMTS: fetching them, and finding one's way in them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import parse_qsl, urlencode, urlsplit, urlunsplit
from xml.etree import ElementTree as ET

from pyproj import CRS
from pyproj.exceptions import CRSError as ProjCRSError

from geofield.errors import FormatError, ImageryError
from geofield.imagery.client import Client
from geofield.imagery.reach import OWN_FOLDER, Reach
from geofield.imagery.sources.base import TileSource
from geofield.imagery.terms import Terms
from geofield.imagery.tiling import TilePyramid
from geofield.strangers import parse_xml
from geofield.wording import nearest, some_of

_XLINK = "{http://www.w3.org/1999/xlink}href"


@dataclass(frozen=True, slots=True, kw_only=True)
class Service:
    """A WMS or WMTS as a user or the catalogue names it."""

    #: Of the capabilities document or of the service; a layer (and a style) may stand in it as
    #: ``layer=NAME`` (WMS: ``layers=NAME``, ``styles=NAME``).
    address: str = field(repr=False)
    #: None offline.
    client: Client | None
    #: As the service calls it; empty for what the document says.
    layer: str = ""
    #: Better known than the document's own words.
    terms: Terms | None = None
    #: key, key_parameter: added to each request as ``key_parameter=key``.
    key: str = field(default="", repr=False)
    key_parameter: str = ""
    #: Sent with each request.
    headers: tuple[tuple[str, str], ...] = ()
    #: Hosts that the document may lead to besides its own.
    reach: Reach = OWN_FOLDER

    def capabilities(self, **query: str) -> ET.Element:
        """The document, asked for with a query where the address is one of the web."""
        document = self.address
        if document.startswith(("http://", "https://")):
            if self.key and self.key_parameter:
                query[self.key_parameter] = self.key
            document = with_query(document, **query) if query else document
        return read_document(document, self.client, dict(self.headers))

    def require(self, target: str) -> None:
        """Refuse an address of the document that is none of the web, or of a foreign host."""
        parts, shown = urlsplit(target), plain_address(self.address)
        if parts.scheme not in ("http", "https") or not parts.netloc:
            raise ImageryError(
                f"{shown} names no web address of its service.",
                hint="Give the address of the service itself, which begins with https://.",
            )
        self.reach.of(self.address).require(target, shown)

    def terms_by(self, credit: str, constraints: str) -> Terms:
        """The terms that are known, else the document's own words."""
        plain = constraints if constraints.lower() != "none" else ""
        return self.terms or Terms(attribution=credit, licence=plain, may_cache=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceSource(TileSource):
    """What the sources of both kinds of services have in common."""

    layer: str
    pyramid: TilePyramid = field()
    key_parameter: str = ""


def read_document(
    address: str, client: Client | None, headers: Mapping[str, str] | None = None
) -> ET.Element:
    """A capabilities document from a file or a server; a service's exception is passed on."""
    if urlsplit(address).scheme in ("http", "https"):
        if client is None:
            raise ImageryError(
                f"The capabilities of {urlsplit(address).netloc} are not here (offline).",
                hint="Save the capabilities document and give its path.",
            )
        body = client.text(address, headers)
    else:
        try:
            body = Path(address).read_bytes()
        except OSError as error:
            raise ImageryError(f"{address} cannot be read: {error.strerror}.") from None
    try:
        root = parse_xml(body, "The capabilities document")
    except FormatError as error:
        raise ImageryError(error.message, hint=error.hint) from None
    except ET.ParseError as error:
        raise ImageryError(
            f"{plain_address(address)} does not give XML: {error}.",
            hint="Give the address of a WMS or WMTS capabilities document.",
        ) from None
    if root.tag.endswith(("ExceptionReport", "ServiceException")):
        text = " ".join("".join(root.itertext()).split())
        raise ImageryError(f"{plain_address(address)} answers: {text[:300]}.")
    return root


def children(element: ET.Element, *names: str) -> list[ET.Element]:
    """The elements along a path of local names."""
    return element.findall("/".join(f"{{*}}{name}" for name in names))


def texts(element: ET.Element, *names: str) -> list[str]:
    """All texts at a path of local names."""
    return [(each.text or "").strip() for each in children(element, *names)]


def text(element: ET.Element, *names: str) -> str:
    """The first text at a path of local names, or ''."""
    return next(iter(texts(element, *names)), "")


def link(element: ET.Element, *names: str) -> str:
    """The xlink:href of the first element along a path of local names, or ''."""
    return next((each.get(_XLINK, "") for each in children(element, *names)), "")


def with_query(address: str, **values: str) -> str:
    """An address with query values set, whatever their case was."""
    parts = urlsplit(address)
    names = {name.lower() for name in values}
    kept = [(k, v) for k, v in parse_qsl(parts.query, True) if k.lower() not in names]
    query = urlencode([*kept, *values.items()], safe="/:,")
    return urlunsplit((parts.scheme, parts.netloc, parts.path, query, ""))


def query_value(address: str, name: str) -> str:
    """A value of the query, whatever the case of its name."""
    pairs = parse_qsl(urlsplit(address).query, True)
    return next((v for k, v in pairs if k.lower() == name.lower()), "")


def plain_address(address: str) -> str:
    """An address for messages: no query, no password."""
    parts = urlsplit(address)
    return f"{parts.netloc.rpartition('@')[2]}{parts.path}" if parts.netloc else address


def parse_ogc_crs(name: str) -> CRS | None:
    """A CRS from ``EPSG:3857`` or ``urn:ogc:def:crs:EPSG::3857``; None when unknown."""
    match = re.search(r"(EPSG|CRS|OGC)[:/]+(?:[\d.]*[:/]+)?(\w+)$", name.strip())
    if not match:
        return None
    authority, code = match.groups()
    if code in ("900913", "3785", "102100", "102113"):
        code = "3857"
    try:
        return CRS.from_user_input("OGC:CRS84" if code == "CRS84" else f"{authority}:{code}")
    except ProjCRSError:
        return None


def choose_layer(names: list[str], wanted: str, address: str) -> str:
    """The wanted layer, or the only one; the error lists what there is."""
    if wanted:
        if wanted in names:
            return wanted
        raise ImageryError(
            f"{plain_address(address)} has no layer {wanted!r}.",
            hint=nearest(wanted, names).strip() or f"Layers: {some_of(names, 12)}.",
        )
    if len(names) == 1:
        return names[0]
    if not names:
        raise ImageryError(f"{plain_address(address)} offers no layer.")
    raise ImageryError(
        f"{plain_address(address)} offers {len(names)} layers: choose one.",
        hint=f"Add --layer NAME; layers: {some_of(names, 12)}.",
    )
