"""What pages of the documentation fetch from the network, on loopback instead.

A WMTS of a made-up land survey, which shows one simulated field in the Netherlands' polder at full
georeference; and the real chip of a tutorial, from the recorded copy beside the project.
"""

from __future__ import annotations

import io
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

#: What the how-to page calls the server.
PUBLIC_ADDRESS = "https://wmts.landsurvey.example"
#: Where the tutorial on a real picture gets it from.
CHIP_HOST = "https://raw.githubusercontent.com"
LAT, LON, SEED = 52.3201, 5.5203, 17
_HALF_WORLD_M = 20037508.342789244
_ZOOMS = range(5, 20)

_CAPABILITIES = """<?xml version="1.0"?>
<Capabilities xmlns="http://www.opengis.net/wmts/1.0" xmlns:ows="http://www.opengis.net/ows/1.1"
  xmlns:xlink="http://www.w3.org/1999/xlink" version="1.0.0">
 <ows:ServiceProvider><ows:ProviderName>Land survey</ows:ProviderName></ows:ServiceProvider>
 <Contents><Layer><ows:Identifier>orthophoto</ows:Identifier>
  <Style isDefault="true"><ows:Identifier>default</ows:Identifier></Style>
  <Format>image/png</Format>
  <TileMatrixSetLink><TileMatrixSet>GoogleMapsCompatible</TileMatrixSet></TileMatrixSetLink>
  <ResourceURL format="image/png" resourceType="tile"
    template="{address}/tiles/{{TileMatrix}}/{{TileRow}}/{{TileCol}}.png"/>
 </Layer>
 <TileMatrixSet><ows:Identifier>GoogleMapsCompatible</ows:Identifier>
  <ows:SupportedCRS>urn:ogc:def:crs:EPSG::3857</ows:SupportedCRS>
  {matrices}
 </TileMatrixSet></Contents>
</Capabilities>"""
_MATRIX = (
    "<TileMatrix><ows:Identifier>{zoom}</ows:Identifier>"
    "<ScaleDenominator>{scale}</ScaleDenominator>"
    f"<TopLeftCorner>-{_HALF_WORLD_M} {_HALF_WORLD_M}</TopLeftCorner>"
    "<TileWidth>256</TileWidth><TileHeight>256</TileHeight>"
    "<MatrixWidth>{count}</MatrixWidth><MatrixHeight>{count}</MatrixHeight></TileMatrix>"
)


def capabilities(address: str) -> bytes:
    """The service's description of itself."""
    matrices = "".join(
        _MATRIX.format(zoom=z, scale=f"{559082264.0287178 / 2**z:.10f}", count=2**z) for z in _ZOOMS
    )
    return _CAPABILITIES.format(address=address, matrices=matrices).encode()


@cache
def tile(zoom: int, row: int, column: int) -> bytes:
    """One tile of the picture, as PNG."""
    from affine import Affine
    from rasterio.warp import Resampling, reproject

    scene = _scene()
    side_m = 2 * _HALF_WORLD_M / 2**zoom
    west, north = -_HALF_WORLD_M + column * side_m, _HALF_WORLD_M - row * side_m
    pixels = np.full((3, 256, 256), 128, np.uint8)
    reproject(
        scene.bands[:3],
        pixels,
        src_transform=scene.grid.transform,
        src_crs=scene.grid.crs.to_wkt(),
        dst_transform=Affine(side_m / 256, 0, west, 0, -side_m / 256, north),
        dst_crs="EPSG:3857",
        resampling=Resampling.bilinear,
        init_dest_nodata=False,
    )
    buffer = io.BytesIO()
    Image.fromarray(np.moveaxis(pixels, 0, -1)).save(buffer, "PNG")
    return buffer.getvalue()


@cache
def _scene() -> Any:
    from geofield.simulate import SimulationSettings, simulate_field

    settings = SimulationSettings(lat=LAT, lon=LON, obstacles=9, climate="temperate")
    return simulate_field(SEED, settings).scene


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_: Any) -> None:
        """Quiet."""

    server: _Server

    def do_HEAD(self) -> None:
        self._file(only_head=True)

    def do_GET(self) -> None:
        if self.path.endswith(".tif"):
            self._file()
            return
        if self.path.partition("?")[0].endswith("WMTSCapabilities.xml"):
            address = f"http://127.0.0.1:{self.server.server_port}"
            self._reply(capabilities(address), "application/xml")
            return
        zoom, row, column = self.path.removesuffix(".png").split("/")[-3:]
        self._reply(tile(int(zoom), int(row), int(column)), "image/png")

    def _file(self, *, only_head: bool = False) -> None:
        """A recorded chip, or the piece of it that was asked for."""
        chips = self.server.chips
        path = None if chips is None else chips / self.path.rsplit("/", 1)[-1]
        if path is None or not path.is_file():
            self.send_error(404)
            return
        body = path.read_bytes()
        piece = re.fullmatch(r"bytes=(\d+)-(\d*)", self.headers.get("Range", ""))
        start = int(piece[1]) if piece else 0
        end = min(int(piece[2]) + 1, len(body)) if piece and piece[2] else len(body)
        self.send_response(206 if piece else 200)
        if piece:
            self.send_header("Content-Range", f"bytes {start}-{end - 1}/{len(body)}")
        self.send_header("Accept-Ranges", "bytes")
        self.send_header("Content-Type", "image/tiff")
        self.send_header("Content-Length", str(end - start))
        self.end_headers()
        if not only_head:
            self.wfile.write(body[start:end])

    def _reply(self, body: bytes, kind: str) -> None:
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, chips: Path | None) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.chips = chips

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A client that has what it needs may hang up."""


@contextmanager
def serving(shared: Path | None = None) -> Iterator[str]:
    """Run the server, with the chips of a folder of real data; gives its address."""
    server = _Server(None if shared is None else shared / "data" / "trees")
    thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
