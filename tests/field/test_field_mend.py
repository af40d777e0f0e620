"""Further points correct the outline that was there: locally, and without losing its ground."""

import warnings

import numpy as np
import pytest
import shapely
from shapely import box

from geofield.field import extract_field, prepare_field
from geofield.field.mend import drawn, mended
from geofield.field.points import obeys
from geofield.field.said import Said
from geofield.simulate import SimulationSettings, simulate_field

SQUARE = box(40, 40, 120, 120)


def overlap(a, b):
    return a.intersection(b).area / a.union(b).area


@pytest.mark.parametrize(
    ("point", "truth"),
    [
        ((124.0, 80.0), box(40, 40, 128, 120)),
        ((80.0, 35.0), box(40, 30, 120, 120)),
        ((118.0, 60.0), box(40, 40, 116, 120)),
        # A side that was turned about one end.
        ((124.0, 105.0), shapely.Polygon([(40, 40), (120, 40), (130, 120), (40, 120)])),
        ((105.0, 116.0), shapely.Polygon([(40, 40), (120, 40), (120, 110), (40, 120)])),
    ],
)
def test_the_side_beside_a_point_moves_or_turns_beyond_it(point, truth):
    belongs = not SQUARE.contains(shapely.Point(point))
    said = ([(80.0, 80.0), point], []) if belongs else ([(80.0, 80.0)], [point])
    found = [one for one in mended(SQUARE, *said, (160, 160)) if obeys(one, *said)]
    assert max(overlap(one, truth) for one in found) > 0.97
    assert overlap(SQUARE, truth) < 0.965


def test_a_side_does_not_leave_the_picture_and_an_obeyed_point_moves_none():
    inside = (80.0, 80.0), (100.0, 60.0)
    assert mended(SQUARE, inside, [(10.0, 10.0)], (160, 160)) == []
    found = mended(SQUARE, [inside[0], (150.0, 80.0)], [], (160, 160))
    assert found
    assert all(box(0, 0, 160, 160).covers(one) for one in found)


def test_a_region_is_drawn_as_exactly_as_its_points_need():
    mask = np.zeros((160, 160), bool)
    mask[40:120, 40:120] = True
    mask[40:42, 70:90] = False  # a notch that a rough outline passes over
    seed, notch = (80.0, 80.0), (80.0, 40.9)
    assert len(drawn(mask, [seed], []).exterior.coords) == 5
    exact = drawn(mask, [seed], [notch])
    assert obeys(exact, [seed], [notch])
    assert overlap(exact, box(40, 40, 120, 120).difference(box(70, 40, 90, 42))) > 0.98


def test_points_close_to_each_other_are_no_error_in_a_reduced_picture():
    """1.2 px apart at a third of the size: the outline of the whole picture holds one of them."""
    large = simulate_field(4, SimulationSettings(width_px=1200, height_px=1200))
    scene = large.scene
    x, y = (float(v) for v in scene.grid.from_lonlat(large.lon, large.lat))
    include, exclude = (x + 90.0, y), (x + 91.2, y)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        field = extract_field(
            scene,
            lat=large.lat,
            lon=large.lon,
            include=[scene.grid.to_lonlat(*include)],
            exclude=[scene.grid.to_lonlat(*exclude)],
        )
    outline = field.polygon_px(scene.grid)
    assert shapely.contains_xy(outline, *include)
    assert not shapely.contains_xy(outline, *exclude)
    assert overlap(outline, large.field.polygon_px(scene.grid)) > 0.8


def test_what_the_points_say_is_told_of_each_outline():
    size = np.array([10.0, 20.0, 30.0])
    said = Said(np.array([0.9, 0.8, 0.1]), size, ((45.0, 80.0),), np.array([True, True, False]))
    both = [np.array([True, True, False]), np.array([True, False, True])]
    same, other = said.figures([SQUARE, box(0, 0, 160, 160)], both)
    assert [same["kept"], other["kept"]] == pytest.approx([1.0, 10 / 60])
    assert (same["clearance"], other["clearance"]) == (5.0, 12.0)
    assert same["network_overlap"] > other["network_overlap"]
    first = Said(np.array([0.9, 0.8, 0.1]), size).figures([SQUARE], both[:1])[0]
    assert (first["kept"], first["clearance"]) == (1.0, 12.0)


@pytest.fixture(scope="module", params=[11, 29])
def field(request):
    return simulate_field(request.param, SimulationSettings(width_px=320, height_px=320))


def test_points_that_move_the_border_a_little_do_not_lose_the_field(field):
    """Ground 3 px inside the border does not belong, ground 3 px outside does, by turns."""
    scene = field.scene
    truth = field.field.polygon_px(scene.grid)
    ring = shapely.segmentize(truth.exterior, 1.0)
    search = prepare_field(scene, lat=field.lat, lon=field.lon)
    include: list[tuple[float, float]] = []
    exclude: list[tuple[float, float]] = []
    found = []
    for number, share in enumerate(np.linspace(0.04, 0.5, 8)):
        place = shapely.line_interpolate_point(ring, share, normalized=True)
        line = truth.buffer(3 if number % 2 else -3).exterior
        at = line.interpolate(line.project(place))
        (include if number % 2 else exclude).append(scene.grid.to_lonlat(at.x, at.y))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            outline = extract_field(
                scene, lat=field.lat, lon=field.lon, include=include, exclude=exclude, search=search
            ).polygon_px(scene.grid)
        found.append(overlap(outline, truth))
    assert min(found) > 0.95, np.round(found, 2)


def test_points_given_at_once_are_taken_one_after_the_other(field):
    """The same points, asked of a fresh search: the outline that a person saw."""
    scene = field.scene
    search = prepare_field(scene, lat=field.lat, lon=field.lon)
    inner = field.field.polygon_px(scene.grid).buffer(-4).exterior
    exclude = tuple(shapely.get_coordinates(inner)[[1, 3]].tolist())
    exclude = tuple((x, y) for x, y in exclude)
    for count in range(3):
        one_by_one = search.candidates((), exclude[:count])
    fresh = prepare_field(scene, lat=field.lat, lon=field.lon)
    assert fresh.candidates((), exclude)[0].polygon.equals(one_by_one[0].polygon)
