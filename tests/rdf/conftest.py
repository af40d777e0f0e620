"""Plans to write, as fixtures."""

from __future__ import annotations

import pytest
from rdf_plans import small_plan

from geofield.model.dataset import Dataset


@pytest.fixture(scope="session")
def plan() -> Dataset:
    """A small plan with every layer, status and kind."""
    return small_plan()
