"""WMS: fixed windows of a map service as tiles of a pyramid."""

from __future__ import annotations

from dataclasses import dataclass, field
from xml.etree import ElementTree as ET

from geofield.crs import WEB_MERCATOR, is_metric, metric_crs, northing_first
from geofield.errors import ImageryError
from geofield.imagery.sources import ows
from geofield.imagery.tiling import Tile, TilePyramid

_FORMATS = ("image/png", "image/jpeg", "image/jpg", "image/webp", "image/png8")
#: Windows of this many pixels: few requests, and small enough for every server's limit.
_TILE_PX = 512


@dataclass(frozen=True, slots=True, kw_only=True)
class WMSSource(ows.ServiceSource):
    """One layer of a WMS in one CRS."""

    service: str = field(repr=False)
    version: str = "1.3.0"
    crs_name: str = "EPSG:3857"
    style: str = ""
    form: str = "image/png"

    @property
    def identity(self) -> str:
        """Service, layer, style, CRS and format, without any key."""
        service = ows.plain_address(self.service)
        return f"wms {service} {self.layer} {self.style} {self.crs_name} {self.form}"

    def address(self, tile: Tile) -> str:
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
        return ows.with_query(self.service, **values)


def open_wms(service: ows.Service, point: tuple[float, float] | None = None) -> WMSSource:
    """A WMS source from the address or path of its capabilities.

    Web Mercator is asked for where the service knows it, so that the windows are those of
    web maps; else the UTM zone of the point (lon, lat) where the picture will be; else any
    metric CRS it names.
    """
    address = service.address
    version = ows.query_value(address, "version") or "1.3.0"
    root = service.capabilities(SERVICE="WMS", REQUEST="GetCapabilities", VERSION=version)
    named = _layers(ows.children(root, "Capability", "Layer"), [])
    wanted = service.layer or ows.query_value(address, "layers")
    chosen = ows.choose_layer(sorted(named), wanted, address)
    names, element = named[chosen]
    credit = ows.text(element, "Attribution", "Title") or ows.text(
        root, "Service", "ContactInformation", "ContactPersonPrimary", "ContactOrganization"
    )
    crs_name, pyramid = _pyramid(names, point, address)
    get_map = ("Capability", "Request", "GetMap")
    target = ows.link(root, *get_map, "DCPType", "HTTP", "Get", "OnlineResource") or address
    offered = ows.texts(root, *get_map, "Format")
    form = next((f for f in _FORMATS if f in offered), "image/png")
    service.require(target)
    return WMSSource(
        name=chosen,
        service=ows.with_query(target, SERVICE="WMS"),
        layer=chosen,
        pyramid=pyramid,
        terms=service.terms_by(credit, ows.text(root, "Service", "AccessConstraints")),
        version=root.get("version", "1.3.0"),
        crs_name=crs_name,
        style=ows.query_value(address, "styles"),
        form=form,
    )


def _layers(
    elements: list[ET.Element], inherited: list[str]
) -> dict[str, tuple[list[str], ET.Element]]:
    """The named layers with their CRS names; children inherit their parents' CRS."""
    found: dict[str, tuple[list[str], ET.Element]] = {}
    for element in elements:
        systems = (*ows.texts(element, "CRS"), *ows.texts(element, "SRS"))
        names = [*inherited, *(part for each in systems for part in each.split())]
        name = ows.text(element, "Name")
        inner = _layers(ows.children(element, "Layer"), names)
        if name and not inner:
            found[name] = (names, element)
        found |= inner
    return found


def _pyramid(
    names: list[str], point: tuple[float, float] | None, address: str
) -> tuple[str, TilePyramid]:
    known = [(name, crs) for name in names if (crs := ows.parse_ogc_crs(name)) is not None]
    for name, crs in known:
        if crs == WEB_MERCATOR:
            return name, TilePyramid.web_mercator(1, 22, _TILE_PX, shift=1)
    metric = [(name, crs) for name, crs in known if is_metric(crs)]
    zone = None if point is None else metric_crs(*point).utm_zone
    metric = [each for each in metric if point is None or each[1].utm_zone == zone] or metric
    if metric:
        name, crs = metric[0]
        return name, TilePyramid.metric(crs, _TILE_PX)
    raise ImageryError(
        f"{ows.plain_address(address)} offers the layer in no metric coordinate reference system.",
        hint="Give another service, or a GeoTIFF made from this one with QGIS.",
    )
