"""The outline of a mask: true to it, straight, with few vertices, valid."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from rasterio.features import rasterize

from geofield.errors import FieldError
from geofield.field.outline import mask_polygon, mean_deviation_px, straight_outline

L_SHAPE = [[-80, -50], [80, -50], [80, 0], [20, 0], [20, 50], [-80, 50]]
RECTANGLE = [[-80, -50], [80, -50], [80, 50], [-80, 50]]


def turned(corners, angle, centre=(128.3, 127.6)):
    c, s = np.cos(angle), np.sin(angle)
    return shapely.Polygon(np.array(corners) @ np.array([[c, s], [-s, c]]) + centre)


def pixels(polygon, side=256):
    return rasterize([(polygon, 1)], (side, side)).astype(bool)


@pytest.mark.parametrize(("corners", "count"), [(RECTANGLE, 4), (L_SHAPE, 6)])
@settings(max_examples=60, deadline=None)
@given(angle=st.floats(0, np.pi))
def test_straight_fields_keep_their_corners(corners, count, angle):
    truth = turned(corners, angle)
    mask = pixels(truth)
    outline = straight_outline(mask)
    assert outline.is_valid
    assert count <= len(outline.exterior.coords) - 1 <= count + 1
    assert truth.exterior.hausdorff_distance(outline.exterior) < 1.5
    assert outline.intersection(truth).area / outline.union(truth).area > 0.98


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), smooth=st.floats(1.0, 6.0))
def test_any_mask_gives_a_valid_outline_within_a_pixel(seed, smooth):
    from scipy.ndimage import gaussian_filter

    noise = gaussian_filter(np.random.default_rng(seed).normal(size=(70, 90)), smooth)
    mask = noise > 0
    outline = straight_outline(mask)
    exact = mask_polygon(mask)
    assert outline.is_valid
    assert not outline.is_empty
    assert shapely.box(0, 0, 90, 70).covers(outline)
    assert mean_deviation_px(outline, exact) <= 1.0
    assert len(outline.exterior.coords) <= len(exact.exterior.coords)


def test_a_mask_that_fills_the_picture_is_the_picture():
    outline = straight_outline(np.ones((50, 60), bool))
    assert outline.equals(shapely.box(0, 0, 60, 50))


def test_holes_are_kept():
    mask = pixels(turned(RECTANGLE, 0.4))
    mask[110:130, 120:140] = False
    outline = straight_outline(mask)
    assert len(list(outline.interiors)) == 1
    assert shapely.Polygon(outline.interiors[0]).area == pytest.approx(400, rel=0.03)


def with_a_round_hole(mask, x, y, radius):
    row, column = np.indices(mask.shape) + 0.5
    return mask & (np.hypot(column - x, row - y) >= radius)


def test_a_crown_in_a_field_stays_round():
    mask = with_a_round_hole(pixels(turned(RECTANGLE, 0.4)), 128, 128, 10)
    hole = shapely.Polygon(straight_outline(mask).interiors[0])
    crown = shapely.Point(128, 128).buffer(10)
    assert hole.intersection(crown).area / hole.union(crown).area > 0.95


def test_the_corner_where_a_machine_turns_is_where_the_sides_meet():
    truth = turned(RECTANGLE, 0.1)
    outline = straight_outline(pixels(truth.buffer(-4).buffer(4)))
    assert len(outline.exterior.coords) - 1 == 4
    assert truth.exterior.hausdorff_distance(outline.exterior) < 0.2


def test_a_side_on_the_picture_s_edge_is_exactly_there_beside_a_crown():
    mask = pixels(turned(RECTANGLE, 0.2, (128, 220)))
    rows = shapely.get_coordinates(straight_outline(with_a_round_hole(mask, 90, 256, 10)))[:, 1]
    assert rows[rows > 252].tolist() == [256.0] * 4


def test_a_field_of_four_pixels_is_their_square():
    mask = np.zeros((9, 9), bool)
    mask[3:5, 3:5] = True
    assert straight_outline(mask).equals(shapely.box(3, 3, 5, 5))


def test_zero_tolerance_keeps_the_staircase():
    mask = pixels(turned(RECTANGLE, 0.4))
    assert straight_outline(mask, tolerance_px=0).area == mask.sum()


def test_an_empty_mask_is_refused():
    with pytest.raises(FieldError, match="No pixel"):
        straight_outline(np.zeros((9, 9), bool))
