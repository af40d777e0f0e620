"""``geofield review``: correct a plan on a page in the browser."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import TYPE_CHECKING

import click

from geofield.cli.console import say
from geofield.cli.farm import say_waiting
from geofield.cli.files import OLD_PATH
from geofield.cli.refresh import say_outdated
from geofield.cli.stops import stop_heard
from geofield.errors import GeofieldError

if TYPE_CHECKING:
    from geofield.review.shelf import Shelf


@click.command(
    epilog="""\b
Examples:
  geofield run sample_data/field_1.tif --lat 35.075373 --lon 33.531142 --out out/
  geofield review out/field.gpkg
  geofield review farm/
  geofield review out/field.gpkg --picture out/scene.tif --no-browser --port 8765
The page lists its keys when you press "?". Ctrl-C, or the page itself, ends the session.
"""
)
@click.argument("plan_file", metavar="PLAN", type=OLD_PATH)
@click.option(
    "--picture",
    type=OLD_PATH,
    help="Picture to show, or a folder of some; that beside PLAN by default.",
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=0,
    show_default=True,
    help="Port of the page; 0 takes a free one.",
)
@click.option("--no-browser", is_flag=True, help="Print the address, open nothing.")
def review(plan_file: Path, picture: Path | None, port: int, no_browser: bool) -> None:
    """Correct a plan on a page in the browser.

    Confirm or reject obstacles, add and move them, correct the outline, turn the tracks: they
    follow at once. PLAN is a GeoPackage of geofield, a folder with several, or a farm, whose
    fields come in the order of doubt. Saving writes into it; until then every edit lies in a
    journal beside it, and comes back when the session was killed.

    The page is served to this machine only, under an address that holds a key.
    """
    from geofield.review.plans import is_farm, is_plan, plans_in
    from geofield.review.server import ReviewServer

    # No browser is opened on nothing.
    if plan_file.is_dir() and not is_farm(plan_file):
        plans_in(plan_file)
    doubtful = plan_file.is_file() and not is_plan(plan_file)
    whole = _shelf(plan_file, picture) if doubtful else None
    try:
        server = ReviewServer(port)
    except OSError as error:
        raise GeofieldError(
            f"Port {port} cannot be used: {error.strerror}.", hint="Choose another --port."
        ) from error
    serving = threading.Thread(target=server.serve_forever, args=(0.2,), daemon=True)
    serving.start()
    click.echo(server.address)
    say("Open this address in a browser on this machine. Ctrl-C ends the session.")
    if not no_browser:
        import webbrowser

        webbrowser.open(server.address)
    shelf = server.load(lambda: whole or _shelf(plan_file, picture))
    if shelf.desk.brought_back:
        say(shelf.desk.brought_back)
    if is_farm(plan_file):
        say_waiting(plan_file)
    try:
        while serving.is_alive():  # waiting without end would hear no Ctrl-C on Windows
            serving.join(0.5)
    except KeyboardInterrupt:
        stop_heard()
        say("Ended.")
    finally:
        server.server_close()
    end_session(shelf, plan_file)


def end_session(shelf: Shelf, plan_file: Path) -> None:
    """Tell where edits are that were not saved; refuse to call it well where they are lost."""
    for words in shelf.end():
        say(words)
    if plan_file.is_file():
        say_outdated(plan_file)
    if shelf.lost:
        raise GeofieldError(
            "Edits of this session are lost: neither saved, nor noted on the disk.",
            hint="Make room, or close the other review of this plan, and make them again.",
        )


def _shelf(plan_file: Path, picture: Path | None) -> Shelf:
    """The plans, read while the browser already asks for the page."""
    from geofield.review.shelf import Shelf

    return Shelf(plan_file, picture)
