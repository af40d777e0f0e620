"""Tools and marks of the map: plan the field here; where to put an obstacle; draw one."""

from __future__ import annotations

from typing import Any, Callable

from qgis.core import QgsGeometry, QgsPointXY, QgsVectorLayer, QgsWkbTypes
from qgis.gui import QgsMapCanvas, QgsMapTool, QgsRubberBand
from qgis.PyQt.QtCore import QPoint, Qt
from qgis.PyQt.QtGui import QColor
from qgis.PyQt.QtWidgets import QApplication

#: How much of the map around an obstacle is shown, in its own diameters.
_AROUND = 7.0


class _Tool(QgsMapTool):
    """A tool that Escape ends."""

    def __init__(self, canvas: QgsMapCanvas, escaped: Callable[[], None]) -> None:
        super().__init__(canvas)
        self._escaped = escaped
        self.setCursor(Qt.CursorShape.CrossCursor)

    def keyPressEvent(self, event: Any) -> None:
        """Escape ends what the tool began."""
        if event.key() == Qt.Key.Key_Escape:
            self._escaped()
            event.accept()


class PointTool(_Tool):
    """Tells where the map was clicked, and with which keys held.

    Parameters
    ----------
    clicked
        Called with the point (map CRS), whether Shift and whether Alt was held.
    escaped
        Called for Escape.
    """

    def __init__(
        self,
        canvas: QgsMapCanvas,
        clicked: Callable[[QgsPointXY, bool, bool], None],
        escaped: Callable[[], None],
    ) -> None:
        super().__init__(canvas, escaped)
        self._clicked = clicked

    def canvasReleaseEvent(self, event: Any) -> None:
        """A click: the left button alone counts."""
        if event.button() == Qt.MouseButton.LeftButton:
            held = event.modifiers()
            self._clicked(
                event.mapPoint(),
                bool(held & Qt.KeyboardModifier.ShiftModifier),
                bool(held & Qt.KeyboardModifier.AltModifier),
            )


class CircleTool(_Tool):
    """Draws a circle: press in its middle, drag to its edge."""

    def __init__(
        self,
        canvas: QgsMapCanvas,
        drawn: Callable[[QgsPointXY, QgsPointXY], None],
        escaped: Callable[[], None],
    ) -> None:
        super().__init__(canvas, escaped)
        self._drawn = drawn
        self._middle: QgsPointXY | None = None
        self._pressed = QPoint()
        self._band = band(canvas, QgsWkbTypes.GeometryType.PolygonGeometry, "#42a5f5")

    def canvasPressEvent(self, event: Any) -> None:
        """Begin in the middle, with the left button alone."""
        if event.button() == Qt.MouseButton.LeftButton:
            self._middle, self._pressed = event.mapPoint(), event.pos()

    def canvasMoveEvent(self, event: Any) -> None:
        """Show the circle as it would be."""
        if self._middle is not None:
            radius = self._middle.distance(event.mapPoint())
            circle = QgsGeometry.fromPointXY(self._middle).buffer(radius, 12)
            self._band.setToGeometry(circle, None)

    def canvasReleaseEvent(self, event: Any) -> None:
        """End at the edge; a click with an unsteady hand draws nothing."""
        middle, self._middle = self._middle, None
        self._band.reset(QgsWkbTypes.GeometryType.PolygonGeometry)
        dragged = (event.pos() - self._pressed).manhattanLength()
        if middle is not None and dragged >= QApplication.startDragDistance():
            self._drawn(middle, event.mapPoint())

    def deactivate(self) -> None:
        """Forget a circle that was begun."""
        self._middle = None
        self._band.reset(QgsWkbTypes.GeometryType.PolygonGeometry)
        super().deactivate()


class BorrowedMap:
    """The map in the hands of one tool; then what was there before has it back."""

    def __init__(self, canvas: QgsMapCanvas) -> None:
        self.canvas = canvas
        self._tool: QgsMapTool | None = None
        self._before: QgsMapTool | None = None

    def use(self, tool: QgsMapTool) -> None:
        """Take the map, also from a tool that borrowed it itself."""
        now = self.canvas.mapTool()
        if self._tool is None or now is not self._tool:
            self._before = now
        self._tool = tool
        self.canvas.setMapTool(tool)

    def drop(self) -> None:
        """Give it back."""
        self.canvas.unsetMapTool(self._tool)
        if self._before is not None:
            self.canvas.setMapTool(self._before)


class Mark:
    """Shows which obstacle is looked at."""

    def __init__(self, canvas: QgsMapCanvas) -> None:
        self.canvas = canvas
        self._band = band(canvas, QgsWkbTypes.GeometryType.PolygonGeometry, "#00e5ff", 3)
        self._shape = QgsGeometry()

    @property
    def is_shown(self) -> bool:
        """Whether there is one, with a shape."""
        return not self._shape.isNull()

    def show(self, layer: QgsVectorLayer | None, feature_id: int | None = None) -> None:
        """Mark a feature of a layer; none where there is none."""
        self._band.reset(QgsWkbTypes.GeometryType.PolygonGeometry)
        self._shape = QgsGeometry()
        if layer is not None and feature_id is not None:
            self._shape = layer.getFeature(feature_id).geometry()
        if self.is_shown:
            self._band.addGeometry(QgsGeometry(self._shape), layer.crs())

    def is_of(self, layer: QgsVectorLayer, feature_id: int) -> bool:
        """Whether the feature still is what was marked: other programs number rows anew."""
        return self._shape.equals(layer.getFeature(feature_id).geometry())

    def look_at(self) -> None:
        """Have the map show it."""
        if self.is_shown:
            box = self._band.asGeometry().boundingBox()
            box.scale(_AROUND)
            self.canvas.setExtent(box)
            self.canvas.refresh()

    def remove(self) -> None:
        """Leave nothing on the map."""
        self.canvas.scene().removeItem(self._band)


def band(canvas: QgsMapCanvas, kind: Any, colour: str, width: int = 2) -> QgsRubberBand:
    """A sketch on the map."""
    made = QgsRubberBand(canvas, kind)
    stroke = QColor(colour)
    made.setStrokeColor(stroke)
    made.setWidth(width)
    fill = QColor(stroke)
    fill.setAlpha(40 if kind == QgsWkbTypes.GeometryType.PolygonGeometry else 255)
    made.setFillColor(fill)
    return made
