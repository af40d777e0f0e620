"""What the review panel says: of the plan and its doubts, of an obstacle, of the tracks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from qgis.core import QgsVectorLayer
from qgis.PyQt.QtCore import Qt
from qgis.PyQt.QtWidgets import QLabel, QVBoxLayout, QWidget

from . import plan_files
from .review import OPEN, counts, value
from .words import number, tr


class ReviewLabels(QWidget):
    """Lines of text below each other."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        box = QVBoxLayout(self)
        box.setContentsMargins(0, 0, 0, 0)
        self.title, self.doubts, self.count = QLabel(), QLabel(), QLabel()
        self.here, self.figures = QLabel(), QLabel()
        self.doubts.setStyleSheet("color: #b26a00")
        self.here.setStyleSheet("font-weight: bold")
        for label in (self.title, self.doubts, self.count, self.here, self.figures):
            label.setWordWrap(True)
            label.setTextFormat(Qt.TextFormat.PlainText)
            box.addWidget(label)
        #: What the picture did not allow when obstacles were looked for.
        self._obstacle_doubts: list[str] = []

    def tell(self, layer: QgsVectorLayer | None, path: str, current: int | None) -> None:
        """Tell of a plan's obstacles as they are now, and of the one that is looked at."""
        if layer is None:
            self._obstacle_doubts = []
            self.title.setText(tr("Choose a layer of a plan, then press the button."))
            for label in (self.doubts, self.count, self.here, self.figures):
                label.setText("")
            return
        self.tell_outline(path)
        found = counts(layer)
        words = {
            "confirmed": tr("{0} confirmed"),
            "rejected": tr("{0} rejected"),
            "added": tr("{0} added"),
        }
        parts = [tr("{0} left to look at").format(sum(found.get(status, 0) for status in OPEN))]
        parts += [text.format(found[name]) for name, text in words.items() if found.get(name)]
        self.count.setText(", ".join(parts))
        feature = None if current is None else layer.getFeature(current)
        if feature is None or not feature.isValid():
            self.here.setText("")
            return
        radius_m, confidence = value(feature, "radius_m"), value(feature, "confidence")
        parts = [tr("Obstacle {0}").format(value(feature, "obstacle_no", tr("new")))]
        parts.append(_said(value(feature, "status", "added")))
        if radius_m:
            parts.append(tr("radius {0} m").format(number(radius_m, 2)))
        if confidence is not None:
            parts.append(tr("confidence {0:.0%}").format(confidence))
        self.here.setText(", ".join(parts))

    def tell_outline(self, path: str) -> None:
        """Tell of a plan's outline as it is now, and of all doubts."""
        field = plan_files.layers_of(path).get("field")
        row = None if field is None else next(field.getFeatures(), None)
        if row is None:
            self.title.setText(path)
            self._show_doubts([])
            return
        text = f"{value(row, 'name', '')}, {number(value(row, 'area_ha', 0.0), 2)} ha"
        certainty = value(row, "certainty")
        if certainty is not None:
            text += tr(", outline {0:.0%} certain").format(certainty)
        self.title.setText(text)
        outline = (value(row, "doubts") or "").split("; ")
        self._show_doubts(["; ".join(map(tr, outline)), *map(tr, self._obstacle_doubts)])

    def tell_figures(self, answer: Mapping[str, Any]) -> None:
        """Tell of tracks that the engine planned."""
        figures = answer["figures"]
        text = tr("Tracks: {0}, segments: {1}, {2} km").format(
            figures["tracks"], figures["segments"], number(figures["length_m"] / 1000, 2)
        )
        self.figures.setText("\n".join([text, *map(tr, answer.get("notes", []))]))
        self._obstacle_doubts = answer.get("doubts", [])

    def _show_doubts(self, doubts: list[str]) -> None:
        self.doubts.setText("\n".join(filter(None, doubts)))
        self.doubts.setVisible(any(doubts))


def _said(status: str) -> str:
    """A status in words."""
    words = {
        "detected": tr("detected"),
        "possible": tr("possible: not driven around"),
        "confirmed": tr("confirmed"),
        "rejected": tr("rejected"),
        "added": tr("added by hand"),
    }
    return words.get(status, status)
