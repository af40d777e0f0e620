"""Edits of all obstacles at once, which a program makes rather than a person, are told."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
import shapely
from changed_plans import Frame, at, geofield, plan_in, rewritten, rows

from geofield.simulate import SimulatedField


def simplified(table: Frame) -> Frame:
    return table.set_geometry(table.geometry.simplify(0.5), crs=table.crs)


def snapped(table: Frame) -> Frame:
    return table.set_geometry(shapely.set_precision(table.geometry, 0.25), crs=table.crs)


@pytest.mark.parametrize("change", [simplified, snapped])
def test_shapes_that_all_changed_are_told(folder: Path, change: object) -> None:
    file = folder / "out/field.gpkg"
    rewritten(file, "obstacles", change)
    words = "All 11 obstacles have other shapes than were written, by up to 0."
    assert words in geofield("export", file, "--format", "geojson", "--out", folder / "e")
    told = geofield("tracks", file, "-o", file)
    assert words in told
    assert "11 that were found became `confirmed`" in told
    assert "a run with --fresh" in told
    assert "Changes: obstacles: 11 changed\n" in told
    assert set(rows(plan_in(folder))["status"]) == {"confirmed"}
    told = geofield("tracks", file, "-o", file)
    assert "obstacles" not in told


def test_a_layer_of_which_all_rows_were_deleted_is_told(folder: Path, made: SimulatedField) -> None:
    file = folder / "out/field.gpkg"
    rewritten(file, "obstacles", lambda table: table.iloc[:0])
    words = "All 11 obstacles that were driven around are gone from the layer"
    assert words in geofield("export", file, "--format", "geojson", "--out", folder / "e")
    told = geofield("tracks", file, "-o", file)
    assert words in told
    assert "a run with --fresh" in told
    assert "Changes: obstacles: 11 taken away\n" in told
    assert "obstacles" not in geofield("tracks", file, "-o", file)
    # The next step that it tells.
    geofield("run", folder / "picture.tif", "--lat", made.lat, "--lon", made.lon, "--out",
             folder / "out", "--format", "gpkg", "--fresh", "--overwrite")  # fmt: skip
    assert len(rows(plan_in(folder))) == 11


def test_of_single_edits_their_number_is_told(folder: Path) -> None:
    file = folder / "out/field.gpkg"

    def edited(table: Frame) -> Frame:
        table.loc[at(table, 1), "status"] = "rejected"
        table.loc[at(table, 2), "geometry"] = table.geometry[at(table, 2)].translate(1, 0)
        drawn = table[at(table, 3)].assign(obstacle_no=None, geometry=lambda t: t.translate(8, 0))
        return pd.concat([table[~at(table, 4)], drawn])

    rewritten(file, "obstacles", edited)
    rewritten(file, "field", lambda table: table.assign(geometry=table.buffer(-2)))
    told = geofield("tracks", file, "-o", file)
    assert "Changes: your outline kept\n" in told
    assert "Changes: obstacles: 2 changed, 1 drawn, 1 taken away\n" in told
    assert "All " not in told
