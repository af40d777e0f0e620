"""Google static maps: the study's source. Single frames, never cached, terms to acknowledge."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar
from urllib.parse import quote

from geofield.errors import ImageryError
from geofield.grid import Grid
from geofield.imagery.sources.base import TileSource
from geofield.imagery.sources.xyz import key_variable
from geofield.imagery.terms import Terms
from geofield.imagery.tiling import Block, Tile, TileLevel, TilePyramid

#: The service's largest picture, px.
MAX_FRAME_PX = 640

GOOGLE_TERMS = Terms(
    attribution="Imagery © Google and its providers, as shown on the picture",
    licence="Google Maps Platform terms of service",
    may_cache=False,
    may_derive=False,
    url="https://cloud.google.com/maps-platform/terms",
)


@dataclass(frozen=True, slots=True)
class GoogleStaticSource(TileSource):
    """Satellite pictures of at most 640 x 640 px with the point exactly at the centre.

    The service takes positions to six decimals of a degree (0.1 m): the point is rounded to
    that first, so that the georeference is exact for what was asked.
    """

    most_px: ClassVar[float] = MAX_FRAME_PX
    name: str = "google"
    terms: Terms = GOOGLE_TERMS
    rate_per_s: float | None = 10.0
    service: str = "https://maps.googleapis.com/maps/api/staticmap"
    #: Latitude and longitude, degrees.
    centre: tuple[float, float] | None = None
    size_px: int = MAX_FRAME_PX

    def __post_init__(self) -> None:
        if not self.key:
            raise ImageryError(
                "The source google needs your own key for the Maps Static API.",
                hint=f"Put it into the environment as {key_variable(self.name)}, or into the "
                "settings file.",
            )

    @property
    def pyramid(self) -> TilePyramid:
        """The zooms of Web Mercator, 0 to 22."""
        return TilePyramid.web_mercator(0, 22)

    def framed(
        self, zoom: int, *, lat: float, lon: float, size_px: int
    ) -> tuple[GoogleStaticSource, Block]:
        """The source bound to a place, and its one frame as a block of one tile."""
        if not 1 <= size_px <= MAX_FRAME_PX:
            raise ImageryError(
                f"Google static maps gives pictures of 1 to {MAX_FRAME_PX} px, not {size_px} px.",
                hint="Use --size 640 with a coarser zoom, or another source.",
            )
        lat, lon = round(lat, 6), round(lon, 6)
        grid = Grid.web_mercator(lat=lat, lon=lon, zoom=zoom, width_px=size_px, height_px=size_px)
        transform = grid.transform
        level = TileLevel(zoom, transform.a, transform.c, transform.f, 1, 1, (size_px, size_px))
        return replace(self, centre=(lat, lon), size_px=size_px), Block(grid.crs, level, 0, 0, 1, 1)

    def address(self, tile: Tile) -> str:
        """The address of the frame at `centre`."""
        if self.centre is None:
            raise ImageryError("Google static maps has no tiles, only frames around a point.")
        lat, lon = self.centre
        return (
            f"{self.service}?center={lat:.6f},{lon:.6f}&zoom={tile.zoom}"
            f"&size={self.size_px}x{self.size_px}&scale=1&maptype=satellite&format=png"
            f"&key={quote(self.key, safe='')}"
        )
