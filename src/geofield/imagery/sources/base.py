"""What every imagery source is: a name, terms, and either tiles or a picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from geofield.imagery.terms import Terms
from geofield.imagery.tiling import Block, Tile, TilePyramid


@dataclass(frozen=True, slots=True, repr=False)
class Request:
    """What to ask a server for; its address may hold a key, so it is never shown."""

    url: str
    headers: tuple[tuple[str, str], ...] = ()


@runtime_checkable
class TileSource(Protocol):
    """Tiles from a server.

    Attributes
    ----------
    name : str
    terms : Terms
    pyramid : TilePyramid
    identity : str
        What makes this source differ from others (address, layer, style), without any key.
    secrets : tuple of str
        Keys that must never be shown.
    rate_per_s : float or None
        Requests per second that the server's owner tolerates.
    date : str or None
        When the imagery was taken, where the source says so.
    """

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def terms(self) -> Terms: ...  # noqa: D102
    @property
    def pyramid(self) -> TilePyramid: ...  # noqa: D102
    @property
    def identity(self) -> str: ...  # noqa: D102
    @property
    def secrets(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def rate_per_s(self) -> float | None: ...  # noqa: D102
    @property
    def date(self) -> str | None: ...  # noqa: D102

    def request(self, tile: Tile) -> Request:
        """What to ask for."""
        ...


@runtime_checkable
class FrameSource(Protocol):
    """A tile source that delivers single frames around a point instead of fixed tiles."""

    def framed(
        self, zoom: int, *, lat: float, lon: float, size_px: int
    ) -> tuple[TileSource, Block]:
        """The source of one tile with the point at its centre, and its block."""
        ...


@runtime_checkable
class LocalTiles(Protocol):
    """Tiles in a file here; `read` gives None where there is none."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def terms(self) -> Terms: ...  # noqa: D102
    @property
    def pyramid(self) -> TilePyramid: ...  # noqa: D102
    @property
    def date(self) -> str | None: ...  # noqa: D102

    def read(self, tile: Tile) -> bytes | None:
        """The bytes of a tile."""
        ...


@dataclass(frozen=True, slots=True)
class PictureSource:
    """One picture, a folder of them, or those of a STAC file.

    Attributes
    ----------
    name : str
    terms : Terms
    path : str
        File, folder, address or STAC file.
    bands : tuple of str or None
        What the bands show, where the user says so.
    date : str or None
    """

    name: str
    terms: Terms
    path: str
    bands: tuple[str, ...] | None = None
    date: str | None = None


Source = TileSource | LocalTiles | PictureSource
