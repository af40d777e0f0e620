"""What a person changed in the field's row stands: its outline, name and columns."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from changed_plans import Frame, geofield, plan_in, rewritten, run, shrunk, there_and_back
from shapely.affinity import translate

from geofield.formats import validate_file
from geofield.model.evidence import Evidence
from geofield.model.field import Field
from geofield.simulate import SimulatedField
from geofield_command import run_geofield


def test_a_drawn_outline_stands_above_the_boundary_given(
    folder: Path, made: SimulatedField
) -> None:
    """The same command again, after the outline was moved: the parcels' file says nothing new."""
    file = folder / "out/field.gpkg"
    parcels = folder / "parcels.gpkg"
    shrunk(gpd.read_file(file, layer="field")).assign(name="Parcel 7").to_file(parcels)
    own = ["--boundary", parcels, "--format", "gpkg", "--overwrite"]
    run(folder, made, *own)
    given = plan_in(folder).field
    assert (given.method, given.name) == ("boundary", "Parcel 7")
    renamed = there_and_back(gpd.read_file(file, layer="field")).assign(name="Mine", crop="rye")
    rewritten(file, "field", lambda table: renamed)
    run(folder, made, *own)
    same = plan_in(folder).field
    assert same.polygon.equals(given.polygon)
    assert (same.name, dict(same.own)) == ("Mine", {"crop": "rye"})
    rewritten(file, "field", shrunk)
    moved = plan_in(folder).field.polygon
    told = run(folder, made, *own)
    assert "the boundary is not used" in told
    assert "your outline kept" in told
    run(folder, made, *own)
    kept = plan_in(folder).field
    assert kept.polygon.equals(moved)
    assert (kept.method, kept.name, dict(kept.own)) == ("drawn", "Mine", {"crop": "rye"})


def test_an_outline_that_was_saved_in_another_crs_and_back_is_no_edit(
    folder: Path, made: SimulatedField
) -> None:
    """It counted as drawn, however little it was off, and was never found again."""
    file, found = folder / "out/field.gpkg", plan_in(folder)
    rewritten(file, "field", there_and_back)
    read = plan_in(folder)
    assert 0 < read.field.polygon.hausdorff_distance(found.field.polygon) < 0.01
    assert (read.outline_edited, read.field.method) == (False, found.field.method)
    geofield("tracks", file, "-o", file)
    told = run(folder, made, "--overwrite")
    assert "outline as before" in told or "outline other by" in told
    after = plan_in(folder).field
    assert after.polygon.equals(found.field.polygon)
    # A hand moves a corner farther than that, and puts one on a straight side.
    ring = shapely.get_coordinates(found.field.polygon.exterior)
    ring[[0, -1]] += 0.03
    assert found.evidence.moved(shapely.Polygon(ring))
    finer = shapely.segmentize(found.field.polygon, 5.0)
    assert not found.evidence.moved(shapely.reverse(finer))


def test_an_outline_that_an_earlier_version_wrote_is_known_by_its_fingerprint() -> None:
    square = shapely.box(500000, 5600000, 500200, 5600100)
    written = "636f6cdd7bad1606916d7fe6a07e3fabc585556624b2492a4f56ea02ee540681"
    evidence = Evidence.from_json({"field": {"method": "auto", "outline_sha256": written}})
    assert not evidence.moved(shapely.reverse(square))
    assert evidence.moved(translate(square, 1e-6))
    again = Evidence.from_json(evidence.to_json(Field(square, "EPSG:32633"), None))
    assert again == evidence


def test_an_outline_of_which_nobody_recorded_how_it_was_written(
    folder: Path, made: SimulatedField
) -> None:
    """As ogr2ogr copies a GeoPackage: its tables alone."""
    file = folder / "out/field.gpkg"
    rewritten(file, "field", shrunk)
    moved = plan_in(folder).field.polygon
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("DELETE FROM gpkg_metadata")
    for what in ("lost the record", "your outline kept"):
        told = run(folder, made, "--overwrite")
        assert what in told
        assert plan_in(folder).field.polygon.equals(moved)


def test_a_region_does_not_change_a_drawn_outline(folder: Path, made: SimulatedField) -> None:
    file = folder / "out/field.gpkg"
    rewritten(file, "field", shrunk)
    where = ("--lat", made.lat, "--lon", made.lon, "-o", file, "--overwrite")
    done = run_geofield("field", folder / "picture.tif", *where, "--region", 1)
    assert done.returncode == 1
    assert "no region changes it" in done.stderr


def test_what_was_thought_of_an_outline_that_was_moved_is_not_told_again(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    rewritten(
        file,
        "field",
        lambda table: table.assign(doubts="something").set_geometry(
            [translate(table.geometry.iloc[0], 4, 0)], crs=table.crs
        ),
    )
    geofield("export", file, "-f", "geojson,report", "--out", folder / "x")
    row = gpd.read_file(folder / "x/geojson/field.geojson").iloc[0]
    assert row["method"] == "drawn"
    assert row[["certainty", "doubts"]].isna().all()
    report = json.loads((folder / "x/report.json").read_text())
    assert report["field"]["certainty"] is None


@pytest.mark.parametrize(("kind", "told", "found"), [
    ("emptied", "this file has 0. Draw the outline in its layer `field`", "no row has an outline"),
    ("cut", "this file has 2. Merge or delete rows of its layer", "has several rows of one field"),
    ("a line", "is a LineString; a plan needs a polygon. Draw it as", "is a LineString"),
])  # fmt: skip
def test_an_outline_that_is_none_is_told(folder: Path, kind: str, told: str, found: str) -> None:
    """Of no place, of --id-column and of one part too many was told, or it was a traceback."""
    file = folder / "out/field.gpkg"

    def changed(table: Frame) -> Frame:
        if kind == "emptied":
            return table.iloc[:0]
        shape = table.geometry.iloc[0]
        if kind == "a line":
            return table.set_geometry([shapely.LineString(shape.exterior.coords)], crs=table.crs)
        x0, y0, x1, y1 = shape.bounds
        half = shapely.box(x0, y0, (x0 + x1) / 2, y1)
        parts = [shape & half, shape - half]
        return pd.concat([table, table]).set_geometry(parts, crs=table.crs)

    rewritten(file, "field", changed)
    done = run_geofield("tracks", file, "-o", file)
    assert done.returncode == 1
    assert told in " ".join(done.stderr.split())
    assert found in run_geofield("validate", file).stderr
    done = run_geofield("export", file, "-f", "isoxml", "--out", folder / "x")
    assert done.returncode == 1
    assert "Traceback" not in done.stderr


def test_an_empty_column_stays(folder: Path, made: SimulatedField) -> None:
    file = folder / "out/field.gpkg"

    def emptied(table: Frame) -> Frame:
        return table.assign(
            crop=pd.array([None], "string"), dose=[np.nan], sown=pd.to_datetime([None])
        )

    rewritten(file, "field", emptied)
    for _ in range(2):
        run(folder, made, "--overwrite")
    table = gpd.read_file(file, layer="field")
    assert table[["crop", "dose", "sown"]].isna().all(axis=None)
    assert (table["dose"].dtype.kind, table["sown"].dtype.kind) == ("f", "M")
    once, again = plan_in(folder), plan_in(folder)
    assert once == again  # nothing in a cell is nothing in the other


def test_ground_that_an_outline_gained_was_searched_by_nobody(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    plan = plan_in(folder)
    assert not plan.evidence.unsearched
    larger = plan.field.polygon.buffer(9)
    rewritten(file, "field", lambda table: table.set_geometry([larger], crs=table.crs))
    (finding,) = validate_file(file)
    assert finding.level == "warning"
    told = geofield("tracks", file, "-o", file)
    gained_ha = (larger.area - plan.field.polygon.area) / 10_000
    assert f"Nobody searched {gained_ha:.2f} ha" in told
    assert "`geofield obstacles PICTURE PLAN`" in told
    assert [each.message for each in validate_file(file)] == [finding.message]
    geofield("export", file, "-f", "report", "--out", folder / "x")
    assert "Nobody searched" in (folder / "x/report.json").read_text()
    # A border drawn a bit better is no further ground, and what was gained may be searched.
    better = plan.field.polygon.buffer(0.3)
    rewritten(file, "field", lambda table: table.set_geometry([better], crs=table.crs))
    assert "Nobody searched" not in geofield("tracks", file, "-o", file)
    rewritten(file, "field", lambda table: table.set_geometry([larger], crs=table.crs))
    geofield("obstacles", folder / "picture.tif", file, "-o", file)
    assert "Nobody searched" not in geofield("tracks", file, "-o", file)
    assert not validate_file(file)
