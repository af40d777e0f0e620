"""What a VRT and the files beside a picture may lead GDAL to.

A VRT names other pictures, and GDAL opens them with any of its drivers. Here a VRT is read
first: only elements that are known, only sources within reach, and only such as hold pixels
themselves or are such a VRT again.
"""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn
from xml.etree import ElementTree as ET

from geofield.errors import ImageryError
from geofield.imagery.reach import Reach
from geofield.strangers import PICTURES, parse_xml

#: How deep VRTs may name VRTs.
_MAX_LEVELS = 6
_SOURCES = frozenset({"SourceFilename", "SourceDataset"})
_SYSTEMS = frozenset({"SRS", "SourceSRS", "TargetSRS", "GDALWarpSRS"})
_WORDS = """
VRTDataset GeoTransform GCPList GCP Metadata MDI VRTRasterBand ColorInterp NoDataValue
HideNoDataValue Description UnitType Offset Scale CategoryNames Category ColorTable Entry
Histograms HistItem HistMin HistMax BucketCount IncludeOutOfRange Approximate HistCounts
SimpleSource ComplexSource AveragedSource KernelFilteredSource SourceBand SourceProperties SrcRect
DstRect NODATA UseMaskBand ScaleOffset ScaleRatio ColorTableComponent Exponent SrcMin SrcMax
DstMin DstMax Clamp LUT Kernel Size Coefs Overview OverviewList MaskBand BlockXSize BlockYSize
GDALWarpOptions WarpMemoryLimit ResampleAlg WorkingDataType Option BandList BandMapping
SrcNoDataReal SrcNoDataImag DstNoDataReal DstNoDataImag SrcAlphaBand DstAlphaBand Transformer
ApproxTransformer MaxError BaseTransformer GenImgProjTransformer SrcGeoTransform
SrcInvGeoTransform DstGeoTransform DstInvGeoTransform ReprojectTransformer ReprojectionTransformer
SrcGCPTransformer SrcTPSTransformer GCPTransformer TPSTransformer Order Reversed Refine MinimumGcps
Tolerance Options PixelFunctionType PixelFunctionArguments SourceTransferType
"""
#: Elements that hold figures and words, but never the name of a file.
_PLAIN = frozenset(_WORDS.split())
_SUBCLASSES = frozenset(
    ("", "VRTWarpedDataset", "VRTSourcedRasterBand", "VRTWarpedRasterBand", "VRTDerivedRasterBand")
)
#: First bytes of further formats that hold their pixels themselves.
_MAGIC = (b"\xff\x4f\xff\x51", b"EHFA_HEADER_TAG", b"RIFF", b"SQLite format 3", b"BM", b"GIF8")


def check_vrt(body: bytes, name: str, folder: Path, reach: Reach, *, level: int = 0) -> None:
    """Refuse a VRT that leads out of reach; relative names begin at the folder."""
    try:
        root = parse_xml(body, name)
    except ET.ParseError as error:
        raise ImageryError(f"{name} is not well-formed XML: {error}.") from None
    if level > _MAX_LEVELS:
        raise ImageryError(f"{name} leads from VRT to VRT more than {_MAX_LEVELS} times.")
    for element in root.iter():
        text = (element.text or "").strip()
        if element.get("subClass", "") not in _SUBCLASSES:
            _refuse(name, f"the kind {element.get('subClass')}")
        if element.tag in _SOURCES:
            relative = element.get("relativeToVRT", element.get("relativetoVRT")) == "1"
            _check_source(folder / text if relative else text, name, reach, level)
        elif element.tag in _SYSTEMS:
            if text.lower().startswith(("http", "/", "\\", "file", ".")):
                _refuse(name, f"a coordinate system by the name of a file ({text[:60]})")
        elif element.tag not in _PLAIN:
            _refuse(name, f"the element {element.tag}")
        elif element.tag == "Metadata" and element.get("domain") == "OVERVIEWS":
            _refuse(name, "overviews by the name of a file")


def check_beside(file: Path) -> None:
    """Refuse files beside a picture that GDAL would follow elsewhere: overviews, masks, PAM."""
    for ending in (".ovr", ".OVR", ".msk", ".MSK", ".msk.ovr", ".ovr.ovr"):
        beside = file.with_name(file.name + ending)
        if beside.is_file() and not holds_pixels(beside):
            raise ImageryError(
                f"{beside} is no picture, and GDAL would follow it.", hint="Remove it."
            )
    record = file.with_name(file.name + ".aux.xml")
    if not record.is_file():
        return
    try:
        root = parse_xml(record.read_bytes(), record.name)
    except ET.ParseError:
        return  # GDAL cannot read it either
    if any(each.get("key", "").upper() == "OVERVIEW_FILE" for each in root.iter()):
        raise ImageryError(f"{record} names overviews in another file.", hint="Remove it.")


def holds_pixels(file: Path) -> bool:
    """Whether a file begins like a format that needs no other file."""
    with file.open("rb") as stream:
        return stream.read(16).startswith(PICTURES + _MAGIC)


def _check_source(source: str | Path, name: str, reach: Reach, level: int) -> None:
    reach.require(source, name)
    text = str(source)
    if "://" in text:
        return  # a host that the user named
    file = Path(text)
    if not file.is_file():
        raise ImageryError(f"{name} names the picture {file}, which is not there.")
    if holds_pixels(file):
        check_beside(file)
        return
    body = file.read_bytes()[: 1 << 26]
    if b"<VRTDataset" not in body[:4096]:
        raise ImageryError(f"{name} names {file}, which is no picture that holds its pixels.")
    check_vrt(body, file.name, file.parent, reach, level=level + 1)


def _refuse(name: str, what: str) -> NoReturn:
    raise ImageryError(
        f"The VRT {name} holds {what}, which may lead to other files or hosts.",
        hint="Give its pictures themselves, or make a GeoTIFF of it with gdal_translate.",
    )
