"""A real QGIS of Debian's packages, as a subprocess with a home of its own."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

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


def asking(client: Path, environment: Mapping[str, str]) -> Callable[..., Any]:
    """Questions to a client script: what it is to do, further variables, its arguments."""

    def ask(
        do: str,
        variables: Mapping[str, str] | None = None,
        timeout_s: float = 300,
        **arguments: Any,
    ) -> Any:
        done = subprocess.run(
            [PYTHON, str(client), json.dumps({"do": do, **arguments})],
            env={**environment, **(variables or {})},
            capture_output=True,
            text=True,
            timeout=timeout_s,
            check=False,
        )
        assert "@@@" in done.stdout, f"QGIS failed: {done.stdout[-500:]} {done.stderr[-3000:]}"
        return json.loads(done.stdout.rsplit("@@@", 1)[1])

    return ask


def mark_all(items: list[pytest.Item], folder: Path) -> None:
    """Mark the tests of a folder as needing QGIS."""
    for item in items:
        if Path(item.fspath).parent == folder:
            item.add_marker(pytest.mark.qgis)
