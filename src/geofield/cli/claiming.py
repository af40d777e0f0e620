"""A command claims what it is going to write, before it reads what is there."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import click

from geofield.claims import claimed


def claim_folder(folder: Path, names: Collection[str] | None = None) -> None:
    """Claim a folder, or some names in it, until the command ends.

    Raises
    ------
    OutputExistsError
        Another geofield works there.
    """
    click.get_current_context().with_resource(claimed(folder, names))


def claim_file(output: Path) -> None:
    """The same for one file."""
    claim_folder(output.parent, (output.name,))
