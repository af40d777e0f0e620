"""Headland tracks without the number of their pass."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

import geofield as gf
from geofield.errors import FormatWarning
from geofield_command import run_geofield

PLAN = Path(__file__).parents[2] / "sample_data" / "field_1.gpkg"


@pytest.mark.parametrize("lost", [["pass_no"], ["pass_no", "segment_no"]])
def test_passes_are_known_by_their_offset(tmp_path: Path, lost: list[str]) -> None:
    path = tmp_path / "plan.gpkg"
    run_geofield("tracks", PLAN, "--spacing", 4, "--headland", 8, "-o", path, check=True)
    before = gf.read_plan(path).tracks
    with closing(sqlite3.connect(path)) as file, file:
        told = "SELECT name FROM sqlite_master WHERE type = 'trigger' AND tbl_name = ?"
        for (name,) in file.execute(told, ("headland_tracks",)).fetchall():
            file.execute(f'DROP TRIGGER "{name}"')
        for name in lost:
            file.execute(f"ALTER TABLE headland_tracks DROP COLUMN {name}")
    with pytest.warns(FormatWarning, match="'headland_tracks' has no column pass_no"):
        after = gf.read_plan(path).tracks
    assert before is not None
    assert after is not None
    rows, known = after.headland_tracks, before.headland_tracks
    assert rows is not None
    assert known is not None
    assert known["pass_no"].nunique() > 1
    for name in ("pass_no", "segment_no"):
        assert rows[name].tolist() == known[name].tolist()
    done = run_geofield("export", path, "--format", "rdf", "--out", tmp_path / "rdf")
    assert done.returncode == 0, done.stderr
