"""A second run of the same input writes the same bytes, in every format."""

from __future__ import annotations

import hashlib
import os
import time

import pytest
from formats_plan import make_dataset

from geofield.formats import FORMATS, write_dataset

pytestmark = pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")


def digests(folder):
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.mark.parametrize(
    "name", [name for name in FORMATS if name not in ("rdf", "rdf-study", "scene")]
)
def test_byte_identical(tmp_path, name, monkeypatch):
    write_dataset(make_dataset(), tmp_path / "first", [name])
    # Another day, another time zone, another working folder.
    monkeypatch.setenv("TZ", "Pacific/Auckland")
    time.tzset()
    real = time.time
    monkeypatch.setattr(time, "time", lambda: real() + 86_400 * 40)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    write_dataset(make_dataset(), tmp_path / "second", [name])
    first, second = digests(tmp_path / "first"), digests(tmp_path / "second")
    assert first == second
    assert first
    assert os.environ["TZ"] == "Pacific/Auckland"


@pytest.mark.parametrize("options", [{"profile": "tracklead"}, {"profile": "aggps"}, {"zip": True}])
def test_shapefile_profiles_too(tmp_path, options):
    for run in ("first", "second"):
        write_dataset(make_dataset(), tmp_path / run, ["shapefile"], options=options)
    assert digests(tmp_path / "first") == digests(tmp_path / "second")
