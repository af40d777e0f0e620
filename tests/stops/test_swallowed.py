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
        raise {error}("Error while accessing batch from stream.") from None
geofield.formats.read_dataset = read
main(["export", "plan.gpkg", "-f", "kml", "--out", sys.argv[2]])
"""


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
