"""``geofield refresh``: all products beside a plan, written anew."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from geofield.cli.console import echo_json, say
from geofield.cli.files import claim_folder, plan_argument
from geofield.wording import command

if TYPE_CHECKING:
    from geofield.plan import Plan


@click.command(
    epilog="""\b
Examples (on the project's own sample):
  geofield run sample_data/field_1.tif --lat 35.075373 --lon 33.531142 --spacing 4 --out out/
  geofield tracks out/field.gpkg --spacing 6 -o out/field.gpkg
  geofield refresh out/field.gpkg
"""
)
@plan_argument
@click.option("--json", "as_json", is_flag=True, help="Print the files as JSON on stdout.")
def refresh(plan_file: Path, as_json: bool) -> None:
    """Write all products anew that lie beside PLAN.gpkg: map, report, files of every format.

    After a stage, a review or an edit in QGIS they show the plan as it was before. The
    GeoPackage itself and the picture stay as they are.
    """
    from geofield.renewal import outdated, renew

    claim_folder(plan_file.parent)
    written = renew(plan_file)
    old = outdated(plan_file)
    if as_json:
        echo_json({"files": [str(path) for path in written], "outdated": old})
        return
    for path in written:
        say(str(path))
    if not written:
        say(f"There are no products beside {plan_file}: geofield export writes some.")
    if old:
        say(f"Still of an earlier plan, with nothing in this one: {', '.join(old)}")


def say_outdated(plan_file: Path) -> None:
    """Tell which products beside a plan are older than it, and how they are renewed."""
    from geofield.renewal import outdated

    old = outdated(plan_file)
    if old:
        renew = command("refresh", plan_file)
        say(f"Older than the plan: {', '.join(old)} (renew them: {renew})")


def say_removed(before: Plan | None, after: Plan, plan_file: Path) -> None:
    """Tell that a stage removed the tracks of a plan, and how they are planned again."""
    if before is not None and before.tracks is not None and after.tracks is None:
        again = command("tracks", plan_file, "-o", plan_file)
        say(f"Tracks removed: they no longer fit ({again})")
