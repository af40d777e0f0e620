"""From a QGIS without an engine to the first map, by clicks alone; run by `qgis --code`.

See `by_hand` for what is asked and answered; `requirements` is a file of locked ones, too.
"""

from pathlib import Path

from by_hand import ANSWER, ASKED, FOLDER, pixel_of, run, until
from geofield_qgis import engine, install
from qgis.core import QgsProject, QgsRasterLayer
from qgis.PyQt.QtCore import Qt
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import QPushButton
from qgis.utils import iface, plugins


def click(widget, place, what):
    """One click of the left button, counted."""
    ANSWER.setdefault("clicks", []).append(what)
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
    # A click that was taken back waits for nothing.
    ours.plan.trigger()
    place = pixel_of(ASKED["lon"], ASKED["lat"])
    QTest.mouseClick(canvas.viewport(), Qt.MouseButton.LeftButton, pos=place)
    waited = ours.planner.waits
    QTest.keyClick(canvas, Qt.Key.Key_Escape)
    ANSWER["waits"] = [waited, ours.planner.waits]
    iface.messageBar().clearWidgets()
    canvas.unsetMapTool(ours.tool)
    QTest.qWait(500)
    press(ours.toolbar.widgetForAction(ours.plan), "tool")
    click(canvas.viewport(), place, "field")
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


run(work)
