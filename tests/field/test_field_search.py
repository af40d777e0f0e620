"""The steps of the default method, each alone: clearing, redrawing, measuring, aligning."""

import numpy as np
import pytest
import shapely
from shapely import Polygon, box

from geofield.field.answer import network_outlines
from geofield.field.border import measure as measure_inside
from geofield.field.clearing import clear
from geofield.field.frame import Frame
from geofield.field.hierarchy import merge
from geofield.field.morphology import filled, inner, plump
from geofield.field.ranking import expected_overlaps
from geofield.field.refine import aligned
from geofield.field.regions import partition
from geofield.field.regions import regions as regions_around
from geofield.field.search import open_ground
from geofield.field.straight import redrawn, ring
from geofield.field.surface import Surface

FRAME = Frame((160, 160))


def overlap(a, b):
    return a.intersection(b).area / a.union(b).area


def picture(shape=(160, 160), seed=0):
    """Three channels of noise as whitened channels have it."""
    return np.random.default_rng(seed).normal(0, 0.4, (3, *shape)).astype(np.float32)


def measure(surface, outline):
    return measure_inside(surface, outline, surface.members(ring(outline)))


def regions(parted, seed, include=(), exclude=()):
    """With a network that knows nothing."""
    likely = np.full(parted.tree.leaf_count, 0.2)
    return regions_around(parted, likely, (seed, *include), exclude)


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
    found = regions(partition(cleared), (90.5, 70.5))
    assert max((one.mask & field).sum() / (one.mask | field).sum() for one in found) > 0.97


def test_a_region_that_only_grew_a_tendril_comes_once():
    stack = picture((240, 240))
    stack[0, 40:120, 40:120] += 12
    stack[0, 60:66, 120:] += 8  # roads, thinner than any field
    stack[0, 90:96, 120:] += 7
    found = regions(partition(stack), (60.5, 60.5))
    assert any(abs(one.mask.sum() - 6400) < 300 for one in found)
    assert len(found) > 1
    masks = {one.mask.tobytes() for one in found}
    assert len(masks) == len(found)


def test_points_take_parts_away_and_add_them():
    stack = picture((240, 240))
    stack[0, 40:120, 40:120] += 12
    stack[0, 40:120, 120:200] += 9
    stack[0, 130:200, 40:200] += 22
    parted = partition(stack)
    left, right, below = (80.5, 80.5), (160.5, 80.5), (120.5, 165.5)
    for include, exclude in (((), (right,)), ((right,), (below,)), ((below,), (right,))):
        found = regions(parted, left, include, exclude)
        obeying = [
            one
            for one in found
            if all(one.mask[int(y), int(x)] for x, y in (left, *include))
            and not any(one.mask[int(y), int(x)] for x, y in exclude)
        ]
        assert obeying, (include, exclude)
    both = np.zeros((240, 240), bool)
    both[40:120, 40:200] = True
    found = regions(parted, left, (right,), (below,))
    assert max((one.mask & both).sum() / (one.mask | both).sum() for one in found) > 0.95


def test_what_the_network_takes_for_the_field_is_a_region():
    stack = picture()
    parted = partition(stack)
    wanted = np.zeros((160, 160), np.float32)
    wanted[30:110, 20:90] = 0.9
    found = regions_around(parted, parted.mean(wanted), ((50.5, 60.5),), ())
    shares = [(one.mask & (wanted > 0)).sum() / (one.mask | (wanted > 0)).sum() for one in found]
    assert max(shares) > 0.9


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
    cleared, _ = clear(stack, 0.6)
    found = regions(partition(cleared), (100.5, 60.5))
    truth = np.zeros((200, 200), bool)
    truth[30:170, 30:170] = True
    best = max((one.mask & truth).sum() / (one.mask | truth).sum() for one in found)
    assert best > 0.95


def test_a_point_on_a_crown_at_the_border_stands_on_the_crowns_own_ground():
    stack = picture()
    stack[0, :, 80:] += 12  # another field, nearer to the point than its own
    crown = disc((160, 160), 75, 60, 5)
    stack[1, crown & (np.indices((160, 160))[1] < 80)] -= 15
    parted = partition(stack)
    x, y = open_ground(parted, np.zeros((160, 160), bool), (78.5, 60.5))
    assert x < 80
    assert np.hypot(x - 75, y - 60) > 4.5
    free = (20.5, 60.5)
    assert open_ground(parted, np.zeros((160, 160), bool), free) == free


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        (box(20, 20, 120, 120).difference(box(60, 20, 80, 35)), "a crown's notch"),
        (box(20, 20, 120, 120).union(box(120, 50, 150, 90)), "a leak through a gap"),
        (box(20, 20, 120, 120).difference(box(105, 20, 120, 35)), "a corner that is missing"),
        (box(0, 20, 120, 120).union(box(80, 120, 120, 160)), "a leak to the frame"),
    ],
)
def test_the_sides_drawn_on_undo(wrong, why):
    truth = box(wrong.bounds[0], 20, 120, 120)
    found = redrawn(wrong, (50, 60), FRAME)
    assert max(overlap(one, truth) for one in found) > 0.999, why
    assert all(one.is_valid and one.contains(shapely.Point(50, 60)) for one in found)
    assert len(found) < 40


def test_a_rectangle_suggests_nothing_else():
    assert redrawn(box(20, 20, 120, 120), (50, 60), FRAME) == []


def test_figures_tell_a_border_from_none():
    stack = picture()
    stack[0, 40:120, 40:120] += 10
    surface = Surface(stack, partition(stack), np.zeros((160, 160), bool), FRAME)
    on, off = (
        measure(surface, box(*corners)) for corners in ((40, 40, 120, 120), (30, 30, 130, 130))
    )
    assert on is not None
    assert off is not None
    assert on["strength_10"] > np.log(5) > off["strength_50"] + 1
    assert on["share_faint"] == 0
    assert off["share_faint"] > 0.9
    assert on["strange_share"] < 0.05 < off["strange_share"]
    assert on["compactness"] == pytest.approx(np.log(np.pi / 4), abs=1e-9)
    assert measure(surface, box(50, 50, 52, 52)) is None


def test_figures_do_not_depend_on_the_direction_of_the_ring():
    stack = picture()
    stack[0, 40:120, 40:120] += 10
    surface = Surface(stack, partition(stack), np.zeros((160, 160), bool), FRAME)
    outline = box(38, 40, 120, 119)
    one, other = measure(surface, outline), measure(surface, Polygon(outline.exterior.coords[::-1]))
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


def test_the_weakest_border_merges_first_and_all_ends_in_one():
    #  0 - 1 - 2 - 3, strong in the middle
    first, second = np.array([0, 1, 2]), np.array([1, 2, 3])
    tree = merge(np.full(4, 500.0), first, second, np.full(3, 10.0), np.array([1.0, 9.0, 2.0]))
    assert tree.parent[-1] == -1
    assert sorted(tree.leaves(6)) == [0, 1, 2, 3]
    assert sorted(tree.leaves(4)) == [0, 1]
    assert sorted(tree.leaves(5)) == [2, 3]
    assert tree.chain(0) == [0, 4, 6]
    assert tree.beside(4) == 5
    assert tree.height[4:].tolist() == [1.0, 2.0, 9.0]


def test_what_the_network_takes_for_the_field_is_an_outline_of_its_own():
    """A strip of 12 px, as narrow as two superpixels, and its turned-off end are kept."""
    likely = np.full((160, 200), 0.1, np.float32)
    likely[60:72, 20:180] = 0.9
    likely[72:130, 20:32] = 0.8
    likely[5:20, 5:60] = 0.9  # other ground
    likely[64:68, 100:104] = 0.2  # a hole
    outlines = network_outlines(likely, (50.0, 66.0))
    truth = shapely.union(shapely.box(20, 60, 180, 72), shapely.box(20, 72, 32, 130))
    assert outlines
    for polygon, holes in outlines.items():
        assert overlap(polygon, truth) > 0.97
        assert holes.sum() == 16
    assert network_outlines(np.full((50, 50), 0.3, np.float32), (5.0, 5.0)) == {}
