"""The command for tests: each call has a process, an environment and streams of its own.

Most of a short command's time goes to loading libraries, which is done once here. Tests of how the
command starts, is stopped, or uses what it was started with start it from nothing.
"""

from __future__ import annotations

import atexit
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from forks import Forks

_PROGRAM = Path(__file__).with_name("forked_command.py")
_ASKS = Path(__file__).with_name("asked_command.py")
#: Variables that are read when they are needed, never while a library loads.
_READ_LATE = ("GEOFIELD_", "PYTEST_", "XDG_", "HOME")
_FORKS: list[Forks] = []


@atexit.register
def _end() -> None:
    for each in _FORKS:
        each.end()
    _FORKS.clear()


def _forks(environment: Mapping[str, str]) -> Forks:
    """Those whose libraries were loaded as a process with this environment loads them."""
    for each in _FORKS:
        other = {name for name, _ in each.environment.items() ^ environment.items()}
        if each.are_alive and all(name.startswith(_READ_LATE) for name in other):
            return each
    _end()
    _FORKS.append(Forks([sys.executable, str(_PROGRAM)], environment))
    return _FORKS[0]


def run_geofield(
    *words: object,
    check: bool = False,
    folder: Path | None = None,
    without: Sequence[str] = (),
    timeout_s: float = 300,
) -> subprocess.CompletedProcess[str]:
    """Run the command in the environment of the test, as `subprocess.run` would.

    Parameters
    ----------
    words : object
        What stands behind ``geofield``.
    check : bool
        Whether it has to succeed.
    folder : Path, optional
        Where it runs.
    without : sequence of str
        Modules that are not installed there.
    timeout_s : float
        It may not take longer.
    """
    environment = dict(os.environ)
    done = _forks(environment).run(
        [str(word) for word in words],
        folder=folder,
        environment=environment,
        without=without,
        timeout_s=timeout_s,
    )
    if check:
        assert done.returncode == 0, done.stderr
    return done


def asking() -> list[str]:
    """A program that stands for the command, loaded once, in shells and for processes that go on.

    It ends as the command does and hands signals on, but for a kill.
    """
    return [sys.executable, "-ES", str(_ASKS), _forks(dict(os.environ)).address]
