"""``geofield tiles``: stage 1 alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from geofield.cli.console import echo_json, progress_bar, say_note
from geofield.cli.degrees import Degrees
from geofield.cli.files import FOLDER, OLD_FILE, claim_folder, output_option
from geofield.cli.options import Number, acknowledge_option, stage_options

if TYPE_CHECKING:
    from geofield.imagery import Where
    from geofield.settings import Settings


#: What only sources of tiles take.
_OF_TILES = ("zoom", "resolution_m", "whole_tiles", "missing", "layer")
#: And what only pictures take.
_OF_PICTURES = ("imagery__crs", "imagery__bands")


class ZoomType(click.ParamType):  # type: ignore[type-arg]  # generic from click 8.4 on
    """A zoom, or the words max and fit."""

    name = "zoom"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """A number, ``max`` or ``fit``."""
        if value in ("max", "fit") or isinstance(value, int):
            return value
        try:
            return int(value)
        except ValueError:
            self.fail(f"{value!r} is no zoom: give a number, max or fit.", param, ctx)


@click.command(
    epilog="""\b
Examples (the first one on the project's own sample):
  geofield tiles sample_data/field_1.tif --lat 35.075373 --lon 33.531142 --size-m 150 -o cut.tif
  geofield tiles naip --lat 34.0165 --lon -117.3340 --zoom 18 --size 640 -o scene.tif
  geofield tiles netherlands --lat 52.32 --lon 5.52 --size-m 800 --resolution 0.3 -o field.tif
  geofield tiles 'https://tiles.example.org/{z}/{x}/{y}.png' --area farm.gpkg --zoom max -o farm.tif
  geofield tiles survey.mbtiles --lat 47.1 --lon 15.4 -o scene.tif
  geofield tiles orthophotos/ --lat 47.1 --lon 15.4 --size-m 600 -o scene.tif
"""
)
@click.argument("source")
@click.option("--lat", type=Degrees("NS"), help="Latitude of the centre.")
@click.option("--lon", type=Degrees("EW"), help="Longitude of the centre.")
@click.option(
    "--area",
    type=OLD_FILE,
    help="Vector file whose extent is fetched, instead of a square around a point.",
)
@click.option(
    "--zoom",
    type=ZoomType(),
    help="Zoom of tiled sources: a number, max, or fit (the largest at which --size-m or --area "
    "fits 640 px); by default as --resolution needs.",
)
@click.option(
    "--resolution",
    "resolution_m",
    type=Number(min=0, min_open=True),
    default=0.6,
    show_default=True,
    help="Wanted metres per pixel on the ground, when no zoom is given.",
)
@click.option(
    "--size", "size_px", type=click.IntRange(1), help="Side of the square, pixels.  [default: 640]"
)
@click.option(
    "--size-m",
    type=Number(min=0, min_open=True),
    help="Side of the square, metres on the ground.",
)
@click.option("--whole-tiles", is_flag=True, help="Keep the touched tiles whole.")
@click.option("--layer", default="", help="Layer of a WMS or WMTS.")
@click.option(
    "--missing",
    type=click.Choice(["error", "mask"]),
    default="error",
    show_default=True,
    help="What to do about tiles that cannot be had: stop, or leave no-data.",
)
@click.option("--offline", is_flag=True, help="Work from the tile cache alone.")
@click.option("--no-cache", is_flag=True, help="Neither read nor keep tiles.")
@click.option("--cache-dir", type=FOLDER, help="Folder of the tile caches.")
@click.option(
    "--crs", "imagery__crs", help="CRS of a picture that does not say its own, e.g. EPSG:32633."
)
@click.option(
    "--bands",
    "imagery__bands",
    help="What the picture's bands show, in order: red, green, blue, nir, grey, other.",
)
@acknowledge_option
@output_option("The GeoTIFF (COG) to write.")
@click.option("--overwrite", is_flag=True, help="Replace an existing file.")
@click.option("--json", "as_json", is_flag=True, help="Print what was made as JSON on stdout.")
@stage_options()
def tiles(
    source: str,
    lat: float | None,
    lon: float | None,
    area: Path | None,
    output: Path,
    layer: str,
    missing: Any,
    offline: bool,
    no_cache: bool,
    cache_dir: Path | None,
    acknowledge_terms: bool,
    overwrite: bool,
    as_json: bool,
    settings: Settings,
    **place: Any,
) -> None:
    """Get the picture of a place as a georeferenced GeoTIFF, from any source.

    SOURCE is the name of a source (see `geofield sources`), a tile address with {z}/{x}/{y},
    the address of a WMS, WMTS or GeoTIFF, a picture, a folder of pictures, an MBTiles or a STAC
    file. Keys are read from the environment (GEOFIELD_KEY_NAME) or the settings file.

    The picture is cut on the source's own pixels, so nothing is resampled and the georeference
    is exact. Tiles are kept in a cache where the source's terms allow it: an interrupted
    download goes on where it stopped.
    """
    from geofield.cli.imagery_tools import (
        cache_dir_of,
        describe,
        fetch_options,
        resolve,
        where_json,
    )
    from geofield.imagery import acquire
    from geofield.imagery.sources import PictureSource

    if output.suffix.lower() not in ("", ".tif", ".tiff"):
        raise click.BadParameter(
            f"{output} would be a GeoTIFF under another name: write NAME.tif.", param_hint="-o"
        )
    where = _where(lat, lon, area, place)
    folder = None if no_cache else cache_dir_of(settings, cache_dir)
    options = replace(
        fetch_options(settings, folder),
        offline=offline,
        missing=missing,
        acknowledged=acknowledge_terms,
    )
    if output.parent.is_dir():  # else it is told below
        claim_folder(output.parent, (output.name,))
    middle_lat, middle_lon = where.point
    found = resolve(
        source,
        settings,
        point=(middle_lon, middle_lat),
        layer=layer,
        offline=offline,
        options=options,
    )
    if is_picture := isinstance(found, PictureSource):
        found = replace(found, bands=settings.imagery.bands, crs=settings.imagery.crs)
    _tell_idle(is_picture, place["zoom"])
    with progress_bar(quiet=as_json) as progress:
        done = acquire(
            found, where, output, options=options, overwrite=overwrite, progress=progress
        )
    if as_json:
        echo_json(where_json(done))
    else:
        describe(done)


def _tell_idle(is_picture: bool, zoom: int | str | None) -> None:
    """Tell which options that were given change nothing with a picture, or with tiles."""
    context = click.get_current_context()
    given = [
        each
        for each in context.command.params
        if context.get_parameter_source(each.name or "") is ParameterSource.COMMANDLINE
    ]
    for option in given:
        if is_picture and option.name in _OF_TILES:
            say_note(f"{option.opts[0]} changes nothing here: a picture is cut on its own pixels.")
        elif not is_picture and option.name in _OF_PICTURES:
            say_note(f"{option.opts[0]} changes nothing here: tiles say it themselves.")
        elif option.name == "resolution_m" and zoom is not None:
            say_note("--resolution changes nothing beside --zoom, which stands instead of it.")


def _where(lat: float | None, lon: float | None, area: Path | None, place: dict[str, Any]) -> Where:
    from geofield.cli.imagery_tools import area_of
    from geofield.imagery import Where

    if area is None and (lat is None or lon is None):
        raise click.UsageError("Give the place: --lat and --lon, or --area FILE.")
    if area is not None and (lat is not None or lon is not None):
        raise click.UsageError("Give --lat and --lon, or --area, not both.")
    if place["size_px"] is not None and place["size_m"] is not None:
        raise click.UsageError("Give the size in pixels (--size) or metres (--size-m), not both.")
    if area is not None:
        return replace(area_of(area), **place)
    return Where(lat=lat, lon=lon, **place)
