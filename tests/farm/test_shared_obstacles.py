"""What stands in a field is avoided: beside a border, and in one that a person reviewed."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import geopandas as gpd
import pandas as pd
import pyogrio
import pytest
import shapely
import shapely.affinity
from pyproj import CRS

import geofield as gf
from geofield.errors import FieldWarning
from geofield.farm.edits import put_edits
from geofield.farm.finish import renew
from geofield.farm.overview import write_overview
from geofield.farm.places import Place
from geofield.farm.put_back import put_back
from geofield.farm.store import Store
from geofield.farm.work import Job, plan_place
from geofield.pipeline import run_tracks
from geofield.plan_files import save_plan
from geofield.settings import Settings

#: Three square fields of 100 m, 20 m apart, a tree in each.
X = {"a": 500_000.0, "b": 500_120.0, "c": 500_240.0}
Y = 5_300_000.0
UTM = CRS(32633)


@pytest.fixture
def farm(tmp_path: Path) -> Path:
    trees = gpd.GeoDataFrame(
        {"radius_m": [3.0] * 3}, geometry=[shapely.Point(x + 70, Y + 50) for x in X.values()],
        crs=UTM,
    )  # fmt: skip
    trees.to_file(tmp_path / "trees.gpkg")
    plans = [plan_place(_place(one), _job(tmp_path)) for one in X]
    folder = gf.Farm(plans).write(tmp_path / "farm")
    write_overview(gf.read_farm(folder), folder)
    return folder


def _job(folder: Path) -> Job:
    return Job(Settings(tracks={"spacing_m": 6.0}), obstacles=folder / "trees.gpkg")


def _place(one: str) -> Place:
    outline = shapely.box(X[one], Y, X[one] + 100, Y + 100)
    lon, lat = gpd.GeoSeries([outline.centroid], crs=UTM).to_crs(4326)[0].coords[0]
    return Place(1, one, one, lat, lon, outline=outline.wkb, crs=UTM.srs)


def _edit(farm: Path, layer: str, change: Callable[[Any], Any]) -> None:
    table = change(pyogrio.read_dataframe(farm / "farm.gpkg", layer=layer))
    pyogrio.write_dataframe(table, farm / "farm.gpkg", layer=layer, geometry_name="geom")


def _sql(farm: Path, statement: str) -> None:
    with closing(sqlite3.connect(farm / "farm.gpkg")) as file, file:
        for (name,) in list(file.execute("SELECT name FROM sqlite_master WHERE type='trigger'")):
            file.execute(f'DROP TRIGGER "{name}"')
        file.execute(statement)


def _and(shape: shapely.Polygon) -> Callable[[Any], Any]:
    """With an obstacle that was drawn."""
    return lambda table: pd.concat([table, gpd.GeoDataFrame(geometry=[shape], crs=table.crs)])


def _inside_m(farm: Path, one: str, shape: shapely.Polygon) -> float:
    """Metres of track of a field in a shape."""
    segments = gf.read_farm(farm)[one].tracks.segments
    return float(segments.intersection(shape.buffer(-0.05)).length.sum())


def test_an_obstacle_drawn_over_a_border_is_avoided_on_both_sides(farm: Path) -> None:
    hedge = shapely.box(X["a"] + 60, Y + 20, X["b"] + 30, Y + 30)
    assert _inside_m(farm, "a", hedge) > 10
    _edit(farm, "obstacles", _and(hedge))
    ids, _ = put_edits(farm, farm / "farm.gpkg")
    assert sorted(ids) == ["a", "b"]
    assert [_inside_m(farm, one, hedge) for one in "ab"] == [0, 0]
    # Not again, where the overview is older than the farm; nor where it was taken away in one.
    assert put_edits(farm, farm / "farm.gpkg") == ([], [])
    renew(Store.of(farm))
    _sql(farm, "DELETE FROM obstacles WHERE field_id = 'a' AND obstacle_no > 1")
    assert put_edits(farm, farm / "farm.gpkg") == (["a"], [])
    assert _inside_m(farm, "a", hedge) > 10
    assert _inside_m(farm, "b", hedge) == 0


def test_an_outline_moved_over_its_neighbours_tree_avoids_it(farm: Path) -> None:
    tree = shapely.Point(X["c"] + 70, Y + 50).buffer(3)
    wide = shapely.box(X["b"], Y, X["c"] + 90, Y + 100)

    def widened(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        table.loc[table["field_id"] == "b", "geometry"] = wide
        return table

    _edit(farm, "field", widened)
    ids, _ = put_edits(farm, farm / "farm.gpkg")
    assert ids == ["b"]
    assert _inside_m(farm, "b", tree) == 0
    assert len(gf.read_farm(farm)["b"].obstacles) == 2


def test_an_outline_moved_over_a_tree_of_the_file_avoids_it(farm: Path) -> None:
    shed = shapely.Point(X["c"] + 110, Y + 50)
    trees = gpd.read_file(farm.parent / "trees.gpkg")
    shed_row = gpd.GeoDataFrame({"radius_m": [4.0]}, geometry=[shed], crs=UTM)
    pd.concat([trees, shed_row]).to_file(farm.parent / "more.gpkg")

    def widened(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        table.loc[table["field_id"] == "c", "geometry"] = shapely.box(
            X["c"], Y, X["c"] + 130, Y + 100
        )
        return table

    _edit(farm, "field", widened)
    job = Job(Settings(), obstacles=farm.parent / "more.gpkg")
    put_edits(farm, farm / "farm.gpkg", around=job.standing)
    assert _inside_m(farm, "c", shed.buffer(4)) == 0
    assert len(gf.read_farm(farm)["c"].obstacles) == 2


def test_a_reviewed_field_avoids_what_is_new_in_the_file(farm: Path) -> None:
    """It was frozen; what a person took away or moved does not come back."""
    trees, file = gpd.read_file(farm.parent / "trees.gpkg"), farm.parent / "more.gpkg"
    bent = shapely.LineString([(X["a"] + 10, Y + 90), (X["a"] + 20, Y + 90), (X["a"] + 20, Y + 80)])
    more = [shapely.Point(X["a"] + 40, Y + 50), shapely.Point(X["a"] + 30, Y + 20), bent]
    pd.concat([trees, gpd.GeoDataFrame({"radius_m": [3.0] * 3}, geometry=more, crs=UTM)]).to_file(
        file
    )
    job = replace(_job(farm.parent), obstacles=file)
    plan = plan_place(_place("a"), job)
    assert len(plan.obstacles) == 4
    told = plan.obstacles.iloc[1:].copy()
    told.loc[told.index[0], "geometry"] = shapely.affinity.translate(told.geometry.iloc[0], 0, 20)
    reviewed = run_tracks(replace(plan, obstacles=told), settings=plan.settings)
    again = plan_place(_place("a"), job, reviewed)
    assert again.obstacles.geometry.equals(reviewed.obstacles.geometry)
    new = shapely.Point(X["a"] + 80, Y + 80)
    row = gpd.GeoDataFrame({"radius_m": [3.0]}, geometry=[new], crs=UTM)
    pd.concat([gpd.read_file(file), row]).to_file(farm.parent / "newer.gpkg")
    job = replace(_job(farm.parent), obstacles=farm.parent / "newer.gpkg")
    again = plan_place(_place("a"), job, reviewed)
    assert len(again.obstacles) == 4
    assert again.obstacles.geometry.iloc[-1].contains(new)
    assert not again.tracks.segments.intersects(new.buffer(2.9)).any()
    assert plan_place(_place("a"), job, again).obstacles.equals(again.obstacles)


def test_a_plan_put_back_has_what_the_farm_was_given_since(farm: Path) -> None:
    save_plan(gf.read_farm(farm)["a"], farm.parent / "a.gpkg")
    new = shapely.Point(X["a"] + 30, Y + 30)
    row = gpd.GeoDataFrame({"radius_m": [3.0]}, geometry=[new], crs=UTM)
    file = farm.parent / "trees.gpkg"
    pd.concat([gpd.read_file(file), row]).to_file(farm.parent / "newer.gpkg")
    job = replace(_job(farm.parent), obstacles=farm.parent / "newer.gpkg")
    gf.Farm([plan_place(_place(one), job) for one in X]).write(farm, overwrite=True)
    with pytest.warns(FieldWarning, match="planned again"):
        put_back(farm.parent / "a.gpkg", farm)
    assert _inside_m(farm, "a", new.buffer(3)) == 0


def test_a_reviewed_field_gets_its_parcel_unless_its_outline_was_drawn(farm: Path) -> None:
    job, plan = _job(farm.parent), gf.read_farm(farm)["a"]
    wider = shapely.box(X["a"] - 50, Y, X["a"] + 100, Y + 100)
    place = replace(_place("a"), outline=wider.wkb)
    rejected = plan.obstacles.assign(status="rejected")
    reviewed = run_tracks(replace(plan, obstacles=rejected), settings=plan.settings)
    again = plan_place(place, job, reviewed)
    assert again.field.polygon.equals(wider)
    assert again.obstacles["status"].tolist() == ["rejected"]
    assert again.tracks.segments.total_bounds[0] < X["a"] - 40
    drawn = replace(plan.field, polygon=shapely.box(X["a"], Y, X["a"] + 100, Y + 90))
    reviewed = run_tracks(replace(plan, field=drawn), settings=plan.settings)
    with pytest.warns(FieldWarning, match="reviewed outline stands; that of the places differs by"):
        again = plan_place(place, job, reviewed)
    assert again.field.polygon.equals(drawn.polygon)
