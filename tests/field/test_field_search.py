"""The steps of the default method, each alone: clearing, redrawing, measuring, aligning."""

import numpy as np
import pytest
import shapely
from shapely import Polygon, box

from geofield.field.answer import network_outlines
from geofield.field.border import measure
from geofield.field.clearing import clear
from geofield.field.frame import Frame
from geofield.field.morphology import filled, inner, plump
from geofield.field.ranking import expected_overlaps
from geofield.field.refine import aligned
from geofield.field.search import open_ground

FRAME = Frame((160, 160))


def overlap(a, b):
    return a.intersection(b).area / a.union(b).area


def picture(shape=(160, 160), seed=0):
    """Three channels of noise as whitened channels have it."""
    return np.random.default_rng(seed).normal(0, 0.4, (3, *shape)).astype(np.float32)


def disc(shape, x, y, radius):
    row, column = np.indices(shape)
    return np.hypot(row + 0.5 - y, column + 0.5 - x) < radius


def test_a_crown_inside_a_surface_gives_way_and_one_on_a_border_stays():
    stack = picture()
    stack[0, :, 80:] += 12  # another field
    inside, border = disc((160, 160), 40, 60, 6), disc((160, 160), 80, 120, 6)
    stack[1, inside | border] -= 15
    cleared, things = clear(stack, 0.6)
    assert things[inside].mean() > 0.9
    assert not things[border].any()
    assert abs(cleared[1][inside].mean()) < 1
    assert np.array_equal(cleared[:, border], stack[:, border])
    assert (cleared[0, :, 90:].mean() - cleared[0, :, :70].mean()) == pytest.approx(12, abs=0.2)


def test_paint_does_not_bridge_a_border_that_a_crown_touches():
    stack = picture()
    field = np.zeros((160, 160), bool)
    field[:80, 80:] = True
    stack[0, field] += 12
    crown = disc((160, 160), 78, 82, 8)  # at the field's corner, mostly outside it
    stack[1, crown] -= 25
    cleared, things = clear(stack, 0.6)
    assert things[crown].mean() > 0.8
    painted = cleared[0][crown]
    assert np.abs(painted).max() < 3, "between the two surfaces"
    beside = field & ~disc((160, 160), 78, 82, 13)
    assert np.abs(cleared[0][beside] - 12).max() < 3


def test_a_road_does_not_give_way():
    stack = picture()
    stack[:, :, 70:76] += 10
    cleared, things = clear(stack, 0.6)
    assert not things.any()
    assert cleared is stack


def test_a_field_full_of_crowns_stays_whole():
    stack = picture((200, 200))
    stack[0, 30:170, 30:170] += 8
    for x in range(40, 170, 14):  # two rows of crowns from side to side
        stack[1, disc((200, 200), x, 90, 6) | disc((200, 200), x, 104, 6)] -= 20
    cleared, things = clear(stack, 0.6)
    crowns = stack[1] < -10
    assert things[crowns].mean() > 0.9
    left = np.abs(cleared[1]) > 3
    assert left.sum() < 0.1 * crowns.sum()
    assert np.abs(cleared[0, 40:160, 40:160] - 8).max() < 3


def test_a_point_on_a_crown_stands_on_the_nearest_open_ground():
    crown = disc((160, 160), 75, 60, 5)
    x, y = open_ground(crown, (78.5, 60.5))
    assert 5 <= np.hypot(x - 75, y - 60) < 6.5
    assert x > 78
    assert open_ground(crown, (20.5, 60.5)) == (20.5, 60.5)
    # Nothing but a crown as far as is looked: it stays.
    assert open_ground(np.ones((160, 160), bool), (78.5, 60.5)) == (78.5, 60.5)


def layers(stack):
    return np.ascontiguousarray(np.moveaxis(stack, 0, -1))


def test_figures_tell_a_border_from_none():
    stack = picture()
    stack[0, 40:120, 40:120] += 10
    on, off = (
        measure(layers(stack), box(*corners), FRAME)
        for corners in ((40, 40, 120, 120), (30, 30, 130, 130))
    )
    assert on["strength_25_above_inside"] > np.log(5) > off["strength_50_above_inside"] + 1
    assert on["inside_95_above_border"] < -1 < 0 < off["inside_95_above_border"]
    assert (on["vertices"], on["long_sides_share"]) == (np.log(4), 1.0)
    comb = [(40.0, 40.0), (40.0, 120.0), (120.0, 120.0), (120.0, 40.0)]
    for x in range(110, 45, -8):
        comb += [(x, 40.0), (x, 48.0), (x - 4.0, 48.0), (x - 4.0, 40.0)]
    assert measure(layers(stack), Polygon(comb), FRAME)["long_sides_share"] < 0.75
    assert measure(layers(stack), box(50, 50, 60, 60), FRAME) is None
    # Where the picture ends nothing is asked of it.
    framed = measure(layers(stack), box(0, 40, 120, 120), FRAME)
    assert framed["strength_50_above_inside"] > 1
    assert measure(layers(stack), box(0, 0, 160, 160), FRAME) is None


def test_figures_do_not_depend_on_the_direction_of_the_ring():
    stack = picture()
    stack[0, 40:120, 40:120] += 10
    outline = box(38, 40, 120, 119)
    again = Polygon(outline.exterior.coords[::-1])
    one, other = (measure(layers(stack), each, FRAME) for each in (outline, again))
    assert one == pytest.approx(other, abs=0.05)


def test_sides_move_onto_the_border():
    stack = picture()
    truth = Polygon([(30, 40), (118, 28), (130, 120), (44, 131)])
    row, column = np.indices((160, 160)) + 0.5
    stack[0, shapely.contains_xy(truth, column, row)] += 10
    crooked = Polygon([(31.5, 38), (116, 29.5), (131.5, 118.5), (42.5, 132.5)])
    found = aligned(crooked, np.moveaxis(stack, 0, -1).copy(), 3.0, FRAME)
    assert overlap(crooked, truth) < 0.965
    assert overlap(found, truth) > 0.985
    assert len(found.exterior.coords) == 5


def test_a_side_beside_the_frame_is_the_frame():
    stack = picture()
    stack[0, 40:120] += 10
    beside = Polygon([(2, 41), (158, 39), (157.8, 121), (1.5, 119)])
    found = aligned(beside, np.moveaxis(stack, 0, -1).copy(), 2.0, FRAME)
    assert found.bounds[::2] == (0, 160)
    assert overlap(found, box(0, 40, 160, 120)) > 0.98


def test_the_choice_prefers_what_others_agree_with():
    small, large = box(0, 0, 100, 100), box(0, 0, 100, 104)
    lone = box(0, 0, 30, 30)
    scores = np.array([0.1, 0.0, -0.2])
    belief, expected, overlap = expected_overlaps([lone, small, large], scores)
    assert belief.sum() == pytest.approx(1)
    assert int(np.argmax(expected)) == 1
    assert 0.5 < expected[1] < 0.9
    assert overlap[1, 2] == pytest.approx(100 / 104, abs=0.02)
    _, expected, _ = expected_overlaps([lone, small, large], 50 * scores)
    assert int(np.argmax(expected)) == 0, "scores taken far beyond their word"
    assert expected[0] > 0.95


def test_only_what_touches_no_border_is_a_hole():
    field = np.zeros((60, 80), bool)
    field[10:60, 10:70] = True
    things = np.zeros_like(field)
    things[20:25, 20:25] = things[8:14, 40:45] = things[57:60, 30:33] = things[40, 20:60] = True
    holes = inner(things, field)
    assert holes[20:25, 20:25].all()
    assert holes[40, 20:60].all()
    assert holes.sum() == 25 + 40  # neither that on the border nor that on the picture's edge
    assert plump(holes).sum() == 25
    assert np.array_equal(filled(field & ~holes), field)


def test_what_the_network_takes_for_the_field_is_an_outline_of_its_own():
    """A strip of 12 px and its turned-off end are kept; what is less likely is another outline."""
    likely = np.full((160, 200), 0.1, np.float32)
    likely[60:72, 20:180] = 0.9
    likely[72:130, 20:32] = 0.8
    likely[5:20, 5:60] = 0.9  # other ground
    likely[64:68, 100:104] = 0.2  # a hole
    outlines = network_outlines(likely, (50.0, 66.0))
    truth = shapely.union(shapely.box(20, 60, 180, 72), shapely.box(20, 72, 32, 130))
    (whole, holes), *others = outlines.items()
    assert overlap(whole, truth) > 0.97
    assert holes.sum() == 16
    surest = shapely.box(20, 60, 180, 72)
    assert max(overlap(polygon, surest) for polygon, _ in others) > 0.97
    assert all(holes[64:68, 100:104].all() for _, holes in others)
    assert network_outlines(np.full((50, 50), 0.1, np.float32), (5.0, 5.0)) == {}
