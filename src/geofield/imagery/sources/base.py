"""What every imagery source is: a name, terms, and either tiles or a picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar
from urllib.parse import quote

from geofield.imagery.sources.mbtiles import MBTilesSource
from geofield.imagery.terms import Terms
from geofield.imagery.tiling import Tile, TilePyramid


@dataclass(frozen=True, slots=True)
class TileSource:
    """Tiles from a server; each kind of server says what to ask it for."""

    #: Side of the largest picture that it gives, pixels.
    most_px: ClassVar[float] = math.inf
    name: str
    terms: Terms = field(default_factory=Terms, kw_only=True)
    #: Never shown.
    key: str = field(default="", repr=False, kw_only=True)
    #: Requests per second that the server's owner tolerates.
    rate_per_s: float | None = field(default=None, kw_only=True)
    #: When the imagery was taken, where the source says so.
    date: str | None = field(default=None, kw_only=True)
    #: Sent with each request, for instance a Referer.
    headers: tuple[tuple[str, str], ...] = field(default=(), kw_only=True)

    @property
    def pyramid(self) -> TilePyramid:
        """The tiles that there are."""
        raise NotImplementedError

    @property
    def identity(self) -> str:
        """What makes this source differ from others (address, layer, style), without any key.

        The tile cache asks for it, so that sources which are never cached need none.
        """
        raise NotImplementedError

    @property
    def secrets(self) -> tuple[str, ...]:
        """The spellings of the key that may stand in an address."""
        return tuple({self.key, quote(self.key, safe=""), quote(self.key)} - {""})

    def address(self, tile: Tile) -> str:
        """What to ask for; it may hold the key, so it is never shown."""
        raise NotImplementedError


@dataclass(frozen=True, slots=True)
class PictureSource:
    """One picture, a folder of them, or those of a STAC file."""

    #: Side of the largest picture that it gives, pixels.
    most_px: ClassVar[float] = math.inf
    name: str
    terms: Terms
    #: File, folder, address or STAC file.
    path: str
    date: str | None = None
    #: bands, crs: what its file does not say of itself (see `OpenOptions`).
    bands: Sequence[str] | None = None
    crs: Any = None


Tiles = TileSource | MBTilesSource
Source = Tiles | PictureSource
