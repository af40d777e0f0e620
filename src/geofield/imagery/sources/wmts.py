"""WMTS: the pyramid, the tile addresses and the terms from a capabilities document."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from urllib.parse import quote
from xml.etree import ElementTree as ET

from pyproj import CRS

from geofield.crs import DEGREE_M, WEB_MERCATOR, is_metric, northing_first
from geofield.errors import ImageryError
from geofield.imagery.sources import ows
from geofield.imagery.tiling import Tile, TileLevel, TilePyramid

#: Metres per pixel at scale 1:1 in the standard (0.28 mm pixels).
_PIXEL_M = 0.00028
#: Side of the largest tile that is taken, pixels.
_MOST_PX = 8192
#: No place and no pixel of a map is beyond it, units of the CRS.
_FAR = 1e9
_FORMATS = ("image/png", "image/webp", "image/jpeg", "image/jpg", "image/png8")


@dataclass(frozen=True, slots=True, kw_only=True)
class WMTSSource(ows.ServiceSource):
    """One layer of a WMTS in one tile matrix set."""

    template: str = field(repr=False)

    @property
    def identity(self) -> str:
        """Template and layer, without any key."""
        address = self.template
        for secret in self.secrets:
            address = address.replace(secret, "")
        return f"wmts {self.layer} {address}"

    def address(self, tile: Tile) -> str:
        """The address of a tile."""
        level = self.pyramid.level(tile.zoom)
        address = (
            self.template.replace("{TileMatrix}", quote(level.identifier, safe=":"))
            .replace("{TileRow}", str(tile.row))
            .replace("{TileCol}", str(tile.column))
        )
        if self.key and self.key_parameter:
            address += f"{'&' if '?' in address else '?'}{self.key_parameter}="
            address += quote(self.key, safe="")
        return address


def open_wmts(service: ows.Service) -> WMTSSource:
    """A WMTS source from the address or path of its capabilities."""
    address = service.address
    whole = address.partition("?")[0].lower().endswith(".xml")
    query = {} if whole else {"SERVICE": "WMTS", "REQUEST": "GetCapabilities"}
    root = service.capabilities(**query)
    layers = _by_identifier(root, "Contents", "Layer")
    wanted = service.layer or ows.query_value(address, "layer")
    chosen = ows.choose_layer(sorted(layers), wanted, address)
    element = layers[chosen]
    sets = _by_identifier(root, "Contents", "TileMatrixSet")
    links = ows.texts(element, "TileMatrixSetLink", "TileMatrixSet")
    set_id, pyramid = _best_set([(i, sets[i]) for i in links if i in sets], address)
    template = _template(root, element, set_id, address)
    service.require(template)
    return WMTSSource(
        name=chosen,
        layer=chosen,
        pyramid=pyramid,
        template=template,
        terms=service.terms_by(
            ows.text(root, "ServiceProvider", "ProviderName"),
            ows.text(root, "ServiceIdentification", "AccessConstraints"),
        ),
    )


def _by_identifier(element: ET.Element, *names: str) -> dict[str, ET.Element]:
    """The elements along a path of local names, by what they are called."""
    return {ows.text(each, "Identifier"): each for each in ows.children(element, *names)}


def _best_set(candidates: list[tuple[str, ET.Element]], address: str) -> tuple[str, TilePyramid]:
    """Web Mercator first (every cache and viewer knows it), then a metric CRS, then degrees."""
    found = []
    for identifier, element in candidates:
        crs = ows.parse_ogc_crs(ows.text(element, "SupportedCRS"))
        if crs is None:
            continue
        levels = _levels(element, crs)
        if levels:
            rank = 0 if crs == WEB_MERCATOR else 1 if is_metric(crs) else 2
            found.append((rank, -len(levels), identifier, TilePyramid(crs, levels)))
    if not found:
        raise ImageryError(
            f"{ows.plain_address(address)} offers the layer in no known coordinate reference "
            "system, or does not say how it is cut into tiles."
        )
    _, _, identifier, pyramid = min(found, key=lambda each: each[:3])
    return identifier, pyramid


def _levels(element: ET.Element, crs: CRS) -> tuple[TileLevel, ...]:
    unit_m = DEGREE_M if crs.is_geographic else crs.axis_info[0].unit_conversion_factor
    # The corner follows the authority's axis order when the CRS is named as a URN or an address.
    swapped = northing_first(crs) and not ows.text(element, "SupportedCRS").startswith("EPSG:")
    read = (_matrix(each, unit_m, swapped, crs) for each in ows.children(element, "TileMatrix"))
    sound = sorted(filter(None, read), key=lambda each: -each.resolution)
    levels = [replace(level, zoom=zoom) for zoom, level in enumerate(sound)]
    return tuple(_in_web_mercator(levels) if crs == WEB_MERCATOR else levels)


def _matrix(element: ET.Element, unit_m: float, swapped: bool, crs: CRS) -> TileLevel | None:
    """A level, its zoom still to be counted; None of one that is not written as it should be."""
    try:
        resolution = float(ows.text(element, "ScaleDenominator")) * _PIXEL_M / unit_m
        left, top = (float(part) for part in ows.text(element, "TopLeftCorner").split())
        names = ("MatrixWidth", "MatrixHeight", "TileWidth", "TileHeight")
        columns, rows, width, height = (int(ows.text(element, name)) for name in names)
    except ValueError:
        return None
    if not (1 / _FAR < resolution < _FAR and abs(left) < _FAR and abs(top) < _FAR):
        return None  # not a number, either
    if min(columns, rows, width, height) < 1 or max(width, height) > _MOST_PX:
        return None
    # Some write longitude first all the same: no latitude is beyond 90 degrees.
    if swapped and not (crs.is_geographic and abs(left) > 90):
        left, top = top, left
    size, identifier = (width, height), ows.text(element, "Identifier")
    return TileLevel(0, resolution, left, top, columns, rows, size, identifier)


def _in_web_mercator(levels: list[TileLevel]) -> list[TileLevel]:
    """Levels with the zooms of the ``z/x/y`` scheme, and its exact numbers where they agree.

    Documents print few digits: over a million columns they add up to metres.
    """
    found = []
    for each in levels:
        width, height = each.tile_px
        near_m = 2 * each.resolution + 1.0
        near = (
            level
            for level in TilePyramid.web_mercator(0, 24, width).levels
            if width == height
            and abs(level.resolution / each.resolution - 1) < 1e-4
            and abs(each.left - level.left) < near_m
            and abs(each.top - level.top) < near_m
        )
        exact = next(near, each)
        wraps = exact.wraps and each.columns == exact.columns
        own = replace(exact, columns=each.columns, rows=each.rows, wraps=wraps)
        found.append(replace(own, identifier=each.identifier))
    return found if len({level.zoom for level in found}) == len(found) else levels


def _template(root: ET.Element, layer: ET.Element, set_id: str, address: str) -> str:
    styles = sorted(ows.children(layer, "Style"), key=lambda each: each.get("isDefault") != "true")
    style = ows.text(styles[0], "Identifier") if styles else ""
    dimensions = {
        name: ows.text(each, "Default") for name, each in _by_identifier(layer, "Dimension").items()
    }
    offered = ows.texts(layer, "Format")
    form = next((f for f in _FORMATS if f in offered), offered[0] if offered else "image/png")
    resources = [
        each
        for each in ows.children(layer, "ResourceURL")
        if each.get("resourceType", "tile") == "tile"
    ]
    if resources:
        best = next((each for each in resources if each.get("format") == form), resources[0])
        template = best.get("template", "")
        fixed = {"style": style, "tilematrixset": set_id, "layer": ows.text(layer, "Identifier")}
        fixed |= {name.lower(): value for name, value in dimensions.items()}
        return re.sub(r"\{(\w+)\}", lambda m: fixed.get(m.group(1).lower(), m.group(0)), template)
    service = address.partition("?")[0]
    for operation in ows.children(root, "OperationsMetadata", "Operation"):
        if operation.get("name") == "GetTile":
            service = ows.link(operation, "DCP", "HTTP", "Get") or service
    values = {
        "SERVICE": "WMTS",
        "REQUEST": "GetTile",
        "VERSION": "1.0.0",
        "LAYER": ows.text(layer, "Identifier"),
        "STYLE": style,
        "FORMAT": form,
        "TILEMATRIXSET": set_id,
    }
    values |= {name.upper(): value for name, value in dimensions.items()}
    base = ows.with_query(service, **values)
    return base + "&TILEMATRIX={TileMatrix}&TILEROW={TileRow}&TILECOL={TileCol}"
