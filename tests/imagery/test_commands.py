"""The commands `tiles`, `sources` and `cache`, as a user runs them."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
import rasterio.shutil
import rasterio.warp
from shapely.geometry import box

from geofield.cli import main
from geofield.errors import FormatError, TermsError
from geofield.imagery import read_scene
from geofield.staging import staged_file

from .pictures import ground, write
from .test_fetch import expected
from .test_sources import wms_server, wmts_server
from .tile_server import Handler, first_time, hole, serving, status_500

POINT = ["--lat", "35.075373", "--lon", "33.531142"]


@pytest.fixture(autouse=True)
def _own_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)


def run(*arguments: object) -> int:
    try:
        main([str(each) for each in arguments])
    except SystemExit as stop:
        return int(stop.code or 0)
    return 0


def test_tiles_from_an_address(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with serving(first_time(status_500, 0.7)) as server:
        code = run("tiles", server.template, *POINT, "--zoom", 18, "--size", 640, "-o", "a.tif")
        shown = capsys.readouterr()
        assert code == 0
        assert shown.out == ""
        assert "640 x 640 px, 0.49 m per pixel" in shown.err
        assert "zoom 18, EPSG:3857" in shown.err
        assert "faults met and survived" in shown.err
        asked = len(server.paths)
        code = run(
            "tiles", server.template, *POINT, "--zoom", 18, "-o", "b.tif", "--json", "--offline"
        )
        assert code == 0
        assert len(server.paths) == asked
    facts = json.loads(capsys.readouterr().out)
    assert facts["zoom"] == 18
    assert facts["tiles"]["cached"] == facts["tiles"]["wanted"]
    scene = read_scene("a.tif", lat=35.075373, lon=33.531142)
    assert np.array_equal(scene.bands, expected(scene.grid, 18))
    assert Path("a.tif").read_bytes() == Path("b.tif").read_bytes()
    assert run("cache", "info", "--json") == 0
    kept = json.loads(capsys.readouterr().out)
    assert kept[0]["tiles"] == facts["tiles"]["wanted"]
    assert run("cache", "info") == 0
    assert "tiles" in capsys.readouterr().out
    assert run("cache", "clear", "nothing") == 1
    assert "holds nothing of 'nothing'" in capsys.readouterr().err
    assert run("cache", "clear", "--yes") == 0
    assert list((tmp_path / "home").rglob("*.mbtiles")) == []


def test_an_area_and_missing_tiles(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import geopandas as gpd

    area = gpd.GeoDataFrame(geometry=[box(33.52, 35.07, 33.53, 35.08)], crs="EPSG:4326")
    area.to_crs("EPSG:32636").to_file("farm.gpkg", driver="GPKG")
    with serving(hole) as server:
        arguments = ["tiles", server.template, "--area", "farm.gpkg", "--zoom", 17, "-o", "a.tif"]
        assert run(*arguments) == 1
        assert "--missing mask" in capsys.readouterr().err
        assert not Path("a.tif").exists()
        assert run(*arguments, "--missing", "mask", "--log", "a.log") == 0
        assert "1 tile could not be had: no-data in the picture" in capsys.readouterr().err
        assert "1 tile could not be had: no-data in the picture" in Path("a.log").read_text()
    with rasterio.open("a.tif") as file:
        assert not file.dataset_mask().all()
        west, south, east, north = rasterio.warp.transform_bounds(file.crs, 4326, *file.bounds)
    assert west <= 33.52 <= 33.53 <= east
    assert south <= 35.07 <= 35.08 <= north
    assert max(33.52 - west, east - 33.53, 35.07 - south, north - 35.08) < 2e-4


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:32760"])
def test_an_area_across_180_degrees_is_no_wider_than_it_is(crs: str) -> None:
    import geopandas as gpd

    sides = [box(179.996, -16.804, 180, -16.8), box(-180, -16.804, -179.998, -16.8)]
    gpd.GeoDataFrame(geometry=sides, crs=4326).to_crs(crs).to_file("farm.gpkg")
    with serving() as server:
        said = ["--area", "farm.gpkg", "--zoom", 17]
        assert run("tiles", server.template, *said, "-o", "a.tif") == 0
        assert {tile[1] for tile in server.asked} == {0, 131070, 131071}
    grid = read_scene("a.tif").grid
    assert grid.width_px == pytest.approx(0.006 / 360 * 256 * 2**17, abs=2)
    for lon in (179.9961, -179.9981):
        assert grid.contains_px(*grid.from_lonlat(lon, -16.802))


@pytest.mark.parametrize(("right_px", "width_px"), [(118, 108), (250, 118)])
def test_the_middle_of_an_area_need_not_be_seen(right_px: int, width_px: int) -> None:
    import geopandas as gpd

    mask = np.full((96, 128), 255, np.uint8)
    mask[40:60, 50:70] = 0
    path = write(Path("gap.tif"), ground(), mask=mask, photometric="RGB")
    with rasterio.open(path) as file:
        left, top = file.transform @ (10, 10)
        right, bottom = file.transform @ (right_px, 86)
        area = gpd.GeoDataFrame(geometry=[box(left, bottom, right, top)], crs=file.crs)
    area.to_file("area.gpkg")
    assert run("tiles", path, "--area", "area.gpkg", "-o", "a.tif") == 0
    with rasterio.open("a.tif") as file:
        # Its box in longitude and latitude lies askew in the zone, and holds whole pixels.
        assert (file.width, file.height) == pytest.approx((width_px, 76), abs=4)
        assert 0 < (file.dataset_mask() == 0).sum() <= 400


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["tiles", "naipp", *POINT, "-o", "a.tif"], 2, "Did you mean 'naip'"),
        (["tiles", "none.tif", *POINT, "-o", "a.tif"], 2, "There is no picture none.tif"),
        (["tiles", "naip", "-o", "a.tif"], 2, "--lat and --lon, or --area"),
        (["tiles", "naip", *POINT, "--size", "9", "--size-m", "9", "-o", "a"], 2, "not both"),
        (["tiles", "naip", *POINT, "--zoom", "deep", "-o", "a.tif"], 2, "a number, max or fit"),
        (["tiles", "naip", *POINT, "--zoom", "21", "-o", "a.tif"], 1, "no zoom 21"),
        (["tiles", "https://h/{z}/{x}", *POINT, "-o", "a.tif"], 1, "lacks {y}"),
        (["tiles", "google", *POINT, "-o", "a.tif"], 1, "GEOFIELD_KEY_GOOGLE"),
        (["tiles", "naip", *POINT, "-o", "no/a.tif"], 1, "folder exists"),
        (["tiles", "naip", *POINT, "-o", "a.jpg"], 2, "write NAME.tif"),
        (["tiles", "", *POINT, "-o", "a.tif"], 2, "no imagery source or file ''"),
        (["field", "", *POINT, "-o", "a.gpkg"], 2, "no imagery source or file ''"),
        (["tiles", "naip", *POINT, "-o", "a.tif", "--offline"], 1, "not in the cache"),
        (["tiles", "naip", *POINT, "-o", "a.tif", "--offline", "--no-cache"], 1, "needs a cache"),
    ],
)
def test_what_goes_wrong_is_said(
    arguments: list[str], code: int, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*arguments) == code
    shown = capsys.readouterr().err
    assert message in shown
    assert "Traceback" not in shown
    assert not Path("a.tif").exists()


def test_options_of_tiles_with_a_picture_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    picture = Path(__file__).parents[2] / "sample_data" / "field_1.tif"
    assert run("tiles", picture, *POINT, "--size", 20, "--resolution", 2, "-o", "a.tif") == 0
    assert "--resolution changes nothing here" in capsys.readouterr().err
    assert run("tiles", picture, *POINT, "--size", 20, "-o", "b.tif") == 0
    assert "changes nothing" not in capsys.readouterr().err


def test_one_of_several_pictures_in_a_geopackage_is_named_as_gdal_does(
    capsys: pytest.CaptureFixture[str],
) -> None:
    samples = Path(__file__).parents[2] / "sample_data"
    for table in ("June", "July"):
        more = {"RASTER_TABLE": table, "APPEND_SUBDATASET": "YES", "TILE_FORMAT": "PNG"}
        rasterio.shutil.copy(samples / "field_1.tif", "a.gpkg", driver="GPKG", **more)
    place = ["--lat", 35.075373, "--lon", 33.531142]
    assert run("field", "a.gpkg", *place, "-o", "b.gpkg") == 1
    assert "Name one of them, as in 'GPKG:a.gpkg:JUNE'" in capsys.readouterr().err
    july = "GPKG:a.gpkg:JULY"
    assert run("tiles", july, *place, "--size", 20, "-o", "b.tif") == 0
    assert run("field", july, *place, "-o", "b.gpkg") == 0
    assert run("export", "b.gpkg", "-f", "map", "--out", "m", "--picture", july) == 0
    capsys.readouterr()
    assert run("info", july) == 0
    assert "480 x 480 px" in capsys.readouterr().out
    with pytest.raises(FormatError, match="is an input"), staged_file("a.gpkg", inputs=[july]):
        pass
    assert run("info", "GPKG:none.gpkg:JULY") == 2
    assert "no picture none.gpkg" in capsys.readouterr().err


def test_what_a_picture_does_not_say_is_said_to_tiles(capsys: pytest.CaptureFixture[str]) -> None:
    path = write(Path("drone.tif"), ground(bands=4), crs=None)
    known: dict[str, Any] = {"bands": ("blue", "green", "red", "other"), "crs": "EPSG:32636"}
    lon, lat = read_scene(path, **known).grid.centre_lonlat
    place = ["--lat", lat, "--lon", lon]
    assert run("tiles", path, *place, "-o", "a.tif") == 1
    assert "--crs EPSG:32636" in capsys.readouterr().err
    said = ["--crs", known["crs"], "--bands", ",".join(known["bands"])]
    assert run("tiles", path, *place, *said, "-o", "a.tif") == 0
    assert "changes nothing" not in capsys.readouterr().err
    assert read_scene("a.tif").roles == ("blue", "green", "red")
    Path("geofield.toml").write_text('[imagery]\ncrs = "EPSG:32636"\nbands = ["grey"]\n')
    assert run("tiles", path, *place, "-o", "b.tif") == 0
    assert read_scene("b.tif").roles == ("grey",)
    with serving() as server:
        tiles = ["tiles", server.template, *POINT, "--size", 9]
        assert run(*tiles, "--crs", "EPSG:32636", "-o", "c.tif") == 0
    assert "--crs changes nothing here" in capsys.readouterr().err


def test_what_is_guessed_about_a_picture_is_told(
    simulated_tif: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with rasterio.open(simulated_tif) as file:
        values, place = file.read(), {"crs": file.crs, "transform": file.transform}
    write(Path("bare.tif"), values, photometric="MINISBLACK", **place)
    lon, lat = read_scene("bare.tif").grid.centre_lonlat
    point = ("--lat", lat, "--lon", lon)
    guess = "Four unnamed bands are taken as red, green, blue, near infrared"
    assert run("run", "bare.tif", *point, "--out", "out", "--format", "gpkg") == 0
    assert capsys.readouterr().err.count(f"Note: {guess}") == 1
    report = json.loads(Path("out/report.json").read_text())
    assert report["picture"]["bands"] == ["red", "green", "blue", "nir"]
    assert [each[: len(guess)] for each in report["picture"]["notes"]] == [guess]
    assert run("tiles", "bare.tif", *point, "-o", "cut.tif") == 0
    assert capsys.readouterr().err.count(f"Note: {guess}") == 1
    # The file that was cut says what its bands are; it remembers how that was known.
    assert run("field", "cut.tif", *point, "-o", "field.gpkg") == 0
    assert guess not in capsys.readouterr().err
    assert guess in read_scene("cut.tif").notes[0]


def test_terms_are_refused_until_acknowledged(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("GEOFIELD_KEY_GOOGLE", "hush-hush")
    assert run("tiles", "google", *POINT, "-o", "a.tif") == 1
    shown = capsys.readouterr().err
    assert "--acknowledge-terms" in shown
    assert "hush-hush" not in shown


def test_a_named_picture_carries_its_terms(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from geofield.cli.imagery_tools import imagery_of
    from geofield.settings import ImagerySettings, load_settings

    path = write(tmp_path / "drone.tif", ground(), photometric="RGB")
    lon, lat = read_scene(path).grid.centre_lonlat
    text = f'[fetch.sources.drone]\nkind = "picture"\nurl = "{path}"\nattribution = "Me"\n'
    Path("geofield.toml").write_text(text)
    with pytest.raises(TermsError):
        imagery_of("drone", load_settings(), (lon, lat))
    Path("geofield.toml").write_text(text + "may_derive = true\n")
    found = imagery_of("drone", load_settings(), (lon, lat))
    with found.at(lat, lon, ImagerySettings()) as picture:
        scene = read_scene(picture.path)
    assert scene.source.attribution == "Me"
    assert np.array_equal(scene.bands, ground())
    found = imagery_of(path, load_settings(), (lon, lat))
    with found.at(lat, lon, ImagerySettings()) as picture:
        assert picture.path == path


@pytest.mark.parametrize(
    ("said", "source"),
    [
        ('attribution = "Me"\n', {"attribution": "Me", "licence": "", "date": None}),
        ('date = "2023-06-01"\n', {"attribution": "", "licence": "", "date": "2023-06-01"}),
    ],
)
def test_what_is_said_of_a_picture_goes_with_its_bands_and_crs(
    tmp_path: Path, said: str, source: dict[str, str | None]
) -> None:
    from geofield.cli.imagery_tools import imagery_of
    from geofield.settings import ImagerySettings, load_settings

    path = write(tmp_path / "drone.tif", ground(bands=4), crs=None)
    known: dict[str, Any] = {"bands": ("blue", "green", "red", "other"), "crs": "EPSG:32636"}
    lon, lat = read_scene(path, **known).grid.centre_lonlat
    text = f'[fetch.sources.drone]\nkind = "picture"\nurl = "{path}"\nmay_derive = true\n{said}'
    Path("geofield.toml").write_text(text)
    found = imagery_of("drone", load_settings(), (lon, lat))
    with found.at(lat, lon, ImagerySettings(**known)) as picture:
        scene = read_scene(picture.path, **known)
    assert {name: getattr(scene.source, name) for name in source} == source
    assert scene.roles == ("blue", "green", "red")
    assert np.array_equal(scene.bands, ground())


def test_sources_of_ones_own(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def keyed(handler: Handler, query: dict[str, str]) -> None:
        zoom, column, rest = handler.path.partition("?")[0].strip("/").split("/")[-3:]
        if query.get("t") == "s3cret" and handler.headers.get("Referer") == "https://farm":
            tile = (int(zoom), int(column), int(rest))
            handler.reply(200, handler.server.body(tile), "image/png")
        else:
            handler.reply(403, b"no", "text/plain")

    with serving() as server:
        server.routes["/own"] = keyed
        Path("geofield.toml").write_text(
            f'[fetch.sources.county]\nurl = "{server.address}/own/{{z}}/{{x}}/{{y}}?t={{key}}"\n'
            'attribution = "Example County"\nlicence = "CC BY 4.0"\nmay_derive = true\n'
            'max_zoom = 19\ndate = "2024-06"\n'
            '[fetch.sources.county.headers]\nReferer = "https://farm"\n'
        )
        assert run("tiles", "county", *POINT, "-o", "a.tif") == 1
        assert "GEOFIELD_KEY_COUNTY" in capsys.readouterr().err
        monkeypatch.setenv("GEOFIELD_KEY_COUNTY", "s3cret")
        assert run("tiles", "county", *POINT, "--zoom", "max", "-o", "a.tif") == 0
        shown = capsys.readouterr()
        assert "Example County; CC BY 4.0" in shown.err
        assert run("sources", "--json") == 0
        rows = {row["name"]: row for row in json.loads(capsys.readouterr().out)}
    assert rows["county"]["has_key"] is True
    assert rows["google"]["may_derive"] is False
    scene = read_scene("a.tif")
    assert (scene.source.zoom, scene.source.date) == (19, "2024-06")
    assert b"s3cret" not in Path("a.tif").read_bytes()
    assert run("sources") == 0
    shown_list = capsys.readouterr().out
    assert "deriving geodata: FORBIDDEN" in shown_list
    assert "s3cret" not in shown_list


@pytest.mark.parametrize("kind", ["wms", "wmts", "mbtiles"])
def test_what_is_said_of_a_source_of_ones_own_holds_for_every_kind(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, kind: str
) -> None:
    from geofield.cli.imagery_tools import catalogue_of
    from geofield.imagery import FetchOptions, find_source
    from geofield.imagery.client import Client
    from geofield.imagery.sources import TileSource
    from geofield.settings import load_settings

    def only_for_farms(act: Callable[..., None]) -> Callable[..., None]:
        def route(handler: Handler, query: dict[str, str]) -> None:
            if handler.headers.get("Referer") == "https://farm":
                act(handler, query)
            else:
                handler.reply(403, b"no", "text/plain")

        return route

    with serving() as server:
        wms_server(server, "EPSG:3857")
        wmts_server(server, mercator=True, rest=True)
        server.routes = {path: only_for_farms(act) for path, act in server.routes.items()}
        address, more = f"{server.address}/wms?service=WMS", 'layer = "ortho"\n'
        if kind == "wmts":
            address, more = f"{server.address}/WMTSCapabilities.xml", ""
        if kind == "mbtiles":
            wanted = ("--zoom", 15, "--size", 300, "-o", "a.tif")
            kept = ("--cache-dir", tmp_path / "own")
            assert run("tiles", server.template, *POINT, *wanted, *kept) == 0
            (file,) = (tmp_path / "own").glob("*.mbtiles")
            address, more = str(file), ""
        Path("geofield.toml").write_text(
            f'[fetch.sources.county]\nkind = "{kind}"\nurl = "{address}"\nmay_derive = true\n{more}'
            'attribution = "Example County"\ndate = "2024-06"\nrate_per_s = 40\n'
            '[fetch.sources.county.headers]\nReferer = "https://farm"\n'
        )
        options = ("--zoom", 15, "--size", 300, "-o", "b.tif", "--json")
        assert run("tiles", "county", *POINT, *options) == 0, capsys.readouterr().err
        said = Path("geofield.toml").read_text()
        # Also where nobody says whose it is.
        refused = said.replace("may_derive = true", "may_derive = false")
        Path("geofield.toml").write_text(refused.replace("Example County", ""))
        assert run("tiles", "county", *POINT, *options) == 1
        assert "forbid" in capsys.readouterr().err
        Path("geofield.toml").write_text(said)
        if kind != "mbtiles":
            client = Client(FetchOptions(attempts=1))
            source = find_source("county", catalogue=catalogue_of(load_settings()), client=client)
            client.close()
            assert isinstance(source, TileSource)
            assert source.rate_per_s == 40
    assert read_scene("b.tif").source.date == "2024-06"


def test_a_wrong_settings_file_does_not_show_its_keys(capsys: pytest.CaptureFixture[str]) -> None:
    Path("geofield.toml").write_text('[fetch.sources.county]\nkey = "s3cret"\nmax_zoom = 99\n')
    assert run("sources") == 2
    shown = capsys.readouterr().err
    assert "fetch.sources.county.url" in shown
    assert "s3cret" not in shown


#: As `python -m geofield`. Tests in the background have SIGINT ignored, and hand that on.
INTERRUPTIBLE = """
import runpy, signal
signal.signal(signal.SIGINT, signal.default_int_handler)
runpy.run_module("geofield", run_name="__main__", alter_sys=True)
"""


def test_ctrl_c_from_a_terminal(tmp_path: Path) -> None:
    def slow(handler: Any, tile: tuple[int, int, int], attempt: int) -> bool:
        time.sleep(0.1)
        return False

    with serving(slow) as server:
        process = subprocess.Popen(
            [
                *(sys.executable, "-c", INTERRUPTIBLE, "tiles", server.template, *POINT),
                *("--zoom", "18", "--size", "5000", "-o", str(tmp_path / "a.tif")),
            ],
            env={**os.environ, "XDG_CACHE_HOME": str(tmp_path / "home")},
            stderr=subprocess.PIPE,
            text=True,
        )
        for _ in range(600):
            if len(server.asked) > 60:
                break
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        _, shown = process.communicate(timeout=30)
    assert process.returncode == 1
    assert "Stopped" in shown
    assert "Traceback" not in shown
    assert sorted(path.name for path in tmp_path.iterdir()) == ["home"]


def test_help_ends_with_examples(capsys: pytest.CaptureFixture[str]) -> None:
    for command in (["tiles"], ["sources"], ["cache"], ["cache", "info"], ["cache", "clear"]):
        assert run(*command, "--help") == 0
        assert "geofield " + command[0] in capsys.readouterr().out.partition("Example")[2]
