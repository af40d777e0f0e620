"""What scripts in QGIS's window share: waiting, places on the map, and the answer to the test.

GEOFIELD_TEST names a JSON file with `picture`, `lat`, `lon`, `folder`; the answer goes into
`answer.json` of that folder.
"""

import json
import os
import time
import traceback
from pathlib import Path

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsPointXY,
    QgsProject,
)
from qgis.PyQt.QtCore import QPoint, QTimer
from qgis.PyQt.QtTest import QTest
from qgis.utils import iface

ASKED = json.loads(Path(os.environ["GEOFIELD_TEST"]).read_text())
FOLDER = Path(ASKED["folder"])
ANSWER = {}


def until(true, seconds, what):
    """Let QGIS work until something is so."""
    begun = time.monotonic()
    while not true():
        if time.monotonic() - begun > seconds:
            raise TimeoutError(what)
        QTest.qWait(20)
    return time.monotonic() - begun


def pixel_of(lon, lat):
    canvas = iface.mapCanvas()
    turned = QgsCoordinateTransform(
        QgsCoordinateReferenceSystem("EPSG:4326"),
        canvas.mapSettings().destinationCrs(),
        QgsProject.instance(),
    ).transform(QgsPointXY(lon, lat))
    place = canvas.getCoordinateTransform().transform(turned)
    return QPoint(round(place.x()), round(place.y()))


def run(work):
    """Do the work once the window is there; then QGIS ends."""

    def begin():
        try:
            work()
        except BaseException:  # noqa: BLE001 - told to the test
            ANSWER["error"] = traceback.format_exc()
            iface.mainWindow().grab().save(str(FOLDER / "error.png"))
        (FOLDER / "answer.json").write_text(json.dumps(ANSWER, default=str))
        os._exit(0)

    QTimer.singleShot(2000, begin)
