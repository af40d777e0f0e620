"""``--log FILE`` and ``--verbose``: what a command did and when, to look into later.

All that is told to the person stands in the log, too, with what is only of interest when something
went wrong: the command line, versions, each step with its time, and where an error came from.
"""

from __future__ import annotations

import logging
import re
import sys
import time
from pathlib import Path

import click

from geofield import __version__
from geofield.cli.files import FILE

#: Values in an address that are named like keys, and a name with its password before the server.
_SECRET = re.compile(
    r"(?i)([?&;][^=&\s]*(?:key|token|secret|password|auth|sig)[^=&\s]*=)[^&\s]+"
    r"|(?<=:/)/?[^/@\s]+(?=@)"
)
_STARTED = time.monotonic()
_LOGGER = logging.getLogger("geofield.cli")
_HANDLERS: list[logging.Handler] = []


def log_options() -> list[click.Parameter]:
    """The two options, the same for every command."""
    return [
        click.Option(
            ["--log", "log_file"],
            type=FILE,
            expose_value=False,
            is_eager=True,
            callback=_to_file,
            help="File to append what was done to, step by step: for a report of what went wrong.",
        ),
        click.Option(
            ["-v", "--verbose"],
            is_flag=True,
            expose_value=False,
            is_eager=True,
            callback=_to_stderr,
            help="Show the steps and where an error came from on stderr, too.",
        ),
    ]


def end_log() -> None:
    """Close what the options opened, at the end of a command."""
    if _HANDLERS:
        _LOGGER.debug("ended after %.2f s", time.monotonic() - _STARTED)
    while _HANDLERS:
        handler = _HANDLERS.pop()
        _LOGGER.removeHandler(handler)
        handler.close()


def _to_file(context: click.Context, _: click.Parameter, file: Path | None) -> None:
    if file is None or context.resilient_parsing:
        return
    try:
        if file.is_file() and not _is_log(file):
            raise click.BadParameter(f"{file} is there, and no log of geofield: name another.")
        handler = logging.FileHandler(file, encoding="utf-8")
    except OSError as error:
        raise click.BadParameter(f"{file} cannot be written: {error.strerror}.") from None
    handler.setFormatter(_Masked("%(asctime)s %(levelname)-7s %(message)s"))
    _add(handler)


def _is_log(file: Path) -> bool:
    """Whether lines may be appended to a file: a plan or a table would be damaged by them."""
    with file.open("rb") as stream:
        return re.match(rb"\d{4}-\d\d-\d\d |$", stream.read(11)) is not None


def _to_stderr(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if not wanted or context.resilient_parsing:
        return
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_SinceStart())
    # What is said to the person stands there already.
    handler.addFilter(lambda record: record.levelno == logging.DEBUG)
    _add(handler)


class _Masked(logging.Formatter):
    """Keys in addresses are nobody's business."""

    def format(self, record: logging.LogRecord) -> str:
        return _SECRET.sub(lambda found: f"{found.group(1) or ''}***", super().format(record))


class _SinceStart(_Masked):
    """Seconds since the command began, and the message."""

    def format(self, record: logging.LogRecord) -> str:
        return f"[{time.monotonic() - _STARTED:7.2f} s] {super().format(record)}"


def _add(handler: logging.Handler) -> None:
    _LOGGER.setLevel(logging.DEBUG)
    _LOGGER.propagate = False
    _LOGGER.addHandler(handler)
    _HANDLERS.append(handler)
    python = f"Python {sys.version.split()[0]}, {sys.platform}"
    text = f"geofield {__version__}, {python}, in {Path.cwd()}: geofield {' '.join(sys.argv[1:])}"
    handler.handle(_LOGGER.makeRecord(_LOGGER.name, logging.DEBUG, __file__, 0, text, (), None))
