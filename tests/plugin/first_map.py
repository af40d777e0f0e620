"""From a QGIS without an engine to the first map, by clicks alone; run by `qgis --code`.

GEOFIELD_TEST names a JSON file with `picture`, `lat`, `lon`, `folder` and `requirements`; the
answer goes into `answer.json` of that folder.
"""

import json
import os
import time
import traceback
from pathlib import Path

from geofield_qgis import engine, install
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsPointXY,
    QgsProject,
    QgsRasterLayer,
)
from qgis.PyQt.QtCore import QPoint, Qt, QTimer
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import QPushButton
from qgis.utils import iface, plugins

ASKED = json.loads(Path(os.environ["GEOFIELD_TEST"]).read_text())
FOLDER = Path(ASKED["folder"])
ANSWER = {"clicks": []}


def until(true, seconds, what):
    begun = time.monotonic()
    while not true():
        if time.monotonic() - begun > seconds:
            raise TimeoutError(what)
        QTest.qWait(20)


def click(widget, place, what):
    """One click of the left button, counted."""
    ANSWER["clicks"].append(what)
    QTest.mouseClick(widget, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, place)
    QTest.qWait(100)


def press(button, what):
    assert button.isVisible()
    assert button.isEnabled()
    click(button, button.rect().center(), what)


def work():
    # What the index would serve lies in a folder: an engine as small as a test needs.
    install.REQUIREMENTS = Path(ASKED["requirements"])
    project, canvas = QgsProject.instance(), iface.mapCanvas()
    picture = QgsRasterLayer(ASKED["picture"], "Picture of the farm")
    project.addMapLayer(picture)
    project.write(str(FOLDER / "farm.qgz"))
    QTest.qWait(500)
    canvas.setExtent(canvas.mapSettings().layerExtentToOutputExtent(picture, picture.extent()))
    canvas.refresh()
    QTest.qWait(500)
    ours = plugins["geofield_qgis"].window
    ANSWER["engine_before"] = engine.find_engine()
    finished = []
    ours.planner.finished.connect(finished.append)
    press(ours.toolbar.widgetForAction(ours.plan), "tool")
    turned = QgsCoordinateTransform(
        QgsCoordinateReferenceSystem("EPSG:4326"), project.crs(), project
    ).transform(QgsPointXY(ASKED["lon"], ASKED["lat"]))
    place = canvas.getCoordinateTransform().transform(turned)
    click(canvas.viewport(), QPoint(round(place.x()), round(place.y())), "field")
    (button,) = (each for each in iface.messageBar().findChildren(QPushButton) if each.isVisible())
    press(button, "engine")
    iface.mainWindow().grab().save(str(FOLDER / "before.png"))
    ours.dialog.grab().save(str(FOLDER / "dialog.png"))
    press(ours.dialog.buttons["install"], "install")
    ours.dialog.grab().save(str(FOLDER / "installing.png"))
    until(lambda: finished, 240, "map")
    QTest.qWait(1000)
    iface.mainWindow().grab().save(str(FOLDER / "first_map.png"))
    ANSWER["engine"] = engine.find_engine()
    ANSWER["plan"] = finished[0]
    ANSWER["dialog_open"] = ours.dialog.isVisible()
    ANSWER["layers"] = sorted(each.name() for each in project.mapLayers().values())
    ANSWER["messages"] = [each.text() for each in iface.messageBar().items()]


def begin():
    try:
        work()
    except BaseException:  # noqa: BLE001 - told to the test
        ANSWER["error"] = traceback.format_exc()
        iface.mainWindow().grab().save(str(FOLDER / "error.png"))
    (FOLDER / "answer.json").write_text(json.dumps(ANSWER, default=str))
    os._exit(0)


QTimer.singleShot(2000, begin)
