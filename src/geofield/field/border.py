"""Border: what a picture shows along an outline, in numbers.

A field's border is strong against what the field has inside, all along it, and its outline is
plain. Strengths are logarithms in units of the ground's own variation (see `whiten`), so that they
carry over to other pictures.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon

from geofield.field.frame import Frame
from geofield.field.straight import ring
from geofield.raster import bilinear

FloatArray = NDArray[np.float64]

#: The border is looked for this far from the outline, pixels; and inside it for comparison.
_AT_PX, _INSIDE_PX = (-2.0, 0.0, 2.0), (-7.0, -11.0)
#: What is compared across a border stands this far from it, pixels.
_ACROSS_PX = 2.5
#: Steps across a border are averaged along so much of it, pixels.
_ALONG_PX = 15
#: Most places along an outline that are looked at, and the fewest that say anything.
_MOST_PLACES, _FEWEST_PLACES = 800, 12
#: An outline of fewer pixels is a mere scrap.
_SCRAP_PX = 125.0
#: Places this near the end of the picture show no border, pixels.
_FRAME_PX = 2.0
#: A side is long from this share of the field's width on.
_LONG = 0.15


def measure(layers: NDArray[np.float32], outline: Polygon, frame: Frame) -> dict[str, float] | None:
    """The figures of an outline by name; None for a mere scrap.

    Parameters
    ----------
    layers : float32 array (rows, columns, channels)
        Whitened channels, small things painted over.
    outline : Polygon
        Pixel coordinates, no holes.
    frame : Frame
        Where the picture ends.
    """
    vertices = ring(outline)
    side = np.concatenate([vertices[1:], vertices[:1]]) - vertices
    length = np.hypot(*side.T)
    places, outward = _places(vertices, side, length, frame)
    if len(places) < _FEWEST_PLACES or outline.area < _SCRAP_PX:
        return None
    long = length >= _LONG * math.sqrt(outline.area)
    return {
        **_along(layers, places, outward),
        "long_sides_share": float(length[long].sum() / length.sum()),
        "vertices": math.log(len(side)),
    }


def _places(
    vertices: FloatArray, side: FloatArray, length: FloatArray, frame: Frame
) -> tuple[FloatArray, FloatArray]:
    """Points along an outline off the frame, a pixel apart, with outward directions."""
    steps = np.maximum(np.rint(length).astype(int), (length > 1e-6).astype(int))
    index = np.repeat(np.arange(len(vertices)), steps)
    number = np.arange(len(index)) - np.repeat(np.cumsum(steps) - steps, steps)
    places = vertices[index] + ((number + 0.5) / steps[index])[:, None] * side[index]
    outward = (side[:, ::-1] * [1, -1] / np.maximum(length, 1e-9)[:, None])[index]
    kept = ~frame.near(places, _FRAME_PX)
    places, outward = places[kept], outward[kept]
    if len(places) > _MOST_PLACES:
        chosen = np.linspace(0, len(places) - 1, _MOST_PLACES).astype(int)
        places, outward = places[chosen], outward[chosen]
    return places, outward


def _along(
    layers: NDArray[np.float32], places: FloatArray, outward: FloatArray
) -> dict[str, float]:
    """Strength at the outline against what is inside it."""
    offsets = np.array([*_AT_PX, *_INSIDE_PX])
    away = (offsets + np.array([[-_ACROSS_PX], [0.0], [_ACROSS_PX]])).reshape(-1, 1)
    x, y = (place + away * out for place, out in zip(places.T, outward.T, strict=True))
    low, middle, high = bilinear(layers, x, y).reshape(3, len(offsets), len(places), -1)
    # A step, or a ridge between like grounds: a fence, a track, a ditch.
    changes = _smoothed(np.stack([high - low, middle - 0.5 * (low + high)]))
    strength = np.sqrt(np.einsum("...c,...c->...", changes, changes)).max(axis=0)
    at, within = strength[: len(_AT_PX)], strength[len(_AT_PX) :]
    base = math.log(max(float(np.median(within)), 0.4) + 0.3)
    own, inside = (np.sort(np.log(each.max(axis=0) + 0.3)) for each in (at, within))
    count = len(places)
    return {
        "strength_25_above_inside": float(own[int(0.25 * count)]) - base,
        "strength_50_above_inside": float(own[int(0.5 * count)]) - base,
        "inside_95_above_border": float(inside[int(0.95 * count)] - own.mean()),
    }


def _smoothed(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Running means along the places, the axis before the last; shorter ones at the ends."""
    import cv2

    count = values.shape[-2]
    half = min(_ALONG_PX, count) // 2
    at = np.arange(count)
    held = np.minimum(at, half) + np.minimum(at[::-1], half) + 1
    total = cv2.boxFilter(
        values.reshape(-1, *values.shape[-2:]),
        cv2.CV_64F,
        (2 * half + 1, 1),
        normalize=False,
        borderType=cv2.BORDER_CONSTANT,
    )
    return np.asarray(total.reshape(values.shape) / held[:, None], np.float32)
