"""Dubins and Reeds-Shepp curves against what is known of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from geofield.tracks.route.curves import dubins_words, trace
from geofield.tracks.route.reeds_shepp import reeds_shepp_words


@pytest.fixture(scope="module")
def pairs() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(7)
    start = np.column_stack((rng.uniform(-30, 30, (2000, 2)), rng.uniform(-4, 4, 2000)))
    goal = np.column_stack((rng.uniform(-30, 30, (2000, 2)), rng.uniform(-4, 4, 2000)))
    return start, goal


def test_every_pair_has_a_curve(pairs: tuple[np.ndarray, np.ndarray]) -> None:
    for words in (dubins_words(*pairs, 5.0), reeds_shepp_words(*pairs, 5.0)):
        assert np.isfinite(words.total.min(axis=1)).all()


def test_reversing_is_never_longer(pairs: tuple[np.ndarray, np.ndarray]) -> None:
    forward = dubins_words(*pairs, 5.0).total.min(axis=1)
    both = reeds_shepp_words(*pairs, 5.0).total.min(axis=1)
    assert (both <= forward + 1e-9).all()
    assert (both < 0.8 * forward).mean() > 0.2


def test_reeds_shepp_is_the_same_both_ways(pairs: tuple[np.ndarray, np.ndarray]) -> None:
    there = reeds_shepp_words(*pairs, 5.0).total.min(axis=1)
    back = reeds_shepp_words(*pairs[::-1], 5.0).total.min(axis=1)
    assert np.abs(there - back).max() < 1e-9


def test_the_tightest_lane_change_is_two_arcs_that_touch() -> None:
    """Rounding took half of them for none: Dubins' curve was a loop then, and did not fit."""
    rng, radius_m = np.random.default_rng(1), 5.0
    aside = rng.uniform(0.5, 9.8, 500)
    along, side = np.sqrt(aside * (4.0 * radius_m - aside)), rng.choice([-1.0, 1.0], 500)
    place, angle = rng.uniform(4.8e6, 4.9e6, (500, 2)), rng.uniform(-np.pi, np.pi, 500)
    ahead = np.column_stack((np.cos(angle), np.sin(angle)))
    left = ahead[:, ::-1] * (-1.0, 1.0)
    start = np.column_stack((place, angle))
    goal = np.column_stack((place + along[:, None] * ahead + (side * aside)[:, None] * left, angle))
    two_arcs = 2.0 * np.arccos(1.0 - aside / (2.0 * radius_m))
    for words in (dubins_words, reeds_shepp_words):
        shortest = words(start, goal, radius_m).total.min(axis=1)
        np.testing.assert_allclose(shortest, two_arcs, atol=1e-4)


#: Steer and sign of each piece of the drives of Reeds and Shepp's nine families, those that are
#: driven from the other end left out, and of Dubins' three: `q` is a quarter circle, `u` are arcs
#: as long as each other, `w` is more than half a circle.
DRIVES = (
    "L+ S+ L+", "L+ S+ R+", "L+ R- L+", "L+ R+ L-", "L+ Ru+ Lu- R-", "L+ Ru- Lu- R+",
    "L+ Rq- S- L-", "L+ Rq- S- R-", "L+ Rq- S- Lq- R+",
)  # fmt: skip
FORWARDS = ("L+ S+ L+", "L+ S+ R+", "L+ Rw+ L+")


@pytest.mark.parametrize(
    ("words", "drive"),
    [*((reeds_shepp_words, one) for one in DRIVES), *((dubins_words, one) for one in FORWARDS)],
)
def test_no_drive_is_shorter_than_the_one_that_is_found(words: Any, drive: str) -> None:
    rng = np.random.default_rng(3)
    count = 400
    arcs = {"u": rng.uniform(0.0, np.pi / 3.0, count), "q": np.full(count, np.pi / 2.0)}
    arcs["w"] = rng.uniform(np.pi, 1.5 * np.pi, count)
    place, angle, total = np.zeros(count, complex), np.zeros(count), np.zeros(count)
    mirrored, reverse = rng.choice([-1.0, 1.0], (2, count))
    for piece in drive.split():
        # An outer arc is no longer than those that are as long as each other.
        longest = 4.0 if piece[0] == "S" else arcs["u"] if "u" in drive else np.pi / 2.0
        far = arcs.get(piece[1], rng.uniform(0.0, longest, count))
        signed = far * (1.0 if piece[-1] == "+" else -1.0)
        signed *= reverse if words is reeds_shepp_words else 1.0
        turned = signed * mirrored * {"L": 1.0, "S": 0.0, "R": -1.0}[piece[0]]
        # The chord of an arc of radius 1 points half its turn aside.
        place += signed * np.sinc(turned / (2.0 * np.pi)) * np.exp(1j * (angle + turned / 2.0))
        angle, total = angle + turned, total + far
    goal = np.column_stack((place.real, place.imag, angle))
    # From the other end with the directions turned about, forwards stay forwards.
    about = np.array([0.0, 0.0, np.pi])
    for start, end in ((np.zeros_like(goal), goal), (goal + about, np.zeros_like(goal) + about)):
        found = words(start, end, 1.0).total.min(axis=1)
        assert (found < total + 1e-9).all()
        assert (found > total - 1e-9).mean() > 0.05


def test_known_lengths() -> None:
    start = np.zeros((3, 3))
    goal = np.array([[0.0, 0.0, np.pi], [0.0, 4.0, np.pi], [10.0, 0.0, 0.0]])
    # Turning on the spot takes three arcs of 60 degrees; two radii to the side a half circle.
    assert reeds_shepp_words(start, goal, 2.0).total.min(axis=1) * 2.0 == pytest.approx(
        [2.0 * np.pi, 2.0 * np.pi, 10.0]
    )
    assert dubins_words(start, goal, 2.0).total.min(axis=1) * 2.0 == pytest.approx(
        [2.0 * 7.0 * np.pi / 3.0, 2.0 * np.pi, 10.0]
    )


def test_traces_end_at_the_goal_and_keep_the_radius(
    pairs: tuple[np.ndarray, np.ndarray],
) -> None:
    start, goal = pairs
    words = reeds_shepp_words(start, goal, 5.0)
    best = words.total.argmin(axis=1)
    for row in range(0, 2000, 20):
        places = trace(
            start[row], words.steer[best[row]], words.length[row, best[row]], 5.0, step_m=0.05
        )
        assert places[0] == pytest.approx(start[row, :2])
        assert places[-1] == pytest.approx(goal[row, :2], abs=1e-6)
        length = np.hypot(*np.diff(places, axis=0).T).sum()
        assert length == pytest.approx(words.total[row, best[row]] * 5.0, rel=1e-4)
