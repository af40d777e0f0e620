"""The plugin: what it adds to QGIS, and takes away again."""

from __future__ import annotations

from typing import Any

from qgis.core import QgsApplication
from qgis.PyQt.QtCore import QCoreApplication, QLocale, QSettings

from .provider import GeofieldProvider
from .words import Words


class GeofieldPlugin:
    """Provider, map tool and review panel.

    Parameters
    ----------
    iface
        The window of QGIS; None in `qgis_process`, which has the provider alone.
    """

    def __init__(self, iface: Any) -> None:
        self.iface = iface
        self.provider: GeofieldProvider | None = None
        self.window: Any = None
        self._translator = _translator()

    def initProcessing(self) -> None:  # noqa: D102
        self.provider = GeofieldProvider()
        QgsApplication.processingRegistry().addProvider(self.provider)

    def initGui(self) -> None:  # noqa: D102
        from .window import Window

        self.initProcessing()
        self.window = Window(self.iface)

    def unload(self) -> None:
        """Take away all that was added."""
        if self.window is not None:
            self.window.close()
            self.window = None
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
            self.provider = None
        if self._translator is not None:
            QCoreApplication.removeTranslator(self._translator)
            self._translator = None


def _translator() -> Words | None:
    """The words in the language of QGIS, where there is a translation."""
    settings = QSettings()
    name = QLocale().name()
    if settings.value("locale/overrideFlag", False, type=bool):
        name = str(settings.value("locale/userLocale", name))
    words = Words(name[:2])
    if words.isEmpty():
        return None
    QCoreApplication.installTranslator(words)
    return words
