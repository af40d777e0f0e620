"""Superpixels: small pieces of even ground and the borders between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Pixels on either side of a border that are compared across it.
_DEPTH_PX = 2


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
    """

    first: IntArray
    second: IntArray
    step: NDArray[np.float32]
    ridge: NDArray[np.float32]

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
        ridge = middle - 0.5 * (low + high)
        parts.append((here[y, x].astype(np.int64), there[y, x].astype(np.int64), high - low, ridge))
    a, b = parts
    return Borders(
        np.concatenate([a[0], b[0]]),
        np.concatenate([a[1], b[1]]),
        np.concatenate([a[2], b[2]], axis=1),
        np.concatenate([a[3], b[3]], axis=1),
    )
