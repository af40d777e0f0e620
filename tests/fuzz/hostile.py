"""Files that somebody made to do harm, one by one."""

from __future__ import annotations

import json
import struct
import zipfile
from collections.abc import Iterator
from pathlib import Path

from .corpus import Sample

_VECTOR = ("import FILE -o OUT/new.gpkg", "validate FILE", "info FILE")
_PICTURE = (
    "info FILE",
    "tiles FILE POINT --size 64 -o OUT/new.tif",
    "field FILE POINT -o OUT/f.gpkg",
)
_BOMB = "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * 10 if n else "ha" * 50}">' for n in range(12))


def hostile(folder: Path) -> Iterator[Sample]:
    """Write them; each must be refused with a message."""

    def text(kind: str, name: str, body: str, commands: tuple[str, ...] = _VECTOR) -> Sample:
        place = folder / kind.replace(" ", "_") / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(body)
        return Sample(kind, place, commands)

    for suffix, root in (
        ("kml", "kml"),
        ("gpx", "gpx"),
        ("rdf", "RDF"),
        ("xml", "ISO11783_TaskData"),
    ):
        yield text(
            f"entity bomb {suffix}", f"a.{suffix}", f"<!DOCTYPE a [{_BOMB}]><{root}>&e11;</{root}>"
        )
        yield text(
            f"external entity {suffix}",
            f"a.{suffix}",
            f'<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/hostname">]><{root}>&x;</{root}>',
        )
        yield text(f"deep {suffix}", f"a.{suffix}", f"<{root}>" + "<a>" * 200_000)
    deep = "[" * 100_000 + "]" * 100_000
    yield text("deep GeoJSON", "a.geojson", f'{{"type": "Polygon", "coordinates": {deep}}}')
    nested = '{"type": "GeometryCollection", "geometries": [' * 20_000
    yield text("nested GeoJSON", "a.geojson", nested)
    for value in ("1e308", "NaN", "-1e400", "91", "181"):
        ring = [[0, 0], [0, 1], [1, 1], [0, 0]]
        body = json.dumps({"type": "Polygon", "coordinates": [ring]}).replace(
            "1, 1", f"{value}, {value}"
        )
        yield text(f"coordinate {value}", "a.geojson", body)
    yield text(
        "remote context",
        "a.jsonld",
        '{"@context": "http://127.0.0.1:9/context", "@id": "a", "@type": "Field"}',
    )
    yield text("deep settings", "a.toml", "a = " + "[" * 50_000, ("sources --settings FILE",))
    yield text("settings of another kind", "a.toml", "tracks = [1]", ("sources --settings FILE",))
    yield text("service", "a.tif", '<GDAL_WMS><Service name="WMS"/></GDAL_WMS>', _PICTURE)
    yield text(
        "VRT of a system file",
        "a.vrt",
        '<VRTDataset rasterXSize="9" rasterYSize="9"><VRTRasterBand dataType="Byte" band="1" '
        'subClass="VRTRawRasterBand"><SourceFilename>/etc/passwd</SourceFilename></VRTRasterBand>'
        "</VRTDataset>",
        _PICTURE,
    )
    yield text(
        "VRT of itself",
        "a.vrt",
        '<VRTDataset rasterXSize="9" rasterYSize="9"><VRTRasterBand dataType="Byte" band="1">'
        '<SimpleSource><SourceFilename relativeToVRT="1">a.vrt</SourceFilename></SimpleSource>'
        "</VRTRasterBand></VRTDataset>",
        _PICTURE,
    )
    yield Sample("enormous picture", enormous_tiff(folder / "enormous.tif"), _PICTURE[:2])
    for kind, name in (("path", "../../escaped.txt"), ("absolute path", "/tmp/escaped.txt")):
        file = folder / f"{kind.replace(' ', '_')}.zip"
        with zipfile.ZipFile(file, "w") as archive:
            archive.writestr(name, "out")
        yield Sample(f"archive with a {kind}", file, _VECTOR)
    bomb = folder / "bomb.zip"
    with (
        zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("a.geojson", "w", force_zip64=True) as member,
    ):
        for _ in range(30):
            member.write(b" " * (1 << 23))
    yield Sample("archive bomb", bomb, _VECTOR)


def enormous_tiff(path: Path) -> Path:
    """A picture of 100 000 x 100 000 px in a few kB: one strip stands for all rows."""
    side = 100_000
    entries = [
        (256, 4, 1, side),
        (257, 4, 1, side),
        (258, 3, 1, 8),
        (259, 3, 1, 1),
        (262, 3, 1, 1),
        (273, 4, 1, 8),
        (277, 3, 1, 1),
        (278, 4, 1, side),
        (279, 4, 1, 4),
    ]
    scale, tie = struct.pack("<3d", 0.6, 0.6, 0), struct.pack("<6d", 0, 0, 0, 4e5, 4e6, 0)
    keys = struct.pack("<16H", 1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 32636)
    start = 8 + 2 + 12 * (len(entries) + 3) + 4
    entries += [
        (33550, 12, 3, start),
        (33922, 12, 6, start + len(scale)),
        (34735, 3, 16, start + len(scale) + len(tie)),
    ]
    body = b"II*\0" + struct.pack("<I", 8) + struct.pack("<H", len(entries))
    body += b"".join(struct.pack("<HHII", *each) for each in sorted(entries)) + b"\0\0\0\0"
    path.write_bytes(body + scale + tie + keys)
    return path
