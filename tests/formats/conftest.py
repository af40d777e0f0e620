from __future__ import annotations

import pytest
from formats_plan import make_dataset

from geofield.model import Dataset


@pytest.fixture
def dataset() -> Dataset:
    return make_dataset()
