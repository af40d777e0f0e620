"""Refine: an outline found in a reduced picture, set onto the borders of the picture itself.

Each side is moved and turned a little, to where the step across it is strongest along most
of its length; the sides' meetings are the new corners.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon
from shapely.affinity import scale

from geofield.field.evidence import channels, whiten
from geofield.field.frame import Frame
from geofield.field.points import Points, obeys
from geofield.field.straight import meeting, ring
from geofield.model import Scene
from geofield.raster import bilinear

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]

#: How far a side may move at first, pixels; then so many pixels of the coarser picture.
_REACH_PX, _REACH_COARSE = 2.5, 1.25
#: Sides are set in a picture of at most so many pixels a side. Lines are exact to a fraction of
#: a pixel there, and a larger one costs gigabytes.
_FINEST_PX = 2500
#: Sides below this length move with their neighbours, pixels.
_MOVED_PX = 10.0
#: Spacing of the places tried across a side, pixels.
_FINE_PX = 0.5
#: Half the distance over which a step is seen, and the smoothing across it, pixels; the
#: stretch along a side in which it is averaged.
_ACROSS_PX, _SMOOTH_PX, _ALONG_PX = 1.0, 1.0, 9
#: How much a side at the end of its reach has to be stronger than one that stays.
_STAY = 0.2
#: A side that stays this near the picture's frame is the frame, pixels.
_FRAME_PX = 2.5


def carried(
    scene: Scene,
    outlines: Sequence[Polygon],
    factor: int,
    include: Points,
    exclude: Points = (),
    *,
    times: int = 1,
) -> list[BoolArray]:
    """The pixels of a scene within each of some outlines that were found in its reduced picture.

    One that obeys the points, and would no longer, stays where it was found.

    Parameters
    ----------
    scene : Scene
    outlines : sequence of Polygon
        Pixel coordinates of the reduced picture.
    factor : int
        Pixels of the scene along one of the reduced picture.
    include, exclude : sequence of (float, float)
        The seed and further points that belong, points that do not; pixel coordinates of the
        reduced picture.
    times : int
        So many pixels of the scene were made along one that it came with.
    """
    size, reach = factor, _REACH_PX
    finest = math.ceil(max(scene.grid.shape) / _FINEST_PX)
    while True:
        points = [
            [(x * factor / size, y * factor / size) for x, y in some] for some in (include, exclude)
        ]
        frame = Frame.of(scene, size, points[0][0], times)
        stack = whiten(channels(scene, size), points[0][0], frame.inside)
        layers = np.ascontiguousarray(np.moveaxis(stack, 0, -1))
        moved = [aligned(one, layers, reach, frame) for one in outlines]
        outlines = [
            one if obeys(one, *points) and not obeys(new, *points) else new
            for one, new in zip(outlines, moved, strict=True)
        ]
        if size <= finest:
            return [
                within(scale(one, size, size, origin=(0, 0)), scene.grid.shape) for one in outlines
            ]
        finer = finest if size <= 4 * finest else math.ceil(size / 4)
        ratio = size / finer
        outlines = [scale(one, ratio, ratio, origin=(0, 0)) for one in outlines]
        size, reach = finer, _REACH_COARSE * ratio


def within(outline: Polygon, shape: tuple[int, int]) -> BoolArray:
    """The pixels whose centres are in an outline."""
    from rasterio.features import rasterize

    return np.asarray(rasterize([(outline, 1)], shape, dtype=np.uint8) > 0)


def aligned(
    outline: Polygon, layers: NDArray[np.float32], reach_px: float, frame: Frame
) -> Polygon:
    """An outline with its sides moved onto the strongest border within reach.

    Parameters
    ----------
    outline : Polygon
        Pixel coordinates of the layers.
    layers : float32 array (rows, columns, channels)
        Whitened channels.
    reach_px : float
    frame : Frame
        Where the picture ends.
    """
    size = frame.shape[::-1]
    start = frame.onto(np.clip(ring(outline), 0, size), _FRAME_PX)
    end = np.roll(start, -1, axis=0)
    framed = frame.near(start, 0.75) & frame.near(end, 0.75)
    framed &= frame.near(0.5 * (start + end), 0.75)
    long = (np.hypot(*(end - start).T) >= _MOVED_PX) & ~framed
    sides = [
        _moved(a, b, layers, reach_px) if moves else (a, b)
        for a, b, moves in zip(start, end, long, strict=True)
    ]
    firm = long | framed
    corners = []
    for at in range(len(sides)):
        before, after = sides[at - 1], sides[at]
        if firm[at - 1] and firm[at]:
            one, other = ((a, b - a) for a, b in (before, after))
            corner = meeting(one, other, start[at], 3.0 * reach_px)
            corners.append(0.5 * (before[1] + after[0]) if corner is None else corner)
        else:
            corners.append(before[1] if firm[at - 1] else after[0])
    polygon = Polygon(np.clip(corners, 0, size))
    return polygon if polygon.is_valid and polygon.area > 0.5 * outline.area else outline


def _moved(
    a: FloatArray, b: FloatArray, layers: NDArray[np.float32], reach_px: float
) -> tuple[FloatArray, FloatArray]:
    """A side's ends, each moved across it to where the border is strongest."""
    import cv2

    length = float(np.hypot(*(b - a)))
    along = (b - a) / length
    across = np.array([along[1], -along[0]])
    count = max(round(length), 2)
    share = (np.arange(count) + 0.5) / count
    steps, half = round(reach_px / _FINE_PX), round(_ACROSS_PX / _FINE_PX)
    away = np.arange(-steps - half, steps + half + 1) * _FINE_PX
    places = a + share[:, None] * (b - a)
    at = places + away[:, None, None] * across
    seen = bilinear(layers, at[..., 0], at[..., 1])
    # Averaged along the side, smoothed across it: the step is largest at its middle.
    smooth = [
        cv2.GaussianBlur(
            cv2.blur(layer, (min(_ALONG_PX, count), 1), borderType=cv2.BORDER_REPLICATE),
            (1, 0),
            sigmaX=0.0,
            sigmaY=_SMOOTH_PX / _FINE_PX,
            borderType=cv2.BORDER_REPLICATE,
        )
        for layer in np.moveaxis(seen, -1, 0)
    ]
    step = np.stack([layer[2 * half :] - layer[: -2 * half] for layer in smooth])
    # The root: one crown on the border does not outweigh the rest of it.
    strength = np.sqrt(np.sqrt(np.sum(step * step, axis=0)))
    offsets = np.arange(-steps, steps + 1)
    stay = 1.0 - _STAY * (offsets / steps) ** 2
    # Every pair of offsets at the two ends.
    one, other = (part.ravel() for part in np.meshgrid(offsets, offsets, indexing="ij"))
    rows = np.rint(one[:, None] + share * (other - one)[:, None]).astype(int) + steps
    value = strength[rows, np.arange(count)].mean(axis=1)
    best = np.argmax(value * 0.5 * (stay[one + steps] + stay[other + steps]))
    return a + one[best] * _FINE_PX * across, b + other[best] * _FINE_PX * across
