"""Tile addresses as templates: XYZ, TMS, quadkeys, sub-domains, @2x."""

from __future__ import annotations

import re
from dataclasses import dataclass
from urllib.parse import quote, urlsplit

from geofield.errors import ImageryError
from geofield.imagery.sources.base import TileSource
from geofield.imagery.tiling import Tile, TilePyramid

_PLACE = re.compile(r"\{([^{}]*)\}")
_KEY_NAMES = ("key", "apikey", "api_key", "token", "access_token")


@dataclass(frozen=True, slots=True)
class XYZSource(TileSource):
    """Web Mercator tiles behind an address template."""

    #: With ``{z}``, ``{x}``, ``{y}`` (from the north) or ``{-y}`` (TMS, from the south), or
    #: ``{q}`` (quadkey); ``{s}`` or ``{switch:a,b,c}`` (sub-domain), ``{r}`` (@2x), ``{key}``.
    template: str
    min_zoom: int = 0
    max_zoom: int = 22
    tile_px: int | None = None
    #: What ``{s}`` stands for.
    subdomains: tuple[str, ...] = ("a", "b", "c")

    def __post_init__(self) -> None:
        names = set(_PLACE.findall(self.template))
        position = {"x", "y", "z"} <= names or {"x", "-y", "z"} <= names or "q" in names
        if not position:
            missing = [f"{{{n}}}" for n in ("x", "y", "z") if n not in names]
            raise ImageryError(
                f"The tile address {_shown(self.template)} lacks {', '.join(missing)}.",
                hint="Write it like https://host/{z}/{x}/{y}.png ({-y} for TMS, {q} for quadkeys).",
            )
        if urlsplit(self.template).scheme not in ("http", "https"):
            raise ImageryError(
                f"The tile address {_shown(self.template)} does not begin with https://."
            )
        known = {"x", "y", "-y", "z", "q", "s", "r", *_KEY_NAMES}
        for name in names - known:
            if not name.startswith("switch:"):
                raise ImageryError(
                    f"The tile address {_shown(self.template)} holds an unknown part {{{name}}}.",
                    hint=f"Known: {', '.join(sorted(known))}, switch:a,b,c.",
                )
        if names & set(_KEY_NAMES) and not self.key:
            raise ImageryError(
                f"The source {self.name} needs a key.",
                hint=f"Put it into the environment as {key_variable(self.name)}, or into the "
                "settings file.",
            )
        if not 0 <= self.min_zoom <= self.max_zoom <= 30:
            raise ImageryError(f"Zooms {self.min_zoom} to {self.max_zoom} make no range.")

    @property
    def pyramid(self) -> TilePyramid:
        """Web Mercator, 256 px, or 512 px for @2x."""
        double = "{r}" in self.template or "@2x" in self.template
        return TilePyramid.web_mercator(
            self.min_zoom, self.max_zoom, self.tile_px or (512 if double else 256)
        )

    @property
    def identity(self) -> str:
        """The template: it holds ``{key}``, not the key."""
        return f"xyz {self.template} {self.tile_px or ''}"

    def address(self, tile: Tile) -> str:
        """The address of a tile."""
        values = {
            "z": str(tile.zoom),
            "x": str(tile.column),
            "y": str(tile.row),
            "-y": str(2**tile.zoom - 1 - tile.row),
            "q": quadkey(tile),
            "r": "@2x",
            "s": self.subdomains[(tile.column + tile.row) % len(self.subdomains)]
            if self.subdomains
            else "",
            **dict.fromkeys(_KEY_NAMES, quote(self.key, safe="")),
        }

        def filled(match: re.Match[str]) -> str:
            name = match.group(1)
            if name.startswith("switch:"):
                choices = name.removeprefix("switch:").split(",")
                return choices[(tile.column + tile.row) % len(choices)].strip()
            return values[name]

        return _PLACE.sub(filled, self.template)


def quadkey(tile: Tile) -> str:
    """The quadkey of a tile: one digit 0..3 per zoom."""
    bits = range(tile.zoom - 1, -1, -1)
    return "".join(str((tile.column >> bit & 1) + 2 * (tile.row >> bit & 1)) for bit in bits)


def key_variable(name: str) -> str:
    """The environment variable that holds the key of a source."""
    return "GEOFIELD_KEY_" + re.sub(r"[^A-Z0-9]+", "_", name.upper()).strip("_")


def _shown(template: str) -> str:
    """A template for messages: without the values of its query, where keys are put by hand."""
    base, mark, query = template.partition("?")
    if not mark:
        return base
    return base + "?" + re.sub(r"=(?!\{)[^&]*", "=...", query)
