"""What a driver loses, counted on ground where the answer is known."""

import json
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
from shapely import LineString, Point, box

import geofield as gf
from geofield.errors import ObstacleError
from geofield.evaluation import driving
from geofield_command import run_geofield

UTM = "EPSG:32636"
EAST, NORTH = 500_000.0, 3_900_000.0


def lines(*ys):
    rows = [LineString([(EAST, NORTH + y), (EAST + 100, NORTH + y)]) for y in ys]
    return gpd.GeoDataFrame(geometry=rows, crs=UTM)


def points(*places):
    rows = [Point(EAST + x, NORTH + y) for x, y in places]
    return gpd.GeoDataFrame(geometry=rows, crs=UTM)


def around(status, confidence, *places):
    table = points(*places)
    table["geometry"] = table.buffer(5, quad_segs=64)
    return table.assign(status=status, confidence=confidence)


FIELD = box(EAST, NORTH, EAST + 100, NORTH + 100)


def test_what_is_near_a_track_is_driven_through():
    truth = points((20, 11), (50, 50), (80, 13), (150, 10))
    none = around("detected", 0.9)
    lost = driving(lines(10, 50.5, 90), none, truth, FIELD)
    assert (lost.things, lost.driven_through) == (3, 2)
    # Chords of circles of 2 m, 1 and 0.5 m from their centres.
    chords = 2 * np.sqrt(4 - 1) + 2 * np.sqrt(4 - 0.25)
    assert lost.driven_through_m == pytest.approx(chords, rel=0.001)
    assert lost.driven_m == pytest.approx(300, rel=1e-3)
    assert lost.share_lost == 0


@pytest.mark.parametrize("angle", np.radians([0.0, 5.625, 22.5, 40.0]))
@pytest.mark.parametrize(("away", "met"), [(1.996, 1), (2.004, 0)])
def test_a_disc_has_no_corners(angle, away, met):
    """Two metres are two metres in every direction."""
    normal, along = (
        np.array([np.cos(angle), np.sin(angle)]),
        np.array([-np.sin(angle), np.cos(angle)]),
    )
    place = np.array([EAST + 50, NORTH + 50]) + normal * away / 1.0004
    track = LineString([place - 30 * along, place + 30 * along])
    segments = gpd.GeoDataFrame(geometry=[track], crs=UTM)
    truth = points((50, 50))
    assert driving(segments, around("detected", 0.9), truth, FIELD).driven_through == met


def test_ground_is_lost_only_where_nothing_stands():
    table = gpd.pd.concat(
        [
            around("detected", 0.9, (20, 20), (70, 70)),
            around("possible", 0.2, (50, 20), (20, 80)),
            around("rejected", 0.9, (50, 80)),
        ]
    )
    lost = driving(lines(50), table, points((21, 20)), FIELD)
    assert lost.lost_m2 == pytest.approx(np.pi * 25, rel=0.01)
    assert lost.expected_unseen == pytest.approx(0.4)
    assert lost.expected_unseen_per_ha == pytest.approx(0.4, rel=0.01)
    both = lost + lost
    assert (both.things, both.lost_m2) == (2, 2 * lost.lost_m2)
    assert both.share_lost == pytest.approx(lost.share_lost)


def test_ground_under_a_crown_from_outside_is_not_lost_for_nothing():
    table = around("detected", 0.9, (-3, 20), (-3, 60))
    lost = driving(lines(50), table, points((-3, 20)), FIELD)
    assert lost.things == 0
    segment = 25 * np.arccos(3 / 5) - 3 * 4
    assert lost.lost_m2 == pytest.approx(segment, rel=0.01)


def test_a_field_without_anything_costs_nothing():
    lost = driving(lines(50), around("detected", 0.9), points(), FIELD)
    assert np.isnan(lost.share_driven_through)
    assert lost.as_dict()["share_driven_through"] is None
    assert lost.share_lost == 0


def test_tracks_need_their_field():
    with pytest.raises(ObstacleError, match="area"):
        gf.evaluate(around("detected", 0.9, (1, 1)), points((1, 1)), segments=lines(5))


@pytest.mark.parametrize("missing", ["area", "segments"])
def test_a_picture_that_a_mapping_lacks_is_named(missing):
    found, truth = around("detected", 0.9, (80, 50)), points((20, 11), (50, 50))
    given: Any = {"area": {"north": FIELD, "east": FIELD}, "segments": {"north": lines(10)}}
    given["segments"]["east"] = lines(10)
    both = {"north": found, "east": found}, {"north": truth, "east": truth}
    assert gf.evaluate(*both, **given, bootstrap=0).driving.things == 4
    del given[missing]["east"]
    with pytest.raises(ObstacleError, match=f"There is no {missing} of picture 'east'"):
        gf.evaluate(*both, **given, bootstrap=0)
    with pytest.raises(ObstacleError, match="one for all"):
        gf.evaluate(found, truth, **given, bootstrap=0)


def test_segments_of_another_zone_are_brought_to_the_area():
    found, truth = around("detected", 0.9, (80, 50)), points((20, 11), (50, 50))
    here = gf.evaluate(found, truth, area=FIELD, segments=lines(10)).driving
    beside = gf.evaluate(found, truth, area=FIELD, segments=lines(10).to_crs(32635)).driving
    assert (beside.things, beside.driven_through) == (here.things, here.driven_through) == (2, 1)
    assert beside.driven_through_m == pytest.approx(here.driven_through_m, rel=1e-4)


def geofield(*arguments, folder):
    return run_geofield(*arguments, folder=folder)


def test_the_command_tells_what_a_driver_loses(simulated, simulated_tif, tmp_path):
    where = ["--lat", simulated.lat, "--lon", simulated.lon]
    run = geofield(
        "run", simulated_tif, *where, "--spacing", 3, "--out", tmp_path, "--format", "gpkg",
        folder=tmp_path,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    plan = next(tmp_path.glob("*.gpkg"))
    truth = simulated.obstacles.assign(geometry=simulated.obstacles.centroid)
    truth.to_file(tmp_path / "truth.geojson")
    told = geofield("evaluate", plan, "truth.geojson", "--driving", "--json", folder=tmp_path)
    assert told.returncode == 0, told.stderr
    lost = json.loads(told.stdout)["driving"]
    assert lost["things"] >= 0.8 * len(truth)
    assert lost["driven_through"] <= 0.15 * lost["things"]
    assert 0 <= lost["share_lost"] < 0.04
    report = json.loads((tmp_path / "report.json").read_text())
    unseen = report["obstacles"]["expected_unseen_per_ha"]
    assert unseen == pytest.approx(lost["expected_unseen_per_ha"], abs=2e-3)
    # Without obstacles the same tracks run through the trees.
    gone = gf.read_plan(plan)
    empty = gf.plan_tracks(
        gone.field.polygon, gone.obstacles.iloc[:0], crs=gone.field.crs, spacing_m=3
    )
    bad = driving(empty.segments, gone.obstacles, truth.to_crs(UTM), gone.field.polygon)
    assert bad.driven_through == bad.things > 0
