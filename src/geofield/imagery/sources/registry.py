"""From what the user names (a source, an address, a path) to the source itself."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from urllib.parse import urlsplit

from geofield.errors import ImageryError, MissingFileError
from geofield.imagery.client import Client
from geofield.imagery.gdal import display_name
from geofield.imagery.reach import Reach, refuse_no_address
from geofield.imagery.sources.base import PictureSource, Source
from geofield.imagery.sources.catalogue import BUILTIN, SourceEntry
from geofield.imagery.sources.google import GoogleStaticSource
from geofield.imagery.sources.mbtiles import MBTilesSource
from geofield.imagery.sources.ows import Service, query_value
from geofield.imagery.sources.wms import open_wms
from geofield.imagery.sources.wmts import open_wmts
from geofield.imagery.sources.xyz import XYZSource
from geofield.imagery.terms import Terms
from geofield.strangers import picture_file
from geofield.wording import nearest

#: The user's own pictures, and addresses whose owner's terms we do not know: the user answers
#: for those. Their tiles are kept, so that a restart goes on where it stopped.
_OWN = Terms(may_cache=True, may_derive=True)
#: Owners whose terms are known to forbid deriving geodata from their pictures, by host.
_FORBIDDING = {
    "google.com": "Google",
    "googleapis.com": "Google",
    "gstatic.com": "Google",
    "bing.com": "Microsoft Bing Maps",
    "virtualearth.net": "Microsoft Bing Maps",
    "arcgisonline.com": "Esri",
    "mapbox.com": "Mapbox",
    "apple.com": "Apple",
    "yandex.net": "Yandex",
}


def find_source(
    what: str,
    *,
    catalogue: Mapping[str, SourceEntry] | None = None,
    keys: Mapping[str, str] | None = None,
    client: Client | None = None,
    layer: str = "",
    point: tuple[float, float] | None = None,
    allow: Sequence[str] = (),
) -> Source:
    """The source that a name, address or path means.

    Parameters
    ----------
    what : str
        A name of the catalogue; a tile address with ``{z}``, ``{x}``, ``{y}``; the address of
        a WMS, WMTS or GeoTIFF (``wms:`` or ``wmts:`` in front settles doubt); a file or folder.
    catalogue : mapping, optional
        Sources by name; the built-in ones by default.
    keys : mapping of source name to key, optional
    client : Client, optional
        For capabilities documents.
    layer : str
        Of a WMS or WMTS.
    point : (lon, lat), optional
        Where the picture will be; a WMS without Web Mercator is asked in its UTM zone.
    allow : sequence of str
        Hosts that a capabilities document may lead to besides its own.

    Raises
    ------
    ImageryError
        Nothing of that name; the nearest one is suggested.
    """
    catalogue = BUILTIN if catalogue is None else catalogue
    refuse_no_address(catalogue[what].address if what in catalogue else what)
    if what in catalogue:
        name, entry = what, catalogue[what]
    else:
        guess, address = kind_of(what)
        if not guess:
            raise _unknown(what, catalogue)
        name = urlsplit(address).hostname or display_name(address)
        entry = SourceEntry(kind=guess, address=address, terms=terms_of_host(address))
    kind, key = entry.kind, (keys or {}).get(what, "")
    # Of an address or file given by hand its own document or metadata know more.
    terms = entry.terms if entry.terms != _OWN else None
    shared = {each: getattr(entry, each) for each in ("rate_per_s", "date", "headers")}
    if kind == "xyz":
        own = ("terms", "min_zoom", "max_zoom", "tile_px", "subdomains")
        own_values = {each: getattr(entry, each) for each in own}
        return XYZSource(name, entry.address, key=key, **own_values, **shared)
    if kind == "google":
        return GoogleStaticSource(name, terms=entry.terms, key=key, service=entry.address, **shared)
    if kind == "mbtiles":
        return replace(MBTilesSource.open(entry.address, terms), date=entry.date)
    if kind in ("wmts", "wms"):
        service = Service(
            address=entry.address,
            client=client,
            layer=layer or entry.layer,
            terms=terms,
            key=key,
            key_parameter=entry.key_parameter,
            headers=entry.headers,
            reach=Reach(tuple(allow)),
        )
        served = open_wmts(service) if kind == "wmts" else open_wms(service, point)
        return replace(served, name=name, key=key, key_parameter=entry.key_parameter, **shared)
    return PictureSource(name, entry.terms, entry.address, entry.date)


def terms_of_host(address: str) -> Terms:
    """The terms of an address given by hand: open, unless its owner is known to forbid."""
    host = urlsplit(address).hostname or ""
    for ending, owner in _FORBIDDING.items():
        if host == ending or host.endswith("." + ending):
            return Terms(f"Imagery © {owner} and its providers", f"terms of {owner}", False, False)
    return _OWN


def kind_of(what: str) -> tuple[str, str]:
    """The kind of a path or address, and the address itself; ('', ...) when it is neither."""
    for prefix in ("wmts:", "wms:", "xyz:"):
        if what.lower().startswith(prefix) and not what.lower().startswith(prefix + "//"):
            return prefix[:-1], what[len(prefix) :]
    if urlsplit(what).scheme in ("http", "https"):
        return _kind_of_address(what), what
    if what.startswith(("/vsi", "s3://", "gs://")):
        return "picture", what
    if "{" in what and "}" in what:
        return "xyz", what
    # No name at all, as of a variable that is not set, would be the working folder.
    return _kind_of_file(picture_file(what)) if what else "", what


def _kind_of_address(address: str) -> str:
    if "{" in address:
        return "xyz"
    service = query_value(address, "service").lower()
    path = urlsplit(address).path.lower()
    if service in ("wms", "wmts"):
        return service
    if path.endswith("wmtscapabilities.xml") or "/wmts" in path:
        return "wmts"
    if "wms" in path.rpartition("/")[2] or path.endswith("/wmsserver"):
        return "wms"
    return "picture"


def _kind_of_file(file: Path) -> str:
    if not file.exists():
        return ""
    if file.suffix.lower() == ".mbtiles":
        return "mbtiles"
    if file.suffix.lower() == ".xml":
        head = file.read_bytes()[:2000]
        if b"wmts" in head.lower():
            return "wmts"
        if b"WMS_Capabilities" in head or b"WMT_MS_Capabilities" in head:
            return "wms"
    return "picture"


def _unknown(what: str, catalogue: Mapping[str, SourceEntry]) -> ImageryError:
    file = picture_file(what)
    # As QGIS and GDAL name what lies in a file.
    if file == Path(what) and re.match("[A-Z][A-Z0-9_]+:", what):
        return ImageryError(
            f"{what} is one picture of a file; only whole files are read.",
            hint=f"Take it out: gdal_translate {what!r} picture.tif",
        )
    near = nearest(what.lower(), catalogue, cutoff=0.5)
    looks_like_path = "/" in what or "\\" in what or file.suffix != ""
    if looks_like_path and not near:
        return MissingFileError(
            f"There is no picture {file}.",
            hint="Check the path. `geofield sources` lists the sources known by name.",
        )
    return MissingFileError(
        f"There is no imagery source or file {what!r}.",
        hint=f"{near} `geofield sources` lists them; an address or a path will do too.".strip(),
    )
