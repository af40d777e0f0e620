"""The way out for GDAL: it follows redirects by itself, so all that it asks for goes through here.

GDAL has no switch against redirects. Its requests are sent through a small proxy on this machine
that opens connections to hosts within reach only; a redirect to any other is a request like all
others here, and refused. What is encrypted stays so: the proxy sees the host's name, no more.
"""

from __future__ import annotations

import http.client
import os
import select
import socket
import threading
from functools import cache
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import urlsplit
from urllib.request import getproxies, proxy_bypass

from geofield.imagery.reach import Reach

_CONNECT_S, _TIMEOUT_S = 20.0, 120.0
_BLOCK = 1 << 16
#: Of one connection, not of the message (RFC 9110, 7.6.1).
_HOP = frozenset(
    ("connection", "proxy-connection", "keep-alive", "te", "trailer", "transfer-encoding")
)


class Gateway(ThreadingHTTPServer):
    """A proxy for this process."""

    daemon_threads = True
    request_queue_size = 64

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        #: Addresses out of reach that were asked for.
        self.refused: list[str] = []
        #: Why servers that do not answer do not.
        self._silent: dict[str, str] = {}
        self._answered: set[str] = set()
        self._reaches: set[Reach] = set()
        self._proxies = getproxies()
        # curl would pass the gateway by for the hosts named there; Python still knows them.
        for name in ("no_proxy", "NO_PROXY"):
            os.unsetenv(name)
        threading.Thread(target=self.serve_forever, name="gateway", daemon=True).start()

    def options(self, reach: Reach) -> dict[str, str]:
        """GDAL's options for pictures with this reach."""
        self._reaches.add(reach)
        here = f"http://127.0.0.1:{self.server_port}"
        return {"GDAL_HTTP_PROXY": here, "GDAL_HTTPS_PROXY": here}

    def may(self, address: str) -> bool:
        """Whether an address is within reach; one that is not is remembered."""
        if any(reach.holds(address) for reach in list(self._reaches)):
            return True
        self.refused.append(address)
        return False

    def silent(self, path: str) -> str:
        """Why a server that a picture may come from does not answer; told once.

        Others read other pictures at the same time.
        """
        reaches = [each for each in list(self._reaches) if each.allowed[-1] == path]
        for server in list(self._silent):
            if any(reach.holds(server) for reach in reaches):
                return self._silent.pop(server, "")
        return ""

    def connected(self, server: str) -> http.client.HTTPConnection:
        """A connection to a server, through the user's own proxy where there is one.

        Raises
        ------
        OSError
            Where there is no way to it.
        """
        asked = urlsplit(server)
        host, port = asked.hostname or "", asked.port or 80
        proxy = self._proxies.get(asked.scheme)
        if not proxy or proxy_bypass(host):
            through = http.client.HTTPConnection(host, port, timeout=_CONNECT_S)
        else:
            parts = urlsplit(proxy if "://" in proxy else f"http://{proxy}")
            through = http.client.HTTPConnection(
                parts.hostname or "", parts.port or 80, timeout=_CONNECT_S
            )
            through.set_tunnel(host, port)
        through.connect()
        through.sock.settimeout(_TIMEOUT_S)
        self._answered.add(server)
        self._silent.pop(server, None)
        return through

    def without(self, server: str, error: Exception) -> int:
        """The status for a host that is silent: GDAL asks again only where it has answered."""
        words = (error.strerror if isinstance(error, OSError) else None) or str(error)
        self._silent[server] = f"{urlsplit(server).hostname} does not answer ({words.lower()})"
        return 502 if server in self._answered else 403

    def handle_error(self, request: Any, client_address: Any) -> None:
        """GDAL closes connections as it likes."""


@cache
def gateway() -> Gateway:
    """The one of this process."""
    return Gateway()


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: Gateway

    def log_message(self, *_: Any) -> None:
        """Say nothing."""

    def do_CONNECT(self) -> None:
        """A tunnel: what is in it is between GDAL and the host."""
        server = f"https://{self.path}"  # it names the port
        if not self.server.may(server):
            self._refuse()
            return
        try:
            connection = self.server.connected(server)
        except OSError as error:
            self.send_error(self.server.without(server, error))
            return
        self.send_response(200)
        self.end_headers()
        self.close_connection = True
        try:
            _pump(self.connection, connection.sock)
        finally:
            connection.close()

    def do_GET(self) -> None:
        """One request, answered as it comes, a redirect too: the next request shows where to."""
        parts = urlsplit(self.path)
        if parts.scheme != "http" or not parts.hostname or not self.server.may(self.path):
            self._refuse()
            return
        headers = {name: value for name, value in self.headers.items() if name.lower() not in _HOP}
        path = parts._replace(scheme="", netloc="").geturl() or "/"
        server = f"http://{parts.netloc}"
        try:
            connection = self.server.connected(server)
            connection.request(self.command, path, headers=headers)
            answer = connection.getresponse()
        except (OSError, http.client.HTTPException) as error:
            self.send_error(self.server.without(server, error))
            return
        self.send_response_only(answer.status, answer.reason)
        for name, value in answer.getheaders():
            if name.lower() not in _HOP:
                self.send_header(name, value)
        if answer.getheader("Content-Length") is None:
            self.send_header("Connection", "close")
            self.close_connection = True
        self.end_headers()
        if self.command != "HEAD":
            while block := answer.read1(_BLOCK):
                self.wfile.write(block)
        connection.close()

    do_HEAD = do_GET  # noqa: N815

    def _refuse(self) -> None:
        self.send_response(403)
        self.send_header("Content-Length", "0")
        self.end_headers()


def _pump(one: socket.socket, other: socket.socket) -> None:
    """Carry bytes both ways until an end closes or nothing comes for long."""
    while True:
        ready, _, _ = select.select([one, other], [], [], _TIMEOUT_S)
        if not ready:
            return
        for end in ready:
            data = end.recv(_BLOCK)
            if not data:
                return
            (other if end is one else one).sendall(data)
