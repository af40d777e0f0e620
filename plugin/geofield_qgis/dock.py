"""The review panel: obstacles in the order of doubt, decided by keys, tracks that follow."""

from __future__ import annotations

from collections.abc import Collection
from html import escape
from pathlib import Path
from typing import Any

from qgis.core import QgsCoordinateTransform, QgsPointXY, QgsProject, QgsVectorLayer
from qgis.PyQt.QtCore import QTimer
from qgis.PyQt.QtWidgets import (
    QDockWidget,
    QGridLayout,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from . import plan_files, sources
from .algorithm import path_of
from .engine import EngineError, said
from .jobs import Live
from .keys import REDO, UNDO, Keys, written
from .map_tools import BorrowedMap, CircleTool, Mark, PointTool
from .preview import Preview
from .review import OPEN, Review, by_doubt, value
from .review_labels import ReviewLabels
from .words import tr

#: Edits that follow each other this closely are planned once, milliseconds.
_PAUSE_MS = 60
_STEP_M = 0.25
#: Buttons that need no obstacle.
_OF_PLAN = ("draw", "save")


class ReviewDock(QDockWidget):
    """A panel for one plan: the one of the active layer, or the first of the project."""

    def __init__(self, iface: Any) -> None:
        super().__init__(tr("Review of a field"), iface.mainWindow())
        self.setObjectName("geofield_review")
        self.iface, self.canvas = iface, iface.mapCanvas()
        self.review: Review | None = None
        self.path = ""
        self.current: int | None = None
        self.borrowed = BorrowedMap(self.canvas)
        self.live = Live(self)
        self.live.failed.connect(self._fail)
        self._released: plan_files.Released | None = None
        self._connections: list[tuple[str, Any, Any]] = []
        self._mark = Mark(self.canvas)
        self.preview = Preview(self.canvas)
        self._build()
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(_PAUSE_MS)
        self._timer.timeout.connect(self.replan)
        QgsProject.instance().layersWillBeRemoved.connect(self._layers_go)

    # -- the panel ---------------------------------------------------------------------------

    def _build(self) -> None:
        body = QWidget(self)
        box = QVBoxLayout(body)
        self.labels = ReviewLabels(body)
        box.addWidget(self.labels)
        grid = QGridLayout()
        self.buttons: dict[str, QPushButton] = {}
        rows = (
            ("open", tr("Review the plan of the active layer"), "", self.open),
            ("previous", tr("Previous"), "K", lambda: self.step(-1)),
            ("next", tr("Next"), "J", lambda: self.step(1)),
            ("confirm", tr("Confirm"), "C", lambda: self.decide("confirmed")),
            ("reject", tr("Reject"), "R", lambda: self.decide("rejected")),
            ("smaller", tr("Smaller"), "-", lambda: self.resize_by(-_STEP_M)),
            ("larger", tr("Larger"), "+", lambda: self.resize_by(_STEP_M)),
            ("move", tr("Move: click its middle"), "M", self.begin_move),
            ("draw", tr("Draw: drag a circle"), "D", self.begin_draw),
            ("undo", tr("Undo"), "U", self.undo),
            ("redo", tr("Redo"), REDO, self.redo),
            ("save", tr("Save and plan again"), "S", self.save),
        )
        for number, (name, text, key, action) in enumerate(rows):
            button = QPushButton(f"{text}  ({written(key)})" if key else text)
            button.clicked.connect(action)
            self.buttons[name] = button
            column, wide = (0, 2) if name in ("open", "save") else ((number + 1) % 2, 1)
            grid.addWidget(button, (number + 1) // 2, column, 1, wide)
        actions = {key: action for *_, key, action in rows if key}
        actions[UNDO] = self.undo
        self._keys = Keys(self, self.canvas, actions, self._is_ours)
        box.addLayout(grid)
        box.addStretch(1)
        self.setWidget(body)
        self._tell()

    @property
    def _ready(self) -> bool:
        """Whether an edit would reach the plan: while its file is written, no layer holds it."""
        return self.review is not None and self._released is None

    @property
    def _unsaved(self) -> bool:
        """Whether edits that the tracks follow lie in no file yet."""
        return any(each.isModified() for each in self._followed())

    def _is_ours(self, key: str) -> bool:
        """Whether a key is the panel's now; QGIS's own are those of an active layer in editing."""
        active = self.iface.activeLayer()
        theirs = key in (UNDO, REDO) and isinstance(active, QgsVectorLayer) and active.isEditable()
        return self.isVisible() and self._ready and not theirs

    def _tell(self) -> None:
        """What the panel says of the plan as it is now."""
        layer = self.review.layer if self._ready else None
        for name, button in self.buttons.items():
            button.setEnabled(layer is not None and (name in _OF_PLAN or self.current is not None))
        self.buttons["open"].setEnabled(self._released is None)
        self.buttons["undo"].setEnabled(layer is not None and layer.undoStack().canUndo())
        self.buttons["redo"].setEnabled(layer is not None and layer.undoStack().canRedo())
        unsaved = layer is not None and self._unsaved
        self.setWindowTitle(tr("Review of a field") + (" *" if unsaved else ""))
        self.labels.tell(
            None if self.review is None else self.review.layer, self.path, self.current
        )

    # -- which plan --------------------------------------------------------------------------

    def open(self, path: str = "") -> bool:
        """Review a plan: the one named, that of the active layer, or the first one there is."""
        if self._released is not None and not path:
            return False  # the plan that is here is being written
        active = path_of(self.iface.activeLayer()) if self.iface.activeLayer() else ""
        others = map(path_of, QgsProject.instance().layerTreeRoot().layerOrder())
        for candidate in dict.fromkeys((path, active, *others)):
            obstacles = plan_files.obstacles_of(candidate) if candidate else None
            if obstacles is None:
                continue
            if not Path(candidate).is_file():
                gone = tr("{0} is not there: put it back, or choose a layer of another plan.")
                self._trouble(gone.format(candidate))
                return False
            self._take(candidate, obstacles)
            return True
        self._trouble(tr("There is no plan in this project: plan a field first."))
        return False

    def _take(self, path: str, layer: QgsVectorLayer) -> None:
        self.close_review()
        self.path, self.review = path, Review(layer)
        for each in self._followed():
            self._connect(each)
        self.current = None
        self._tell()
        self.step(1)
        self.replan(preview=self._unsaved)
        self._may_edit(of_one=False)

    def _followed(self) -> list[QgsVectorLayer]:
        """The layers whose edits the tracks follow: obstacles and outline."""
        outline = plan_files.layers_of(self.path).get("field")
        return [self.review.layer, *([] if outline is None else [outline])]

    def _connect(self, layer: QgsVectorLayer) -> None:
        for signal, slot in (
            (layer.undoStack().indexChanged, self._edited),
            (layer.afterCommitChanges, self._saved),
            (layer.afterRollBack, self._edited),
        ):
            signal.connect(slot)
            self._connections.append((layer.id(), signal, slot))

    def _disconnect(self, ids: Collection[str]) -> None:
        """Hear no more of layers; while they are there: of one that is gone QGIS would end."""
        for layer_id, signal, slot in self._connections:
            if layer_id in ids:
                signal.disconnect(slot)
        self._connections = [each for each in self._connections if each[0] not in ids]

    def close_review(self) -> None:
        """Let the plan go; what is in the edit buffer stays there."""
        self._disconnect({layer_id for layer_id, *_ in self._connections})
        self.review, self.current = None, None
        self._timer.stop()
        self.preview.clear()
        self._mark.show(None)
        self._tell()

    def _layers_go(self, ids: list[str]) -> None:
        self._disconnect(ids)
        if self.review is not None and self.review.layer.id() in ids:
            self.close_review()

    def remove(self) -> None:
        """Leave nothing in the window."""
        QgsProject.instance().layersWillBeRemoved.disconnect(self._layers_go)
        self.close_review()
        self._keys.remove()
        self.live.close()
        self._take_back()
        self.preview.remove()
        self._mark.remove()
        self.iface.removeDockWidget(self)
        self.deleteLater()

    # -- what the keys do --------------------------------------------------------------------

    def step(self, by: int) -> None:
        """Go to the next or previous obstacle in the order of doubt."""
        if self.review is None:
            return
        queue = by_doubt(self.review.layer)
        if not queue:
            return
        at = queue.index(self.current) + by if self.current in queue else 0
        self._go(queue[at % len(queue)])

    def _may_edit(self, *, of_one: bool = True) -> bool:
        """Whether there is something to edit; what is read-only is told."""
        if self.review is None or (of_one and self.current is None):
            return False
        if not self.review.layer.supportsEditing():
            self._trouble(tr("The obstacles are read-only here: nothing can be decided."))
            return False
        if of_one and not self._mark.is_of(self.review.layer, self.current):
            self._trouble(tr("The plan was changed outside of this panel: look again."))
            self._take(self.path, self.review.layer)
            return False
        return True

    def decide(self, status: str) -> None:
        """Confirm or reject the obstacle, and go to the most doubtful one that is left."""
        if not self._may_edit():
            return
        self.review.set_status(self.current, status)
        for feature_id in by_doubt(self.review.layer):
            if value(self.review.layer.getFeature(feature_id), "status", "added") in OPEN:
                self._go(feature_id)
                return
        self._go(self.current)

    def resize_by(self, by_m: float) -> None:
        """Make the obstacle a little larger or smaller."""
        if not self._may_edit():
            return
        if self.review.resize(self.current, by_m) is None:
            self._trouble(tr("This obstacle is not round: use QGIS's vertex tool."))
        self._show_mark()

    def begin_move(self) -> None:
        """The next click on the map is the obstacle's middle."""
        if self._may_edit():
            self.borrowed.use(PointTool(self.canvas, self._move_to, self.borrowed.drop))

    def _move_to(self, point: QgsPointXY, shift: bool, alt: bool) -> None:
        self.borrowed.drop()
        if self._ready and self._may_edit():
            self.review.move(self.current, self._to_layer(point))
            self._show_mark()

    def begin_draw(self) -> None:
        """The next drag on the map is a new obstacle."""
        if self._may_edit(of_one=False):
            self.borrowed.use(CircleTool(self.canvas, self._drawn, self.borrowed.drop))

    def _drawn(self, middle: QgsPointXY, edge: QgsPointXY) -> None:
        self.borrowed.drop()
        if not self._ready:
            return
        middle, edge = self._to_layer(middle), self._to_layer(edge)
        self.current = self.review.add(middle, middle.distance(edge))
        self._show_mark()
        self._tell()

    def undo(self) -> None:
        """Take the last edit back; it is the layer's own undo."""
        if self.review is not None:
            self._show_changed(self.review.undo())

    def redo(self) -> None:
        """Make the edit again that was taken back last; it is the layer's own redo."""
        if self.review is not None:
            self._show_changed(self.review.redo())

    def _show_changed(self, changed: list[int]) -> None:
        if len(changed) == 1:  # seen, and what the next key speaks of
            self._go(changed[0])
        self._show_mark()

    def save(self) -> None:
        """Save the edits into the plan's file; the tracks in it follow."""
        if not self._ready:
            return
        edited = [each for each in self._followed() if each.isModified()]
        for layer in edited:
            if not layer.commitChanges():
                self._trouble("; ".join(layer.commitErrors()))
        if not edited:
            self._saved()

    # -- tracks that follow ------------------------------------------------------------------

    def _edited(self, *_: Any) -> None:
        self._timer.start()
        self.review.layer.triggerRepaint()
        self._show_mark()
        self._tell()

    def replan(self, *, preview: bool = True) -> None:
        """Ask for the tracks of the layers as they are now, saved or not."""
        if self.review is None:
            return
        edited = plan_files.as_edited(self.path, self.review.layer)
        question = {"do": "plan", "file": self.path, **edited}
        self.live.ask(question, self._show_tracks if preview else self._show_figures)

    def _show_tracks(self, answer: dict[str, Any]) -> None:
        if self.review is None:
            return
        layers = plan_files.layers_of(self.path)
        if "route" in layers:
            waits = tr("The route is planned anew when the edits are saved.")
            answer = {**answer, "notes": [*answer.get("notes", []), waits]}
        if self._show_figures(answer):
            self.preview.show(answer, self.review.layer.crs(), layers)

    def _show_figures(self, answer: dict[str, Any]) -> bool:
        if "error" in answer:
            self._trouble(said(answer["error"]))
            return False
        self.labels.tell_figures(answer)
        self.labels.tell_outline(self.path)
        return True

    def _saved(self) -> None:
        # After the signal: QGIS is still at work on the layer while it is sent.
        QTimer.singleShot(0, self._write)

    def _write(self) -> None:
        if not self._ready:
            return
        self._show_mark()  # what was new has another id now
        try:  # to let go of the file ends what is edited in any of its layers
            for layer in plan_files.all_of(self.path):
                sources.refuse_unsaved(layer)
        except EngineError as error:
            self._trouble(str(error))
            return
        self._mark.show(None)
        self._released = plan_files.Released(self.path)
        self._timer.stop()
        self._tell()
        self.live.ask({"do": "write", "file": self.path}, self._written)

    def _written(self, answer: dict[str, Any]) -> None:
        self._take_back()
        if self.review is None:  # its layers were removed meanwhile
            return
        if self._show_figures(answer):
            self.preview.clear()
        self.current = None
        self.step(1)
        self._tell()

    def _fail(self, why: str) -> None:
        self._take_back()
        self._trouble(why)

    def _take_back(self) -> None:
        released, self._released = self._released, None
        if released is not None:
            released.back()
            self._tell()

    # -- the map -----------------------------------------------------------------------------

    def _go(self, feature_id: int) -> None:
        self.current = feature_id
        self._show_mark()
        self._mark.look_at()
        self._tell()

    def _show_mark(self) -> None:
        self._mark.show(None if self.review is None else self.review.layer, self.current)
        if not self._mark.is_shown:  # deleted: the next key speaks of none
            self.current = None

    def _to_layer(self, point: QgsPointXY) -> QgsPointXY:
        return QgsCoordinateTransform(
            self.canvas.mapSettings().destinationCrs(),
            self.review.layer.crs(),
            QgsProject.instance(),
        ).transform(point)

    def _trouble(self, text: str) -> None:
        bar, text = self.iface.messageBar(), escape(text)  # the bar reads HTML
        if all(item.text() != text for item in bar.items()):  # each edit would tell it again
            bar.pushWarning("geofield", text)
