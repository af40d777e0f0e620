"""Curves of a bounded turning radius: words of arcs and straights, and what they trace.

A *word* is a list of pieces, each a left arc, a straight or a right arc with a length in radii;
negative lengths are driven backwards. A pose is (x, y, angle), the angle counter-clockwise from the
x axis in radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geofield.tracks.frame import FloatArray

LEFT, STRAIGHT, RIGHT = 1, 0, -1
_TWO_PI = 2.0 * np.pi
_MATCH = 1e-6
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Words:
    """Candidate curves for many pairs of poses."""

    #: Shape (words, pieces): ``LEFT``, ``STRAIGHT`` or ``RIGHT``; shorter words are filled with
    #: straights of length 0.
    steer: NDArray[np.int8]
    #: Shape (pairs, words, pieces): in radii, signed; NaN where a word does not join the pair.
    length: FloatArray

    @property
    def total(self) -> FloatArray:
        """Length of each word in radii, infinite where it does not join: (pairs, words)."""
        return np.asarray(np.nan_to_num(np.abs(self.length).sum(axis=2), nan=np.inf))

    @property
    def cusps(self) -> NDArray[np.int64]:
        """How often each word changes between forwards and backwards: (pairs, words)."""
        sign = np.sign(np.nan_to_num(self.length))
        changes = np.zeros(sign.shape[:2], dtype=np.int64)
        last = np.zeros(sign.shape[:2])
        for piece in range(sign.shape[2]):
            now = sign[:, :, piece]
            changes += (now != 0) & (last != 0) & (now != last)
            last = np.where(now != 0, now, last)
        return changes


def advance(
    pose: tuple[FloatArray, FloatArray, FloatArray], steer: FloatArray, length: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Drive one piece from poses, at a turning radius of 1; arrays broadcast."""
    x, y, angle = pose
    turned = angle + steer * length
    straight = steer == 0
    safe = np.where(straight, 1.0, steer)
    x1 = np.where(straight, x + length * np.cos(angle), x + (np.sin(turned) - np.sin(angle)) / safe)
    y1 = np.where(straight, y + length * np.sin(angle), y - (np.cos(turned) - np.cos(angle)) / safe)
    return x1, y1, turned


def keep_joining(words: Words, x: FloatArray, y: FloatArray, angle: FloatArray) -> Words:
    """Blank every word that, driven from (0, 0, 0) at radius 1, does not end at its goal.

    Published formulas hold on parts of the plane only; driving them is the test.
    """
    pose = (np.zeros_like(words.length[:, :, 0]),) * 3
    for piece in range(words.length.shape[2]):
        steer = words.steer[None, :, piece].astype(np.float64)
        pose = advance(pose, steer, words.length[:, :, piece])
    apart = np.hypot(pose[0] - x[:, None], pose[1] - y[:, None])
    turn = np.abs((pose[2] - angle[:, None] + np.pi) % _TWO_PI - np.pi)
    with np.errstate(invalid="ignore"):
        good = (apart < _MATCH) & (turn < _MATCH)
    length = np.where(good[:, :, None], words.length, np.nan)
    return Words(words.steer, length)


def to_unit(
    start: FloatArray, goal: FloatArray, radius_m: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Goals seen from starts, in radii: poses of shape (n, 3) in, (x, y, angle) out.

    The x axis lies ahead of a start, y to its left.
    """
    dx, dy = (goal[:, 0] - start[:, 0]) / radius_m, (goal[:, 1] - start[:, 1]) / radius_m
    cos, sin = np.cos(start[:, 2]), np.sin(start[:, 2])
    return dx * cos + dy * sin, dy * cos - dx * sin, goal[:, 2] - start[:, 2]


def touching(value: FloatArray, low: float, high: float) -> FloatArray:
    """A value that lies beyond a bound by rounding alone, at it.

    There arcs touch, as those of the tightest lane change: without it half of such words are none.
    """
    near = (value > low - _ROUNDING) & (value < high + _ROUNDING)
    return np.where(near, np.clip(value, low, high), value)


def trace(
    start: FloatArray,
    steer: NDArray[np.int8],
    length: FloatArray,
    radius_m: float,
    *,
    step_m: float,
) -> FloatArray:
    """Points (n, 2) along one word from a pose: every `step_m` on arcs, straights by their ends.

    Pieces that rounding made are left out: no machine can tell which way they run.
    """
    x, y, angle = (np.array([value]) for value in start)
    xs, ys = [x], [y]
    for way, part in zip(steer.tolist(), length.tolist(), strict=True):
        if part == 0.0:
            continue
        count = 1 if way == STRAIGHT else max(2, int(np.ceil(abs(part) * radius_m / step_m)))
        along = part * np.arange(1, count + 1) / count
        if way == STRAIGHT:
            x = x + along * radius_m * np.cos(angle)
            y = y + along * radius_m * np.sin(angle)
        else:
            turned = angle + way * along
            x = x + way * radius_m * (np.sin(turned) - np.sin(angle))
            y = y - way * radius_m * (np.cos(turned) - np.cos(angle))
            angle = turned[-1:]
        if abs(part) > _MATCH:
            xs.append(x)
            ys.append(y)
        x, y = x[-1:], y[-1:]
    return np.column_stack((np.concatenate(xs), np.concatenate(ys)))


def dubins_words(start: FloatArray, goal: FloatArray, radius_m: float) -> Words:
    """The six words of Dubins for each pair of poses, in metres and radians: forwards only.

    In the order LSL, RSR, LSR, RSL, RLR, LRL (Dubins 1957, "On curves of minimal length with a
    constraint on average curvature"; equations of Shkel and Lumelsky 2001).
    """
    x, y, angle = to_unit(start, goal, radius_m)
    d = np.hypot(x, y)
    theta = np.arctan2(y, x)
    a, b = -theta % _TWO_PI, (angle - theta) % _TWO_PI
    sa, sb, ca, cb, cab = np.sin(a), np.sin(b), np.cos(a), np.cos(b), np.cos(a - b)
    with np.errstate(invalid="ignore"):
        p_lsl = np.sqrt(touching(2.0 + d * d - 2.0 * cab + 2.0 * d * (sa - sb), 0.0, np.inf))
        w = np.arctan2(cb - ca, d + sa - sb)
        lsl = (_round(w - a), p_lsl, _round(b - w))
        p_rsr = np.sqrt(touching(2.0 + d * d - 2.0 * cab + 2.0 * d * (sb - sa), 0.0, np.inf))
        w = np.arctan2(ca - cb, d - sa + sb)
        rsr = (_round(a - w), p_rsr, _round(w - b))
        p_lsr = np.sqrt(touching(d * d - 2.0 + 2.0 * cab + 2.0 * d * (sa + sb), 0.0, np.inf))
        w = np.arctan2(-ca - cb, d + sa + sb) - np.arctan2(-2.0, p_lsr)
        lsr = (_round(w - a), p_lsr, _round(w - b))
        p_rsl = np.sqrt(touching(d * d - 2.0 + 2.0 * cab - 2.0 * d * (sa + sb), 0.0, np.inf))
        w = np.arctan2(ca + cb, d - sa - sb) - np.arctan2(2.0, p_rsl)
        rsl = (_round(a - w), p_rsl, _round(b - w))
        p_rlr = _round(
            -np.arccos(touching((6.0 - d * d + 2.0 * cab + 2.0 * d * (sa - sb)) / 8.0, -1.0, 1.0))
        )
        t = _round(a - np.arctan2(ca - cb, d - sa + sb) + p_rlr / 2.0)
        rlr = (t, p_rlr, _round(a - b - t + p_rlr))
        p_lrl = _round(
            -np.arccos(touching((6.0 - d * d + 2.0 * cab + 2.0 * d * (sb - sa)) / 8.0, -1.0, 1.0))
        )
        t = _round(-a - np.arctan2(ca - cb, d + sa - sb) + p_lrl / 2.0)
        lrl = (t, p_lrl, _round(b - a - t + p_lrl))
    length = np.stack(
        [np.stack(np.broadcast_arrays(*word), axis=-1) for word in (lsl, rsr, lsr, rsl, rlr, lrl)],
        axis=1,
    )
    steer = np.array(
        [[1, 0, 1], [-1, 0, -1], [1, 0, -1], [-1, 0, 1], [-1, 1, -1], [1, -1, 1]], dtype=np.int8
    )
    return keep_joining(Words(steer, length), x, y, angle)


def _round(angle: FloatArray) -> FloatArray:
    """An angle in [0, 2 pi), where a full turn but for rounding is none."""
    turned = np.asarray(angle) % _TWO_PI
    return np.where(turned > _TWO_PI - 1e-9, 0.0, turned)
