"""Capabilities documents of WMS and WMTS: fetching them, and finding one's way in them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import parse_qsl, urlencode, urlsplit, urlunsplit
from xml.etree import ElementTree as ET

from pyproj import CRS
from pyproj.exceptions import CRSError as ProjCRSError

from geofield.errors import FormatError, ImageryError
from geofield.imagery.client import Client
from geofield.imagery.reach import OWN_FOLDER, Reach
from geofield.imagery.terms import Terms
from geofield.strangers import parse_xml

_XLINK = "{http://www.w3.org/1999/xlink}href"


@dataclass(frozen=True, slots=True, kw_only=True)
class Service:
    """A WMS or WMTS as a user or the catalogue names it.

    Attributes
    ----------
    address : str
        Of the capabilities document or of the service; a layer (and a style) may stand in it as
        ``layer=NAME`` (WMS: ``layers=NAME``, ``styles=NAME``).
    client : Client or None
        None offline.
    name, layer : str
        For people, and as the service calls it; empty for what the document says.
    terms : Terms, optional
        Better known than the document's own words.
    key, key_parameter : str
        Added to each request as ``key_parameter=key``.
    reach : Reach
        Hosts that the document may lead to besides its own.
    """

    address: str = field(repr=False)
    client: Client | None
    name: str = ""
    layer: str = ""
    terms: Terms | None = None
    key: str = field(default="", repr=False)
    key_parameter: str = ""
    reach: Reach = OWN_FOLDER

    def capabilities(self, **query: str) -> ET.Element:
        """The document, asked for with a query where the address is one of the web."""
        document = self.address
        if document.startswith(("http://", "https://")):
            if self.key and self.key_parameter:
                query[self.key_parameter] = self.key
            document = with_query(document, **query) if query else document
        return read_document(document, self.client)

    def require(self, target: str) -> None:
        """Refuse an address of the document that is none of the web, or of a foreign host."""
        require_web_address(target, self.address)
        self.reach.of(self.address).require(target, plain_address(self.address))


def read_document(address: str, client: Client | None) -> ET.Element:
    """A capabilities document from a file or a server.

    Raises
    ------
    ImageryError
        Not XML, or a service exception, whose text is passed on.
    """
    if urlsplit(address).scheme in ("http", "https"):
        if client is None:
            raise ImageryError(
                f"The capabilities of {urlsplit(address).netloc} are not here (offline).",
                hint="Save the capabilities document and give its path.",
            )
        body = client.text(address)
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
    if local(root) in ("ExceptionReport", "ServiceExceptionReport", "ServiceException"):
        text = " ".join("".join(root.itertext()).split())
        raise ImageryError(f"{plain_address(address)} answers: {text[:300]}.")
    return root


def local(element: ET.Element) -> str:
    """A tag without its namespace."""
    return element.tag.rpartition("}")[2]


def children(element: ET.Element, *names: str) -> list[ET.Element]:
    """The elements along a path of local names."""
    found = [element]
    for name in names:
        found = [child for parent in found for child in parent if local(child) == name]
    return found


def text(element: ET.Element, *names: str) -> str:
    """The text at a path of local names, or ''."""
    found = children(element, *names)
    return (found[0].text or "").strip() if found else ""


def link(element: ET.Element) -> str:
    """The xlink:href of an element."""
    return element.get(_XLINK, "")


def require_web_address(target: str, document: str) -> None:
    """Refuse a service whose document does not say where it is asked, but for a path.

    Raises
    ------
    ImageryError
    """
    if urlsplit(target).scheme not in ("http", "https") or not urlsplit(target).netloc:
        raise ImageryError(
            f"{plain_address(document)} names no web address of its service.",
            hint="Give the address of the service itself, which begins with https://.",
        )


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
    """The wanted layer, or the only one.

    Raises
    ------
    ImageryError
        Listing what there is.
    """
    if wanted:
        if wanted in names:
            return wanted
        import difflib

        close = difflib.get_close_matches(wanted, names, n=1)
        raise ImageryError(
            f"{plain_address(address)} has no layer {wanted!r}.",
            hint=f"Did you mean {close[0]!r}?" if close else f"Layers: {_listed(names)}.",
        )
    if len(names) == 1:
        return names[0]
    if not names:
        raise ImageryError(f"{plain_address(address)} offers no layer.")
    raise ImageryError(
        f"{plain_address(address)} offers {len(names)} layers: choose one.",
        hint=f"Add --layer NAME; layers: {_listed(names)}.",
    )


def _listed(names: list[str]) -> str:
    return ", ".join(names[:12]) + (f" and {len(names) - 12} more" if len(names) > 12 else "")
