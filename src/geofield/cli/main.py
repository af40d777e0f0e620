"""The ``geofield`` command: finds subcommands by name and turns errors into exit codes.

Subcommands are imported only when they run, so that ``--help`` is quick.
"""

from __future__ import annotations

import atexit
import errno
import gc
import importlib
import io
import os
import re
import sys
import warnings
from contextlib import ExitStack
from typing import Any, NoReturn

import click

from geofield import __version__
from geofield.cli.console import progress_option, say_error, say_note
from geofield.cli.log import end_log, log_options
from geofield.cli.stops import stop_no_more, stoppable, was_stopped
from geofield.errors import GeofieldError, GeofieldWarning
from geofield.wording import nearest

#: Name, "module:function" and the one line of help, in the order of the work.
COMMANDS: dict[str, tuple[str, str]] = {
    "run": ("geofield.cli.run:run", "The main job: picture and point in, all products out."),
    "tiles": ("geofield.cli.tiles:tiles", "Stage 1: get imagery as a GeoTIFF."),
    "field": ("geofield.cli.field:field", "Stage 2: find the field's outline."),
    "obstacles": ("geofield.cli.obstacles:obstacles", "Stage 3: find the obstacles in it."),
    "tracks": ("geofield.cli.tracks:tracks", "Stage 4: plan the tracks to drive."),
    "batch": ("geofield.cli.batch:batch", "Many fields: plan a whole farm, here or on a cluster."),
    "farm": ("geofield.cli.farm:farm", "Take a plan out of a farm, or put it back reviewed."),
    "review": ("geofield.cli.review:review", "Correct a plan on a page in the browser."),
    "undo": ("geofield.cli.undo:undo", "Bring back the plan before the last run."),
    "live": ("geofield.cli.live:live", ""),  # for programs: not in the list that people see
    "ready": ("geofield.cli.ready:ready", ""),
    "refresh": ("geofield.cli.refresh:refresh", "Write all products beside a plan anew."),
    "export": ("geofield.cli.export:export", "Write other formats from a plan."),
    "import": ("geofield.cli.import_:import_", "Read other programs' boundaries and lines."),
    "validate": ("geofield.cli.validate:validate", "Check products against their formats."),
    "query": ("geofield.cli.query:query", "Ask linked data."),
    "info": ("geofield.cli.info:info", "Show what a file holds."),
    "settings": ("geofield.cli.settings:settings", "List the settings and what they mean."),
    "formats": ("geofield.cli.formats:formats", "List the formats and what each carries."),
    "sources": ("geofield.cli.sources:sources", "List imagery sources and their terms."),
    "cache": ("geofield.cli.cache:cache", "Look at the tile cache, or clear it."),
    "evaluate": ("geofield.cli.evaluate:evaluate", "Compare obstacles with a truth."),
    "doctor": ("geofield.cli.doctor:doctor", "Show versions and what looks wrong."),
    "simulate": ("geofield.cli.simulate:simulate", "Make synthetic fields with known truth."),
}


class LazyGroup(click.Group):
    """A group that imports a subcommand when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of the work."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The subcommand of a name."""
        if cmd_name not in COMMANDS:
            return None
        module, _, function = COMMANDS[cmd_name][0].partition(":")
        command: click.Command = getattr(importlib.import_module(module), function)
        if all(each.name != "progress" for each in command.params):
            # After the command's own options, before --help, which click adds.
            command.params += [progress_option(), *log_options()]
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """As in click, with a suggestion for a mistyped name."""
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            hint = nearest(args[0], COMMANDS) or " See `geofield --help`."
            raise click.UsageError(f"There is no command {args[0]!r}.{hint}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list of commands, without importing any."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items() if text])


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="""\b
Examples (on the project's own sample):
  geofield run sample_data/field_1.tif --lat 35.075373 --lon 33.531142 --spacing 4 --out out/
  geofield tracks out/field.gpkg --spacing 6 -o wider.gpkg
""",
)
@click.version_option(__version__, prog_name="geofield")
def cli() -> None:
    """From a point in a farm field and a picture of it to drivable geodata.

    The field's outline, the obstacles in it and the tracks to drive, as files that QGIS,
    geopandas and farm terminals open.
    """


def _show_warning(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
    if issubclass(category, GeofieldWarning):
        say_note(str(message))


#: What the system says of a path that a person named.
_NOT_OURS = (
    errno.EACCES, errno.EPERM, errno.EROFS, errno.ENAMETOOLONG, errno.ELOOP, errno.EIO,
    errno.ENOTDIR,
)  # fmt: skip
_NO_NUMBER = re.compile(r"'(.*)' is not a valid (float|integer)(?: range)?\.")


def _as_number(found: re.Match[str]) -> str:
    """What click says of a value that is no number, with how one is written."""
    given, kind = found.groups()
    if kind == "integer":
        return f"{given!r} is no whole number, such as 4."
    digits = re.fullmatch(r"(-?\d+)(?:[.,](\d+))?\s*m?", given)
    if digits is None:
        return f"{given!r} is no number, such as 4.5."
    return f"{given!r} is no number: write {'.'.join(filter(None, digits.groups()))}."


def _end_stopped() -> NoReturn:
    stop_no_more()
    click.echo("Stopped; nothing half-written is left.", err=True)
    sys.exit(1)


def _end_if_known(error: Exception) -> None:
    """End with a message where an error is one of our own, or has a plain reason."""
    if was_stopped():
        # A library that was calling back makes an error of its own of a stop.
        _end_stopped()
    if isinstance(error, GeofieldError):
        say_error(error.message, error.hint)
        sys.exit(error.exit_code)
    if isinstance(error, FileNotFoundError) and error.filename is None:
        say_error("The folder that this was started in is gone.", "Change to another: cd FOLDER")
        sys.exit(1)
    if isinstance(error, OSError) and error.errno == errno.ENOSPC:
        place = error.filename or "what was printed has no room"
        say_error(f"The disk is full: {place}.", "Free some space, then repeat.")
        sys.exit(1)
    if isinstance(error, OSError) and error.errno in _NOT_OURS:
        place = error.filename or "What was named"
        say_error(f"{place}: {error.strerror}.", "Name a file or folder you may use.")
        sys.exit(1)


def _refuse_bytes(words: list[str]) -> None:
    """Refuse what is no text: no library opens such a file, and no format holds such a name."""
    for word in words:
        try:
            word.encode()
        except UnicodeEncodeError:
            raise click.UsageError(
                f"{os.fsencode(word)!r} is no UTF-8: rename the file, or set LC_ALL=C.UTF-8."
            ) from None


def _open_streams(*, own: bool) -> None:
    """Streams that the caller closed lead nowhere; those of our `own` process take all letters.

    Otherwise a file that is opened next takes their number, and what is printed goes into it.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115
    if own and isinstance(sys.stdout, io.TextIOWrapper):
        # A letter that the code page of a pipe on Windows lacks ends no work, as on stderr.
        sys.stdout.reconfigure(errors="backslashreplace")


def main(args: list[str] | None = None) -> None:
    """Run the command line; exit code 0 done, 1 failed with a message, 2 wrong usage.

    Parameters
    ----------
    args : list of str, optional
        The words behind ``geofield``, from a program that goes on afterwards; without them those
        that this process was started with, which ends.
    """
    try:
        _run(args)
    except SystemExit as stop:
        if args is None and isinstance(stop.code, int):
            _leave(stop.code)
        raise


def _leave(code: int) -> None:
    """End the process when all is done, without taking libraries apart.

    One that is taken apart while a thread of its own still runs may abort the process: all would
    be written and told, and the exit code of a fault given.
    """
    try:
        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
    except (OSError, ValueError):
        return  # Python says what it could not write
    os._exit(code)


def _run(args: list[str] | None) -> None:
    """Run the command line; always leaves by an exception."""
    # What libraries make while they load stays to the end: going through it is 7 % of a start.
    gc.set_threshold(10_000)
    _open_streams(own=args is None)
    # OpenBLAS's threads spin for 25 ms behind every product of matrices that small; it is told
    # before NumPy loads it.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with ExitStack() as around:
        around.enter_context(warnings.catch_warnings())
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", GeofieldWarning)
        warnings.showwarning = _show_warning
        around.callback(end_log)
        around.enter_context(stoppable(whole_process=args is None))
        try:
            _refuse_bytes(sys.argv[1:] if args is None else args)
            # Not standalone, click hands the code of `context.exit` back instead of leaving.
            code = cli.main(args=args, prog_name="geofield", standalone_mode=False)
            sys.exit(code if isinstance(code, int) else 0)
        except click.exceptions.Exit as stop:
            sys.exit(stop.exit_code)
        except click.ClickException as error:
            # Final for click, which has no door for its words.
            vars(error).update(message=_NO_NUMBER.sub(_as_number, error.message))
            error.show()
            sys.exit(error.exit_code)
        except (click.Abort, KeyboardInterrupt):
            _end_stopped()
        except Exception as error:
            _end_if_known(error)
            raise
