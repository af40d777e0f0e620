"""One field edited in two places: both words stand, or what gives way is told."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyogrio
import pytest
import shapely
from pyproj import CRS

import geofield as gf
from geofield.earlier import with_said_tracks
from geofield.farm.edited_in_place import edited_in_place
from geofield.farm.overview import write_overview
from geofield.farm.put_back import put_back, take_in_place
from geofield.farm.store import Store
from geofield.model.evidence import Evidence, outline_record
from geofield.model.obstacles import from_polygons
from geofield.pipeline import run_tracks
from geofield.plan_files import save_plan
from geofield.review import Session
from geofield.review.shelf import Shelf
from geofield.settings import Settings
from geofield_command import run_geofield

UTM = CRS(32633)
Y = 5_300_000.0
X = {"a": 500_000.0, "b": 500_200.0}


@pytest.fixture
def farm(tmp_path: Path) -> Path:
    """Two fields of 100 m with two trees in each, and their overview."""
    plans = []
    for one, x in X.items():
        trees = shapely.buffer(shapely.points([(x + 30, Y + 30), (x + 60, Y + 70)]), 3)
        shape = shapely.box(x, Y, x + 100, Y + 100)
        field = gf.Field(shape, crs=UTM, name=one, field_id=one, method="boundary")
        known = Evidence(outline=outline_record(shape))
        found = from_polygons(trees, UTM, buffer_m=0.0, status="added")
        settings = Settings(tracks={"spacing_m": 6.0})
        plans.append(run_tracks(gf.Plan(field, obstacles=found, evidence=known), settings=settings))
    folder = gf.Farm(plans).write(tmp_path / "farm")
    write_overview(gf.read_farm(folder), folder)
    return folder


def _said(farm: Path, one: str) -> dict[int, str]:
    table = gf.read_farm(farm)[one].obstacles
    return dict(table[["obstacle_no", "status"]].itertuples(index=False))


def _edit(file: Path, change: Callable[[Any], Any]) -> None:
    table = change(pyogrio.read_dataframe(file, layer="obstacles"))
    pyogrio.write_dataframe(table, file, layer="obstacles", geometry_name="geom")


def _as(one: str, number: int, status: str) -> Callable[[Any], Any]:
    """With a status for an obstacle of a field, or of the only one."""

    def change(table: Any) -> Any:
        there = table["obstacle_no"] == number
        there &= table["field_id"] == one if "field_id" in table else True
        return table.assign(status=table["status"].mask(there, status))

    return change


def _put(file: Path, farm: Path, code: int = 0) -> str:
    done = run_geofield("farm", "put", file, farm)
    assert done.returncode == code, done.stderr
    return " ".join(done.stderr.split())


def _reviewed(farm: Path) -> Path:
    """The plan of b in `reviewed/`, as the page saved it with its first tree rejected."""
    shelf = Shelf(farm)
    shelf.open([name.split(" ")[0] for name in shelf.names].index("b"))
    shelf.desk.edit({"do": "status", "no": 1, "status": "rejected"})
    shelf.desk.save()
    shelf.end()
    return farm / "reviewed" / "b.gpkg"


def test_what_the_overview_is_put_over_is_told_and_stays(farm: Path) -> None:
    """The page's own words lead there, and what it had saved was gone without any."""
    _edit(farm / "farm.gpkg", _as("b", 2, "rejected"))
    file = _reviewed(farm)
    words = _put(farm / "farm.gpkg", farm)
    assert "Field b was changed in the farm since farm.gpkg was written, too" in words
    assert "the other plan stays as reviewed/b.gpkg.bak" in words
    assert _said(farm, "b") == {1: "added", 2: "rejected"}
    assert list(gf.read_plan(file).obstacles["status"]) == ["added", "rejected"]
    kept = gf.read_plan(shutil.copy(farm / "reviewed" / "b.gpkg.bak", farm.parent / "bak.gpkg"))
    assert list(kept.obstacles["status"]) == ["rejected", "added"]


def test_another_overview_is_not_put_over_edits_of_the_farms_own(farm: Path) -> None:
    """Those were gone without a word: it was written anew."""
    other = Path(shutil.copy(farm / "farm.gpkg", farm.parent / "other.gpkg"))
    _edit(other, _as("a", 1, "rejected"))
    _edit(farm / "farm.gpkg", _as("b", 2, "rejected"))
    assert "farm.gpkg has edits that the farm does not hold yet" in _put(other, farm, code=1)
    _put(farm / "farm.gpkg", farm)
    assert "changed in the farm" not in _put(other, farm)
    assert _said(farm, "a") == {1: "rejected", 2: "added"}
    assert _said(farm, "b") == {1: "added", 2: "rejected"}


@pytest.mark.parametrize("door", ["page", "command"])
def test_settings_said_of_a_reviewed_plan_where_it_lies_are_taken_in(farm: Path, door: str) -> None:
    """They were passed over."""
    file, store = _reviewed(farm), Store.of(farm)
    assert not list(edited_in_place(store))
    if door == "page":
        session = Session(gf.read_plan(file))
        session.do({"do": "tracks", "settings": {"direction": "30"}})
        save_plan(session.plan, file, overwrite=True)
    else:
        done = run_geofield("tracks", file, "--direction", 30, "-o", file, "--overwrite")
        assert done.returncode == 0, done.stderr
    assert list(edited_in_place(store)) == ["b"]
    take_in_place(store, "b")
    plan = gf.read_farm(farm)["b"]
    assert plan.tracks.heading_deg == pytest.approx(30.0, abs=0.1)
    assert plan.tracks.spacing_m == 6.0
    assert gf.read_plan(file) == plan
    assert not list(edited_in_place(store))
    # As those of the page did: what the command had said gave way when all is planned anew.
    settings, told = with_said_tracks(Settings(tracks={"spacing_m": 12.0}), plan)
    assert (settings.tracks.direction, settings.tracks.spacing_m) == ("30", 12.0)
    assert told == ("as set for this field: --direction 30",)


def test_settings_of_the_farm_are_no_edit_of_a_reviewed_plan(farm: Path) -> None:
    """Those of a later run: the file has the ones with which it was put."""
    file, store = _reviewed(farm), Store.of(farm)
    plan = gf.read_farm(farm)["b"]
    wide = run_tracks(plan, settings=Settings(tracks={"spacing_m": 12.0}))
    gf.Farm([gf.read_farm(farm)["a"], wide]).write(farm, overwrite=True)
    file.touch()
    assert not list(edited_in_place(store))


def test_a_reviewed_plan_that_comes_with_an_older_time_is_taken_in(farm: Path) -> None:
    """As rsync and cp -p bring one that was edited on another machine."""
    file, store = _reviewed(farm), Store.of(farm)
    other = Path(shutil.copy(file, farm.parent / "b.gpkg"))
    _edit(other, _as("b", 2, "confirmed"))
    os.utime(other, ns=(1, 1))
    shutil.copy2(other, file)
    assert list(edited_in_place(store)) == ["b"]
    take_in_place(store, "b")
    assert _said(farm, "b") == {1: "rejected", 2: "confirmed"}


def test_a_plan_put_back_twice_says_nothing_new(farm: Path) -> None:
    file, store = _reviewed(farm), Store.of(farm)
    put_back(file, farm)
    assert not list(edited_in_place(store))
