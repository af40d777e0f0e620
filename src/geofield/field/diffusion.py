"""Anisotropic diffusion: smooths surfaces and keeps their borders (Perona and Malik 1990).

The study named non-linear diffusion as the smoothing it lacked.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from geofield.model import Scene

#: Largest time step at which the explicit scheme with four neighbours is stable.
_STEP = 0.2
#: Steps; details of about ``sqrt(_STEPS / 2)`` pixels vanish.
_STEPS = 12
#: Difference of grey levels that counts as a border. The conductance is Perona and Malik's first,
#: ``exp(-(difference / _BORDER)**2)``, which favours strong borders.
_BORDER = 12.0


def diffuse(band: NDArray[np.generic]) -> NDArray[np.float32]:
    """A band (rows, columns) of grey levels, 0..255, after diffusion.

    Nothing flows over the picture's edge, so that the mean stays the same.
    """
    value = band.astype(np.float32)
    for _ in range(_STEPS):
        change = np.zeros_like(value)
        for along, changed in ((value, change), (value.T, change.T)):
            difference = np.diff(along, axis=0)
            flow = difference * np.exp(-np.square(difference / _BORDER))
            changed[:-1] += flow
            changed[1:] -= flow
        value += np.float32(_STEP) * change
    return value


def diffused(scene: Scene) -> Scene:
    """A scene with every band diffused."""
    bands = np.stack([np.rint(diffuse(band)).clip(0, 255) for band in scene.bands])
    return replace(scene, bands=bands.astype(np.uint8))
