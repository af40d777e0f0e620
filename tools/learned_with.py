"""What a model was learned with, kept in its file: data, seed, versions.

A table that is learned again with the same is the same; a network, which learns by the clock, is
one like it. A test holds the files against the data that lie here: a table that grew, or a network
that another one was learned behind, is noticed.
"""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any

LEARNED = Path(__file__).resolve().parent.parent / "src/geofield/learned"
#: What was learned without one fold of sites each: figures are taken with these, nobody runs them.
LEFT_OUT = Path(__file__).resolve().parent / "left_out"
LIBRARIES = ("numpy", "scipy", "opencv-python-headless")


def learned_with(
    data: Iterable[Path], libraries: Iterable[str] = (), **more: Any
) -> dict[str, Any]:
    """Return facts for the model's file.

    Parameters
    ----------
    data : iterable of Path
        Files learned from, told by their SHA-256.
    libraries : iterable of str
        Further ones whose versions count.
    **more
        Seed, steps and the like.
    """
    versions = {name: version(name) for name in (*LIBRARIES, *libraries)}
    return {
        **more,
        "versions": {"python": platform.python_version(), **versions},
        "sha256": {file.name: sha256(file) for file in data},
    }


def sha256(file: Path) -> str:
    """Return the digest of a file."""
    return hashlib.sha256(file.read_bytes()).hexdigest()
