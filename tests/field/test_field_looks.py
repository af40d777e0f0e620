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


class Discs:
    """In place of the network: ground is around the point that belongs, as wide as told."""

    def __init__(self, disc_px, shown_px, near_px=1e9):
        self.disc_px, self.shown_px, self.near_px = disc_px, shown_px, near_px
        self.asked: list[Any] = []

    def __call__(self, batch):
        self.asked.append(batch)
        at = batch[0, len(BANDS) + POINTS.index("belongs_at")]
        row, column = np.unravel_index(int(np.argmax(at)), at.shape)
        # The first look is told the wide disc; each later one a disc of the picture's pixels.
        side = self.shown_px if len(self.asked) == 1 else self.near_px
        cells = ANSWER_PX / SIDE_PX
        y, x = np.indices((ANSWER_PX, ANSWER_PX)) + 0.5
        away = np.hypot(x - (column + 2) * cells, y - (row + 2) * cells)
        radius = self.disc_px * ANSWER_PX / side
        return ((radius - away) * 2).astype(np.float32)[None, None]


def answer(scene, include, exclude, shape, factor, net: Any, times=1):
    """What a network, or what stands for one, says of a scene."""
    return seen(scene, times).probability(include, exclude, shape, factor, net)


@pytest.fixture(scope="module")
def scene():
    return simulate_field(5, SimulationSettings(width_px=300, height_px=240, obstacles=3)).scene


def test_ground_in_a_part_is_looked_at_again(scene):
    net = Discs(DISC_PX, 300, round(0.31 * 300))
    found = answer(scene, [(200.0, 90.0)], [], (240, 300), 1, net)
    assert len(net.asked) == 2
    y, x = np.indices(found.shape) + 0.5
    inside = np.hypot(x - 200, y - 90)
    assert (found[inside < DISC_PX - 4] > 0.5).all()
    assert (found[inside > DISC_PX + 4] < 0.5).all()
    # What it was shown the second time is the same ground, three times as large.
    first, second = (cv2.resize(one[0, 0], (SIDE_PX, SIDE_PX)) for one in net.asked)
    assert not np.allclose(first, second)
    whole = seen(scene)
    part = Square(153, 44, 93)
    again = seen(scene.crop(153, 44, 93, 93))
    assert np.allclose(whole.bands(part), again.bands(again.whole), atol=1e-5)


def test_ground_that_fills_the_picture_is_looked_at_once(scene):
    net = Discs(140.0, 300)
    found = answer(scene, [(150.0, 120.0)], [], (240, 300), 1, net)
    assert len(net.asked) == 1
    assert found.shape == (240, 300)


def test_no_ground_is_looked_at_once(scene):
    asked = []

    def nothing(batch):
        asked.append(batch)
        return np.full((1, 1, ANSWER_PX, ANSWER_PX), -3.0, np.float32)

    found = answer(scene, [(150.0, 120.0)], [], (240, 300), 1, nothing)
    assert len(asked) == 1
    assert found == pytest.approx(expit(-3.0))


def test_both_looks_count_within_the_part_and_one_beyond(scene):
    answers = iter((3.0, -1.5))

    def flat(batch):
        odds = np.full((ANSWER_PX, ANSWER_PX), -9.0, np.float32)
        value = next(answers)
        if value > 0:
            odds[30:34, 30:34] = value  # ground of 4 x 4 cells in the middle of the square
        else:
            odds[:] = value
        return odds[None, None]

    middle = 300 / 2
    found = answer(scene, [(middle, middle)], [], (240, 300), 1, flat)
    assert found[150, 150] == pytest.approx(expit((3.0 - 2 * 1.5) / 3), abs=0.02)
    assert found[60, 20] == pytest.approx(expit(-9.0), abs=1e-4)


def test_all_points_that_belong_are_in_the_part_and_others_are_left_out(scene):
    net = Discs(12.0, 300, 1e9)
    far = [(60.0, 60.0), (170.0, 130.0)]
    answer(scene, far, [(290.0, 20.0)], (240, 300), 1, net)
    first, second = (one[0, len(BANDS) :] for one in net.asked)
    assert first[POINTS.index("apart_at")].max() > 0.9
    assert second[POINTS.index("apart_at")].max() < 1e-3
    count, _ = cv2.connectedComponents((second[POINTS.index("belongs_at")] > 0.5).astype(np.uint8))
    assert count == 1 + len(far)


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
