"""The engine's own environment: made on request, from locked and hashed requirements.

Nothing is installed into the Python of QGIS. A separate Python of 3.11 or newer makes an
environment in the user's profile; pip takes into it exactly the files whose hashes this plugin
carries, through the proxy that QGIS is set to use.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Any
from urllib.parse import quote

from qgis.core import QgsSettings
from qgis.PyQt.QtCore import QObject, QProcess, pyqtSignal

from . import engine
from .words import tr

#: Locked requirements of the engine with their hashes; `make plugin` puts them here.
REQUIREMENTS = Path(__file__).with_name("requirements.txt")
#: Download and disk space, megabytes, measured on Linux with Python 3.11.
DOWNLOAD_MB, DISK_MB = 310, 1080
_OLDEST = (3, 11)


def consent_text() -> str:
    """What a person agrees to before anything is fetched."""
    return tr(
        "The engine will be fetched from the Python package index (about {0} MB) and put into "
        "{2} ({1} MB there). The Python of QGIS is not touched, and removing that folder removes "
        "everything."
    ).format(DOWNLOAD_MB, DISK_MB, engine.own_environment())


def find_python() -> str | None:
    """A Python that is new enough for the engine; None when there is none."""
    names = ["python3.13", "python3.12", "python3.11", "python3", "python"]
    if sys.platform == "win32":
        names = [str(Path(sys.exec_prefix) / "python.exe"), "py", *names]
    for name in names:
        command = shutil.which(name)
        if command is not None and _version(command) >= _OLDEST:
            return command
    return None


def network(settings: Any = None) -> dict[str, str]:
    """The proxy of QGIS's network settings, as variables that pip reads."""
    settings = settings or QgsSettings()
    if not settings.value("proxy/proxyEnabled", False, type=bool):
        return {}
    host = str(settings.value("proxy/proxyHost", "") or "")
    if not host:
        return {}
    port = str(settings.value("proxy/proxyPort", "") or "")
    kind = str(settings.value("proxy/proxyType", "") or "")
    scheme = "socks5h" if kind.startswith("Socks5") else "http"
    user = str(settings.value("proxy/proxyUser", "") or "")
    password = str(settings.value("proxy/proxyPassword", "") or "")
    # Letters such as @ and : would end the name or password where they stand.
    login = f"{quote(user, safe='')}:{quote(password, safe='')}@" if user else ""
    address = f"{scheme}://{login}{host}:{port}" if port else f"{scheme}://{login}{host}"
    return {"HTTP_PROXY": address, "HTTPS_PROXY": address}


class Installer(QObject):
    """Makes the environment, step by step, while the window stays alive.

    Parameters
    ----------
    wheel : str
        A file of the engine itself, checked against the hash the plugin carries; empty takes it
        from the package index.
    """

    said = pyqtSignal(str)
    done = pyqtSignal()
    failed = pyqtSignal(str)

    def __init__(self, wheel: str = "", parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._wheel = wheel
        self._process: QProcess | None = None
        self._target = engine.own_environment()
        self._before = self._target.with_name("engine.before")
        self._steps: list[tuple[str, list[str]]] = []
        self._lines: list[str] = []

    def start(self) -> None:
        """Begin; ends in `done` or `failed`."""
        if not REQUIREMENTS.is_file():
            self.failed.emit(tr("This copy of the plugin carries no list of requirements."))
            return
        python = find_python()
        if python is None:
            self.failed.emit(
                tr("No Python of version 3.11 or newer was found: install one from python.org.")
            )
            return
        # An environment knows its own path, so it is made in its place; the old one waits.
        self._target.parent.mkdir(parents=True, exist_ok=True)
        try:
            # One that still waits is the last whole one: QGIS was ended while it installed.
            if self._before.exists():
                self._put_back()
            if self._target.exists():
                self._target.rename(self._before)
        except OSError:  # Windows moves nothing that runs
            self.failed.emit(
                tr("The engine there is in use: close geofield's panel in QGIS, then repeat.")
            )
            return
        inside = engine.command_in(self._target).with_name(
            "python.exe" if sys.platform == "win32" else "python"
        )
        pip = [
            "-m", "pip", "install", "--disable-pip-version-check", "--no-input",
            "--only-binary", ":all:", "--require-hashes", "-r", str(REQUIREMENTS),
        ]  # fmt: skip
        if self._wheel:
            pip += ["--find-links", str(Path(self._wheel).parent)]
        self._steps = [
            (python, ["-m", "venv", str(self._target)]),
            (str(inside), pip),
            (str(engine.command_in(self._target)), ["--version"]),
        ]
        self._next()

    def stop(self) -> None:
        """End it, and leave the engine that was there before."""
        if self._process is not None:
            self._process.blockSignals(True)
            engine.stop(self._process)
            self._process = None
        self._put_back()

    def _next(self) -> None:
        if not self._steps:
            shutil.rmtree(self._before, ignore_errors=True)
            self.done.emit()
            return
        command, words = self._steps.pop(0)
        self._process = QProcess(self)
        self._process.setProcessEnvironment(engine.clean_environment(network()))
        self._process.setProcessChannelMode(QProcess.ProcessChannelMode.MergedChannels)
        self._process.readyRead.connect(self._read)
        self._process.finished.connect(self._finish)
        self._process.start(command, words)

    def _read(self) -> None:
        text = bytes(self._process.readAll()).decode("utf-8", "replace")
        for line in text.splitlines():
            if line.strip():
                self._lines.append(line.strip())
                self.said.emit(line.strip())

    def _finish(self, code: int, status: Any) -> None:
        self._read()
        if code != 0 or status != QProcess.ExitStatus.NormalExit:
            self._put_back()
            self.failed.emit(" ".join(self._lines[-4:]) or tr("It ended unexpectedly."))
            return
        self._next()

    def _put_back(self) -> None:
        """The engine that was there before, if there was one."""
        shutil.rmtree(self._target, ignore_errors=True)
        if self._before.exists():
            self._before.rename(self._target)


def _version(command: str) -> tuple[int, ...]:
    asked = ["-c", "import sys, venv; print(*sys.version_info[:2])"]
    return tuple(int(each) for each in engine.answer_of(command, asked, wait_ms=20_000))
