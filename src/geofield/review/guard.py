"""Who may speak to the page's server: the browser that got the address with the token, only.

The token of the printed address becomes a cookie that other sites' pages cannot send
(SameSite=Strict). Every change needs it a second time, in a header, which no other site's page
can set without being asked for. Host and Origin are checked, so that a name that somebody
points at 127.0.0.1 (DNS rebinding) reaches nothing.
"""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie

from geofield.errors import GeofieldError

COOKIE = "geofield_review"
HEADER = "X-Geofield-Token"

#: Sent with every answer.
SECURITY_HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self'; img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; "
        "form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}


class OtherTabError(GeofieldError):
    """A tab asked that may not edit, or that does not show the plan as it is."""


class Guard:
    """The rules for a server that listens on a port."""

    def __init__(self, port: int) -> None:
        self.token = secrets.token_urlsafe(24)
        self.hosts = (f"127.0.0.1:{port}", f"localhost:{port}")
        # Cookies know no ports: two sessions beside each other must not share a name.
        self.cookie = f"{COOKIE}_{port}"

    def refusal(self, method: str, headers: Mapping[str, str]) -> str | None:
        """Why a request is refused, in words; None when it is not."""
        if headers.get("Host", "") not in self.hosts:
            return "This address is not the one that was printed."
        origin = headers.get("Origin")
        if origin is not None and origin not in {f"http://{host}" for host in self.hosts}:
            return "Another site asked for this."
        if not self._same(self._cookie(headers)):
            return "Open the address that `geofield review` printed: it holds the key."
        if method != "GET" and not self._same(headers.get(HEADER, "")):
            return "The request has no key."
        return None

    def opens(self, token: str, headers: Mapping[str, str]) -> bool:
        """Whether the address of a first request holds the token."""
        return headers.get("Host", "") in self.hosts and self._same(token)

    def cookie_header(self) -> str:
        """The cookie that the browser keeps until it is closed."""
        return f"{self.cookie}={self.token}; Path=/; HttpOnly; SameSite=Strict"

    def _cookie(self, headers: Mapping[str, str]) -> str:
        try:
            found = SimpleCookie(headers.get("Cookie", "")).get(self.cookie)
        except CookieError:
            return ""
        return "" if found is None else found.value

    def _same(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(), self.token.encode())
