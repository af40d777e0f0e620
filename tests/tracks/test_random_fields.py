"""What is true of any plan of tracks: random fields, asked by other geometry than the planner's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import pytest
import shapely
from shapely import Polygon, affinity

from geofield.model.tracks import Tracks
from geofield.tracks import plan_route, plan_tracks
from geofield.tracks.headland import inset

pytestmark = pytest.mark.filterwarnings("ignore::geofield.errors.GeofieldWarning")
#: Units of the CRS that a plan may be off by the rounding of coordinates in the millions.
CLOSE = 1e-5


@dataclass(frozen=True, slots=True)
class Case:
    """A plan, and what it was asked for."""

    field: Polygon
    avoided: list[Any]
    settings: dict[str, Any]
    tracks: Tracks

    @property
    def barred(self) -> Any:
        """All that no machine may enter, in one shape."""
        return shapely.union_all(self.avoided)

    def sharp(self, name: str) -> Any:
        """The geometries of one of the layers."""
        return getattr(self.tracks, name).geometry.to_numpy()


def any_field(rng: np.random.Generator) -> Any:
    """A box, a star, boxes that overlap or a strip with bends; up to two holes, turned."""
    field: Any
    match rng.integers(4):
        case 0:
            field = shapely.box(0, 0, *rng.uniform(40, 220, 2))
        case 1:
            angles = np.sort(rng.uniform(0, 2 * np.pi, 25))
            reach = rng.uniform(40, 130, 25)
            corners = np.column_stack((reach * np.cos(angles), reach * np.sin(angles)))
            field = shapely.make_valid(Polygon(corners))
        case 2:
            boxes = [shapely.box(0, 0, *rng.uniform(50, 160, 2)) for _ in range(3)]
            field = shapely.union_all([affinity.rotate(b, rng.uniform(0, 180)) for b in boxes])
        case _:
            field = shapely.buffer(shapely.linestrings(rng.uniform(0, 200, (4, 2))), 22)
    field = max(shapely.get_parts(field), key=shapely.area)
    for x, y in places(rng, field, 3):
        hole: Any = shapely.Point(x, y).buffer(rng.uniform(2, 8))
        if rng.integers(2):  # as near to the border as the first pass around the field
            near = shapely.line_interpolate_point(field.exterior, rng.uniform(), normalized=True)
            hole = near.buffer(7).difference(near.buffer(2))
            hole = max(shapely.get_parts(hole.intersection(field.buffer(-1))), key=shapely.area)
        if shapely.within(hole, field):
            field = shapely.difference(field, hole)
    turned: Any = affinity.rotate(field, rng.uniform(0, 360))
    return affinity.translate(turned, *rng.uniform((3e5, 1e6), (7e5, 6e6)))


def places(rng: np.random.Generator, field: Any, count: int) -> Any:
    """Some random places in a field's bounds: x, y."""
    return rng.uniform(field.bounds[:2], field.bounds[2:], (count, 2))


def any_case(seed: int) -> Case:
    """A field, up to twelve obstacles and settings, all drawn at random."""
    rng = np.random.default_rng(seed)
    field = any_field(rng)
    at = places(rng, field, int(rng.integers(12)))
    round_ones = shapely.buffer(shapely.points(at), rng.uniform(1, 7, len(at)))
    # Two of them stand on the corner of a box.
    boxes = [shapely.box(x, y, x + rng.uniform(2, 30), y + 6) for x, y in at[:2]]
    spacing_m = float(rng.uniform(2.5, 12))
    settings: dict[str, Any] = {
        "spacing_m": spacing_m,
        "width_m": spacing_m * float(rng.choice([1.0, 0.8, 1.3])),
        "direction": rng.choice(np.array(["dominant", "fewest", float(rng.uniform(0, 180))], "O")),
        "last_strip": str(rng.choice(["overrun", "leave", "shift", "spread"])),
        "headland_m": float(rng.choice([0.0, 8.0, 14.0])),
        "headland_holes": bool(rng.integers(2)),
        "min_segment_m": float(rng.choice([0.0, 4.0])),
        "clearance_m": float(rng.choice([0.0, 1.3])),
        "step_m": float(rng.choice([1.0, 4.0])),
    }
    obstacles = [*round_ones, *boxes]
    tracks = plan_tracks(field, obstacles, crs="EPSG:32636", **settings)
    clear = settings["clearance_m"] * tracks.ground_scale
    # 64 corners a quarter: a clearance's round corners are outside of those by a millimetre.
    grown = [shapely.buffer(each, clear, quad_segs=64) if clear else each for each in obstacles]
    return Case(field, grown, settings, tracks)


@pytest.fixture(scope="module")
def cases() -> list[Case]:
    """Plans of fields, each with a track at least."""
    made = [any_case(seed) for seed in range(36)]
    some = [case for case in made if len(case.tracks.segments)]
    assert len(some) > 30
    return some


def test_segments_lie_in_the_field_and_in_no_obstacle(cases: list[Case]) -> None:
    for case in cases:
        lines = case.sharp("segments")
        outside = shapely.difference(lines, shapely.buffer(case.field, CLOSE))
        assert shapely.length(outside).max() < CLOSE
        inside = shapely.intersection(lines, shapely.buffer(case.barred, -2e-3))
        assert shapely.length(inside).max() < CLOSE


def test_tracks_are_straight_parallel_and_apart_as_asked(cases: list[Case]) -> None:
    for case in cases:
        tracks, lines = case.tracks, case.sharp("segments")
        ends = shapely.get_coordinates(lines).reshape(-1, 2, 2)
        ways = ends[:, 1] - ends[:, 0]
        along = ways[np.argmax(np.hypot(*ways.T))]
        along = along / np.hypot(*along)
        across = np.array([-along[1], along[0]])
        assert np.abs(ends[:, 0] @ across - ends[:, 1] @ across).max() < CLOSE
        place, number = ends[:, 0] @ across / tracks.ground_scale, tracks.segments["track_no"]
        first = np.unique(number, return_index=True)
        apart = np.abs(np.diff(place[first[1]])) / np.diff(first[0])
        if case.settings["last_strip"] in ("overrun", "leave"):
            assert apart == pytest.approx(case.settings["spacing_m"], abs=1e-4)
        elif len(apart):
            assert apart.max() < case.settings["spacing_m"] + 1e-4


def test_nothing_that_can_be_driven_is_left_out(cases: list[Case]) -> None:
    for case in cases:
        tracks, least_m = case.tracks, case.settings["min_segment_m"]
        lines, number = case.sharp("segments"), tracks.segments["track_no"].to_numpy()
        assert tracks.segments["length_m"].min() >= least_m
        if case.settings["headland_m"]:
            continue
        free = shapely.difference(case.field, case.barred)
        for track in np.unique(number):
            mine = lines[number == track]
            ends = shapely.get_coordinates(mine)
            way = (ends[1] - ends[0]) / np.hypot(*(ends[1] - ends[0]))
            whole = shapely.LineString([ends[0] - 900 * way, ends[0] + 900 * way])
            parts = shapely.get_parts(shapely.intersection(whole, free))
            long = shapely.length(parts) / tracks.ground_scale > max(least_m, 0.05)
            left = shapely.length(parts[long]).sum() - shapely.length(mine).sum()
            assert abs(left) < 0.02 * (1 + long.sum())


def test_a_headland_does_not_depend_on_the_vertex_that_an_outline_begins_with() -> None:
    for seed in (3, 33, *range(4, 10)):
        ring = shapely.get_coordinates(any_field(np.random.default_rng(seed)).exterior)[:-1]
        begun = [np.roll(ring, -at, axis=0) for at in (0, len(ring) // 3, len(ring) // 2)]
        left = [inset(Polygon(each), 14.0) for each in (*begun, ring[::-1])]
        # By 4.5 square metres of the first one, and tracks by metres.
        assert np.ptp(shapely.area(left)) < 0.01


def test_gaps_lie_between_segments_and_name_what_is_in_them(cases: list[Case]) -> None:
    gap_count = 0
    for case in cases:
        tracks, scale = case.tracks, case.tracks.ground_scale
        segments, gaps = tracks.segments, tracks.gaps
        many = segments.groupby("track_no").size()
        assert many.to_list() == tracks.lines["segment_count"].to_list()
        assert (many - 1).to_list() == tracks.lines["gap_count"].to_list()
        of_gaps = gaps.groupby("track_no").size().reindex(many.index, fill_value=0)
        assert of_gaps.to_list() == (many - 1).to_list()
        for layer, number in ((segments, "segment_no"), (gaps, "gap_no")):
            counted = layer.groupby("track_no").cumcount() + 1
            assert layer[number].to_list() == counted.to_list()
            lengths_m = layer.geometry.length / scale
            assert layer["length_m"].to_list() == pytest.approx(lengths_m.to_list(), abs=2e-3)
        key = segments.set_index(["track_no", "segment_no"]).geometry
        for gap in gaps.itertuples():
            before = key[gap.track_no, gap.gap_no].coords[-1]
            behind = key[gap.track_no, gap.gap_no + 1].coords[0]
            assert np.allclose(gap.geometry.coords, [before, behind], atol=CLOSE)
            met = [
                at + 1
                for at, each in enumerate(case.avoided)
                if gap.geometry.intersection(each).length > 0.05
            ]
            told = [int(word) for word in gap.cause.replace(",", " ").split() if word.isdecimal()]
            assert set(met) <= set(told)
            assert all(gap.geometry.distance(case.avoided[no - 1]) < 0.01 for no in told)
            assert ([] if pd.isna(gap.obstacle_no) else [gap.obstacle_no]) == sorted(told)[:1]
            if not case.settings["headland_m"]:
                away = gap.geometry.difference(case.field).length
                assert (away > 0.0) <= ("border" in gap.cause) or away < 0.05
            gap_count += 1
    assert gap_count > 100


def test_obstacles_share_what_they_cost_together(cases: list[Case]) -> None:
    shared = 0
    for case in cases:
        tracks = case.tracks
        if tracks.blocked_count or not case.avoided:
            continue  # where those would run is in no table
        area: Any = case.field
        if tracks.headland is not None:
            area = shapely.difference(area, shapely.union_all(case.sharp("headland")))
        lost_m = np.zeros(len(case.avoided))
        for line in case.sharp("lines"):
            start, end = shapely.get_coordinates(line)[[0, -1]]
            way = (end - start) / np.hypot(*(end - start))
            whole = shapely.LineString([start - 900 * way, start + 900 * way])
            met = [shapely.intersection(whole, each) for each in (*case.avoided, area)]
            cuts = np.unique((shapely.get_coordinates(met) - start) @ way)
            middles = shapely.points(start + ((cuts[1:] + cuts[:-1]) / 2)[:, None] * way)
            inside = np.array([shapely.intersects(each, middles) for each in case.avoided])
            inside &= shapely.intersects(area, middles)
            deep = inside.sum(axis=0)
            shared += int((deep > 1).sum())
            lost_m += (inside * np.diff(cuts) / np.maximum(deep, 1)).sum(axis=1)
        told = [loss.length_m for loss in tracks.losses]
        assert told == pytest.approx((lost_m / tracks.ground_scale).tolist(), abs=0.05, rel=1e-3)
    assert shared > 20


def test_headlands_run_around_the_field_and_past_what_stands_there(cases: list[Case]) -> None:
    cut_by_holes = 0
    for case in cases:
        tracks, scale, how = case.tracks, case.tracks.ground_scale, case.settings
        if tracks.headland is None or tracks.headland_tracks is None:
            assert not how["headland_m"]
            continue
        (strip,) = tracks.headland.geometry
        assert tracks.headland["area_ha"].iloc[0] == pytest.approx(strip.area / scale**2 / 1e4)
        assert shapely.difference(strip, shapely.buffer(case.field, 2e-3)).area < 0.01
        straight = shapely.union_all(case.sharp("segments"))
        assert shapely.intersection(straight, shapely.buffer(strip, -0.01)).length < 0.05
        table, rings = tracks.headland_tracks, case.sharp("headland_tracks")
        lengths_m = shapely.length(rings) / scale
        assert table["length_m"].to_list() == pytest.approx(lengths_m.tolist(), abs=0.02)
        counted = table.groupby("pass_no").cumcount() + 1
        assert table["segment_no"].to_list() == counted.to_list()
        outside = shapely.difference(rings, shapely.buffer(case.field, 2e-3))
        assert shapely.length(outside).max(initial=0.0) < 0.01
        inside = shapely.intersection(rings, shapely.buffer(case.barred, -5e-3))
        assert shapely.length(inside).max(initial=0.0) < 0.01
        near = shapely.distance(rings, case.field.exterior) / scale
        assert (near > table["offset_m"].to_numpy() - 0.01).all()
        first = shapely.buffer(Polygon(case.field.exterior), -how["width_m"] / 2 * scale).boundary
        holes = shapely.MultiPolygon([Polygon(ring) for ring in case.field.interiors])
        cut_by_holes += first.intersects(holes) and not how["headland_holes"]
    assert cut_by_holes > 8


@dataclass(frozen=True, slots=True)
class Drive:
    """A case with the tables of a route, the machine's turning radius and the border's margin."""

    case: Case
    route: Any
    turns: Any
    radius_m: float | None
    margin_m: float

    @property
    def work(self) -> Any:
        """The rows of the route that drive a segment."""
        return self.route[self.route["kind"] == "work"]


@pytest.fixture(scope="module", params=[None, 2.0, 5.0])
def drives(request: pytest.FixtureRequest, cases: list[Case]) -> list[Drive]:
    """Routes of all patterns and curves; with reversing and without, with a margin and none."""
    made = []
    for at, case in enumerate(case for case in cases if len(case.tracks.segments) <= 90):
        margin_m = 4.0 * (at % 2)
        planned = plan_route(
            case.tracks,
            pattern=("boustrophedon", "skip", "shortest")[at % 3],
            turning_radius_m=request.param,
            curve="reeds_shepp" if at % 4 < 2 else "dubins",
            margin_m=margin_m,
        )
        made.append(Drive(case, planned.route, planned.turns, request.param, margin_m))
    return made


def test_a_drive_works_every_segment_once_in_the_direction_it_tells(drives: list[Drive]) -> None:
    left_out = 0
    for drive in drives:
        segments, work, turns = drive.case.tracks.segments, drive.work, drive.turns
        key = segments.set_index(["track_no", "segment_no"]).geometry
        driven = list(zip(work["track_no"], work["segment_no"], strict=True))
        assert sorted(driven) == key.index.to_list()
        for row in work.itertuples():
            along = np.diff(shapely.get_coordinates([key[row.track_no, row.segment_no]]), axis=0)
            way = np.diff(shapely.get_coordinates([row.geometry])[[0, -1]], axis=0)
            assert ((along * way).sum() > 0.0) == (row.direction == "forward")
        left_m = turns["skipped_m"]
        assert (turns["from_track"] == turns["to_track"])[left_m > 0.0].all()
        whole_m = work["length_m"].sum() + left_m.sum()
        assert whole_m == pytest.approx(segments["length_m"].sum())
        left_out += int((left_m > 0.0).sum())
    assert left_out > 5 or drives[0].radius_m is None


def test_a_drive_is_one_line_whose_metres_are_told(drives: list[Drive]) -> None:
    for drive in drives:
        route, turns, scale = drive.route, drive.turns, drive.case.tracks.ground_scale
        lines = route.geometry.to_numpy()
        lengths_m = shapely.length(lines) / scale
        assert route["length_m"].to_list() == pytest.approx(lengths_m.tolist(), rel=3e-3, abs=0.01)
        before_m = np.cumsum(route["length_m"]) - route["length_m"]
        assert route["start_m"].to_list() == pytest.approx(before_m.to_list())
        ends = shapely.get_coordinates(shapely.get_point(lines, -1))[:-1]
        starts = shapely.get_coordinates(shapely.get_point(lines, 0))[1:]
        follows = np.diff(route["sequence"]) == 1
        assert np.abs(ends - starts)[follows].max(initial=0.0) < 1e-3
        track_no = drive.work.set_index("sequence")["track_no"]
        assert turns["from_track"].to_list() == track_no.loc[turns["sequence"] - 1].to_list()
        assert turns["to_track"].to_list() == track_no.loc[turns["sequence"] + 1].to_list()
        kind = route.set_index("sequence")["kind"].loc[turns["sequence"]]
        assert (kind == "drive").to_list() == (turns["kind"] == "drive").to_list()
        # No piece of a curve is rounding alone, and none is driven "-0 m" backwards.
        assert not np.signbit(turns["reverse_m"]).any()
        for way in turns.geometry[turns["kind"] != "drive"]:
            assert np.hypot(*np.diff(way.coords, axis=0).T).min() > 1e-6


def test_turns_keep_to_the_ground_and_to_the_turning_radius(drives: list[Drive]) -> None:
    fitting = 0
    for drive in drives:
        case, turns, scale = drive.case, drive.turns, drive.case.tracks.ground_scale
        ways, fits = turns.geometry.to_numpy(), (turns["fits"] == "yes").to_numpy()
        may: Any = case.field
        if drive.margin_m:
            whole = Polygon(case.field.exterior)
            around = shapely.buffer(whole, drive.margin_m * scale, quad_segs=64)
            may = shapely.union(may, shapely.difference(around, whole))
        outside_m = shapely.length(shapely.difference(ways, shapely.buffer(may, 0.02))) / scale
        assert outside_m[fits].max(initial=0.0) < 0.05
        assert (outside_m <= turns["outside_m"] + 0.1).all()
        through = shapely.length(shapely.intersection(ways, shapely.buffer(case.barred, -0.02)))
        assert through.max(initial=0.0) < 0.05
        curved = (turns["kind"] != "drive").to_numpy() & (drive.radius_m is not None)
        assert (turns["radius_m"].notna().to_numpy() == curved).all()
        for way in ways[fits & curved]:
            assert drive.radius_m is not None
            assert least_radius(way) / scale > 0.9 * drive.radius_m
            fitting += 1
    assert fitting > 150 or drives[0].radius_m is None


def test_metres_driven_backwards_are_those_between_cusps(drives: list[Drive]) -> None:
    most_m = 0.0
    for drive in drives:
        route, turns, scale = drive.route, drive.turns, drive.case.tracks.ground_scale
        before = route.set_index("sequence").geometry.loc[turns["sequence"] - 1]
        for turn, work in zip(turns.itertuples(), before, strict=True):
            assert (turn.reverse_m > 0.0) == (turn.kind == "reeds_shepp")
            if turn.kind == "drive":
                continue
            last, steps = (np.diff(line.coords, axis=0) for line in (work, turn.geometry))
            runs = np.concatenate((last[-1:], steps))
            heading = np.unwrap(np.arctan2(runs[:, 1], runs[:, 0]), period=2 * np.pi)
            cusps = np.cumsum(np.abs(np.diff(heading)) > 0.7 * np.pi)
            backward_m = np.hypot(*steps.T)[cusps % 2 == 1].sum() / scale
            assert backward_m == pytest.approx(turn.reverse_m, rel=1e-2, abs=1e-2)
            most_m = max(most_m, backward_m)
    assert most_m > 1.0 or drives[0].radius_m is None


def least_radius(way: Any) -> float:
    """Of the bends of a line, but for the cusps where a machine reverses, units of the CRS."""
    steps = np.diff(shapely.get_coordinates(way), axis=0)
    long = np.hypot(*steps.T)
    steps, long = steps[long > 0.02], long[long > 0.02]
    heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    bend = np.abs(np.diff(heading))
    smooth = bend < 0.9 * np.pi
    sharpest = (2.0 * bend / (long[1:] + long[:-1]))[smooth]
    return float(1.0 / sharpest.max(initial=1e-9))
