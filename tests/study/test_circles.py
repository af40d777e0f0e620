"""Circle detectors on discs whose truth is known."""

import numpy as np
import pytest
from scipy import ndimage

from geofield.errors import ObstacleError
from geofield.study.phase_code import find_circles


def discs(centres, radius, size=(90, 110), *, inside=0.2, outside=0.7):
    y, x = np.mgrid[: size[0], : size[1]]
    grey = np.full(size, outside)
    for cx, cy in centres:
        # Anti-aliased border: the disc's true radius, not that of its pixels.
        cover = np.clip(radius + 0.5 - np.hypot(x - cx, y - cy), 0, 1)
        grey += cover * (inside - outside)
    return grey


CENTRES = [(25.3, 30.7), (70.0, 25.5), (50.5, 65.2)]


@pytest.mark.parametrize("method", ["phase_code", "two_stage"])
@pytest.mark.parametrize("polarity", ["dark", "bright"])
def test_every_disc_is_found_where_it_is(method, polarity):
    grey = discs(CENTRES, 9.0)
    if polarity == "bright":
        grey = 1 - grey
    found = find_circles(grey, (6, 14), polarity=polarity, method=method, sensitivity=0.9)
    assert len(found) == 3
    for cx, cy in CENTRES:
        # The discs are drawn by pixel index: half a pixel from the picture's corner.
        apart = np.hypot(found.x_px - cx - 0.5, found.y_px - cy - 0.5)
        nearest = np.argmin(apart)
        assert apart[nearest] < 0.4
        assert found.radius_px[nearest] == pytest.approx(9.0, abs=0.5)
    assert np.all(np.diff(found.strength) <= 0)


def test_the_wrong_polarity_finds_nothing():
    assert len(find_circles(discs(CENTRES, 9.0), (6, 14), polarity="bright")) == 0


@pytest.mark.parametrize("kind", ["constant", "tiny", "one"])
def test_pictures_without_circles_give_none(kind):
    grey = {
        "constant": np.full((40, 40), 0.3),
        "tiny": np.random.default_rng(1).random((3, 3)),
        "one": np.zeros((1, 1)),
    }[kind]
    assert len(find_circles(grey, (6, 14))) == 0


def test_one_radius_is_a_range():
    found = find_circles(discs(CENTRES, 9.0), (9, 9), polarity="dark", sensitivity=0.97)
    assert len(found) == 3
    assert found.radius_px == pytest.approx(9.0)


def test_logical_and_grey_pictures_both_work():
    disc = ndimage.binary_erosion(discs(CENTRES, 9.0) < 0.45)
    assert len(find_circles(disc, (6, 14), polarity="bright", sensitivity=0.9)) == 3


@pytest.mark.parametrize("radius", [(9, 4), (0, 5), (-3, 5), (5, np.inf), (np.nan, 5)])
def test_impossible_ranges_are_refused(radius):
    with pytest.raises(ObstacleError, match="radius range"):
        find_circles(np.zeros((20, 20)), radius)


def test_other_bad_values_are_refused():
    grey = discs(CENTRES, 9.0)
    with pytest.raises(ObstacleError, match="sensitivity"):
        find_circles(grey, (6, 14), sensitivity=1.5)
    with pytest.raises(ObstacleError, match="threshold"):
        find_circles(grey, (6, 14), edge_threshold=2)
    with pytest.raises(ObstacleError, match="polarity"):
        find_circles(grey, (6, 14), polarity="grey")  # type: ignore[arg-type]
    with pytest.raises(ObstacleError, match="method"):
        find_circles(grey, (6, 14), method="three_stage")  # type: ignore[arg-type]
