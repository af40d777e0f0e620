"""What a stranger's file names is not followed: no connection, no file outside its folder."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import rasterio
from affine import Affine
from rasterio.control import GroundControlPoint

from geofield.imagery import read_scene
from geofield_command import run_geofield

from .pictures import EAST, NORTH, UTM, ground
from .tile_server import Handler, serving

LAT, LON = 48.0, 15.0
WMS = (
    '<GDAL_WMS><Service name="TMS"><ServerUrl>{url}/${{z}}/${{x}}/${{y}}.png</ServerUrl></Service>'
    "<DataWindow><UpperLeftX>-20037508</UpperLeftX><UpperLeftY>20037508</UpperLeftY>"
    "<LowerRightX>20037508</LowerRightX><LowerRightY>-20037508</LowerRightY><TileLevel>1"
    "</TileLevel><TileCountX>1</TileCountX><TileCountY>1</TileCountY><YOrigin>top</YOrigin>"
    "</DataWindow><Projection>EPSG:3857</Projection><BlockSizeX>256</BlockSizeX>"
    "<BlockSizeY>256</BlockSizeY><BandsCount>3</BandsCount></GDAL_WMS>"
)
SERVER = """
import socket, sys
server = socket.create_server(("127.0.0.1", 0))
print(server.getsockname()[1], flush=True)
while True:
    connection, _ = server.accept()
    open(sys.argv[1], "a").write("called\\n")
    connection.sendall(b"HTTP/1.1 404 Not Found\\r\\nContent-Length: 0\\r\\n\\r\\n")
    connection.close()
"""


class Stranger:
    """A server of another process that writes down every connection."""

    def __init__(self, url: str, calls: Path) -> None:
        self.url = url
        self._calls = calls

    @property
    def was_called(self) -> bool:
        return self._calls.exists()


@pytest.fixture
def stranger(tmp_path: Path) -> Iterator[Stranger]:
    calls = tmp_path / "calls.txt"
    with subprocess.Popen(
        [sys.executable, "-c", SERVER, str(calls)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        yield Stranger(f"http://127.0.0.1:{process.stdout.readline().strip()}", calls)
        process.kill()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of the user's; beside it lies a picture that is none of its business."""
    mine = tmp_path / "mine"
    mine.mkdir()
    for place in (mine / "own.tif", tmp_path / "secret.tif"):
        _picture(place)
    return mine


def _picture(path: Path) -> None:
    values = np.random.default_rng(3).integers(1, 255, (3, 200, 200), np.uint8)
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        width=200,
        height=200,
        count=3,
        dtype="uint8",
        crs="EPSG:32633",
        transform=Affine(0.6, 0, 500_000 - 60, 0, -0.6, 5_316_300 + 60),
        photometric="RGB",
    ) as file:
        file.write(values)


def vrt(source: str, *, relative: bool = False, band: str = "", more: str = "") -> str:
    bands = "".join(
        f'<VRTRasterBand dataType="Byte" band="{n}"{band}><SimpleSource>'
        f'<SourceFilename relativeToVRT="{int(relative)}">{source}</SourceFilename>'
        f'<SourceBand>{n}</SourceBand><SrcRect xOff="0" yOff="0" xSize="200" ySize="200"/>'
        '<DstRect xOff="0" yOff="0" xSize="200" ySize="200"/></SimpleSource></VRTRasterBand>'
        for n in (1, 2, 3)
    )
    return (
        '<VRTDataset rasterXSize="200" rasterYSize="200"><SRS>EPSG:32633</SRS>'
        f"<GeoTransform>499940, 0.6, 0, 5316360, 0, -0.6</GeoTransform>{more}{bands}</VRTDataset>"
    )


def cut(*args: object) -> subprocess.CompletedProcess[str]:
    """`geofield tiles` at the point of the pictures."""
    return run_geofield("tiles", *args, "--lat", LAT, "--lon", LON, "--size", 40, timeout_s=120)


def refused(done: subprocess.CompletedProcess[str], out: Path) -> str:
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert not out.exists()
    return done.stderr


def test_a_vrt_reads_its_own_folder(folder: Path) -> None:
    (folder / "a.vrt").write_text(vrt("own.tif", relative=True))
    (folder / "b.vrt").write_text(vrt("a.vrt", relative=True))
    for name in ("a.vrt", "b.vrt"):
        done = cut(folder / name, "-o", folder / f"{name}.tif")
        assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "how", ["", "-order 2", "-tps", "-order 1 -refine_gcps 0.5 3", "-et 0", "-t_srs EPSG:32635"]
)
def test_a_vrt_that_warps_by_control_points_is_read(folder: Path, how: str) -> None:
    """As `gdalwarp -of VRT` writes it: only numbers place its picture."""
    if shutil.which("gdalwarp") is None:
        pytest.skip("gdalwarp is not there")
    points = [
        GroundControlPoint(row, column, EAST + column / 2, NORTH - row / 2)
        for row in (0, 32, 64)
        for column in (0, 32, 64)
    ]
    profile = {"width": 64, "height": 64, "count": 3, "dtype": "uint8", "photometric": "RGB"}
    source = folder / "points.tif"
    with rasterio.open(source, "w", driver="GTiff", gcps=points, crs=UTM, **profile) as file:
        file.write(ground(64, 64))
    warped = folder / "warped.vrt"
    subprocess.run(["gdalwarp", "-q", "-of", "VRT", *how.split(), source, warped], check=True)
    assert read_scene(warped).valid.mean() > 0.8


def test_a_vrt_reads_no_other_file_unless_allowed(folder: Path) -> None:
    secret, out = folder.parent / "secret.tif", folder / "out.tif"
    for text in (vrt(str(secret)), vrt("../secret.tif", relative=True)):
        (folder / "a.vrt").write_text(text)
        assert "secret.tif, which you did not name" in refused(
            cut(folder / "a.vrt", "-o", out), out
        )
    done = cut(folder / "a.vrt", "--allow", secret, "-o", out)
    assert done.returncode == 0, done.stderr


def test_a_vrt_reads_no_raw_bytes_and_runs_no_code(folder: Path) -> None:
    out = folder / "out.tif"
    (folder / "passwords").write_bytes(b"root:x:0:0" * 12_000)
    raw = (
        '<VRTDataset rasterXSize="200" rasterYSize="200"><SRS>EPSG:32633</SRS>'
        "<GeoTransform>499940, 0.6, 0, 5316360, 0, -0.6</GeoTransform>"
        '<VRTRasterBand dataType="Byte" band="1" subClass="VRTRawRasterBand">'
        '<SourceFilename relativeToVRT="1">passwords</SourceFilename><ImageOffset>0</ImageOffset>'
        "<PixelOffset>1</PixelOffset><LineOffset>200</LineOffset></VRTRasterBand></VRTDataset>"
    )
    code = vrt("own.tif", relative=True, band=' subClass="VRTDerivedRasterBand"').replace(
        "<SimpleSource>", "<PixelFunctionLanguage>Python</PixelFunctionLanguage><SimpleSource>"
    )
    for text, word in ((raw, "VRTRawRasterBand"), (code, "PixelFunctionLanguage")):
        (folder / "a.vrt").write_text(text)
        assert word in refused(cut(folder / "a.vrt", "-o", out), out)


@pytest.mark.parametrize("way", ["source", "inner", "driver", "stac", "overviews", "pam", "index"])
def test_nobody_is_called_that_only_a_file_names(
    folder: Path, stranger: Stranger, way: str
) -> None:
    out, picture = folder / "out.tif", folder / "a.vrt"
    address = f"{stranger.url}/a.tif"
    if way == "source":
        picture.write_text(vrt(f"/vsicurl/{address}"))
    elif way == "inner":
        (folder / "inner.tif").write_text(WMS.format(url=stranger.url))
        picture.write_text(vrt("inner.tif", relative=True))
    elif way == "driver":
        picture = folder / "service.tif"
        picture.write_text(WMS.format(url=stranger.url))
    elif way == "overviews":
        picture = folder / "own.tif"
        (folder / "own.tif.ovr").write_text(WMS.format(url=stranger.url))
    elif way == "pam":
        picture = folder / "own.tif"
        (folder / "own.tif.aux.xml").write_text(
            '<PAMDataset><Metadata domain="OVERVIEWS"><MDI key="OVERVIEW_FILE">'
            f"/vsicurl/{address}</MDI></Metadata></PAMDataset>"
        )
    elif way == "index":
        picture = folder / "index.geojson"
        picture.write_text(
            json.dumps(
                {
                    "type": "FeatureCollection",
                    "features": [
                        {
                            "type": "Feature",
                            "properties": {"location": address},
                            "geometry": {"type": "Point", "coordinates": [LON, LAT]},
                        }
                    ],
                }
            )
        )
    else:
        picture = folder / "item.json"
        picture.write_text(
            json.dumps(
                {
                    "type": "Feature",
                    "id": "a",
                    "bbox": [LON - 1, LAT - 1, LON + 1, LAT + 1],
                    "geometry": None,
                    "properties": {},
                    "assets": {"visual": {"href": address, "roles": ["visual"]}},
                }
            )
        )
    refused(cut(picture, "-o", out), out)
    assert not stranger.was_called


def test_the_stranger_is_called_when_the_user_says_so(folder: Path, stranger: Stranger) -> None:
    (folder / "a.vrt").write_text(vrt(f"/vsicurl/{stranger.url}/a.tif"))
    cut(folder / "a.vrt", "--allow", stranger.url, "-o", folder / "out.tif")
    assert stranger.was_called


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (
            "a.geojson",
            '<OGRVRTDataSource><OGRVRTLayer name="x"><SrcDataSource>/vsicurl/URL/x.geojson'
            "</SrcDataSource></OGRVRTLayer></OGRVRTDataSource>",
        ),
        ("a.kml", "<OGRWFSDataSource><URL>URL/wfs</URL></OGRWFSDataSource>"),
        (
            "a.geojson",
            '{"type": "gdal_streamed_alg", "command_line": "gdal vector pipeline ! read '
            '/vsicurl/URL/x.geojson ! write streamed --of stream"}',
        ),
        (
            "a.gml",
            '<ogr:FeatureCollection xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" '
            'xsi:schemaLocation="http://ogr.maptools.org/ URL/x.xsd" '
            'xmlns:ogr="http://ogr.maptools.org/" xmlns:gml="http://www.opengis.net/gml">'
            '<gml:featureMember><ogr:a fid="a.1"><ogr:geometryProperty><gml:Point '
            'srsName="EPSG:4326"><gml:coordinates>1,2</gml:coordinates></gml:Point>'
            "</ogr:geometryProperty></ogr:a></gml:featureMember></ogr:FeatureCollection>",
        ),
        (
            "a.kml",
            '<!DOCTYPE kml [<!ENTITY secret SYSTEM "URL/entity">]>'
            '<kml xmlns="http://www.opengis.net/kml/2.2"><Document><NetworkLink><Link><href>'
            "URL/n.kml</href></Link></NetworkLink><Placemark><name>&secret;</name><Point>"
            "<coordinates>1,2,0</coordinates></Point></Placemark></Document></kml>",
        ),
        (
            "a.kml",
            '<kml xmlns="http://www.opengis.net/kml/2.2"><Document><NetworkLink><Link><href>'
            "URL/n.kml</href></Link></NetworkLink></Document></kml>",
        ),
    ],
)
def test_vectors_call_nobody_either(
    tmp_path: Path, stranger: Stranger, name: str, text: str
) -> None:
    file = tmp_path / name
    file.write_text(text.replace("URL", stranger.url))
    for line in (
        ("import", file, "-o", tmp_path / "new.gpkg"),
        ("tracks", file, "--crs", "EPSG:4326", "-o", tmp_path / "new.gpkg"),
        ("evaluate", file, file),
    ):
        done = run_geofield(*line, timeout_s=120)
        # GML is data: its point is read, but not the schema that it names. A link alone is a file
        # in which nothing was found.
        none = line[0] == "evaluate" and "NetworkLink" in text and "Placemark" not in text
        assert done.returncode in ((0, 1) if name == "a.gml" else (int(not none),)), done.stdout
        assert "Traceback" not in done.stderr
    assert not stranger.was_called
    assert (tmp_path / "new.gpkg").exists() == (name == "a.gml")


ENTITIES = (
    '<!DOCTYPE a [<!ENTITY x "y">]>',
    '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/hostname">]>',
    '<!DOCTYPE a SYSTEM "http://127.0.0.1:9/a.dtd">',
)


@pytest.mark.parametrize("prolog", ENTITIES)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_entities_are_refused_by_every_reader(tmp_path: Path, prolog: str, encoding: str) -> None:
    from geofield.errors import GeofieldError
    from geofield.formats import read_dataset
    from geofield.formats.xml import read_xml
    from geofield.imagery.sources.ows import read_document

    readers = {
        "ISO11783_TaskData": read_xml,
        "kml": lambda file: read_dataset(file.rename(file.with_suffix(".kml"))),
        "WMS_Capabilities": lambda file: read_document(str(file), None),
    }
    for root, read in readers.items():
        file = tmp_path / "a.xml"
        declared = f'<?xml version="1.0" encoding="{encoding}"?>'
        file.write_bytes(f"{declared}{prolog}<{root}>&x;</{root}>".encode(encoding))
        with pytest.raises(GeofieldError, match=r"entity|external document type"):
            read(file)


@pytest.mark.parametrize("target", ["another host", "file:///etc/hostname", "ftp://127.0.0.1/a"])
def test_servers_send_on_to_nobody_else(tmp_path: Path, stranger: Stranger, target: str) -> None:
    location = f"{stranger.url}/a.png" if target == "another host" else target

    def sent_on(handler: Handler, tile: tuple[int, int, int], attempt: int) -> bool:
        handler.reply(302, b"", "text/plain", Location=location)
        return True

    out = tmp_path / "out.tif"
    with serving(sent_on) as server:
        done = cut(server.template, "--zoom", 16, "--no-cache", "-o", out)
    assert "sends on to" in refused(done, out) or "leads to" in done.stderr
    assert not stranger.was_called


def test_a_server_may_send_on_to_itself(tmp_path: Path) -> None:
    def sent_on(handler: Handler, tile: tuple[int, int, int], attempt: int) -> bool:
        if handler.path.startswith("/old/"):
            handler.reply(302, b"", "text/plain", Location=handler.path[4:])
            return True
        return False

    out = tmp_path / "out.tif"
    with serving(sent_on) as server:
        template = server.address + "/old/{z}/{x}/{y}.png"
        done = cut(template, "--zoom", 16, "--no-cache", "-o", out)
    assert done.returncode == 0, done.stderr
