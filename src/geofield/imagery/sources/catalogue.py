"""The imagery known by name: open national imagery, and what its owners ask for.

Terms change: the address of each is here, and the user answers for keeping to them. Users
add sources of their own in the settings file, ``[fetch.sources.NAME]``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from geofield.imagery.sources.google import GOOGLE_TERMS
from geofield.imagery.terms import Terms


@dataclass(frozen=True, slots=True)
class SourceEntry:
    """How a source is reached, and on what terms."""

    #: xyz, wmts, wms, mbtiles, google or picture.
    kind: str
    #: Template, address or path.
    address: str
    terms: Terms = field(default_factory=Terms)
    #: title, region: for people.
    title: str = ""
    region: str = ""
    min_zoom: int = 0
    max_zoom: int = 22
    tile_px: int | None = None
    subdomains: tuple[str, ...] = ("a", "b", "c")
    #: Of a WMS or WMTS.
    layer: str = ""
    #: Name of the query value that carries the key (WMS, WMTS).
    key_parameter: str = ""
    needs_key: bool = False
    rate_per_s: float | None = None
    date: str | None = None
    headers: tuple[tuple[str, str], ...] = ()


_GEOPF = (
    "https://data.geopf.fr/wmts?SERVICE=WMTS&REQUEST=GetTile&VERSION=1.0.0"
    "&LAYER=ORTHOIMAGERY.ORTHOPHOTOS&STYLE=normal&FORMAT=image/jpeg&TILEMATRIXSET=PM"
    "&TILEMATRIX={z}&TILEROW={y}&TILECOL={x}"
)
_PNOA = (
    "https://www.ign.es/wmts/pnoa-ma?SERVICE=WMTS&REQUEST=GetTile&VERSION=1.0.0"
    "&LAYER=OI.OrthoimageCoverage&STYLE=default&FORMAT=image/jpeg"
    "&TILEMATRIXSET=GoogleMapsCompatible&TILEMATRIX={z}&TILEROW={y}&TILECOL={x}"
)


def _open(
    address: str, title: str, region: str, *, attribution: str, licence: str, url: str, **more: Any
) -> SourceEntry:
    """Open imagery, of which tiles may be kept, and twenty are asked for in a second."""
    terms = Terms(attribution, licence, may_cache=True, url=url)
    known = {"kind": "xyz", "rate_per_s": 20, **more}
    return SourceEntry(address=address, terms=terms, title=title, region=region, **known)


BUILTIN: dict[str, SourceEntry] = {
    "naip": _open(
        "https://gis.apfo.usda.gov/arcgis/rest/services/NAIP/USDA_CONUS_PRIME/ImageServer/tile/"
        "{z}/{y}/{x}",
        "NAIP, 0.6 m",
        "United States, without Alaska and Hawaii",
        attribution="USDA Farm Production and Conservation - Business Center, NAIP",
        licence="public domain",
        url="https://naip-usdaonline.hub.arcgis.com",
        max_zoom=18,
    ),
    "austria": _open(
        "https://maps.wien.gv.at/basemap/bmaporthofoto30cm/normal/google3857/{z}/{y}/{x}.jpeg",
        "basemap.at orthophoto, 0.3 m",
        "Austria",
        attribution="basemap.at",
        licence="CC BY 4.0",
        url="https://basemap.at",
        max_zoom=19,
    ),
    "france": _open(
        _GEOPF,
        "BD ORTHO, 0.2 m",
        "France",
        attribution="IGN-F/Géoportail",
        licence="Licence Ouverte 2.0 (Etalab)",
        url="https://geoservices.ign.fr",
        max_zoom=19,
    ),
    "netherlands": _open(
        "https://service.pdok.nl/hwh/luchtfotorgb/wmts/v1_0/Actueel_orthoHR/EPSG:3857/"
        "{z}/{x}/{y}.jpeg",
        "Luchtfoto HR, 0.08 m",
        "Netherlands",
        attribution="Beeldmateriaal Nederland, PDOK",
        licence="CC BY 4.0",
        url="https://www.pdok.nl",
        max_zoom=20,
    ),
    "nrw": _open(
        "https://www.wmts.nrw.de/geobasis/wmts_nw_dop/1.0.0/WMTSCapabilities.xml",
        "DOP, 0.1 m",
        "North Rhine-Westphalia, Germany",
        attribution="Geobasis NRW",
        licence="DL-DE-ZERO-2.0",
        url="https://www.govdata.de/dl-de/zero-2-0",
        kind="wmts",
        layer="nw_dop",
    ),
    "spain": _open(
        _PNOA,
        "PNOA, 0.25 m",
        "Spain",
        attribution="PNOA, cedido por © Instituto Geográfico Nacional",
        licence="CC BY 4.0",
        url="https://www.ign.es/web/ign/portal/info-aviso-legal",
        max_zoom=19,
    ),
    "switzerland": _open(
        "https://wmts.geo.admin.ch/1.0.0/ch.swisstopo.swissimage/default/current/3857/"
        "{z}/{x}/{y}.jpeg",
        "SWISSIMAGE, 0.1 m",
        "Switzerland",
        attribution="© swisstopo",
        licence="open government data of swisstopo, source to be named",
        url="https://www.swisstopo.admin.ch/en/terms-of-use-free-geodata-and-geoservices",
        max_zoom=20,
    ),
    "google": SourceEntry(
        "google",
        "https://maps.googleapis.com/maps/api/staticmap",
        GOOGLE_TERMS,
        "Google static maps, the study's source",
        "world",
        needs_key=True,
        rate_per_s=10,
    ),
}
