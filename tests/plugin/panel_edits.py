"""Edits around the panel that its keys do not make; run by Debian's Python as `panel` is."""

from pathlib import Path

import panel
from client import answer
from osgeo import ogr
from panel import begin, reviewed, settled, until
from qgis.core import QgsApplication, QgsFeature, QgsGeometry, QgsProject, QgsRectangle
from qgis.PyQt.QtCore import QEvent, Qt
from qgis.PyQt.QtGui import QKeyEvent
from qgis.PyQt.QtTest import QTest


def opened(plan):
    layers, dock = reviewed(plan)
    dock.show()
    dock.open(plan)
    settled(dock)
    return layers, dock


def written(dock):
    until(lambda: dock._released is not None)
    settled(dock)


def outline(plan):
    """An outline that is edited in QGIS, with an obstacle, and once more by itself."""
    layers, dock = opened(plan)
    field, found = layers["field"], []

    def narrower():
        field.startEditing()
        row = next(field.getFeatures())
        field.changeGeometry(row.id(), row.geometry().buffer(-10, 4))
        until(dock._timer.isActive)
        settled(dock)
        return dock.labels.figures.text(), dock.windowTitle()

    found.append((dock.labels.figures.text(), dock.windowTitle()))
    found.append(narrower())
    dock.decide("rejected")
    settled(dock)
    dock.save()
    written(dock)
    found.append((dock.labels.figures.text(), dock.windowTitle()))
    found.append(narrower())
    field.commitChanges()
    written(dock)
    found.append((dock.labels.figures.text(), layers["tracks"].featureCount()))
    return {"found": found, "said": panel.window.said()}


def outline_cut(plan):
    """An outline that was cut in two, and one that was deleted."""
    layers, dock = opened(plan)
    field, said = layers["field"], panel.window.said
    field.startEditing()
    row = next(field.getFeatures())
    box = row.geometry().boundingBox()
    west = QgsRectangle(box.xMinimum(), box.yMinimum(), box.center().x(), box.yMaximum())
    half = QgsGeometry.fromRect(west).intersection(row.geometry())
    other = QgsFeature(field.fields())
    other.setGeometry(row.geometry().difference(half))
    field.changeGeometry(row.id(), half)
    field.addFeature(other)
    settled(dock)
    cut = said()
    field.deleteFeatures([each.id() for each in field.getFeatures()])
    settled(dock)
    return {"cut": cut, "gone": said(), "figures": dock.labels.figures.text()}


def while_written(plan):
    """QGIS's own tools and the panel's button in the toolbar while a plan is written."""
    layers, dock = opened(plan)
    layer, found = layers["obstacles"], {}
    dock.decide("rejected")
    dock.save()
    until(lambda: dock._released is not None)
    found["editing"] = layer.startEditing()
    found["opened"] = [dock.open(""), dock._released is not None]
    settled(dock)
    found["after"] = [layer.startEditing(), dock.labels.count.text(), panel.window.said()]
    dock.decide("rejected")
    dock.save()
    until(lambda: dock._released is not None)
    panel.window.removeDockWidget = lambda dock: None
    dock.remove()  # as the plugin does that is unloaded
    found["unloaded"] = [layer.source(), layer.featureCount()]
    return found


def deleted_and_drawn(plan):
    """What the keys speak of after an obstacle was deleted, one drawn, and a row has no shape."""
    layers, dock = opened(plan)
    layer, found = layers["obstacles"], {}
    layer.startEditing()
    layer.deleteFeature(dock.current)
    steps = layer.undoStack().index()
    QTest.keyClick(panel.window.canvas, "c")
    dock._move_to(layer.extent().center(), False, False)
    found["deleted"] = [layer.undoStack().index() - steps, dock.buttons["confirm"].isEnabled()]
    middle = panel.window.canvas.extent().center()
    edge = panel.QgsPointXY(middle.x() + 3, middle.y())
    dock._drawn(middle, edge)
    area = layer.getFeature(dock.current).geometry().area()
    QTest.keyClick(panel.window.canvas, "+")
    drawn = layer.getFeature(dock.current)
    found["larger"] = (drawn.geometry().area() / area) ** 0.5 * 3
    found["drawn"] = [drawn["status"], drawn["radius_m"] or None]
    settled(dock)
    figures = dock.labels.figures.text()
    bare = QgsFeature(layer.fields())
    bare.setAttribute("status", "added")
    layer.addFeature(bare)
    dock.undo()
    dock.redo()
    settled(dock)
    found["bare"] = [dock.labels.figures.text() == figures, dock.current]
    dock.save()
    written(dock)
    return {**found, "said": panel.window.said()}


def made_read_only(plan):
    """Keys on obstacles that were made read-only after the panel was opened."""
    layers, _ = opened(plan)
    layer = layers["obstacles"]
    layer.setReadOnly(True)
    for key in "cr+m":
        QTest.keyClick(panel.window.canvas, key)
    return {"steps": layer.undoStack().count(), "said": panel.window.said()}


def project_with_sketch(plan, home):
    """The layers that are shown, and after a project that was saved with a sketch is opened."""
    _, dock = opened(plan)
    project = QgsProject.instance()

    def shown():
        nodes = project.layerTreeRoot().findLayers()
        return [node.name() for node in nodes if node.isVisible()]

    found = [shown()]
    dock.decide("rejected")
    settled(dock)
    found.append(shown())
    project.write(f"{home}/project.qgz")
    found.append(shown())
    project.clear()
    project.read(f"{home}/project.qgz")
    return [*found, shown()]


def farm(plan):
    """What is told where there are several fields, after several edits."""
    _, dock = opened(plan)
    for _ in range(2):
        dock.decide("rejected")
        settled(dock)
    dock.save()
    QgsApplication.processEvents()
    settled(dock)
    return {"said": panel.window.said(), "count": dock.labels.count.text()}


def taken_over(plan):
    """Whether there is a sketch with an edit, when the plan is let go, and when it is had again."""
    _, dock = opened(plan)
    found = [dock.preview.is_shown]
    dock.decide("rejected")
    settled(dock)
    found.append(dock.preview.is_shown)
    dock.close_review()
    found.append(dock.preview.is_shown)
    dock.open(plan)
    settled(dock)
    return [*found, dock.preview.is_shown]


def removed(plan):
    """An obstacle decided after the outline's layer was removed; then the project is closed."""
    layers, dock = opened(plan)
    QgsProject.instance().removeMapLayer(layers.pop("field").id())
    until(lambda: True)  # QGIS deletes it now
    dock.decide("rejected")
    settled(dock)
    dock.save()
    written(dock)
    found = [dock.labels.count.text(), panel.window.said()]
    QgsProject.instance().clear()
    return [*found, dock.labels.title.text()]


def numbered_anew(plan):
    """Another program gives the row that is looked at to another obstacle; two keys then."""
    layers, dock = opened(plan)
    layer, found = layers["obstacles"], []
    looked_at = dock.current
    data = ogr.Open(plan, 1)
    rows = data.GetLayerByName("obstacles")
    here = rows.GetFeature(looked_at)
    other = rows.GetFeature(next(each.GetFID() for each in rows if each.GetFID() != looked_at))
    here.SetFID(other.GetFID())
    other.SetFID(looked_at)
    for each in (here, other):
        rows.SetFeature(each)
    del rows, data
    for _ in range(2):
        QTest.keyClick(panel.window.canvas, "r")
        settled(dock)
        found.append(
            [each["obstacle_no"] for each in layer.getFeatures() if each["status"] == "rejected"]
        )
    return {"found": found, "was": here["obstacle_no"], "said": panel.window.said()}


def held(plan):
    """Keys that a hand rests on."""
    layers, dock = opened(plan)
    first, layer = dock.current, layers["obstacles"]
    for letter, key in (("r", Qt.Key.Key_R), ("j", Qt.Key.Key_J)):
        for again in (False, True, True):
            nothing = Qt.KeyboardModifier.NoModifier
            press = QKeyEvent(QEvent.Type.KeyPress, key, nothing, letter, again)
            QgsApplication.sendEvent(panel.window.canvas, press)
    rejected = list(layer.getFeatures("status = 'rejected'"))
    settled(dock)
    return {"rejected": len(rejected), "stepped": dock.current != first}


def taken_out(plan, gone):
    """A plan of which a person took layers out of the project before the review."""
    layers, dock = reviewed(plan)
    project = QgsProject.instance()
    for name in gone:
        project.removeMapLayer(layers[name].id())
    before = set(project.mapLayers())
    found = dock.open()
    if not found:
        return {"found": found, "said": panel.window.said()}
    settled(dock)
    dock.decide("rejected")
    settled(dock)
    dock.save()
    written(dock)
    back = {layer.name() for each, layer in project.mapLayers().items() if each not in before}
    groups = project.layerTreeRoot().findGroups()
    return {
        "found": found, "said": panel.window.said(), "title": dock.labels.title.text(),
        "count": dock.labels.count.text(), "figures": dock.labels.figures.text(),
        "back": sorted(back), "groups": len(groups),
        "order": [each.name() for each in groups[0].findLayers()],
    }  # fmt: skip


def away(plan, home):
    """A plan whose file is not there for a while: in the session, and when a project is opened."""
    _, dock = reviewed(plan)
    dock.open()
    settled(dock)
    project, seen = QgsProject.instance(), []
    for reopened in (False, True):
        if reopened:
            project.write(f"{home}/all.qgz")
            project.clear()
        Path(plan).rename(f"{plan}.away")
        if reopened:
            project.read(f"{home}/all.qgz")
        panel.window.bar.clearWidgets()
        QgsApplication.processEvents()
        QgsApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        gone = dock.open(), panel.window.said()[-1:]
        Path(f"{plan}.away").rename(plan)
        back = dock.open()
        settled(dock)
        dock.decide("rejected")
        settled(dock)
        dock.save()
        written(dock)
        seen.append([*gone, back, dock.labels.count.text()])
    return seen


def moved(plan, home):
    """A project that was moved with its plan, from which the outline was taken out."""
    reviewed(plan)
    project, other = QgsProject.instance(), Path(home) / "moved"
    here = Path(plan).parent
    project.write(str(here / "all.qgz"))
    project.clear()
    here.rename(other)
    project.read(str(other / "all.qgz"))
    (field,) = project.mapLayersByName("Field")
    project.removeMapLayer(field.id())
    from geofield_qgis.dock import ReviewDock

    dock = ReviewDock(panel.window)
    found = dock.open()
    settled(dock)
    groups = project.layerTreeRoot().findGroups(True)
    return [found, [[each.name() for each in group.findLayers()] for group in groups]]


def laid_out(plan):
    """Left and right ends of the buttons that are as wide as the panel."""
    _, dock = opened(plan)
    dock.resize(420, 700)
    QgsApplication.processEvents()
    boxes = [dock.buttons[name].geometry() for name in ("open", "save")]
    return [[box.left(), box.right()] for box in boxes]


_ALL = (
    outline, outline_cut, while_written, deleted_and_drawn, made_read_only, project_with_sketch,
    farm, numbered_anew, held, taken_over, removed, taken_out, away, moved,
    laid_out,
)  # fmt: skip

if __name__ == "__main__":
    begin()
    answer({each.__name__: each for each in _ALL})
