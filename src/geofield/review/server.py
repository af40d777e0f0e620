"""The page's server: this machine only, one plan, the standard library's HTTP.

One person, one page, some requests a second: a framework would add dependencies and no feature.
Nothing here knows fields or tracks; `desk` answers, `guard` says who may ask.
"""

from __future__ import annotations

import json
import logging
import threading
from collections.abc import Callable
from concurrent.futures import Future
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from geofield.errors import ChangedError, GeofieldError
from geofield.review.guard import SECURITY_HEADERS, Guard, OtherTabError

if TYPE_CHECKING:
    from geofield.review.desk import Desk
    from geofield.review.shelf import Shelf

_LOG = logging.getLogger(__name__)
#: The largest request that is read: an outline of a hundred thousand corners.
MOST_BYTES = 4_000_000
_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".md": "text/plain; charset=utf-8",
}


class ReviewServer(ThreadingHTTPServer):
    """A server for one session, bound to 127.0.0.1; port 0 takes a free one.

    The page itself is served at once; what it asks of the plan waits until :meth:`load` has it.
    """

    daemon_threads = True
    request_queue_size = 32

    def __init__(self, port: int = 0) -> None:
        super().__init__(("127.0.0.1", port), _Handler)
        self.guard = Guard(self.server_port)
        self.files = _page_files()
        self._shelf: Future[Shelf] = Future()

    @property
    def shelf(self) -> Shelf:
        """The plans; waits until they are read.

        Raises
        ------
        GeofieldError
            When they could not be read.
        """
        return self._shelf.result()

    def load(self, read: Callable[[], Shelf]) -> Shelf:
        """Read the plans, and let the requests that wait for them go on."""
        try:
            self._shelf.set_result(read())
        except BaseException as error:
            self._shelf.set_exception(error)
            raise
        return self.shelf

    @property
    def address(self) -> str:
        """What to open in the browser; holds the key."""
        return f"http://127.0.0.1:{self.server_port}/?token={self.guard.token}"

    def stop(self) -> None:
        """End :meth:`serve_forever`, from whichever thread."""
        threading.Thread(target=self.shutdown, daemon=True).start()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that closes its connections early is no fault."""


def _page_files() -> dict[str, tuple[bytes, str]]:
    """All files of the page by their address: no path from a request is ever opened."""
    found: dict[str, tuple[bytes, str]] = {}
    folders = [
        ("", resources.files("geofield.review") / "page"),
        ("web/", resources.files("geofield.web")),
    ]
    while folders:
        prefix, folder = folders.pop()
        for entry in folder.iterdir():
            if entry.is_dir():
                folders.append((f"{prefix}{entry.name}/", entry))
                continue
            suffix = entry.name[entry.name.rfind(".") :]
            if suffix in _TYPES:
                found[f"/{prefix}{entry.name}"] = (entry.read_bytes(), _TYPES[suffix])
    return found


class _NoSuchRequestError(Exception):
    """A page of another version asked."""


class _Handler(BaseHTTPRequestHandler):
    server: ReviewServer
    protocol_version = "HTTP/1.1"
    timeout = 60
    # An answer is one packet that must not wait for the browser's word about the last one.
    disable_nagle_algorithm = True
    wbufsize = 1 << 16

    def log_message(self, *_: Any) -> None:
        """Requests are no news."""

    def version_string(self) -> str:
        """Nothing about versions to strangers."""
        return "geofield"

    def do_GET(self) -> None:
        """The page, its state, tiles."""
        address = urlsplit(self.path)
        token = parse_qs(address.query).get("token", [""])[0]
        if address.path == "/" and token and self.server.guard.opens(token, self._headers()):
            # The key leaves the address line, so that no screenshot shows it.
            cookie = self.server.guard.cookie_header()
            self._send(303, b"", "text/plain", {"Location": "/", "Set-Cookie": cookie})
            return
        if self._refused():
            return
        if address.path == "/api/state":
            self._json(*_answered(self._state))
        elif address.path.startswith("/tile/"):
            self._tile(address.path)
        else:
            name = "/index.html" if address.path == "/" else address.path
            found = self.server.files.get(name)
            if found is None:
                self._json(404, {"message": "There is no such page."})
            else:
                self._send(200, *found)

    def do_POST(self) -> None:
        """Edits, previews, saving."""
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > MOST_BYTES:
            self.close_connection = True
            self._json(413, {"message": f"More than {MOST_BYTES} bytes, or of unknown length."})
            return
        body = self.rfile.read(int(length))
        if self._refused():
            return
        try:
            value = json.loads(body or b"{}")
        except (ValueError, RecursionError):
            value = None
        if not isinstance(value, dict):
            self._json(400, {"message": "The request is not a JSON object."})
            return
        self._json(*_answered(lambda: self._answer(urlsplit(self.path).path, value)))

    def _state(self) -> dict[str, Any]:
        shelf = self.server.shelf
        plans = {"plans": shelf.names, "plan": shelf.current}
        return {**shelf.desk.opening(), **plans, "token": self.server.guard.token}

    def _answer(self, path: str, value: dict[str, Any]) -> dict[str, Any]:
        shelf, tab = self.server.shelf, self.headers.get("X-Geofield-Tab", "")
        if path == "/api/take":
            return {"yours": shelf.take(tab, force=bool(value.get("force")))}
        if path == "/api/stop":
            shelf.refuse_loss()
            noted = shelf.noted
            self.server.stop()
            return {"stopped": True, "noted": noted}
        shelf.refuse_others(tab)
        if path == "/api/open":
            number = value.get("plan")
            shelf.open(number if isinstance(number, int) else -1)
            return {"plan": shelf.current}
        desk = shelf.desk
        if path == "/api/preview":
            return desk.preview(value)
        with desk.lock:
            shelf.refuse_outdated(self.headers.get("X-Geofield-Seen"))
            return self._changed(desk, path, value)

    @staticmethod
    def _changed(desk: Desk, path: str, value: dict[str, Any]) -> dict[str, Any]:
        name = value.get("name")
        requests: dict[str, Callable[[], dict[str, Any]]] = {
            "/api/edit": lambda: desk.edit(value),
            "/api/save": lambda: desk.save(name if isinstance(name, str) else None),
            "/api/reload": desk.reload,
            "/api/export": lambda: desk.export(str(value.get("format", ""))),
        }
        if path not in requests:
            raise _NoSuchRequestError(path)
        return requests[path]()

    def _tile(self, path: str) -> None:
        show, *places = path.split("/")[2:]
        shelf = self.server.shelf
        numbers = [int(place) for place in places if place.isdecimal()]
        known = len(places) == len(numbers) == 4 and numbers[0] < len(shelf.names)
        picture = shelf.desk_of(numbers[0]).picture if known else None
        if picture is None or show not in ("colour", "infrared"):
            self._json(404, {"message": "There is no such tile."})
            return
        _, level, column, row = numbers
        try:
            data, kind = picture.tile(level, column, row, show)  # type: ignore[arg-type]
        except (GeofieldError, OSError) as error:
            self._json(404, {"message": str(error)})
            return
        self._send(200, data, kind, {"Cache-Control": "private, max-age=3600"})

    def _refused(self) -> bool:
        reason = self.server.guard.refusal(self.command, self._headers())
        if reason is None:
            return False
        self._json(403, {"message": reason})
        return True

    def _headers(self) -> dict[str, str]:
        return {name.title(): value for name, value in self.headers.items()}

    def _json(self, status: int, value: dict[str, Any]) -> None:
        data = json.dumps(value, ensure_ascii=False, separators=(",", ":")).encode()
        self._send(status, data, "application/json")

    def _send(
        self, status: int, data: bytes, kind: str, more: dict[str, str] | None = None
    ) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        for name, value in {**SECURITY_HEADERS, **(more or {})}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(data)


def _answered(work: Callable[[], dict[str, Any]]) -> tuple[int, dict[str, Any]]:
    """Status and answer of a request: a page that hears nothing would think the session ended."""
    try:
        return 200, work()
    except ChangedError as error:
        return 409, _words(error)
    except OtherTabError as error:
        return 422, {**_words(error), "other_tab": True}
    except GeofieldError as error:
        return 422, _words(error)
    except _NoSuchRequestError:
        return 404, {"message": "There is no such request."}
    except OSError as error:
        return 500, {"message": f"{error.filename or 'The disk'}: {error.strerror or error}."}
    except Exception as error:  # noqa: BLE001 - the session must outlive a fault
        _LOG.exception("A request of the page failed")
        return 500, {
            "message": f"This went wrong within geofield: {type(error).__name__}: {error}.",
            "hint": "Nothing was changed by it; save what you have edited.",
        }


def _words(error: GeofieldError) -> dict[str, Any]:
    return {"message": error.message, "hint": error.hint or ""}
