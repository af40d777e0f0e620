"""The network's looks at a picture: what it is shown of a part, and where its answer lies."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import pytest
from scipy.special import expit

from geofield.field.looks import Square, seen
from geofield.field.network import ANSWER_PX, BANDS, POINTS, SIDE_PX
from geofield.simulate import SimulationSettings, simulate_field

DISC_PX = 22.0


class Asked:
    """In place of the network: sees a picture as it is, and notes what it is asked."""

    def __init__(self, answer: Any):
        self.seen: list[Any] = []
        self.asked: list[Any] = []
        self.steps = (self.sees, self.told)
        self.answer = answer

    def sees(self, bands):
        assert bands.shape == (1, len(BANDS), SIDE_PX, SIDE_PX)
        self.seen.append(bands)
        return (bands,)

    def told(self, bands, points):
        assert points.shape == (1, len(POINTS), ANSWER_PX, ANSWER_PX)
        self.asked.append((bands, points))
        return (self.answer(bands[0], points[0])[None, None],)


class Discs(Asked):
    """Ground is around the point that belongs, as wide as told."""

    def __init__(self, disc_px, shown_px, near_px=1e9):
        super().__init__(self.around)
        self.disc_px, self.shown_px, self.near_px = disc_px, shown_px, near_px

    def around(self, bands, points):
        at = points[POINTS.index("belongs_at")]
        row, column = np.unravel_index(int(np.argmax(at)), at.shape)
        # The first look is told the wide disc; each later one a disc of the picture's pixels.
        side = self.shown_px if len(self.asked) == 1 else self.near_px
        y, x = np.indices((ANSWER_PX, ANSWER_PX)) + 0.5
        away = np.hypot(x - (column + 0.5), y - (row + 0.5))
        radius = self.disc_px * ANSWER_PX / side
        return ((radius - away) * 2).astype(np.float32)


def answer(scene, include, exclude, shape, factor, net: Any, times=1):
    """What a network, or what stands for one, says of a scene."""
    return seen(scene, net, times).probability(include, exclude, shape, factor)


@pytest.fixture(scope="module")
def scene():
    return simulate_field(5, SimulationSettings(width_px=300, height_px=240, obstacles=3)).scene


def test_ground_in_a_part_is_looked_at_again(scene):
    net: Any = Discs(DISC_PX, 300, round(0.31 * 300))
    found = answer(scene, [(200.0, 90.0)], [], (240, 300), 1, net)
    assert len(net.asked) == 2
    y, x = np.indices(found.shape) + 0.5
    inside = np.hypot(x - 200, y - 90)
    assert (found[inside < DISC_PX - 4] > 0.5).all()
    assert (found[inside > DISC_PX + 4] < 0.5).all()
    # What it was shown the second time is the same ground, three times as large.
    first, second = net.seen
    assert not np.allclose(first, second)
    whole = seen(scene, net)
    part = Square(153, 44, 93)
    again = seen(scene.crop(153, 44, 93, 93), net)
    assert np.allclose(whole.bands(part), again.bands(again.whole), atol=1e-5)


def test_ground_that_fills_the_picture_is_looked_at_once(scene):
    net = Discs(140.0, 300)
    found = answer(scene, [(150.0, 120.0)], [], (240, 300), 1, net)
    assert len(net.asked) == 1
    assert found.shape == (240, 300)


def test_no_ground_is_looked_at_once(scene):
    net = Asked(lambda bands, points: np.full((ANSWER_PX, ANSWER_PX), -3.0, np.float32))
    found = answer(scene, [(150.0, 120.0)], [], (240, 300), 1, net)
    assert len(net.asked) == 1
    assert found == pytest.approx(expit(-3.0))


def test_both_looks_count_within_the_part_and_one_beyond(scene):
    answers = iter((3.0, -1.5))

    def flat(bands, points):
        odds = np.full((ANSWER_PX, ANSWER_PX), -9.0, np.float32)
        value = next(answers)
        if value > 0:
            odds[30:34, 30:34] = value  # ground of 4 x 4 cells in the middle of the square
        else:
            odds[:] = value
        return odds

    middle = 300 / 2
    found = answer(scene, [(middle, middle)], [], (240, 300), 1, Asked(flat))
    assert found[150, 150] == pytest.approx(expit((3.0 - 2 * 1.5) / 3), abs=0.02)
    assert found[60, 20] == pytest.approx(expit(-9.0), abs=1e-4)


def test_all_points_that_belong_are_in_the_part_and_others_are_left_out(scene):
    net = Discs(12.0, 300, 1e9)
    far = [(60.0, 60.0), (170.0, 130.0)]
    answer(scene, far, [(290.0, 20.0)], (240, 300), 1, net)
    first, second = (points[0] for _, points in net.asked)
    assert first[POINTS.index("apart_at")].max() > 0.9
    assert second[POINTS.index("apart_at")].max() < 1e-3
    count, _ = cv2.connectedComponents((second[POINTS.index("belongs_at")] > 0.5).astype(np.uint8))
    assert count == 1 + len(far)


def test_what_was_seen_is_asked_again_about_further_points(scene):
    net: Any = Discs(DISC_PX, 300, round(0.31 * 300))
    looks, shape = seen(scene, net), (240, 300)
    first = looks.probability([(200.0, 90.0)], [], shape, 1)
    assert (len(net.seen), len(net.asked)) == (2, 2)
    again = looks.probability([(200.0, 90.0)], [(20.0, 20.0)], shape, 1, once=True)
    assert (len(net.seen), len(net.asked)) == (2, 3)
    assert not np.array_equal(first, again)
    bands, points = net.asked[-1]
    assert np.array_equal(bands, net.seen[0])
    assert points[0, POINTS.index("apart_at")].max() > 0.9
    # The ground lies elsewhere: another part is seen, the whole is not seen again.
    looks.probability([(60.0, 60.0)], [], shape, 1)
    assert len(net.seen) == 3


def test_of_the_parts_that_were_seen_the_last_ones_are_kept(scene):
    net: Any = Discs(DISC_PX, 300, round(0.31 * 300))
    looks, shape = seen(scene, net), (240, 300)
    for x in range(50, 250, 10):
        net.asked.clear()  # the first look is told the wide disc
        looks.probability([(float(x), 120.0)], [], shape, 1)
    # The whole is asked about each time: it was seen once, and stays.
    assert len(net.seen) == 1 + 20
    assert len(looks.shown) == 12
    assert looks.whole in looks.shown


@pytest.mark.parametrize("factor", [1, 2])
def test_a_large_picture_is_answered_on_its_own_pixels(factor):
    large = simulate_field(5, SimulationSettings(width_px=1400, height_px=900, obstacles=3)).scene
    net = Discs(100.0, 1400 / 2, 1e9)
    shape = (900 // factor, 1400 // factor)
    at = (700.0 / factor, 400.0 / factor)
    found = answer(large, [at], [], shape, factor, net)
    row, column = np.nonzero(found > 0.5)
    assert np.mean(column) + 0.5 == pytest.approx(at[0], abs=12 / factor)
    assert np.mean(row) + 0.5 == pytest.approx(at[1], abs=12 / factor)


def test_pixels_that_were_only_made_show_nothing_more(scene):
    """A picture of 50 px, each made into six: its ground of 15 px is not looked at again."""
    for times, looks in ((1, 2), (6, 1)):
        net = Discs(45.0, 300)
        answer(scene, [(150.0, 120.0)], [], (240, 300), 1, net, times)
        assert len(net.asked) == looks
