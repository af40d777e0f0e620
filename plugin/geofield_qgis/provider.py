"""The provider `geofield:` of Processing."""

from __future__ import annotations

from qgis.core import QgsProcessingProvider
from qgis.PyQt.QtGui import QIcon

from .algorithm import ICONS
from .algorithms import ALGORITHMS


class GeofieldProvider(QgsProcessingProvider):
    """Lists the algorithms, whether there is an engine or not."""

    def id(self) -> str:  # noqa: D102
        return "geofield"

    def name(self) -> str:  # noqa: D102
        return "geofield"

    def icon(self) -> QIcon:  # noqa: D102
        return QIcon(str(ICONS / "geofield.svg"))

    def loadAlgorithms(self) -> None:  # noqa: D102
        for algorithm in ALGORITHMS:
            self.addAlgorithm(algorithm())
