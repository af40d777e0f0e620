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
    """How tiles are fetched and kept."""

    #: Where tile caches live; None keeps nothing.
    cache_dir: Path | None = None
    #: Work from the cache alone.
    offline: bool = False
    #: What happens to tiles that cannot be had: stop, or leave no-data.
    missing: Literal["error", "mask"] = "error"
    #: threads, attempts: requests at once, and at most for one answer.
    threads: int = 16
    attempts: int = 6
    #: For connecting, for each pause within a body, and three times that for the whole.
    timeout_s: float = 20.0
    #: The first pause before the same request; doubled each time.
    backoff_s: float = 0.25
    #: cache_max_bytes, cache_max_age_s: limits of each cache file.
    cache_max_bytes: int | None = 2 * 2**30
    cache_max_age_s: float | None = 90 * 86400.0
    #: The user answers for terms that forbid deriving geodata.
    acknowledged: bool = False
    #: Address of an HTTP proxy; never used for this machine itself.
    proxy: str | None = None
    #: Endings of host names that are asked without the proxy.
    no_proxy: tuple[str, ...] = ()
    #: Folders and hosts that files and servers may lead to besides their own.
    allow: tuple[str, ...] = ()
