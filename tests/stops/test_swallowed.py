"""A stop that meets a library in the midst of a call back to Python is a stop all the same."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

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


#: A bare `except` of a library.
PASSED_OVER = """
import signal, sys, time
import geofield.formats
from geofield.cli import main
def read(*_, **__):
    for _ in range(2):
        try:
            signal.raise_signal(getattr(signal, sys.argv[1]))
        except:
            pass
    try:
        time.sleep(20)
    finally:
        time.sleep(0.5)
        print("cleaned up")
geofield.formats.read_dataset = read
main(["export", "plan.gpkg", "-f", "kml", "--out", sys.argv[2]])
"""


#: A program that goes on after the command; what it starts inherits which signals are ignored.
GOES_ON = """
import signal, subprocess, sys, time
import geofield.formats
from geofield.cli import main
def read(*_, **__):
    signal.raise_signal(getattr(signal, sys.argv[1]))
hooks = sys.excepthook, sys.unraisablehook
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGTERM, signal.SIG_DFL)
geofield.formats.read_dataset = read
try:
    main(["export", "plan.gpkg", "-f", "kml", "--out", sys.argv[2]])
except SystemExit as stop:
    assert stop.code == 1
time.sleep(0.5)
assert (sys.excepthook, sys.unraisablehook) == hooks
assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
child = subprocess.Popen(["sleep", "10"])
child.terminate()
print("the child ended by", child.wait())
"""


def ended(*words: str, folder: Path) -> tuple[int, str, str]:
    """Exit code and what was said of a Python that was told in these words what to do."""
    done = subprocess.run(
        [sys.executable, *words, "out"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=15,
    )
    return done.returncode, done.stderr.strip(), done.stdout.strip()


@pytest.mark.parametrize("kind", ["SIGTERM", "SIGINT"])
def test_a_stop_that_is_passed_over(kind: str, tmp_path: Path) -> None:
    assert ended("-c", PASSED_OVER, kind, folder=tmp_path) == (1, STOPPED, "cleaned up")


@pytest.mark.parametrize("kind", ["SIGTERM", "SIGINT"])
def test_a_stop_while_a_dataclass_is_made(kind: str, tmp_path: Path) -> None:
    in_text = PASSED_OVER.replace("time.sleep(20)", 'exec("import time; time.sleep(20)")')
    (tmp_path / "as_module.py").write_text(in_text)
    assert ended("-m", "as_module", kind, folder=tmp_path) == (1, STOPPED, "cleaned up")


@pytest.mark.parametrize("kind", ["SIGTERM", "SIGINT"])
def test_a_stop_in_a_destructor(kind: str, tmp_path: Path) -> None:
    assert ended("-c", DESTRUCTOR, kind, folder=tmp_path) == (1, STOPPED, "")


@pytest.mark.parametrize("kind", ["SIGTERM", "SIGINT"])
@pytest.mark.parametrize("error", ["RuntimeError", "FormatError"])
def test_a_stop_in_a_call_back(kind: str, error: str, tmp_path: Path) -> None:
    code = CODE.format(error=error)
    assert ended("-c", code, kind, folder=tmp_path) == (1, STOPPED, "")


@pytest.mark.parametrize("kind", ["SIGTERM", "SIGINT"])
def test_a_program_that_calls_the_command_is_stopped_as_before(kind: str, tmp_path: Path) -> None:
    said = f"the child ended by {-signal.SIGTERM}"
    assert ended("-c", GOES_ON, kind, folder=tmp_path) == (0, STOPPED, said)
