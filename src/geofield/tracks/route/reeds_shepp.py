"""Shortest curves that may reverse: the words of Reeds and Shepp.

Reeds and Shepp 1990, "Optimal paths for a car that goes both forwards and backwards", section 8:
nine families of words; the others follow by driving backwards in time, by reflection and by
exchanging start and goal.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geofield.tracks.frame import FloatArray
from geofield.tracks.route.curves import (
    LEFT,
    RIGHT,
    STRAIGHT,
    Words,
    keep_joining,
    to_unit,
    touching,
)

_HALF_PI = np.pi / 2.0
_Family = Callable[[FloatArray, FloatArray, FloatArray], list[FloatArray]]
_PIECES = 5


def reeds_shepp_words(start: FloatArray, goal: FloatArray, radius_m: float) -> Words:
    """All words of Reeds and Shepp for each pair of poses (n, 3), in metres and radians."""
    x, y, angle = to_unit(start, goal, radius_m)
    angle = _wrap(angle)
    # Exchanging start and goal reverses the word: the goal seen from the other end.
    back = (x * np.cos(angle) + y * np.sin(angle), x * np.sin(angle) - y * np.cos(angle), angle)
    steers: list[list[int]] = []
    lengths: list[FloatArray] = []
    zero = np.zeros_like(x)
    with np.errstate(invalid="ignore", divide="ignore"):
        for steer, family, reversible in _FAMILIES:
            for from_goal in (False, True) if reversible else (False,):
                px, py, pa = back if from_goal else (x, y, angle)
                for flip in (1.0, -1.0):
                    for mirror in (1, -1):
                        parts = family(flip * px, mirror * py, flip * mirror * pa)
                        word = [mirror * way for way in steer]
                        parts = [flip * part for part in parts]
                        if from_goal:
                            word, parts = word[::-1], parts[::-1]
                        missing = _PIECES - len(word)
                        steers.append(word + [STRAIGHT] * missing)
                        lengths.append(np.stack(parts + [zero] * missing, axis=-1))
    words = Words(np.array(steers, dtype=np.int8), np.stack(lengths, axis=1))
    return keep_joining(words, x, y, angle)


def _wrap(angle: FloatArray) -> FloatArray:
    """An angle in (-pi, pi]."""
    turned = -((-np.asarray(angle) + np.pi) % (2.0 * np.pi) - np.pi)
    return np.asarray(turned)


def _polar(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.hypot(x, y), np.arctan2(y, x)


def _tau_omega(
    u: FloatArray, v: FloatArray, xi: FloatArray, eta: FloatArray, phi: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The outer arcs of the words of four arcs (their equation 8.5)."""
    delta = _wrap(u - v)
    a = np.sin(u) - np.sin(delta)
    b = np.cos(u) - np.cos(delta) - 1.0
    t1 = np.arctan2(eta * a - xi * b, xi * a + eta * b)
    t2 = 2.0 * (np.cos(delta) - np.cos(v) - np.cos(u)) + 3.0
    tau = np.where(t2 < 0.0, _wrap(t1 + np.pi), _wrap(t1))
    return tau, _wrap(tau - u + v - phi)


def _lsl(x: FloatArray, y: FloatArray, phi: FloatArray) -> list[FloatArray]:
    u, t = _polar(x - np.sin(phi), y - 1.0 + np.cos(phi))
    return [t, u, _wrap(phi - t)]


def _lsr(x: FloatArray, y: FloatArray, phi: FloatArray) -> list[FloatArray]:
    u1, t1 = _polar(x + np.sin(phi), y - 1.0 - np.cos(phi))
    u = np.sqrt(touching(u1 * u1 - 4.0, 0.0, np.inf))
    t = _wrap(t1 + np.arctan2(2.0, u))
    return [t, u, _wrap(t - phi)]


def _lrl(x: FloatArray, y: FloatArray, phi: FloatArray) -> list[FloatArray]:
    u1, theta = _polar(x - np.sin(phi), y - 1.0 + np.cos(phi))
    u = -2.0 * np.arcsin(touching(u1 / 4.0, -1.0, 1.0))
    t = _wrap(theta + u / 2.0 + np.pi)
    return [t, u, _wrap(phi - t + u)]


def _lrlr_inner_opposite(x: FloatArray, y: FloatArray, phi: FloatArray) -> list[FloatArray]:
    xi, eta = x + np.sin(phi), y - 1.0 - np.cos(phi)
    u = np.arccos(touching((2.0 + np.hypot(xi, eta)) / 4.0, -1.0, 1.0))
    t, v = _tau_omega(u, -u, xi, eta, phi)
    return [t, u, -u, v]


def _lrlr_inner_same(x: FloatArray, y: FloatArray, phi: FloatArray) -> list[FloatArray]:
    xi, eta = x + np.sin(phi), y - 1.0 - np.cos(phi)
    u = -np.arccos(touching((20.0 - xi * xi - eta * eta) / 16.0, -1.0, 1.0))
    t, v = _tau_omega(u, u, xi, eta, phi)
    return [t, u, u, v]


def _lrsl(x: FloatArray, y: FloatArray, phi: FloatArray) -> list[FloatArray]:
    rho, theta = _polar(x - np.sin(phi), y - 1.0 + np.cos(phi))
    r = np.sqrt(touching(rho * rho - 4.0, 0.0, np.inf))
    t = _wrap(theta + np.arctan2(r, -2.0))
    return [t, np.full_like(t, -_HALF_PI), 2.0 - r, _wrap(phi - _HALF_PI - t)]


def _lrsr(x: FloatArray, y: FloatArray, phi: FloatArray) -> list[FloatArray]:
    xi, eta = x + np.sin(phi), y - 1.0 - np.cos(phi)
    rho, t = _polar(-eta, xi)
    return [t, np.full_like(t, -_HALF_PI), 2.0 - rho, _wrap(t + _HALF_PI - phi)]


def _lrslr(x: FloatArray, y: FloatArray, phi: FloatArray) -> list[FloatArray]:
    xi, eta = x + np.sin(phi), y - 1.0 - np.cos(phi)
    rho = np.hypot(xi, eta)
    u = 4.0 - np.sqrt(touching(rho * rho - 4.0, 0.0, np.inf))
    t = _wrap(np.arctan2((4.0 - u) * xi - 2.0 * eta, -2.0 * xi + (u - 4.0) * eta))
    quarter = np.full_like(t, -_HALF_PI)
    return [t, quarter, u, quarter, _wrap(t - phi)]


_FAMILIES: tuple[tuple[list[int], _Family, bool], ...] = (
    ([LEFT, STRAIGHT, LEFT], _lsl, False),
    ([LEFT, STRAIGHT, RIGHT], _lsr, False),
    ([LEFT, RIGHT, LEFT], _lrl, True),
    ([LEFT, RIGHT, LEFT, RIGHT], _lrlr_inner_opposite, False),
    ([LEFT, RIGHT, LEFT, RIGHT], _lrlr_inner_same, False),
    ([LEFT, RIGHT, STRAIGHT, LEFT], _lrsl, True),
    ([LEFT, RIGHT, STRAIGHT, RIGHT], _lrsr, True),
    ([LEFT, RIGHT, STRAIGHT, LEFT, RIGHT], _lrslr, False),
)
