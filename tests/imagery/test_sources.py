"""Every kind of source, each against a real server or real files."""

from __future__ import annotations

import io
import json
import logging
import pickle
import re
import shutil
import subprocess
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import geopandas as gpd
import mercantile
import numpy as np
import pytest
import rasterio
import shapely
from affine import Affine
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from rasterio.control import GroundControlPoint

from geofield.cli.main import cli
from geofield.crs import LONLAT, WEB_MERCATOR, parse_crs, transformer
from geofield.errors import (
    ImageryError,
    ImageryWarning,
    NetworkError,
    PointOutsideError,
    TermsError,
)
from geofield.grid import Grid
from geofield.imagery import (
    FetchOptions,
    Imagery,
    Where,
    acquire,
    find_source,
    open_reader,
    read_scene,
)
from geofield.imagery.cache import cache_infos
from geofield.imagery.client import Client
from geofield.imagery.sources import BUILTIN, PictureSource
from geofield.imagery.sources.google import GoogleStaticSource
from geofield.imagery.sources.registry import kind_of
from geofield.imagery.sources.xyz import XYZSource, quadkey
from geofield.imagery.terms import Terms
from geofield.imagery.tiling import Tile
from geofield.settings import ImagerySettings, Settings
from geofield.windows import open_scene
from geofield_command import run_geofield

from .pictures import EAST, NORTH, RESOLUTION, UTM, ground, write
from .tile_server import Handler, TileServer, encode, serving, tile_pixels

LAT, LON = 35.075373, 33.531142
FAST = FetchOptions(backoff_s=0.01, timeout_s=2.0, attempts=2)
WORLD = 20037508.342789244


def pattern(grid: Grid) -> np.ndarray:
    """The servers' picture on any grid: a function of place alone (rows, columns, 3)."""
    x, y = grid.to_native(
        np.arange(grid.width_px)[None, :] + 0.5, np.arange(grid.height_px)[:, None] + 0.5
    )
    red = np.floor(x / 3.0) % 251
    green = np.floor(y / 5.0) % 241
    return np.dstack([red, green, (red + green) % 233]).astype(np.uint8)


# -- templates ----------------------------------------------------------------------------------


@given(zoom=st.integers(1, 22), data=st.data())
def test_templates_put_numbers_where_they_belong(zoom: int, data: Any) -> None:
    column = data.draw(st.integers(0, 2**zoom - 1))
    row = data.draw(st.integers(0, 2**zoom - 1))
    tile = Tile(zoom, column, row)

    def url(template: str) -> str:
        return XYZSource("x", template).address(tile)

    flipped = 2**zoom - 1 - row
    assert url("http://h/{z}/{x}/{y}.png") == f"http://h/{zoom}/{column}/{row}.png"
    assert url("http://h/{z}/{x}/{-y}.png") == f"http://h/{zoom}/{column}/{flipped}.png"
    key = mercantile.quadkey(column, row, zoom)
    assert quadkey(tile) == key
    assert url("http://h/{q}.jpg") == f"http://h/{key}.jpg"
    assert url("http://{s}.h/{z}/{x}/{y}{r}.png")[7] in "abc"
    assert url("http://{switch:m, n}.h/{z}/{x}/{y}")[7] in "mn"


def test_double_tiles_are_512_px() -> None:
    assert XYZSource("x", "http://h/{z}/{x}/{y}{r}.png").pyramid.levels[0].tile_px == (512, 512)
    assert XYZSource("x", "http://h/{z}/{x}/{y}@2x.png").pyramid.levels[0].tile_px == (512, 512)


@pytest.mark.parametrize(
    ("template", "message"),
    [
        ("https://h/{z}/{x}.png", r"lacks \{y\}"),
        ("https://h/tiles.png", r"lacks \{x\}, \{y\}, \{z\}"),
        ("ftp://h/{z}/{x}/{y}", "does not begin with https"),
        ("https://h/{z}/{x}/{y}/{what}", r"unknown part \{what\}"),
        ("https://h/{z}/{x}/{y}?key={key}", "needs a key.*GEOFIELD_KEY_MY_MAP"),
    ],
)
def test_bad_templates(template: str, message: str) -> None:
    with pytest.raises(ImageryError, match=message):
        XYZSource("my map", template)


def test_a_key_written_into_a_template_is_not_repeated_in_messages() -> None:
    with pytest.raises(ImageryError) as caught:
        XYZSource("x", "https://h/{z}/{x}.png?token=secret123")
    assert "secret123" not in str(caught.value)


def test_unknown_names_get_the_nearest_one() -> None:
    with pytest.raises(ImageryError, match="Did you mean 'switzerland'"):
        find_source("swizerland")
    with pytest.raises(ImageryError, match="There is no picture"):
        find_source("folder/none.tif")
    with pytest.raises(ImageryError, match="one picture of a file") as caught:
        find_source("NETCDF:/fields/a.nc:ortho")  # as GDAL names it
    assert "gdal_translate" in str(caught.value.hint)
    with pytest.raises(ImageryError, match=r"no picture /fields/a\.gpkg"):
        find_source("GPKG:/fields/a.gpkg:ortho")


@pytest.mark.parametrize(
    ("what", "kind"),
    [
        ("https://h/{z}/{x}/{y}.png", "xyz"),
        ("https://h/ows?service=WMS&layers=a", "wms"),
        ("https://h/1.0.0/WMTSCapabilities.xml", "wmts"),
        ("https://h/geoserver/wms", "wms"),
        ("wmts:https://h/any", "wmts"),
        ("https://h/ortho.tif", "picture"),
        ("s3://bucket/ortho.tif", "picture"),
        ("nothing-here", ""),
    ],
)
def test_kinds(what: str, kind: str) -> None:
    assert kind_of(what)[0] == kind


def test_zoom_and_latitude_beyond_the_source(tmp_path: Path) -> None:
    source = XYZSource("x", "http://127.0.0.1:9/{z}/{x}/{y}.png", max_zoom=19)
    with pytest.raises(ImageryError, match=r"no zoom 20.*has 0 to 19"):
        acquire(source, Where(lat=LAT, lon=LON, zoom=20), tmp_path / "a.tif", options=FAST)
    with pytest.raises(ImageryError, match=r"Latitude 86.*85\.05"):
        acquire(source, Where(lat=86, lon=LON, zoom=10), tmp_path / "a.tif", options=FAST)


def test_every_built_in_source_has_its_terms() -> None:
    for name, entry in BUILTIN.items():
        assert entry.terms.attribution, name
        assert entry.terms.licence, name
        assert entry.terms.url.startswith("https://"), name
        assert entry.address.startswith("https://"), name
    assert not BUILTIN["google"].terms.may_derive
    assert not BUILTIN["google"].terms.cacheable


# -- terms and keys ------------------------------------------------------------------------------

KEY = "AIza-very/secret+key"


def google_server(server: TileServer) -> None:
    def frame(handler: Handler, query: dict[str, str]) -> None:
        if query.get("key") != KEY:
            handler.reply(403, b"bad key " + query.get("key", "").encode(), "text/plain")
            return
        lat, lon = (float(part) for part in query["center"].split(","))
        size = int(query["size"].partition("x")[0])
        grid = Grid.web_mercator(
            lat=lat, lon=lon, zoom=int(query["zoom"]), width_px=size, height_px=size
        )
        handler.reply(200, encode(pattern(grid)), "image/png")

    server.routes["/staticmap"] = frame


def test_google_needs_acknowledgement_and_is_never_cached(tmp_path: Path) -> None:
    with serving() as server:
        google_server(server)
        source = GoogleStaticSource(key=KEY, service=server.address + "/staticmap")
        options = replace(FAST, cache_dir=tmp_path / "cache")
        where = Where(lat=LAT, lon=LON, zoom=18)
        with pytest.raises(TermsError, match="acknowledged=True"):
            acquire(source, where, tmp_path / "a.tif", options=options)
        assert server.paths == []
        options = replace(options, acknowledged=True)
        done = acquire(source, where, tmp_path / "a.tif", options=options)
        # Where no size is asked for, what the service gives at most; and no more of it.
        with Imagery("", source, options).at(LAT, LON, ImagerySettings()) as picture:
            assert read_scene(picture.path).grid.shape == (640, 640)
            assert picture.wider(5000.0) is None
            assert not picture.offers_more
        with pytest.raises(ImageryError, match="1 to 640 px"):
            acquire(source, replace(where, size_px=641), tmp_path / "b.tif", options=options)
        with pytest.raises(ImageryError, match="needs a cache"):
            acquire(source, where, tmp_path / "b.tif", options=replace(options, offline=True))
    assert not (tmp_path / "cache").exists()
    # The point lies exactly at the centre, to the service's six decimals.
    assert done.grid == Grid.web_mercator(lat=LAT, lon=LON, zoom=18)
    scene = read_scene(done.path)
    assert np.array_equal(scene.rgb, pattern(done.grid))
    assert scene.source.may_derive is False
    assert "Google" in scene.source.attribution


def _everything_written(folder: Path) -> bytes:
    parts = []
    for path in sorted(folder.rglob("*")):
        parts.append(str(path).encode())
        if path.is_file():
            parts.append(path.read_bytes())
    return b"\n".join(parts)


@pytest.mark.parametrize("trouble", ["", "wrong key", "dead", "404", "html"])
def test_keys_show_nowhere(
    tmp_path: Path,
    trouble: str,
    caplog: pytest.LogCaptureFixture,
    capfd: pytest.CaptureFixture[str],
) -> None:
    caplog.set_level(logging.DEBUG)
    quoted = KEY.replace("/", "%2F").replace("+", "%2B")
    shown = []
    with serving() as server:

        def keyed(handler: Handler, query: dict[str, str]) -> None:
            if trouble == "wrong key":
                handler.reply(401, f"bad key {query['key']}".encode(), "text/plain")
            elif trouble == "dead":
                handler.reset()
            elif trouble == "404":
                handler.reply(404, b"", "text/plain")
            elif trouble == "html":
                handler.reply(200, f"<html>{query['key']}</html>".encode(), "text/html")
            else:
                zoom, column, row = map(int, handler.path.split("?")[0].split("/")[-3:])
                handler.reply(200, encode(tile_pixels(zoom, column, row)), "image/png")

        server.routes["/keyed"] = keyed
        source = XYZSource(
            "paid",
            server.address + "/keyed/{z}/{x}/{y}?key={key}",
            terms=Terms(may_cache=True),
            key=KEY,
        )
        options = replace(FAST, cache_dir=tmp_path / "cache")
        try:
            done = acquire(
                source, Where(lat=LAT, lon=LON, zoom=18), tmp_path / "a.tif", options=options
            )
            shown.append(repr(done))
        except ImageryError as error:
            shown.append(str(error))
            assert trouble
        assert any(quoted in path for path in server.paths)
    shown += [repr(source), caplog.text, *capfd.readouterr()]
    everything = "\n".join(shown).encode() + _everything_written(tmp_path)
    assert KEY.encode() not in everything
    assert quoted.encode() not in everything


@pytest.mark.parametrize(
    "template",
    [
        "https://mt1.google.com/vt/lyrs=s&x={x}&y={y}&z={z}",
        "https://ecn.t0.tiles.virtualearth.net/tiles/a{q}.jpeg",
        "https://services.arcgisonline.com/ArcGIS/rest/services/World_Imagery/MapServer/tile/{z}/{y}/{x}",
    ],
)
def test_addresses_of_owners_who_forbid_it_are_known(tmp_path: Path, template: str) -> None:
    source = find_source(template)
    assert not isinstance(source, PictureSource)
    assert not source.terms.cacheable
    with pytest.raises(TermsError, match="forbid"):
        acquire(source, Where(lat=LAT, lon=LON, zoom=18), tmp_path / "a.tif", options=FAST)


# -- WMS and WMTS ------------------------------------------------------------------------------

WMS = """<?xml version="1.0"?>
<WMS_Capabilities version="1.3.0" xmlns="http://www.opengis.net/wms"
  xmlns:xlink="http://www.w3.org/1999/xlink">
 <Service><Name>WMS</Name><AccessConstraints>CC BY 4.0</AccessConstraints></Service>
 <Capability>
  <Request><GetMap><Format>image/jpeg</Format><Format>image/png</Format>
   <DCPType><HTTP><Get><OnlineResource xlink:href="ADDRESS/wms?map=a"/></Get></HTTP></DCPType>
  </GetMap></Request>
  <Layer><Title>All</Title><CRS>EPSG:4326</CRS>
   <Layer><Name>ortho</Name><CRS>CRSNAME</CRS>
    <Attribution><Title>Land survey</Title></Attribution></Layer>
   <Layer><Name>plan</Name></Layer>
  </Layer>
 </Capability>
</WMS_Capabilities>"""


def wms_server(server: TileServer, crs_name: str) -> None:
    def answer(handler: Handler, query: dict[str, str]) -> None:
        upper = {name.upper(): value for name, value in query.items()}
        if upper["REQUEST"] == "GetCapabilities":
            text = WMS.replace("ADDRESS", server.address).replace("CRSNAME", crs_name)
            handler.reply(200, text.encode(), "text/xml")
            return
        assert upper["MAP"] == "a"
        box = [float(part) for part in upper["BBOX"].split(",")]
        if crs_name in ("EPSG:31468", "EPSG:32661"):  # the authority lists northing first
            box = [box[1], box[0], box[3], box[2]]
        width, height = int(upper["WIDTH"]), int(upper["HEIGHT"])
        transform = Affine(
            (box[2] - box[0]) / width, 0, box[0], 0, (box[1] - box[3]) / height, box[3]
        )
        grid = Grid(width, height, transform, parse_crs(upper["CRS"]))
        handler.reply(200, encode(pattern(grid)), "image/png")

    server.routes["/wms"] = answer


@pytest.mark.parametrize(
    ("crs_name", "lat", "lon", "zoom"),
    [
        ("EPSG:3857", LAT, LON, 18),
        ("EPSG:32633", 47.1, 15.4, None),
        ("EPSG:31468", 48.0, 12.1, None),
        # Both axes of polar systems point south (or north): easting first but in 32661.
        ("EPSG:3413", 72.6, -38.5, None),
        ("EPSG:3031", -72.0, 2.5, None),
        ("EPSG:5041", 83.5, 10.0, None),
        ("EPSG:32661", 83.5, 10.0, None),
    ],
)
def test_wms(tmp_path: Path, crs_name: str, lat: float, lon: float, zoom: int | None) -> None:
    with serving() as server:
        wms_server(server, crs_name)
        client = Client(FetchOptions(attempts=2))
        address = server.address + "/wms?service=WMS"
        with pytest.raises(ImageryError, match=r"2 layers.*layer=.NAME.*ortho, plan"):
            find_source(address, client=client, point=(lon, lat))
        with pytest.raises(ImageryError, match="Did you mean 'ortho'"):
            find_source(address, client=client, layer="orto")
        source = find_source(address, client=client, layer="ortho", point=(lon, lat))
        client.close()
        assert pickle.loads(pickle.dumps(source)) == source
        assert source.terms.attribution == "Land survey"
        where = Where(lat=lat, lon=lon, zoom=zoom, resolution_m=0.6, size_px=700)
        options = replace(FAST, cache_dir=tmp_path / "cache")
        done = acquire(source, where, tmp_path / "a.tif", options=options)
        again = acquire(source, where, tmp_path / "b.tif", options=replace(options, offline=True))
    assert done.grid.crs.to_epsg() == int(crs_name[5:])
    assert done.grid.ground_resolution_m <= 0.61
    with rasterio.open(done.path) as file:
        got = np.moveaxis(file.read(), 0, -1)
    assert np.array_equal(got, pattern(done.grid))
    assert again.path.read_bytes() == done.path.read_bytes()
    if zoom:
        # MBTiles count zooms as web maps do: GDAL finds the same ground in the cache.
        info = cache_infos(tmp_path / "cache")[0]
        assert info.zooms == (17, 17)
        with rasterio.open(info.path, driver="MBTILES") as file:
            x, y = done.grid.to_native(0.5, 0.5)
            row, column = file.index(x, y)
            assert file.res[0] == pytest.approx(done.grid.transform.a, rel=1e-9)
            pixel = file.read((1, 2, 3), window=rasterio.windows.Window(column, row, 1, 1))
        assert np.array_equal(pixel[:, 0, 0], got[0, 0])


WMTS = """<?xml version="1.0"?>
<Capabilities xmlns="http://www.opengis.net/wmts/1.0" xmlns:ows="http://www.opengis.net/ows/1.1"
  xmlns:xlink="http://www.w3.org/1999/xlink" version="1.0.0">
 <ows:ServiceIdentification><ows:AccessConstraints>DL-DE-ZERO</ows:AccessConstraints>
 </ows:ServiceIdentification>
 <ows:ServiceProvider><ows:ProviderName>Land survey</ows:ProviderName></ows:ServiceProvider>
 <ows:OperationsMetadata><ows:Operation name="GetTile"><ows:DCP><ows:HTTP>
  <ows:Get xlink:href="ADDRESS/kvp?"/></ows:HTTP></ows:DCP></ows:Operation>
 </ows:OperationsMetadata>
 <Contents><Layer><ows:Identifier>dop</ows:Identifier>
  <Style isDefault="true"><ows:Identifier>plain</ows:Identifier></Style>
  <Format>image/png</Format>
  <TileMatrixSetLink><TileMatrixSet>SET</TileMatrixSet></TileMatrixSetLink>
  RESOURCE
 </Layer>
 <TileMatrixSet><ows:Identifier>SET</ows:Identifier>
  <ows:SupportedCRS>urn:ogc:def:crs:EPSG::CODE</ows:SupportedCRS>
  MATRICES
 </TileMatrixSet></Contents>
</Capabilities>"""
OGC_CRS = ("http://www.opengis.net/def/crs/EPSG/0/", "urn:ogc:def:crs:EPSG::")
MATRIX = (
    "<TileMatrix><ows:Identifier>{0}</ows:Identifier><ScaleDenominator>{1}</ScaleDenominator>"
    "<TopLeftCorner>{2}</TopLeftCorner><TileWidth>256</TileWidth><TileHeight>256</TileHeight>"
    "<MatrixWidth>{3}</MatrixWidth><MatrixHeight>{3}</MatrixHeight></TileMatrix>"
)


def wmts_document(address: str, *, mercator: bool, rest: bool) -> str:
    if mercator:  # as printed in many documents: too few digits to be exact
        matrices = "".join(
            MATRIX.format(
                f"{z:02d}", f"{559082264.029 / 2**z:.4f}", "-20037508.34 20037508.34", 2**z
            )
            for z in range(5, 21)
        )
        code = "3857"
    else:  # northing before easting, as the authority of EPSG:31468 has it
        matrices = "".join(
            MATRIX.format(f"L{n}", scale, "6000000 4000000", 10000)
            for n, scale in enumerate([4000, 2000, 1000])
        )
        code = "31468"
    resource = (
        f'<ResourceURL format="image/png" resourceType="tile" template="{address}/rest/'
        '{Style}/{TileMatrixSet}/{TileMatrix}/{TileCol}/{TileRow}.png"/>'
        if rest
        else ""
    )
    return (
        WMTS.replace("ADDRESS", address)
        .replace("MATRICES", matrices)
        # The authority's order of axes holds for both ways to name a CRS in full.
        .replace("urn:ogc:def:crs:EPSG::", OGC_CRS[rest])
        .replace("CODE", code)
        .replace("RESOURCE", resource)
    )


def wmts_server(server: TileServer, *, mercator: bool, rest: bool) -> None:
    def capabilities(handler: Handler, query: dict[str, str]) -> None:
        text = wmts_document(server.address, mercator=mercator, rest=rest)
        handler.reply(200, text.encode(), "text/xml")

    def draw(handler: Handler, matrix: str, column: int, row: int) -> None:
        if mercator:
            handler.reply(200, encode(tile_pixels(int(matrix), column, row)), "image/png")
            return
        resolution = [4000, 2000, 1000][int(matrix[1:])] * 0.00028
        left, top = 4_000_000 + column * 256 * resolution, 6_000_000 - row * 256 * resolution
        grid = Grid(
            256, 256, Affine(resolution, 0, left, 0, -resolution, top), parse_crs("EPSG:31468")
        )
        handler.reply(200, encode(pattern(grid)), "image/png")

    def by_rest(handler: Handler, query: dict[str, str]) -> None:
        style, name, matrix, column, last = handler.path.strip("/").split("/")[1:]
        assert (style, name) == ("plain", "SET")
        draw(handler, matrix, int(column), int(last.partition(".")[0]))

    def by_query(handler: Handler, query: dict[str, str]) -> None:
        assert query["LAYER"] == "dop"
        assert query["STYLE"] == "plain"
        draw(handler, query["TILEMATRIX"], int(query["TILECOL"]), int(query["TILEROW"]))

    server.routes |= {"/WMTSCapabilities.xml": capabilities, "/rest": by_rest, "/kvp": by_query}


@pytest.mark.parametrize("rest", [True, False])
@pytest.mark.parametrize("mercator", [True, False])
def test_wmts(tmp_path: Path, mercator: bool, rest: bool) -> None:
    with serving() as server:
        wmts_server(server, mercator=mercator, rest=rest)
        client = Client(FetchOptions(attempts=2))
        source = find_source(server.address + "/WMTSCapabilities.xml", client=client)
        client.close()
        assert not isinstance(source, PictureSource)
        assert source.terms.attribution == "Land survey"
        if mercator:
            assert source.pyramid.zooms == (5, 20)
            where = Where(lat=LAT, lon=LON, zoom=18, size_px=600)
        else:
            where = Where(lat=48.0, lon=12.1, zoom="max", size_px=600)
        done = acquire(source, where, tmp_path / "a.tif", options=FAST)
    with rasterio.open(done.path) as file:
        got = file.read()
    if mercator:
        from .test_fetch import expected

        assert np.array_equal(got, expected(done.grid, 18))
        column = (done.grid.transform.c + WORLD) / done.grid.transform.a
        assert column == pytest.approx(round(column), abs=1e-6)
    else:
        assert done.grid.crs.to_epsg() == 31468
        assert np.array_equal(np.moveaxis(got, 0, -1), pattern(done.grid))


def test_capabilities_from_a_file_and_bad_ones(tmp_path: Path) -> None:
    file = tmp_path / "caps.xml"
    file.write_text(wmts_document("http://127.0.0.1:9", mercator=True, rest=True))
    with pytest.raises(ImageryError, match=r"leads to http://127\.0\.0\.1:9"):
        find_source(str(file))
    source = find_source(str(file), allow=["http://127.0.0.1:9"])
    assert not isinstance(source, PictureSource)
    assert source.pyramid.zooms == (5, 20)
    nowhere = wmts_document("http://127.0.0.1:9", mercator=True, rest=True)
    for text, message in [
        (nowhere.replace("http://127.0.0.1:9", "caps"), "no web address of its service"),
        ("<html>wmts<body>", "does not give XML"),
        ("<ExceptionReport>wmts is down</ExceptionReport>", "answers: wmts is down"),
        ('<!DOCTYPE a [<!ENTITY b "wmts">]><a>&b;</a>', "entity"),
    ]:
        file.write_text(text)
        with pytest.raises(ImageryError, match=message):
            find_source(str(file))


def test_a_wmts_in_degrees_that_has_longitude_first(tmp_path: Path) -> None:
    corners = []
    for corner in ("90 -180", "-180 90"):
        text = wmts_document("http://127.0.0.1:9", mercator=False, rest=True)
        text = text.replace("6000000 4000000", corner).replace("31468", "4326")
        (file := tmp_path / "caps.xml").write_text(text)
        source = find_source(str(file), allow=["http://127.0.0.1:9"])
        assert not isinstance(source, PictureSource)
        corners += [(level.left, level.top) for level in source.pyramid.levels]
    assert set(corners) == {(-180.0, 90.0)}


@pytest.mark.parametrize("wrong", ["", "0", "nan", "1e-300", "x", "-1", "1 2 3"])
@pytest.mark.parametrize("name", ["ScaleDenominator", "TopLeftCorner", "TileWidth", "MatrixHeight"])
def test_a_wmts_with_a_wrong_number_has_its_other_levels(
    tmp_path: Path, name: str, wrong: str
) -> None:
    text = wmts_document("http://127.0.0.1:9", mercator=True, rest=True)
    (file := tmp_path / "caps.xml").write_text(
        re.sub(f"<{name}>[^<]*", f"<{name}>{wrong}", text, count=1)
    )
    source = find_source(str(file), allow=["http://127.0.0.1:9"])
    assert not isinstance(source, PictureSource)
    assert source.pyramid.zooms == (6, 20)
    file.write_text(re.sub(f"<{name}>[^<]*", f"<{name}>{wrong}", text))
    with pytest.raises(ImageryError, match="does not say how it is cut into tiles"):
        find_source(str(file), allow=["http://127.0.0.1:9"])


def test_a_document_that_is_not_there_names_the_host() -> None:
    with (
        serving() as server,
        closing(Client(FetchOptions(attempts=1))) as client,
        pytest.raises(NetworkError, match=r"127\.0\.0\.1.*status 404"),
    ):
        find_source(server.address + "/a/WMTSCapabilities.xml", client=client)


# -- pictures over HTTP, folders, indexes, STAC -------------------------------------------------


def test_a_cog_over_http_is_read_by_ranges(tmp_path: Path) -> None:
    from geofield.imagery import write_scene

    values = ground(1600, 1600)
    picture = write(
        tmp_path / "plain.tif", values, photometric="RGB", tiled=True, compress="deflate"
    )
    cog = write_scene(read_scene(picture), tmp_path / "cog.tif")
    size = cog.stat().st_size
    sent = []

    with serving() as server:

        def answer(handler: Handler, query: dict[str, str]) -> None:
            assert query.get("sig") == "hush"
            asked = handler.headers.get("Range", "")
            first, _, last = asked.removeprefix("bytes=").partition("-")
            if handler.command == "GET":
                sent.append(int(last) - int(first) + 1 if last else size)
            handler.file(cog)

        server.routes["/cog.tif"] = answer
        address = f"{server.address}/cog.tif?sig=hush"
        grid = open_reader(str(cog)).grid
        lon, lat = grid.to_lonlat(800.5, 800.5)
        scene = read_scene(address, lat=lat, lon=lon, size_px=301)
        assert np.array_equal(scene.bands, values[:, 650:951, 650:951])
        assert scene.source.name == "cog.tif" or "hush" not in scene.source.name
        assert sum(sent) < size / 2
        with pytest.raises(ImageryError) as caught:
            read_scene(f"{server.address}/gone.tif?sig=hush", lat=lat, lon=lon)
        assert "hush" not in str(caught.value)


def sheets(folder: Path) -> np.ndarray:
    """Four sheets of one picture on one lattice, with a seam through its middle."""
    values = ground(200, 240)
    folder.mkdir()
    for row in (0, 100):
        for column in (0, 120):
            place = Affine(
                RESOLUTION, 0, EAST + column * RESOLUTION, 0, -RESOLUTION, NORTH - row * RESOLUTION
            )
            part = values[:, row : row + 100, column : column + 120]
            write(folder / f"sheet_{row}_{column}.tif", part, transform=place, photometric="RGB")
    return values


def test_a_folder_of_sheets_is_one_picture(tmp_path: Path) -> None:
    values = sheets(tmp_path / "sheets")
    (tmp_path / "sheets" / "notes.txt").write_text("not a picture")
    whole = Grid(240, 200, Affine(RESOLUTION, 0, EAST, 0, -RESOLUTION, NORTH), UTM)
    lon, lat = whole.to_lonlat(120.5, 100.5)
    scene = read_scene(tmp_path / "sheets", lat=lat, lon=lon, size_px=101)
    assert np.array_equal(scene.bands, values[:, 50:151, 70:171])
    assert scene.valid.all()
    assert any("Joined from 4 pictures" in note for note in scene.notes)
    everything = read_scene(tmp_path / "sheets", lat=lat, lon=lon)
    assert np.array_equal(everything.bands, values)
    coarse = read_scene(tmp_path / "sheets", lat=lat, lon=lon, resolution_m=1.0)
    assert coarse.valid.all()
    mean = values.reshape(3, 100, 2, 120, 2).mean(axis=(2, 4))
    assert np.abs(coarse.bands - mean).mean() < 4
    with pytest.raises(PointOutsideError, match="outside all 4 pictures"):
        read_scene(tmp_path / "sheets", lat=lat + 1, lon=lon)
    reader = pickle.loads(pickle.dumps(open_reader(str(tmp_path / "sheets"), lat=lat, lon=lon)))
    assert np.array_equal(reader.read().bands, values)


def test_a_damaged_picture_of_a_folder_is_told(tmp_path: Path) -> None:
    folder = tmp_path / "sheets"
    sheets(folder)
    whole = Grid(240, 200, Affine(RESOLUTION, 0, EAST, 0, -RESOLUTION, NORTH), UTM)
    lon, lat = whole.to_lonlat(30.5, 30.5)

    def field() -> subprocess.CompletedProcess[str]:
        where = ("--lat", lat, "--lon", lon, "--output", tmp_path / "out.gpkg")
        return run_geofield("field", folder, "--overwrite", *where)

    assert "left out" not in field().stderr
    (folder / "sheet_100_120.tif").write_bytes(b"not a picture")
    told = field()
    assert told.returncode == 0
    assert told.stderr.count("sheet_100_120.tif was left out") == 1
    assert "not recognized as being in a supported file format" in told.stderr
    with pytest.warns(ImageryWarning, match=r"sheet_100_120\.tif was left out"):
        scene = read_scene(folder, lat=lat, lon=lon)
    assert any("sheet_100_120.tif was left out" in note for note in scene.notes)
    # The only one that shows the place: nothing else is taken for it.
    (folder / "sheet_0_0.tif").write_bytes(b"not a picture")
    refused = field()
    assert refused.returncode == 1
    assert "outside all 2 pictures" in refused.stderr
    assert "sheet_0_0.tif was left out" in refused.stderr
    # Of many, a few are named.
    for name in "abcd":
        (folder / f"{name}.tif").write_bytes(b"not a picture")
    assert "c.tif was left out" in field().stderr
    assert "So were 3 more." in field().stderr


def east_sheets(folder: Path, values: np.ndarray, **profile: Any) -> None:
    """The two sheets in the east anew, with other values."""
    for row in (0, 100):
        place = Affine(RESOLUTION, 0, EAST + 60, 0, -RESOLUTION, NORTH - row * RESOLUTION)
        part = values[:, row : row + 100, 120:]
        write(folder / f"sheet_{row}_120.tif", part, transform=place, **profile)


def test_sheets_are_joined_by_the_bands_that_they_share(tmp_path: Path) -> None:
    folder = tmp_path / "sheets"
    values = sheets(folder)
    four = np.concatenate([values[::-1], values[:1] // 2])
    named = ["blue", "green", "red", "nir"]
    east_sheets(folder, four, descriptions=named, photometric="MINISBLACK")
    whole = Grid(240, 200, Affine(RESOLUTION, 0, EAST, 0, -RESOLUTION, NORTH), UTM)
    for at in (30.5, 150.5):
        lon, lat = whole.to_lonlat(at, 50.5)
        scene = read_scene(folder, lat=lat, lon=lon)
        colours = [scene.roles.index(role) for role in ("red", "green", "blue")]
        assert scene.nir is None
        assert np.array_equal(scene.bands[colours], values)
        assert scene.valid.all()
    assert scene.guesses[0].startswith("Read without nir, which sheet_0_0.tif does not have")
    near = read_scene(folder, lat=lat, lon=lon, size_px=21)  # where all have it
    assert np.array_equal(near.nir, values[0, 40:61, 140:161] // 2)
    assert near.guesses == ()


@pytest.mark.parametrize("kind", ["uint16", "grey"])
def test_sheets_of_another_kind_are_told(tmp_path: Path, kind: str) -> None:
    folder = tmp_path / "sheets"
    values = sheets(folder)
    east_sheets(folder, values.astype(np.uint16) * 40 if kind == "uint16" else values[:1])
    whole = Grid(240, 200, Affine(RESOLUTION, 0, EAST, 0, -RESOLUTION, NORTH), UTM)
    lon, lat = whole.to_lonlat(30.5, 50.5)
    why = {"uint16": "its values are uint16, those of sheet_0_0.tif uint8; .* gdal_translate"}
    told = rf"sheet_0_120\.tif was left out: {why.get(kind, 'it shows grey, unlike')}"
    with pytest.warns(ImageryWarning, match=told):
        scene = open_scene(folder, lat, lon, Settings())
    assert "sheet_100_120.tif was left out" in scene.guesses[0]
    assert read_scene(folder, lat=lat, lon=lon, size_px=41).guesses == ()  # far from them


def test_sheets_of_another_zone_fit_to_a_pixel(tmp_path: Path) -> None:
    # Two neighbours on either side of 36 E, each in its own zone, showing the same ground.
    folder = tmp_path / "zones"
    folder.mkdir()
    lon0, lat0 = 36.0, 35.0
    for name, epsg, shift in [("west", 32636, -260), ("east", 32637, -140)]:
        unit = Grid(1, 1, Affine.identity(), parse_crs(epsg))
        x, y = unit.from_lonlat(lon0, lat0)
        place = Affine(0.5, 0, round(x) + 0.5 * shift, 0, -0.5, round(y) + 100)
        grid = Grid(400, 400, place, parse_crs(epsg))
        px, py = np.meshgrid(np.arange(400) + 0.5, np.arange(400) + 0.5)
        lons, lats = grid.to_lonlat(px, py)
        # A smooth function of the place on earth.
        wave = np.sin((lons - lon0) * 4e4) + np.cos((lats - lat0) * 3e4)
        values = np.stack([120 + 55 * wave] * 3).astype(np.uint8)
        write(folder / f"{name}.tif", values, crs=f"EPSG:{epsg}", transform=place)
    west = open_reader(str(folder / "west.tif")).grid
    lon, lat = west.to_lonlat(300, 200)
    scene = read_scene(folder, lat=lat, lon=lon)
    assert any("1 of them reprojected" in note for note in scene.notes)
    assert scene.grid.width_px > 480
    px, py = np.meshgrid(
        np.arange(scene.grid.width_px) + 0.5, np.arange(scene.grid.height_px) + 0.5
    )
    lons, lats = scene.grid.to_lonlat(px, py)
    wave = np.sin((lons - lon0) * 4e4) + np.cos((lats - lat0) * 3e4)
    difference = np.abs(scene.bands[0].astype(float) - (120 + 55 * wave))[scene.valid]
    assert np.percentile(difference, 99) < 3.0


def test_a_geopackage_that_is_the_picture_itself(tmp_path: Path) -> None:
    """As QGIS and GDAL write one; other GeoPackages are indexes."""
    from .pictures import ground, write

    plain = write(tmp_path / "plain.tif", ground())
    rasterio.shutil.copy(plain, tmp_path / "tiled.gpkg", driver="GPKG", TILE_FORMAT="PNG")
    there, here = read_scene(plain), read_scene(tmp_path / "tiled.gpkg")
    assert here.grid.to_native(3, 4) == pytest.approx(there.grid.to_native(3, 4), abs=1e-6)
    height, width = there.bands.shape[1:]
    assert np.array_equal(here.bands[:3, :height, :width], there.bands)
    told = CliRunner().invoke(cli, ["info", str(tmp_path / "tiled.gpkg")])
    assert "bands: red uint8" in told.stdout
    # Of several pictures in one file, which one is for the person to say.
    more = {"driver": "GPKG", "RASTER_TABLE": "b", "APPEND_SUBDATASET": "YES"}
    rasterio.shutil.copy(plain, tmp_path / "tiled.gpkg", **more)
    with pytest.raises(ImageryError, match="2 others") as caught:
        read_scene(tmp_path / "tiled.gpkg")
    name = f"GPKG:{tmp_path / 'tiled.gpkg'}:B"
    assert "Name one of them, as in 'GPKG:" in caught.value.hint
    told = CliRunner().invoke(cli, ["info", str(tmp_path / "tiled.gpkg")])
    assert "pictures in it:" in told.stdout
    assert name in told.stdout
    assert np.array_equal(read_scene(name).bands[:3, :height, :width], there.bands)
    assert isinstance(find_source(name), PictureSource)
    told = CliRunner().invoke(cli, ["info", name])
    assert "bands: red uint8" in told.stdout
    with pytest.raises(ImageryError, match="Cannot find table 'c'"):
        read_scene(f"{name[:-1]}c")


def test_an_index_and_a_vrt(tmp_path: Path) -> None:
    import fiona

    values = sheets(tmp_path / "sheets")
    index = tmp_path / "index.gpkg"
    schema = {"geometry": "Polygon", "properties": {"location": "str"}}
    ring = [(0, 0), (1, 0), (1, 1), (0, 0)]
    with fiona.open(index, "w", driver="GPKG", schema=schema, crs="EPSG:4326") as table:
        for path in sorted((tmp_path / "sheets").glob("*.tif")):
            table.write(
                {
                    "geometry": {"type": "Polygon", "coordinates": [ring]},
                    "properties": {"location": f"sheets/{path.name}"},
                }
            )
    whole = Grid(240, 200, Affine(RESOLUTION, 0, EAST, 0, -RESOLUTION, NORTH), UTM)
    lon, lat = whole.to_lonlat(120.5, 100.5)
    assert np.array_equal(read_scene(index, lat=lat, lon=lon).bands, values)
    vrt = tmp_path / "one.vrt"
    with rasterio.open(tmp_path / "sheets" / "sheet_0_0.tif") as file:
        rasterio.shutil.copy(file, str(vrt), driver="VRT")
    assert np.array_equal(read_scene(vrt).bands, values[:, :100, :120])


def test_an_index_that_was_cut_off(tmp_path: Path) -> None:
    index = tmp_path / "index.fgb"
    rows = {"location": ["sheet.tif"], "geometry": [shapely.box(33, 35, 34, 36)]}
    gpd.GeoDataFrame(rows, crs=4326).to_file(index)
    index.write_bytes(index.read_bytes()[:300])
    with pytest.raises(ImageryError, match=r"^The index index\.fgb cannot be read: .*whole\?$"):
        read_scene(index)


def test_a_picture_that_is_called_like_an_index(tmp_path: Path, sample: Path) -> None:
    named = tmp_path / "picture.gpkg"
    named.write_bytes((sample / "field_1.tif").read_bytes())
    assert np.array_equal(read_scene(named).bands, read_scene(sample / "field_1.tif").bands)


def test_stac_items(tmp_path: Path) -> None:
    values = ground(100, 100, 4)
    write(tmp_path / "data.tif", values, photometric="MINISBLACK")
    for n, name in enumerate(["red", "green", "blue"]):
        write(tmp_path / f"{name}.tif", values[n : n + 1])
    grid = Grid(100, 100, Affine(RESOLUTION, 0, EAST, 0, -RESOLUTION, NORTH), UTM)
    corners = grid.corners_lonlat()
    lon, lat = grid.to_lonlat(50, 50)
    item = {
        "type": "Feature",
        "stac_version": "1.0.0",
        "id": "survey-7",
        "geometry": {"type": "Polygon", "coordinates": [[*corners, corners[0]]]},
        "properties": {
            "datetime": "2024-05-01T10:00:00Z",
            "license": "CC-BY-4.0",
            "providers": [{"name": "Land survey"}],
        },
        "links": [],
        "assets": {
            "thumbnail": {"href": "t.png", "type": "image/png", "roles": ["thumbnail"]},
            "image": {
                "href": "./data.tif",
                "type": "image/tiff; application=geotiff",
                "roles": ["data"],
                "eo:bands": [
                    {"name": "B1", "common_name": "nir"},
                    {"name": "B2", "common_name": "red"},
                    {"name": "B3", "common_name": "green"},
                    {"name": "B4", "common_name": "blue"},
                ],
            },
        },
    }
    file = tmp_path / "item.json"
    file.write_text(json.dumps(item))
    scene = read_scene(file, lat=lat, lon=lon)
    assert scene.roles == ("nir", "red", "green", "blue")
    assert np.array_equal(scene.bands, values)
    assert (scene.source.name, scene.source.date) == ("survey-7", "2024-05-01T10:00:00Z")
    assert (scene.source.licence, scene.source.attribution) == ("CC-BY-4.0", "Land survey")
    with pytest.raises(PointOutsideError, match="No item"):
        read_scene(file, lat=lat + 1, lon=lon)
    # One picture per colour, in a collection with a newer item elsewhere.
    single = {
        name: {"href": f"{name}.tif", "type": "image/tiff", "bands": [{"eo:common_name": name}]}
        for name in ("blue", "green", "red")
    }
    far = {**item, "id": "far", "geometry": {"type": "Point", "coordinates": [0, 0]}}
    several = {"type": "FeatureCollection", "features": [far, {**item, "assets": single}]}
    file.write_text(json.dumps(several))
    scene = read_scene(file, lat=lat, lon=lon)
    assert scene.roles == ("red", "green", "blue")
    assert np.array_equal(scene.bands, values[:3])
    # A band of other pixels over the same ground is one of it, one of the ground beside is none.
    coarse = Affine(2 * RESOLUTION, 0, EAST, 0, -2 * RESOLUTION, NORTH)
    write(tmp_path / "blue.tif", values[2:3, ::2, ::2], transform=coarse)
    assert read_scene(file, lat=lat, lon=lon).roles == ("red", "green", "blue")
    for place, crs in ((coarse @ Affine.translation(3, 0), UTM), (coarse, "EPSG:32635")):
        write(tmp_path / "blue.tif", values[2:3, ::2, ::2], transform=place, crs=crs)
        with pytest.raises(ImageryError, match=r"^red\.tif and blue\.tif do not show the same"):
            read_scene(file, lat=lat, lon=lon)


def test_a_stac_file_with_nulls_is_read_and_one_out_of_order_is_told(tmp_path: Path) -> None:
    write(tmp_path / "data.tif", ground(), photometric="RGB")
    scene = read_scene(tmp_path / "data.tif")
    lon, lat = scene.grid.centre_lonlat
    asset = {"href": "data.tif", "roles": ["visual"]}
    nulls: dict[str, Any] = {"geometry": None, "properties": None, "links": None, "bbox": None}
    odd: list[dict[str, Any]] = [
        {"properties": {"providers": ["me"]}},
        {"assets": {"visual": {**asset, "bands": ["red"]}}},
        {"geometry": {"type": "Polygon"}},
        {"geometry": {"type": "Field", "coordinates": []}},
        {"bbox": [33, 35]},
    ]
    file = tmp_path / "item.json"
    dated = {"datetime": None, "start_datetime": "2018-01-01T00:00:00Z", "proj:epsg": None}
    for more in (
        {},
        {"properties": {"providers": None, "license": None}},
        {"properties": {"providers": [None], **dated}, "links": [None], "bbox": [None] * 4},
    ):
        file.write_text(
            json.dumps({**nulls, "assets": {"visual": {**asset, "type": None}}, **more})
        )
        assert np.array_equal(read_scene(file, lat=lat, lon=lon).bands, scene.bands)
    for each in odd:
        file.write_text(json.dumps({"assets": {"visual": asset}, **each}))
        with pytest.raises(ImageryError, match=r"^item\.json is not as STAC has it"):
            read_scene(file, lat=lat, lon=lon)
    # An asset, or an item of several, that is null is none, and the others are read.
    none: dict[str, Any] = {"none": None, "no address": {"type": "image/tiff", "href": None}}
    bands = {"visual": {**asset, "bands": [None, None, None]}}
    items = [None, {"assets": None}, {**nulls, "assets": {**none, **bands}}]
    file.write_text(json.dumps({"type": "FeatureCollection", "features": items}))
    assert np.array_equal(read_scene(file, lat=lat, lon=lon).bands, scene.bands)
    for assets in (None, {}, none):
        file.write_text(json.dumps({"stac_version": "1.0.0", **nulls, "assets": assets}))
        with pytest.raises(ImageryError, match=r"^No item of item\.json has a GeoTIFF") as told:
            read_scene(file, lat=lat, lon=lon)
        assert told.value.hint == "Give items with assets of the role `data` or `visual`."


def test_the_date_is_that_of_the_item_that_is_shown(tmp_path: Path) -> None:
    # Web Mercator pixels are finer on the ground towards the north, where the old sheet reaches.
    x, y = transformer(LONLAT, WEB_MERCATOR).transform(33.0, 35.0)

    def item(year: int, rows: int, pixel: float) -> dict[str, Any]:
        place = Affine(pixel, 0, x - 20, 0, -pixel, y + pixel * rows - 20)
        values = np.full((3, rows, 100), year - 1900, np.uint8)
        values[:, ::2] += 1
        path = tmp_path / f"{year}_{pixel}.tif"
        write(path, values, crs="EPSG:3857", transform=place, photometric="RGB")
        asset = {"href": path.name, "type": "image/tiff", "roles": ["visual"]}
        properties = {"datetime": f"{year}-06-01T00:00:00Z"}
        return {"id": str(year), "properties": properties, "assets": {"visual": asset}}

    def shown(*items: dict[str, Any]) -> tuple[int, str]:
        file = tmp_path / "items.json"
        file.write_text(json.dumps({"type": "FeatureCollection", "features": items}))
        scene = read_scene(file, lat=35.0, lon=33.0, size_m=10)
        return int(scene.bands.min()) + 1900, (scene.source.date or "")[:4]

    assert shown(item(2015, 9000, 0.6), item(2023, 100, 0.6)) == (2023, "2023")
    assert shown(item(2015, 9000, 0.3), item(2023, 100, 0.6)) == (2015, "2015")


def test_each_stac_item_has_its_own_order_of_bands(tmp_path: Path) -> None:
    grey = {"red": 60, "green": 120, "blue": 180, "nir": 240}

    def item(name: str, order: str, east: float) -> dict[str, Any]:
        names = order.split()
        values = np.stack([np.full((100, 100), grey[each], np.uint8) for each in names])
        values[:, ::2] += 1
        place = Affine(RESOLUTION, 0, east, 0, -RESOLUTION, NORTH)
        write(tmp_path / f"{name}.tif", values, transform=place)
        asset: dict[str, Any] = {"href": f"{name}.tif", "type": "image/tiff"}
        asset |= {"eo:bands": [{"common_name": each} for each in names]}
        return {"id": name, "properties": {}, "assets": {"image": asset}}

    items = [item("a", "red green blue nir", EAST), item("b", "nir red green blue", EAST + 50)]
    file = tmp_path / "items.json"
    file.write_text(json.dumps({"type": "FeatureCollection", "features": items}))
    scene = read_scene(file)
    assert scene.grid.shape == (100, 200)
    for name, value in grey.items():
        band = scene.band(name)
        assert band is not None
        assert band[51, [20, 150]].tolist() == [value, value]


@pytest.mark.parametrize("pixel", [RESOLUTION, 200.0])
def test_a_picture_with_control_points_lies_in_a_set_as_alone(tmp_path: Path, pixel: float) -> None:
    # Beside a sheet that reaches farther to the north-west, or wider than what is looked at.
    def place(column: float, row: float) -> tuple[float, float]:
        return EAST + pixel * column, NORTH - pixel * row

    corners = [(c, r) for c in (0, 128) for r in (0, 96)]
    gcps = [
        GroundControlPoint(row=r, col=c, x=place(c, r)[0], y=place(c, r)[1]) for c, r in corners
    ]
    profile: dict[str, Any] = {"driver": "GTiff", "count": 3, "dtype": "uint8", "crs": UTM}
    path = tmp_path / "set" / "points.tif"
    path.parent.mkdir()
    with rasterio.open(path, "w", width=128, height=96, gcps=gcps, **profile) as file:
        file.write(ground())
    beside = Affine(2 * pixel, 0, EAST - 20 * pixel, 0, -2 * pixel, NORTH + 20 * pixel)
    write(path.with_name("beside.tif"), ground(), transform=beside, photometric="RGB")
    lon, lat = transformer(parse_crs(UTM), LONLAT).transform(*place(90, 60))
    at = {"lat": lat, "lon": lon, "size_px": 21}
    alone, among = read_scene(path, **at), read_scene(path.parent, **at)
    assert among.grid == alone.grid
    assert np.array_equal(among.bands, alone.bands)
    assert "beside.tif was left out: only control points place points.tif" in " ".join(
        among.guesses
    )


@pytest.mark.parametrize(("lat", "lon"), [(35.28, 33.02), (35.15, 33.299), (35.15, 33.301)])
def test_a_set_of_sheets_in_degrees_is_seen_to_their_borders(
    tmp_path: Path, lat: float, lon: float
) -> None:
    # Sheets of 27 km: each one reprojected reaches 10 km from its middle, or from the point.
    for n in (0, 1):
        place = Affine(1e-3, 0, 33.0 + 0.3 * n, 0, -1e-3, 35.3)
        values = ground(300, 300)
        write(tmp_path / f"{n}.tif", values, crs="EPSG:4326", transform=place, photometric="RGB")
    scene = read_scene(tmp_path, lat=lat, lon=lon, size_m=3000)
    assert min(scene.grid.shape) * scene.grid.ground_resolution_m > 2800
    assert scene.valid.mean() > 0.97


def test_own_pictures_are_cut_as_they_are(tmp_path: Path) -> None:
    path = write(tmp_path / "own.tif", ground(), photometric="RGB")
    source = find_source(path)
    grid = open_reader(path).grid
    lon, lat = grid.to_lonlat(60.5, 40.5)
    done = acquire(source, Where(lat=lat, lon=lon, size_px=21), tmp_path / "cut.tif")
    with rasterio.open(done.path) as file:
        assert np.array_equal(file.read(), ground()[:, 30:51, 50:71])
    area = shapely.box(*grid.to_lonlat(40, 60), *grid.to_lonlat(60, 40))
    done = acquire(source, Where(area=area), tmp_path / "area.tif")
    assert 19 <= done.grid.width_px <= 22
    # Ground that is wide and low gives a picture of that shape, with all of its corners.
    corners = np.array([(20, 40), (80, 40), (80, 60), (20, 60)])
    area = shapely.Polygon(np.column_stack(grid.to_lonlat(*corners.T)))
    done = acquire(source, Where(area=area), tmp_path / "wide.tif")
    x, y = done.grid.from_lonlat(*shapely.get_coordinates(area).T)
    size = done.grid.width_px, done.grid.height_px
    assert min(x.min(), y.min(), size[0] - x.max(), size[1] - y.max()) > -1e-3
    assert size[1] < 0.5 * size[0]
    with pytest.raises(ImageryError, match="is the picture itself"):
        acquire(source, Where(lat=lat, lon=lon), path, overwrite=True)


def test_mbtiles_of_others(tmp_path: Path) -> None:
    import sqlite3

    file = tmp_path / "other.mbtiles"
    with closing(sqlite3.connect(file)) as db, db:
        db.execute("CREATE TABLE metadata (name TEXT, value TEXT)")
        db.execute(
            "CREATE TABLE tiles (zoom_level INT, tile_column INT, tile_row INT, tile_data BLOB)"
        )
        tile = mercantile.tile(LON, LAT, 16)
        for dx in (-1, 0, 1):
            for dy in (-1, 0, 1):
                x, y = tile.x + dx, tile.y + dy
                body = encode(tile_pixels(16, x, y))
                db.execute("INSERT INTO tiles VALUES (16, ?, ?, ?)", (x, 2**16 - 1 - y, body))
    source = find_source(str(file))
    where = Where(lat=LAT, lon=LON, zoom="max", size_px=256)
    done = acquire(source, where, tmp_path / "a.tif")
    from .test_fetch import expected

    with rasterio.open(done.path) as opened:
        assert np.array_equal(opened.read(), expected(done.grid, 16))
    # What the file does not show is no picture, as beyond the edge of any other one.
    wide = acquire(source, replace(where, size_px=1500), tmp_path / "b.tif")
    with rasterio.open(wide.path) as opened:
        assert 0.2 < opened.dataset_mask().mean() / 255 < 0.3  # 768 of 1500 px
    with pytest.raises(ImageryError, match="not in the file"):
        acquire(source, replace(where, lat=LAT + 0.1), tmp_path / "c.tif")
    (tmp_path / "bad.mbtiles").write_text("nothing")
    with pytest.raises(ImageryError, match="not an MBTiles file"):
        find_source(str(tmp_path / "bad.mbtiles"))
    # Damaged after it was looked at.
    with closing(sqlite3.connect(file)) as db, db:
        (page,) = db.execute("SELECT rootpage FROM sqlite_master WHERE name = 'tiles'").fetchone()
        (size,) = db.execute("PRAGMA page_size").fetchone()
    content = bytearray(file.read_bytes())
    content[page * size - size : page * size - size + 8] = b"\xff" * 8
    file.write_bytes(content)
    with pytest.raises(ImageryError, match="the file is damaged there"):
        acquire(source, where, tmp_path / "c.tif")


def test_jpeg_and_webp_tiles(tmp_path: Path) -> None:
    for form in ("JPEG", "WEBP"):

        class Other(TileServer):
            def body(self, tile: tuple[int, int, int], form: str = form) -> bytes:
                buffer = io.BytesIO()
                Image.fromarray(np.full((256, 256, 3), 99, np.uint8)).save(buffer, form)
                return buffer.getvalue()

        with serving() as server:
            server.__class__ = Other
            source = XYZSource("x", server.template)
            target = tmp_path / f"{form}.tif"
            with pytest.warns(ImageryWarning, match="same picture"):
                done = acquire(source, Where(lat=LAT, lon=LON, zoom=18), target, options=FAST)
        assert np.abs(read_scene(done.path).bands.astype(int) - 99).max() <= 2


@pytest.mark.real
def test_real_chips_as_a_folder(shared: Path, tmp_path: Path) -> None:
    # Different UTM zones and years in one folder: the chip that holds the point is shown.
    for name in ("riverside_2018_89", "chico_2018_77", "claremont_2020_75"):
        shutil.copy(shared / "data" / "trees" / f"{name}.tif", tmp_path)
    for name in ("chico_2018_77", "riverside_2018_89"):
        with rasterio.open(tmp_path / f"{name}.tif") as file:
            values = file.read()
        lon, lat = open_reader(str(tmp_path / f"{name}.tif")).grid.centre_lonlat
        scene = read_scene(tmp_path, lat=lat, lon=lon, size_px=128)
        assert np.array_equal(scene.bands, values[:, 64:192, 64:192])
