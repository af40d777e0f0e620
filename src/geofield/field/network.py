"""Network: how likely each place belongs to the field that the points show.

A small network (`learned/outline.onnx`, trained by `tools/train_outlines.py`) sees the whole
picture at one size, the points that belong to the field and those that do not. Its answer is
coarse: it says which ground; where exactly that ends is asked of the picture itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from geofield.learned.network import Network
from geofield.model import Scene

FloatArray = NDArray[np.float32]
BoolArray = NDArray[np.bool_]
Points = Sequence[tuple[float, float]]

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


@dataclass(frozen=True, eq=False)
class Seen:
    """A scene as the network sees it.

    Attributes
    ----------
    bands : float32 array (bands, SIDE_PX, SIDE_PX)
        See `BANDS`.
    scale : float
        Pixels of it along one of the scene.
    """

    bands: FloatArray
    scale: float

    def probability(
        self,
        include: Points,
        exclude: Points,
        shape: tuple[int, int],
        factor: int,
        network: Network,
    ) -> FloatArray:
        """How likely each pixel of the scene, reduced by a factor, belongs to the field.

        Parameters
        ----------
        include, exclude : sequence of (float, float)
            Points that belong and that do not, pixel coordinates of the reduced scene.
        shape : (int, int)
            Rows and columns of the reduced scene.
        factor : int
        network : Network
            The one that is asked.
        """
        import cv2

        scale = factor * self.scale
        points = points_maps(
            *([(x * scale, y * scale) for x, y in one] for one in (include, exclude))
        )
        often = SIDE_PX // ANSWER_PX
        large = np.repeat(np.repeat(points, often, axis=1), often, axis=2)
        odds = network(np.concatenate([self.bands, large])[None])[0, 0]
        share = scale * ANSWER_PX / SIDE_PX
        shift = 0.5 * share - 0.5
        onto = np.array([[share, 0, shift], [0, share, shift]])
        wide = cv2.warpAffine(
            odds,
            onto,
            shape[::-1],
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        )
        return np.asarray(expit(wide), dtype=np.float32)


def seen(scene: Scene) -> Seen:
    """A scene in the network's size."""
    import cv2

    rows, columns = scene.grid.shape
    scale = SIDE_PX / max(rows, columns)
    size = max(1, round(columns * scale)), max(1, round(rows * scale))

    def small(band: NDArray[np.generic]) -> FloatArray:
        inside = cv2.resize(np.asarray(band, np.float32), size, interpolation=cv2.INTER_AREA)
        frame = np.zeros((SIDE_PX, SIDE_PX), np.float32)
        frame[: size[1], : size[0]] = inside
        return frame

    if scene.is_colour:
        colours = [scene.bands[scene.roles.index(role)] for role in ("red", "green", "blue")]
        rgb = np.stack([small(band) for band in colours])
    else:
        rgb = np.repeat(small(scene.grey)[None], 3, axis=0)
    nir = None if scene.nir is None else small(scene.nir)
    return Seen(normalised(rgb, nir, small(scene.valid) > 0.5), scale)


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
