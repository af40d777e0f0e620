"""Stage 1, the picture, and how imagery is fetched."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, PositiveFloat, SecretStr

from geofield.settings.section import Section, words


class SourceSettings(Section):
    """An imagery source of the user's own."""

    url: str = Field(description="Tile address with {z} {x} {y}, WMS or WMTS address, or path.")
    kind: Literal["xyz", "wmts", "wms", "mbtiles", "picture"] = Field(
        "xyz", description="What the address is."
    )
    attribution: str = Field("", description="To be named with every product.")
    licence: str = Field("", description="Of the imagery.")
    terms_url: str = Field("", description="Where the terms can be read.")
    may_cache: bool = Field(False, description="Whether the terms allow keeping tiles.")
    may_derive: bool = Field(False, description="Whether the terms allow deriving geodata.")
    min_zoom: int = Field(0, ge=0, le=30, description="Coarsest zoom.")
    max_zoom: int = Field(22, ge=0, le=30, description="Finest zoom.")
    tile_px: int | None = Field(None, ge=64, le=4096, description="Side of a tile, pixels.")
    subdomains: tuple[str, ...] = Field(("a", "b", "c"), description="What {s} stands for.")
    layer: str = Field("", description="Layer of a WMS or WMTS.")
    key: SecretStr | None = Field(None, description="Key; better kept in the environment.")
    key_parameter: str = Field("", description="Query name of the key (WMS, WMTS).")
    rate_per_s: PositiveFloat | None = Field(None, description="Requests per second at most.")
    date: str | None = Field(None, description="When the imagery was taken.")
    headers: dict[str, SecretStr] = Field({}, description="Sent with each request.")


class ImagerySettings(Section):
    """Stage 1: the picture."""

    size_m: PositiveFloat | None = Field(
        None,
        description="Side of the window read around the point, metres; all of a small picture "
        "without. It grows until it shows the field.",
        json_schema_extra={"option": "--size-m"},
    )
    bands: Annotated[tuple[str, ...] | None, BeforeValidator(words)] = Field(
        None,
        description="What the picture's bands show, in order: red, green, blue, nir, grey, other.",
    )
    crs: str | None = Field(
        None, description="CRS of a picture that does not say its own, e.g. EPSG:32633."
    )


class FetchSettings(Section):
    """Getting imagery from servers; it does not change the result, so products do not keep it."""

    threads: int = Field(16, ge=1, le=64, description="Tiles fetched at once.")
    cache_dir: str | None = Field(
        None,
        description="Folder of the tile caches; the user's cache folder by default.",
    )
    cache_max_mb: PositiveFloat = Field(
        2048.0,
        description="Tiles kept per source at most, megabytes.",
    )
    cache_max_days: PositiveFloat = Field(90.0, description="Tiles are fetched anew after, days.")
    allow: tuple[str, ...] = Field(
        (),
        description="Folder or address that a VRT, tile index, STAC file, capabilities document "
        "or redirect may lead to; repeat for several.",
    )
    keys: dict[str, SecretStr] = Field(
        {}, description="Keys by source name; GEOFIELD_KEY_NAME in the environment wins."
    )
    sources: dict[str, SourceSettings] = Field(
        {},
        description="Sources of your own, by name: [fetch.sources.NAME] in the settings file.",
    )
