"""A real QGIS of Debian's packages, as a subprocess with a home of its own."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from forks import Forks

#: QGIS belongs to Debian's Python, never to the environment of the tests.
PYTHON = "/usr/bin/python3"
_NEEDED = "apt-get install qgis python3-qgis python3-gdal"


def environment_in(home: Path, more: Mapping[str, str] | None = None) -> dict[str, str]:
    """The variables of a QGIS without a window; the test is skipped where there is no QGIS."""
    home.chmod(0o700)
    environment = {
        "QT_QPA_PLATFORM": "offscreen",
        "HOME": str(home),
        "XDG_RUNTIME_DIR": str(home),
        "PATH": "/usr/bin:/bin",
        "LC_ALL": "C.UTF-8",
        **(more or {}),
    }
    command = [PYTHON, "-c", "import qgis.core"]
    found = (
        Path(PYTHON).exists()
        and subprocess.run(command, env=environment, capture_output=True, check=False).returncode
        == 0
    )
    if not found:
        if os.environ.get("CI"):
            pytest.fail(f"QGIS is missing: {_NEEDED}")
        pytest.skip(f"needs QGIS: {_NEEDED}")
    return environment


@contextmanager
def asking(client: Path, environment: Mapping[str, str]) -> Iterator[Callable[..., Any]]:
    """Questions to a client script: what it is to do, further variables, its arguments."""
    program = Path(__file__).with_name("forked_qgis.py")
    forks = Forks([PYTHON, str(program)], environment)

    def ask(
        do: str,
        variables: Mapping[str, str] | None = None,
        timeout_s: float = 300,
        **arguments: Any,
    ) -> Any:
        words = [str(client), json.dumps({"do": do, **arguments})]
        if variables:  # which a library may read while it loads
            done = subprocess.run(
                [PYTHON, *words], env={**environment, **variables}, capture_output=True, text=True,
                timeout=timeout_s, check=False,
            )  # fmt: skip
        else:
            done = forks.run(words, timeout_s=timeout_s)
        assert "@@@" in done.stdout, f"QGIS failed: {done.stdout[-500:]} {done.stderr[-3000:]}"
        return json.loads(done.stdout.rsplit("@@@", 1)[1])

    yield ask
    forks.end()


def mark_all(items: list[pytest.Item], folder: Path) -> None:
    """Mark the tests of a folder as needing QGIS."""
    for item in items:
        if Path(item.fspath).parent == folder:
            item.add_marker(pytest.mark.qgis)
