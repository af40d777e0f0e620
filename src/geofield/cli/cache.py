"""``geofield cache``: what is kept of tiles, and clearing it."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import click

from geofield.cli.console import echo_json, say
from geofield.cli.files import FOLDER
from geofield.cli.options import settings_option
from geofield.errors import ImageryError
from geofield.settings import Settings
from geofield.wording import counted

_folder = click.option("--cache-dir", type=FOLDER, help="Folder of the tile caches.")


@click.group(
    epilog="""\b
Examples:
  geofield cache info
  geofield cache clear naip
"""
)
def cache() -> None:
    """Look at the tile cache, or clear it.

    Each source has one MBTiles file, which QGIS opens as a layer.
    """


@cache.command(
    epilog="""\b
Example:
  geofield cache info --json
"""
)
@_folder
@click.option("--json", "as_json", is_flag=True, help="Print as JSON on stdout.")
@settings_option
def info(cache_dir: Path | None, as_json: bool, settings: Settings) -> None:
    """Say what is kept: sources, tiles, megabytes, dates."""
    from geofield.cli.imagery_tools import cache_dir_of
    from geofield.imagery.cache import cache_infos

    folder = cache_dir_of(settings, cache_dir)
    rows: list[dict[str, Any]] = [
        {
            "source": each.source,
            "path": str(each.path),
            "tiles": each.tiles,
            "megabytes": round(each.bytes / 1e6, 3),
            "zooms": each.zooms,
            "oldest": _day(each.oldest_s),
            "newest": _day(each.newest_s),
            "attribution": each.attribution,
        }
        for each in cache_infos(folder)
    ]
    if as_json:
        echo_json(rows)
        return
    if not rows:
        say(f"The tile cache {folder} is empty.")
        return
    for row in rows:
        zooms = f"zoom {row['zooms'][0]} to {row['zooms'][1]}, " if row["zooms"] else ""
        days = f"{row['oldest']} to {row['newest']}" if row["oldest"] else ""
        click.secho(row["source"], bold=True, nl=False)
        click.echo(f"  {counted(row['tiles'], 'tile')}, {row['megabytes']:.1f} MB, {zooms}{days}")
        click.echo(f"    {row['path']}")


@cache.command(
    epilog="""\b
Example:
  geofield cache clear --yes
"""
)
@click.argument("source", required=False)
@_folder
@click.option("--yes", is_flag=True, help="Do not ask.")
@settings_option
def clear(source: str | None, cache_dir: Path | None, yes: bool, settings: Settings) -> None:
    """Delete the tiles of SOURCE, or of all sources."""
    from geofield.cli.imagery_tools import cache_dir_of
    from geofield.imagery.cache import cache_infos, clear_cache

    folder = cache_dir_of(settings, cache_dir)
    names = [each.source for each in cache_infos(folder)]
    if source is None and names and not yes:
        click.confirm(
            f"Delete the tiles of {counted(len(names), 'source')} in {folder}?",
            abort=True,
            err=True,
        )
    gone = clear_cache(folder, source)
    if source is not None and not gone:
        raise ImageryError(
            f"The tile cache holds nothing of {source!r}.",
            hint=f"It holds: {', '.join(names) or 'nothing'}.",
        )
    say(f"Deleted {counted(len(gone), 'file')} in {folder}.")


def _day(seconds: int | None) -> str | None:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC).date().isoformat()
