"""What a person does with the plugin, in QGIS's real window; run by `qgis --code`.

See `by_hand` for what is asked and answered; pictures of the window lie beside the answer.
"""

import time
from pathlib import Path

from by_hand import ANSWER, ASKED, FOLDER, pixel_of, run, until
from qgis.core import (
    Qgis,
    QgsApplication,
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsProject,
    QgsRasterLayer,
    QgsRectangle,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QPoint, Qt
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import QAction, QApplication
from qgis.utils import iface, plugins, reloadPlugin


def screenshot(name):
    canvas = iface.mapCanvas()
    canvas.refreshAllLayers()
    QTest.qWait(300)
    until(lambda: not canvas.isDrawing(), 60, "drawing")
    QTest.qWait(300)
    iface.mainWindow().grab().save(str(FOLDER / f"{name}.png"))


def key(which, modifier=Qt.KeyboardModifier.NoModifier):
    canvas = iface.mapCanvas()
    QApplication.setActiveWindow(iface.mainWindow())
    canvas.setFocus()
    QTest.keyClick(canvas, which, modifier)
    QTest.qWait(10)


def statuses(layer):
    return {each["obstacle_no"]: each["status"] for each in layer.getFeatures()}


def work():
    project, canvas = QgsProject.instance(), iface.mapCanvas()
    window = iface.mainWindow()
    window.resize(1360, 860)
    picture = QgsRasterLayer(ASKED["picture"], "Picture of the farm")
    project.addMapLayer(picture)
    project.write(str(FOLDER / "farm.qgz"))
    QTest.qWait(500)  # QGIS takes the CRS of the first layer a little later
    project.setCrs(QgsCoordinateReferenceSystem("EPSG:3857"))  # not that of the picture
    QTest.qWait(200)
    extent = QgsCoordinateTransform(picture.crs(), project.crs(), project).transformBoundingBox(
        picture.extent()
    )
    canvas.setExtent(QgsRectangle(extent))
    canvas.refresh()
    QTest.qWait(500)
    plugin = plugins["geofield_qgis"]
    ours = plugin.window

    # One click: outline, obstacles, tracks.
    ours.plan.trigger()
    finished = []
    ours.planner.finished.connect(finished.append)
    QTest.mouseClick(
        canvas.viewport(),
        Qt.MouseButton.LeftButton,
        Qt.KeyboardModifier.NoModifier,
        pixel_of(ASKED["lon"], ASKED["lat"]),
    )
    until(lambda: ours.planner.outline_s is not None, 200, "outline")
    screenshot("outline")
    until(lambda: finished, 200, "tracks")
    ANSWER["outline_s"] = ours.planner.outline_s
    ANSWER["plan"] = finished[0]
    outline = QgsVectorLayer(f"{finished[0]}|layername=field", "outline", "ogr")
    ANSWER["area_ha"] = next(outline.getFeatures())["area_ha"]
    del outline
    ANSWER["project_crs"] = project.crs().authid()
    ANSWER["groups"] = {
        group.name(): [node.name() for node in group.findLayers()]
        for group in project.layerTreeRoot().findGroups()
    }
    dock = ours.dock
    until(dock.labels.figures.text, 200, "figures")
    screenshot("planned")

    # Review by keys; as in German, QGIS has one of them, too.
    theirs = QAction(window)
    theirs.setShortcut("R")
    window.addAction(theirs)
    layer = dock.review.layer
    before = statuses(layer)
    ANSWER["before"], ANSWER["count_before"] = before, dock.labels.count.text()
    first = layer.getFeature(dock.current)["obstacle_no"]
    key(Qt.Key.Key_R)
    second = layer.getFeature(dock.current)["obstacle_no"]
    key(Qt.Key.Key_C)
    answered = []
    shown = dock._show_tracks

    def hear(told):
        shown(told)
        answered.append(time.monotonic())

    dock._show_tracks = hear
    until(lambda: dock.preview.is_shown, 100, "preview")
    edited = time.monotonic()
    ANSWER["third"] = layer.getFeature(dock.current)["obstacle_no"]
    key(Qt.Key.Key_R)
    until(lambda: answered, 100, "second preview")
    ANSWER["replan_s"] = answered[-1] - edited
    ANSWER["decided"] = {first: statuses(layer)[first], second: statuses(layer)[second]}
    key(Qt.Key.Key_U)
    after = statuses(layer)
    ANSWER["undone"] = [layer.getFeature(dock.current)["obstacle_no"], dock.windowTitle()]
    ANSWER["changed"] = sorted(no for no in before if before[no] != after[no])
    ANSWER["undo_steps"] = layer.undoStack().count()
    # QGIS has the key, too: for the layer that is active, which is the picture.
    key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier)
    ANSWER["redone"] = [statuses(layer)[ANSWER["third"]], dock.buttons["redo"].text()]
    key(Qt.Key.Key_U)
    dock.step(1)
    number = layer.getFeature(dock.current)["obstacle_no"]
    radius = layer.getFeature(dock.current)["radius_m"]
    area = layer.getFeature(dock.current).geometry().area()
    key(Qt.Key.Key_Plus)
    ANSWER["larger"] = [
        layer.getFeature(dock.current)["radius_m"] - radius,
        layer.getFeature(dock.current).geometry().area() > area,
        layer.getFeature(dock.current)["status"],
    ]
    middle = layer.getFeature(dock.current).geometry().centroid().asPoint()
    key(Qt.Key.Key_M)
    centre = canvas.viewport().rect().center()
    QTest.mouseClick(
        canvas.viewport(),
        Qt.MouseButton.LeftButton,
        Qt.KeyboardModifier.NoModifier,
        centre + QPoint(60, 0),
    )
    moved = layer.getFeature(dock.current).geometry().centroid().asPoint()
    ANSWER["moved"] = [number, moved.distance(middle)]
    rows = layer.featureCount()
    key(Qt.Key.Key_D)
    QTest.mousePress(canvas.viewport(), Qt.MouseButton.LeftButton, pos=centre - QPoint(120, 90))
    QTest.mouseMove(canvas.viewport(), centre - QPoint(100, 80))
    QTest.mouseRelease(canvas.viewport(), Qt.MouseButton.LeftButton, pos=centre - QPoint(90, 70))
    ANSWER["drawn"] = layer.featureCount() - rows
    QTest.qWait(200)  # longer than the pause after which an edit is planned
    until(lambda: not dock.live.busy and not dock._timer.isActive(), 60, "tracks after drawing")
    canvas.zoomByFactor(2.0)
    screenshot("review")

    # Saving plans again, into the file that QGIS had open.
    ANSWER["unsaved"] = layer.isModified()
    key(Qt.Key.Key_S)
    until(lambda: dock._released is not None, 20, "writing")
    key(Qt.Key.Key_R)  # no layer holds the file now: an edit would be lost
    ANSWER["while_writing"] = [dock.buttons["reject"].isEnabled(), layer.isEditable()]
    until(lambda: dock._released is None and not dock.preview.is_shown, 200, "saved")
    ANSWER["after_writing"] = dock.buttons["reject"].isEnabled()
    QTest.qWait(200)
    ANSWER["saved"] = {
        "provider": layer.providerType(),
        "rows": layer.featureCount(),
        "statuses": statuses(layer),
        "renderer": type(layer.renderer()).__name__,
        "figures": dock.labels.figures.text(),
        # What went well may still stand there; what went wrong must not.
        "messages": [
            item.text()
            for item in iface.messageBar().items()
            if item.level() in (Qgis.MessageLevel.Warning, Qgis.MessageLevel.Critical)
        ],
    }
    # What the engine has to tell stands in the panel, as long as it tells it.
    outline = dock.labels.doubts.text()
    figures = {"tracks": 2, "segments": 3, "length_m": 450.0}
    dock._show_figures({"figures": figures, "doubts": ["Hazy."], "notes": ["A strip is left."]})
    ANSWER["told"] = [dock.labels.doubts.text().removeprefix(outline), dock.labels.figures.text()]
    dock._show_figures({"figures": figures})
    ANSWER["told"].append(dock.labels.doubts.text() == outline)
    # All the rest by keys, timed.
    begun, presses = time.monotonic(), 0
    while any(each in ("detected", "possible") for each in statuses(layer).values()):
        key(Qt.Key.Key_C if presses % 3 else Qt.Key.Key_R)
        presses += 1
    ANSWER["by_keys"] = [presses, time.monotonic() - begun]
    ANSWER["count_after"] = dock.labels.count.text()
    key(Qt.Key.Key_S)
    until(lambda: dock._released is None and not dock.preview.is_shown, 200, "saved again")
    canvas.setExtent(QgsRectangle(extent))
    screenshot("saved")

    # More ground with Shift: the same plan anew, with what was said of its obstacles.
    finished.clear()
    ours.plan.trigger()
    QTest.mouseClick(
        canvas.viewport(),
        Qt.MouseButton.LeftButton,
        Qt.KeyboardModifier.ShiftModifier,
        pixel_of(ASKED["lon"] + 0.0003, ASKED["lat"] + 0.0003),
    )
    until(lambda: finished, 200, "planned with more ground")
    ANSWER["again"] = finished[0]
    until(lambda: not dock.live.busy, 60, "figures again")
    ANSWER["count_again"] = dock.labels.count.text()
    ANSWER["layers_again"] = len(
        [each for each in project.mapLayers().values() if each.name() == "Obstacles"]
    )

    # Ground taken away with Alt.
    finished.clear()
    west = pixel_of(ASKED["lon"] - 0.0009, ASKED["lat"])
    ANSWER["west"] = [ASKED["lon"] - 0.0009, ASKED["lat"]]
    QTest.mouseClick(
        canvas.viewport(), Qt.MouseButton.LeftButton, Qt.KeyboardModifier.AltModifier, west
    )
    until(lambda: finished, 200, "planned with less ground")
    ANSWER["without"] = finished[0]
    ANSWER["outline_again_s"] = ours.planner.outline_s
    until(lambda: not dock.live.busy, 60, "figures without")
    ANSWER["waiting"] = ours.planner.awake._process.processId()

    # The dialogues, for a person to look at.
    import processing

    tool = processing.createAlgorithmDialog("geofield:plan", {"IMAGERY": picture})
    tool.resize(900, 700)
    tool.show()
    QTest.qWait(500)
    tool.grab().save(str(FOLDER / "tool.png"))
    tool.close()
    ANSWER["batch"] = in_batch({"INPUT": f"{finished[0]}|layername=field"}, (5.0, 9.0))
    ours.show_engine()
    QTest.qWait(300)
    ours.dialog.grab().save(str(FOLDER / "engine.png"))

    # Reloaded and unloaded, it leaves nothing.
    awake = dock.live._process.processId()
    reloadPlugin("geofield_qgis")
    QTest.qWait(300)
    from qgis.PyQt.QtWidgets import QDockWidget, QToolBar

    names = lambda kind: [  # noqa: E731
        each.objectName() for each in window.findChildren(kind) if "geofield" in each.objectName()
    ]
    ANSWER["after_reload"] = [len(names(QDockWidget)), len(names(QToolBar))]
    plugins["geofield_qgis"].unload()
    QTest.qWait(300)
    left = [Path(f"/proc/{each}").exists() for each in (awake, ANSWER["waiting"])]
    ANSWER["engine_left"] = any(left)
    ANSWER["after_unload"] = [len(names(QDockWidget)), len(names(QToolBar))]


def in_batch(given, spacings_m):
    """Tracks at several spacings by the dialogue of batch mode; where they lie."""
    from processing.gui.BatchAlgorithmDialog import BatchAlgorithmDialog
    from processing.tools.dataobjects import createContext

    dialog = BatchAlgorithmDialog(
        QgsApplication.processingRegistry().createAlgorithmById("geofield:tracks")
    )
    panel, context = dialog.mainWidget(), createContext()
    panel.addRow(len(spacings_m) - 1)
    outputs = [str(FOLDER / f"batch {spacing_m:g} ä") for spacing_m in spacings_m]
    for row, (spacing_m, output) in enumerate(zip(spacings_m, outputs, strict=True)):
        for name, value in {**given, "SPACING_M": spacing_m}.items():
            column = panel.parameter_to_column[name]
            panel.wrappers[row][column].setParameterValue(value, context)
        place = panel.tblParameters.cellWidget(row + 1, panel.parameter_to_column["OUTPUT"])
        place.setValue(output)
    dialog.resize(1200, 500)
    dialog.show()
    QTest.qWait(300)
    dialog.grab().save(str(FOLDER / "batch.png"))
    QTest.mouseClick(dialog.runButton(), Qt.MouseButton.LeftButton)
    until(lambda: not dialog.cancelButton().isEnabled(), 200, "batch")
    dialog.grab().save(str(FOLDER / "batch_done.png"))
    dialog.close()
    return outputs


run(work)
