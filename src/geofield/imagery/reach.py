"""Reach: which files and addresses may be opened because of what a file says.

A VRT, a tile index, a STAC file, a capabilities document and a redirect all name other files
and hosts. Followed is what lies in the naming file's own folder or on its own host, and what
the user allowed by name (``--allow``, or ``allow`` in the settings); anything else is refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from geofield.errors import ImageryError

_PORTS = {"http": 80, "https": 443}
_CURL = "/vsicurl/"


@dataclass(frozen=True, slots=True)
class Reach:
    """Folders and hosts that may be reached."""

    #: Folders, files (they stand for their folder) and addresses (for their host).
    allowed: tuple[str, ...] = ()

    def of(self, named: str | Path) -> Reach:
        """The same, and what lies beside a file or address that the user named."""
        return Reach((*self.allowed, str(named)))

    def holds(self, what: str | Path) -> bool:
        """Whether a file or address may be opened."""
        text = str(what).removeprefix(_CURL)
        host = _host(text)
        if host is not None:
            return any(host == _host(each.removeprefix(_CURL)) for each in self.allowed)
        if text.startswith("/vsi") or "://" in text:
            return text in self.allowed
        place, folders = Path(text), list(self._folders())
        if place.drive.startswith("\\\\") and place.drive not in {each.drive for each in folders}:
            return False  # Windows tells a server that is asked for a file who asks
        return any(place.resolve().is_relative_to(folder) for folder in folders)

    def require(self, what: str | Path, by: str) -> None:
        """Refuse a file or address that may not be opened; `by` is who names it."""
        if self.holds(what):
            return
        text = str(what).removeprefix(_CURL)
        parts = urlsplit(text)
        web = _host(text) is not None
        place = f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}" if web else text
        raise ImageryError(
            f"{by} leads to {place}, which you did not name: nothing was read from there.",
            hint=f"If you trust it: --allow {place}",
        )

    def _folders(self) -> Iterator[Path]:
        for each in self.allowed:
            if _host(each.removeprefix(_CURL)) is None and not each.startswith(("/vsi", "<")):
                place = Path(each).resolve()
                yield place if place.is_dir() else place.parent


def refuse_no_address(text: str) -> None:
    """Refuse what is written like an address of the web, and is none."""
    try:
        urlsplit(text)
    except ValueError as error:
        # Behind it may stand a key, before it a password.
        server = text.partition("?")[0].rpartition("@")[2]
        raise ImageryError(
            f"{server} is no address: {error}.", hint="Write it like https://host/path."
        ) from None


def _host(address: str) -> tuple[str, int] | None:
    """Host name and port of a web address; None for anything else."""
    try:
        parts = urlsplit(address)
        if parts.scheme.lower() not in _PORTS or not parts.hostname:
            return None
        port = parts.port or _PORTS[parts.scheme.lower()]
    except ValueError:
        return None
    # The two standard ports of a host are one server.
    return parts.hostname.lower(), 443 if port == 80 else port


#: Nothing besides what the user named.
OWN_FOLDER = Reach()
