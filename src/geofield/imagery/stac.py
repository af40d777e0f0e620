"""STAC items and item collections as files: which pictures, what they show, since when."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urljoin
from xml.sax.saxutils import escape

import numpy as np
import rasterio
import shapely
from shapely.errors import ShapelyError
from shapely.geometry import Point, shape

from geofield.errors import ImageryError, PointOutsideError
from geofield.imagery.bands import find_roles
from geofield.imagery.collection import open_collection
from geofield.imagery.gdal import display_name, gdal_env, is_remote, open_picture
from geofield.imagery.opening import OpenOptions
from geofield.imagery.reach import Reach
from geofield.imagery.reader import SceneReader
from geofield.model.scene import ImagerySource, swapped

_RASTER = ("image/tiff", "image/vnd.stac.geotiff", "image/jp2", "application/x-geotiff")
_SINGLE = ("red", "green", "blue", "nir")


def is_stac(path: Path) -> bool:
    """Whether a file is a STAC item or a collection of items (and not plain GeoJSON)."""
    document = _document(path)
    items = [each for each in (document, *_items(document)) if isinstance(each, dict)]
    return any({"stac_version", "assets"} & each.keys() for each in items)


def open_stac(path: Path, options: OpenOptions) -> SceneReader:
    """A reader over the items of a file that hold the point: the finest, of equals the newest.

    Raises
    ------
    PointOutsideError
        No item holds the point.
    ImageryError
        No item has a picture.
    """
    options = replace(options, reach=options.reach.of(path))
    try:
        known = _known(path, options)
    except (AttributeError, LookupError, TypeError, ValueError, ShapelyError) as error:
        raise ImageryError(
            f"{path.name} is not as STAC has it: {type(error).__name__}, {error}.",
            hint="Name its pictures themselves, or the folder that they lie in.",
        ) from error
    reader = open_collection(known, options, name=path.name)
    # Of the one that is shown at the point: a finer one may be older.
    return replace(reader, source=known[reader.path].source or reader.source)


def _known(path: Path, options: OpenOptions) -> dict[str, OpenOptions]:
    """The pictures of a file, and what is known of each: their bands may come in another order."""
    features, point = _items(_document(path)), options.point
    if point is not None:
        lon, lat = point
        here = [f for f in features if _holds(f, lat, lon)]
        if not here:
            message = f"No item of {path.name} holds the point lat {lat}, lon {lon}."
            if any(_holds(f, lon, lat) for f in features):
                message += f" {swapped(lat, lon)}"
            raise PointOutsideError(message)
        features = here
    features = sorted(features, key=lambda f: _date(f) or "", reverse=True)
    items = [item for item in (_item(f, path, options) for f in features) if item is not None]
    if not items:
        raise ImageryError(
            f"No item of {path.name} has a GeoTIFF or JPEG 2000 asset.",
            hint="Give items with assets of the role `data` or `visual`.",
        )
    return dict(items)


def _document(path: Path) -> dict[str, Any]:
    """What a file holds; nothing where it is no JSON object."""
    try:
        # What is null is as good as not there: some programs write all that there may be.
        document = json.loads(path.read_text(encoding="utf-8"), object_pairs_hook=_said)
    except (OSError, ValueError, RecursionError):
        return {}
    return document if isinstance(document, dict) else {}


def _said(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    return {name: value for name, value in pairs if value is not None}


def _items(document: Mapping[str, Any]) -> list[Any]:
    """The items of a document, which may be one."""
    features = document.get("features", [document])
    return _there(features) if isinstance(features, list) else []


def _there(given: Iterable[Any]) -> list[Any]:
    """Those of a list that are not null."""
    return [each for each in given if each is not None]


def _holds(feature: Mapping[str, Any], lat: float, lon: float) -> bool:
    if feature.get("geometry"):
        return bool(shapely.intersects(shape(feature["geometry"]), Point(lon, lat)))
    box = feature.get("bbox")
    if not box or None in box:
        return True
    half = len(box) // 2
    return bool(box[0] <= lon <= box[half] and box[1] <= lat <= box[half + 1])


def _date(feature: Mapping[str, Any]) -> str | None:
    properties = feature.get("properties", {})
    value = properties.get("datetime") or properties.get("start_datetime")
    return str(value) if value else None


def _item(
    feature: Mapping[str, Any], path: Path, options: OpenOptions
) -> tuple[str, OpenOptions] | None:
    """The picture of an item, and what is known of it; None without one."""
    rasters = {
        name: asset for name, asset in feature.get("assets", {}).items() if _is_picture(asset)
    }
    if not rasters:
        return None
    chosen, roles = _chosen(rasters)
    places = [_place(asset, feature, path) for asset in chosen]
    for place in places:
        options.reach.require(place, path.name)
    properties = feature.get("properties", {})
    providers = [str(p.get("name", "")) for p in _there(properties.get("providers", ()))]
    licence = str(properties.get("license", ""))
    source = ImagerySource(
        name=str(feature.get("id", path.stem)),
        date=_date(feature),
        attribution=", ".join(filter(None, providers)),
        licence="" if licence in ("proprietary", "various", "other") else licence,
    )
    whole = places[0] if len(places) == 1 else stacked(places, roles or (), options.reach)
    known = replace(options, bands=options.bands or roles, source=options.source or source)
    return whole, known


def _is_picture(asset: Mapping[str, Any]) -> bool:
    if not asset.get("href"):
        return False
    kind, address = str(asset.get("type", "")).lower(), str(asset["href"]).lower()
    named = address.partition("?")[0].endswith((".tif", ".tiff", ".jp2"))
    aside = {"thumbnail", "overview", "metadata"} & set(asset.get("roles", []))
    return (kind.startswith(_RASTER) or named) and not aside


def _chosen(
    rasters: Mapping[str, Mapping[str, Any]],
) -> tuple[list[Mapping[str, Any]], tuple[str, ...] | None]:
    """The assets to read: one with all colours, else one per colour."""
    described = {name: _band_names(asset) for name, asset in rasters.items()}
    for name, names in described.items():
        if len(names) >= 3:
            return [rasters[name]], _roles(names)
    for name, asset in rasters.items():
        if name == "visual" or "visual" in asset.get("roles", []):
            return [asset], None
    single = {names[0]: rasters[name] for name, names in described.items() if len(names) == 1}
    single |= {name: rasters[name] for name in _SINGLE if name in rasters and name not in single}
    if {"red", "green", "blue"} <= set(single):
        roles = tuple(role for role in _SINGLE if role in single)
        return [single[role] for role in roles], roles
    data = [asset for asset in rasters.values() if "data" in asset.get("roles", [])]
    return [(data or list(rasters.values()))[0]], None


def _band_names(asset: Mapping[str, Any]) -> list[str]:
    bands = asset.get("bands") or asset.get("eo:bands") or []
    return [
        str(said.get("common_name") or said.get("eo:common_name") or said.get("name") or "")
        for said in (band or {} for band in bands)
    ]


def _roles(names: Sequence[str]) -> tuple[str, ...] | None:
    """Roles from band names, where they name the colours."""
    roles = find_roles(names, ["undefined"] * len(names), ["picture"] * len(names))
    named = {"red", "green", "blue"} <= {name.lower() for name in names} and not roles.notes
    return tuple(roles.roles) if named else None


def _place(asset: Mapping[str, Any], feature: Mapping[str, Any], path: Path) -> str:
    """An asset's path or address; relative ones start at the item."""
    href = str(asset["href"])
    if is_remote(href) or Path(href).is_absolute():
        return href
    links = [each for each in _there(feature.get("links", ())) if each.get("rel") == "self"]
    own = next((str(each["href"]) for each in links if "href" in each), "")
    near = path.parent / href
    return urljoin(own, href) if is_remote(own) and not near.exists() else str(near)


def stacked(paths: Sequence[str], roles: Sequence[str], reach: Reach) -> str:
    """One-band pictures of the same ground as the bands of one: a VRT as text."""
    with gdal_env(paths[0]), open_picture(paths[0], reach) as first:
        width, height, dtype = first.width, first.height, first.dtypes[0]
        crs, transform, nodata = first.crs, first.transform, first.nodata
        bounds, pixel = first.bounds, max(first.res)
    gdal_type = rasterio.dtypes._gdal_typename(dtype)
    lines = [f'<VRTDataset rasterXSize="{width}" rasterYSize="{height}">']
    if crs:
        lines.append(f"<SRS>{escape(crs.to_wkt())}</SRS>")
    lines.append(f"<GeoTransform>{', '.join(map(repr, transform.to_gdal()))}</GeoTransform>")
    for n, (path, role) in enumerate(zip(paths, roles, strict=True), 1):
        with gdal_env(path), open_picture(path, reach) as each:
            size = each.width, each.height
            apart = np.abs(np.subtract(each.bounds, bounds)).max()
            if each.crs != crs or apart > max(pixel, *each.res):
                raise ImageryError(
                    f"{display_name(paths[0])} and {display_name(path)} do not show the same "
                    "ground: they are no bands of one picture.",
                    hint="Bring them onto the same ground, as with gdalwarp -t_srs and -te.",
                )
        source = f"/vsicurl/{path}" if path.startswith("http") else str(Path(path).resolve())
        lines.append(
            f'<VRTRasterBand dataType="{gdal_type}" band="{n}">'
            f"<Description>{escape(role)}</Description>"
            + (f"<NoDataValue>{nodata!r}</NoDataValue>" if nodata is not None else "")
            + f"<SimpleSource><SourceFilename>{escape(source)}</SourceFilename>"
            f'<SourceBand>1</SourceBand><SrcRect xOff="0" yOff="0" xSize="{size[0]}" '
            f'ySize="{size[1]}"/><DstRect xOff="0" yOff="0" xSize="{width}" ySize="{height}"/>'
            "</SimpleSource></VRTRasterBand>"
        )
    return "".join([*lines, "</VRTDataset>"])
