"""Superpixels: small pieces of even ground and the borders between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.spatial import cKDTree

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Pixels on either side of a border that are compared across it.
_DEPTH_PX = 2
#: Neighbourhood in which a border's contrast is averaged and its straightness seen, pixels.
_ALONG_PX = 15.0
#: Scatter of a border about its own line that still counts as straight, pixels.
_STRAIGHT_PX = 1.5
#: Long borders are measured at this many places.
_MOST_PLACES = 1200


def superpixels(gradient: NDArray[np.float32], step_px: int) -> NDArray[np.int32]:
    """Watershed pieces, one to a cell of a square lattice, numbered from 0.

    Parameters
    ----------
    gradient : float32 array (rows, columns)
    step_px : int
        Side of a cell, pixels; each piece grows from the cell's calmest pixel.
    """
    from skimage.segmentation import watershed

    rows, columns = gradient.shape
    more = ((-rows) % step_px, (-columns) % step_px)
    padded = np.pad(gradient, ((0, more[0]), (0, more[1])), constant_values=np.inf)
    cells = padded.reshape(padded.shape[0] // step_px, step_px, -1, step_px).swapaxes(1, 2)
    calmest = cells.reshape(*cells.shape[:2], -1).argmin(axis=2)
    row, column = np.indices(calmest.shape) * step_px
    row, column = row + calmest // step_px, column + calmest % step_px
    markers = np.zeros(gradient.shape, np.int32)
    markers[row.ravel(), column.ravel()] = np.arange(1, calmest.size + 1)
    return np.asarray(watershed(gradient, markers) - 1, np.int32)


@dataclass(frozen=True, eq=False)
class Borders:
    """Every pixel side between two superpixels (n of them), and what it shows.

    Attributes
    ----------
    first, second : int array (n,)
        The superpixels on its two sides.
    step : float array (channels, n)
        Second minus first, a few pixels away from the side.
    ridge : float array (channels, n)
        The side itself minus the mean of both: a fence, a track, a ditch.
    xy : float array (n, 2)
        Pixel coordinates of its middle.
    """

    first: IntArray
    second: IntArray
    step: NDArray[np.float32]
    ridge: NDArray[np.float32]
    xy: FloatArray

    def pairs(self, count: int) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
        """Neighbours among `count` superpixels: first, second, length px, strength.

        The strength is the length of the mean step or ridge vector: noise and rows cancel
        along a border, a real change does not.
        """
        swap = self.first > self.second
        low = np.where(swap, self.second, self.first)
        high = np.where(swap, self.first, self.second)
        keys, index = np.unique(low * count + high, return_inverse=True)
        length = np.bincount(index).astype(float)
        sign = np.where(swap, -1.0, 1.0)
        step, ridge = np.zeros(len(keys)), np.zeros(len(keys))
        for one, other in zip(self.step, self.ridge, strict=True):
            step += np.square(np.bincount(index, one * sign) / length)
            ridge += np.square(np.bincount(index, other) / length)
        return keys // count, keys % count, length, np.sqrt(np.maximum(step, ridge))

    def along(self, side: NDArray[np.int8]) -> BorderLine | None:
        """What the border between two sets of superpixels shows along its way.

        Parameters
        ----------
        side : int8 array
            Per superpixel +1 (one set), -1 (the other) or 0 (neither).
        """
        one, other = side[self.first], side[self.second]
        at = np.flatnonzero(one * other < 0)
        if len(at) < 8:
            return None
        length_px = len(at)
        if length_px > _MOST_PLACES:
            at = at[np.linspace(0, length_px - 1, _MOST_PLACES).astype(int)]
        xy = self.xy[at]
        close = cKDTree(xy).query_pairs(_ALONG_PX, output_type="ndarray")
        own = np.arange(len(at))
        rows = np.concatenate([close[:, 0], close[:, 1], own])
        columns = np.concatenate([close[:, 1], close[:, 0], own])
        shape = (len(at), len(at))
        near = coo_array((np.ones(len(rows), np.float32), (rows, columns)), shape).tocsr()
        x, y = (xy - xy.mean(axis=0)).T
        step = self.step[:, at] * np.where(one[at] > 0, 1, -1)
        columns_of = [*step, *self.ridge[:, at], x, y, x * x, y * y, x * y]
        mean = (near @ np.stack(columns_of, axis=1)) / near.sum(axis=1)[:, None]
        half = len(step)
        strength = np.maximum(
            np.linalg.norm(mean[:, :half], axis=1), np.linalg.norm(mean[:, half : 2 * half], axis=1)
        )
        mx, my, mxx, myy, mxy = mean[:, 2 * half :].T
        sxx, syy, sxy = mxx - mx * mx, myy - my * my, mxy - mx * my
        thickness = (sxx + syy) / 2 - np.hypot((sxx - syy) / 2, sxy)
        straight = np.exp(-np.maximum(thickness, 0) / _STRAIGHT_PX**2)
        return BorderLine(strength, straight, length_px)


@dataclass(frozen=True, eq=False)
class BorderLine:
    """A border's strength and straightness (0..1) at places along it; its length, px."""

    strength: FloatArray
    straight: FloatArray
    length_px: int


def borders(labels: NDArray[np.int32], stack: NDArray[np.float32]) -> Borders:
    """The borders between superpixels, measured in whitened channels."""
    reach = _DEPTH_PX + 1
    padded = np.pad(stack, ((0, 0), (reach, reach), (reach, reach)), mode="edge")
    parts = []
    for down, right in ((1, 0), (0, 1)):
        rows, columns = labels.shape
        here, there = labels[: rows - down, : columns - right], labels[down:, right:]
        y, x = np.nonzero(here != there)
        yp, xp = y + reach, x + reach
        low = padded[:, yp - _DEPTH_PX * down, xp - _DEPTH_PX * right]
        high = padded[:, yp + reach * down, xp + reach * right]
        middle = 0.5 * (padded[:, yp, xp] + padded[:, yp + down, xp + right])
        xy = np.column_stack([x + 0.5 + 0.5 * right, y + 0.5 + 0.5 * down])
        ridge = middle - 0.5 * (low + high)
        parts.append(
            (here[y, x].astype(np.int64), there[y, x].astype(np.int64), high - low, ridge, xy)
        )
    a, b = parts
    return Borders(
        np.concatenate([a[0], b[0]]),
        np.concatenate([a[1], b[1]]),
        np.concatenate([a[2], b[2]], axis=1),
        np.concatenate([a[3], b[3]], axis=1),
        np.concatenate([a[4], b[4]]),
    )
