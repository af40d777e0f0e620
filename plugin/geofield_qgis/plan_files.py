"""The layers of one plan in the project, and letting go of their file while it is replaced."""

from __future__ import annotations

from typing import Any

from qgis.core import QgsDataProvider, QgsProject, QgsVectorLayer, QgsWkbTypes

from .algorithm import path_of
from .results import settled
from .sources import table_of


def layers_of(path: str) -> dict[str, QgsVectorLayer]:
    """The project's layers of a plan's GeoPackage, by their names in it."""
    found, path = {}, str(settled(path))
    for layer in QgsProject.instance().mapLayers().values():
        if isinstance(layer, QgsVectorLayer) and path_of(layer) == path:
            found[table_of(layer)] = layer
    return found


class Released:
    """No layer of a plan holds its file; afterwards all show what lies in it then.

    QGIS keeps a GeoPackage open, and the engine refuses to replace a file that another program
    has open: a write-ahead log of the old file would spoil the new one.
    """

    def __init__(self, path: str) -> None:
        self._held: list[tuple[QgsVectorLayer, str, bool]] = []
        for layer in layers_of(path).values():
            editing = layer.isEditable()
            if editing:
                layer.rollBack()  # nothing is lost: it was asked for after saving
            self._held.append((layer, layer.source(), editing))
            kind = QgsWkbTypes.displayString(layer.wkbType())
            _point_to(layer, f"{kind}?crs={layer.crs().authid()}", "memory")

    def back(self) -> None:
        """Take the file up again."""
        for layer, source, editing in self._held:
            try:
                _point_to(layer, source, "ogr")
                if editing:
                    layer.startEditing()
                layer.triggerRepaint()
            except RuntimeError:
                continue  # removed from the project meanwhile
        self._held = []


def _point_to(layer: QgsVectorLayer, source: str, provider: str) -> None:
    options: Any = QgsDataProvider.ProviderOptions()
    options.transformContext = QgsProject.instance().transformContext()
    layer.setDataSource(source, layer.name(), provider, options, False)
