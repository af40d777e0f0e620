"""Tracks that follow edits: drawn on the map in the place of those in the file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from qgis.core import QgsGeometry, QgsPointXY, QgsProject, QgsWkbTypes
from qgis.PyQt.QtXml import QDomDocument

from .map_tools import band

_LINES = QgsWkbTypes.GeometryType.LineGeometry
#: What is not as it was before the edits; the route is planned when they are saved.
_OUTDATED = (
    "tracks", "segments", "gaps", "track_points", "headland_tracks", "route", "turns",
)  # fmt: skip


class Preview:
    """Tracks that are in no file yet; the layers of those before the edits are hidden meanwhile."""

    def __init__(self, canvas: Any) -> None:
        self.canvas = canvas
        self._bands = {
            "segments": band(canvas, _LINES, "#ffffff", 2),
            "gaps": band(canvas, _LINES, "#ff80ab", 2),
            "headland_tracks": band(canvas, _LINES, "#ffffff", 2),
        }
        self._hidden: list[str] = []
        QgsProject.instance().writeProject.connect(self._describe)

    @property
    def is_shown(self) -> bool:
        """Whether layers are hidden for it."""
        return bool(self._hidden)

    def show(self, answer: Mapping[str, Any], crs: Any, layers: Mapping[str, Any]) -> None:
        """Draw what was planned, places in `crs`; `layers` are those of the plan."""
        for name, sketch in self._bands.items():
            sketch.reset(_LINES)
            lines = [[QgsPointXY(x, y) for x, y in line] for line in answer[name]]
            if lines:
                sketch.addGeometry(QgsGeometry.fromMultiPolylineXY(lines), crs)
        if self._hidden:
            return
        root = QgsProject.instance().layerTreeRoot()
        for name in _OUTDATED:
            layer = layers.get(name)
            node = None if layer is None else root.findLayer(layer.id())
            if node is not None and node.isVisible():
                node.setItemVisibilityChecked(False)
                self._hidden.append(layer.id())

    def clear(self) -> None:
        """Show the layers again."""
        for sketch in self._bands.values():
            sketch.reset(_LINES)
        root = QgsProject.instance().layerTreeRoot()
        for layer_id in self._hidden:
            node = root.findLayer(layer_id)
            if node is not None:
                node.setItemVisibilityChecked(True)
        self._hidden = []

    def remove(self) -> None:
        """Leave nothing on the map."""
        self.clear()
        QgsProject.instance().writeProject.disconnect(self._describe)
        for sketch in self._bands.values():
            self.canvas.scene().removeItem(sketch)

    def _describe(self, document: QDomDocument) -> None:
        """Have a project that is being saved show the layers: it holds no sketch."""
        nodes = document.elementsByTagName("layer-tree-layer")
        for number in range(nodes.count()):
            node = nodes.at(number).toElement()
            if node.attribute("id") in self._hidden:
                node.setAttribute("checked", "Qt::Checked")
