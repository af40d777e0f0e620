"""A plan is the same value before it is written and after it is read."""

from __future__ import annotations

import copy
import json
import math
from dataclasses import asdict, replace
from pathlib import Path

import geopandas as gpd
import pandas as pd
import pytest
import shapely
from pyproj import CRS

import geofield as gf
from geofield.crs import parse_crs, transformer
from geofield.errors import GeofieldError
from geofield.model.obstacles import circle_polygons
from geofield.pipeline import run_tracks
from geofield.plan import Plan, read_plan
from geofield.settings import load_settings
from geofield_command import run_geofield

UTM = CRS.from_epsg(32636)
X, Y = 545_000.0, 3_880_000.0
SETTINGS = load_settings(
    None, {"tracks": {"spacing_m": 5.0, "headland_m": 5.0}, "export": {"formats": ["gpkg", "rdf"]}}
)


@pytest.fixture(scope="module")
def plan() -> Plan:
    """A field with a wall that leaves nothing of two tracks, and a tree on two others."""
    wall = shapely.box(X - 1, Y + 18, X + 121, Y + 28)
    table = gpd.GeoDataFrame(
        {
            "obstacle_no": [1, 2],
            "kind": ["other", "tree"],
            "status": "added",
            "radius_m": [None, 4],
        },
        geometry=[wall, *circle_polygons([X + 60], [Y + 45], [4.0], UTM)],
        crs=UTM,
    ).assign(status="added", buffer_m=0.0)
    field = gf.Field(shapely.box(X, Y, X + 120, Y + 60), crs=UTM)
    obstacles = gf.schema.conform(gf.schema.OBSTACLES, table)
    return run_tracks(Plan(field, obstacles), settings=SETTINGS)


@pytest.mark.parametrize("product", ["field.gpkg", "field.rdf"])
def test_statistics_are_the_same_after_a_round_trip(
    plan: Plan, product: str, tmp_path: Path
) -> None:
    assert plan.tracks is not None
    before = plan.tracks.statistics
    assert before.blocked_count == 2
    assert 50 < before.coverage_percent < 100
    assert [loss.obstacle_no for loss in before.losses] == [1, 2]
    plan.write(tmp_path)
    again = read_plan(tmp_path / product)
    assert again.tracks is not None
    assert again.tracks.statistics == before
    assert again == plan
    assert again.field == plan.field
    assert len({again.field, plan.field}) == 1
    assert replace(again.field, name="other") != plan.field


def test_the_command_tells_the_same_figures_as_the_plan_that_it_wrote(
    plan: Plan, tmp_path: Path
) -> None:
    plan.write(tmp_path / "out")
    file = tmp_path / "out/field.gpkg"
    done = run_geofield("tracks", file, "--spacing", 5, "-o", file, "--json", check=True)
    (told,) = json.loads(done.stdout)["fields"]
    tracks = read_plan(file).tracks
    assert tracks is not None
    for name, value in asdict(tracks.statistics).items():
        if name == "losses":
            assert told[name] == [asdict(loss) for loss in tracks.statistics.losses]
        else:
            assert math.isclose(told[name], value, rel_tol=1e-12), name


def test_comparing_plans_plans_nothing(
    plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from geofield.tracks import direction

    plan.write(tmp_path)
    again = read_plan(tmp_path / "field.gpkg")

    def refused(*args: object, **options: object) -> None:
        raise AssertionError("== ran a track algorithm")

    monkeypatch.setattr(direction, "find_baseline", refused)
    monkeypatch.setattr(direction, "longest_edge", refused)
    assert again == plan
    assert again != run_other(plan)


@pytest.mark.parametrize("product", ["field.gpkg", "field.rdf"])
def test_that_nobody_looked_for_obstacles_is_known_again(product: str, tmp_path: Path) -> None:
    """It came back as a search that had found none, which says that the field is free."""
    plan = Plan(gf.Field(shapely.box(X, Y, X + 120, Y + 60), crs=UTM))
    plan.write(tmp_path, formats=["gpkg", "rdf"])
    again = read_plan(tmp_path / product)
    assert again.obstacles is None
    assert again == plan


def test_names_of_a_column_of_numbers(tmp_path: Path) -> None:
    """They ended the writing of a plan in a traceback."""
    numbers = pd.array([7, 8, pd.NA], dtype="Int64")
    shape = shapely.box(X, Y, X + 120, Y + 60)
    field = gf.Field(shape, UTM, name=numbers[0], field_id=numbers[1])
    Plan(field).write(tmp_path, formats="gpkg")
    again = read_plan(tmp_path / "field.gpkg").field
    assert (again.name, again.field_id) == ("7", "8")
    assert gf.Field(shape, UTM, name=numbers[2]) == gf.Field(shape, UTM)


def test_tracks_compare_by_value(plan: Plan) -> None:
    assert plan.tracks is not None
    assert copy.deepcopy(plan.tracks) == plan.tracks
    assert run_tracks(plan, settings=SETTINGS).tracks == plan.tracks
    fewer = plan.tracks.segments.iloc[1:]
    assert replace(plan.tracks, segments=fewer) != plan.tracks
    assert plan.tracks != "tracks"


def run_other(plan: Plan) -> Plan:
    """The same plan under another name of the field."""
    from dataclasses import replace

    return replace(plan, field=replace(plan.field, name="another"))


def test_a_place_in_a_field_that_180_degrees_runs_through() -> None:
    polygon = shapely.box(817_500, 8_007_000, 817_900, 8_007_200)
    field = gf.Field(polygon, parse_crs("EPSG:32760"))
    longitudes = shapely.get_coordinates(field.polygon_lonlat)[:, 0]
    assert longitudes.min() < -179 < 179 < longitudes.max()
    lat, lon = Plan(field).point
    there = shapely.Point(transformer(parse_crs(4326), field.crs).transform(lon, lat))
    assert polygon.contains(there)


def test_arguments_of_a_wrong_kind_are_refused_by_their_names(plan: Plan, tmp_path: Path) -> None:
    field = gpd.GeoDataFrame(geometry=[plan.field.polygon], crs=UTM)
    for name, call in {
        "overrides": lambda: gf.load_settings(None, 3),  # type: ignore[arg-type]
        "formats": lambda: plan.write(tmp_path, formats=3),  # type: ignore[arg-type]
        "options": lambda: plan.write(tmp_path, formats=["gpkg"], options=3),  # type: ignore[arg-type]
        "client": lambda: next(gf.plan_fields(field, client=3)),
    }.items():
        with pytest.raises(GeofieldError, match=f"`{name}` must be a .*, not int"):
            call()
    with pytest.raises(GeofieldError, match="no format 3"):
        plan.write(tmp_path, formats=[3])  # type: ignore[list-item]
