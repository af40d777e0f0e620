"""Options: what is known of a picture before it is opened, and how tiles are fetched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from geofield.imagery.reach import OWN_FOLDER, Reach
from geofield.model.scene import ImagerySource


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenOptions:
    """What is known of a picture or set of pictures better than its files know it."""

    #: lat, lon: the point of interest, degrees, WGS 84: where a reprojected picture is centred; of
    #: a set only what lies near it is taken.
    lat: float | None = None
    lon: float | None = None
    #: What the bands show, in order: red, green, blue, nir, grey, alpha, other.
    bands: Sequence[str] | None = None
    #: Of a picture that does not name it.
    crs: Any = None
    #: File values that become 0 and 255.
    scaling: tuple[float, float] | None = None
    source: ImagerySource | None = None
    #: What a VRT, a tile index or a STAC file may lead to besides its own folder.
    reach: Reach = OWN_FOLDER

    @property
    def point(self) -> tuple[float, float] | None:
        """Longitude and latitude, degrees; None unless both are known."""
        return None if self.lat is None or self.lon is None else (self.lon, self.lat)


@dataclass(frozen=True, slots=True)
class FetchOptions:
    """How tiles are fetched and kept.

    Attributes
    ----------
    cache_dir : Path or None
        Where tile caches live; None keeps nothing.
    offline : bool
        Work from the cache alone.
    missing : "error" or "mask"
        What happens to tiles that cannot be had: stop, or leave no-data.
    threads, attempts : int
        Requests at once, and at most for one answer.
    timeout_s : float
        For connecting, for each pause within a body, and three times that for the whole.
    backoff_s : float
        The first pause before the same request; doubled each time.
    cache_max_bytes, cache_max_age_s
        Limits of each cache file.
    acknowledged : bool
        The user answers for terms that forbid deriving geodata.
    proxy : str or None
        Address of an HTTP proxy; never used for this machine itself.
    no_proxy : tuple of str
        Endings of host names that are asked without the proxy.
    allow : tuple of str
        Folders and hosts that files and servers may lead to besides their own.
    """

    cache_dir: Path | None = None
    offline: bool = False
    missing: Literal["error", "mask"] = "error"
    threads: int = 16
    attempts: int = 6
    timeout_s: float = 20.0
    backoff_s: float = 0.25
    cache_max_bytes: int | None = 2 * 2**30
    cache_max_age_s: float | None = 90 * 86400.0
    acknowledged: bool = False
    proxy: str | None = None
    no_proxy: tuple[str, ...] = ()
    allow: tuple[str, ...] = ()
