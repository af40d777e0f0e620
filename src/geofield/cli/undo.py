"""``geofield undo``: the plan before the last run."""

from __future__ import annotations

from pathlib import Path

import click

from geofield.cli.console import say
from geofield.cli.files import plan_argument, tell_unsaved
from geofield.cli.refresh import say_outdated


@click.command(
    epilog="""\b
Examples (on the project's own sample):
  geofield run sample_data/field_1.tif --lat 35.075373 --lon 33.531142 --spacing 4 --out out/
  geofield tracks out/field.gpkg --spacing 6 -o out/field.gpkg
  geofield undo out/field.gpkg
"""
)
@plan_argument
def undo(plan_file: Path) -> None:
    """Bring back the plan that the last run or stage replaced, edits and all.

    It lies beside PLAN.gpkg as PLAN.gpkg.bak; the two change places, so that a second undo
    takes the first one back. Other products stay as they are: `geofield refresh` renews them.
    """
    from geofield.staging.generations import earlier_of, undo

    tell_unsaved(plan_file.parent, (plan_file.name,))
    undo(plan_file)
    say_outdated(plan_file)
    say(f"{plan_file} is the earlier plan again; the later one is {earlier_of(plan_file)}.")
