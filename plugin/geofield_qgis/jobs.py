"""Commands that run while the window stays alive, and one that answers again and again."""

from __future__ import annotations

import json
from typing import Any, Callable

from qgis.PyQt.QtCore import QObject, QProcess, pyqtSignal

from . import engine
from .words import tr


class Awake:
    """A command line that has its libraries loaded already, for the next job.

    Finding an outline takes about as long as loading what that needs.
    """

    def __init__(self) -> None:
        self._process: QProcess | None = None

    def wake(self) -> None:
        """Have one; nothing happens where there is one, or no engine."""
        if self._process is not None and self._process.state() != QProcess.ProcessState.NotRunning:
            return
        try:
            command = engine.require_engine()
        except engine.EngineError:
            return  # the job itself says so
        self._process = QProcess()
        self._process.setProcessEnvironment(engine.clean_environment())
        self._process.start(command, ["ready"])

    def take(self) -> QProcess | None:
        """The one that waits, if it still does; it belongs to the caller."""
        process, self._process = self._process, None
        if process is None or process.state() != QProcess.ProcessState.Running:
            return None
        return process

    def sleep(self) -> None:
        """Let it go."""
        process, self._process = self._process, None
        if process is not None:
            engine.stop(process)


class Job(QObject):
    """One command; tells how far it is, and ends in `done` or `failed`."""

    progressed = pyqtSignal(int, int, str)
    done = pyqtSignal(object)
    failed = pyqtSignal(str)

    def __init__(
        self,
        words: list[str],
        environment: dict[str, str],
        parent: QObject,
        awake: Awake | None = None,
    ) -> None:
        super().__init__(parent)
        self._stopped = False
        self._reader = engine.Reader(self.progressed.emit, lambda line: None)
        words = [*words, "--progress", "json"]
        # One that is awake already has the plain environment.
        waiting = None if awake is None or environment else awake.take()
        self._process = waiting or QProcess()
        self._process.setParent(self)
        self._process.readyReadStandardError.connect(self._read)
        self._process.readyReadStandardOutput.connect(self._read)
        self._process.finished.connect(self._finish)
        self._process.errorOccurred.connect(self._fail_to_start)
        if waiting is not None:
            waiting.write(json.dumps(words).encode() + b"\n")
            return
        self._process.setProcessEnvironment(engine.clean_environment(environment))
        self._process.start(engine.require_engine(), words)

    def stop(self) -> None:
        """End the command; neither `done` nor `failed` follows."""
        self._stopped = True
        engine.stop(self._process)

    def _read(self) -> None:
        if not self._stopped:
            self._reader.take(self._process)

    def _fail_to_start(self, error: Any) -> None:
        if error == QProcess.ProcessError.FailedToStart and not self._stopped:
            self._stopped = True
            self.failed.emit(self._process.errorString())

    def _finish(self, code: int, status: Any) -> None:
        if self._stopped:
            return
        self._reader.take(self._process, last=True)
        if status != QProcess.ExitStatus.NormalExit or code != 0:
            crashed = status != QProcess.ExitStatus.NormalExit
            self.failed.emit(self._reader.why(code, crashed))
        else:
            self.done.emit(self._reader.result())


class Live(QObject):
    """`geofield live`: an engine that stays awake and answers questions about a plan.

    Questions wait for each other; of those that wait, a newer one of the same kind takes the
    older one's place, for only the last state of the map matters.
    """

    failed = pyqtSignal(str)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._process: QProcess | None = None
        self._asked: Callable[[dict[str, Any]], None] | None = None
        self._waiting: list[tuple[str, dict[str, Any], Callable]] = []
        self._rest = b""

    def ask(self, question: dict[str, Any], answer: Callable[[dict[str, Any]], None]) -> None:
        """Ask, and have `answer` called with what comes back."""
        kind = str(question["do"])
        self._waiting = [each for each in self._waiting if each[0] != kind]
        self._waiting.append((kind, question, answer))
        self._next()

    @property
    def busy(self) -> bool:
        """Whether an answer is still to come."""
        return self._asked is not None or bool(self._waiting)

    def close(self) -> None:
        """Let the engine go."""
        self._waiting, self._asked = [], None
        process, self._process = self._process, None
        if process is not None:
            process.blockSignals(True)
            engine.stop(process)
            process.deleteLater()

    def _next(self) -> None:
        if self._asked is not None or not self._waiting:
            return
        if self._process is None:
            try:
                command = engine.require_engine()
            except engine.EngineError as error:
                self._waiting = []
                self.failed.emit(str(error))
                return
            self._rest = b""
            self._process = QProcess(self)
            self._process.setProcessEnvironment(engine.clean_environment())
            self._process.readyReadStandardOutput.connect(self._read)
            self._process.finished.connect(self._ended)
            self._process.start(command, ["live", "--progress", "json"])
        _, question, self._asked = self._waiting.pop(0)
        self._process.write(json.dumps(question).encode() + b"\n")

    def _read(self) -> None:
        if self._process is None:
            return
        self._process.readAllStandardError()
        lines = (self._rest + bytes(self._process.readAllStandardOutput())).split(b"\n")
        self._rest = lines.pop()
        for line in lines:
            answer, self._asked = self._asked, None
            try:
                told = json.loads(line)
            except ValueError:
                continue
            if answer is not None:
                answer(told)
        self._next()

    def _ended(self) -> None:
        process, self._process = self._process, None
        asked, self._asked = self._asked, None
        if process is not None:
            process.deleteLater()
        if asked is not None:
            self._waiting = []
            self.failed.emit(tr("The engine ended unexpectedly; the next edit starts it again."))
