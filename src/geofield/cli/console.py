"""What commands show: a person gets bars and tables on stderr, a program lines of JSON there.

Data goes to stdout. With ``--progress json`` each line of stderr that is a JSON object tells a
program one thing: ``{"progress": {"done": 1, "total": 4, "what": "field"}}``, ``{"note": "..."}``
or, at the end, ``{"error": {"message": "...", "hint": "..."}}``. Other lines are for a person.
JSON is ASCII: a program reads it right whatever code page Windows gives a pipe.
"""

from __future__ import annotations

import json
import logging
import math
import os
import stat
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import click

from geofield.cli.stops import stop_main

#: Called with (done, total, what), and facts for programs by name.
Progress = Callable[..., None]

_PROGRAM_WATCHES = False
_LOG = logging.getLogger("geofield.cli")
_LOG.addHandler(logging.NullHandler())


def echo_json(value: Mapping[str, Any] | list[Any]) -> None:
    """Data for other programs: one JSON document on stdout."""
    click.echo(json.dumps(_plain(value), indent=2, default=str, allow_nan=False))


def _plain(value: Any) -> Any:
    """A value in which what is no finite number, for which JSON has no word, is null."""
    if isinstance(value, Mapping):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def say(message: str, **style: Any) -> None:
    """A line for the person, on stderr; `style` is click's, as in ``fg="yellow"``."""
    _LOG.info(message)
    click.secho(message, err=True, **style)


def say_note(message: str) -> None:
    """Something that the person should know, though the work went on."""
    _LOG.warning(message)
    if _PROGRAM_WATCHES:
        _tell({"note": message})
    else:
        click.secho(f"Note: {message}", fg="yellow", err=True)


def say_error(message: str, hint: str | None) -> None:
    """Why the work failed, and what can be done."""
    _LOG.error("%s %s", message, hint or "")
    _LOG.debug("where it came from:", exc_info=True)
    if _PROGRAM_WATCHES:
        _tell({"error": {"message": message, "hint": hint or ""}})
        return
    click.secho(f"Error: {message}", fg="red", err=True)
    if hint:
        click.echo(hint, err=True)


def progress_option() -> click.Option:
    """``--progress bar|json``, the same for every command."""
    return click.Option(
        ["--progress"],
        type=click.Choice(["bar", "json"]),
        default="bar",
        expose_value=False,
        is_eager=True,
        callback=_choose_progress,
        help="json: lines of JSON on stderr for a program, which stops the work by closing stdin.",
    )


def _choose_progress(context: click.Context, _: click.Parameter, value: str) -> None:
    global _PROGRAM_WATCHES  # noqa: PLW0603 - one process runs one command
    _PROGRAM_WATCHES = value == "json"
    if _PROGRAM_WATCHES and not context.resilient_parsing and context.info_name != "live":
        _watch_stdin()


def _watch_stdin() -> None:
    """Stop when the pipe from the program that started us ends: Windows sends no signals."""
    try:
        watched = stat.S_ISFIFO(os.fstat(0).st_mode)
    except OSError:
        return  # no stdin at all
    if not watched:
        return

    def wait() -> None:
        while os.read(0, 4096):
            pass
        stop_main()

    threading.Thread(target=wait, name="stdin", daemon=True).start()


def _tell(value: Mapping[str, Any]) -> None:
    click.echo(json.dumps(value, default=str), err=True)


@contextmanager
def progress_bar(*, quiet: bool = False) -> Iterator[Progress]:
    """A callback that draws a progress bar on stderr, or tells a program how far the work is."""
    with _progress(quiet=quiet) as shown:
        last = ""

        def show(done: int, total: int, what: str, **facts: Any) -> None:
            nonlocal last
            if what != last or done == total:
                _LOG.debug("%s: %d of %d", what, done, total)
            last = what
            shown(done, total, what, **facts)

        yield show


@contextmanager
def _progress(*, quiet: bool) -> Iterator[Progress]:
    if _PROGRAM_WATCHES:
        yield lambda done, total, what, **facts: _tell(
            {"progress": {"done": done, "total": total, "what": what, **facts}}
        )
        return
    if quiet or not sys.stderr.isatty():
        yield lambda done, total, what, **facts: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)

        def show(done: int, total: int, what: str, **_: Any) -> None:
            bar.update(task, completed=done, total=total or None, description=what)

        yield show
