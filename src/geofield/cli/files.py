"""Files and folders on the command line: kinds of paths, and the claim of what will be written."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any, TypeVar

import click

from geofield.staging import claimed

Command = TypeVar("Command", bound=Callable[..., Any])

PATH = click.Path(path_type=Path)
FILE = click.Path(dir_okay=False, path_type=Path)
FOLDER = click.Path(file_okay=False, path_type=Path)
#: What must be there.
OLD_PATH = click.Path(exists=True, path_type=Path)
OLD_FILE = click.Path(exists=True, dir_okay=False, path_type=Path)
plan_argument = click.argument("plan_file", metavar="PLAN.gpkg", type=OLD_FILE)


def output_option(help_text: str, kind: click.Path = FILE) -> Callable[[Command], Command]:
    """Add ``-o``, ``--output``, which must be given."""
    return click.option("-o", "--output", required=True, type=kind, help=help_text)


def claim_folder(folder: Path, names: Collection[str] | None = None) -> None:
    """Claim a folder, or some names in it, until the command ends, before it reads what is there.

    Raises
    ------
    OutputExistsError
        Another geofield works there.
    """
    click.get_current_context().with_resource(claimed(folder, names))


def claim_file(output: Path) -> None:
    """The same for one file."""
    claim_folder(output.parent, (output.name,))
