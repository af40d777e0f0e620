"""Options of files that fields come from: parcels for the boundary of one, places for many."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from geofield.cli.console import say_note
from geofield.cli.files import OLD_PATH, Command
from geofield.errors import FieldError, FormatError

if TYPE_CHECKING:
    from geofield.farm.places import Places
    from geofield.model import Field
    from geofield.settings import Settings

_COLUMNS = ("id", "name", "lat", "lon")


def boundary_options(command: Command) -> Command:
    """Add ``--boundary``, ``--boundary-layer`` and ``--boundary-name``."""
    name = click.option("--boundary-name", help="Take the parcel of this name or id instead.")
    layer = click.option("--boundary-layer", help="Layer of --boundary, where it has several.")
    parcels = click.option(
        "--boundary",
        type=OLD_PATH,
        help="Your own parcels (any vector file, any CRS): the only one is taken, or the one with "
        "the point.",
    )
    return parcels(layer(name(command)))


def parcel_and_point(
    path: Path | None, layer: str | None, name: str | None, lat: float | None, lon: float | None
) -> tuple[Field | None, float, float]:
    """The user's own parcel from any vector file, None without one, and a point in the field."""
    if path is None:
        if layer or name:
            given = "--boundary-layer" if layer else "--boundary-name"
            raise click.UsageError(f"{given} is of a file of parcels: name it with --boundary.")
        if lat is None or lon is None:
            raise _missing(lat)
        return None, lat, lon
    if (lat is None) != (lon is None):
        raise _missing(lat)
    from geofield.crs import parse_crs
    from geofield.field import field_from_boundary
    from geofield.formats.antimeridian import joined
    from geofield.formats.catalogue import PARQUET
    from geofield.formats.foreign import has_rows, layer_names, read_vector
    from geofield.formats.gpkg_read import is_own
    from geofield.formats.raw_tables import CSV
    from geofield.formats.table_positions import read_table

    in_layers = path.suffix.lower() not in CSV
    alone = path.suffix.lower() in (*CSV, *PARQUET)
    try:
        layers = layer_names(path) if in_layers and layer is None and not is_own(path) else []
        if len(layers) > 1:
            layers = [each for each in layers if has_rows(path, each)] or layers[:1]
            layer = layers[0]
        if len(layers) > 1:
            say_note(
                f"{path.name}: of its layers {', '.join(layers)} the first is taken for the "
                "parcels; name another with --boundary-layer."
            )
        table = read_vector(path, layer) if in_layers else read_table(path, layer)
    except FormatError as error:
        of_layers = "`ogrinfo` shows the layers of a file; name one with --boundary-layer."
        of_file = alone or (layer is None and error.hint)
        raise FieldError(
            f"The boundary: {error.message}", hint=error.hint if of_file else of_layers
        ) from None
    if table.crs is not None:
        whole = joined(table.geometry.to_numpy(), parse_crs(table.crs))
        table = table.set_geometry(whole, crs=table.crs)
    parcel = field_from_boundary(table, lat=lat, lon=lon, name=name)
    if lat is None or lon is None:
        lon, lat = parcel.inside_lonlat
    return parcel, lat, lon


def _missing(lat: float | None) -> click.UsageError:
    return click.UsageError(f"Missing option '{'--lat' if lat is None else '--lon'}'.")


def place_options(command: Command) -> Command:
    """Add ``--layer``, ``--places-crs`` and the names of columns."""
    for name in reversed(_COLUMNS):
        command = click.option(
            f"--{name}-column",
            help=f"Column of PLACES with the {name}; usual names are found.",
        )(command)
    command = click.option(
        "--places-crs", help="CRS of files that do not say theirs, e.g. EPSG:32633."
    )(command)
    return click.option("--layer", help="Layer of PLACES, where it has several.")(command)


def places_of(path: Path, settings: Settings, options: Mapping[str, Any]) -> Places:
    """The places of a file; what there is to say of them is said."""
    from geofield.farm.place_reader import read_places

    places = read_places(
        path,
        settings=settings,
        layer=options.get("layer"),
        crs=options.get("places_crs"),
        **{f"{name}_column": options.get(f"{name}_column") for name in _COLUMNS},
    )
    return tell_places(places)


def tell_places(places: Places) -> Places:
    """Say what there is to say of places; those with the overlaps that each has."""
    from geofield.farm.places import overlaps

    for note in places.notes:
        say_note(note)
    told = overlaps(places)
    if told:
        first = next(iter(told))
        say_note(
            f"{len(told)} parcels overlap others, such as {places.names[first].as_py()}: it "
            f"{told[first]}. Each is planned as it is."
        )
    return replace(places, remarks=told)
