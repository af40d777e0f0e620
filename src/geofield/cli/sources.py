"""``geofield sources``: the imagery known by name, and its terms."""

from __future__ import annotations

from typing import Any

import click

from geofield.cli.console import echo_json, say
from geofield.cli.options import settings_option
from geofield.settings import Settings


@click.command(
    epilog="""\b
Examples:
  geofield sources
  geofield sources --json
  geofield tiles switzerland --lat 46.95 --lon 7.44 -o bern.tif

\b
A source of your own, in geofield.toml:
  [fetch.sources.county]
  url = "https://tiles.example.org/ortho/{z}/{x}/{y}.jpg?token={key}"
  attribution = "Example County"
  licence = "CC BY 4.0"
  may_derive = true
  may_cache = true
  max_zoom = 20
Its key goes into the environment as GEOFIELD_KEY_COUNTY.
"""
)
@click.option("--json", "as_json", is_flag=True, help="Print the sources as JSON on stdout.")
@settings_option
def sources(as_json: bool, settings: Settings) -> None:
    """List the imagery sources known by name: terms, attribution, zooms.

    The imagery of others comes on terms: keep to them, and name the source in what you make.
    """
    from geofield.cli.imagery_tools import catalogue_of, keys_of

    catalogue = catalogue_of(settings)
    keys = keys_of(settings, catalogue)
    rows = [_row(name, entry, has_key=name in keys) for name, entry in sorted(catalogue.items())]
    if as_json:
        echo_json(rows)
        return
    for row in rows:
        key = ""
        if row["needs_key"]:
            key = ", key found" if row["has_key"] else f", needs a key ({row['key_variable']})"
        click.secho(row["name"], bold=True, nl=False)
        click.echo(f"  {row['title']}" + (f" · {row['region']}" if row["region"] else ""))
        click.echo(f"    {row['kind']}, zoom {row['min_zoom']} to {row['max_zoom']}{key}")
        terms = "; ".join(part for part in (row["attribution"], row["licence"]) if part)
        click.echo(f"    {terms or 'no terms given'}")
        allowed = "deriving geodata: " + ("yes" if row["may_derive"] else "FORBIDDEN by its terms")
        allowed += "; keeping tiles: " + ("yes" if row["may_cache"] else "no")
        click.echo(f"    {allowed}" + (f"  {row['terms_url']}" if row["terms_url"] else ""))
    say(
        "\nAlso any picture or folder of pictures, MBTiles and STAC files, and the addresses of "
        "tiles, WMS, WMTS and GeoTIFFs."
    )


def _row(name: str, entry: Any, *, has_key: bool) -> dict[str, Any]:
    from geofield.imagery.sources.xyz import key_variable

    return {
        "name": name,
        "kind": entry.kind,
        "title": entry.title,
        "region": entry.region,
        "min_zoom": entry.min_zoom,
        "max_zoom": entry.max_zoom,
        "attribution": entry.terms.attribution,
        "licence": entry.terms.licence,
        "may_derive": entry.terms.may_derive,
        "may_cache": entry.terms.cacheable,
        "terms_url": entry.terms.url,
        "needs_key": entry.needs_key,
        "has_key": has_key,
        "key_variable": key_variable(name),
    }
