"""Tracks that a person drew: cut by what stands in them, and by nothing else."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely

from geofield.errors import TrackWarning
from geofield.model.track_edits import TrackEdit, TrackEdits
from geofield.model.tracks import Tracks
from geofield.tracks import plan_tracks

CORNER = np.array([500_000.0, 5_600_000.0])
RADIUS = 3.0
HOW: Any = {
    "crs": "+proj=tmerc +lon_0=15 +k=1 +x_0=500000 +datum=WGS84 +units=m",
    "spacing_m": 10.0,
    "direction": 90,
}


def tracks_with(drawn: list[Any], circles: list[tuple[float, float]]) -> Tracks:
    """Tracks of a hectare with lines drawn, and circles in it."""
    edits = tuple(
        TrackEdit(7, drawn=shapely.MultiLineString([CORNER + line]).wkt) for line in drawn
    )
    return plan_tracks(
        moved(shapely.box(0, 0, 100, 100)),
        [moved(shapely.Point(one).buffer(RADIUS, quad_segs=64)) for one in circles],
        edits=TrackEdits(edits),
        **HOW,
    )


def moved(shape: Any) -> Any:
    """A shape to where the field is."""
    return shapely.transform(shape, lambda xy: xy + CORNER)


@pytest.mark.parametrize(
    ("line", "circle", "expected_m"),
    [
        ([(10, 20), (60, 20), (60, 60), (40, 60), (40, 10), (90, 10)], (80, 10), [197, 7]),
        ([(10, 20), (60, 20), (20, 20), (20, 80)], (20, 60), [127, 17]),
        ([(10, 10), (60, 10), (60, 60), (10, 60), (10, 10)], (60, 40), [77, 117]),
        ([(10, 20), (30, 20), (30, 20), (30, 90), (30, 10)], (30, 60), [57, 54, 47]),
        ([(10, 20), (50, 20), (90, 20)], (50, 20), [37, 37]),
        ([(-30, 20), (90, 20)], (50, 20), [47, 37]),
    ],
    ids=["crossing itself", "there and back", "a ring", "back through it", "a corner", "border"],
)
def test_a_drawn_track_is_driven_along_it_up_to_what_stands_there(
    line: Any, circle: tuple[float, float], expected_m: list[float]
) -> None:
    tracks = tracks_with([line], [circle])
    mine = tracks.segments[tracks.segments["track_no"] == 11]
    assert mine["length_m"].tolist() == pytest.approx(expected_m, abs=0.01)
    begin = shapely.get_coordinates(mine.geometry.to_numpy()[0])[0] - CORNER
    assert begin == pytest.approx(np.clip(line[0], 0, 100), abs=1e-6)
    whole = shapely.LineString(CORNER + line)
    assert all(whole.buffer(1e-6).covers(each) for each in mine.geometry)
    gaps = tracks.gaps[tracks.gaps["track_no"] == 11]
    assert gaps["cause"].tolist() == ["obstacle 1"] * (len(expected_m) - 1)


@pytest.mark.parametrize("circles", [[], [(60, 0)]], ids=["nothing there", "beside it"])
def test_a_gap_is_due_to_what_the_line_left_out_of_it_meets(
    circles: list[tuple[float, float]],
) -> None:
    tracks = tracks_with([[(50, 40), (50, -20), (70, -20), (70, 40)]], circles)
    gaps = tracks.gaps[tracks.gaps["track_no"] == 11]
    assert gaps["length_m"].tolist() == pytest.approx([20.0])
    assert gaps["cause"].tolist() == ["border"]


def test_what_an_obstacle_costs_a_drawn_line_is_told() -> None:
    # Beside the first, through two that overlap, and out of the field to the last.
    line = [(60, 50), (20, 50), (20, 40), (60, 40), (60, 95), (-30, 95)]
    circles = [(40.0, 45.0), (60.0, 70.0), (60.0, 74.0), (-10.0, 95.0)]
    before, after = (tracks_with(drawn, circles) for drawn in ([], [line]))
    lost_m = [one.length_m for one in after.losses]
    more_m = np.array(lost_m) - [one.length_m for one in before.losses]
    assert more_m.tolist() == pytest.approx([0, 5, 5, 0], abs=1e-2)
    whole_m = after.segments["length_m"].sum() + sum(lost_m)
    percent = [one.percent for one in after.losses]
    assert percent == pytest.approx([100 * each / whole_m for each in lost_m])


def test_added_tracks_are_numbered_on_without_a_gap() -> None:
    tracks = tracks_with([[(10, 12), (90, 12)], [(10, 14), (90, 14)], [(10, 16), (90, 16)]], [])
    assert tracks.lines["track_no"].tolist() == list(range(1, 14))


def test_a_track_that_was_beyond_the_border_for_a_while_is_drawn_among_the_others_again() -> None:
    """The plan failed where a later one had stayed in use: they came in another order."""
    field, smaller = shapely.box(0, 0, 100, 100), shapely.box(0, 0, 100, 70)
    planned = plan_tracks(moved(field), **HOW)
    # The half of each, turned a little.
    bent = [
        shapely.LineString([line.coords[0], line.centroid.coords[0] + np.array((0, 2))])
        for line in planned.segments.geometry
    ]
    edited = replace(
        planned, written=planned._written(), segments=planned.segments.set_geometry(bent)
    )
    edits = edited.edits_since(planned.edits)
    whole = plan_tracks(moved(field), edits=edits, **HOW)
    with pytest.warns(TrackWarning, match="3 tracks that you edited are of another layout"):
        fewer = plan_tracks(moved(smaller), edits=edits, **HOW)
    again = plan_tracks(moved(field), edits=fewer.edits, **HOW)
    assert len(again.lines) == 10
    assert again.lines.equals(whole.lines)
    assert again.segments.equals(whole.segments)
