"""Tools of the map: plan the field here; where to put an obstacle; draw one."""

from __future__ import annotations

from typing import Any, Callable

from qgis.core import QgsGeometry, QgsPointXY, QgsWkbTypes
from qgis.gui import QgsMapCanvas, QgsMapTool, QgsRubberBand
from qgis.PyQt.QtCore import Qt
from qgis.PyQt.QtGui import QColor


class PointTool(QgsMapTool):
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
        super().__init__(canvas)
        self._clicked, self._escaped = clicked, escaped
        self.setCursor(Qt.CursorShape.CrossCursor)

    def canvasReleaseEvent(self, event: Any) -> None:
        """A click: the left button alone counts."""
        if event.button() == Qt.MouseButton.LeftButton:
            held = event.modifiers()
            self._clicked(
                event.mapPoint(),
                bool(held & Qt.KeyboardModifier.ShiftModifier),
                bool(held & Qt.KeyboardModifier.AltModifier),
            )

    def keyPressEvent(self, event: Any) -> None:
        """Escape ends what the tool began."""
        if event.key() == Qt.Key.Key_Escape:
            self._escaped()
            event.accept()


class CircleTool(QgsMapTool):
    """Draws a circle: press in its middle, drag to its edge."""

    def __init__(
        self, canvas: QgsMapCanvas, drawn: Callable[[QgsPointXY, QgsPointXY], None]
    ) -> None:
        super().__init__(canvas)
        self._drawn = drawn
        self._middle: QgsPointXY | None = None
        self._band = band(canvas, QgsWkbTypes.GeometryType.PolygonGeometry, "#42a5f5")
        self.setCursor(Qt.CursorShape.CrossCursor)

    def canvasPressEvent(self, event: Any) -> None:
        """Begin in the middle."""
        self._middle = event.mapPoint()

    def canvasMoveEvent(self, event: Any) -> None:
        """Show the circle as it would be."""
        if self._middle is not None:
            radius = self._middle.distance(event.mapPoint())
            circle = QgsGeometry.fromPointXY(self._middle).buffer(radius, 12)
            self._band.setToGeometry(circle, None)

    def canvasReleaseEvent(self, event: Any) -> None:
        """End at the edge."""
        middle, self._middle = self._middle, None
        self._band.reset(QgsWkbTypes.GeometryType.PolygonGeometry)
        if middle is not None and middle.distance(event.mapPoint()) > 0:
            self._drawn(middle, event.mapPoint())

    def deactivate(self) -> None:
        """Forget a circle that was begun."""
        self._middle = None
        self._band.reset(QgsWkbTypes.GeometryType.PolygonGeometry)
        super().deactivate()


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
