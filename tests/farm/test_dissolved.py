"""Layers of a farm's overview that another program dissolved across fields lose no row."""

from __future__ import annotations

import shutil
from collections.abc import Callable
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
from geofield.errors import FormatWarning
from geofield.farm.edits import is_edited, put_edits
from geofield.farm.overview import write_overview
from geofield.farm.places import Place
from geofield.farm.work import Job, plan_place
from geofield.settings import Settings
from geofield_command import run_geofield

UTM = CRS(32633)
#: Square fields of 100 m: two beside each other, and one in the next zone.
AT = {"a": (500_000.0, 32633), "b": (500_110.0, 32633), "c": (500_000.0, 32634)}
Y = 5_300_000.0
LOST = "ignore:.* has no column .* any more:geofield.errors.FormatWarning"
Change = Callable[[Any], Any]


def _place(one: str) -> Place:
    x, epsg = AT[one]
    outline = shapely.box(x, Y, x + 100, Y + 100)
    lon, lat = gpd.GeoSeries([outline.centroid], crs=epsg).to_crs(4326)[0].coords[0]
    return Place(1, one, one, lat, lon, outline=outline.wkb, crs=CRS(epsg).srs)


@pytest.fixture(scope="module", params=["ab", "abc"], ids=["one zone", "two zones"])
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two trees in each field, and a hedge in a and b, a row of each."""
    folder = tmp_path_factory.mktemp("dissolved")
    hedge = gpd.GeoSeries([shapely.box(500_080, Y + 60, 500_130, Y + 64)], crs=UTM)
    things = [hedge.to_crs(4326)]
    for one in request.param:
        x, epsg = AT[one]
        trees = shapely.buffer(shapely.points([(x + 30, Y + 30), (x + 60, Y + 33)]), 3)
        things.append(gpd.GeoSeries(trees, crs=epsg).to_crs(4326))
    gpd.GeoDataFrame(geometry=pd.concat(things), crs=4326).to_file(folder / "trees.gpkg")
    job = Job(Settings(tracks={"spacing_m": 6.0}), obstacles=folder / "trees.gpkg")
    farm = gf.Farm([plan_place(_place(one), job) for one in request.param]).write(folder / "farm")
    write_overview(gf.read_farm(farm), farm)
    return farm


@pytest.fixture
def farm(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "farm"))


def _edit(farm: Path, layer: str, change: Change) -> None:
    table = change(pyogrio.read_dataframe(farm / "farm.gpkg", layer=layer))
    pyogrio.write_dataframe(table, farm / "farm.gpkg", layer=layer, geometry_name="geom")


def _dissolved(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    return table.iloc[[0]].set_geometry([table.union_all()], crs=table.crs)


def _bare(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    return _dissolved(table)[["geometry"]]


def _emptied(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    one = _dissolved(table)
    return one.assign(**dict.fromkeys(one.columns.drop("geometry")))


def _by_field(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    return table.dissolve("field_id", as_index=False)


def _apart(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """The one thing that is in two fields is a single row then."""
    return _bare(table).explode(ignore_index=True)


def _inside_m(plan: gf.Plan) -> float:
    assert plan.tracks is not None
    assert plan.obstacles is not None
    driven = plan.tracks.segments.union_all()
    around = plan.obstacles[plan.obstacles["status"] != "rejected"].union_all().buffer(-0.01)
    return float(driven.intersection(around).length)


def _rows(farm: Path) -> dict[str, list[tuple[int, str]]]:
    return {
        plan.field.field_id: [
            (int(no), status)
            for no, status in plan.obstacles[["obstacle_no", "status"]].itertuples(index=False)
        ]
        for plan in gf.read_farm(farm)
        if plan.obstacles is not None
    }


@pytest.mark.filterwarnings(LOST)
@pytest.mark.parametrize("change", [_dissolved, _bare, _emptied, _by_field])
@pytest.mark.parametrize("layer", ["obstacles", "tracks", "segments"])
def test_a_layer_dissolved_across_fields_is_no_edit(farm: Path, layer: str, change: Change) -> None:
    """All trees of one field became another's, its tracks became drawn ones."""
    _edit(farm, layer, change)
    with pytest.warns(FormatWarning, match="merged into another row: each counts as it was"):
        assert put_edits(farm, farm / "farm.gpkg") == ([], [])
    assert not is_edited(farm, farm / "farm.gpkg")


@pytest.mark.filterwarnings(LOST)
def test_rows_that_lost_all_columns_are_no_edit(farm: Path) -> None:
    """The hedge is one row then, and was gone from one of its fields."""
    _edit(farm, "obstacles", _apart)
    assert put_edits(farm, farm / "farm.gpkg") == ([], [])


def test_what_was_edited_before_it_was_dissolved_stands(farm: Path) -> None:
    before = _rows(farm)
    tree = gf.read_farm(farm)["b"].obstacles.iloc[-1]

    def edited(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        there = (table["field_id"] == "b") & (table["obstacle_no"] == tree["obstacle_no"])
        return _dissolved(table[~there]).assign(status="rejected")

    _edit(farm, "obstacles", edited)
    with pytest.warns(FormatWarning, match="each counts as it was written"):
        ids, _ = put_edits(farm, farm / "farm.gpkg")
    assert sorted(ids) == ["a", "b"]
    after = _rows(farm)
    assert after["b"] == before["b"][:-1]
    assert after["a"] == [(before["a"][0][0], "rejected"), *before["a"][1:]]
    assert all(_inside_m(plan) == 0 for plan in gf.read_farm(farm))
    # Not again, while the overview is older than the farm.
    with pytest.warns(FormatWarning, match="each counts as it was written"):
        assert put_edits(farm, farm / "farm.gpkg") == ([], [])


def test_merged_with_a_rejected_one_of_another_field_it_is_driven_around(farm: Path) -> None:
    """It was gone with its row: they drove through it."""
    mine = gf.read_farm(farm)["b"].obstacles.set_index("obstacle_no").geometry
    tree = mine[mine.area < 30].iloc[0]

    def merged(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        there = table["field_id"] == "b"
        there &= table["obstacle_no"] == mine.index[mine == tree][0]
        first = table.index[table["field_id"] == "a"][0]
        table.loc[first, "geometry"] = table.geometry[[first, *table.index[there]]].union_all(
        ).convex_hull  # fmt: skip
        table.loc[first, "status"] = "rejected"
        return table[~there]

    _edit(farm, "obstacles", merged)
    with pytest.warns(FormatWarning, match="1 row of field b merged .* driven around there"):
        put_edits(farm, farm / "farm.gpkg")
    plan = gf.read_farm(farm)["b"]
    assert plan.tracks.segments.intersection(tree.buffer(-0.01)).length.sum() == 0


def test_a_track_taken_away_and_one_drawn_before_they_were_dissolved(farm: Path) -> None:
    before = gf.read_farm(farm)["b"].tracks.lines.set_index("track_no").geometry
    drawn = shapely.affinity.scale(shapely.affinity.translate(before[2], 2.0, 1.5), 0.5, 0.5)

    def edited(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        table = table[(table["field_id"] != "b") | (table["track_no"] != 4)]
        if "segment_no" not in table:
            line = gpd.GeoDataFrame(geometry=[drawn], crs=UTM).to_crs(table.crs)
            table = pd.concat([table, line], ignore_index=True)
        return _dissolved(table)

    for layer in ("tracks", "segments"):
        _edit(farm, layer, edited)
    with pytest.warns(FormatWarning, match="each counts as it was written"):
        assert put_edits(farm, farm / "farm.gpkg") == (["b"], [])
    after = gf.read_farm(farm)["b"].tracks.lines.set_index("track_no").geometry
    (new,) = set(after.index) - set(before.index)
    assert set(before.index) - set(after.index) == {4}
    assert after[new].within(drawn.buffer(0.01))


def test_the_command_tells_of_it(farm: Path) -> None:
    _edit(farm, "obstacles", _dissolved)
    done = run_geofield("farm", "put", farm / "farm.gpkg", farm)
    assert done.returncode == 0, done.stderr
    words = " ".join(done.stderr.split())
    assert "Layer 'obstacles':" in words
    assert "merged into another row: each counts as it was written" in words
    assert "farm.gpkg has no edits" in words
