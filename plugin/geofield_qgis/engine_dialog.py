"""The dialogue that finds, installs, updates or names the engine."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from qgis.core import QgsSettings
from qgis.PyQt.QtCore import pyqtSignal
from qgis.PyQt.QtWidgets import (
    QDialog,
    QFileDialog,
    QHBoxLayout,
    QLabel,
    QPlainTextEdit,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from . import engine, install
from .words import tr


class EngineDialog(QDialog):
    """What engine there is, and the ways to get one."""

    #: An engine was installed or named, and answers.
    ready = pyqtSignal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle(tr("geofield's engine"))
        self.setMinimumWidth(560)
        self._installer: install.Installer | None = None
        box = QVBoxLayout(self)
        self.state, self.consent = QLabel(), QLabel(install.consent_text())
        for label in (self.state, self.consent):
            label.setWordWrap(True)
            box.addWidget(label)
        row = QHBoxLayout()
        self.buttons: dict[str, QPushButton] = {}
        for name, text, action in (
            ("install", tr("Install or update"), self.install),
            ("wheel", tr("Install from a file..."), self.install_wheel),
            ("choose", tr("Use another command..."), self.choose),
            ("forget", tr("Find it by itself"), self.forget),
        ):
            button = QPushButton(text)
            button.clicked.connect(action)
            row.addWidget(button)
            self.buttons[name] = button
        box.addLayout(row)
        self.log = QPlainTextEdit()
        self.log.setReadOnly(True)
        box.addWidget(self.log)
        self.tell()

    def tell(self) -> bool:
        """Say which engine is used; whether there is one."""
        try:
            command = engine.require_engine()
        except engine.EngineError as error:
            self.state.setText(str(error))
            return False
        self.state.setText(
            tr("Ready: {0}, version {1}").format(command, engine.engine_version(command))
        )
        return True

    def install(self, _: Any = None, wheel: str = "") -> None:
        """Install; pressing the button below the words is the consent."""
        self._enable(False)
        self.log.clear()
        self._installer = install.Installer(wheel, self)
        self._installer.said.connect(self.log.appendPlainText)
        self._installer.failed.connect(self._failed)
        self._installer.done.connect(self._done)
        self._installer.start()

    def install_wheel(self) -> None:
        """Install with the engine itself from a file."""
        path, _ = QFileDialog.getOpenFileName(self, tr("Engine"), "", "Wheel (geofield-*.whl)")
        if path:
            self.install(wheel=path)

    def choose(self) -> None:
        """Name the command."""
        path, _ = QFileDialog.getOpenFileName(self, tr("The geofield command"))
        if path:
            QgsSettings().setValue(engine.SETTING, str(Path(path)))
            self._tell_others()

    def forget(self) -> None:
        """Forget a command that was named."""
        QgsSettings().remove(engine.SETTING)
        self.tell()

    def reject(self) -> None:
        """Closing the window ends an installation."""
        if self._installer is not None:
            self._installer.stop()
        super().reject()

    def _failed(self, why: str) -> None:
        self._installer = None
        self._enable(True)
        self.tell()
        self.log.appendPlainText(why)

    def _done(self) -> None:
        self._installer = None
        self._enable(True)
        self._tell_others()

    def _tell_others(self) -> None:
        if self.tell():
            self.ready.emit()

    def _enable(self, on: bool) -> None:
        for button in self.buttons.values():
            button.setEnabled(on)
