"""``geofield formats``: what can be written and read, and what each format leaves out."""

from __future__ import annotations

import sys

import click

from geofield.cli.console import echo_json


@click.command(
    epilog="""\b
Example:
  geofield formats --json
"""
)
@click.option("--json", "as_json", is_flag=True, help="Print the table as JSON on stdout.")
def formats(as_json: bool) -> None:
    """List the formats with what each can and cannot carry."""
    from geofield import schema
    from geofield.formats import FORMATS

    required = [layer.name for layer in schema.LAYERS if not layer.optional]
    if as_json:
        echo_json(
            [
                {
                    "name": each.name,
                    "title": each.title,
                    "files": list(each.files),
                    "layers": list(each.layers),
                    "drops": [str(drop) for drop in each.drops],
                    "import": each.reader is not None,
                    "precision_m": each.precision_m,
                    "crs": each.crs,
                    "options": list(each.options),
                }
                for each in FORMATS.values()
            ]
        )
        return
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for heading in ("Format", "What it is", "Read", "Carries", "Leaves out"):
        table.add_column(heading, overflow="fold", no_wrap=heading == "Format")
    for each in FORMATS.values():
        missing = [name for name in required if name not in each.layers]
        table.add_row(
            each.name,
            each.title,
            _reading(each.reader, each.precision_m),
            "all layers" if not missing else ", ".join(n for n in required if n in each.layers),
            "; ".join([*(name.replace("_", " ") for name in missing), *map(str, each.drops)])
            or "nothing",
        )
    # To a pipe the table is as wide as it needs to be: nothing is cut.
    width = None if sys.stdout.isatty() else 200
    Console(width=width, highlight=False).print(table)


def _reading(reader: str | None, precision_m: float | None) -> str:
    if reader is None:
        return "no"
    if not precision_m:
        return "yes, exact"
    if precision_m < 0.001:
        return f"yes, {precision_m * 1e6:.0f} µm" if precision_m < 1e-4 else "yes, < 1 mm"
    return f"yes, {precision_m * 1000:.0f} mm"
