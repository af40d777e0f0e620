"""The `geofield` command: where it is, whether it fits, and how it is run.

It runs as a process with an environment cleaned of what QGIS sets for its own Python, GDAL and
PROJ, and tells by lines of JSON how far it is. A command is stopped by closing its standard
input and by SIGTERM: it then takes away what it had half written.
"""

from __future__ import annotations

import configparser
import json
import os
import shutil
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Callable

from qgis.core import QgsApplication, QgsSettings
from qgis.PyQt.QtCore import QProcess, QProcessEnvironment

from .words import tr

#: Where a person named the command; empty when it is to be found.
SETTING = "geofield/engine"
#: What QGIS sets for itself and another Python must not see.
_QGIS_OWN = ("PYTHON", "PROJ_", "GDAL_", "QT_", "QML", "LD_LIBRARY_PATH", "LD_PRELOAD", "DYLD_")
#: How long a stopped command may clean up, milliseconds, before it is killed.
_STOP_MS = 2000


class EngineError(Exception):
    """The command is missing, does not fit, or said why its work failed."""


@dataclass
class Result:
    """What a command left behind.

    Attributes
    ----------
    data
        The JSON document of its standard output, or None.
    lines : list of str
        What it said for a person.
    """

    data: Any = None
    lines: list[str] = field(default_factory=list)


def plugin_version() -> str:
    """The version of this plugin, which is that of the engine it belongs to."""
    metadata = configparser.ConfigParser(interpolation=None)
    metadata.read(Path(__file__).with_name("metadata.txt"), encoding="utf-8")
    return metadata.get("general", "version")


def own_environment() -> Path:
    """The folder of the engine's own environment, in the user's profile."""
    return Path(QgsApplication.qgisSettingsDirPath()) / "geofield" / "engine"


def command_in(environment: Path) -> Path:
    """Where an environment keeps the command."""
    if sys.platform == "win32":
        return environment / "Scripts" / "geofield.exe"
    return environment / "bin" / "geofield"


def find_engine() -> str | None:
    """The command: the one set, the plugin's own, or the one on the PATH; None for none."""
    chosen = str(QgsSettings().value(SETTING, "") or "")
    if chosen:
        return chosen if Path(chosen).is_file() else None
    own = command_in(own_environment())
    return str(own) if own.is_file() else shutil.which("geofield")


def require_engine() -> str:
    """The command, fit for this plugin.

    Raises
    ------
    EngineError
        Saying in one sentence what to do.
    """
    command = find_engine()
    if command is None:
        raise EngineError(
            tr(
                "geofield's engine is not there: install it or name it under "
                "Plugins > geofield > Engine..."
            )
        )
    found = engine_version(command)
    if found.split(".")[:2] != plugin_version().split(".")[:2]:
        raise EngineError(
            tr(
                "The engine {command} is version {found}, but this plugin belongs to {wanted}: "
                "update it under Plugins > geofield > Engine..."
            ).format(command=command, found=found, wanted=plugin_version())
        )
    return command


_VERSIONS: dict[tuple[str, float], str] = {}


def engine_version(command: str) -> str:
    """The version of a command, asked once for each state of its file."""
    key = (command, Path(command).stat().st_mtime)
    if key not in _VERSIONS:
        words = answer_of(command, ["--version"])
        if not words:
            raise EngineError(
                tr(
                    "The engine {command} does not start: repair it under "
                    "Plugins > geofield > Engine..."
                ).format(command=command)
            )
        _VERSIONS[key] = words[-1]
    return _VERSIONS[key]


def answer_of(command: str, words: list[str], wait_ms: int = 60_000) -> list[str]:
    """What a short command answers, word by word; nothing where it fails."""
    process = QProcess()
    process.setProcessEnvironment(clean_environment())
    process.start(command, words)
    if not process.waitForStarted(wait_ms) or not process.waitForFinished(wait_ms):
        process.kill()
        return []
    answer = bytes(process.readAllStandardOutput()).decode("utf-8", "replace").split()
    return answer if process.exitCode() == 0 else []


def clean_environment(extra: dict[str, str | None] | None = None) -> QProcessEnvironment:
    """The environment of a command: the person's own, without what belongs to QGIS.

    An `extra` variable that is None is left out. The engine reads names in any case, so that one
    that is written otherwise gives way, too.
    """
    environment, extra = QProcessEnvironment(), extra or {}
    said = {name.upper() for name in extra}
    for name, value in os.environ.items():
        if name.upper() not in said and not name.upper().startswith(_QGIS_OWN):
            environment.insert(name, value)
    environment.insert("PYTHONUTF8", "1")
    environment.insert("PYTHONNOUSERSITE", "1")
    for name, value in extra.items():
        if value is not None:
            environment.insert(name, value)
    return environment


def run(
    words: list[str],
    *,
    is_cancelled: Callable[[], bool] = lambda: False,
    on_progress: Callable[[int, int, str], None] = lambda done, total, what: None,
    on_line: Callable[[str], None] = lambda line: None,
    environment: dict[str, str | None] | None = None,
    fine: tuple[int, ...] = (0,),
) -> Result:
    """Run a command to its end, in any thread.

    Parameters
    ----------
    words : list of str
        The command line after `geofield`.
    is_cancelled
        Asked several times a second; the command is stopped when it is true.
    on_progress
        Called with (done, total, what).
    on_line
        Called with what the command says for a person.
    environment : mapping, optional
        Further variables; None for one that does not count.
    fine : tuple of int
        Exit codes that are no failure.

    Raises
    ------
    EngineError
        In the command's own words.
    """
    process = QProcess()
    process.setProcessEnvironment(clean_environment(environment))
    process.start(require_engine(), [*words, "--progress", "json"])
    if not process.waitForStarted(30_000):
        raise EngineError(tr("The engine does not start: {0}").format(process.errorString()))
    reader = Reader(on_progress, on_line)
    while process.state() != QProcess.ProcessState.NotRunning:
        process.waitForReadyRead(100)
        reader.take(process)
        if is_cancelled():
            stop(process)
            raise EngineError(tr("Stopped; nothing half-written is left."))
    reader.take(process, last=True)
    crashed = process.exitStatus() != QProcess.ExitStatus.NormalExit
    if crashed or process.exitCode() not in fine or reader.failed:
        raise EngineError(reader.why(process.exitCode(), crashed))
    return reader.result()


def stop(process: QProcess) -> None:
    """End a command: as it likes to be asked first, by force when it does not listen."""
    if process.state() == QProcess.ProcessState.NotRunning:
        return
    process.closeWriteChannel()
    if sys.platform != "win32":
        process.terminate()
    end = time.monotonic() + _STOP_MS / 1000
    while process.state() != QProcess.ProcessState.NotRunning and time.monotonic() < end:
        process.waitForFinished(100)
    if process.state() != QProcess.ProcessState.NotRunning:
        process.kill()
        process.waitForFinished(_STOP_MS)


class Reader:
    """Takes what a command writes, as it comes: data whole, lines one by one."""

    def __init__(self, on_progress: Callable, on_line: Callable) -> None:
        self._on_progress, self._on_line = on_progress, on_line
        self._data = bytearray()
        self._rest = b""
        self._lines: list[str] = []
        self._error: dict[str, str] = {}

    def take(self, process: QProcess, *, last: bool = False) -> None:
        """Take what is there by now; at the end also a line without its end."""
        self._data += bytes(process.readAllStandardOutput())
        *lines, self._rest = (self._rest + bytes(process.readAllStandardError())).split(b"\n")
        if last and self._rest:
            lines.append(self._rest)
        for line in lines:
            self._hear(line.decode("utf-8", "replace").rstrip())

    def _hear(self, line: str) -> None:
        told = _as_object(line)
        if "progress" in told:
            progress = told["progress"]
            self._on_progress(progress["done"], progress["total"], progress["what"])
        elif "error" in told:
            self._error = told["error"]
        elif line:
            self._lines.append(tr(told.get("note", line)))
            self._on_line(self._lines[-1])

    @property
    def failed(self) -> bool:
        """Whether the command told an error, whatever its exit code."""
        return bool(self._error)

    def why(self, code: int, crashed: bool) -> str:
        """Why the command failed, in its own words."""
        if self._error:
            return said(self._error)
        last = " ".join(self._lines[-3:])
        if crashed or not last:
            ended = tr("The engine ended unexpectedly (code {0}).").format(code)
            return f"{ended} {last}".strip()
        return last

    def result(self) -> Result:
        """The data of a command that did its work."""
        text = self._data.decode("utf-8", "replace").strip()
        try:
            return Result(json.loads(text) if text else None, self._lines)
        except ValueError:
            return Result(None, [*self._lines, *text.splitlines()])


def said(error: Mapping[str, str]) -> str:
    """An error of the engine, with what to do."""
    return " ".join(tr(part) for part in (error["message"], error.get("hint")) if part)


def _as_object(line: str) -> dict[str, Any]:
    if line.startswith("{"):
        try:
            return dict(json.loads(line))
        except ValueError:
            return {}
    return {}
