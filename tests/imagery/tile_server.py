"""A real HTTP server on loopback: tiles of a known picture, with faults on demand."""

from __future__ import annotations

import email.utils
import io
import socket
import struct
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, urlsplit

import numpy as np
from PIL import Image


def tile_pixels(zoom: int, column: int, row: int, size: int = 256) -> np.ndarray:
    """The picture of a tile: a pattern in world pixels, so that seams and shifts show."""
    x = (column * size + np.arange(size, dtype=np.int64))[None, :]
    y = (row * size + np.arange(size, dtype=np.int64))[:, None]
    red = (x + 3 * zoom) % 251
    green = (y + 5 * zoom) % 241
    blue = (x // 16 + y // 16) * 37 % 233
    return np.dstack(np.broadcast_arrays(red, green, blue)).astype(np.uint8)


def encode(pixels: np.ndarray, form: str = "PNG") -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, form, **({"compress_level": 1} if form == "PNG" else {}))
    return buffer.getvalue()


Fault = Callable[["Handler", tuple[int, int, int], int], bool]


class Handler(BaseHTTPRequestHandler):
    """Answers ``/z/x/y.png``, registered documents, and files by range."""

    protocol_version = "HTTP/1.1"
    server: TileServer
    # A small answer in one packet: no waiting for acknowledgements.
    disable_nagle_algorithm = True
    wbufsize = -1

    def log_message(self, *_: Any) -> None:
        """Quiet."""

    def do_GET(self) -> None:
        server = self.server
        with server.lock:
            server.paths.append(self.path)
            server.agents.add(self.headers.get("User-Agent", ""))
        if server.dead:
            self.reset()
            return
        parts = urlsplit(self.path)
        for prefix, answer in server.routes.items():
            if parts.path.startswith(prefix):
                answer(self, dict(parse_qsl(parts.query, True)))
                return
        try:
            zoom, column, rest = parts.path.strip("/").split("/")[-3:]
            tile = int(zoom), int(column), int(rest.partition(".")[0].partition("@")[0])
        except ValueError:
            self.reply(404, b"no such path", "text/plain")
            return
        self.tile(tile)

    def do_HEAD(self) -> None:
        self.do_GET()

    def tile(self, tile: tuple[int, int, int]) -> None:
        server = self.server
        with server.lock:
            server.asked[tile] += 1
            attempt = server.asked[tile]
        if server.fault is not None and server.fault(self, tile, attempt):
            return
        self.reply(200, server.body(tile), "image/png")

    def reply(self, status: int, body: bytes, kind: str, **headers: str) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        for name, value in headers.items():
            self.send_header(name.replace("_", "-"), value)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)
        self.wfile.flush()

    def reset(self) -> None:
        """Close the connection with a reset."""
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.close_connection = True
        self.connection.close()

    def file(self, path: Path) -> None:
        """A file, whole or by range."""
        size = path.stat().st_size
        asked = self.headers.get("Range")
        with path.open("rb") as file:
            if asked is None:
                self.reply(200, file.read(), "image/tiff", Accept_Ranges="bytes")
                return
            first, _, last = asked.removeprefix("bytes=").partition("-")
            start = int(first)
            stop = min(int(last) + 1 if last else size, size)
            file.seek(start)
            self.reply(
                206,
                file.read(stop - start),
                "image/tiff",
                Content_Range=f"bytes {start}-{stop - 1}/{size}",
                Accept_Ranges="bytes",
            )


class TileServer(ThreadingHTTPServer):
    """The server and what it remembers."""

    daemon_threads = True
    request_queue_size = 128

    def __init__(self, fault: Fault | None = None, *, size: int = 256) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.fault = fault
        self.size = size
        self.dead = False
        self.asked: Counter[tuple[int, int, int]] = Counter()
        self.paths: list[str] = []
        self.agents: set[str] = set()
        self.routes: dict[str, Callable[[Handler, dict[str, str]], None]] = {}
        self.lock = threading.Lock()

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"

    @property
    def template(self) -> str:
        return self.address + "/{z}/{x}/{y}.png"

    def body(self, tile: tuple[int, int, int]) -> bytes:
        return encode(tile_pixels(*tile, self.size))

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Clients that go away are part of the tests."""


@contextmanager
def serving(fault: Fault | None = None, *, size: int = 256) -> Iterator[TileServer]:
    server = TileServer(fault, size=size)
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


# -- faults -----------------------------------------------------------------------------------


def chosen(tile: tuple[int, int, int], share: float, salt: int = 0) -> bool:
    """A fixed share of all tiles, the same ones every time."""
    zoom, column, row = tile
    number = (column * 73856093 ^ row * 19349663 ^ zoom * 83492791 ^ salt * 2654435761) & 0xFFFFFF
    return number % 1000 < share * 1000


def first_time(act: Callable[[Handler, tuple[int, int, int]], None], share: float) -> Fault:
    """A fault at the first request of a share of the tiles."""

    def fault(handler: Handler, tile: tuple[int, int, int], attempt: int) -> bool:
        if attempt > 1 or not chosen(tile, share):
            return False
        act(handler, tile)
        return True

    return fault


def status_500(handler: Handler, tile: tuple[int, int, int]) -> None:
    handler.reply(500, b"out of order", "text/plain")


def status_429(handler: Handler, tile: tuple[int, int, int]) -> None:
    handler.reply(429, b"slow down", "text/plain", Retry_After="1")


def status_503_date(handler: Handler, tile: tuple[int, int, int]) -> None:
    moment = email.utils.formatdate(time.time() + 1, usegmt=True)
    handler.reply(503, b"later", "text/plain", Retry_After=moment)


def html_200(handler: Handler, tile: tuple[int, int, int]) -> None:
    handler.reply(200, b"<html><body>Please log in</body></html>", "text/html")


def truncated_png(handler: Handler, tile: tuple[int, int, int]) -> None:
    body = handler.server.body(tile)
    handler.reply(200, body[: len(body) // 2], "image/png")


def short_body(handler: Handler, tile: tuple[int, int, int]) -> None:
    body = handler.server.body(tile)
    handler.send_response(200)
    handler.send_header("Content-Type", "image/png")
    handler.send_header("Content-Length", str(len(body)))
    handler.end_headers()
    handler.wfile.write(body[: len(body) // 3])
    handler.wfile.flush()
    handler.close_connection = True


def reset(handler: Handler, tile: tuple[int, int, int]) -> None:
    handler.reset()


def slow_body(handler: Handler, tile: tuple[int, int, int]) -> None:
    """Drips: a byte now and then, for longer than anybody waits."""
    body = handler.server.body(tile)
    handler.send_response(200)
    handler.send_header("Content-Type", "image/png")
    handler.send_header("Content-Length", str(len(body)))
    handler.end_headers()
    handler.close_connection = True
    for byte in body[:40]:
        try:
            handler.wfile.write(bytes([byte]))
            handler.wfile.flush()
        except OSError:
            return
        time.sleep(0.1)


TRANSIENT = {
    "status 500": status_500,
    "status 429 with Retry-After": status_429,
    "status 503 with a date": status_503_date,
    "HTML with status 200": html_200,
    "truncated PNG": truncated_png,
    "body shorter than said": short_body,
    "connection reset": reset,
    "slow body": slow_body,
}


def hole(handler: Handler, tile: tuple[int, int, int], attempt: int) -> bool:
    """404 for a twentieth of the tiles, for good."""
    if chosen(tile, 0.05, salt=1):
        handler.reply(404, b"nothing here", "text/plain")
        return True
    return False


def no_agent(handler: Handler, tile: tuple[int, int, int], attempt: int) -> bool:
    """403 for whoever does not say who they are."""
    agent = handler.headers.get("User-Agent", "")
    if not agent or agent.startswith("python-urllib3"):
        handler.reply(403, b"who are you?", "text/plain")
        return True
    return False
