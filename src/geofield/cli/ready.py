"""``geofield ready``: a command line that is awake before it is known what it will be asked."""

from __future__ import annotations

import importlib
import json
import os

import click

from geofield.cli.main import cli
from geofield.errors import GeofieldError

#: What outline, obstacles and tracks need; loading it takes about as long as finding an outline.
_NEEDED = (
    "geofield.cli.field",
    "geofield.cli.obstacles",
    "geofield.cli.tracks",
    "geofield.pipeline",
    "geofield.field",
    "geofield.imagery",
    "geofield.obstacles",
    "geofield.plan_files",
    "geofield.formats.gpkg",
    "geofield.formats.gpkg_read",
    "geofield.tracks",
    "pyogrio",
)


@click.command(
    hidden=True,
    epilog="""\b
Example:
  echo '["info", "sample_data/field_1.gpkg"]' | geofield ready
""",
)
def ready() -> None:
    """Load what the stages need, then run the one command line that comes on standard input.

    It is a JSON list of words in one line; standard input is that command's own from then on.
    """
    for name in _NEEDED:
        importlib.import_module(name)
    line = _line()
    if not line:
        return
    try:
        words = json.loads(line)
    except ValueError:
        words = None
    if not isinstance(words, list) or not all(isinstance(word, str) for word in words):
        raise GeofieldError("The line is no JSON list of words.")
    code = cli.main(args=words, prog_name="geofield", standalone_mode=False)
    if isinstance(code, int) and code:
        raise click.exceptions.Exit(code)


def _line() -> bytes:
    """A line, and no byte after it: the rest belongs to the command."""
    line = bytearray()
    while (byte := os.read(0, 1)) and byte != b"\n":
        line += byte
    return bytes(line)
