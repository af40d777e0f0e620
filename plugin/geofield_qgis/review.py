"""Edits of a review, each one step of the layer's own edit buffer, so that undo is QGIS's own."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Callable

from qgis.core import NULL, QgsFeature, QgsGeometry, QgsPointXY, QgsVectorLayer
from qgis.PyQt.QtGui import QTransform

from .words import tr

#: Statuses that a person has not spoken about.
OPEN = ("detected", "possible")
#: Smallest and largest radius that an edit makes, metres.
RADII_M = (0.1, 200.0)
#: Corners of a circle that is drawn.
_CORNERS_PER_QUARTER = 12
#: How much of the circle around it a circle with corners fills at least.
_CIRCLE = 0.98


def value(feature: QgsFeature, name: str, default: Any = None) -> Any:
    """An attribute; the default where it is empty or there is no such column."""
    index = feature.fields().indexOf(name)
    found = feature.attribute(index) if index >= 0 else None
    return default if found is None or found == NULL else found


def doubt(feature: QgsFeature) -> float:
    """How much a look is worth: 1 where it could be either way, 0 where nothing is unsure."""
    return 1.0 - abs(2.0 * float(value(feature, "confidence", 0.5)) - 1.0)


def _radius_m(feature: QgsFeature) -> float | None:
    """Of a round obstacle; one that was drawn is round where it is a circle.

    0 is none, as programs write it that know no empty number.
    """
    known = value(feature, "radius_m")
    if known or value(feature, "status") in OPEN:
        return known or None
    _, _, around = feature.geometry().minimalEnclosingCircle()
    is_circle = feature.geometry().area() > _CIRCLE * math.pi * around**2
    return around - value(feature, "buffer_m", 0.0) if is_circle else None


def by_doubt(layer: QgsVectorLayer) -> list[int]:
    """Ids of the obstacles: those nobody spoke about first, the most doubtful at the front."""
    found = []
    for feature in layer.getFeatures():
        if not feature.hasGeometry():
            continue
        reviewed = value(feature, "status", "added") not in OPEN
        number = value(feature, "obstacle_no", 0)
        found.append((reviewed, -doubt(feature), number, feature.id()))
    return [each[-1] for each in sorted(found)]


def counts(layer: QgsVectorLayer) -> dict[str, int]:
    """Obstacles by status."""
    found: dict[str, int] = {}
    for feature in layer.getFeatures():
        status = value(feature, "status", "added")
        found[status] = found.get(status, 0) + 1
    return found


class Review:
    """What a person says of the obstacles of one plan.

    Parameters
    ----------
    layer : QgsVectorLayer
        The layer `obstacles`; an edit puts it into editing.
    """

    def __init__(self, layer: QgsVectorLayer) -> None:
        self.layer = layer

    def set_status(self, feature_id: int, status: str) -> None:
        """Confirm or reject."""
        with self._step(tr("Status {0}").format(status)):
            self._set(feature_id, "status", status)

    def move(self, feature_id: int, to: QgsPointXY) -> None:
        """Put an obstacle's middle to another place, in the layer's CRS."""
        geometry = QgsGeometry(self.layer.getFeature(feature_id).geometry())
        middle = geometry.centroid().asPoint()
        geometry.translate(to.x() - middle.x(), to.y() - middle.y())
        with self._step(tr("Move obstacle")):
            self.layer.changeGeometry(feature_id, geometry)
            self._stands(feature_id)

    def resize(self, feature_id: int, by_m: float) -> float | None:
        """Make a round obstacle larger or smaller; its new radius, None for what is not round."""
        feature = self.layer.getFeature(feature_id)
        radius_m = _radius_m(feature)
        if radius_m is None:
            return None
        margin_m = value(feature, "buffer_m", 0.0)
        new_m = min(max(radius_m + by_m, RADII_M[0]), RADII_M[1])
        geometry = QgsGeometry(feature.geometry())
        middle = geometry.centroid().asPoint()
        # The shape keeps the scale that the engine drew it with, so metres stay true.
        factor = (new_m + margin_m) / (radius_m + margin_m)
        scaling = QTransform().translate(middle.x(), middle.y())
        geometry.translate(-middle.x(), -middle.y())
        geometry.transform(QTransform.fromScale(factor, factor))
        geometry.transform(scaling)
        with self._step(tr("Radius of obstacle")):
            self.layer.changeGeometry(feature_id, geometry)
            if value(feature, "radius_m") is not None:
                self._set(feature_id, "radius_m", new_m)
            self._stands(feature_id)
        return new_m

    def add(self, middle: QgsPointXY, radius: float) -> int:
        """Draw a round obstacle that nobody had found, in units of the layer's CRS; its id.

        It is taken exactly as drawn: the circle is what no vehicle enters.
        """
        feature = QgsFeature(self.layer.fields())
        circle = QgsGeometry.fromPointXY(middle).buffer(radius, _CORNERS_PER_QUARTER)
        feature.setGeometry(circle)
        feature.setAttribute("status", "added")
        with self._step(tr("Draw obstacle")):
            self.layer.addFeature(feature)
        return feature.id()

    def undo(self) -> list[int]:
        """Take the last edit back; the ids of the obstacles that are otherwise now."""
        return self._changed_by(self.layer.undoStack().undo)

    def redo(self) -> list[int]:
        """Make the edit again that was taken back last; the ids as for :meth:`undo`."""
        return self._changed_by(self.layer.undoStack().redo)

    def _changed_by(self, act: Callable[[], None]) -> list[int]:
        changed: dict[int, None] = {}

        def note(feature_id: int, *_: Any) -> None:
            changed[feature_id] = None

        layer = self.layer
        signals = (layer.attributeValueChanged, layer.geometryChanged, layer.featureAdded)
        for signal in signals:
            signal.connect(note)
        try:
            act()
        finally:
            for signal in signals:
                signal.disconnect(note)
        return list(changed)

    @contextmanager
    def _step(self, name: str) -> Iterator[None]:
        """One edit, one step to undo."""
        if not self.layer.isEditable():
            self.layer.startEditing()
        self.layer.beginEditCommand(name)
        try:
            yield
        except BaseException:
            self.layer.destroyEditCommand()
            raise
        self.layer.endEditCommand()

    def _set(self, feature_id: int, name: str, new: Any) -> None:
        index = self.layer.fields().indexOf(name)
        self.layer.changeAttributeValue(feature_id, index, new)

    def _stands(self, feature_id: int) -> None:
        """A place or size that a person gave says that the thing is there."""
        if value(self.layer.getFeature(feature_id), "status") != "added":
            self._set(feature_id, "status", "confirmed")
