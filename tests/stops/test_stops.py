"""Stops at random moments: products are the old ones or the new ones, whole.

This is the short run; `benchmarks/stops.py` stops 200 times.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from geofield.imagery import write_scene
from geofield.simulate import SimulationSettings, simulate_field

from .moments import GEOFIELD, STOPS, Work, make_works, stop

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs signals")


@pytest.fixture(scope="module")
def works(tmp_path_factory: pytest.TempPathFactory) -> list[Work]:
    folder = tmp_path_factory.mktemp("works")
    made = simulate_field(5, SimulationSettings(width_px=160, height_px=160, obstacles=3))
    write_scene(made.scene, folder / "picture.tif")
    point = ["--lat", str(made.lat), "--lon", str(made.lon)]
    return make_works(folder, folder / "picture.tif", point)


@pytest.mark.parametrize("kind", STOPS)
def test_a_stop_leaves_old_products_or_new_ones(
    works: list[Work], kind: object, tmp_path: Path
) -> None:
    dice = random.Random(str(kind))
    moments = [(work, False) for work in works]
    # And of one command, while its files are moved into place.
    moments.append((works[STOPS.index(kind)], True))  # type: ignore[arg-type]
    stops = [
        stop(work, kind, dice, tmp_path / f"{work.name} {aimed}", aimed=aimed)  # type: ignore[arg-type]
        for work, aimed in moments
    ]
    assert not [each for each in stops if each.faults]


def test_a_stop_while_the_command_line_loads_shows_no_traceback(tmp_path: Path) -> None:
    """Ctrl+C right behind Enter showed where in Python's imports it came, up to a second long."""
    (tmp_path / "click.py").write_text("import signal\nsignal.raise_signal(signal.SIGINT)\n")
    line = [sys.executable, "-m", "geofield", "info", "field.gpkg"]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (-signal.SIGINT, "")


def test_work_that_outlives_its_terminal_goes_on(works: list[Work], tmp_path: Path) -> None:
    """As `nohup geofield run ... &`."""
    picture = next(works[0].before.parent.glob("picture.tif"))
    made = simulate_field(5, SimulationSettings(width_px=160, height_px=160, obstacles=3))
    point = ["--lat", str(made.lat), "--lon", str(made.lon)]
    command = [str(GEOFIELD), "run", str(picture), *point, "--out", str(tmp_path / "out")]
    with subprocess.Popen(
        ["sh", "-c", "trap '' HUP; exec \"$@\"", "sh", *command],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        while process.poll() is None:
            time.sleep(0.3)
            process.send_signal(signal.SIGHUP)
    assert process.returncode == 0
    assert (tmp_path / "out" / "field.gpkg").is_file()
