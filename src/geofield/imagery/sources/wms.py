"""WMS: fixed windows of a map service as tiles of a pyramid."""

from __future__ import annotations

from dataclasses import dataclass, field
from xml.etree import ElementTree as ET

from pyproj import CRS

from geofield.crs import WEB_MERCATOR, is_metric, metric_crs, northing_first
from geofield.errors import ImageryError
from geofield.imagery.sources.base import Request
from geofield.imagery.sources.ows import (
    Service,
    children,
    choose_layer,
    link,
    parse_ogc_crs,
    plain_address,
    query_value,
    text,
    with_query,
)
from geofield.imagery.sources.xyz import secrets_of
from geofield.imagery.terms import Terms
from geofield.imagery.tiling import Tile, TilePyramid

_FORMATS = ("image/png", "image/jpeg", "image/jpg", "image/webp", "image/png8")
#: Windows of this many pixels: few requests, and small enough for every server's limit.
_TILE_PX = 512


@dataclass(frozen=True, slots=True)
class WMSSource:
    """One layer of a WMS in one CRS."""

    name: str
    service: str = field(repr=False)
    layer: str
    pyramid: TilePyramid
    terms: Terms
    version: str = "1.3.0"
    crs_name: str = "EPSG:3857"
    style: str = ""
    form: str = "image/png"
    key: str = field(default="", repr=False)
    key_parameter: str = ""
    rate_per_s: float | None = None
    date: str | None = None

    @property
    def identity(self) -> str:
        """Service, layer, style, CRS and format, without any key."""
        service = plain_address(self.service)
        return f"wms {service} {self.layer} {self.style} {self.crs_name} {self.form}"

    @property
    def secrets(self) -> tuple[str, ...]:
        """The key."""
        return secrets_of(self.key)

    def request(self, tile: Tile) -> Request:
        """The address of a window."""
        level = self.pyramid.level(tile.zoom)
        width, height = level.tile_px
        west = level.left + tile.column * width * level.resolution
        north = level.top - tile.row * height * level.resolution
        east, south = west + width * level.resolution, north - height * level.resolution
        box = [west, south, east, north]
        newer = self.version >= "1.3"
        if newer and self.crs_name != "CRS:84" and northing_first(self.pyramid.crs):
            box = [south, west, north, east]
        values = {
            "SERVICE": "WMS",
            "VERSION": self.version,
            "REQUEST": "GetMap",
            "LAYERS": self.layer,
            "STYLES": self.style,
            "CRS" if newer else "SRS": self.crs_name,
            "BBOX": ",".join(repr(each) for each in box),
            "WIDTH": str(width),
            "HEIGHT": str(height),
            "FORMAT": self.form,
            "TRANSPARENT": "TRUE" if "png" in self.form else "FALSE",
        }
        if self.key and self.key_parameter:
            values[self.key_parameter] = self.key
        return Request(with_query(self.service, **values))


def open_wms(service: Service, point: tuple[float, float] | None = None) -> WMSSource:
    """A WMS source from the address or path of its capabilities.

    Web Mercator is asked for where the service knows it, so that the windows are those of
    web maps; else the UTM zone of the point; else any metric CRS it names.

    Parameters
    ----------
    service : Service
    point : (lon, lat), optional
        Where the picture will be, for the choice of the CRS.

    Raises
    ------
    ImageryError
    """
    address = service.address
    version = query_value(address, "version") or "1.3.0"
    root = service.capabilities(SERVICE="WMS", REQUEST="GetCapabilities", VERSION=version)
    named = _layers(children(root, "Capability", "Layer"), [])
    wanted = service.layer or query_value(address, "layers")
    chosen = choose_layer(sorted(named), wanted, address)
    names, _ = named[chosen]
    crs_name, pyramid = _pyramid(names, point, address)
    get_map = children(root, "Capability", "Request", "GetMap")
    target, offered = address, []
    if get_map:
        links = children(get_map[0], "DCPType", "HTTP", "Get", "OnlineResource")
        target = (link(links[0]) if links else "") or address
        offered = [(each.text or "").strip() for each in children(get_map[0], "Format")]
    form = next((f for f in _FORMATS if f in offered), "image/png")
    service.require(target)
    return WMSSource(
        name=service.name or chosen,
        service=with_query(target, SERVICE="WMS"),
        layer=chosen,
        pyramid=pyramid,
        terms=service.terms or _terms(root, named[chosen][1]),
        version=root.get("version", "1.3.0"),
        crs_name=crs_name,
        style=query_value(address, "styles"),
        form=form,
        key=service.key,
        key_parameter=service.key_parameter,
    )


def _layers(
    elements: list[ET.Element], inherited: list[str]
) -> dict[str, tuple[list[str], ET.Element]]:
    """The named layers with their CRS names; children inherit their parents' CRS."""
    found: dict[str, tuple[list[str], ET.Element]] = {}
    for element in elements:
        own = [
            part
            for each in (*children(element, "CRS"), *children(element, "SRS"))
            for part in (each.text or "").split()
        ]
        names = [*inherited, *own]
        name = text(element, "Name")
        inner = _layers(children(element, "Layer"), names)
        if name and not inner:
            found[name] = (names, element)
        found |= inner
    return found


def _pyramid(
    names: list[str], point: tuple[float, float] | None, address: str
) -> tuple[str, TilePyramid]:
    known: list[tuple[str, CRS]] = []
    for each in names:
        crs = parse_ogc_crs(each)
        if crs is not None:
            known.append((each, crs))
    for name, crs in known:
        if crs == WEB_MERCATOR:
            return name, TilePyramid.web_mercator(1, 22, _TILE_PX, shift=1)
    metric = [(name, crs) for name, crs in known if is_metric(crs)]
    if point is not None:
        zone = metric_crs(*point).utm_zone
        for name, crs in metric:
            if crs.utm_zone == zone:
                return name, TilePyramid.metric(crs, tile_px=_TILE_PX)
    if metric:
        return metric[0][0], TilePyramid.metric(metric[0][1], tile_px=_TILE_PX)
    raise ImageryError(
        f"{plain_address(address)} offers the layer in no metric coordinate reference system.",
        hint="Give another service, or a GeoTIFF made from this one with QGIS.",
    )


def _terms(root: ET.Element, layer: ET.Element) -> Terms:
    credit = text(layer, "Attribution", "Title") or text(
        root, "Service", "ContactInformation", "ContactPersonPrimary", "ContactOrganization"
    )
    constraints = text(root, "Service", "AccessConstraints")
    plain = constraints if constraints.lower() not in ("none", "") else ""
    return Terms(attribution=credit, licence=plain, may_cache=True)
