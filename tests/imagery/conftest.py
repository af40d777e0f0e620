"""Where the real pictures are."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


@pytest.fixture
def shared_data() -> Path:
    root = Path(__file__).resolve().parents[2]
    shared = Path(os.environ.get("GEOFIELD_SHARED", root.parent / "shared"))
    if not (shared / "data" / "trees").is_dir():
        pytest.skip(f"no real imagery at {shared / 'data'} (set GEOFIELD_SHARED)")
    return shared / "data"
