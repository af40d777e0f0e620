"""Cuts: the ground that the network takes for the field, ended where the picture shows a border.

Each superpixel belongs to the field or not; what the network says of it counts by its size, and
two neighbours that are told apart cost by their common border: little across a strong one. The
cheapest division is a minimum cut of a graph (Greig, Porteous and Seheult 1989).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import logit

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

#: A border of this strength costs 1/e of what one costs that is none.
_SOFT = 3.0
#: Log odds count up to here.
_SURE = 3.0
#: Capacities are whole numbers: parts of one; and what a point says.
_PARTS, _NEVER = 10.0, 10**7


def divided(
    likely: FloatArray,
    size_px: FloatArray,
    pairs: tuple[IntArray, IntArray, FloatArray, FloatArray],
    wanted: Sequence[int],
    unwanted: Sequence[int],
    terms: Sequence[tuple[float, float]],
) -> list[BoolArray]:
    """The superpixels of the field, on each of some terms.

    Parameters
    ----------
    likely, size_px : float array (superpixels,)
        How likely each belongs to the field; its pixels.
    pairs : (first, second, length px, strength)
        Neighbours.
    wanted, unwanted : sequence of int
        Superpixels that belong and that do not, whatever else speaks.
    terms : sequence of (price, favour)
        The price of a pixel of border where the picture shows none, in pixels of log odds of
        one; and log odds added everywhere.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order, maximum_flow

    first, second, length, strength = pairs
    count = len(size_px)
    everyone, field, other = np.arange(count), np.full(count, count), np.full(count, count + 1)
    ends = (
        np.concatenate([first, second, field, everyone]),
        np.concatenate([second, first, everyone, other]),
    )
    # The terms change what edges carry, not which there are.
    number = csr_array((np.arange(len(ends[0])), ends), shape=(count + 2, count + 2))
    shape = number.indices, number.indptr
    soft = length * np.exp(-strength / _SOFT)
    odds = logit(np.clip(likely, 1e-6, 1 - 1e-6))
    found = []
    for price, favour in terms:
        across = np.rint(_PARTS * price * soft)
        own = np.rint(_PARTS * size_px * np.clip(odds + favour, -_SURE, _SURE))
        own[list(unwanted)], own[list(wanted)] = -_NEVER, _NEVER
        capacity = np.concatenate([across, across, np.maximum(own, 0), np.maximum(-own, 0)])
        graph = csr_array((capacity[number.data].astype(np.int32), *shape))
        left = graph - maximum_flow(graph, count, count + 1).flow
        left.data[left.data < 0] = 0
        left.eliminate_zeros()
        members = np.zeros(count + 2, bool)
        members[breadth_first_order(left, count, return_predecessors=False)] = True
        found.append(members[:count])
    return found
