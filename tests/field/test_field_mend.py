"""Further points correct the outline that was there: locally, and without losing its ground."""

import warnings
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import shapely
from affine import Affine
from pyproj import CRS
from shapely import box

from geofield.field import extract_field, prepare_field
from geofield.field.frame import Frame, covered
from geofield.field.likely import likeliest
from geofield.field.mend import forced, mended
from geofield.field.outline import straight_outline
from geofield.field.points import drawn, obeys
from geofield.field.ranking import log_odds
from geofield.field.refine import carried
from geofield.field.said import Said
from geofield.field.search import search_field
from geofield.field.straight import ring
from geofield.grid import Grid
from geofield.model.scene import Scene
from geofield.simulate import SimulationSettings, simulate_field

SQUARE = box(40, 40, 120, 120)
FRAME = Frame((160, 160))


def overlap(a, b):
    return a.intersection(b).area / a.union(b).area


def outline_of(field, include, exclude, search=None):
    """The outline in pixels, of points in pixels."""
    scene = field.scene
    belong, apart = ([scene.grid.to_lonlat(*one) for one in some] for some in (include, exclude))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = extract_field(
            scene, lat=field.lat, lon=field.lon, include=belong, exclude=apart, search=search
        )
    return found.polygon_px(scene.grid)


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
    found = [one for one in mended(SQUARE, *said, FRAME) if obeys(one, *said)]
    assert max(overlap(one, truth) for one in found) > 0.97
    assert overlap(SQUARE, truth) < 0.965


def test_a_side_does_not_leave_the_picture_and_an_obeyed_point_moves_none():
    inside = (80.0, 80.0), (100.0, 60.0)
    assert mended(SQUARE, inside, [(10.0, 10.0)], FRAME) == []
    wide = Frame((150, 200))
    for point in ((190.0, 80.0), (80.0, 145.0)):
        found = mended(SQUARE, [inside[0], point], [], wide)
        assert found
        assert all(box(0, 0, 200, 150).covers(one) for one in found)


def test_a_first_correction_moves_a_side_and_details_give_way_at_a_point_too():
    seed, beyond = (80.0, 80.0), (124.0, 80.0)
    first = mended(SQUARE, [seed, beyond], [], FRAME)
    assert min(one.symmetric_difference(SQUARE).area for one in first) > 80 * 3, "no mere strip"
    later = mended(SQUARE, [seed, beyond], [(20.0, 20.0), (20.0, 140.0)], FRAME)
    assert min(one.symmetric_difference(SQUARE).area for one in later) < 20
    # Sides that move beyond the point would cross others: it gives way or bends at once.
    beside = [(124.0, y) for y in (50.0, 65.0, 95.0, 110.0)]
    only = mended(SQUARE, [seed, beyond], beside, FRAME)
    assert only
    assert all(obeys(one, [seed, beyond], beside) for one in only)
    assert max(one.symmetric_difference(SQUARE).area for one in only) < 80 * 8


def test_a_side_is_bent_at_a_point_where_a_person_is_at_details():
    seed, beyond = (80.0, 80.0), (124.0, 80.0)
    truth = SQUARE.union(shapely.Polygon([(120, 40), (128, 80), (120, 120)]))
    away = [(20.0, 20.0), (20.0, 140.0)]
    best = max(overlap(one, truth) for one in mended(SQUARE, [seed, beyond], away, FRAME))
    assert best > 0.99
    # With fewer points a whole side is meant, and near its end it is turned.
    first = mended(SQUARE, [seed, beyond], [], FRAME)
    assert max(overlap(one, truth) for one in first) < 0.98
    for near_end in ((124.0, 42.0), (124.0, 118.0)):
        corner = mended(SQUARE, [seed, near_end], away, FRAME)
        assert all(len(one.exterior.coords) != 6 for one in corner)


def test_an_outline_is_drawn_as_exactly_as_its_points_need():
    mask = np.zeros((160, 160), bool)
    mask[40:120, 40:120] = True
    mask[40:42, 70:90] = False  # a notch that a rough outline passes over
    seed, notch = (80.0, 80.0), (80.0, 40.9)
    truth = box(40, 40, 120, 120).difference(box(70, 40, 90, 42))
    draw = partial(straight_outline, mask)
    assert len(drawn(draw, (3.0, 1.0), [seed], []).exterior.coords) == 5
    exact = drawn(draw, (3.0, 1.0), [seed], [notch])
    assert obeys(exact, [seed], [notch])
    assert overlap(exact, truth) > 0.98
    assert not obeys(drawn(draw, (3.0, 1.0), [seed], [(60.0, 60.0)]), [seed], [(60.0, 60.0)])


def test_a_side_does_not_move_onto_a_border_across_a_point():
    bands = np.full((3, 160, 160), 90, np.uint8)
    bands[:, 40:120, 40:120] = 160
    bands += np.random.default_rng(0).integers(0, 6, bands.shape, dtype=np.uint8)
    grid = Grid(160, 160, Affine(0.6, 0, 4e5, 0, -0.6, 4e6), CRS.from_epsg(32636))
    scene = Scene(grid, bands, ("red", "green", "blue"), np.ones((160, 160), bool))
    inner, seed, said = box(40, 40, 118.2, 120), (80.0, 80.0), (119.2, 80.0)
    free, held = (carried(scene, [inner], 1, [seed], away)[0] for away in ((), [said]))
    assert free[80, 119], "without the point it moves onto the border"
    assert not held[80, 119]
    assert held[80, 117]


def test_points_close_to_each_other_are_no_error_in_a_reduced_picture():
    """1.2 px apart at a third of the size: the outline of the whole picture holds one of them."""
    large = simulate_field(4, SimulationSettings(width_px=1200, height_px=1200))
    scene = large.scene
    x, y = (float(v) for v in scene.grid.from_lonlat(large.lon, large.lat))
    include, exclude = (x + 90.0, y), (x + 91.2, y)
    outline = outline_of(large, [include], [exclude])
    assert shapely.contains_xy(outline, *include)
    assert not shapely.contains_xy(outline, *exclude)
    assert overlap(outline, large.field.polygon_px(scene.grid)) > 0.8


def test_what_the_points_say_is_told_of_each_outline():
    likely = np.full((160, 160), 0.1, np.float32)
    likely[40:120, 40:120] = 0.9
    square, picture = SQUARE, box(0, 0, 160, 160)
    before, whole = (covered(ring(one), likely.shape) for one in (square, picture))
    said = Said(likely, ((45.0, 80.0),), before)
    same, other = said.figures(square, before), said.figures(picture, whole)
    assert [same["kept"], other["kept"]] == pytest.approx([1.0, 0.25], abs=0.01)
    assert (same["clearance"], other["clearance"]) == (5.0, 12.0)
    assert (same["corrections"], other["corrections"]) == (1.0, 1.0)
    # Pixel by pixel: what the square holds of all that is likely.
    area, everywhere = float(before.sum()), float(likely.sum())
    common = float(likely[before > 0].sum())
    share = common / (area + everywhere - common)
    assert same["network_overlap"] == pytest.approx(float(log_odds(share)), abs=0.02)
    assert same["network_overlap"] > other["network_overlap"]
    assert same["network_missed"] == pytest.approx(1 - common / everywhere, abs=0.01)
    assert other["network_missed"] == pytest.approx(0.0, abs=1e-6)
    right = np.where(before > 0, likely, 1 - likely)
    fit = np.log(0.02 - np.log(right).sum() / area)
    assert same["network_fit_of_area"] == pytest.approx(fit, abs=0.02)
    assert same["network_fit_of_area"] < other["network_fit_of_area"]
    first = Said(likely).figures(square, before)
    assert (first["kept"], first["clearance"], first["corrections"]) == (1.0, 12.0, 0.0)


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
        (include if number % 2 else exclude).append((at.x, at.y))
        outline = outline_of(field, include, exclude, search)
        found.append(overlap(outline, truth))
    assert min(found) > 0.94, np.round(found, 2)


def test_points_given_at_once_are_taken_one_after_the_other(field):
    """The same points, asked of a fresh search: the outline that a person saw."""
    scene = field.scene
    search = prepare_field(scene, lat=field.lat, lon=field.lon)
    inner = field.field.polygon_px(scene.grid).buffer(-4).exterior
    exclude = tuple(shapely.get_coordinates(inner)[[1, 3]].tolist())
    exclude = tuple((x, y) for x, y in exclude)
    for count in range(3):
        one_by_one = outline_of(field, [], exclude[:count], search)
    fresh = prepare_field(scene, lat=field.lat, lon=field.lon)
    assert outline_of(field, [], exclude, fresh).equals(one_by_one)


def test_a_point_corrects_the_outline_that_was_shown(field, monkeypatch):
    """Not the one with the best score: nobody has seen that."""
    shown, corrected = [], []

    def worst(found, ranking):
        assert len(found) > 1
        shown.append(found[-1].polygon)
        return replace(likeliest(found, ranking), candidate=found[-1])

    def said(likely, points, before):
        corrected.append(before)
        return Said(likely, points, before)

    monkeypatch.setattr("geofield.field.search.likeliest", worst)
    monkeypatch.setattr("geofield.field.search.Said", said)
    place = field.scene.pixel_of(lat=field.lat, lon=field.lon)
    search = search_field(field.scene, *place)
    inner = field.field.polygon_px(field.scene.grid).buffer(-4).exterior.coords[1]
    search.answer((), (search.place(*inner),))
    first, second = corrected
    assert first is None
    assert np.array_equal(second, covered(ring(shown[0]), second.shape))


def test_a_strip_to_a_point_far_off_is_the_last_resort():
    """Ground elsewhere, joined to the point by a strip, was taken where .95 had been right."""
    seed, details = (20.0, 20.0), [(45.0, 45.0), (60.0, 60.0)]
    found = mended(SQUARE, [seed, *details], [(119.0, 80.0)], FRAME)
    assert not any(one.contains(box(60, 60, 100, 100)) and one.area < 6500 for one in found)
    (strip,) = forced(SQUARE, [seed, *details], [(119.0, 80.0)])
    assert strip.contains(shapely.Point(seed))
    assert SQUARE.area < strip.area + 40 < SQUARE.area + 120
    # Beside the border it is a detail.
    near = mended(SQUARE, [(60.0, 60.0), *details], [(119.0, 80.0)], FRAME)
    assert any(0 < SQUARE.area - one.area < 40 for one in near)
