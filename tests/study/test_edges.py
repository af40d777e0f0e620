"""Edge maps against the definitions, on pictures small enough to work out by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from geofield.errors import ObstacleError
from geofield.study.edges import EDGE_METHODS, EdgeScan, gradient


def edge_map(grey, method="sobel", threshold=None):
    scan = EdgeScan.of(grey, method)
    return scan.at(scan.default_threshold if threshold is None else threshold)


@pytest.mark.parametrize("method", ["sobel", "prewitt"])
def test_a_unit_step_gives_half(method):
    step = np.zeros((8, 9))
    step[:, 5:] = 1
    gx, gy = gradient(step, method)
    assert gx[3].tolist() == [0, 0, 0, 0, 0.5, 0.5, 0, 0, 0]
    assert np.all(gy == 0)


def test_integers_are_scaled_to_one():
    grey = np.random.default_rng(0).integers(0, 256, (20, 20), dtype=np.uint8)
    assert np.array_equal(edge_map(grey, "roberts"), edge_map(grey / 255, "roberts"))


@pytest.mark.parametrize("method", EDGE_METHODS)
@given(grey=arrays(np.float64, (12, 15), elements=st.floats(0, 1, width=16)))
@settings(max_examples=25, deadline=None)
def test_a_higher_threshold_never_adds_an_edge(method, grey):
    scan = EdgeScan.of(grey, method)
    low, high = scan.at(0.05), scan.at(0.2)
    assert not np.any(high & ~low)
    assert not np.any(low & ~scan.ridge)


@pytest.mark.parametrize("method", ["sobel", "prewitt"])
@given(grey=arrays(np.float64, (10, 13), elements=st.floats(0, 1, width=16)))
@settings(max_examples=25, deadline=None)
def test_edges_turn_with_the_picture(method, grey):
    assert np.array_equal(edge_map(np.rot90(grey), method), np.rot90(edge_map(grey, method)))


@pytest.mark.parametrize("method", EDGE_METHODS)
def test_a_constant_picture_has_no_edges(method):
    assert not edge_map(np.full((20, 20), 0.4), method).any()


def test_canny_edge_of_a_disc_is_a_closed_thin_ring():
    y, x = np.mgrid[:60, :60]
    grey = (np.hypot(x - 30, y - 29) < 15).astype(float)
    edges = edge_map(grey, "canny", 0.4)
    radius = np.hypot(*(np.nonzero(edges)[::-1] - np.array([[30], [29]])))
    assert np.all(np.abs(radius - 15) < 1.5)
    assert 75 < edges.sum() < 130


def test_unknown_method_and_colour_are_refused():
    with pytest.raises(ObstacleError, match="laplace"):
        edge_map(np.zeros((5, 5)), "laplace")
    with pytest.raises(ObstacleError, match="one band"):
        edge_map(np.zeros((5, 5, 3)))
