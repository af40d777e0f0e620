"""Fetching from a real server on loopback: exact, patient, resumable."""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import random
import sqlite3
import struct
import subprocess
import sys
import time
import zlib
from contextlib import closing
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import mercantile
import numpy as np
import pytest
import rasterio
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import box

from geofield.errors import ImageryError, ImageryWarning, NetworkError, OutputExistsError
from geofield.imagery import FetchOptions, Where, acquire, find_source, read_scene
from geofield.imagery.cache import cache_infos, clear_cache
from geofield.imagery.sources.mbtiles import MBTilesSource
from geofield.imagery.sources.xyz import XYZSource
from geofield.imagery.terms import Terms
from geofield.imagery.tiling import TilePyramid

from . import tile_server
from .tile_server import TileServer, chosen, first_time, serving, tile_pixels

LAT, LON = 35.075373, 33.531142
HERE = Where(lat=LAT, lon=LON, zoom=18, size_px=640)
FAST = FetchOptions(backoff_s=0.01, timeout_s=1.0)


def expected(grid: Any, zoom: int, size: int = 256) -> np.ndarray:
    """The picture the server's tiles make on a grid (bands, rows, columns)."""
    left = -20037508.342789244
    column = round((grid.transform.c - left) / grid.transform.a)
    row = round((-left - grid.transform.f) / grid.transform.a)
    c0, r0 = column // size, row // size
    c1 = -(-(column + grid.width_px) // size)
    r1 = -(-(row + grid.height_px) // size)
    world = 2**zoom
    rows = [
        np.concatenate([tile_pixels(zoom, c % world, r, size) for c in range(c0, c1)], axis=1)
        for r in range(r0, r1)
    ]
    whole = np.concatenate(rows)
    part = whole[
        row - r0 * size : row - r0 * size + grid.height_px,
        column - c0 * size : column - c0 * size + grid.width_px,
    ]
    return np.moveaxis(part, -1, 0)


def sha(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def leftovers(folder: Path) -> list[str]:
    return sorted(p.name for p in folder.iterdir() if p.name.startswith("."))


# -- the product ---------------------------------------------------------------------------


def test_a_point_becomes_an_exact_cog(tmp_path: Path) -> None:
    from rio_cogeo import cog_validate

    with serving() as server:
        source: Any = find_source(server.template)
        source = replace(
            source,
            name="survey",
            terms=Terms("© Survey", "CC BY 4.0", may_cache=True, url="https://example.org/terms"),
            date="2024-05-01",
        )
        done = acquire(source, HERE, tmp_path / "scene.tif", options=FAST)
        assert all(agent.startswith("geofield/") for agent in server.agents)
    assert done.report.wanted == done.report.downloaded == sum(server.asked.values())
    with rasterio.open(done.path) as file:
        assert np.array_equal(file.read(), expected(done.grid, 18))
        assert file.transform == done.grid.transform
        assert file.dataset_mask().all()
        tags = file.tags()
    assert tags["GEOFIELD_SOURCE"] == "survey"
    assert tags["GEOFIELD_ATTRIBUTION"] == "© Survey"
    assert tags["GEOFIELD_LICENCE"] == "CC BY 4.0"
    assert tags["GEOFIELD_ZOOM"] == "18"
    assert tags["GEOFIELD_IMAGERY_DATE"] == "2024-05-01"
    assert date.today().isoformat()[:4] in tags["GEOFIELD_DETAILS"]
    assert cog_validate(done.path, strict=True) == (True, [], [])
    scene = read_scene(done.path, lat=LAT, lon=LON)
    assert scene.source == done.source
    x, y = scene.pixel_of(lat=LAT, lon=LON)
    assert abs(x - 320) <= 0.5
    assert abs(y - 320) <= 0.5


@settings(max_examples=40)
@given(
    zoom=st.integers(1, 22),
    lon=st.floats(-180, 180),
    lat=st.floats(-85, 85),
    size=st.integers(1, 1500),
)
def test_blocks_lie_exactly_where_mercantile_puts_them(
    zoom: int, lon: float, lat: float, size: int
) -> None:
    pyramid = TilePyramid.web_mercator()
    whole = pyramid.block_around(zoom, lat=lat, lon=lon, size_px=size, whole_tiles=True)
    world = 2**zoom
    first = mercantile.xy_bounds(whole.column % world, whole.row, zoom)
    last_row = whole.row + whole.rows - 1
    last = mercantile.xy_bounds((whole.column + whole.columns - 1) % world, last_row, zoom)
    turn = 2 * 20037508.342789244
    grid = whole.grid
    left, top = grid.to_native(0, 0)
    right, bottom = grid.to_native(grid.width_px, grid.height_px)
    assert (left - first.left) % turn in (
        pytest.approx(0, abs=1e-6),
        pytest.approx(turn, abs=1e-6),
    )
    assert (right - last.right) % turn in (
        pytest.approx(0, abs=1e-6),
        pytest.approx(turn, abs=1e-6),
    )
    assert top == pytest.approx(first.top, abs=1e-8)
    assert bottom == pytest.approx(last.bottom, abs=1e-7)
    # The cut window is a whole number of pixels inside, around the point.
    cut = pyramid.block_around(zoom, lat=lat, lon=lon, size_px=size)
    column, row, width, height = cut.window
    assert (cut.column, cut.row) == (whole.column, whole.row)
    inner = grid.crop(column, row, width, height)
    assert np.allclose(tuple(inner.transform), tuple(cut.grid.transform), rtol=0, atol=1e-7)
    if width == height == size and abs(lon) < 179:
        x, y = cut.grid.from_lonlat(lon, lat)
        assert abs(x - size / 2) <= 0.5 + 1e-6
        assert abs(y - size / 2) <= 0.5 + 1e-6
    tiles = list(whole.tiles(0))
    assert [tile.column for tile in tiles] == [
        column % world for column in range(whole.column, whole.column + whole.columns)
    ]


@pytest.mark.parametrize("lon", [179.9999, -179.9999])
def test_the_antimeridian_is_crossed_without_a_seam(tmp_path: Path, lon: float) -> None:
    with serving() as server:
        where = Where(lat=-16.8, lon=lon, zoom=12, size_px=700)
        done = acquire(find_source(server.template), where, tmp_path / "a.tif", options=FAST)
    with rasterio.open(done.path) as file:
        assert np.array_equal(file.read(), expected(done.grid, 12))
    columns = {tile[1] for tile in server.asked}
    assert {0, 4095} <= columns
    # Places on both sides of it are found, and come back.
    scene = read_scene(done.path, lat=-16.8, lon=lon)
    for x in (10.5, 350.0, 690.5):
        there, north = scene.grid.to_lonlat(x, 350.0)
        assert abs(there) > 179
        assert scene.grid.from_lonlat(there, north) == pytest.approx((x, 350.0), abs=1e-5)
    places = np.array([[10.5, 20.0], [690.0, 600.0]])
    x, y = scene.grid.to_metric_array(places).T
    assert np.allclose(scene.grid.from_crs(x, y, scene.grid.metric_crs), places.T, atol=1e-4)


@pytest.mark.slow
def test_a_mosaic_is_not_built_in_memory(tmp_path: Path) -> None:
    code = (
        "import sys, numpy as np\n"
        "from pathlib import Path\n"
        "from geofield.imagery.mosaic import stage_rows, stage_to_cog\n"
        "from geofield.imagery.tiling import TilePyramid\n"
        "block = TilePyramid.web_mercator().block_around(18, lat=35.0, lon=33.5, size_px=9000)\n"
        "strip = np.random.default_rng(1).integers(0, 255, (256, 256 * block.columns, 3), 'u1')\n"
        "valid = np.ones(strip.shape[:2], bool)\n"
        "valid[:9] = False\n"
        "def rows():\n"
        "    for row in range(block.rows):\n"
        "        yield row, strip, valid if row > 5 else None\n"
        "def peak():\n"
        "    return int(Path('/proc/self/status').read_text().split('VmHWM:')[1].split()[0])\n"
        "before = peak()\n"
        "staged = Path(sys.argv[1]) / 'rows.tif'\n"
        "stage_rows(staged, block, rows())\n"
        "stage_to_cog(staged, Path(sys.argv[1]) / 'a.tif', {})\n"
        "print((peak() - before) // 1024)\n"
    )
    if not Path("/proc/self/status").exists():
        pytest.skip("the peak of a process's memory is read from /proc")
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], check=True, capture_output=True, text=True
    )
    # 243 MB of pixels went through.
    assert int(done.stdout) < 150
    with rasterio.open(tmp_path / "a.tif") as file:
        assert file.overviews(1) == [2, 4, 8, 16, 32]
        assert 0.9 < (file.dataset_mask() > 0).mean() < 1.0


def test_whole_tiles_and_areas(tmp_path: Path) -> None:
    tile = mercantile.tile(LON, LAT, 15)
    area = box(*mercantile.bounds(tile))
    with serving() as server:
        source = find_source(server.template)
        done = acquire(source, Where(area=area, zoom=17), tmp_path / "a.tif", options=FAST)
        assert (done.grid.width_px, done.grid.height_px) == (1024, 1024)
        bounds = mercantile.xy_bounds(tile)
        with rasterio.open(done.path) as file:
            assert file.bounds == pytest.approx(bounds, abs=1e-6)
        whole = replace(HERE, whole_tiles=True)
        done = acquire(source, whole, tmp_path / "b.tif", options=FAST)
        assert done.grid.width_px % 256 == done.grid.height_px % 256 == 0
        fit = Where(area=area, zoom="fit")
        done = acquire(source, fit, tmp_path / "c.tif", options=FAST)
        assert done.source.zoom == 16
        assert done.grid.width_px == 512


@pytest.mark.parametrize(
    ("wanted", "zoom"), [(0.6, 18), (0.4887, 18), (0.4885, 19), (1.0, 17), (0.0001, 22)]
)
def test_zoom_for_a_ground_resolution(wanted: float, zoom: int) -> None:
    # At 35 N zoom 18 is 0.4886 m on the sphere of the study, 0.4879 m on the ellipsoid.
    pyramid = TilePyramid.web_mercator()
    got = pyramid.zoom_for(wanted, lat=LAT, lon=LON)
    assert pyramid.ground_resolution_m(got, lat=LAT, lon=LON) <= wanted * 1.001 or got == 22
    if got:
        assert pyramid.ground_resolution_m(got - 1, lat=LAT, lon=LON) > wanted
    assert abs(got - zoom) <= 1


# -- faults ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, int]:
    """The product of a fault-free run, and how many tiles it has."""
    with serving() as server:
        path = tmp_path_factory.mktemp("sound") / "a.tif"
        done = acquire(_named(server), _WIDE, path, options=FAST)
    return path, done.report.wanted


_WIDE = Where(lat=LAT, lon=LON, zoom=18, size_px=1900)


def _named(server: TileServer) -> XYZSource:
    """The same name at every port, so that products compare byte by byte."""
    return XYZSource("server", server.template, terms=Terms(may_cache=True))


@pytest.mark.parametrize("name", list(tile_server.TRANSIENT))
def test_passing_faults_leave_no_trace(tmp_path: Path, sound: tuple[Path, int], name: str) -> None:
    share = 0.05
    with serving(first_time(tile_server.TRANSIENT[name], share)) as server:
        done = acquire(_named(server), _WIDE, tmp_path / "a.tif", options=FAST)
        hit = sum(chosen(tile, share) for tile in server.asked)
    assert hit > 0
    assert sum(done.report.troubles.values()) >= hit
    assert done.report.downloaded == sound[1]
    assert sha(done.path) == sha(sound[0])


def test_retry_after_is_honoured(tmp_path: Path) -> None:
    with serving(first_time(tile_server.status_429, 1.0)) as server:
        begun = time.monotonic()
        where = replace(HERE, size_px=100)
        acquire(_named(server), where, tmp_path / "a.tif", options=FAST)
        assert time.monotonic() - begun >= 1.0
    assert set(server.asked.values()) == {2}


def test_a_proxy_is_used_for_far_hosts_only(tmp_path: Path) -> None:
    with serving() as near, serving() as proxy:
        options = replace(FAST, proxy=proxy.address)
        acquire(_named(near), HERE, tmp_path / "a.tif", options=options)
        assert not proxy.paths
        far = XYZSource("far", "http://tiles.example/{z}/{x}/{y}.png")
        done = acquire(far, HERE, tmp_path / "b.tif", options=options)
        assert len(proxy.paths) == done.report.wanted
        assert all(path.startswith("http://tiles.example/18/") for path in proxy.paths)


def test_a_user_agent_is_sent(tmp_path: Path) -> None:
    with serving(tile_server.no_agent) as server:
        done = acquire(_named(server), HERE, tmp_path / "a.tif", options=FAST)
    assert done.report.absent == 0


def test_holes_are_an_error_or_masked(tmp_path: Path) -> None:
    with serving(tile_server.hole) as server:
        with pytest.raises(ImageryError, match=r"tiles of server could not be had") as caught:
            acquire(_named(server), _WIDE, tmp_path / "a.tif", options=FAST)
        assert "404" in str(caught.value)
        assert 'missing="mask"' in str(caught.value)
        assert list(tmp_path.iterdir()) == []
        masked = replace(FAST, missing="mask")
        done = acquire(_named(server), _WIDE, tmp_path / "a.tif", options=masked)
    scene = read_scene(done.path)
    assert done.report.missing > 0
    assert dict(scene.source.details)["tiles_masked"] == str(done.report.missing)
    # Exactly the holes are without data; nothing else is black.
    level = 18
    left = -20037508.342789244
    column = round((done.grid.transform.c - left) / done.grid.transform.a)
    row = round((-left - done.grid.transform.f) / done.grid.transform.a)
    ys, xs = np.mgrid[0 : done.grid.height_px, 0 : done.grid.width_px]
    tiles = {(int(t[1]), int(t[2])) for t in server.asked if chosen(t, 0.05, salt=1)}
    there = np.ones(scene.valid.shape, bool)
    for c, r in tiles:
        there &= ~(((xs + column) // 256 == c) & ((ys + row) // 256 == r))
    assert np.array_equal(scene.valid, there)
    assert np.array_equal(
        scene.bands, np.where(there, expected(done.grid, level), 0).astype(np.uint8)
    )
    from rio_cogeo import cog_validate

    assert cog_validate(done.path, strict=True) == (True, [], [])
    with rasterio.open(done.path) as file:
        assert rasterio.enums.MaskFlags.per_dataset in file.mask_flag_enums[0]
        assert file.overviews(1) == [2, 4]
        # The overviews' mask is that of the picture.
        coarse = file.dataset_mask(out_shape=(475, 475)) > 0
    assert abs(coarse.mean() - there.mean()) < 0.01


def test_tiles_that_never_come_whole_are_counted_as_failed(tmp_path: Path) -> None:
    def always(handler: Any, tile: tuple[int, int, int], attempt: int) -> bool:
        if chosen(tile, 0.1):
            tile_server.html_200(handler, tile)
            return True
        return False

    options = replace(FAST, attempts=3)
    with serving(always) as server, pytest.raises(ImageryError) as caught:
        acquire(_named(server), _WIDE, tmp_path / "a.tif", options=options)
    assert "not a picture (text/html) 3 times" in str(caught.value)
    assert "(0 not there, " in str(caught.value)


def test_a_tile_that_says_it_is_enormous_is_a_broken_one() -> None:
    from geofield.imagery.client import BrokenBodyError
    from geofield.imagery.fetch import decode_tile

    body = bytearray(tile_server.encode(tile_pixels(18, 1, 1)))
    body[16:24] = struct.pack(">II", 30_000, 30_000)
    body[29:33] = struct.pack(">I", zlib.crc32(body[12:29]))
    with pytest.raises(BrokenBodyError, match="broken picture"):
        decode_tile(bytes(body), "image/png", (256, 256))


def test_a_server_that_refuses_everything_is_left_in_peace(tmp_path: Path) -> None:
    def forbidden(handler: Any, tile: tuple[int, int, int], attempt: int) -> bool:
        handler.reply(403, b"no", "text/plain")
        return True

    with serving(forbidden) as server:
        where = replace(HERE, size_px=256 * 40)
        with pytest.raises(ImageryError, match=r"gives nothing.*403.*check the key"):
            acquire(_named(server), where, tmp_path / "a.tif", options=FAST)
        assert len(server.asked) < 400
        assert set(server.asked.values()) == {1}
    assert list(tmp_path.iterdir()) == []


def test_a_tile_half_transparent_is_masked(tmp_path: Path) -> None:
    class Transparent(TileServer):
        def body(self, tile: tuple[int, int, int]) -> bytes:
            rgba = np.dstack([tile_pixels(*tile), np.full((256, 256), 255, np.uint8)])
            rgba[:, :128, 3] = 0
            return tile_server.encode(rgba)

    with serving() as server:
        server.__class__ = Transparent
        where = replace(HERE, whole_tiles=True)
        with pytest.warns(ImageryWarning, match=r"does not show 50 % of the picture"):
            done = acquire(_named(server), where, tmp_path / "a.tif", options=FAST)
    scene = read_scene(done.path)
    assert not scene.valid[:, :128].any()
    assert scene.valid[:, 128:256].all()


def test_a_source_with_nothing_to_show_is_told(tmp_path: Path) -> None:
    """Servers answer with clear tiles, or with one and the same, where they have no picture."""

    class Nothing(TileServer):
        values = (0, 0, 0, 0)

        def body(self, tile: tuple[int, int, int]) -> bytes:
            return tile_server.encode(np.full((256, 256, 4), self.values, np.uint8))

    with serving() as server:
        server.__class__ = Nothing
        with pytest.raises(ImageryError, match="all of the picture is transparent"):
            acquire(_named(server), HERE, tmp_path / "a.tif", options=FAST)
        Nothing.values = (204, 204, 204, 255)
        with pytest.warns(ImageryWarning, match=r"(\d+) of \1 tiles .* are the same picture"):
            acquire(_named(server), HERE, tmp_path / "a.tif", options=FAST)


def test_tiles_of_another_size_are_refused(tmp_path: Path) -> None:
    with serving(size=512) as server:
        with pytest.raises(ImageryError, match=r"512 x 512 px, not 256 x 256 px.*tile_px = 512"):
            acquire(_named(server), HERE, tmp_path / "a.tif", options=FAST)
        source = replace(_named(server), tile_px=512)
        done = acquire(source, replace(HERE, zoom=17), tmp_path / "a.tif", options=FAST)
        with rasterio.open(done.path) as file:
            assert np.array_equal(file.read(), expected(done.grid, 17, 512))


# -- interruption, cache, offline -------------------------------------------------------------


def test_a_server_that_dies_half_way_and_a_restart(tmp_path: Path, sound: tuple[Path, int]) -> None:
    def dies(handler: Any, tile: tuple[int, int, int], attempt: int) -> bool:
        if sum(handler.server.asked.values()) > 30:
            handler.server.dead = True
        return False

    cached = replace(FAST, cache_dir=tmp_path / "cache", attempts=3)
    with serving(dies) as server:
        source = _named(server)
        with pytest.raises(NetworkError, match=r"No answer from 127.0.0.1.*offline=True"):
            acquire(source, _WIDE, tmp_path / "a.tif", options=cached)
        assert not (tmp_path / "a.tif").exists()
        assert leftovers(tmp_path) == []
        got = cache_infos(tmp_path / "cache")[0].tiles
        assert 0 < got <= 31
        server.dead, server.fault = False, None
        server.asked.clear()
        done = acquire(source, _WIDE, tmp_path / "a.tif", options=cached)
        assert len(server.asked) == sound[1] - got
        assert done.report.cached == got
        assert sha(done.path) == sha(sound[0])


def test_ctrl_c_leaves_nothing_half_written(tmp_path: Path) -> None:
    def impatient(done: int, total: int, what: str) -> None:
        if done > total // 2:
            raise KeyboardInterrupt

    cached = replace(FAST, cache_dir=tmp_path / "cache")
    with serving() as server:
        source = _named(server)
        with pytest.raises(KeyboardInterrupt):
            acquire(source, _WIDE, tmp_path / "a.tif", options=cached, progress=impatient)
        assert sorted(p.name for p in tmp_path.iterdir()) == ["cache"]
        got = cache_infos(tmp_path / "cache")[0].tiles
        assert got >= 32
        server.asked.clear()
        done = acquire(source, _WIDE, tmp_path / "a.tif", options=cached)
        assert len(server.asked) == done.report.wanted - got


def test_offline_works_from_the_cache_alone(tmp_path: Path) -> None:
    cached = replace(FAST, cache_dir=tmp_path / "cache")
    with serving() as server:
        source = _named(server)
        first = acquire(source, HERE, tmp_path / "a.tif", options=cached)
    offline = replace(cached, offline=True)
    again = acquire(source, HERE, tmp_path / "b.tif", options=offline)
    assert again.report.cached == again.report.wanted
    assert sha(first.path) == sha(again.path)
    with pytest.raises(ImageryError, match=r"not in the cache \(offline\)"):
        acquire(source, _WIDE, tmp_path / "c.tif", options=offline)
    with pytest.raises(ImageryError, match="needs a cache"):
        acquire(source, HERE, tmp_path / "c.tif", options=replace(FAST, offline=True))


def test_offline_takes_tiles_past_their_time_and_online_asks_anew(tmp_path: Path) -> None:
    cached = replace(FAST, cache_dir=tmp_path / "cache")
    short = replace(cached, cache_max_age_s=0.5)
    with serving() as server:
        source = _named(server)
        first = acquire(source, HERE, tmp_path / "a.tif", options=cached)
        time.sleep(2.0)
        again = acquire(source, HERE, tmp_path / "b.tif", options=replace(short, offline=True))
        assert again.report.cached == again.report.wanted
        assert sha(first.path) == sha(again.path)
        anew = acquire(source, HERE, tmp_path / "c.tif", options=short)
        assert anew.report.downloaded == anew.report.wanted


def test_what_had_arrived_when_the_work_stopped_is_kept(tmp_path: Path) -> None:
    cached = replace(FAST, cache_dir=tmp_path / "cache")
    with serving() as server:

        def stop_when_all_is_there(done: int, total: int, what: str) -> None:
            before = -1
            while before != len(server.asked):
                before = len(server.asked)
                time.sleep(0.5)
            raise KeyboardInterrupt

        source = _named(server)
        with pytest.raises(KeyboardInterrupt):
            acquire(
                source, _WIDE, tmp_path / "a.tif", options=cached, progress=stop_when_all_is_there
            )
        assert len(server.asked) > 20
        assert cache_infos(tmp_path / "cache")[0].tiles == len(server.asked)


def test_no_network_names_the_host_and_the_way_out(tmp_path: Path) -> None:
    with serving() as server:
        source = _named(server)
    with pytest.raises(NetworkError) as caught:
        acquire(source, HERE, tmp_path / "a.tif", options=replace(FAST, attempts=2))
    message = str(caught.value)
    assert f"127.0.0.1:{server.server_port}" in message
    assert "offline=True" in message
    assert "cache" in message


def test_the_cache_is_an_mbtiles_file(tmp_path: Path) -> None:
    cached = replace(FAST, cache_dir=tmp_path / "cache")
    with serving() as server:
        done = acquire(_named(server), HERE, tmp_path / "a.tif", options=cached)
    info = cache_infos(tmp_path / "cache")[0]
    assert (info.source, info.tiles, info.zooms) == ("server", done.report.wanted, (18, 18))
    # GDAL's own driver sees the same ground in it.
    with rasterio.open(info.path, driver="MBTILES", ZOOM_LEVEL="18") as file:
        x, y = done.grid.to_native(0, 0)
        inverse = ~file.transform
        column, row = (round(v) for v in inverse @ (x, y))
        window = rasterio.windows.Window(column, row, 640, 640)
        got = file.read((1, 2, 3), window=window)
    assert np.array_equal(got, expected(done.grid, 18))
    # And geofield reads it as a source.
    source = MBTilesSource.open(info.path)
    again = acquire(source, HERE, tmp_path / "b.tif")
    with rasterio.open(again.path) as file:
        assert np.array_equal(file.read(), expected(done.grid, 18))


@pytest.mark.qgis
def test_qgis_opens_the_cache(tmp_path: Path) -> None:
    python = Path("/usr/bin/python3")
    environment = {
        "QT_QPA_PLATFORM": "offscreen",
        "HOME": str(tmp_path),
        "XDG_RUNTIME_DIR": str(tmp_path),
        "PATH": "/usr/bin:/bin",
    }
    code = (
        "import sys\n"
        "from qgis.core import QgsApplication, QgsRasterLayer\n"
        "app = QgsApplication([], False)\n"
        "app.initQgis()\n"
        "for path, provider in ((sys.argv[1], 'gdal'),\n"
        "                       ('type=mbtiles&url=file://' + sys.argv[1], 'wms')):\n"
        "    layer = QgsRasterLayer(path, 'tiles', provider)\n"
        "    box = layer.extent()\n"
        "    print(layer.isValid(), layer.crs().authid(), box.xMinimum(), box.yMinimum(),\n"
        "          box.xMaximum(), box.yMaximum())\n"
        "app.exitQgis()\n"
    )
    found = python.exists() and (
        subprocess.run(
            [python, "-c", "import qgis.core"], env=environment, capture_output=True, check=False
        ).returncode
        == 0
    )
    if not found:
        if os.environ.get("CI"):
            pytest.fail("QGIS is missing: apt-get install qgis python3-qgis python3-gdal")
        pytest.skip("needs QGIS: apt-get install qgis python3-qgis python3-gdal")
    cached = replace(FAST, cache_dir=tmp_path / "cache")
    where = replace(HERE, whole_tiles=True)
    with serving() as server:
        done = acquire(_named(server), where, tmp_path / "a.tif", options=cached)
    copy = tmp_path / "copy.mbtiles"
    copy.write_bytes(cache_infos(tmp_path / "cache")[0].path.read_bytes())
    shown = subprocess.run(
        [python, "-c", code, str(copy)],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    ).stdout
    left, top = done.grid.to_native(0, 0)
    right, bottom = done.grid.to_native(done.grid.width_px, done.grid.height_px)
    lines = shown.splitlines()
    assert len(lines) == 2
    for line in lines:
        valid, crs, *numbers = line.split()
        assert (valid, crs) == ("True", "EPSG:3857")
        got = [float(number) for number in numbers]
        assert got == pytest.approx([left, bottom, right, top], abs=0.1)


def test_a_damaged_cache_is_set_aside_and_rebuilt(tmp_path: Path) -> None:
    folder = tmp_path / "cache"
    cached = replace(FAST, cache_dir=folder)
    with serving() as server:
        source = _named(server)
        acquire(source, HERE, tmp_path / "a.tif", options=cached)
        file = cache_infos(folder)[0].path
        file.write_bytes(b"not a database at all" * 100)
        with pytest.warns(ImageryWarning, match="set aside as"):
            acquire(source, HERE, tmp_path / "b.tif", options=cached)
        assert cache_infos(folder)[0].tiles > 0
        assert len(list(folder.glob("*.damaged-1"))) == 1
        data = bytearray(file.read_bytes())
        data[4096 : len(data) // 2] = random.Random(1).randbytes(len(data) // 2 - 4096)
        file.write_bytes(data)
        with pytest.warns(ImageryWarning, match="set aside as"):
            acquire(source, HERE, tmp_path / "c.tif", options=cached)
    assert sha(tmp_path / "a.tif") == sha(tmp_path / "c.tif")
    gone = clear_cache(folder)
    assert len(gone) == 3
    assert cache_infos(folder) == []


def test_the_cache_keeps_to_its_size_and_age(tmp_path: Path) -> None:
    folder = tmp_path / "cache"
    with serving() as server:
        source = _named(server)
        small = replace(FAST, cache_dir=folder, cache_max_bytes=200_000)
        acquire(source, _WIDE, tmp_path / "a.tif", options=small)
        info = cache_infos(folder)[0]
        assert 0 < info.bytes <= 200_000
        assert info.path.stat().st_size < 400_000
        old = replace(FAST, cache_dir=folder, cache_max_age_s=3600.0)
        acquire(source, HERE, tmp_path / "b.tif", options=old)
        with closing(sqlite3.connect(info.path)) as db, db:
            db.execute("UPDATE fetched SET time_s = time_s - 7200")
        db.close()
        server.asked.clear()
        done = acquire(source, HERE, tmp_path / "c.tif", options=old)
        assert len(server.asked) == done.report.wanted


def _worker(template: str, folder: str, number: int) -> int:
    source = XYZSource("server", template, terms=Terms(may_cache=True))
    options = FetchOptions(cache_dir=Path(folder) / "cache", backoff_s=0.01)
    where = Where(lat=LAT + 0.001 * (number % 2), lon=LON, zoom=18, size_px=900)
    done = acquire(source, where, Path(folder) / f"{number}.tif", options=options)
    return done.report.wanted


def test_several_processes_share_one_cache(tmp_path: Path) -> None:
    with serving() as server:
        context = multiprocessing.get_context("spawn")
        jobs = [(server.template, str(tmp_path), number) for number in range(3)]
        with context.Pool(3) as pool:
            wanted = pool.starmap(_worker, jobs)
    assert all(wanted)
    info = cache_infos(tmp_path / "cache")[0]
    assert info.tiles == len(server.asked)
    assert sha(tmp_path / "0.tif") == sha(tmp_path / "2.tif")
    with closing(sqlite3.connect(info.path)) as db, db:
        assert db.execute("PRAGMA integrity_check").fetchone() == ("ok",)


def test_the_rate_limit_is_kept(tmp_path: Path) -> None:
    with serving() as server:
        source = replace(_named(server), rate_per_s=40.0)
        begun = time.monotonic()
        done = acquire(source, HERE, tmp_path / "a.tif", options=FAST)
        assert time.monotonic() - begun >= (done.report.wanted - 1) / 40.0


def test_an_existing_product_is_refused_before_anything_is_fetched(tmp_path: Path) -> None:
    (tmp_path / "a.tif").write_text("mine")
    with serving() as server:
        with pytest.raises(OutputExistsError):
            acquire(_named(server), HERE, tmp_path / "a.tif", options=FAST)
        assert not server.asked
    assert (tmp_path / "a.tif").read_text() == "mine"


def test_a_full_disk_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, *_: Any) -> None:
        path.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("geofield.imagery.acquisition.stage_rows", full)
    with serving() as server, pytest.raises(Exception, match="disk is full"):
        acquire(_named(server), HERE, tmp_path / "a.tif", options=FAST)
    assert list(tmp_path.iterdir()) == []
