"""The layers of one plan in the project, and letting go of their file while it is replaced."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from qgis.core import QgsDataProvider, QgsFeature, QgsProject, QgsVectorLayer, QgsWkbTypes

from .algorithm import path_of
from .results import settled
from .sources import table_of


def all_of(path: str) -> list[QgsVectorLayer]:
    """All layers of the project that show a plan's GeoPackage, duplicated ones too."""
    path = str(settled(path))
    layers = QgsProject.instance().mapLayers().values()
    return [each for each in layers if isinstance(each, QgsVectorLayer) and path_of(each) == path]


def layers_of(path: str) -> dict[str, QgsVectorLayer]:
    """The project's layers of a plan's GeoPackage, by their names in it."""
    return {table_of(layer): layer for layer in all_of(path)}


def rows_of(layer: QgsVectorLayer) -> Iterator[QgsFeature]:
    """The rows of a layer as they are edited, and those that its filter hides."""
    yield from layer.getFeatures()
    if layer.subsetString():
        edits, whole = layer.editBuffer(), layer.clone()
        known = {*layer.allFeatureIds(), *(edits.deletedFeatureIds() if edits else ())}
        whole.setSubsetString("")
        yield from (each for each in whole.getFeatures() if each.id() not in known)


class Released:
    """No layer of a plan holds its file; afterwards all show what lies in it then.

    QGIS keeps a GeoPackage open, and the engine refuses to replace a file that another program
    has open: a write-ahead log of the old file would spoil the new one.
    """

    def __init__(self, path: str) -> None:
        self._held: list[tuple[QgsVectorLayer, str, bool]] = []
        for layer in all_of(path):
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
