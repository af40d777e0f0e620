"""`gf.Farm`: many plans in one value, written as a folder that foreign programs read."""

from __future__ import annotations

import json
import os
import sqlite3
import subprocess
import warnings
from contextlib import closing
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pyarrow.parquet as pq
import pyproj
import pytest
import shapely

import geofield as gf
from geofield.errors import FormatError, OutputExistsError
from geofield.farm import Farm, read_farm
from geofield.model.rows import rows_of

SQUARE = shapely.box(0.0, 0.0, 120.0, 90.0)


def plan_at(x: float, y: float, epsg: int, name: str, **own: object) -> gf.Plan:
    """A plan with obstacles, a headland and a route, in any zone."""
    from geofield.pipeline import run_tracks
    from geofield.settings import with_values

    outline = shapely.affinity.translate(SQUARE, x, y)
    hole = shapely.Point(x + 70.0, y + 50.0).buffer(5.0)
    polygon: Any = outline.difference(hole)
    field = gf.Field(
        polygon, pyproj.CRS(epsg), name=name, field_id=name, method="boundary",
        own=tuple(own.items()),
    )  # fmt: skip
    trees = gpd.GeoDataFrame(
        {"radius_m": [3.0, 2.5]},
        geometry=[shapely.Point(x + 30.0, y + 30.0), shapely.Point(x + 90.0, y + 20.0)],
        crs=field.crs,
    )
    from geofield.formats.foreign_tables import obstacle_table

    plan = gf.Plan(field, obstacles=obstacle_table(trees, field.crs, Path("trees")))
    settings = with_values(None, spacing_m=6, headland_m=12.0, route="shortest", buffer_m=2.25)
    return run_tracks(plan, settings=settings)


@pytest.fixture(scope="module")
def plans() -> list[gf.Plan]:
    return [
        plan_at(500_000.0, 5_500_000.0, 32632, "Süd 1", farmer="Mayer", plots=3, organic=True),
        plan_at(500_400.0, 5_500_100.0, 32632, "north/2", farmer="Özil", yield_t=7.25),
        plan_at(300_000.0, 5_300_000.0, 32633, "east"),
    ]


@pytest.mark.parametrize("umask", [0o002, 0o077])
def test_files_may_be_read_by_whom_the_user_lets(
    plans: list[gf.Plan], tmp_path: Path, umask: int
) -> None:
    usual = os.umask(umask)
    try:
        Farm(plans).write(tmp_path / "farm")
    finally:
        os.umask(usual)
    files = [path for path in (tmp_path / "farm").rglob("*") if path.is_file()]
    assert {path.stat().st_mode & 0o777 for path in files} == {0o666 & ~umask}


def test_plans_come_back_equal(plans: list[gf.Plan], tmp_path: Path) -> None:
    Farm(plans).write(tmp_path / "farm")
    back = read_farm(tmp_path / "farm")
    assert len(back) == 3
    assert back.ids == ["Süd 1", "north/2", "east"]
    for plan, again in zip(plans, back, strict=True):
        assert plan == again
        assert plan == back[plan.field.field_id]
        assert again.settings == plan.settings
    assert back["Süd 1"].field.own == (("farmer", "Mayer"), ("plots", 3), ("organic", True))
    assert "east" in back
    assert "west" not in back
    with pytest.raises(KeyError, match="did you mean 'east'"):
        back["eest"]


def test_one_zone_is_metric_and_several_are_wgs84(plans: list[gf.Plan]) -> None:
    several, one = Farm(plans), Farm(plans[:2])
    assert several.tracks.crs.to_epsg() == 4326
    assert one.tracks.crs.to_epsg() == 32632
    assert list(one.fields["utm_epsg"]) == [32632, 32632]
    # True lengths stand in the columns, whatever the CRS.
    for farm, mine in ((several, plans), (one, plans[:2])):
        for plan in mine:
            rows = farm.segments[farm.segments["field_id"] == plan.field.field_id]
            assert np.array_equal(rows["length_m"], plan.tracks.segments["length_m"])
    lonlat = several.segments.geometry.iloc[[0]].to_crs(32632).iloc[0]
    assert lonlat.hausdorff_distance(plans[0].tracks.segments.geometry.iloc[0]) < 1e-6
    assert all(len(several.layer(name)) for name in ("route", "headland", "turns"))
    assert len(several.layer("alternatives")) == 0


def test_the_users_columns_stand_beside_each_other(plans: list[gf.Plan]) -> None:
    fields = Farm(plans).fields.set_index("field_id")
    assert list(fields["farmer"].fillna("")) == ["Mayer", "Özil", ""]
    assert fields.loc["Süd 1", "plots"] == 3
    assert fields.loc["north/2", "yield_t"] == 7.25


def test_a_list_may_stand_in_a_column_of_ones_own(tmp_path: Path) -> None:
    field = gf.Field(
        shapely.box(500_000, 5e6, 500_200, 5_000_100), 32632, own=(("crops", ["a", "b"]),)
    )
    Farm([gf.Plan(field)]).write(tmp_path / "farm")
    assert read_farm(tmp_path / "farm")[field.field_id].field == field


def test_ids_that_come_twice_are_refused(plans: list[gf.Plan]) -> None:
    with pytest.raises(FormatError, match="Süd 1"):
        Farm([plans[0], plans[0]])


def test_foreign_programs_read_the_folder(plans: list[gf.Plan], tmp_path: Path) -> None:
    Farm(plans).write(tmp_path / "farm")
    part = tmp_path / "farm" / "tracks" / "chunk=0000" / "part-0.parquet"
    geo = json.loads(pq.read_metadata(part).metadata[b"geo"])
    assert geo["version"] == "1.1.0"
    assert geo["columns"]["geometry"]["covering"]["bbox"]["xmin"] == ["bbox", "xmin"]
    assert pq.ParquetFile(part).metadata.row_group(0).column(0).compression == "ZSTD"
    whole = gpd.read_parquet(tmp_path / "farm" / "tracks")
    assert set(whole["field_id"]) == {"Süd 1", "north/2", "east"}
    west = whole[whole["field_id"] == "Süd 1"].total_bounds
    some = gpd.read_parquet(tmp_path / "farm" / "tracks", bbox=tuple(west))
    assert set(some["field_id"]) == {"Süd 1"}
    # No row is missed for a box that was rounded.
    assert len(some) == (whole["field_id"] == "Süd 1").sum()
    for row in whole.geometry.iloc[:5]:
        assert len(gpd.read_parquet(tmp_path / "farm" / "tracks", bbox=row.bounds))
    tool = subprocess.run(
        ["ogrinfo", "-so", "-al", str(part)], capture_output=True, text=True, check=False
    )
    if "Parquet" in subprocess.run(["ogrinfo", "--formats"], capture_output=True, text=True,
                                   check=False).stdout:  # fmt: skip
        assert "Multi Line String" in tool.stdout


def test_a_validator_of_geoparquet_has_nothing_to_say(plans: list[gf.Plan], tmp_path: Path) -> None:
    import dask_geopandas
    import geoparquet_validator

    Farm(plans).write(tmp_path / "farm")
    for layer in ("field", "segments", "obstacles", "status"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            assert len(dask_geopandas.read_parquet(tmp_path / "farm" / layer).compute())
        report = geoparquet_validator.check(
            str(tmp_path / "farm" / layer / "chunk=0000" / "part-0.parquet")
        )
        assert geoparquet_validator.failed(report) == []


def test_a_farm_is_not_written_over_something_else(plans: list[gf.Plan], tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("years of work")
    for overwrite in (False, True):
        with pytest.raises(OutputExistsError):
            Farm(plans).write(tmp_path, overwrite=overwrite)
    Farm(plans).write(tmp_path / "farm")
    with pytest.raises(OutputExistsError):
        Farm(plans[:1]).write(tmp_path / "farm")
    Farm(plans[:1]).write(tmp_path / "farm", overwrite=True)
    assert len(read_farm(tmp_path / "farm")) == 1


def test_a_farm_that_was_read_may_be_written_over_itself(
    plans: list[gf.Plan], tmp_path: Path
) -> None:
    """All of it was taken away first, and the rest was a traceback."""
    folder = Farm(plans).write(tmp_path / "farm")
    read_farm(folder).write(folder, overwrite=True)
    assert [plan.field.field_id for plan in read_farm(folder)] == [
        plan.field.field_id for plan in plans
    ]


def test_the_same_plans_give_the_same_bytes(plans: list[gf.Plan], tmp_path: Path) -> None:
    for name in ("one", "two"):
        Farm(plans).write(tmp_path / name)
    files = sorted(p.relative_to(tmp_path / "one") for p in (tmp_path / "one").rglob("*.parquet"))
    assert len(files) > 8
    for file in files:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()


def test_a_chunk_without_status_does_not_count(plans: list[gf.Plan], tmp_path: Path) -> None:
    Farm(plans).write(tmp_path / "farm")
    (tmp_path / "farm" / "status" / "chunk=0000" / "part-0.parquet").unlink()
    assert len(read_farm(tmp_path / "farm")) == 0


def test_a_field_of_a_farm_is_written_like_any_plan(plans: list[gf.Plan], tmp_path: Path) -> None:
    Farm(plans).write(tmp_path / "farm")
    read_farm(tmp_path / "farm")["Süd 1"].write(tmp_path / "one", formats=["gpkg"])
    with closing(sqlite3.connect(tmp_path / "one" / "field.gpkg")) as file, file:
        assert file.execute("SELECT farmer, plots FROM field").fetchone() == ("Mayer", 3)


def test_a_farm_shows_itself(plans: list[gf.Plan]) -> None:
    farm = Farm(plans)
    assert "Farm of 3 fields" in repr(farm)
    assert "3 done" in repr(farm)
    assert "<svg" in farm._repr_html_()
    # One that was just begun, or of which every place failed.
    empty = Farm()
    assert "no place is done" in repr(empty)
    assert "no place is done" in empty._repr_html_()


def test_what_is_no_farm_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="no farm"):
        read_farm(tmp_path)
    (tmp_path / "farm.json").write_text('{"version": 99}')
    with pytest.raises(FormatError, match="later version"):
        read_farm(tmp_path)


def test_what_is_changed_in_a_plans_tables_is_in_the_farm(tmp_path: Path) -> None:
    plan = plan_at(500_000.0, 5_500_000.0, 32632, "one")
    assert plan.tracks is not None
    lengths_m = plan.tracks.segments["length_m"].to_numpy().copy()
    # Columns that nobody looked at, and a table that was made and changed since.
    plan.tracks.segments["length_m"] = lengths_m + 1.0
    plan.tracks.segments["driver"] = "Ayşe"
    Farm([plan]).write(tmp_path / "farm")
    found = gpd.read_parquet(tmp_path / "farm" / "segments")
    assert np.array_equal(found["length_m"], lengths_m + 1.0)
    assert set(found["driver"]) == {"Ayşe"}
    assert len(gpd.read_parquet(tmp_path / "farm" / "gaps")) == len(plan.tracks.gaps)
    assert read_farm(tmp_path / "farm")["one"] == plan


def test_no_table_is_made_of_the_tracks_of_a_parcel(tmp_path: Path) -> None:
    """They go from the planner to the files: tables would be most of the work."""
    parcel = gpd.GeoDataFrame(geometry=[shapely.box(0, 0, 200, 100)], crs=32633)
    parcel.translate(500_000, 5_500_000).to_file(tmp_path / "one.gpkg")
    (plan,) = gf.plan_fields(tmp_path / "one.gpkg", spacing_m=5)
    assert plan.tracks is not None
    rows = rows_of(plan.tracks)
    assert len(rows["tracks"]) == 20
    assert [name for name, each in rows.items() if each._frame is not None] == []
