"""The panel and the clicks without QGIS's own window; run by Debian's Python, prints JSON.

    /usr/bin/python3 panel.py '{"do": "saved_with_edits", "plan": "..."}'

Real are the map, the message bar and the project; the window around them is a bare one.
"""

import os
import sys
import time

from client import answer
from qgis.core import (
    QgsApplication,
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsPointXY,
    QgsProject,
    QgsRasterLayer,
)
from qgis.gui import QgsMapCanvas, QgsMapToolPan, QgsMessageBar
from qgis.PyQt.QtCore import QEvent, QPoint, Qt
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import QAction, QMainWindow, QTextBrowser

LONLAT = QgsCoordinateReferenceSystem("EPSG:4326")


class Window:
    """What the plugin asks of QGIS's window."""

    def __init__(self):
        self.main = QMainWindow()
        self.canvas = QgsMapCanvas(self.main)
        self.bar = QgsMessageBar(self.main)
        self.main.show()

    def mainWindow(self):
        return self.main

    def mapCanvas(self):
        return self.canvas

    def messageBar(self):
        return self.bar

    active = None

    def activeLayer(self):
        return self.active

    def said(self):
        """What a person reads in the messages."""
        return [each.toPlainText() for each in self.bar.findChildren(QTextBrowser)]


def until(ready, wait_s=60):
    end = time.monotonic() + wait_s
    while not ready():
        QgsApplication.processEvents()
        # As the loop of a window does, which these are not in.
        QgsApplication.sendPostedEvents(None, QEvent.DeferredDelete)
        time.sleep(0.01)
        assert time.monotonic() < end, window.said()


def reviewed(plan):
    """The layers of a plan, and the panel with it; not yet opened."""
    from geofield_qgis import results
    from geofield_qgis.dock import ReviewDock

    layers = results.show(plan)
    window.canvas.setDestinationCrs(layers["field"].crs())
    return layers, ReviewDock(window)


def settled(dock):
    until(lambda: not (dock._timer.isActive() or dock.live.busy) and dock._released is None)


def saved_with_edits(plan):
    """S while another layer of the plan is edited, and again when that is saved."""
    layers, dock = reviewed(plan)
    twice = layers["segments"].clone()
    QgsProject.instance().addMapLayer(twice)
    rows = twice.featureCount()
    dock.open(plan)
    dock.decide("rejected")
    edited = layers["segments"]
    edited.startEditing()
    edited.deleteFeature(next(edited.getFeatures()).id())
    dock.save()
    QgsApplication.processEvents()
    settled(dock)
    answer = {"said": window.said(), "still_edited": edited.isModified(), "before": rows}
    edited.rollBack()
    dock.save()
    QgsApplication.processEvents()
    settled(dock)
    shown = [len(list(each.getFeatures())) for each in (edited, twice)]
    return {**answer, "shown": shown, "rejected": dock.labels.count.text()}


def filtered(plan):
    """The figures of a plan of which some obstacles are filtered away."""
    layers, dock = reviewed(plan)
    figures = []
    for some in ("", "obstacle_no < 4"):
        layers["obstacles"].setSubsetString(some)
        dock.open(plan)
        settled(dock)
        figures.append(dock.labels.figures.text())
    return {"figures": figures, "count": dock.labels.count.text()}


def read_only(plan):
    """A plan that cannot be edited, with what might be HTML in its name."""
    layers, dock = reviewed(plan)
    layers["obstacles"].setReadOnly(True)
    dock.open(plan)
    settled(dock)
    dock._trouble("The layer <b>A & B</b> is edited")
    return window.said()


def without_radius(plan):
    """A radius of 0, as programs write it that know no empty number."""
    layers, dock = reviewed(plan)
    layer = layers["obstacles"]
    layer.startEditing()
    first = next(layer.getFeatures())
    layer.changeAttributeValue(first.id(), layer.fields().indexOf("radius_m"), 0.0)
    area = first.geometry().area()
    larger = dock_review(dock, layer).resize(first.id(), 0.25)
    return [larger, layer.getFeature(first.id()).geometry().area() / area]


def dock_review(dock, layer):
    from geofield_qgis.review import Review

    dock.review = Review(layer)
    return dock.review


def project_saved_meanwhile(plan, home):
    """A project that is saved while the plan is written: its layers, opened again."""
    layers, dock = reviewed(plan)
    layers["tracks"].setFieldAlias(1, "Course")
    rows = {name: each.featureCount() for name, each in layers.items() if name != "scene"}
    dock.open(plan)
    settled(dock)
    dock.decide("confirmed")
    dock.save()
    until(lambda: dock._released is not None)
    project = QgsProject.instance()
    project.write(f"{home}/project.qgs")
    settled(dock)
    dock.close_review()
    project.clear()
    project.read(f"{home}/project.qgs")
    found = {each.name().lower().replace(" ", "_"): each for each in project.mapLayers().values()}
    return {
        "before": rows,
        "after": {name: found[name].featureCount() for name in rows},
        "alias": found["tracks"].attributeAlias(1),
        "coloured": type(found["obstacles"].renderer()).__name__,
    }


def discarded(plan):
    """What the panel is told of an edit after saving, and of layers that go with edits."""
    _, dock = reviewed(plan)
    dock.open(plan)
    settled(dock)
    dock.decide("confirmed")
    dock.save()
    until(lambda: dock._released is not None)
    settled(dock)
    told, tell, troubles = [], dock._tell, []
    dock._tell = lambda: (told.append(dock.windowTitle()), tell())
    sys.excepthook = lambda *trouble: troubles.append(repr(trouble[1]))
    dock.review.set_status(dock.current, "rejected")
    edited = len(told)
    settled(dock)
    QgsProject.instance().clear()
    return {"edited": edited, "troubles": troubles, "title": dock.windowTitle()}


def tools(plan):
    """Which tool has the map after the keys, and how many obstacles were drawn and moved."""
    layers, dock = reviewed(plan)
    dock.open(plan)
    settled(dock)
    canvas, view, hand = window.canvas, window.canvas.viewport(), QgsMapToolPan(window.canvas)
    canvas.setMapTool(hand)
    place, rows, found = view.rect().center(), layers["obstacles"].featureCount(), {}

    def drag(pixels, button):
        QTest.mousePress(view, button, pos=place)
        QTest.mouseMove(view, place + QPoint(pixels, 0))
        QTest.mouseRelease(view, button, pos=place + QPoint(pixels, 0))

    dock.begin_draw()
    QTest.keyClick(canvas, Qt.Key.Key_Escape)
    found["escaped"] = canvas.mapTool() is hand
    dock.begin_move()
    dock.begin_draw()
    dock.begin_draw()
    drag(2, Qt.MouseButton.LeftButton)
    drag(40, Qt.MouseButton.RightButton)
    found["slips"] = layers["obstacles"].featureCount() - rows
    drag(40, Qt.MouseButton.LeftButton)
    found["drawn"] = layers["obstacles"].featureCount() - rows
    found["given_back"] = canvas.mapTool() is hand
    settled(dock)
    return found


def keys(plan):
    """What keys do on the map and on a button of the panel, and with the panel hidden."""
    layers, dock = reviewed(plan)
    window.main.addDockWidget(Qt.DockWidgetArea.RightDockWidgetArea, dock)
    dock.open(plan)
    settled(dock)
    layer, found = layers["obstacles"], {}
    first, theirs = dock.current, QAction(window.main)
    theirs.setShortcut("R")
    window.main.addAction(theirs)
    radius_m = layer.getFeature(first)["radius_m"]
    # As keyboards of the United States and of Germany write it.
    for place, held in (
        (window.canvas, Qt.KeyboardModifier.ShiftModifier),
        (dock.buttons["next"], Qt.KeyboardModifier.NoModifier),
    ):
        QTest.keyClick(place, "+", held)
    found["larger_m"] = layer.getFeature(first)["radius_m"] - radius_m
    QTest.keyClick(dock.buttons["next"], "r")
    found["rejected"] = layer.getFeature(first)["status"]
    steps = layer.undoStack().index()
    QTest.keyClick(window.canvas, "r", Qt.KeyboardModifier.ControlModifier)
    QTest.keyClick(window.canvas, "r", Qt.KeyboardModifier.ShiftModifier)
    dock.hide()
    QTest.keyClick(window.canvas, "r")
    found["others"] = layer.undoStack().index() - steps
    settled(dock)
    return found


def undone(plan):
    """Which obstacles are otherwise after each undo, and how many were looked at to know it."""
    layers, dock = reviewed(plan)
    layer, found = layers["obstacles"], []
    review = dock_review(dock, layer)
    one, other, gone = [each.id() for each in layer.getFeatures()][:3]
    middle = layer.getFeature(other).geometry().centroid().asPoint()
    review.set_status(one, "rejected")
    review.move(other, QgsPointXY(middle.x() + 3, middle.y()))
    layer.deleteFeature(gone)
    review.add(middle, 2.0)
    looked, features = [], layer.getFeatures
    layer.getFeatures = lambda *words: looked.append(words) or features(*words)
    for _ in range(5):
        found.append(review.undo())
    again = [review.redo() for _ in range(5)]
    return {"ids": [one, other, gone], "found": found, "again": again, "looked": len(looked)}


def redone(plan):
    """An edit taken back and made again by keys, after the panel took the plan over once more."""
    layers, dock = reviewed(plan)
    dock.show()
    dock.open(plan)
    settled(dock)
    layer, first, said = layers["obstacles"], dock.current, dock.labels
    control, shift = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier

    def seen():
        settled(dock)
        state = layer.getFeature(first)["status"], said.figures.text()
        return [*state, *(dock.buttons[name].isEnabled() for name in ("undo", "redo"))]

    found = {"opened": seen()}
    dock.decide("rejected")
    found["rejected"] = seen()
    QTest.keyClick(window.canvas, "z", control)
    found["undone"] = seen()
    dock.open(plan)
    dock.step(1)
    window.active = layers["field"]
    window.active.startEditing()
    QTest.keyClick(window.canvas, "z", control | shift)
    found["of_another"] = seen()
    window.active.rollBack()
    QTest.keyClick(window.canvas, "z", control | shift)
    found["redone"] = seen()
    found["at"] = [dock.current == first, dock.buttons["redo"].text()]
    return found


def routed(plan):
    """A plan with a route while an obstacle is rejected, and when that is saved."""
    layers, dock = reviewed(plan)
    root = QgsProject.instance().layerTreeRoot()
    names = ("headland_tracks", "route", "turns")
    nodes = [root.findLayer(layers[each].id()) for each in names]
    for node in nodes:
        node.setItemVisibilityChecked(True)
    dock.open(plan)
    settled(dock)
    answer = {"opened": dock.labels.figures.text()}
    dock.decide("rejected")
    settled(dock)
    answer["edited"] = [dock.labels.figures.text(), [each.isVisible() for each in nodes]]
    around = dock.preview._bands["headland_tracks"]
    answer["around_m"] = around.asGeometry().length()
    dock.save()
    QgsApplication.processEvents()
    settled(dock)
    answer["saved"] = [dock.labels.figures.text(), [each.isVisible() for each in nodes]]
    return answer


def in_german(plan, doubts):
    """What the panel of a German QGIS says of a plan, and how its layers are shown."""
    from geofield_qgis.words import Words

    words = Words("de")
    QgsApplication.installTranslator(words)
    layers, dock = reviewed(plan)
    field = layers["field"]
    where = field.fields().indexFromName("doubts")
    row = next(field.getFeatures()).id()
    field.dataProvider().changeAttributeValues({row: {where: doubts}})
    dock.open(plan)
    settled(dock)
    obstacles = layers["obstacles"]
    return {
        "doubts": dock.labels.doubts.text(),
        "figures": dock.labels.figures.text(),
        "layers": [each.name() for each in layers.values()],
        "legend": [each.label() for each in obstacles.renderer().legendSymbolItems()],
        "styled": obstacles.loadDefaultStyle()[1],
        "in_file": [each.label() for each in obstacles.renderer().legendSymbolItems()],
    }


def clicks(picture, lon, lat, home):
    """A click whose message is closed, one with Shift in another CRS, one that is stopped."""
    from geofield_qgis.planner import Planner

    project, layer = QgsProject.instance(), QgsRasterLayer(picture, "picture")
    project.addMapLayer(layer)
    project.write(f"{home}/project.qgz")
    window.canvas.setLayers([layer])
    window.canvas.setDestinationCrs(layer.crs())
    planner, plans = Planner(window), []
    planner.finished.connect(plans.append)
    place = QgsCoordinateTransform(LONLAT, layer.crs(), project).transform(QgsPointXY(lon, lat))

    planner.click(place, False, False)
    until(lambda: planner._bar is not None)
    window.bar.popWidget()  # as its cross does
    until(lambda: plans, 200)
    first = sorted(each.name() for each in project.mapLayers().values())

    window.canvas.setDestinationCrs(LONLAT)
    planner.click(QgsPointXY(lon + 0.0003, lat + 0.0003), True, False)
    until(lambda: len(plans) > 1, 200)

    planner.click(QgsPointXY(lon - 0.0003, lat + 0.0003), True, False)
    gone = sorted(each.name() for each in project.mapLayers().values())
    planner.clear()
    stopped = sorted(each.name() for each in project.mapLayers().values())
    return {"plans": plans, "first": first, "gone": gone, "stopped": stopped}


_ALL = (
    saved_with_edits, filtered, read_only, without_radius, project_saved_meanwhile, discarded,
    tools, keys, undone, redone, routed, in_german, clicks,
)  # fmt: skip
ACTIONS = {each.__name__: each for each in _ALL}


def begin():
    """A QGIS with the plugin at hand, and the window."""
    global application, window  # noqa: PLW0603 - there is one of each
    QgsApplication.setPrefixPath("/usr", True)
    application = QgsApplication([], True)
    application.initQgis()
    sys.path += ["/usr/share/qgis/python/plugins", os.environ["QGIS_PLUGINPATH"]]
    window = Window()
    return window


if __name__ == "__main__":
    begin()
    answer(ACTIONS)
