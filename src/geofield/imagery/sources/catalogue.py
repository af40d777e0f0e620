"""The imagery known by name: open national imagery, and what its owners ask for.

Terms change: the address of each is here, and the user answers for keeping to them. Users
add sources of their own in the settings file, ``[fetch.sources.NAME]``.
"""

from __future__ import annotations

from dataclasses import dataclass, field

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

BUILTIN: dict[str, SourceEntry] = {
    "naip": SourceEntry(
        "xyz",
        "https://gis.apfo.usda.gov/arcgis/rest/services/NAIP/USDA_CONUS_PRIME/ImageServer/tile/"
        "{z}/{y}/{x}",
        Terms(
            "USDA Farm Production and Conservation - Business Center, NAIP",
            "public domain",
            may_cache=True,
            url="https://naip-usdaonline.hub.arcgis.com",
        ),
        "NAIP, 0.6 m",
        "United States, without Alaska and Hawaii",
        max_zoom=18,
        rate_per_s=20,
    ),
    "austria": SourceEntry(
        "xyz",
        "https://maps.wien.gv.at/basemap/bmaporthofoto30cm/normal/google3857/{z}/{y}/{x}.jpeg",
        Terms("basemap.at", "CC BY 4.0", may_cache=True, url="https://basemap.at"),
        "basemap.at orthophoto, 0.3 m",
        "Austria",
        max_zoom=19,
        rate_per_s=20,
    ),
    "france": SourceEntry(
        "xyz",
        _GEOPF,
        Terms(
            "IGN-F/Géoportail",
            "Licence Ouverte 2.0 (Etalab)",
            may_cache=True,
            url="https://geoservices.ign.fr",
        ),
        "BD ORTHO, 0.2 m",
        "France",
        max_zoom=19,
        rate_per_s=20,
    ),
    "netherlands": SourceEntry(
        "xyz",
        "https://service.pdok.nl/hwh/luchtfotorgb/wmts/v1_0/Actueel_orthoHR/EPSG:3857/"
        "{z}/{x}/{y}.jpeg",
        Terms(
            "Beeldmateriaal Nederland, PDOK",
            "CC BY 4.0",
            may_cache=True,
            url="https://www.pdok.nl",
        ),
        "Luchtfoto HR, 0.08 m",
        "Netherlands",
        max_zoom=20,
        rate_per_s=20,
    ),
    "nrw": SourceEntry(
        "wmts",
        "https://www.wmts.nrw.de/geobasis/wmts_nw_dop/1.0.0/WMTSCapabilities.xml",
        Terms(
            "Geobasis NRW",
            "DL-DE-ZERO-2.0",
            may_cache=True,
            url="https://www.govdata.de/dl-de/zero-2-0",
        ),
        "DOP, 0.1 m",
        "North Rhine-Westphalia, Germany",
        layer="nw_dop",
        rate_per_s=20,
    ),
    "spain": SourceEntry(
        "xyz",
        _PNOA,
        Terms(
            "PNOA, cedido por © Instituto Geográfico Nacional",
            "CC BY 4.0",
            may_cache=True,
            url="https://www.ign.es/web/ign/portal/info-aviso-legal",
        ),
        "PNOA, 0.25 m",
        "Spain",
        max_zoom=19,
        rate_per_s=20,
    ),
    "switzerland": SourceEntry(
        "xyz",
        "https://wmts.geo.admin.ch/1.0.0/ch.swisstopo.swissimage/default/current/3857/"
        "{z}/{x}/{y}.jpeg",
        Terms(
            "© swisstopo",
            "open government data of swisstopo, source to be named",
            may_cache=True,
            url="https://www.swisstopo.admin.ch/en/terms-of-use-free-geodata-and-geoservices",
        ),
        "SWISSIMAGE, 0.1 m",
        "Switzerland",
        max_zoom=20,
        rate_per_s=20,
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
