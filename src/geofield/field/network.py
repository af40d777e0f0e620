"""Network: what is shown to the network that says which ground belongs to the field.

A small network (`learned/outline.onnx`, trained by `tools/train_outlines.py`) sees a picture at one
size, and is told the points that belong to the field and those that do not (`outline_points.onnx`).
Its answer is coarse: it says which ground; where exactly that ends is asked of the picture itself.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from geofield.field.points import Points
from geofield.learned.network import Network

FloatArray = NDArray[np.float32]
BoolArray = NDArray[np.bool_]
Features = tuple[FloatArray, ...]

#: Sides of the picture that the network sees, and of its answer, pixels.
SIDE_PX, ANSWER_PX = 256, 64
#: Width of a point's bell and of its wide surroundings, pixels of the answer.
_BELL_PX, _WIDE_PX = 1.4, 10.0
#: Grey levels that count as contrast at least: an even picture is not blown up to noise.
_LEAST_CONTRAST = 6.0

BANDS = ("red", "green", "blue", "nir", "vegetation", "valid")
"""Channels of the picture, in units of their own spread; zero where there is no data."""
POINTS = ("belongs_at", "belongs_around", "apart_at", "apart_around")
"""Maps of the points: a bell at each, and its wide surroundings."""


def normalised(rgb: FloatArray, nir: FloatArray | None, valid: BoolArray) -> FloatArray:
    """The picture's channels as the network takes them, in the order of `BANDS`.

    Parameters
    ----------
    rgb : float32 array (3, SIDE_PX, SIDE_PX)
        Grey levels; a grey picture three times.
    nir : float32 array (SIDE_PX, SIDE_PX), optional
    valid : bool array (SIDE_PX, SIDE_PX)
    """
    luma = np.tensordot(np.array([0.298, 0.587, 0.114], np.float32), rgb, 1)
    known = luma[valid] if valid.any() else luma.ravel()
    middle, spread = float(known.mean()), float(known.std()) + _LEAST_CONTRAST
    layers = [(band - middle) / spread for band in rgb]
    if nir is None:
        layers += [np.zeros_like(luma), np.zeros_like(luma)]
    else:
        own = nir[valid] if valid.any() else nir.ravel()
        layers.append((nir - float(own.mean())) / (float(own.std()) + _LEAST_CONTRAST))
        layers.append(3.0 * (nir - rgb[0]) / (nir + rgb[0] + 20.0))
    layers.append(np.ones_like(luma))
    stack: FloatArray = np.clip(np.stack(layers), -4.0, 4.0, dtype=np.float32)
    stack[:, ~valid] = 0.0
    return stack


def points_maps(include: Points, exclude: Points) -> FloatArray:
    """Points, pixel coordinates of `SIDE_PX`, as maps (points, ANSWER_PX, ANSWER_PX)."""
    scale = ANSWER_PX / SIDE_PX
    rows, columns = np.indices((ANSWER_PX, ANSWER_PX), np.float32)
    maps = []
    for points in (include, exclude):
        away = np.full(rows.shape, 1e6, np.float32)
        for x, y in points:
            square = np.square(columns + 0.5 - x * scale) + np.square(rows + 0.5 - y * scale)
            np.minimum(away, square, out=away)
        maps.append(np.exp(-away / (2 * _BELL_PX**2)))
        maps.append(np.exp(-np.sqrt(away) / _WIDE_PX))
    return np.stack(maps).astype(np.float32)


def features(network: Network, bands: FloatArray) -> Features:
    """What the network sees in a picture, whichever points are meant: four fifths of its work.

    Parameters
    ----------
    network : Network
    bands : float32 array (bands, SIDE_PX, SIDE_PX)
        As `normalised` gives them.
    """
    return network.steps[0](bands[None])


def log_odds(network: Network, picture: Features, include: Points, exclude: Points) -> FloatArray:
    """Log odds of belonging to the field that points mean, (ANSWER_PX, ANSWER_PX).

    Parameters
    ----------
    network : Network
    picture : tuple of float32 array
        What it sees there, as `features` gives it.
    include, exclude : sequence of (float, float)
        Points that belong and that do not, pixel coordinates of `SIDE_PX`.
    """
    (odds,) = network.steps[1](*picture, points_maps(include, exclude)[None])
    return np.asarray(odds[0, 0])
