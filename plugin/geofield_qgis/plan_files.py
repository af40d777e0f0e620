"""The layers of one plan in the project, and letting go of their file while it is replaced."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from qgis.core import (
    NULL,
    QgsDataProvider,
    QgsFeature,
    QgsGeometry,
    QgsProject,
    QgsReadWriteContext,
    QgsVectorLayer,
    QgsWkbTypes,
)
from qgis.PyQt.QtXml import QDomDocument, QDomElement

from . import results, sources
from .algorithm import path_of
from .sources import table_of

#: What a review is of.
_REVIEWED = ("obstacles", "field")


def all_of(path: str) -> list[QgsVectorLayer]:
    """All layers of the project that show a plan's GeoPackage, duplicated ones too."""
    path = str(results.settled(path))
    layers = QgsProject.instance().mapLayers().values()
    return [each for each in layers if isinstance(each, QgsVectorLayer) and path_of(each) == path]


def layers_of(path: str) -> dict[str, QgsVectorLayer]:
    """The project's layers of a plan's GeoPackage, by their names in it."""
    return {table_of(layer): layer for layer in all_of(path)}


def obstacles_of(path: str) -> QgsVectorLayer | None:
    """The obstacles of a plan that has a layer in the project; None where it has none.

    Obstacles and outline that were taken out of the project are put back into it, and layers
    whose file was not there for a while are opened again.
    """
    for each in all_of(path):
        if not each.isEditable() and not each.supportsEditing():
            _point_to(each, each.source(), "ogr")
    layers = layers_of(path)
    missing = [name for name in _REVIEWED if name not in layers]
    if not layers or (missing and not sources.is_plan(path)):
        return None
    return {**layers, **{name: results.load(path, name) for name in missing}}["obstacles"]


def as_edited(path: str, obstacles: QgsVectorLayer) -> dict[str, Any]:
    """Obstacles and outline of a plan as they are now, saved or not, for the engine."""
    names, rows = obstacles.fields().names(), []
    for feature in _shapes_of(obstacles):
        values = dict(zip(names, feature.attributes()))
        row = {k: v for k, v in values.items() if isinstance(v, (int, float, str)) and v != NULL}
        rows.append({**row, "wkb": _hex(feature.geometry())})
    field = layers_of(path).get("field")
    return {"obstacles": rows, **({} if field is None else {"outline": _outline(field)})}


def _outline(field: QgsVectorLayer) -> str:
    """The outline as it is edited; that it is one polygon, the engine sees to."""
    shapes = [each.geometry() for each in _shapes_of(field)]
    if len(shapes) == 1:
        return _hex(shapes[0])
    none = QgsGeometry.fromWkt("GeometryCollection EMPTY")
    return _hex(QgsGeometry.collectGeometry(shapes) if shapes else none)


def _hex(geometry: QgsGeometry) -> str:
    """Well-known binary, for the engine; curves and measures are none of its business."""
    return bytes(geometry.asWkb()).hex()


def _shapes_of(layer: QgsVectorLayer) -> Iterator[QgsFeature]:
    """The rows with a shape of a layer as they are edited, and those that its filter hides."""
    rows = list(layer.getFeatures())
    if layer.subsetString():
        edits, whole = layer.editBuffer(), layer.clone()
        known = {*layer.allFeatureIds(), *(edits.deletedFeatureIds() if edits else ())}
        whole.setSubsetString("")
        rows += [each for each in whole.getFeatures() if each.id() not in known]
    return (each for each in rows if each.hasGeometry())


class Released:
    """No layer of a plan holds its file; afterwards all show what lies in it then.

    QGIS keeps a GeoPackage open, and the engine refuses to replace a file that another program
    has open: a write-ahead log of the old file would spoil the new one. A project that is saved
    meanwhile has the layers as they were.
    """

    def __init__(self, path: str) -> None:
        self._held: list[tuple[QgsVectorLayer, str, bool, bool]] = []
        self._described: dict[str, QDomElement] = {}
        QgsProject.instance().writeMapLayer.connect(self._describe)
        for layer in all_of(path):
            editing = layer.isEditable()
            if editing:
                layer.rollBack()  # nothing is lost: it was asked for after saving
            self._held.append((layer, layer.source(), editing, layer.readOnly()))
            self._described[layer.id()] = _described(layer)
            kind = QgsWkbTypes.displayString(layer.wkbType())
            _point_to(layer, f"{kind}?crs={layer.crs().authid()}", "memory")
            layer.setReadOnly(True)  # what QGIS's tools did to it would be lost

    def back(self) -> None:
        """Take the file up again."""
        QgsProject.instance().writeMapLayer.disconnect(self._describe)
        for layer, source, editing, read_only in self._held:
            try:
                layer.setReadOnly(read_only)
                _point_to(layer, source, "ogr")
                if editing:
                    layer.startEditing()
                layer.triggerRepaint()
            except RuntimeError:
                continue  # removed from the project meanwhile
        self._held = []

    def _describe(self, layer: Any, element: QDomElement, document: QDomDocument) -> None:
        """Have a project that is being saved hold a layer as it was."""
        if layer.id() in self._described:
            whole = document.importNode(self._described[layer.id()], True)
            while element.hasChildNodes():
                element.removeChild(element.firstChild())
            while whole.hasChildNodes():
                element.appendChild(whole.firstChild())


def _described(layer: QgsVectorLayer) -> QDomElement:
    """A layer as a project describes it."""
    document = QDomDocument()
    element = document.createElement("maplayer")
    document.appendChild(element)
    layer.writeLayerXml(element, document, QgsReadWriteContext())
    return element


def _point_to(layer: QgsVectorLayer, source: str, provider: str) -> None:
    options: Any = QgsDataProvider.ProviderOptions()
    options.transformContext = QgsProject.instance().transformContext()
    layer.setDataSource(source, layer.name(), provider, options, False)
