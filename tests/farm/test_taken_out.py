"""A plan that was taken out of a farm is put over what it was made from, and over nothing else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import geopandas as gpd
import pandas as pd
import pytest
import shapely
from click.testing import CliRunner
from pyproj import CRS

import geofield as gf
from geofield import schema
from geofield.cli.main import cli
from geofield.errors import FormatError
from geofield.farm.put_back import put_back
from geofield.model.evidence import Evidence, outline_record
from geofield.pipeline import run_tracks
from geofield.plan_files import save_plan
from geofield.settings import Settings
from geofield.staging.generations import undo
from geofield_command import run_geofield

UTM = CRS(32633)


def _farm(folder: Path, y: float = 5_300_000.0) -> Path:
    """A farm of two square fields."""
    settings = Settings(tracks={"spacing_m": 6.0})
    plans = []
    for one, x in (("a", 500_000.0), ("b", 500_200.0)):
        field = gf.Field(shapely.box(x, y, x + 100, y + 100), UTM, name=one, field_id=one)
        evidence = Evidence(outline=outline_record(field.polygon))
        plans.append(run_tracks(gf.Plan(field, evidence=evidence), settings=settings))
    return gf.Farm(plans).write(folder)


def _get(farm: Path, to: Path) -> Path:
    done = CliRunner().invoke(cli, ["farm", "get", str(farm), "a", "-o", str(to)])
    assert done.exit_code == 0, done.output
    return to


def _tree(file: Path, x: float) -> None:
    """Add a tree to a plan in a file, as the review page does."""
    plan = gf.read_plan(file)
    tree = gpd.GeoDataFrame(geometry=[shapely.Point(x, 5_300_050).buffer(4)], crs=UTM)
    tree = schema.conform(schema.OBSTACLES, tree)
    parts = [part for part in (plan.obstacles, tree) if part is not None and len(part)]
    plan = replace(plan, obstacles=pd.concat(parts))
    save_plan(run_tracks(plan, settings=plan.settings), file, overwrite=True)


def test_a_second_copy_does_not_replace_the_first_without_a_word(tmp_path: Path) -> None:
    farm = _farm(tmp_path / "farm")
    one, other = (_get(farm, tmp_path / f"{name}.gpkg") for name in ("one", "other"))
    _tree(one, 500_030)
    _tree(other, 500_070)
    put_back(one, farm)
    with pytest.raises(FormatError, match=r"a was changed in .* since other\.gpkg was taken out"):
        put_back(other, farm)
    assert gf.read_farm(farm)["a"].obstacles.geometry.centroid.x.round().tolist() == [500_030]
    # The same file again, edited further, is no other's work; nor is what is taken out now.
    _tree(one, 500_050)
    put_back(one, farm)
    assert len(gf.read_farm(farm)["a"].obstacles) == 2
    later = _get(farm, tmp_path / "later.gpkg")
    _tree(later, 500_010)
    put_back(later, farm)
    with pytest.raises(FormatError, match="since one"):
        put_back(one, farm)
    done = CliRunner().invoke(cli, ["farm", "put", str(other), str(farm), "--anyway"])
    assert done.exit_code == 0, done.output
    assert len(gf.read_farm(farm)["a"].obstacles) == 1
    undo(farm / "reviewed" / "a.gpkg")
    assert len(gf.read_plan(farm / "reviewed" / "a.gpkg").obstacles) == 3


def test_a_plan_of_other_ground_is_refused(tmp_path: Path) -> None:
    farm, far = _farm(tmp_path / "farm"), _farm(tmp_path / "far", 5_400_000.0)
    before = gf.read_farm(farm)["a"]
    with pytest.raises(FormatError, match="'a' is of a field elsewhere"):
        put_back(_get(far, tmp_path / "far.gpkg"), farm)
    neighbour = replace(before, field=replace(before.field, field_id="b"))
    save_plan(neighbour, tmp_path / "b.gpkg")
    with pytest.raises(FormatError, match="'b' is of a field elsewhere"):
        put_back(tmp_path / "b.gpkg", farm)
    assert gf.read_farm(farm)["a"] == before


def test_a_file_in_place_of_the_farm_is_no_farm(tmp_path: Path) -> None:
    # Errors of the system told of a file of the farm's inside that file.
    plan = _get(_farm(tmp_path / "farm"), tmp_path / "one.gpkg")
    done = run_geofield("farm", "get", "one.gpkg", "a", "-o", "two.gpkg", folder=tmp_path)
    assert done.returncode == 1
    assert done.stderr.startswith("Error: one.gpkg is no farm of geofield"), done.stderr
    done = run_geofield("farm", "put", plan.name, "one.gpkg", folder=tmp_path)
    assert done.returncode == 1
    assert done.stderr.startswith("Error: one.gpkg is no farm of geofield"), done.stderr


def test_reasons_are_looked_for_only_where_they_lie(tmp_path: Path) -> None:
    # The next step named a failed.csv that a farm without failed places has not.
    farm = _farm(tmp_path / "farm")
    for there in (False, True):
        if there:
            (farm / "failed.csv").write_text("id,reason\nc,no field there\n", "utf-8")
        done = run_geofield("farm", "get", "farm", "c", "-o", "c.gpkg", folder=tmp_path)
        assert done.returncode == 1
        assert "It has plans of a, b" in done.stderr
        assert ("failed.csv" in done.stderr) == there, done.stderr
