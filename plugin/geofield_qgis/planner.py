"""Plan the field here: a click, and outline, obstacles and tracks come up one after the other."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from html import escape
from pathlib import Path
from typing import Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsCsException,
    QgsGeometry,
    QgsPointXY,
    QgsProject,
    QgsRasterLayer,
    QgsVectorLayer,
    QgsWkbTypes,
)
from qgis.PyQt.QtCore import QObject, QStandardPaths, pyqtSignal
from qgis.PyQt.QtWidgets import QProgressBar, QPushButton

from . import description, engine, plan_files, results, sources
from .jobs import Awake, Job
from .map_tools import band
from .words import number, tr

LONLAT = QgsCoordinateReferenceSystem("EPSG:4326")
#: Distance between the tracks that a click plans, metres.
SPACING_M = 4


class Planner(QObject):
    """One field being planned from clicks on the map.

    The stages run one after the other in the engine; what is known already is sketched on the
    map. A further click with Shift says that more ground belongs to the field, with Alt that
    some does not: the outline is then found anew, and all after it.
    """

    finished = pyqtSignal(str)
    engine_missing = pyqtSignal(str)

    def __init__(self, iface: Any) -> None:
        super().__init__(iface.mainWindow())
        self.iface = iface
        canvas = iface.mapCanvas()
        self._sketch = {
            "field": band(canvas, QgsWkbTypes.GeometryType.PolygonGeometry, "#ffd54f", 3),
            "obstacles": band(canvas, QgsWkbTypes.GeometryType.PolygonGeometry, "#ff7043"),
        }
        self._points = band(canvas, QgsWkbTypes.GeometryType.PointGeometry, "#00c853", 6)
        self._job: Job | None = None
        #: The next command line, loading its libraries while a person looks where to click.
        self.awake = Awake()
        self._item: Any = None
        iface.messageBar().widgetRemoved.connect(self._message_goes)
        self._bar: QProgressBar | None = None
        self._target: Path | None = None
        # In longitude and latitude: the CRS of the map may be another one at the next click.
        self._here: QgsPointXY | None = None
        self._ground: dict[str, list[QgsPointXY]] = {"include": [], "exclude": []}
        self._begun_s = 0.0
        #: A click was made and there is no engine yet.
        self.waits = False
        #: Seconds from the click to the sketch of the outline, of the last field.
        self.outline_s: float | None = None

    def click(self, point: QgsPointXY, shift: bool, alt: bool) -> None:
        """A click on the map, in its CRS."""
        more = (shift or alt) and self._here is not None
        try:
            place = self._lonlat(point)
            for layer in plan_files.all_of(str(self._target)) if more else ():
                sources.refuse_unsaved(layer)
        except (engine.EngineError, QgsCsException) as error:
            self._say(str(error))
            return
        if more:
            self._ground["exclude" if alt else "include"].append(place)
        else:
            self._here, self._target = place, None
            self._ground = {"include": [], "exclude": []}
            self._points.reset(QgsWkbTypes.GeometryType.PointGeometry)
        self._points.addPoint(point)
        self.stop()
        self._begin()

    def go_on(self) -> None:
        """Plan what was clicked before there was an engine."""
        self.awake.wake()
        self._begin()

    def stop(self) -> None:
        """End what runs; what was planned before stays."""
        if self._job is not None:
            self._job.stop()
            self._job = None
        self._clear_message()

    def clear(self) -> None:
        """Stop, and take the sketches off the map."""
        if self._job is not None:
            self.stop()
            self._show_plan()
        for each in self._sketch.values():
            each.reset(QgsWkbTypes.GeometryType.PolygonGeometry)
        self._points.reset(QgsWkbTypes.GeometryType.PointGeometry)
        self._here, self.waits = None, False

    def remove(self) -> None:
        """Leave nothing on the map, and no process."""
        self.stop()
        self.iface.messageBar().widgetRemoved.disconnect(self._message_goes)
        self.awake.sleep()
        scene = self.iface.mapCanvas().scene()
        for each in (*self._sketch.values(), self._points):
            scene.removeItem(each)

    # -- the stages --------------------------------------------------------------------------

    def _begin(self) -> None:
        picture = self._picture()
        if picture is None:
            self._say(tr("There is no picture here: add a raster layer of the place first."))
            return
        self._imagery, self._environment = sources.imagery(picture)
        if self._environment:
            self._say(
                tr(
                    "Whether the terms of {0} allow this is for you to say: use Plan a field in "
                    "the toolbox, or a picture of your own."
                ).format(picture.name())
            )
            return
        try:
            engine.require_engine()
        except engine.EngineError as error:
            self.waits = True
            self.engine_missing.emit(str(error))
            return
        self.waits = False
        if self._target is None:
            self._target = _folder() / time.strftime("field_%Y%m%d_%H%M%S.gpkg")
        for each in self._sketch.values():
            each.reset(QgsWkbTypes.GeometryType.PolygonGeometry)
        self._begun_s = time.monotonic()
        self._show_progress()
        self._forget_layers()
        words = ["--lat", f"{self._here.y():.9f}", "--lon", f"{self._here.x():.9f}"]
        for name, points in self._ground.items():
            for point in points:
                option = description.settings()[f"field.{name}"]["option"]
                words += [option, f"{point.x():.9f},{point.y():.9f}"]
        words += ["-o", str(self._target), "--overwrite", "--json"]
        self._run("field", ["field", self._imagery, *words])

    def _run(self, stage: str, words: list[str]) -> None:
        titles = {
            "field": tr("Finding the outline..."),
            "obstacles": tr("Finding the obstacles..."),
            "tracks": tr("Planning the tracks..."),
        }
        self._clear_message()
        self._show_progress(titles[stage])
        try:
            job = Job(words, self._environment, self, self.awake)
        except engine.EngineError as error:
            self._fail(str(error))
            return
        job.progressed.connect(self._progress)
        job.failed.connect(self._fail)
        job.done.connect(lambda result: self._done(stage, result))
        self._job = job
        self.awake.wake()

    def _done(self, stage: str, result: engine.Result) -> None:
        target = str(self._target)
        if stage == "field":
            self._draw("field")
            self.outline_s = time.monotonic() - self._begun_s
            self._run("obstacles", ["obstacles", self._imagery, target, "-o", target])
        elif stage == "obstacles":
            self._draw("obstacles")
            self._run(
                "tracks", ["tracks", target, "-o", target, "--spacing", str(SPACING_M), "--json"]
            )
        else:
            self._job = None
            self._clear_message()
            results.show(target)
            for each in self._sketch.values():
                each.reset(QgsWkbTypes.GeometryType.PolygonGeometry)
            (row,) = result.data["fields"]
            self._say(
                tr("Tracks: {0}, {1} km. Shift+click adds ground, Alt+click takes it away.").format(
                    row["track_count"], number(row["length_m"] / 1000, 1)
                ),
                good=True,
            )
            self.finished.emit(target)

    def _draw(self, name: str) -> None:
        """Sketch a layer of the file as it is now, and let go of the file."""
        layer = QgsVectorLayer(f"{self._target}|layername={name}", name, "ogr")
        sketch = self._sketch[name]
        sketch.reset(QgsWkbTypes.GeometryType.PolygonGeometry)
        for feature in layer.getFeatures():
            sketch.addGeometry(QgsGeometry(feature.geometry()), layer.crs())

    def _forget_layers(self) -> None:
        """Layers of the same plan, planned anew now, leave the project."""
        for layer in plan_files.all_of(str(self._target)):
            QgsProject.instance().removeMapLayer(layer.id())

    def _show_plan(self) -> None:
        """Show what the file holds where the plan was not made anew."""
        if self._target is not None and self._target.is_file():
            results.show(self._target)

    def _picture(self) -> QgsRasterLayer | None:
        """The picture at the place: the active layer, or the topmost one that shows it."""
        canvas = self.iface.mapCanvas()
        for layer in [self.iface.activeLayer(), *canvas.layers()]:
            if not isinstance(layer, QgsRasterLayer) or not layer.isValid():
                continue
            turned = QgsCoordinateTransform(LONLAT, layer.crs(), QgsProject.instance())
            try:
                if layer.extent().contains(turned.transform(self._here)):
                    return layer
            except QgsCsException:
                continue
        return None

    def _lonlat(self, point: QgsPointXY) -> QgsPointXY:
        crs = self.iface.mapCanvas().mapSettings().destinationCrs()
        return QgsCoordinateTransform(crs, LONLAT, QgsProject.instance()).transform(point)

    # -- what the person sees ----------------------------------------------------------------

    def _show_progress(self, title: str = "") -> None:
        if self._item is not None or not title:
            return
        messages = self.iface.messageBar()
        self._item = messages.createMessage("geofield", title)
        self._bar = QProgressBar()
        self._bar.setRange(0, 0)
        self._bar.setMaximumWidth(160)
        button = QPushButton(tr("Stop"))
        button.clicked.connect(self.clear)
        self._item.layout().addWidget(self._bar)
        self._item.layout().addWidget(button)
        messages.pushWidget(self._item)

    def _progress(self, done: int, total: int, what: str) -> None:
        if self._bar is not None and total > 1:
            self._bar.setRange(0, total)
            self._bar.setValue(done)

    def _clear_message(self) -> None:
        item, self._item, self._bar = self._item, None, None
        if item is not None:
            self.iface.messageBar().popWidget(item)

    def _message_goes(self, item: Any) -> None:
        """A person closed it; the work goes on."""
        if item == self._item:
            self._item = self._bar = None

    def _fail(self, why: str) -> None:
        self._job = None
        self._clear_message()
        self._show_plan()
        self._say(why)

    def _say(self, text: str, *, good: bool = False) -> None:
        bar = self.iface.messageBar()
        # The bar reads HTML.
        (bar.pushSuccess if good else bar.pushWarning)("geofield", escape(text))


def _folder() -> Path:
    """Where clicked plans go: beside the project, or among the person's documents."""
    documents = QStandardPaths.writableLocation(QStandardPaths.StandardLocation.DocumentsLocation)
    for home in filter(None, (QgsProject.instance().homePath(), documents)):
        folder = Path(home) / "geofield"
        with suppress(OSError):  # a project may lie where nothing can be written
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                break
    return folder
