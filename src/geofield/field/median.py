"""Median: of arrays that hold numbers alone, so often that NumPy's care for others is too long."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Real = TypeVar("Real", np.float32, np.float64)


def median(values: NDArray[Real]) -> NDArray[Real]:
    """The same as NumPy's along the last axis, in a fraction of its time.

    Parameters
    ----------
    values : float array (..., n)
        No NaN; n of at least 1.
    """
    ordered, count = np.sort(values), values.shape[-1]
    return np.asarray(0.5 * (ordered[..., (count - 1) // 2] + ordered[..., count // 2]))
