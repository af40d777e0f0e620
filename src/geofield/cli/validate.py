"""``geofield validate``: whether a product keeps the rules of its format, and its own."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

from geofield.cli.console import echo_json, say
from geofield.cli.files import OLD_PATH
from geofield.errors import FormatError
from geofield.wording import counted


@click.command(
    epilog="""\b
Examples (on the project's own sample):
  geofield validate sample_data/field_1.gpkg
  geofield export sample_data/field_1.gpkg --format isoxml --out export/
  geofield validate export/isoxml/TASKDATA/TASKDATA.XML --json
"""
)
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=OLD_PATH)
@click.option("--json", "as_json", is_flag=True, help="Print the findings as JSON on stdout.")
@click.pass_context
def validate(context: click.Context, files: tuple[Path, ...], as_json: bool) -> None:
    """Check each FILE, of any format: the format's rules, and whether the plan fits together.

    Exit code 1 when there is an error; warnings alone leave it at 0.
    """
    from geofield.formats import Finding, validate_file

    reports = {}
    for file in files:
        try:
            reports[str(file)] = validate_file(file)
        except FormatError as error:
            if len(files) == 1:
                raise
            # The others are checked all the same.
            told = f"{error.message} {error.hint or ''}".strip()
            reports[str(file)] = [Finding("error", "file", told)]
    failed = any(each.level == "error" for found in reports.values() for each in found)
    if as_json:
        echo_json({name: [asdict(each) for each in found] for name, found in reports.items()})
    else:
        for name, found in reports.items():
            say(f"{name}: {'no fault found' if not found else counted(len(found), 'finding')}")
            for each in found:
                say(f"  {each.level}: {each.where}: {each.message}")
    if failed:
        context.exit(1)
