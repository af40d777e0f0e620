"""Routes drive every segment once, in order, and never through an obstacle."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import geopandas as gpd
import numpy as np
import pytest
import shapely
from shapely import affinity

from geofield import schema
from geofield.errors import TrackError, TrackWarning
from geofield.model.obstacles import ObstacleShapes
from geofield.model.tracks import Tracks
from geofield.tracks import plan_route, plan_tracks
from geofield.tracks.route.order import track_order
from geofield.tracks.route.passage import Passage
from geofield.tracks.route.turns import Turn, plan_turns

#: One unit is one metre on the ground here: a zone of scale 1 along its middle.
CRS: Any = "+proj=tmerc +lon_0=15 +k=1 +x_0=500000 +datum=WGS84 +units=m"
FIELD: Any = shapely.difference(
    shapely.box(500000, 5600000, 500300, 5600200),
    shapely.union(
        shapely.box(500120, 5600120, 500180, 5600200), shapely.box(500040, 5600040, 500060, 5600060)
    ),
)


_LINESTRINGS = shapely.linestrings


def obstacles(count: int = 12) -> list[shapely.Polygon]:
    rng = np.random.default_rng(4)
    places = rng.uniform((500030, 5600030), (500270, 5600170), (count, 2))
    return list(shapely.buffer(shapely.points(places), rng.uniform(1.5, 5.0, count), quad_segs=16))


@pytest.fixture(scope="module")
def tracks() -> Tracks:
    return plan_tracks(FIELD, obstacles(), crs=CRS, spacing_m=6.0, headland_m=18.0, direction=2.0)


@pytest.mark.parametrize("pattern", ["boustrophedon", "skip", "shortest"])
@pytest.mark.parametrize(
    ("radius_m", "curve"), [(None, "dubins"), (5.0, "dubins"), (5.0, "reeds_shepp")]
)
def test_route_is_whole_and_free(
    tracks: Tracks, pattern: Any, radius_m: float | None, curve: Any
) -> None:
    planned = plan_route(tracks, pattern=pattern, turning_radius_m=radius_m, curve=curve)
    route, turns = planned.route, planned.turns
    assert route is not None
    assert turns is not None
    assert list(route.columns[:-1]) == schema.ROUTE.column_names
    assert list(turns.columns[:-1]) == schema.TURNS.column_names
    assert route["sequence"].tolist() == list(range(1, len(route) + 1))

    work = route[route["kind"] == "work"]
    driven = list(zip(work["track_no"], work["segment_no"], strict=True))
    all_segments = list(
        zip(tracks.segments["track_no"], tracks.segments["segment_no"], strict=True)
    )
    assert sorted(driven) == all_segments

    # One unbroken line, on which every metre is counted.
    lines = route.geometry.to_numpy()
    ends = shapely.get_coordinates(shapely.get_point(lines, -1))
    starts = shapely.get_coordinates(shapely.get_point(lines, 0))
    assert np.abs(ends[:-1] - starts[1:]).max() < 1e-5
    assert route["start_m"].iloc[-1] + route["length_m"].iloc[-1] == pytest.approx(
        route["length_m"].sum()
    )
    assert shapely.length(lines) == pytest.approx(route["length_m"].to_numpy(), rel=2e-3, abs=1e-3)

    # Through nothing, ever; and inside the field where it is said to fit.
    solid = shapely.union_all([*obstacles(), shapely.Polygon(FIELD.interiors[0])])
    assert not shapely.intersects(lines, shapely.buffer(solid, -0.01)).any()
    fits = turns["fits"] == "yes"
    assert shapely.covers(shapely.buffer(FIELD, 0.01), turns.geometry.to_numpy()[fits]).all()
    assert (turns.loc[fits, "outside_m"] == 0.0).all()
    if radius_m is not None:
        assert fits.mean() > 0.7
        assert (turns.loc[~fits & (turns["kind"] != "drive"), "outside_m"] > 0.0).all()
        # A way with corners is not what a machine with a turning radius can drive.
        assert (turns.loc[turns["kind"] == "drive", "fits"] == "no").all()
    else:
        assert fits.all()
    if curve == "dubins":
        assert (turns["reverse_m"] == 0.0).all()


def test_curves_keep_the_turning_radius(tracks: Tracks) -> None:
    turns = plan_route(tracks, turning_radius_m=5.0).turns
    assert turns is not None
    checked = 0
    for row in turns[turns["kind"] == "dubins"].itertuples():
        places = shapely.get_coordinates(row.geometry)
        a, b, c = places[:-2], places[1:-1], places[2:]
        twice_area = np.abs(
            np.cross(np.c_[b - a, np.zeros(len(a))], np.c_[c - a, np.zeros(len(a))])[:, 2]
        )
        sides = np.hypot(*(b - a).T) * np.hypot(*(c - b).T) * np.hypot(*(c - a).T)
        # Where two arcs meet, three points see a mean of both, which is no sharper than either.
        long = np.minimum(np.hypot(*(b - a).T), np.hypot(*(c - b).T)) > 1e-3
        curvature = 2.0 * twice_area[long] / sides[long]
        assert curvature.max(initial=0.0) <= 1.01 / 5.0
        checked += int(long.sum())
    assert checked > 500


def test_shortest_is_shorter(tracks: Tracks) -> None:
    drive = {}
    for pattern in ("boustrophedon", "shortest"):
        planned = plan_route(tracks, pattern=pattern, turning_radius_m=5.0)
        assert planned.turns is not None
        drive[pattern] = planned.turns["length_m"].sum()
    assert drive["shortest"] < 0.9 * drive["boustrophedon"]


def test_shortest_is_never_longer_than_in_order() -> None:
    """It was in 17 of 100 fields, by up to 28 %: reversing was priced as driving forwards only."""
    for seed in range(12):
        rng = np.random.default_rng(seed)
        field = affinity.rotate(shapely.box(500000, 5600000, 500080, 5600050), 15 * seed)
        places = shapely.points(rng.uniform((500000, 5600000), (500080, 5600050), (6, 2)))
        trees = shapely.buffer(places, rng.uniform(1, 5, 6))
        planned = plan_tracks(field, trees, crs=CRS, spacing_m=8.0)
        price_m = []
        for pattern in ("boustrophedon", "shortest"):
            options: Any = {"pattern": pattern, "curve": "reeds_shepp", "margin_m": 40.0}
            turns = plan_route(planned, turning_radius_m=5.0, **options).turns
            assert turns is not None
            price_m.append(turns["length_m"].sum() + 12 * 5.0 * (turns["fits"] == "no").sum())
        assert price_m[1] <= price_m[0] + 1e-6, seed


@pytest.mark.parametrize("radius_m", [None, 4.0])
def test_tracks_are_not_finished_one_by_one_behind_a_wall(radius_m: float | None) -> None:
    """It took 667 m without curves: a way of 60 m around the wall had the price of 6."""
    field = shapely.box(500000, 5600000, 500200, 5600120)
    wall = shapely.box(500098, 5600015, 500102, 5600105)
    planned = plan_tracks(field, [wall], crs=CRS, spacing_m=8.0, direction=90)
    options: Any = {"turning_radius_m": radius_m, "margin_m": 20.0, "curve": "reeds_shepp"}
    turns = plan_route(planned, pattern="shortest", **options).turns
    assert turns is not None
    assert turns["length_m"].sum() < (370 if radius_m is None else 500)


def test_equal_input_gives_equal_routes(tracks: Tracks) -> None:
    one, two = (plan_route(tracks, pattern="shortest", turning_radius_m=5.0) for _ in range(2))
    assert one.route is not None
    assert two.route is not None
    assert one.route.to_wkb().equals(two.route.to_wkb())


def test_a_margin_lets_turns_leave_the_field() -> None:
    plain = shapely.box(500000, 5600000, 500100, 5600060)
    tracks = plan_tracks(plain, crs=CRS, spacing_m=6.0)
    without = plan_route(tracks, turning_radius_m=3.0).turns
    with_margin = plan_route(tracks, turning_radius_m=3.0, margin_m=3.1).turns
    assert without is not None
    assert with_margin is not None
    assert (without["fits"] == "no").all()
    assert (without["outside_m"] > 0.0).all()
    assert (with_margin["fits"] == "yes").all()
    assert with_margin["length_m"].to_numpy() == pytest.approx(3.0 * np.pi, abs=1e-3)
    # Going backwards first, there is room inside the field.
    reversing = plan_route(tracks, turning_radius_m=3.0, curve="reeds_shepp").turns
    assert reversing is not None
    assert (reversing["fits"] == "yes").all()
    assert (reversing["reverse_m"] > 0.0).all()


def test_skip_orders() -> None:
    assert track_order(np.arange(1, 8), 0) == [1, 2, 3, 4, 5, 6, 7]
    assert track_order(np.arange(1, 8), 1) == [1, 3, 5, 7, 6, 4, 2]
    assert track_order(np.arange(1, 8), 2) == [1, 4, 7, 5, 2, 3, 6]


def test_a_whole_number_of_tracks_may_be_written_with_a_point() -> None:
    """It ended in a traceback of Python."""
    tracks = plan_tracks(shapely.box(0, 0, 60, 60), crs=32633, spacing_m=6.0, direction=90)
    with pytest.warns(TrackWarning, match="cannot be left out at a turn"):
        far = plan_route(tracks, pattern="skip", skip=1e30)  # type: ignore[arg-type]
    one, other = (plan_route(tracks, pattern="skip", skip=each) for each in (2, 2.0))  # type: ignore[arg-type]
    assert one.route is not None
    assert other.route is not None
    assert one.route.equals(other.route)
    assert far.route is not None


@pytest.mark.parametrize("pattern", ["boustrophedon", "skip", "shortest"])
def test_start_chooses_the_corner(pattern: Any) -> None:
    plain = shapely.box(500000, 5600000, 500300, 5600200)
    tracks = plan_tracks(plain, crs="EPSG:32633", spacing_m=6.0)
    for corner in ((500000, 5600000), (500300, 5600000), (500300, 5600200), (500000, 5600200)):
        route = plan_route(tracks, start=corner, pattern=pattern).route
        assert route is not None
        first = shapely.get_coordinates(route.geometry.iloc[0])[0]
        assert np.hypot(*(first - corner)) < 6.0


def test_shortest_ways_are_shortest() -> None:
    """Around one circle the length is known: two tangents and an arc."""
    shapes = ObstacleShapes(
        np.array([[50.0, 50.0, 10.0]]), np.array([1]), np.empty(0, dtype=object), np.empty(0, int)
    )
    passage = Passage(shapely.box(0, 0, 100, 100), shapes)
    way = passage.shortest(np.array([10.0, 50.0]), np.array([90.0, 50.0]))
    assert way is not None
    tangent = np.sqrt(40.0**2 - 10.0**2)
    arc = 10.0 * (np.pi - 2.0 * np.arccos(10.0 / 40.0))
    length = np.hypot(*np.diff(way, axis=0).T).sum()
    assert 2.0 * tangent + arc <= length < (2.0 * tangent + arc) * 1.005
    # A wall from border to border leaves no way.
    wall = ObstacleShapes(
        np.empty((0, 3)), np.empty(0, int), np.array([shapely.box(48, -5, 52, 105)]), np.array([1])
    )
    closed = Passage(shapely.box(0, 0, 100, 100), wall)
    assert closed.shortest(np.array([10.0, 50.0]), np.array([90.0, 50.0])) is None


@pytest.mark.parametrize(
    "wrong",
    [
        {"pattern": "spiral"},
        {"pattern": "skip", "skip": -1},
        {"pattern": "skip", "skip": 1.5},
        {"turning_radius_m": 0.0},
        {"turning_radius_m": float("nan")},
        {"turning_radius_m": 500.0},
        {"curve": "clothoid"},
        {"margin_m": -1.0},
        {"start": (float("nan"), 0.0)},
    ],
)
def test_bad_settings_are_refused(tracks: Tracks, wrong: dict[str, object]) -> None:
    with pytest.raises(TrackError):
        plan_route(tracks, **wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("radius_m", [None, 5.0])
def test_a_wall_is_never_driven_through(radius_m: float | None) -> None:
    field = shapely.box(500000, 5600000, 500100, 5600060)
    wall = shapely.box(500048, 5599990, 500052, 5600070)
    tracks = plan_tracks(field, [wall], crs=CRS, spacing_m=6.0, headland_m=12.0)
    with pytest.warns(TrackWarning, match="cut the field"):
        planned = plan_route(tracks, pattern="shortest", turning_radius_m=radius_m)
    assert planned.route is not None
    assert planned.notes
    assert not shapely.intersects(
        planned.route.geometry.to_numpy(), shapely.buffer(wall, -0.01)
    ).any()
    # One number is missing: there the machine must be carried over.
    numbers = planned.route["sequence"].to_numpy()
    assert (np.diff(numbers) > 1).sum() >= 1
    assert (planned.route["kind"] == "work").sum() == len(tracks.segments)


def test_fields_with_nothing_to_drive() -> None:
    field = shapely.box(500000, 5600000, 500100, 5600060)
    with pytest.warns(TrackWarning, match="Nothing is left to drive"):
        empty = plan_tracks(field, [shapely.buffer(field, 5.0)], crs=CRS, spacing_m=5.0)
    planned = plan_route(empty, turning_radius_m=5.0)
    assert planned.route is not None
    assert len(planned.route) == 0


@contextmanager
def counting() -> Iterator[list[int]]:
    """How many lines are made each time that some are."""
    made: list[int] = []

    def counted(places: Any, **how: Any) -> Any:
        lines = _LINESTRINGS(places, **how)
        made.append(np.size(lines))
        return lines

    with patch.object(shapely, "linestrings", counted):
        yield made


def looked_along(stands: Any) -> int:
    """How many lines are made to find ways around what stands in a field."""
    field = shapely.box(500000, 5600000, 500200, 5600100)
    planned = plan_tracks(field, stands, crs=CRS, spacing_m=6.0, direction=90)
    with counting() as made:
        plan_route(planned)
    return sum(made)


def test_round_outlines_cost_no_more_than_circles() -> None:
    rng = np.random.default_rng(3)
    xy = rng.uniform((500020, 5600010), (500180, 5600090), (40, 2))
    circles = gpd.GeoDataFrame({"radius_m": [5.0] * len(xy)}, geometry=shapely.points(xy), crs=CRS)
    # 6 times as many lines; 186 times where ways are looked for between all corners.
    assert looked_along(circles.buffer(5.0, quad_segs=32)) < 8 * looked_along(circles)


def test_a_row_of_trees_is_one_thing_to_go_around() -> None:
    row = [shapely.Point(500100.0, 5600003.0 + 3.5 * number) for number in range(27)]
    trees = gpd.GeoDataFrame({"radius_m": [2.0] * len(row)}, geometry=row, crs=CRS)
    # 73 000 where each tree is a shape of its own, and 14 times as long.
    assert looked_along(trees) < 40_000


def test_trees_in_a_row_that_do_not_touch_are_passed_by_the_first_and_the_last() -> None:
    trees = np.column_stack((13.0 + 3.0 * np.arange(60), np.full(60, 50.0), np.full(60, 1.2)))
    shapes = ObstacleShapes(trees, np.arange(60), np.empty(0, dtype=object), np.empty(0, int))
    passage = Passage(shapely.box(0, 0, 203, 100), shapes)
    with counting() as made:
        way = passage.shortest(np.array([5.0, 50.0]), np.array([198.0, 50.0]))
    assert way is not None
    length = np.hypot(*np.diff(way, axis=0).T).sum()
    taut = 59 * 3.0 + 2.0 * (np.sqrt(8.0**2 - 1.2**2) + 1.2 * np.arcsin(1.2 / 8.0))
    assert taut <= length < taut * 1.001
    # 10 000 where all trees on the straight line come in at once.
    assert sum(made) < 300


def test_a_way_out_of_a_ring_of_trees_is_none_and_one_within_is_found() -> None:
    angle = np.arange(24) * np.pi / 12
    ring = np.column_stack((50 + 30 * np.cos(angle), 50 + 30 * np.sin(angle), np.full(24, 5.0)))
    circles = np.vstack((ring, [50.0, 50.0, 10.0]))
    shapes = ObstacleShapes(circles, np.arange(25), np.empty(0, dtype=object), np.empty(0, int))
    passage = Passage(shapely.box(0, 0, 100, 100), shapes)
    inside, other, outside = np.array([[35.0, 50.0], [65.0, 50.0], [5.0, 50.0]])
    assert passage.shortest(inside, outside) is None
    way = passage.shortest(inside, other)
    assert way is not None
    length = np.hypot(*np.diff(way, axis=0).T).sum()
    taut = 2.0 * np.sqrt(15.0**2 - 10.0**2) + 10.0 * (np.pi - 2.0 * np.arccos(10.0 / 15.0))
    assert taut <= length < taut * 1.01


@pytest.mark.parametrize("strip_m", [0.1, 0.3, 0.6])
def test_a_narrow_strip_beside_a_circle_is_passed(strip_m: float) -> None:
    """The corners of sixteen sides around the circle lay beyond the border: there was no way."""
    circle = np.array([[50.0, 30.0, 30.0 - strip_m]])
    shapes = ObstacleShapes(circle, np.arange(1), np.empty(0, dtype=object), np.empty(0, int))
    passage = Passage(shapely.box(0, 0, 100, 60), shapes)
    way = passage.shortest(np.array([5.0, 30.0]), np.array([95.0, 30.0]))
    assert way is not None
    assert passage.fits(np.array([shapely.LineString(way)])).all()
    radius = 30.0 - strip_m
    free = np.sqrt(45.0**2 - radius**2)
    taut = 2.0 * free + radius * (np.pi - 2.0 * np.arccos(radius / 45.0))
    assert taut <= shapely.LineString(way).length < 1.01 * taut


def test_vertices_along_a_straight_border_are_no_corners_to_turn_at() -> None:
    ring = shapely.get_coordinates(shapely.segmentize(shapely.box(0, 0, 600, 400), 1.0))[:-1]
    ring += np.random.default_rng(1).normal(0.0, 1e-4, ring.shape)
    no = np.empty(0, np.int64)
    none = ObstacleShapes(np.empty((0, 3)), no, np.empty(0, object), no)
    passage = Passage(shapely.Polygon(ring), none)
    # 1007, and so 500 000 lines to look along, where each vertex is one.
    assert len(passage._corners[-1].places) == 0


def past_a_tree(
    radius_m: float, before_m: float, spare_m: float | tuple[float, float]
) -> tuple[Turn, shapely.LineString, float]:
    """The turn of a machine of 4 m past a tree on its track, its way, the shortest way's length."""
    circle, no = np.array([[20.0, 0.0, radius_m]]), np.empty(0, object)
    shapes = ObstacleShapes(circle, np.arange(1), no, np.empty(0, int))
    passage = Passage(shapely.box(-50, -50, 100, 50), shapes)
    ends = np.array([[20.0 - radius_m - before_m, 0.0], [20.0 + radius_m + before_m, 0.0]])
    exits, entries = (np.append(end, 0.0)[None] for end in ends)
    spare = np.full((1, 2), spare_m)
    (turn,) = plan_turns(exits, entries, passage, radius_m=4.0, curve="dubins", spare_m=spare)
    line = shapely.LineString(turn.places)
    assert line.distance(shapely.Point(20, 0)) > radius_m - 1e-6
    step, along = np.diff(turn.places, axis=0), ends[:, 0] + [-turn.early_m, turn.late_m]
    np.testing.assert_allclose(turn.places[[0, -1]], np.column_stack((along, [0, 0])), atol=1e-9)
    if turn.fits:
        heading = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
        length = np.hypot(*step.T)
        bend = np.abs(np.diff(heading)) / (0.5 * (length[1:] + length[:-1]))
        assert bend.max() < 1.001 / 4.0
        # It leaves and joins the track in the track's own direction.
        assert np.abs(heading[[0, -1]]).max() < 0.05
    shortest = passage.shortest(*ends)
    assert shortest is not None
    return turn, line, float(np.hypot(*np.diff(shortest, axis=0).T).sum())


@pytest.mark.parametrize("radius_m", [6.0, 10.0])
def test_curves_follow_the_shortest_way_around_what_no_single_curve_clears(radius_m: float) -> None:
    turn, line, shortest_m = past_a_tree(radius_m, before_m=12.0, spare_m=0.0)
    assert (turn.kind, turn.fits, turn.early_m, turn.late_m) == ("dubins", True, 0.0, 0.0)
    assert turn.length_m == pytest.approx(line.length, rel=1e-3)
    assert shortest_m < turn.length_m < 1.04 * shortest_m


@pytest.mark.parametrize(
    "walls", [[(18, -3, 22, 12)], [(18, -3, 20, 14), (30, -14, 32, 3)], [(15, -5, 28, 9)]]
)
def test_curves_follow_the_shortest_way_around_corners_whatever_its_heading(walls: Any) -> None:
    for turned_deg in (0, 40, 100, 200, 320):
        for mirror in (1, -1):

            def placed(shape: Any, turned: float = turned_deg, mirror: int = mirror) -> Any:
                mirrored = affinity.scale(shape, 1, mirror, origin=(0, 0))
                return affinity.rotate(mirrored, turned, origin=(0, 0))

            solid = np.array([placed(shapely.box(*wall)) for wall in walls], dtype=object)
            none = np.empty((0, 3)), np.empty(0, int)
            shapes = ObstacleShapes(*none, solid, np.arange(len(walls)))
            passage = Passage(placed(shapely.box(-60, -60, 120, 60)), shapes)
            ends = [np.array(placed(shapely.Point(x, 0)).coords[0]) for x in (0, 50)]
            out, into = (np.append(end, np.radians(turned_deg))[None] for end in ends)
            spare = np.zeros((1, 2))
            (turn,) = plan_turns(out, into, passage, radius_m=3.0, curve="dubins", spare_m=spare)
            shortest = passage.shortest(*ends)
            assert shortest is not None
            assert turn.fits
            assert turn.length_m < 1.03 * shapely.LineString(shortest).length


@pytest.mark.parametrize("radius_m", [6.0, 10.0])
def test_a_track_is_left_early_and_joined_late_where_a_tree_is_too_near(radius_m: float) -> None:
    turn, _, shortest_m = past_a_tree(radius_m, before_m=0.5, spare_m=0.0)
    assert (turn.kind, turn.fits) == ("drive", False)
    assert turn.length_m == pytest.approx(shortest_m)
    turn, line, _ = past_a_tree(radius_m, before_m=0.5, spare_m=40.0)
    assert (turn.kind, turn.fits) == ("dubins", True)
    assert turn.early_m == pytest.approx(turn.late_m)
    assert 4.0 < turn.early_m < 8.0
    assert turn.length_m == pytest.approx(line.length, rel=1e-3)
    assert turn.length_m < 1.4 * (2.0 * radius_m + 1.0 + turn.early_m + turn.late_m)
    # No more of the segments is left out than there is.
    for spare_m in (1.0, 3.0, 3.6, 4.7):
        turn, _, _ = past_a_tree(radius_m, before_m=0.5, spare_m=spare_m)
        assert max(turn.early_m, turn.late_m) <= spare_m
        assert turn.fits == (turn.early_m > 0)
    for early_m, late_m in ((40.0, 1.0), (1.0, 40.0)):
        turn, _, _ = past_a_tree(radius_m, before_m=0.5, spare_m=(early_m, late_m))
        assert turn.early_m <= early_m
        assert turn.late_m <= late_m


@pytest.mark.parametrize(("bend_m", "fits"), [(1.0, "no"), (12.0, "yes"), (20.0, "yes")])
def test_a_turn_past_a_tree_meets_segments_that_a_person_bent(bend_m: float, fits: str) -> None:
    """It "fitted", and ended 4 m beside the work, at 36 degrees to it."""
    tree = shapely.Point(500015.5, 5300080).buffer(4)
    field = shapely.box(500000, 5300000, 500040, 5300160)
    plan = plan_tracks(field, [tree], crs=CRS, spacing_m=10.0, direction=0.0)
    bent = []
    for line in plan.segments.geometry:
        ends = shapely.get_coordinates(line)
        near = line.project(shapely.Point(500015, 5300080))
        at = abs(near - bend_m) if near > 0 else bend_m
        middle = line.interpolate(at) if line.length < 100 else line.centroid
        bent.append(shapely.LineString([ends[0], (middle.x + 2.5, middle.y), ends[1]]))
    segments = plan.segments.set_geometry(bent, crs=plan.segments.crs)
    route = plan_route(replace(plan, segments=segments), turning_radius_m=6.0, margin_m=30.0)
    assert route.route is not None
    assert route.turns is not None
    (past,) = np.flatnonzero(route.turns["from_track"] == route.turns["to_track"])
    shapes = route.route.geometry.iloc[2 * past : 2 * past + 3]
    (before, way, after) = (shapely.get_coordinates(each) for each in shapes)
    np.testing.assert_allclose(way[[0, -1]], [before[-1], after[0]], atol=1e-6)
    assert route.turns["fits"].iloc[past] == fits
    if fits == "yes":
        for joint in ((before[-2:], way[:2]), (way[-2:], after[:2])):
            one, other = (np.arctan2(*np.diff(each, axis=0)[0]) for each in joint)
            assert abs(one - other) < 0.06
