"""``geofield query``: ask linked data, with the queries that come with the package."""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import click

from geofield.cli.console import echo_json, say
from geofield.errors import FormatError, MissingFileError
from geofield.wording import counted, nearest


@click.command(
    epilog="""\b
Examples (on the project's own sample):
  geofield query --list
  geofield run sample_data/field_1.tif --lat 35.075373 --lon 33.531142 --spacing 4 --out out/
  geofield query out/field.rdf out/obstacles.rdf obstacles-larger-than --set radius=2.5
  geofield query out/tracks.rdf length-per-track --json
  geofield query length-per-track --show > my-own.rq
  geofield query out/tracks.rdf my-own.rq
"""
)
@click.argument("arguments", nargs=-1, metavar="FILE... NAME")
@click.option("--set", "values", multiple=True, metavar="NAME=VALUE", help="A parameter's value.")
@click.option("--list", "list_only", is_flag=True, help="The queries and their parameters.")
@click.option("--show", is_flag=True, help="The SPARQL itself, to paste into any store.")
@click.option("--json", "as_json", is_flag=True, help="As JSON on stdout; CSV otherwise.")
def query(
    arguments: tuple[str, ...], values: tuple[str, ...], list_only: bool, show: bool, as_json: bool
) -> None:
    """Answer a question from RDF files: a query of the package, or a file of SPARQL.

    Every FILE (RDF/XML, Turtle, N-Triples, JSON-LD) is merged into one graph first; NAME is a
    query of `--list`, or a file of SPARQL. GeoSPARQL functions (geof:distance,
    geof:sfWithin, ...) are available.
    """
    from geofield.formats.rdf.query import ask, open_store, queries

    known = queries()
    if list_only:
        for each in known.values():
            click.secho(each.name, bold=True)
            parameters = ", ".join(f"{n}={v}" for n, v in each.parameters.items())
            click.echo(f"  {each.description}{f' --set {parameters}' if parameters else ''}")
        return
    if not arguments or (len(arguments) < 2 and not show):
        raise click.UsageError("Give one or more files and a query; `geofield query --list`.")
    *files, name = arguments
    wanted = known.get(name)
    text = _own(name, list(known)) if wanted is None else ""
    if show:
        click.echo(wanted.sparql if wanted else text)
        return
    answer = ask(open_store(map(Path, files)), wanted or text, _pairs(values))
    if as_json:
        echo_json([dict(zip(answer.columns, row, strict=True)) for row in answer.rows])
    else:
        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerow(answer.columns)
        writer.writerows(answer.rows)
    say(f"{counted(len(answer.rows), 'answer')}.")


def _own(name: str, known: list[str]) -> str:
    path = Path(name)
    if path.suffix in (".rq", ".sparql") and path.is_file():
        try:
            return path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            raise FormatError(f"{name} is no text in UTF-8.", hint="Save it as UTF-8.") from None
    raise MissingFileError(
        f"There is no query {name!r}, and no file of SPARQL of that name.",
        hint=nearest(name, known).strip() or f"Queries: {', '.join(known)}.",
    )


def _pairs(values: tuple[str, ...]) -> dict[str, str]:
    pairs = {}
    for value in values:
        name, separator, text = value.partition("=")
        if not separator:
            raise click.UsageError(f"--set takes NAME=VALUE, not {value!r}.")
        pairs[name] = text
    return pairs
