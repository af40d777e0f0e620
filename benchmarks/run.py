"""How long the main job takes, as a user meets it: whole processes, cold imports.

python benchmarks/run.py
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from common import machine, write_page

SAMPLE = Path(__file__).resolve().parents[1] / "sample_data"
REPEATS = 7


def seconds(command: list[str]) -> list[float]:
    """Wall times of a command, the first (cold) one left out."""
    times = []
    # As on a user's machine: modules are compiled once, by the first run.
    surroundings = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    for _ in range(REPEATS + 1):
        start = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True, env=surroundings)
        times.append(time.perf_counter() - start)
    return times[1:]


def main() -> None:
    from geofield.imagery import write_scene
    from geofield.simulate import SimulationSettings, simulate_field

    python = sys.executable
    with tempfile.TemporaryDirectory() as folder:
        made = simulate_field(7, SimulationSettings(obstacles=20))
        picture = Path(folder) / "field.tif"
        write_scene(made.scene, picture)
        run = [python, "-m", "geofield", "run", str(picture), "--lat", str(made.lat)]
        run += ["--lon", str(made.lon), "--spacing", "2", "--overwrite", "--fresh"]
        run += ["--out", str(Path(folder) / "out")]
        cases = [
            ("`geofield run`, 640 x 640 px, 4 bands, all files", run, 3.0),
            ("`geofield --help`", [python, "-m", "geofield", "--help"], 0.15),
            ("`import geofield`", [python, "-c", "import geofield"], 0.1),
            ("python alone", [python, "-c", "pass"], None),
        ]
        rows = ["| what | median s | slowest s | goal s |", "| --- | --- | --- | --- |"]
        for name, command, goal in cases:
            times = seconds(command)
            limit = f"{goal:g}" if goal else ""
            rows.append(f"| {name} | {statistics.median(times):.2f} | {max(times):.2f} | {limit} |")
    write_page("run", "The main job, whole processes", [*machine(), "", *rows])


if __name__ == "__main__":
    main()
