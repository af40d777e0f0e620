"""Options of commands that read places, and the reading."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from geofield.cli.console import say_note

if TYPE_CHECKING:
    from geofield.farm.places import Places
    from geofield.settings import Settings

Command = TypeVar("Command", bound=Callable[..., Any])
_COLUMNS = ("id", "name", "lat", "lon")


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
    from geofield.farm.overlaps import overlaps
    from geofield.farm.place_reader import read_places

    places = read_places(
        path,
        settings=settings,
        layer=options.get("layer"),
        crs=options.get("places_crs"),
        **{f"{name}_column": options.get(f"{name}_column") for name in _COLUMNS},
    )
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
