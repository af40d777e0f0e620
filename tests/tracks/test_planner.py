"""Tracks as users ask for them: directions, layout, identity, causes, points, bad input."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import geopandas as gpd
import numpy as np
import pyproj
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import Geod, Transformer
from shapely import Polygon, affinity

from geofield import schema
from geofield.errors import (
    CRSError,
    CRSMismatchError,
    FieldError,
    ObstacleError,
    TrackError,
    TrackWarning,
)
from geofield.grid import Grid
from geofield.model import Field
from geofield.model.obstacles import circle_polygons
from geofield.notes import listening
from geofield.tracks import longest_edge, plan_tracks

#: One unit is one metre on the ground here: a zone of scale 1 along its middle.
CRS: Any = "+proj=tmerc +lon_0=15 +k=1 +x_0=500000 +datum=WGS84 +units=m"
X, Y = 500000.0, 5600000.0


def box(x0: float, y0: float, x1: float, y1: float) -> Polygon:
    return shapely.box(X + x0, Y + y0, X + x1, Y + y1)


def circles(*rows: tuple[float, float, float]) -> gpd.GeoDataFrame:
    """A table of the schema's obstacles: circles of x, y, radius with a margin of 1 m inside it."""
    x, y, radius = np.array(rows).T
    return schema.table(
        schema.OBSTACLES,
        {
            "obstacle_no": np.arange(1, len(rows) + 1),
            "kind": ["tree"] * len(rows),
            "status": ["detected"] * len(rows),
            "radius_m": radius - 1.0,
            "buffer_m": np.ones(len(rows)),
        },
        circle_polygons(X + x, Y + y, radius, pyproj.CRS(CRS)),
        CRS,
    )


def test_a_plain_field() -> None:
    tracks = plan_tracks(box(0, 0, 100, 40), crs=CRS, spacing_m=4.0)
    assert tracks.lines["track_no"].tolist() == list(range(1, 11))
    assert tracks.segments["length_m"].tolist() == pytest.approx([100.0] * 10, abs=1e-7)
    assert len(tracks.gaps) == 0
    y = shapely.get_coordinates(tracks.segments.geometry.to_numpy())[::2, 1] - Y
    assert sorted(y) == pytest.approx(np.arange(2.0, 40.0, 4.0), abs=1e-6)
    figures = tracks.statistics
    assert figures.length_m == pytest.approx(1000.0)
    assert figures.coverage_percent == pytest.approx(100.0, abs=1e-6)
    assert figures.overlap_percent == pytest.approx(0.0, abs=1e-6)
    assert pickle.loads(pickle.dumps(tracks)).segments.equals(tracks.segments)


def test_a_field_knows_its_own_crs() -> None:
    field = Field(box(0, 0, 100, 40), CRS)
    own = plan_tracks(field, spacing_m=4.0)
    assert own.segments.equals(plan_tracks(field.polygon, crs=CRS, spacing_m=4.0).segments)
    with pytest.raises(CRSMismatchError, match="not in the CRS given"):
        plan_tracks(field, crs=32633, spacing_m=4.0)


def test_circles_are_cut_as_circles_and_named() -> None:
    tracks = plan_tracks(box(0, 0, 100, 40), circles((50, 22, 7)), crs=CRS, spacing_m=4.0)
    gaps = tracks.gaps
    away = np.abs(shapely.get_coordinates(gaps.geometry.to_numpy())[::2, 1] - Y - 22.0)
    assert gaps["length_m"].to_numpy() == pytest.approx(2.0 * np.sqrt(49.0 - away**2), abs=1e-6)
    assert set(gaps["cause"]) == {"obstacle 1"}
    assert gaps["obstacle_no"].tolist() == [1] * len(gaps)
    (loss,) = tracks.statistics.losses
    assert loss.length_m == pytest.approx(gaps["length_m"].sum())


@pytest.mark.parametrize("inside_m", [1e-2, 1e-4, 1e-6])
def test_a_circle_that_hardly_reaches_a_track_takes_a_chord_of_it(inside_m: float) -> None:
    tree = circles((50, 20, 5 + inside_m))
    tracks = plan_tracks(box(0, 0, 100, 40), tree, crs=CRS, spacing_m=10.0)
    # Of a circle of 5 + d, 5 beside its middle: 2 sqrt(d (10 + d)).
    chord_m = 2.0 * np.sqrt(inside_m * (10.0 + inside_m))
    assert tracks.gaps["length_m"].tolist() == pytest.approx([chord_m, chord_m], rel=0.01)


def test_more_tracks_than_a_short_number_counts_keep_their_order() -> None:
    tracks = plan_tracks(
        box(0, 0, 30, 330), circles((15, 165, 5)), crs=CRS, spacing_m=0.01, direction=90, step_m=50
    )
    assert tracks.lines["track_no"].tolist() == list(range(1, 33_001))
    assert len(tracks.gaps) == 1000
    assert tracks.segments["length_m"].sum() == pytest.approx(
        (30 * 330 - np.pi * 25) / 0.01, rel=1e-6
    )


@pytest.mark.parametrize("edit", ["moved", "reshaped", "dented"])
def test_a_persons_drawing_is_the_truth(edit: str) -> None:
    table = circles((50, 22, 7))
    circle = table.geometry.iloc[0]
    drawn = {
        "moved": shapely.transform(circle, lambda xy: xy + np.array((9.0, 0.0))),
        "reshaped": box(40, 14, 63, 29),
        # One corner pulled out by 0.8 m changes the area by half a percent.
        "dented": Polygon([(X + 57.8, Y + 22.0), *list(circle.exterior.coords)[1:-1]]),
    }[edit]
    table = table.set_geometry(gpd.GeoSeries([drawn], crs=CRS))
    tracks = plan_tracks(box(0, 0, 100, 40), table, crs=CRS, spacing_m=4.0)
    through = tracks.segments.geometry.to_numpy()
    assert not shapely.intersects(through, shapely.buffer(drawn, -0.01)).any()
    assert shapely.distance(shapely.union_all(through), drawn) < 1e-6


@pytest.mark.parametrize("status", ["rejected", "possible", "Rejected "])
def test_rejected_and_possible_obstacles_do_not_count(status: str) -> None:
    table = circles((50, 20, 5), (20, 20, 5))
    table.loc[0, "status"] = status
    tracks = plan_tracks(box(0, 0, 100, 40), table, crs=CRS, spacing_m=4.0)
    assert set(tracks.gaps["obstacle_no"]) == {2}


def test_identity_survives_changes_of_obstacles() -> None:
    field: Any = shapely.difference(box(0, 0, 120, 80), box(50, 50, 60, 80))
    before = plan_tracks(field, circles((30, 30, 6), (90, 60, 5)), crs=CRS, spacing_m=3.0)
    after = plan_tracks(
        field, circles((30, 30, 6), (90, 60, 5), (70, 20, 4)), crs=CRS, spacing_m=3.0
    )
    touched = set(after.gaps.loc[after.gaps["cause"].str.contains("3"), "track_no"])
    assert touched
    for name in ("segments", "gaps", "lines"):
        one, two = getattr(before, name), getattr(after, name)
        same_one = one[~one["track_no"].isin(touched)].reset_index(drop=True)
        same_two = two[~two["track_no"].isin(touched)].reset_index(drop=True)
        assert len(same_one)
        assert same_one.equals(same_two)
    # A track that nothing is left of keeps its number free.
    blocked = plan_tracks(field, [box(-5, 5, 125, 9)], crs=CRS, spacing_m=3.0)
    assert blocked.blocked_count == 1
    assert blocked.lines["track_no"].tolist() == sorted({*before.lines["track_no"]} - {3})


def test_gaps_name_every_cause() -> None:
    field: Any = shapely.difference(box(0, 0, 100, 40), box(40, 20, 50, 40))
    obstacles = [box(48, 24, 55, 30), box(54, 24, 60, 30), box(10, 24, 14, 30)]
    tracks = plan_tracks(field, obstacles, crs=CRS, spacing_m=4.0, direction=90.0)
    causes = set(tracks.gaps["cause"])
    assert "border, obstacles 1, 2" in causes
    assert "border" in causes
    assert "obstacle 3" in causes
    border = tracks.gaps[tracks.gaps["cause"] == "border"]
    assert border["obstacle_no"].isna().all()


def test_gaps_name_what_stands_on_either_side_of_the_track() -> None:
    # Along 6 m: gaps are where both sides of the track are barred, from wherever they are so.
    way = [(X, Y), (X + 10.0, Y)]
    barred = [box(20, 6, 60, 8), box(30, 4, 40, 6), box(55, 4, 70, 6)]
    planned = plan_tracks(box(0, 0, 100, 16), barred, crs=CRS, spacing_m=3.0, direction=way)
    gaps = planned.gaps[planned.gaps["length_m"] < 20.0]
    gaps = gaps[gaps.geometry.bounds["miny"].sub(Y + 6.0).abs() < 1e-6]
    assert gaps["length_m"].tolist() == pytest.approx([10.0, 5.0], abs=1e-6)
    assert gaps["cause"].tolist() == ["obstacles 1, 2", "obstacles 1, 3"]


def test_what_touches_a_gap_with_a_corner_is_no_cause() -> None:
    field: Any = shapely.difference(box(0, 0, 100, 16), box(40, 2, 50, 16))
    corner = Polygon([(X + 42, Y + 4), (X + 48, Y + 4), (X + 45, Y + 6)])
    planned = plan_tracks(
        field, [corner], crs=CRS, spacing_m=3.0, direction=[(X, Y), (X + 10.0, Y)]
    )
    touched = planned.gaps.distance(shapely.Point(X + 45, Y + 6)) < 1e-6
    assert planned.gaps.loc[touched, "cause"].tolist() == ["border"]


def test_tracks_keep_one_number_across_a_notch() -> None:
    field: Any = shapely.difference(box(0, 0, 100, 40), box(40, 9, 60, 40))
    tracks = plan_tracks(field, crs=CRS, spacing_m=4.0)
    assert tracks.lines["track_no"].tolist() == list(range(1, 11))
    assert tracks.lines["segment_count"].tolist() == [1, 1] + [2] * 8
    assert set(tracks.gaps["cause"]) == {"border"}


# -- direction -----------------------------------------------------------------------------


def test_headings_are_true_headings() -> None:
    """At the edge of a zone grid north and true north differ by more than two degrees."""
    to_utm = Transformer.from_crs(4326, CRS, always_xy=True)
    x, y = to_utm.transform(17.9, 52.0)
    field = shapely.box(x - 200, y - 150, x + 200, y + 150)
    to_lonlat = Transformer.from_crs(CRS, 4326, always_xy=True)
    for heading in (0.0, 30.0, 90.0, 135.0):
        tracks = plan_tracks(field, crs=CRS, spacing_m=10.0, direction=heading)
        assert tracks.heading_deg == pytest.approx(heading, abs=1e-9)
        middle = tracks.segments.geometry.iloc[len(tracks.segments) // 2]
        (a, b) = (to_lonlat.transform(*place) for place in middle.coords)
        azimuth, _, _ = Geod(ellps="WGS84").inv(*a, *b)
        apart = (azimuth - heading + 90.0) % 180.0 - 90.0
        assert abs(apart) < 0.01
    # The other way round is the same set of lines.
    assert plan_tracks(
        field, crs=CRS, spacing_m=10.0, direction=210.0
    ).heading_deg == pytest.approx(30.0)


@pytest.mark.parametrize("direction", ["longest_edge", "hough"])
def test_the_longest_edge_is_found_through_noise(direction: str) -> None:
    rng = np.random.default_rng(8)
    along = np.linspace(0.0, 200.0, 60)
    # The long edge has 60 vertices that stray by 0.3 m; the others have two each.
    edge = np.column_stack((along, rng.normal(0.0, 0.15, 60).clip(-0.3, 0.3)))
    ring = np.vstack((edge, [(200.0, 90.0), (110.0, 95.0), (0.0, 80.0)]))
    turn = np.deg2rad(27.0)
    ring = ring @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    tracks = plan_tracks(
        Polygon(ring + np.array((X, Y))), crs=CRS, spacing_m=5.0, direction=direction
    )
    assert tracks.heading_deg == pytest.approx(
        63.0, abs=0.3 if direction == "longest_edge" else 0.8
    )
    first = tracks.segments.geometry.iloc[0]
    # Counted from that edge, half a spacing inside.
    assert shapely.Point(X, Y).distance(first) == pytest.approx(2.5, abs=1.2)


def test_longest_edge_of_simple_shapes() -> None:
    assert longest_edge(box(0, 0, 100, 40)).length == pytest.approx(100.0)
    many = shapely.segmentize(box(0, 0, 100, 40), 0.5)
    assert longest_edge(many).length == pytest.approx(100.0, abs=1e-6)
    tiny = box(0, 0, 0.6, 0.4)
    assert longest_edge(tiny).length == pytest.approx(0.6)


@pytest.mark.parametrize("x", [0.0, 137_000.0])
def test_a_heading_and_its_opposite_count_from_opposite_sides(x: float) -> None:
    field = box(x, 0, x + 100, 60)
    firsts = {}
    for heading in (0.0, 360.0, -360.0, 180.0, 540.0):
        tracks = plan_tracks(field, crs=CRS, spacing_m=10.0, direction=heading)
        assert tracks.heading_deg == 0.0
        firsts[heading] = tracks.lines.geometry.iloc[0].centroid.x < X + x + 50
    assert firsts == {0.0: True, 360.0: True, -360.0: True, 180.0: False, 540.0: False}


def test_points_that_no_disk_holds_are_refused() -> None:
    with pytest.raises(TrackError, match="track points"):
        plan_tracks(box(0, 0, 100, 60), crs=CRS, spacing_m=10.0, step_m=1e-6)


@pytest.mark.parametrize("short", [-1.0, float("nan")])
def test_no_piece_is_shorter_than_nothing(short: float) -> None:
    with pytest.raises(TrackError, match="min_segment_m"):
        plan_tracks(box(0, 0, 100, 60), crs=CRS, spacing_m=10.0, min_segment_m=short)


def test_fewest_is_the_narrow_way() -> None:
    turn = np.deg2rad(33.0)
    field = shapely.affinity.rotate(box(0, 0, 200, 60), 33.0)
    few = plan_tracks(field, crs=CRS, spacing_m=5.0, direction="fewest")
    assert len(few.lines) == 12
    for heading in range(0, 180, 7):
        other = plan_tracks(field, crs=CRS, spacing_m=5.0, direction=float(heading))
        assert len(other.lines) >= 12
    assert np.rad2deg(turn) == pytest.approx(33.0)


def test_fewest_turns_counts_pieces() -> None:
    comb: Any = shapely.difference(
        box(0, 0, 200, 60), shapely.union_all([box(x, 20, x + 10, 60) for x in range(20, 200, 40)])
    )
    tracks = plan_tracks(comb, crs=CRS, spacing_m=4.0, direction="fewest")
    turns = plan_tracks(comb, crs=CRS, spacing_m=4.0, direction="fewest_turns")
    assert len(tracks.lines) < len(turns.lines)
    assert len(turns.segments) < len(tracks.segments)


@pytest.mark.parametrize(
    "options",
    [
        {"spacing_m": 24.0},
        {"spacing_m": 12.0, "headland_m": 12.0},
        {"spacing_m": 12.0, "offset_m": 2.0},
        {"spacing_m": 12.0, "headland_m": 5.0, "last_strip": "leave"},
        {"spacing_m": 12.0, "last_strip": "shift"},
    ],
)
def test_no_heading_beats_the_fewest_nor_what_is_said_of_them(options: dict[str, Any]) -> None:
    ring = [(0, 0), (190, -30), (230, 90), (150, 60), (120, 170), (20, 150)]
    field: Any = Polygon([(X + x, Y + y) for x, y in ring]).difference(
        shapely.Point(X + 80, Y + 60).buffer(15)
    )

    def counted(direction: Any) -> tuple[int, int, str]:
        tracks = plan_tracks(field, crs=CRS, direction=direction, **options)
        return len(tracks.lines) + tracks.blocked_count, len(tracks.segments), tracks.direction_why

    others = [counted(float(heading)) for heading in range(180)]
    fewest = counted("fewest")[0]
    assert fewest <= min(tracks for tracks, _, _ in others)
    assert counted("fewest_turns")[1] <= min(pieces for _, pieces, _ in others)
    dominant, _, why = counted("dominant")
    saved = f"direction fewest would need {fewest} tracks instead of {dominant}"
    assert why.endswith("no heading needs fewer tracks" if dominant <= fewest else saved)


def test_fewest_turns_does_not_leave_a_field_undriven() -> None:
    strip = box(0, 0, 200, 10)
    tracks = plan_tracks(
        strip, crs=CRS, spacing_m=6.0, direction="fewest_turns", min_segment_m=12.0
    )
    assert tracks.segments["length_m"].sum() > 300


def test_ab_lines_are_tracks_themselves() -> None:
    a, b = (X + 10.0, Y + 7.0), (X + 60.0, Y + 33.0)
    tracks = plan_tracks(box(0, 0, 100, 40), crs=CRS, spacing_m=4.0, direction=[a, b])
    nearest = tracks.segments.distance(shapely.LineString([a, b]).centroid).min()
    assert nearest < 1e-6
    same = plan_tracks(
        box(0, 0, 100, 40), crs=CRS, spacing_m=4.0, direction=shapely.LineString([a, b])
    )
    assert same.segments.equals(tracks.segments)


# -- layout --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("last_strip", "expected"),
    [
        ("overrun", [2.0, 6.0, 10.0, 14.0, 18.0]),
        ("leave", [2.0, 6.0, 10.0, 14.0]),
        ("shift", [2.0, 6.0, 10.0, 14.0, 17.0]),
        ("spread", [1.9, 5.7, 9.5, 13.3, 17.1]),
    ],
)
def test_last_strips(last_strip: Any, expected: list[float]) -> None:
    tracks = plan_tracks(box(0, 0, 100, 19), crs=CRS, spacing_m=4.0, last_strip=last_strip)
    y = shapely.get_coordinates(tracks.segments.geometry.to_numpy())[::2, 1] - Y
    y = y if y[0] < y[-1] else 19.0 - y
    assert y == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("last_strip", ["overrun", "leave", "shift"])
@pytest.mark.parametrize("y", [1.0, 17.5])
def test_a_track_passes_a_place_near_either_border(last_strip: Any, y: float) -> None:
    """In the last half spacing `leave` and `shift` passed up to a spacing beside it, in silence."""
    field, place = box(0, 0, 100, 19), shapely.Point(X + 33.0, Y + y)
    a_b = [(X + 33.0, Y + y), (X + 60.0, Y + y)]
    for how in ({"through": place, "direction": 90}, {"direction": a_b}):
        tracks = plan_tracks(field, crs=CRS, spacing_m=4.0, last_strip=last_strip, **how)
        assert tracks.segments.distance(place).min() < 1e-6


@pytest.mark.parametrize("last_strip", ["leave", "shift"])
def test_no_strip_reaches_beyond_a_narrow_field_unasked(last_strip: Any) -> None:
    """Of strips wider than the field none fits; only what was asked for lies there anyway."""
    narrow: Any = {"crs": CRS, "spacing_m": 30.0, "direction": 90, "last_strip": last_strip}
    with listening() as heard:
        tracks = plan_tracks(box(0, 0, 100, 19), **narrow)
    place = 9.5 if last_strip == "leave" else 15.0
    assert len(heard) == (last_strip == "leave")
    assert tracks.lines.bounds["miny"].tolist() == pytest.approx([Y + place], abs=0.02)
    asked = plan_tracks(box(0, 0, 100, 19), **narrow, offset_m=16.0)
    assert asked.lines.bounds["miny"].tolist() == pytest.approx([Y + 3.0], abs=0.02)


@pytest.mark.filterwarnings("ignore::geofield.errors.TrackWarning")
def test_tracks_that_are_spread_tell_how_far_beside_a_place_they_lie() -> None:
    how: Any = {"crs": CRS, "spacing_m": 4.0, "direction": 90, "last_strip": "spread"}
    for y in (1.0, 11.3, 17.5):
        place = shapely.Point(X + 33.0, Y + y)
        tracks = plan_tracks(box(0, 0, 100, 19), through=place, **how)
        (note,) = (note for note in tracks.notes if "spread evenly" in note)
        told_m = float(note.split(" they lie ")[1].split()[0])
        assert told_m == pytest.approx(tracks.segments.distance(place).min(), abs=0.006)
    assert not plan_tracks(box(0, 0, 100, 19), **how).notes


def test_offset_and_place() -> None:
    first = plan_tracks(box(0, 0, 100, 40), crs=CRS, spacing_m=4.0, offset_m=1.0).segments
    distance = box(0, 0, 100, 40).exterior.distance(first.geometry.iloc[0])
    assert distance == pytest.approx(0.0)
    # From the first of two edges of equal length, which runs along the top or the bottom.
    y = shapely.get_coordinates(first.geometry.iloc[0])[0, 1] - Y
    assert min(y, 40.0 - y) == pytest.approx(1.0, abs=1e-6)
    place = shapely.Point(X + 33.0, Y + 11.3)
    tracks = plan_tracks(box(0, 0, 100, 40), crs=CRS, spacing_m=4.0, through=place)
    assert tracks.segments.distance(place).min() < 1e-6
    border = plan_tracks(box(0, 0, 100, 40), crs=CRS, spacing_m=4.0, offset_m=0.0)
    assert len(border.lines) == 11


def test_a_track_on_a_border_of_many_vertices_is_whole() -> None:
    """Vertices lie beside their line by the last digits of a northing: pieces were lost."""
    rng = np.random.default_rng(1)
    for _ in range(30):
        length_m, angle = rng.uniform(200, 600), rng.uniform(0, 180)
        along = np.concatenate([[0], np.sort(rng.uniform(0, length_m, 120)), [length_m]])
        ring = [*((x, 0) for x in along), *((x, 100) for x in along[::-1])]
        field = affinity.rotate(Polygon(ring), angle, origin=(0, 0))
        field = affinity.translate(field, rng.uniform(2e5, 8e5), rng.uniform(1e6, 9e6))
        how: Any = {"crs": "EPSG:32636", "spacing_m": 4.0, "direction": "longest_edge"}
        segments = plan_tracks(field, offset_m=0.0, **how).segments
        first = segments[segments["track_no"] == 1]
        assert first.geometry.length.tolist() == pytest.approx([length_m], abs=1e-3)


@pytest.mark.parametrize("turned_deg", [0.0, 33.0])
@pytest.mark.parametrize("mirrored", [1, -1])
def test_what_only_touches_a_track_takes_nothing_of_it(mirrored: int, turned_deg: float) -> None:
    """Two sheds that meet corner to corner on it, one along it, and a spike of the field."""
    middle = (X + 50.0, Y + 6.0)

    def put(shape: Any) -> Any:
        mirror = affinity.scale(shape, mirrored, 1, origin=middle)
        return affinity.rotate(mirror, turned_deg, origin=middle)

    how: Any = {"crs": CRS, "spacing_m": 4.0}
    how["direction"] = put(shapely.LineString([(X, Y + 6.0), (X + 100.0, Y + 6.0)]))
    sheds = [box(40, 2, 50, 6), box(50, 6, 60, 10), box(20, 6, 30, 9)]
    stands = gpd.GeoDataFrame(
        {"radius_m": [np.nan] * 3 + [2.0]},
        geometry=[put(each) for each in [*sheds, shapely.Point(X + 80.0, Y + 6.0)]],
        crs=CRS,
    )
    planned = plan_tracks(put(box(0, 0, 100, 12)), stands, **how)
    middle_ones = planned.segments[planned.segments["track_no"] == 2]
    assert sorted(middle_ones["length_m"]) == pytest.approx([18.0, 78.0], abs=1e-6)
    assert planned.gaps["length_m"].tolist() == pytest.approx([4.0], abs=1e-6)
    assert planned.statistics.losses[3].length_m == pytest.approx(4.0, abs=1e-6)
    assert sum(each.length_m for each in planned.statistics.losses[:3]) < 1e-6
    ring = [(0, 0), (100, 0), (100, 10), (60, 10), (60, 5), (40, 5), (20, 6), (0, 5)]
    spiked = plan_tracks(put(Polygon([(X + x, Y + y) for x, y in ring])), **how)
    assert sorted(spiked.segments["length_m"]) == pytest.approx([40.0, 40.0, 100.0], abs=1e-6)


def test_what_stands_on_a_first_track_along_either_border_is_told_as_its_loss() -> None:
    """Of a track along one of the two borders it was told as none."""
    tree, shed = shapely.Point(X + 50, Y).buffer(0.1), box(70, -1, 80, 1)
    for y in (0.0, 12.0):
        stands = [affinity.translate(each, 0.0, y) for each in (tree, shed)]
        how: Any = {"direction": shapely.LineString([(X, Y + y), (X + 100, Y + y)])}
        planned = plan_tracks(box(0, 0, 100, 12), stands, crs=CRS, spacing_m=6.0, **how)
        told = [each.length_m for each in planned.statistics.losses]
        assert told == pytest.approx([0.2, 10.0], abs=1e-6)
        share = 100.0 * 10.0 / 300.0
        assert planned.statistics.losses[1].percent == pytest.approx(share, abs=1e-5)


def test_headland() -> None:
    field = box(0, 0, 100, 60)
    tracks = plan_tracks(field, circles((3, 30, 2)), crs=CRS, spacing_m=4.0, headland_m=8.0)
    assert tracks.headland is not None
    assert tracks.headland_tracks is not None
    assert tracks.headland["area_ha"].iloc[0] == pytest.approx((6000 - 84 * 44) / 1e4)
    inner = box(8, 8, 92, 52)
    assert shapely.covers(shapely.buffer(inner, 1e-6), tracks.segments.geometry.to_numpy()).all()
    assert len(tracks.lines) == 11
    rings = tracks.headland_tracks
    assert rings["pass_no"].tolist() == [1, 2]
    assert rings["offset_m"].tolist() == [2.0, 6.0]
    assert rings.geometry.iloc[1].is_closed
    assert not rings.geometry.iloc[0].is_closed
    assert rings["length_m"].iloc[1] == pytest.approx(2 * (88 + 48))
    assert tracks.statistics.coverage_percent > 98.0


@pytest.mark.filterwarnings("ignore:Between passes:geofield.errors.TrackWarning")
@pytest.mark.parametrize("last_strip", ["leave", "shift", "spread"])
@pytest.mark.parametrize("spacing_m", [5.0, 7.0])
def test_a_machine_whose_passes_overlap_stays_within_the_border(
    last_strip: Any, spacing_m: float
) -> None:
    field = box(0, 0, 200, 121)
    how: Any = {"crs": CRS, "spacing_m": spacing_m, "width_m": 6.0}
    plain = plan_tracks(field, last_strip=last_strip, **how)
    around = plan_tracks(field, headland_m=2.0 * spacing_m, **how)
    assert around.headland_tracks is not None
    rings = around.headland_tracks
    assert rings["offset_m"].tolist() == [3.0, 3.0 + spacing_m]
    for lines in (plain.segments.geometry, rings.geometry):
        worked = shapely.buffer(lines.to_numpy(), 3.0, cap_style="flat", join_style="mitre")
        assert shapely.covers(shapely.buffer(field, 1e-6), worked).all()
    across = np.sort(plain.segments.geometry.bounds["miny"].to_numpy()) - Y
    assert np.diff(across).max() <= spacing_m + 1e-6
    kept = across[0], 121.0 - across[-1]
    assert min(kept) == pytest.approx(3.0)
    assert max(kept) < 3.0 + spacing_m if last_strip == "leave" else max(kept) == pytest.approx(3.0)


@pytest.mark.parametrize("direction", [90.0, 270.0, "longest_edge"])
def test_only_whole_strips_are_left_on_either_side_of_a_place(direction: Any) -> None:
    for y in np.arange(20.0, 26.0):
        how: Any = {"crs": CRS, "spacing_m": 6.0, "direction": direction, "last_strip": "leave"}
        planned = plan_tracks(box(0, 0, 200, 100), through=(X + 9.0, Y + y), **how)
        across = planned.segments.geometry.bounds["miny"].to_numpy() - Y
        assert min(*across, *(100.0 - across)) >= 3.0 - 1e-2
        assert len(across) == 1 + (y - 3.0) // 6.0 + (97.0 - y) // 6.0


def test_wide_strips_beside_a_first_track_on_the_border_lie_inside() -> None:
    how: Any = {"crs": CRS, "spacing_m": 4.0, "width_m": 10.0, "last_strip": "leave"}
    planned = plan_tracks(box(0, 0, 200, 30), offset_m=0.0, direction="longest_edge", **how)
    from_edge = 30.0 - (planned.segments.geometry.bounds["miny"].to_numpy() - Y)
    assert from_edge == pytest.approx([0, 8, 12, 16, 20, 24], abs=1e-6)


def test_a_pass_of_a_headland_narrower_than_half_the_machine_stays_within_the_border() -> None:
    for width_m, headland_m, offset_m in ((None, 2.0, 3.0), (13.0, 6.0, 6.5)):
        how: Any = {"crs": CRS, "spacing_m": 6.0, "width_m": width_m}
        planned = plan_tracks(box(0, 0, 200, 121), headland_m=headland_m, **how)
        assert planned.headland_tracks is not None
        assert planned.headland_tracks["offset_m"].tolist() == [offset_m]


def test_a_headland_is_told_to_be_worked_as_far_as_its_passes_reach() -> None:
    how: Any = {"crs": CRS, "spacing_m": 5.0, "width_m": 6.0}
    assert not plan_tracks(box(0, 0, 200, 120), headland_m=11.0, **how).notes
    with pytest.warns(TrackWarning, match=r"strip of 1\.00 m"):
        plan_tracks(box(0, 0, 200, 120), headland_m=12.0, **how)


def test_short_segments_join_the_gap() -> None:
    obstacles = [box(40, -1, 45, 41), box(47, -1, 52, 41)]
    tracks = plan_tracks(box(0, 0, 100, 40), obstacles, crs=CRS, spacing_m=4.0, min_segment_m=3.0)
    assert set(tracks.gaps["cause"]) == {"obstacles 1, 2"}
    assert tracks.gaps["length_m"].tolist() == pytest.approx([12.0] * 10)
    assert tracks.lines["gap_count"].tolist() == [1] * 10


# -- points --------------------------------------------------------------------------------


def test_points_are_numbered_and_have_both_ends() -> None:
    grid = Grid.web_mercator(lat=50.5, lon=15.0, zoom=18, width_px=400, height_px=400)
    tracks = plan_tracks(
        box(0, 0, 60.5, 8), [box(30, -1, 32, 9)], crs=CRS, spacing_m=4.0, step_m=2.0, grid=grid
    )
    points = tracks.points
    assert points["point_no"].tolist() == list(range(1, len(points) + 1))
    assert len(points) == tracks.lines["point_count"].sum()
    for (track, segment), group in points.groupby(["track_no", "segment_no"]):
        row = tracks.segments[
            (tracks.segments["track_no"] == track) & (tracks.segments["segment_no"] == segment)
        ].iloc[0]
        places = shapely.get_coordinates(group.geometry.to_numpy())
        ends = shapely.get_coordinates(row.geometry)
        assert places[[0, -1]] == pytest.approx(ends, abs=1e-6)
        steps = np.hypot(*np.diff(places, axis=0).T)
        assert steps[:-1] == pytest.approx([2.0] * (len(steps) - 1))
        assert 0.0 < steps[-1] <= 2.0 + 1e-6
    lon, lat = grid.to_lonlat(points["x_px"].to_numpy(), points["y_px"].to_numpy())
    assert lon == pytest.approx(points["lon"].to_numpy(), abs=1e-9)
    assert lat == pytest.approx(points["lat"].to_numpy(), abs=1e-9)


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.tuples(st.floats(-10, 110), st.floats(-10, 70), st.floats(1.5, 15)), max_size=8),
    st.floats(0, 180),
    st.floats(1.0, 12.0),
)
def test_no_point_lies_outside_or_in_a_buffer(
    rows: list[tuple[float, float, float]], heading: float, spacing_m: float
) -> None:
    field: Any = shapely.difference(box(0, 0, 100, 60), box(40, 30, 55, 60))
    obstacles = circles(*rows) if rows else None
    tracks = plan_tracks(field, obstacles, crs=CRS, spacing_m=spacing_m, direction=heading)
    xy = shapely.get_coordinates(tracks.points.geometry.to_numpy())
    assert shapely.distance(shapely.points(xy), field).max(initial=0.0) < 1e-6
    for x, y, radius in rows:
        away = np.hypot(xy[:, 0] - X - x, xy[:, 1] - Y - y)
        assert away.min(initial=np.inf) > radius - 1e-6


# -- what may go wrong ---------------------------------------------------------------------


def test_obstacles_in_another_crs_and_of_other_kinds() -> None:
    field = box(0, 0, 100, 40)
    reference = plan_tracks(field, circles((50, 22, 7)), crs=CRS, spacing_m=4.0)
    elsewhere = plan_tracks(field, circles((50, 22, 7)).to_crs(4326), crs=CRS, spacing_m=4.0)
    assert elsewhere.gaps["length_m"].to_numpy() == pytest.approx(
        reference.gaps["length_m"].to_numpy(), abs=1e-5
    )
    tree = gpd.GeoDataFrame({"radius_m": [7.0]}, geometry=[shapely.Point(X + 50, Y + 22)], crs=CRS)
    point = plan_tracks(field, tree, crs=CRS, spacing_m=4.0)
    assert point.gaps["length_m"].to_numpy() == pytest.approx(
        reference.gaps["length_m"].to_numpy(), abs=1e-6
    )
    grown = plan_tracks(
        field, [shapely.Point(X + 50, Y + 22)], crs=CRS, spacing_m=4.0, clearance_m=7.0
    )
    assert grown.gaps["length_m"].sum() == pytest.approx(reference.gaps["length_m"].sum(), abs=1e-4)
    fence = shapely.LineString([(X + 50, Y - 5), (X + 50, Y + 45)])
    cut = plan_tracks(field, [fence], crs=CRS, spacing_m=4.0, clearance_m=1.0)
    assert cut.gaps["length_m"].tolist() == pytest.approx([2.0] * 10)
    with pytest.raises(TrackError, match="without a radius"):
        plan_tracks(field, [fence], crs=CRS, spacing_m=4.0)
    nameless = gpd.GeoDataFrame(geometry=[shapely.box(15.0, 50.5, 15.001, 50.501)])
    with pytest.raises(CRSMismatchError):
        plan_tracks(field, nameless, crs=CRS, spacing_m=4.0)


def test_an_obstacle_of_several_kinds_of_shapes_is_each_of_them() -> None:
    """As QGIS makes them when layers are merged or collected: they ended in a traceback."""
    fence = shapely.LineString([(X + 70, Y - 5), (X + 70, Y + 45)])
    shapes = [box(20, 9, 30, 21), fence]
    apart = gpd.GeoDataFrame({"radius_m": [1.0, 1.0]}, geometry=shapes, crs=CRS)
    nested = shapely.GeometryCollection([shapely.GeometryCollection([fence])])
    mixed = shapely.GeometryCollection([shapes[0], nested])
    one = gpd.GeoDataFrame({"radius_m": [1.0]}, geometry=[mixed], crs=CRS)
    expected, found = (
        plan_tracks(box(0, 0, 100, 40), each, crs=CRS, spacing_m=4.0) for each in (apart, one)
    )
    assert found.segments.geometry.geom_equals_exact(expected.segments.geometry, 1e-9).all()
    assert set(found.gaps["obstacle_no"]) == {1}
    with pytest.raises(TrackError, match="Obstacle 1 is a LineString without a radius"):
        plan_tracks(box(0, 0, 100, 40), [mixed], crs=CRS, spacing_m=4.0)


@pytest.mark.parametrize("settings", [{}, {"min_segment_m": 5.0}])
def test_an_obstacle_over_the_whole_field(settings: dict[str, Any]) -> None:
    with pytest.warns(TrackWarning, match="covers the field" + ".*5 m" * len(settings)):
        tracks = plan_tracks(
            box(0, 0, 100, 40), [box(-5, -5, 105, 45)], crs=CRS, spacing_m=4.0, **settings
        )
    assert len(tracks.segments) == len(tracks.gaps) == len(tracks.lines) == len(tracks.points) == 0
    assert tracks.blocked_count == 10
    assert tracks.statistics.coverage_percent == 0.0
    assert list(tracks.points.columns[:-1]) == schema.TRACK_POINTS.column_names


def test_radii_that_are_not_numbers() -> None:
    table = circles((50, 20, 5))
    table["radius_m"] = np.nan
    tracks = plan_tracks(box(0, 0, 100, 40), table, crs=CRS, spacing_m=4.0)
    assert len(tracks.gaps) == 2
    table["radius_m"] = np.inf
    with pytest.raises(ObstacleError):
        plan_tracks(box(0, 0, 100, 40), table, crs=CRS, spacing_m=4.0)


def test_outlines_are_repaired_or_refused() -> None:
    field = box(0, 0, 100, 40)
    flat = plan_tracks(field, crs=CRS, spacing_m=4.0).segments
    with pytest.warns(TrackWarning, match="Heights"):
        high = plan_tracks(shapely.force_3d(field, 9.0), crs=CRS, spacing_m=4.0)
    assert high.segments.equals(flat)
    assert high.notes
    corners = [(0, 0), (100, 0), (100, 40), (100, 60), (100, 40), (0, 40)]
    spike = Polygon(np.array(corners) + np.array((X, Y)))
    with pytest.warns(TrackWarning, match="0.40 ha kept, 0.0 m2 left out"):
        assert plan_tracks(spike, crs=CRS, spacing_m=4.0).segments[
            "length_m"
        ].sum() == pytest.approx(1000.0)
    single = plan_tracks(shapely.MultiPolygon([field]), crs=CRS, spacing_m=4.0)  # type: ignore[arg-type]
    assert single.segments.equals(flat)
    bow = Polygon([(X, Y), (X + 100, Y + 40), (X + 100, Y), (X, Y + 40)])
    for wrong, match in (
        (bow, "cannot be repaired .* Its parts have 0.10, 0.10 ha"),
        (Polygon(), "empty"),
        (shapely.MultiPolygon([field, box(200, 0, 300, 40)]), "2 parts"),
        (shapely.LineString([(0, 0), (1, 1)]), "must be a polygon"),
        ("POLYGON", "shapely polygon"),
        (Polygon([(X, Y), (X + 1, np.inf), (X + 2, Y)]), "finite"),
    ):
        with pytest.raises(TrackError, match=match):
            plan_tracks(wrong, crs=CRS, spacing_m=4.0)  # type: ignore[arg-type]


def test_degrees_are_refused() -> None:
    degrees = shapely.box(15.0, 50.5, 15.002, 50.501)
    for crs in (4326, 3857, CRS):
        with pytest.raises(CRSError):
            plan_tracks(degrees, crs=crs, spacing_m=4.0)


def test_obstacles_in_degrees_are_placed_or_refused() -> None:
    """Of whatever kind: they were left out, and the tracks ran through all of them."""
    field, trees = box(0, 0, 100, 40), circles((50, 20, 5)).geometry
    metres = plan_tracks(field, list(trees), crs=CRS, spacing_m=4.0)
    assert len(metres.gaps) == 2
    degrees = trees.to_crs(4326)
    for own in (degrees, degrees.array):
        assert len(plan_tracks(field, own, crs=CRS, spacing_m=4.0).gaps) == 2
    swapped = shapely.transform(degrees.to_numpy(), lambda lonlat: lonlat[:, ::-1])
    for plain in (list(degrees), degrees.to_numpy(), degrees.iloc[0], list(swapped)):
        with pytest.raises(CRSMismatchError, match="look like degrees"):
            plan_tracks(field, plain, crs=CRS, spacing_m=4.0)
    with pytest.raises(CRSMismatchError, match="swapped"):
        plan_tracks(field, gpd.GeoSeries(swapped, crs=4326), crs=CRS, spacing_m=4.0)
    elsewhere = gpd.GeoSeries([box(900, 0, 910, 10)], crs=CRS).to_crs(4326)
    assert plan_tracks(field, elsewhere, crs=CRS, spacing_m=4.0).gaps.empty


def test_spacing_wider_than_the_field() -> None:
    with pytest.warns(TrackWarning, match="no track"):
        tracks = plan_tracks(box(0, 0, 100, 10), crs=CRS, spacing_m=40.0)
    assert tracks.segments["length_m"].tolist() == pytest.approx([100.0])
    assert tracks.notes


@pytest.mark.parametrize(
    "wrong",
    [
        {"spacing_m": 0.0},
        {"spacing_m": float("nan")},
        {"spacing_m": 4.0, "step_m": -1.0},
        {"spacing_m": 4.0, "direction": "north"},
        {"spacing_m": 4.0, "direction": float("inf")},
        {"spacing_m": 4.0, "direction": [(X, Y), (X, Y)]},
        {"spacing_m": 4.0, "direction": [(X, Y)]},
        {"spacing_m": 4.0, "last_strip": "bend"},
        {"spacing_m": 4.0, "headland_m": 50.0},
        {"spacing_m": 4.0, "headland_m": -1.0},
        {"spacing_m": 4.0, "offset_m": float("nan")},
        {"spacing_m": 4.0, "offset_m": 1.0, "through": (X, Y)},
        {"spacing_m": 4.0, "through": (X, float("nan"))},
        {"spacing_m": 4.0, "through": "here"},
        {"spacing_m": 4.0, "through": (X,)},
        {"spacing_m": 4.0, "through": (15.0, 50.5)},
        {"spacing_m": 4.0, "through": shapely.Point()},
        {"spacing_m": 4.0, "direction": [(15.0, 50.5), (15.001, 50.5)]},
        {"spacing_m": 4.0, "min_segment_m": -1.0},
        {"spacing_m": 4.0, "min_segment_m": float("nan")},
        {"spacing_m": 4.0, "straight_tolerance_m": -1.0},
        {"spacing_m": 4.0, "straight_tolerance_m": float("nan")},
        {"spacing_m": 4.0, "clearance_m": -1.0},
        {"spacing_m": 4.0, "clearance_m": None},
        {"spacing_m": 4.0, "headland_m": "12"},
        {"spacing_m": 4.0, "obstacles": ["tree"]},
        {"spacing_m": 4.0, "obstacles": 3},
        {"spacing_m": 4.0, "grid": 3},
        {"spacing_m": 4.0, "edits": {}},
        {"spacing_m": 4.0, "outside": 3},
        {"spacing_m": 4.0, "outside": [(X, Y)]},
    ],
)
def test_bad_settings_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(TrackError):
        plan_tracks(box(0, 0, 100, 40), crs=CRS, **wrong)  # type: ignore[arg-type]


def test_points_follow_a_segment_that_a_person_bent() -> None:
    planned = plan_tracks(box(0, 0, 100, 8), crs=CRS, spacing_m=4.0, direction=90, step_m=10.0)
    bent = shapely.LineString(np.array([(0, 2), (30, 42), (100, 42)]) + np.array((X, Y)))
    dot = shapely.LineString([(X, Y), (X, Y)])
    segments = planned.segments.copy()
    segments["geometry"] = [bent, dot]
    points = replace(planned, segments=segments).points
    first = points[points["track_no"] == 1]
    assert shapely.distance(bent, first.geometry.to_numpy()).max() < 1e-6
    assert len(first) == 13  # 120 m along it, not 108 m from end to end
    assert np.isfinite(points[["lat", "lon"]].to_numpy()).all()
    figures = replace(planned, segments=segments).statistics
    strip = bent.buffer(2.0, cap_style="flat").intersection(planned.outline)
    assert figures.worked_ha == pytest.approx(strip.area / 1e4, rel=0.01)


def test_the_area_worked_by_ten_thousands_of_tracks_is_known_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """0.01 m typed as spacing held the review page for minutes, and again when it was opened anew.

    The first track, in the corner, is too short to tell the way of all.
    """
    corner: Any = Polygon([(X, Y), (X + 150, Y + 120.3), (X + 170, Y + 20)])
    tracks = plan_tracks(corner, crs=CRS, spacing_m=0.01, direction=17.3)
    assert len(tracks.lines) > 10_000
    monkeypatch.setattr(shapely, "union_all", None)  # it took the minutes
    assert tracks.statistics.coverage_percent == pytest.approx(100.0, abs=0.01)


def test_tips_of_sharp_corners_are_not_worked() -> None:
    spike: Any = Polygon([(X, Y), (X + 300, Y), (X, Y + 40)])
    tracks = plan_tracks(spike, crs=CRS, spacing_m=10.0, headland_m=10.0)
    lines = [*tracks.segments.geometry, *tracks.headland_tracks.geometry]
    near = shapely.union_all(shapely.buffer(np.array(lines), 5.0))
    share = 100.0 * near.intersection(spike).area / spike.area
    assert tracks.statistics.coverage_percent == pytest.approx(share, abs=1.0)


@pytest.mark.parametrize("spacing_m", [6.0, 7.0])
def test_passes_around_the_field_are_as_wide_as_the_machine(spacing_m: float) -> None:
    """Also where the straight tracks were moved together to fill the rest evenly."""
    tracks = plan_tracks(
        box(X, Y, X + 100, Y + 100),
        crs=CRS,
        spacing_m=spacing_m,
        headland_m=2 * spacing_m,
        last_strip="spread",
    )
    assert tracks.spacing_m < spacing_m - 0.1
    assert tracks.statistics.coverage_percent == pytest.approx(100.0, abs=1e-6)


def test_a_headland_that_passes_do_not_fill_is_told() -> None:
    field = box(X, Y, X + 100, Y + 100)
    with pytest.warns(TrackWarning, match=r"4 passes of 3 m and leaves a strip of 2\.00 m"):
        tracks = plan_tracks(field, crs=CRS, spacing_m=3.0, headland_m=14.0)
    assert "12 m or 15 m would leave none" in tracks.notes[0]
    assert tracks.statistics.coverage_percent < 95.0
    for headland_m in (2.0, 3.0, 15.0):  # narrower than one pass, one, five
        assert not plan_tracks(field, crs=CRS, spacing_m=3.0, headland_m=headland_m).notes


def test_a_headland_of_more_passes_than_anybody_drives_is_refused() -> None:
    """Of 9 500 passes it came to an end after a minute."""
    with pytest.raises(TrackError, match=r"would take 1,050 passes of 0\.02 m; 1,000 are the most"):
        plan_tracks(box(0, 0, 100, 60), crs=CRS, spacing_m=0.02, headland_m=21.0)


@pytest.mark.parametrize("offset_m", [-1.0, np.nan, 121.0])
def test_an_offset_outside_the_field_is_refused(offset_m):
    """It was taken modulo the spacing: the first track lay where nobody had said."""
    with pytest.raises(TrackError, match="offset"):
        plan_tracks(box(0, 0, 200, 120), crs=CRS, spacing_m=6.0, offset_m=offset_m)


@pytest.mark.parametrize("name", ["spacing_m", "width_m", "offset_m", "step_m", "min_segment_m"])
def test_words_for_lengths_are_refused_by_name(name):
    lengths: Any = {"spacing_m": 6.0, name: "6"}
    with pytest.raises(TrackError, match=f"{name} is '6'; it must be"):
        plan_tracks(box(0, 0, 200, 120), crs=CRS, **lengths)


def test_words_for_a_radius_are_refused():
    trees = gpd.GeoDataFrame(
        {"radius_m": ["3", "4,5"]}, geometry=[box(9, 9, 10, 10), box(50, 50, 51, 51)], crs=CRS
    )
    with pytest.raises(ObstacleError, match="radius_m holds words, as '4,5'"):
        plan_tracks(box(0, 0, 200, 120), trees, crs=CRS, spacing_m=6.0)


def test_passes_that_overlap_by_more_than_half_stay_inside():
    """One more track lay 1 m from the border: a machine of 6 m reached 2 m beyond it."""
    tracks = plan_tracks(box(0, 0, 200, 120), crs=CRS, spacing_m=2.0, width_m=6.0)
    across = np.sort(tracks.lines.bounds.miny.to_numpy()) - Y
    assert across == pytest.approx(np.arange(3.0, 118.0, 2.0))


@pytest.mark.parametrize(("first_m", "nearest_m"), [(1.0, 1.0), (3.0, 3.0), (5.0, 3.0)])
def test_a_given_first_track_is_there_however_passes_overlap(first_m, nearest_m):
    tracks = plan_tracks(box(0, 0, 200, 120), crs=CRS, spacing_m=2.0, width_m=6.0, offset_m=first_m)
    # The longest edge, from which the first is counted, is the upper one.
    across = np.sort(Y + 120.0 - tracks.lines.bounds.miny.to_numpy())
    assert np.isclose(across, first_m).any()
    assert across[0] == pytest.approx(nearest_m)
    assert across[-1] == pytest.approx(117.0)


def test_a_place_to_pass_through_is_passed_however_passes_overlap():
    tracks = plan_tracks(
        box(0, 0, 200, 120), crs=CRS, spacing_m=2.0, width_m=6.0, through=(X + 50, Y + 119.5)
    )
    assert (np.abs(tracks.lines.bounds.maxy - Y - 119.5) < 1e-6).any()


def test_a_step_that_fills_the_disk_is_refused_with_one_that_does_not():
    with pytest.raises(TrackError, match="10,000,000 are the most") as refused:
        plan_tracks(box(0, 0, 200, 120), crs=CRS, spacing_m=6.0, step_m=1e-4)
    step_m = float(refused.value.hint.split()[-2])
    tracks = plan_tracks(box(0, 0, 200, 120), crs=CRS, spacing_m=6.0, step_m=step_m)
    assert len(tracks.lines) == 20


@pytest.mark.parametrize("direction", ["dominant", "longest_edge", "fewest", "fewest_turns"])
def test_a_ring_may_begin_anywhere_and_run_either_way(direction: str) -> None:
    """Of a rectangle two edges are the longest, of a round field none is."""
    plain, round_field = box(0, 0, 97, 61.3), shapely.Point(X, Y).buffer(60, quad_segs=90)
    for field in (plain, affinity.rotate(plain, 20), round_field):
        ring = shapely.get_coordinates(field)[:-1]
        rings = [np.roll(each, n, axis=0) for n in range(4) for each in (ring, ring[::-1])]
        one, *others = (
            plan_tracks(Polygon(each), crs=CRS, spacing_m=4, direction=direction).segments.geometry
            for each in rings
        )
        assert all(len(each) == len(one) for each in others)
        assert all(each.geom_equals_exact(one, 1e-4).all() for each in others)


def test_fields_as_tables_of_other_programs_have_them():
    """Many programs write all outlines as shapes of several parts, one in each."""
    shape = shapely.box(X, Y, X + 200, Y + 100)
    parts: Any = shapely.MultiPolygon([shape])
    one = Field(parts, CRS)
    assert one == Field(shape, CRS)
    parts = shapely.MultiPolygon([shape, shapely.box(X, Y + 200, X + 9, Y + 209)])
    with pytest.raises(FieldError, match="Of 2 parts each is a field"):
        Field(parts, CRS)
    table: Any = gpd.GeoDataFrame(geometry=[shape], crs=CRS)
    with pytest.raises(TrackError, match="a shapely polygon, not GeoDataFrame"):
        plan_tracks(table, spacing_m=10)


@pytest.mark.parametrize("clearance_m", [1e30, 1001.0])
def test_a_clearance_beyond_everything_is_told_as_that(clearance_m: float) -> None:
    """It was told of too narrow a spacing."""
    with pytest.raises(TrackError, match=r"A clearance of \S+ m is above 1000 m"):
        plan_tracks(box(0, 0, 100, 60), crs=CRS, spacing_m=4.0, clearance_m=clearance_m)


def test_an_obstacle_larger_than_the_field_leaves_nothing() -> None:
    tree = gpd.GeoDataFrame({"radius_m": [1e12]}, geometry=[shapely.Point(X, Y)], crs=CRS)
    with pytest.warns(TrackWarning, match="covers the field"):
        tracks = plan_tracks(box(0, 0, 100, 60), tree, crs=CRS, spacing_m=4.0)
    assert len(tracks.segments) == 0


@pytest.mark.parametrize(("name", "value"), [("radius_m", -1.0), ("buffer_m", np.inf)])
def test_a_point_of_no_possible_size_is_refused_as_a_polygon_is(name: str, value: float) -> None:
    """A margin of -1 m made the tree smaller, an endless one covered all."""
    sizes = {"radius_m": [3.0], "buffer_m": [1.0], name: [value]}
    tree = gpd.GeoDataFrame(sizes, geometry=[shapely.Point(X + 50, Y + 30)], crs=CRS)
    with pytest.raises(ObstacleError, match="negative or infinite"):
        plan_tracks(box(0, 0, 100, 60), tree, crs=CRS, spacing_m=4.0)


def test_a_machine_wider_than_the_field_is_told_by_its_width() -> None:
    with pytest.warns(TrackWarning, match="The machine's width of 500 m leaves no track"):
        plan_tracks(box(0, 0, 100, 60), crs=CRS, spacing_m=4.0, width_m=500.0)


def test_obstacles_without_a_number_have_the_next_ones() -> None:
    obstacles = gpd.GeoDataFrame(
        {"obstacle_no": [None, 7, None]},
        geometry=[box(x, 9, x + 8, 17) for x in (30, 90, 150)],
        crs=CRS,
    )
    planned = plan_tracks(box(0, 0, 200, 60), obstacles, crs=CRS, spacing_m=6, direction=90)
    assert planned.gaps["obstacle_no"].tolist() == [8, 7, 9] * 2


def test_an_obstacle_of_the_number_0_is_named_as_the_cause_of_its_gaps() -> None:
    trees = gpd.GeoDataFrame(
        {"obstacle_no": [0, 1]}, geometry=[box(50, 9, 58, 17), box(150, 9, 158, 17)], crs=CRS
    )
    planned = plan_tracks(box(0, 0, 200, 25), trees, crs=CRS, spacing_m=4.0, direction=90.0)
    assert planned.gaps["obstacle_no"].tolist() == [0, 1] * 2
    assert set(planned.gaps["cause"]) == {"obstacle 0", "obstacle 1"}
