"""rasterio and pyproj side by side: CRS between them, GDAL's options, errors with a reason."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import rasterio
from pyproj import CRS
from rasterio.errors import NotGeoreferencedWarning, RasterioError, RasterioIOError
from rasterio.io import DatasetReader

from geofield import __version__
from geofield.crs import parse_crs
from geofield.errors import CRSError, ImageryError, MissingFileError
from geofield.imagery.damage import made_up
from geofield.imagery.reach import OWN_FOLDER, Reach, refuse_no_address
from geofield.imagery.vrt import check_beside, check_vrt
from geofield.strangers import picture_file

#: Sent with every request: servers answer 403 without one.
USER_AGENT = f"geofield/{__version__} (farm field mapping; python-urllib3)"

_OPTIONS: dict[str, Any] = {
    "GDAL_HTTP_USERAGENT": USER_AGENT,
    "GDAL_HTTP_MAX_RETRY": "5",
    "GDAL_HTTP_RETRY_DELAY": "0.5",
    "GDAL_HTTP_CONNECTTIMEOUT": "20",
    "GDAL_HTTP_TIMEOUT": "120",
    "GDAL_HTTP_MERGE_CONSECUTIVE_RANGES": "YES",
    "GDAL_INGESTED_BYTES_AT_OPEN": "32768",
    "GDAL_PNG_WHOLE_IMAGE_OPTIM": "NO",  # of a PNG that was cut off it gives zeros for an error
}

#: Their files hold the pixels themselves, and name no other file or host.
_DRIVERS = [
    *("GTiff", "JPEG", "PNG", "JP2OpenJPEG", "WEBP", "HFA", "GPKG", "MBTiles", "BMP", "GIF"),
    *("ENVI", "EHdr", "AAIGrid"),
]

_CHECK = "Check the address and the network."
_REMOTE = re.compile(r"^(https?://|/vsicurl/|/vsis3/|s3://|gs://)", re.IGNORECASE)


def is_remote(path: str) -> bool:
    """Whether GDAL would read a path over the network."""
    return bool(_REMOTE.match(path)) or "/vsicurl/" in path


def display_name(path: str | Path) -> str:
    """A path for people and products: no folders, no query (keys live there), no password."""
    text = str(path)
    if text.startswith("<"):  # a VRT as text
        return "stacked bands"
    if is_remote(text):
        text = re.sub(r"[?#].*$", "", text).rstrip("/")
    return re.split(r"[\\/]", text)[-1] or "picture"


@contextmanager
def gdal_env(path: str = "", **options: Any) -> Iterator[None]:
    """GDAL options for reading and writing here; side files are listed for local paths only."""
    beside = {"GDAL_DISABLE_READDIR_ON_OPEN": "EMPTY_DIR"} if is_remote(path) else {}
    with rasterio.Env(**(_OPTIONS | beside | options)):
        yield


def to_pyproj(crs: Any) -> CRS:
    """A rasterio CRS as a pyproj CRS: horizontal part only, by its EPSG code where it has one."""
    parsed = parse_crs(crs.to_wkt(version="WKT2_2019"))
    if parsed.is_compound:
        parsed = parsed.sub_crs_list[0]
    authority = parsed.to_authority(min_confidence=100)
    if authority:
        known = CRS.from_authority(*authority)
        if known == parsed:
            return known
    return parsed


def to_rasterio(crs: CRS) -> Any:
    """A pyproj CRS as a rasterio CRS."""
    authority = crs.to_authority(min_confidence=100)
    try:
        if authority and CRS.from_authority(*authority) == crs:
            return rasterio.crs.CRS.from_authority(*authority)
        return rasterio.crs.CRS.from_wkt(crs.to_wkt())
    except rasterio.errors.CRSError as error:
        raise CRSError(f"GDAL does not know the coordinate reference system {crs.name}.") from error


def open_picture(path: str, reach: Reach = OWN_FOLDER, *, placed: bool = False) -> Any:
    """Open a picture with rasterio, or say why it cannot be opened.

    Only drivers are used whose files hold the pixels themselves, and VRTs that were looked
    at: nothing is opened beyond what the user named, its folder and `reach`. The path is a file, an
    address, or a VRT as text; one that is known to be `placed` leaves warnings as they are.

    Raises
    ------
    ImageryError
        No such file, not a picture, truncated, or the server does not answer.
    """
    name = display_name(path)
    refuse_no_address(path)
    if not is_remote(path) and not path.startswith(("/vsi", "<")) and "://" not in path:
        file = picture_file(path)
        if not file.exists():
            raise MissingFileError(
                f"There is no picture {file}.", hint="Check the path; it must name a raster file."
            )
        if file.is_file() and file.stat().st_size == 0:
            raise ImageryError(f"The picture {path} is empty (0 bytes).", hint="Copy it again.")
    try:
        drivers = _drivers_for(path, reach)
        if is_remote(path) or drivers == ["VRT"]:
            from geofield.imagery.gateway import gateway

            rasterio.env.setenv(**gateway().options(reach.of(path)))
        with nullcontext() if placed else _unplaced_is_no_news():
            dataset = DatasetReader(path, driver=drivers)
        if "OVERVIEW_FILE" in dataset.tags(ns="OVERVIEWS"):
            dataset.close()
            raise ImageryError(f"The picture {name} names overviews in another file.")
        return dataset
    except RasterioIOError as error:
        _tell_refused(path, reach)
        raise ImageryError(
            f"The picture {name} cannot be opened: {reason(error, path)}.",
            hint=(
                _CHECK
                if is_remote(path)
                else "It must be a raster file that GDAL reads (GeoTIFF, COG, VRT, JPEG 2000 ...), "
                "unpacked from its archive; `gdalinfo` tells more."
            ),
        ) from None


@contextmanager
def _unplaced_is_no_news() -> Iterator[None]:
    """Silence what our own errors say of a picture without a place, with a next step.

    Warnings are silenced in all threads of a process: not while windows are read, which several do.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        yield


def _tell_refused(path: str, reach: Reach = OWN_FOLDER) -> None:
    """Say which host a picture's server sends on to, or which one is silent, where that is why."""
    if not is_remote(path) and not path.lower().endswith(".vrt"):
        return
    from geofield.imagery.gateway import gateway

    refused, silent = gateway().refused, gateway().silent(path)
    if refused:
        address = refused.pop()
        refused.clear()
        reach.of(path).require(address, f"The picture {display_name(path)}")
    if silent:
        raise ImageryError(
            f"The picture {display_name(path)} cannot be read: {silent}.", hint=_CHECK
        )


def _drivers_for(path: str, reach: Reach) -> list[str]:
    """The drivers that may open a picture, after a look at it."""
    if path.startswith("<"):
        check_vrt(path.encode(), "stacked bands", Path(), reach)
        return ["VRT"]
    file = picture_file(path)
    if is_remote(path) or not file.is_file():
        return _DRIVERS
    with file.open("rb") as stream:
        head = stream.read(4096)
    if b"<VRTDataset" in head:
        body = file.read_bytes()[: 1 << 26]
        # GDAL begins at the file that a link leads to.
        check_vrt(body, file.name, file.resolve().parent, reach.of(path))
        return ["VRT"]
    check_beside(file)
    return _DRIVERS


@contextmanager
def reading(path: str) -> Iterator[None]:
    """Turn GDAL's read errors, and warnings of damage, into one that says what to do."""
    why = ""
    with made_up() as said:
        try:
            yield
        except (RasterioError, OSError) as error:
            _tell_refused(path)
            why = reason(error, path)
    if why or said:
        raise ImageryError(
            f"The picture {display_name(path)} cannot be read to its end: {why or said[0]}.",
            hint="The file is truncated or damaged: copy or download it again.",
        )


def reason(error: BaseException, path: str) -> str:
    """GDAL's own words without paths, queries and keys."""
    cause: BaseException = error
    while cause.__cause__ is not None:
        cause = cause.__cause__
    text = str(cause) or str(error)
    text = text.replace(path, display_name(path))
    text = re.sub(r"(https?://[^\s?'\"]+)\?[^\s'\"]*", r"\1", text)
    text = re.sub(r"//[^/@\s]+@", "//", text)
    return text.strip().rstrip(".").split("\n")[0][:300]
