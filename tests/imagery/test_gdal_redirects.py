"""GDAL follows redirects by itself: none of them leads to a host that the user did not name."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import ProxyHandler, build_opener

import pytest
import rasterio

from geofield.errors import ImageryError
from geofield.imagery.gateway import gateway
from geofield.imagery.gdal import open_picture
from geofield.imagery.reach import Reach

from .test_reach import Stranger, cut, folder, refused, stranger, vrt  # noqa: F401  (fixtures)
from .tile_server import Handler, TileServer, serving


@pytest.fixture
def server(folder: Path) -> Iterator[TileServer]:  # noqa: F811
    with serving() as found:
        found.routes["/own.tif"] = lambda handler, _: handler.file(folder / "own.tif")
        yield found


def sent_on(server: TileServer, location: str) -> str:
    """An address that sends on to another."""

    def answer(handler: Handler, _: dict[str, str]) -> None:
        handler.reply(302, b"", "text/plain", Location=location)

    server.routes["/moved.tif"] = answer
    return f"{server.address}/moved.tif"


def test_a_remote_picture_is_read(folder: Path, server: TileServer) -> None:  # noqa: F811
    for address in (f"{server.address}/own.tif", sent_on(server, f"{server.address}/own.tif")):
        out = folder / "out.tif"
        done = cut(address, "--overwrite", "-o", out)
        assert done.returncode == 0, done.stderr
        assert out.stat().st_size > 1000


@pytest.mark.parametrize("way", ["picture", "file", "vrt", "later"])
def test_its_server_sends_on_to_nobody_else(
    folder: Path,  # noqa: F811
    server: TileServer,
    stranger: Stranger,  # noqa: F811
    way: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Not even to one that the user's proxy is passed by for.
    monkeypatch.setenv("NO_PROXY", "127.0.0.1,localhost")
    target = "file:///etc/hostname" if way == "file" else f"{stranger.url}/own.tif"
    picture: object = sent_on(server, target)
    if way == "vrt":
        picture = folder / "a.vrt"
        picture.write_text(vrt(f"/vsicurl/{sent_on(server, target)}"))
    if way == "later":

        def answer(handler: Handler, _: dict[str, str]) -> None:
            if len(server.paths) > 2:
                handler.reply(302, b"", "text/plain", Location=target)
            else:
                handler.file(folder / "own.tif")

        server.routes["/own.tif"] = answer
        picture = f"{server.address}/own.tif"
    out = folder / "out.tif"
    words = ["--allow", server.address] if way == "vrt" else []
    told = refused(cut(picture, *words, "-o", out), out)
    assert not stranger.was_called
    if way in ("picture", "vrt"):
        assert f"leads to {stranger.url}, which you did not name" in told
        assert f"--allow {stranger.url}" in told


def test_it_may_where_the_user_says_so(
    folder: Path,  # noqa: F811
    server: TileServer,
    stranger: Stranger,  # noqa: F811
) -> None:
    address = sent_on(server, f"{stranger.url}/own.tif")
    cut(address, "--allow", stranger.url, "-o", folder / "out.tif")
    assert stranger.was_called


@pytest.mark.parametrize(
    ("address", "host"),
    [("http://127.0.0.1:9", "127.0.0.1"), ("https://nowhere.invalid", "nowhere.invalid")],
)
def test_a_server_that_does_not_answer_is_named_at_once(
    tmp_path: Path, address: str, host: str
) -> None:
    """After 26 seconds the answer was "HTTP response code: 502"."""
    begun = time.monotonic()
    told = refused(cut(f"{address}/a.tif", "-o", tmp_path / "out.tif"), tmp_path / "out.tif")
    assert f"a.tif cannot be read: {host} does not answer (" in told
    assert "Check the address and the network." in told
    assert time.monotonic() - begun < 13


def test_no_picture_is_said_to_come_from_a_server_of_another(
    server: TileServer,
) -> None:
    """While one server says "not found", another is asked for in vain, as by a second thread."""
    silent, missing = "http://127.0.0.1:9/b.tif", f"{server.address}/a.tif"

    def answer(handler: Handler, _: dict[str, str]) -> None:
        proxy = gateway().options(Reach((silent,)))["GDAL_HTTP_PROXY"]
        opener = build_opener(ProxyHandler({"http": proxy}))
        with pytest.raises(HTTPError):
            opener.open(silent)
        handler.reply(404, b"", "text/plain")

    server.routes["/"] = answer
    told = r"b\.tif cannot be read: 127\.0\.0\.1 does not answer"
    with rasterio.Env():
        with pytest.raises(ImageryError, match=r"a\.tif cannot be opened: .*404"):
            open_picture(missing)
        with pytest.raises(ImageryError, match=told):
            open_picture(silent)
