"""A stop that meets a library in the midst of a call back to Python is a stop all the same."""

from __future__ import annotations

import subprocess
import sys

import pytest

STOPPED = "Stopped; nothing half-written is left."
#: As GDAL does with what its stream of rows raises.
CODE = """
import signal, sys
import geofield.formats
from geofield.cli import main
from geofield.errors import FormatError
def read(*_, **__):
    try:
        signal.raise_signal(getattr(signal, sys.argv[1]))
    except BaseException:
        sys.excepthook(*sys.exc_info())  # as numpy's C code does while it is loaded
        raise {error}("Error while accessing batch from stream.") from None
geofield.formats.read_dataset = read
main(["export", "plan.gpkg", "-f", "kml", "--out", sys.argv[2]])
"""


#: A destructor is where Python prints what is raised, and goes on.
DESTRUCTOR = """
import signal, sys, time
import geofield.formats
from geofield.cli import main
class Closing:
    def __del__(self):
        signal.raise_signal(getattr(signal, sys.argv[1]))
        time.sleep(0)
def read(*_, **__):
    Closing()
    time.sleep(20)
geofield.formats.read_dataset = read
main(["export", "plan.gpkg", "-f", "kml", "--out", sys.argv[2]])
"""


@pytest.mark.parametrize("kind", ["SIGTERM", "SIGINT"])
def test_a_stop_in_a_destructor(kind: str, tmp_path: object) -> None:
    done = subprocess.run(
        [sys.executable, "-c", DESTRUCTOR, kind, f"{tmp_path}/out"],
        capture_output=True,
        text=True,
        check=False,
        timeout=15,
    )
    assert (done.returncode, done.stderr.strip()) == (1, STOPPED)


@pytest.mark.parametrize("kind", ["SIGTERM", "SIGINT"])
@pytest.mark.parametrize("error", ["RuntimeError", "FormatError"])
def test_a_stop_in_a_call_back(kind: str, error: str, tmp_path: object) -> None:
    done = subprocess.run(
        [sys.executable, "-c", CODE.format(error=error), kind, f"{tmp_path}/out"],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert (done.returncode, done.stderr.strip()) == (1, STOPPED)
