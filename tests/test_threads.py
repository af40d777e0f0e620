"""A command leaves the cores that it cannot use to others."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

TASKS = Path("/proc/self/task")
AFTER_A_COMMAND = """
import os
from geofield.cli import main
try:
    main(["--version"])
except SystemExit:
    pass
import numpy
print(len(os.listdir("/proc/self/task")))
"""


@pytest.mark.skipif(not TASKS.is_dir(), reason="threads are counted in /proc")
@pytest.mark.parametrize("wanted", [None, "3"])
def test_matrices_are_multiplied_by_one_thread_unless_a_person_says_more(wanted):
    surroundings = {name: value for name, value in os.environ.items() if "NUM_THREADS" not in name}
    if wanted:
        surroundings["OPENBLAS_NUM_THREADS"] = wanted
    command = [sys.executable, "-c", AFTER_A_COMMAND]
    done = subprocess.run(command, env=surroundings, capture_output=True, text=True, check=True)
    assert (int(done.stdout.split()[-1]) == 1) == (wanted is None or os.cpu_count() == 1)
