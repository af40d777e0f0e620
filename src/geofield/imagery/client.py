"""The HTTP client: polite, patient, and silent about keys.

A request is repeated with growing pauses on time-outs, broken connections, 429, 5xx and on
bodies that the caller finds broken; ``Retry-After`` pauses the whole host. Keys are removed
from every message.
"""

from __future__ import annotations

import logging
import random
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar
from urllib.parse import urljoin, urlsplit

import urllib3
from urllib3.exceptions import HTTPError, InvalidHeader, LocationParseError, NewConnectionError
from urllib3.util import Retry

from geofield.errors import ImageryError, NetworkError
from geofield.imagery.gdal import USER_AGENT
from geofield.imagery.opening import FetchOptions
from geofield.imagery.reach import Reach
from geofield.wording import counted

T = TypeVar("T")

#: Statuses after which the same request may succeed.
_AGAIN = frozenset({408, 425, 429, 500, 502, 503, 504, 520, 521, 522, 523, 524})
#: There is nothing at this address.
_NOTHING = frozenset({204, 404, 410})
_MEANINGS = {
    400: " (bad request)",
    401: " (not authorised: check the key)",
    403: " (forbidden: check the key and the terms)",
}
_MAX_REDIRECTS = 5
_MAX_BODY = 128 * 2**20
#: A server that asks for a longer pause has said no.
_MAX_PAUSE_S = 120.0
_THIS_MACHINE = ("localhost", "127.0.0.1", "::1")
_LOGGERS = ("urllib3.connectionpool", "urllib3.poolmanager", "urllib3.connection")


class NotThereError(Exception):
    """The server says that there is nothing: a hole in the coverage."""


class BrokenBodyError(Exception):
    """The answer is not what it should be; asking again may help."""


class GaveUpError(Exception):
    """The server answered, but never with what was asked for."""


class Client:
    """A pool of connections to tile servers, shared by threads.

    It asks `rate_per_s` times per second at most; `secrets` are keys that must not show in
    messages.
    """

    def __init__(
        self,
        options: FetchOptions,
        *,
        rate_per_s: float | None = None,
        secrets: Iterable[str] = (),
    ) -> None:
        self.attempts = options.attempts
        self._secrets = sorted({secret for secret in secrets if secret}, key=len, reverse=True)
        #: How often each kind of trouble was met and survived.
        self.troubles: Counter[str] = Counter()
        self._timeout_s = options.timeout_s
        self._backoff_s = options.backoff_s
        self._interval_s = 1.0 / rate_per_s if rate_per_s else 0.0
        self._next_slot = 0.0
        self._not_before: dict[str, float] = {}
        self._lock = threading.Lock()
        self._stopped = threading.Event()
        pool: dict[str, Any] = {
            "num_pools": 8,
            "maxsize": options.threads,
            "block": False,
            "timeout": urllib3.Timeout(connect=options.timeout_s, read=options.timeout_s),
            "headers": {"User-Agent": USER_AGENT, "Accept": "image/*,*/*;q=0.5"},
        }
        self._direct = urllib3.PoolManager(**pool)
        proxy = options.proxy
        self._proxied = urllib3.ProxyManager(proxy, **pool) if proxy else self._direct
        endings = (each.lstrip(".") for each in options.no_proxy if each)
        self._no_proxy = (*_THIS_MACHINE, *endings)
        for name in _LOGGERS:
            logging.getLogger(name).addFilter(self._keyless)
        self._reach = Reach(options.allow)

    def stop(self) -> None:
        """Make every pause and every further request end at once."""
        self._stopped.set()

    def close(self) -> None:
        """Close the connections."""
        self._direct.clear()
        self._proxied.clear()
        for name in _LOGGERS:
            logging.getLogger(name).removeFilter(self._keyless)

    def redact(self, text: str) -> str:
        """The text with every key replaced by ``***``."""
        for secret in self._secrets:
            text = text.replace(secret, "***")
        return text

    def _keyless(self, record: logging.LogRecord) -> bool:
        """Keep keys out of urllib3's debugging log, which prints every address."""
        record.msg, record.args = self.redact(record.getMessage()), None
        return True

    def get(
        self,
        url: str,
        accept: Callable[[bytes, str], T],
        headers: Mapping[str, str] | None = None,
    ) -> T:
        """Ask until `accept` takes the body and its content type, and give what it makes of them.

        It raises `BrokenBodyError` for an answer that is not what it should be. `headers` are sent
        beside User-Agent and Accept.

        Raises
        ------
        NotThereError
            Nothing at this address (404, 410, 204).
        GaveUpError
            The server refuses, or never gave a sound answer.
        NetworkError
            The server cannot be reached.
        """
        host = urlsplit(url).netloc.rpartition("@")[2]
        last: Exception = GaveUpError("not tried")
        for attempt in range(self.attempts):
            self._wait_turn(host)
            pause = self._backoff_s * 2**attempt * random.uniform(0.75, 1.25)  # noqa: S311
            try:
                status, kind, asked, body = self._once(url, headers)
            except (HTTPError, OSError) as error:
                if isinstance(error, LocationParseError):
                    raise GaveUpError(self.redact(f"not an address: {error}")) from None
                last, trouble, asked = error, _kind_of(error), None
            else:
                _require_hope(status)
                try:
                    if status == 200:
                        return accept(body, kind)
                    trouble = f"status {status}"
                except BrokenBodyError as error:
                    trouble, asked = str(error), None
                last = GaveUpError(trouble)
            with self._lock:
                self.troubles[trouble] += 1
            if asked is not None:
                self._keep_quiet(host, asked, trouble)
            self._pause(pause if asked is None else asked)
        if isinstance(last, GaveUpError):
            raise GaveUpError(f"{last} {counted(self.attempts, 'time')}")
        raise NetworkError(
            f"No answer from {host}: {self.redact(_plain(last))} "
            f"({counted(self.attempts, 'attempt')}).",
            hint="Check the network and the address. What was fetched is kept in the cache: repeat "
            "to go on, or use --offline to work from the cache alone.",
        )

    def _keep_quiet(self, host: str, asked_s: float, trouble: str) -> None:
        """Ask a host for nothing, in any thread, for as long as it wants."""
        if asked_s > _MAX_PAUSE_S:
            raise GaveUpError(f"{trouble}, asks to wait {asked_s:.0f} s")
        with self._lock:
            until = time.monotonic() + asked_s
            self._not_before[host] = max(self._not_before.get(host, 0.0), until)

    def text(self, url: str, headers: Mapping[str, str] | None = None) -> bytes:
        """A document (capabilities), with the same patience; `NetworkError` without one."""
        try:
            return self.get(url, lambda body, kind: body, headers)
        except (NotThereError, GaveUpError) as error:
            parts = urlsplit(url)
            raise NetworkError(
                f"{parts.netloc.rpartition('@')[2]} does not give the document {parts.path}: "
                f"{error}.",
                hint="Check the address.",
            ) from None

    def _once(
        self, url: str, headers: Mapping[str, str] | None
    ) -> tuple[int, str, float | None, bytes]:
        """Status, content type, the pause asked for, body."""
        host = urlsplit(url).hostname or ""
        near = any(host == each or host.endswith("." + each) for each in self._no_proxy)
        pool = self._direct if near else self._proxied
        merged = {**pool.headers, **headers} if headers else None
        for _ in range(_MAX_REDIRECTS):
            response = pool.request(
                "GET", url, headers=merged, preload_content=False, retries=False, redirect=False
            )
            onward = response.get_redirect_location()
            if not onward:
                break
            response.drain_conn()
            response.release_conn()
            url = self._redirected(url, onward)
        else:
            raise GaveUpError("sent on and on")
        deadline = time.monotonic() + 3 * self._timeout_s
        parts, size = [], 0
        try:
            while part := response.read1(1 << 18):
                parts.append(part)
                size += len(part)
                # A body that drips keeps the socket alive for ever.
                if time.monotonic() > deadline:
                    raise TimeoutError("the body came too slowly")
                if size > _MAX_BODY:
                    raise OSError("the body is too large")
        except BaseException:
            response.close()
            raise
        response.release_conn()
        asked = _retry_after(response.headers.get("Retry-After"))
        return response.status, response.headers.get("Content-Type", ""), asked, b"".join(parts)

    def _redirected(self, url: str, onward: str) -> str:
        """Where a server sends on to, when that is itself or allowed."""
        target = urljoin(url, onward)
        parts, asked = urlsplit(target), urlsplit(url)
        if parts.scheme not in ("http", "https"):
            raise ImageryError(
                f"{asked.hostname} sends on to {self.redact(parts.scheme)}:, which is no address "
                "of the web: refused."
            )
        if asked.scheme == "https" and parts.scheme == "http":
            raise ImageryError(f"{asked.hostname} sends on from https to http: refused.")
        self._reach.of(url).require(target, f"The server {asked.hostname}")
        return target

    def _wait_turn(self, host: str) -> None:
        with self._lock:
            now = time.monotonic()
            slot = max(now, self._next_slot, self._not_before.get(host, 0.0))
            if self._interval_s:
                self._next_slot = slot + self._interval_s
        self._pause(slot - now)

    def _pause(self, seconds: float) -> None:
        if (seconds > 0 and self._stopped.wait(seconds)) or self._stopped.is_set():
            raise NetworkError("The work was stopped.")


def _retry_after(value: str | None) -> float | None:
    """Seconds to wait: a number, or a date."""
    try:
        return float(Retry().parse_retry_after(value or ""))
    except (InvalidHeader, ValueError, OverflowError):
        return None


def _kind_of(error: Exception) -> str:
    text = f"{type(error).__name__} {error}".lower()
    if "timeout" in text or "timed out" in text or "too slowly" in text:
        return "time-out"
    if isinstance(error, NewConnectionError):
        return "no connection"
    if "incomplete" in text:
        return "body cut off"
    return "connection broken"


def _plain(error: Exception) -> str:
    """The reason alone: urllib3's messages carry the whole address."""
    kind = _kind_of(error)
    cause = error.__cause__ or error.__context__
    if isinstance(cause, OSError) and cause.strerror:
        return f"{kind}, {cause.strerror.lower()}"
    return kind


def _require_hope(status: int) -> None:
    """Give up on what asking again will not change."""
    if status in _NOTHING:
        raise NotThereError(f"status {status}")
    if status != 200 and status not in _AGAIN:
        raise GaveUpError(f"status {status}{_MEANINGS.get(status, '')}")
