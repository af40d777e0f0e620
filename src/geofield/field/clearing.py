"""Clearing: crowns and other small things inside an even surface give way to its look.

A row of crowns has stronger borders than most fields, and would tear a field in two. What
stands out of its neighbourhood, is small, and has the same ground all around it says nothing
about where the field ends, and is painted over with that ground. What stands between two
surfaces stays.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from geofield.field.morphology import plump

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float32]

#: How far a pixel stands out of the median around it, in units of the surface's variation.
#: At the higher levels crowns come apart from each other and from weaker borders.
_STANDS_OUT = (5.0, 10.0, 20.0)
#: Side of the square of that median, metres; and the largest thing to paint over.
_WINDOW_M, _LARGEST_M = 21.0, 45.0
#: Side of that square at least, pixels: a smaller one holds too few for a median.
_SMALLEST_WINDOW_PX = 9
#: And at most: OpenCV counts the square's pixels in 16 bits.
_LARGEST_WINDOW_PX = 255
#: Ground is one surface within this distance. So much of what is around a thing has to be; and
#: around what is painted, for the rest to be left out.
_EVEN, _AROUND_THING, _AROUND_PAINT = 5.0, 0.8, 0.6
#: Width of the ring that is looked at, pixels, and of the rim that is painted over too.
_RING_PX, _RIM_PX = 5, 2
#: Softness of the paint, pixels.
_SOFT_PX = 3.0


def clear(stack: FloatArray, pixel_m: float) -> tuple[FloatArray, BoolArray]:
    """Channels with small things inside surfaces painted over, and where these are.

    Parameters
    ----------
    stack : float32 array (channels, rows, columns)
        Whitened channels.
    pixel_m : float
        Ground size of a pixel, metres.

    Returns
    -------
    (float32 array, bool array)
    """
    import cv2

    away = _standing_out(stack, pixel_m)
    things = np.zeros(away.shape, bool)
    for level in _STANDS_OUT:
        things |= _inside_surfaces(stack, away > level, pixel_m)
    if not things.any():
        return stack, things
    ellipse = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _RIM_PX + 1,) * 2)
    # Of what stands out strongly, the rest of it too.
    things |= (cv2.dilate(things.view(np.uint8), ellipse) > 0) & (away > _STANDS_OUT[0])
    painted = cv2.dilate(things.view(np.uint8), ellipse) > 0
    return _painted(stack, painted), things


def _painted(stack: FloatArray, painted: BoolArray) -> FloatArray:
    """Channels with each part of a mask painted over with the ground beside it.

    Where most of that ground is one surface, the rest is left out: paint that ran from one
    surface into another would bridge the border between them.
    """
    import cv2

    result = stack.copy()
    count, labels, stats, _ = cv2.connectedComponentsWithStats(
        painted.view(np.uint8), connectivity=4
    )
    for number in range(1, count):
        rows, columns = _around(stats[number])
        own = labels[rows, columns] == number
        part = stack[:, rows, columns]
        ground = _ring(own) & ~painted[rows, columns]
        if not ground.any():
            continue
        even = _like_most(part[:, ground])
        if np.count_nonzero(even) > _AROUND_PAINT * len(even):
            ground[ground] = even
        at = ndimage.distance_transform_edt(~ground, return_distances=False, return_indices=True)
        near = np.moveaxis(part[:, at[0], at[1]], 0, -1)
        soft = cv2.GaussianBlur(near, (0, 0), _SOFT_PX).reshape(near.shape)
        result[:, rows, columns] = np.where(own, np.moveaxis(soft, -1, 0), result[:, rows, columns])
    return result


def _around(stats: NDArray[np.int32]) -> tuple[slice, slice]:
    """The window of a part and its ring, from OpenCV's figures of the part."""
    left, top, width, height = stats[:4]
    margin = _RING_PX + 2
    return (
        slice(max(top - margin, 0), top + height + margin),
        slice(max(left - margin, 0), left + width + margin),
    )


def _ring(own: BoolArray) -> BoolArray:
    """A part and what lies around it."""
    import cv2

    wide = 2 * (_RING_PX + 1) + 1
    ellipse = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (wide, wide))
    return np.asarray(cv2.dilate(own.view(np.uint8), ellipse) > 0)


def _like_most(ground: FloatArray) -> BoolArray:
    """Which places of some ground (channels, places) are like most of it."""
    away = ground - np.median(ground, axis=1)[:, None]
    return np.asarray(np.sqrt(np.einsum("cn,cn->n", away, away)) < _EVEN)


def _standing_out(stack: FloatArray, pixel_m: float) -> FloatArray:
    import cv2

    side = min(max(round(_WINDOW_M / pixel_m) | 1, _SMALLEST_WINDOW_PX), _LARGEST_WINDOW_PX)
    total = np.zeros(stack.shape[1:], np.float32)
    for layer in stack:
        # The median filter wants bytes: thirds of a unit are fine enough.
        middle = float(np.median(layer))
        levels = np.clip((layer - middle) * 3 + 128, 0, 255).astype(np.uint8)
        usual = (cv2.medianBlur(levels, side).astype(np.float32) - 128) / 3 + middle
        total += np.square(layer - usual)
    return np.sqrt(total)


def _inside_surfaces(stack: FloatArray, away: BoolArray, pixel_m: float) -> BoolArray:
    """What is small and has one even surface all around it."""
    import cv2

    limit = _LARGEST_M / pixel_m
    plumper = plump(away).view(np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(plumper, connectivity=4)
    beside = cv2.dilate(away.view(np.uint8), np.ones((3, 3), np.uint8)) > 0
    kept = np.zeros(count, bool)
    for number in range(1, count):
        if max(stats[number, 2:4]) > limit or stats[number, cv2.CC_STAT_AREA] < 3:
            continue
        rows, columns = _around(stats[number])
        ground = _ring(labels[rows, columns] == number) & ~beside[rows, columns]
        if np.count_nonzero(ground) >= 15:
            even = _like_most(stack[:, rows, columns][:, ground])
            kept[number] = np.count_nonzero(even) > _AROUND_THING * len(even)
    return np.asarray(kept[labels])
