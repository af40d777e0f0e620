"""QGIS's libraries loaded, for `real_qgis`: each question's QGIS starts in a process of its own.

Run by Debian's Python. Nothing of QGIS is started here, so that there are no threads to lose.
"""

import os
import runpy
import sys
import traceback

import qgis.core
import qgis.PyQt.QtCore
import qgis.PyQt.QtGui  # noqa: F401

from fork_server import served

words = served()
if words is not None:
    sys.argv[:] = words
    sys.path[0] = os.path.dirname(words[0])  # noqa: PTH120 - as Python does it
    try:
        runpy.run_path(words[0], run_name="__main__")
    except Exception:  # noqa: BLE001 - told to the test
        traceback.print_exc()
    sys.stdout.flush()
    # Leaving QGIS tidily crashes now and then in headless processes.
    os._exit(1)
