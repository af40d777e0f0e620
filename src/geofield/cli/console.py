"""What commands show: a person gets bars and tables on stderr, a program lines of JSON there.

Data goes to stdout. With ``--progress json`` each line of stderr that is a JSON object tells a
program one thing: ``{"progress": {"done": 1, "total": 4, "what": "field"}}``, ``{"note": "..."}``
or, at the end, ``{"error": {"message": "...", "hint": "..."}}``. Other lines are for a person.
"""

from __future__ import annotations

import atexit
import json
import logging
import math
import os
import signal
import stat
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import click

#: Called with (done, total, what), and facts for programs by name.
Progress = Callable[..., None]

_PROGRAM_WATCHES = False
#: When this command was asked to stop, seconds.
_STOPS: list[float] = []
#: Programs say a stop in two ways at once, as they may not know which one is heard.
_SAME_STOP_S = 1.0
_LOG = logging.getLogger("geofield.cli")
_LOG.addHandler(logging.NullHandler())


def echo_json(value: Mapping[str, Any] | list[Any]) -> None:
    """Data for other programs: one JSON document on stdout."""
    click.echo(json.dumps(value, indent=2, ensure_ascii=False, default=str))


def say(message: str) -> None:
    """A line for the person, on stderr."""
    _LOG.info(message)
    click.echo(message, err=True)


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


def stop_cleanly() -> None:
    """Let SIGTERM end the work as Ctrl+C does: files half written are taken away first."""
    if threading.current_thread() is threading.main_thread():
        _STOPS.clear()
        for kind in (signal.SIGINT, signal.SIGTERM):
            signal.signal(kind, _stop)
        atexit.register(_stop_no_more)


def _stop(*_: Any) -> None:
    now_s = time.monotonic()
    if _STOPS and now_s - _STOPS[-1] < _SAME_STOP_S:
        return  # said twice; what it leaves is being taken away
    _STOPS.append(now_s)
    sys.unraisablehook = _stop_again
    sys.excepthook = _say_no_stop
    raise KeyboardInterrupt


def _say_no_stop(kind: type[BaseException], error: BaseException, trace: Any) -> None:
    """A library's C code that is loaded while a stop comes prints it, then fails to load."""
    if not issubclass(kind, KeyboardInterrupt):
        sys.__excepthook__(kind, error, trace)


def _stop_again(unheard: Any) -> None:
    """A stop that came where Python passes over it, as in a destructor, comes once more."""
    if not issubclass(unheard.exc_type, KeyboardInterrupt):
        return
    _STOPS.append(-math.inf)
    again = threading.Timer(0.05, _interrupt)
    again.daemon = True
    again.start()


def was_stopped() -> bool:
    """Whether a stop came: a library that was calling back may have made another error of it."""
    return bool(_STOPS)


def _interrupt() -> None:
    """Ctrl+C for the main thread itself, so that it also wakes from waiting for a server."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        signal.raise_signal(signal.SIGINT)


def _stop_no_more() -> None:
    """All is written and said, only Python itself is taken down: there is nothing to stop."""
    for kind in (signal.SIGINT, signal.SIGTERM):
        signal.signal(kind, signal.SIG_IGN)


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
        _interrupt()

    threading.Thread(target=wait, name="stdin", daemon=True).start()


def _tell(value: Mapping[str, Any]) -> None:
    print(json.dumps(value, ensure_ascii=False, default=str), file=sys.stderr, flush=True)  # noqa: T201


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
