"""The pipeline: one call or stage by stage, a person's edits kept, plans read back."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from pyproj import CRS

import geofield as gf
from geofield.errors import FieldError, OutputExistsError, TrackError
from geofield.model.evidence import Evidence
from geofield.model.review import reconcile
from geofield.model.written import Written
from geofield.pipeline import plan_field, run_field, run_obstacles, run_tracks
from geofield.plan import Plan, read_plan
from geofield.settings import Settings, load_settings
from geofield.simulate import SimulatedField
from geofield_command import run_geofield as geofield

SETTINGS = load_settings(None, {"tracks": {"spacing_m": 6.0}, "obstacles": {"buffer_m": 1.5}})


@pytest.fixture(scope="module")
def plan(simulated: SimulatedField) -> Plan:
    return plan_field(simulated.scene, lat=simulated.lat, lon=simulated.lon, settings=SETTINGS)


@pytest.mark.parametrize(
    ("argument", "next_step"),
    [
        ({"settings": {"tracks": {"spacing_m": 6}}}, "load_settings"),
        ({"boundary": shapely.box(0, 0, 9, 9)}, "Field"),
        ({"previous": "out/field.gpkg"}, "read_plan"),
        ({"include": [shapely.Point(33.5, 35.0)]}, "point.x"),
    ],
)
def test_arguments_of_another_kind_are_told(
    argument: dict[str, Any], next_step: str, simulated: SimulatedField
) -> None:
    point: dict[str, Any] = {"lat": simulated.lat, "lon": simulated.lon}
    call = gf.extract_field if "include" in argument else plan_field
    with pytest.raises(gf.GeofieldError, match=next_step):
        call(simulated.scene, **point, **argument)
    with pytest.raises(gf.GeofieldError, match="read_scene"):
        gf.extract_field("scene.tif", **point)  # type: ignore[arg-type]


@pytest.fixture
def file(plan: Plan, tmp_path: Path) -> Path:
    plan.write(tmp_path / "out", formats=["gpkg"])
    return tmp_path / "out" / "field.gpkg"


def edit(file: Path, layer: str, change: object) -> None:
    """Change a layer of a GeoPackage as an editor would: other layers stay."""
    table = gpd.read_file(file, layer=layer)
    table = change(table)  # type: ignore[operator]
    table.to_file(file, layer=layer, driver="GPKG", geometry_name="geom")


def test_the_plan_fits_the_truth(plan: Plan, simulated: SimulatedField) -> None:
    truth = simulated.field.polygon
    union = plan.field.polygon.union(truth).area
    assert plan.field.polygon.intersection(truth).area / union > 0.95
    assert plan.obstacles is not None
    found = shapely.points(plan.obstacles.geometry.centroid.get_coordinates().to_numpy())
    for crown in simulated.obstacles.geometry:
        assert min(shapely.distance(found, crown.centroid)) < 2.0
    assert plan.tracks is not None
    free = plan.field.polygon.difference(plan.obstacles.union_all().buffer(-0.05))
    assert all(free.buffer(1e-6).covers(segment) for segment in plan.tracks.segments.geometry)


def test_what_is_known_to_stand_there_is_driven_around(
    plan: Plan, simulated: SimulatedField, simulated_tif: Path, tmp_path: Path
) -> None:
    field, tree = plan.field, plan.obstacles.iloc[0]  # type: ignore[union-attr]
    middle = tree.geometry.centroid
    fence = shapely.LineString([(middle.x - 30, middle.y), (middle.x + 30, middle.y + 2)])
    table = gpd.GeoDataFrame(
        {"radius_m": [float(tree.radius_m), np.nan]}, geometry=[middle, fence], crs=field.crs
    )
    place: dict[str, Any] = {"lat": simulated.lat, "lon": simulated.lon, "settings": SETTINGS}
    there = plan_field(simulated.scene, **place, known=table.to_crs(4326))
    assert there.obstacles is not None
    assert there.tracks is not None
    # The tree that is seen, too, is there once; nothing was there before that could have changed.
    assert there.obstacles["status"].value_counts()["added"] == 2
    assert len(there.obstacles) == len(plan.obstacles) + 1  # type: ignore[arg-type]
    assert not there.changes
    assert not there.tracks.segments.intersects(fence).any()
    table.to_file(tmp_path / "known.gpkg")
    for again in ((), ("--overwrite",)):
        done = geofield(
            "run", simulated_tif, "--lat", simulated.lat, "--lon", simulated.lon, "--spacing", 6,
            "--obstacles", tmp_path / "known.gpkg", "--out", tmp_path / "out", *again,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        read = read_plan(tmp_path / "out" / "field.gpkg")
        assert read.obstacles is not None
        assert read.obstacles["status"].value_counts()["added"] == 2
    with pytest.raises(gf.GeofieldError, match="does not say its CRS"):
        plan_field(simulated.scene, **place, known=table.set_crs(None, allow_override=True))


def test_stage_by_stage_is_the_same(plan: Plan, simulated: SimulatedField) -> None:
    scene = simulated.scene
    staged = run_field(scene, lat=simulated.lat, lon=simulated.lon, settings=SETTINGS)
    staged = run_obstacles(staged, scene, settings=SETTINGS)
    staged = run_tracks(staged, settings=SETTINGS)
    assert staged == plan


def test_a_window_is_read_once(
    simulated: SimulatedField, simulated_tif: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from geofield import imagery

    read, sizes = imagery.read_scene, []

    def counted(*args: object, **options: object) -> object:
        sizes.append(options["size_m"])
        return read(*args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(imagery, "read_scene", counted)
    where: dict[str, Any] = {"lat": simulated.lat, "lon": simulated.lon}
    plan_field(simulated_tif, **where, settings=SETTINGS, size_m=180.0)
    assert sizes
    assert len(sizes) == len(set(sizes))


def test_a_window_grows_with_its_field(simulated: SimulatedField, simulated_tif: Path) -> None:
    where: dict[str, Any] = {"lat": simulated.lat, "lon": simulated.lon}
    whole = plan_field(simulated_tif, **where, settings=SETTINGS)
    grown = plan_field(simulated_tif, **where, settings=SETTINGS, size_m=60.0)
    assert grown.grid is not None
    assert grown.grid.width_px * grown.grid.ground_resolution_m > 100.0
    common = grown.field.polygon.intersection(whole.field.polygon).area
    assert common / grown.field.polygon.union(whole.field.polygon).area > 0.9


def test_a_plan_is_read_back_equal(plan: Plan, file: Path) -> None:
    again = read_plan(file)
    assert again == plan
    assert again.tracks is not None
    assert plan.tracks is not None
    assert again.tracks.points.equals(plan.tracks.points)
    assert again.settings == SETTINGS
    assert again != run_tracks(plan, settings=load_settings(None, {"tracks": {"spacing_m": 7.0}}))


def test_a_rejected_obstacle_no_longer_blocks(plan: Plan, file: Path) -> None:
    def reject(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        table.loc[table["obstacle_no"] == 1, "status"] = "rejected"
        return table

    edit(file, "obstacles", reject)
    again = run_tracks(read_plan(file), settings=SETTINGS)
    assert again.tracks is not None
    assert plan.tracks is not None
    assert (plan.tracks.gaps["obstacle_no"] == 1).any()
    assert not (again.tracks.gaps["obstacle_no"] == 1).any()
    assert len(again.tracks.lines) == len(plan.tracks.lines)


def test_a_drawn_obstacle_is_avoided_as_drawn(plan: Plan, file: Path) -> None:
    assert plan.obstacles is not None
    taken = plan.obstacles.union_all().buffer(12)
    spot = plan.field.polygon.buffer(-15).difference(taken).representative_point()
    drawn = spot.buffer(7, cap_style="square")

    def draw(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        row = gpd.GeoDataFrame(geometry=[drawn], crs=table.crs)
        return pd.concat([table, row], ignore_index=True)

    edit(file, "obstacles", draw)
    again = run_tracks(read_plan(file), settings=SETTINGS)
    assert again.obstacles is not None
    added = again.obstacles[again.obstacles["status"] == "added"]
    assert added["obstacle_no"].tolist() == [len(plan.obstacles) + 1]
    assert added.geometry.iloc[0].equals(drawn)
    assert again.tracks is not None
    assert (again.tracks.gaps["obstacle_no"] == len(plan.obstacles) + 1).any()
    hit = shapely.length(shapely.intersection(again.tracks.segments.geometry.to_numpy(), drawn))
    assert hit.max() < 1e-6


def test_a_persons_word_survives_detection(
    plan: Plan, file: Path, simulated: SimulatedField
) -> None:
    def review(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        table.loc[table["obstacle_no"] == 1, "status"] = "rejected"
        table.loc[table["obstacle_no"] == 2, "status"] = "confirmed"
        return table

    edit(file, "obstacles", review)
    again = run_obstacles(read_plan(file), simulated.scene, settings=SETTINGS)
    assert plan.obstacles is not None
    assert again.obstacles is not None
    assert len(again.obstacles) == len(plan.obstacles)
    status = again.obstacles.set_index("obstacle_no")["status"]
    assert status[1] == "rejected"
    assert status[2] == "confirmed"
    assert again.tracks is None


def test_a_moved_outline_is_kept(file: Path, simulated: SimulatedField) -> None:
    def move(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        table.geometry = table.geometry.buffer(-8)
        return table

    edit(file, "field", move)
    edited = read_plan(file)
    assert edited.outline_edited
    tracks = run_tracks(edited, settings=SETTINGS)
    assert tracks.field.method == "drawn"
    assert tracks.tracks is not None
    inside = edited.field.polygon.buffer(1e-6)
    assert all(inside.covers(segment) for segment in tracks.tracks.segments.geometry)
    # Running everything again keeps it too, and knows it as a person's from then on.
    where: dict[str, Any] = {"lat": simulated.lat, "lon": simulated.lon}
    again = plan_field(simulated.scene, **where, settings=SETTINGS, previous=edited)
    assert again.field.polygon.equals(edited.field.polygon)
    assert again.field.method == "drawn"
    third = plan_field(simulated.scene, **where, settings=SETTINGS, previous=again)
    assert third.field.polygon.equals(edited.field.polygon)


def test_another_fields_plan_is_not_mixed_in(
    plan: Plan, file: Path, simulated: SimulatedField
) -> None:
    from dataclasses import replace

    from shapely.affinity import translate

    elsewhere = replace(plan.field, polygon=translate(plan.field.polygon, 5000, 0))
    other = replace(plan, field=elsewhere, evidence=Evidence(), tracks=None)
    where: dict[str, Any] = {"lat": simulated.lat, "lon": simulated.lon}
    again = run_field(simulated.scene, **where, settings=SETTINGS, previous=other)
    assert again.obstacles is None
    assert other.obstacles is not None
    reviewed = other.obstacles.copy()
    reviewed.loc[0, "status"] = "confirmed"
    with pytest.raises(FieldError, match="another field"):
        run_field(
            simulated.scene,
            **where,
            settings=SETTINGS,
            previous=replace(other, obstacles=reviewed),
        )


def test_incomplete_rows_become_added_obstacles(plan: Plan) -> None:
    assert plan.obstacles is not None
    table = plan.obstacles.copy()
    table.loc[0, "obstacle_no"] = None
    table.loc[1, "status"] = None
    table.loc[2, "obstacle_no"] = table.loc[3, "obstacle_no"]
    done, _ = reconcile(table)
    assert len(done) == len(table)
    assert done["obstacle_no"].is_unique
    assert done["obstacle_no"].notna().all()
    assert done["status"].isin(["detected", "possible", "added"]).all()
    assert (done["status"] == "added").sum() == 3


@pytest.mark.parametrize("recorded", [None, float("nan")])  # NaN: as earlier versions wrote it
def test_an_obstacle_without_a_kind_is_no_edit(plan: Plan, recorded: float | None) -> None:
    assert plan.obstacles is not None
    table = plan.obstacles.copy()
    table["kind"] = table["kind"].astype(object)
    table.loc[0, "kind"] = None
    table["status"] = "detected"
    done, written = reconcile(table)
    said = json.loads(json.dumps(written.to_json(), allow_nan=False))
    assert said["rows"][0][1] is None
    said["rows"][0][1] = recorded
    again, written = reconcile(done, Written.from_json(said))
    assert set(again["status"]) == {"detected"}
    assert not any(row.kept for row in written.rows)


def test_products_of_a_run(plan: Plan, tmp_path: Path) -> None:
    out = tmp_path / "out"
    files = plan.write(out, timings_s={"field": 0.1})
    names = {path.relative_to(out).as_posix() for path in files}
    assert {
        "scene.tif",
        "field.gpkg",
        "field.qgz",
        "map.png",
        "report.json",
        "obstacles.rdf",
        "tracks.rdf",
        "field.rdf",
        "geojson/field.geojson",
        "geojson/track_points.geojson",
        "shapefile/boundary.shp",
        "shapefile/obstacles.shp",
        "shapefile/guidance.shp",
    } <= names
    assert all(path.stat().st_size > 0 for path in files)
    report = json.loads((out / "report.json").read_text())
    assert plan.tracks is not None
    assert report["tracks"]["points"] == len(plan.tracks.points)
    assert report["tracks"]["length_m"] == pytest.approx(
        plan.tracks.segments["length_m"].sum(), abs=0.01
    )
    area_ha = plan.tracks.statistics.area_ha
    assert report["field"]["area_ha"] == pytest.approx(area_ha, abs=5e-5)
    with pytest.raises(OutputExistsError):
        plan.write(out)
    before = {path: path.read_bytes() for path in files if path.suffix not in (".json",)}
    plan.write(out, overwrite=True)
    assert {path: path.read_bytes() for path in before} == before


def test_a_failure_leaves_the_previous_products(
    plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    files = plan.write(out, formats=["gpkg"])
    before = {path: path.read_bytes() for path in files}

    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("power cut")

    monkeypatch.setattr("geofield.mapping.draw_map", fail)
    with pytest.raises(RuntimeError, match="power cut"):
        plan.write(out, formats=["gpkg"], overwrite=True)
    assert {path: path.read_bytes() for path in before} == before
    assert sorted(path.name for path in out.iterdir()) == sorted(path.name for path in files)


def test_the_public_names_load() -> None:
    for name in gf.__all__:
        assert getattr(gf, name) is not None
    assert callable(gf.plan_field)
    with pytest.raises(AttributeError, match="no attribute"):
        _ = gf.nothing


def test_plans_differ_when_anything_differs(plan: Plan) -> None:
    from dataclasses import replace

    assert plan != "a plan"
    assert replace(plan, grid=None) != plan
    assert replace(plan, settings=Settings()) != plan
    assert plan.obstacles is not None
    moved = plan.obstacles.copy()
    moved.loc[0, "radius_m"] = np.nextafter(moved.loc[0, "radius_m"], 99)
    assert replace(plan, obstacles=moved) != plan


@pytest.mark.parametrize("tracks", [{"spacing_m": 30.0}, {"spacing_m": 3.0, "headland_m": 11.0}])
def test_a_field_smaller_than_one_track_is_refused(tracks: dict[str, float]) -> None:
    small = Plan(
        gf.Field(shapely.box(500_000, 3_900_000, 500_020, 3_900_020), crs=CRS("EPSG:32636"))
    )
    assert run_tracks(small, settings=load_settings(None, {"tracks": {"spacing_m": 3.0}})).tracks
    with pytest.raises(TrackError):
        run_tracks(small, settings=load_settings(None, {"tracks": tracks}))
