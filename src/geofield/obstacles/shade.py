"""Which way shade falls, from the crowns themselves.

A crown is lit on one side. Every candidate votes with the direction in which its picture
darkens (the near infrared, where crowns are brightest), weighted by how much it looks like
a crown; the sum over many is the sun's azimuth turned by half a turn. It lets the verifier
ask for the shadow where a shadow must be: what is green and casts none is no tree.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from geofield.obstacles.channels import Channels, box_mean

STEP_RAD = np.pi / 36
"""Directions come in steps of five degrees: the same on every machine."""

_REACH_PX = 2
_SOFT = {"nir": 5.0, "luma": 3.0}
"""A slope, grey levels per pixel, that gives half a vote."""


def shade_votes(
    found: Channels,
    x_px: NDArray[np.float64],
    y_px: NDArray[np.float64],
    weight: NDArray[np.float64],
) -> complex:
    """Return the sum of the candidates' votes, x to the right and y down.

    Parameters
    ----------
    found : Channels
    x_px, y_px : float64 arrays, shape (n,)
        Candidate centres, pixel-index coordinates of the working grid.
    weight : float64 array, shape (n,)
    """
    name = "nir" if "nir" in found.maps else "luma"
    image = box_mean(found.maps[name], 3)
    rows = np.rint(y_px).astype(np.intp)
    cols = np.rint(x_px).astype(np.intp)
    last_row, last_col = image.shape[0] - 1, image.shape[1] - 1

    def at(dy: int, dx: int) -> NDArray[np.float32]:
        return image[np.clip(rows + dy, 0, last_row), np.clip(cols + dx, 0, last_col)]

    right = (at(0, -_REACH_PX) - at(0, _REACH_PX)) / (2 * _REACH_PX)
    down = (at(-_REACH_PX, 0) - at(_REACH_PX, 0)) / (2 * _REACH_PX)
    votes = right.astype(np.float64) + 1j * down
    votes /= np.abs(votes) + _SOFT[name]
    return complex((weight * votes).sum())


def shade_direction(votes: complex) -> float:
    """Return the direction in which shade falls, radians from right to down."""
    return float(np.rint(np.angle(votes) / STEP_RAD) * STEP_RAD)
