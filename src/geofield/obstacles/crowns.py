"""Crowns by a network: where their centres are, how large they are, how sure that is.

The network looks at the normalised bands on the working grid and answers for cells of two by
two pixels: is a crown's centre here, which way from here is it, how large is the crown, is the
cell under a crown, does something else stand here. Where exactly a centre is, is often in doubt,
and then several cells share one answer: each votes for the place it points to, and a crown is
where most votes fall. One crown is one answer: weaker ones within reach of a stronger one are
the same crown seen twice.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from geofield.learned import network
from geofield.model.circles import Circles
from geofield.raster import Image, is_peak, smoothed

NETWORK = "crowns"
CELL_PX = 2
ALIGN_PX = 16
"""The network halves the picture four times."""
OVERLAP_PX = 144
"""No answer depends on a pixel farther away than this."""
LEAST = 0.01
"""Cells that answer less do not vote."""
LEAST_VOTES = 0.47
"""Places with fewer votes are no candidates."""
SPREAD_CELLS = 2.25
"""How near to each other votes fall that mean one crown."""
REACH_CELLS = 5.0
"""No cell votes for a place farther from it."""
RIM_CELLS = 10


def answers(bands: dict[str, Image | float]) -> dict[str, Image]:
    """Run the network on bands of the working grid; return its output by name, per cell.

    Probabilities are 0 to 1, offsets in cells, the radius in pixels.
    """
    net = network(NETWORK)
    batch = net.stacked(**bands)
    rows, cols = batch.shape[2:]
    fill = ((0, 0), (0, 0), (0, -rows % ALIGN_PX), (0, -cols % ALIGN_PX))
    batch = np.pad(batch, fill, mode="edge")
    out = net(batch)[0][:, : -(-rows // CELL_PX), : -(-cols // CELL_PX)]
    named = dict(zip(net.outputs, out, strict=True))
    for name in ("centre", "cover", "other"):
        named[name] = 1 / (1 + np.exp(-np.clip(named[name], -30, 30)))
    named["radius"] = np.exp(np.clip(named.pop("log_radius"), 0, 4))
    return named


def centres(named: dict[str, Image]) -> Circles:
    """Return where most votes fall, pixels of the working grid; the strength is their number."""
    p = named["centre"]
    row, col = np.nonzero(p >= LEAST)
    voters = p[row, col]
    way = (np.clip(named[d][row, col], -REACH_CELLS, REACH_CELLS) for d in ("dx", "dy"))
    # Crowns beyond the picture's border take their votes with them.
    x, y = (here + there + RIM_CELLS for here, there in zip((col, row), way, strict=True))
    shape = tuple(n + 2 * RIM_CELLS for n in p.shape)
    votes = _fallen(x, y, voters, shape)
    at = np.nonzero(is_peak(votes) & (votes >= LEAST_VOTES))
    size = _fallen(x, y, voters * np.log(named["radius"][row, col]), shape)
    strength = votes[at].astype(np.float64)
    y_px, x_px = (
        (at[axis] + 0.5 + _between(votes, at, axis) - RIM_CELLS) * CELL_PX for axis in (0, 1)
    )
    return Circles(x_px, y_px, np.exp(size[at] / strength), strength)


def _fallen(x: Image, y: Image, weight: Image, shape: tuple[int, ...]) -> Image:
    """Return the sum of the votes around each cell (rows, cols); x and y in cells."""
    left, top = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
    count = np.zeros(shape[0] * shape[1])
    for right in (0, 1):
        for below in (0, 1):
            # A place between four cells is shared among them.
            share = np.abs(1 - right - (x - left)) * np.abs(1 - below - (y - top))
            where = (top + below) * shape[1] + left + right
            count += np.bincount(where, weight * share, count.size)
    around = smoothed(count.reshape(shape).astype(np.float32), SPREAD_CELLS)
    return np.asarray(around * np.float32(2 * np.pi * SPREAD_CELLS**2), dtype=np.float32)


def _between(votes: Image, at: tuple[NDArray[np.intp], ...], axis: int) -> NDArray[np.float64]:
    """Return how far beside its cell each maximum lies along an axis, by a parabola."""
    padded = np.pad(votes, 1, mode="edge").astype(np.float64)
    row, col = at[0] + 1, at[1] + 1
    step = np.array([axis == 0, axis == 1], dtype=np.intp)
    before, here, after = (padded[row + k * step[0], col + k * step[1]] for k in (-1, 0, 1))
    curve = before - 2 * here + after
    offset = 0.5 * (before - after) / np.where(curve < 0, curve, -1.0)
    return np.asarray(np.clip(np.where(curve < 0, offset, 0.0), -0.5, 0.5), dtype=np.float64)


def once_each(crowns: Circles, share: float, least_px: float) -> Circles:
    """Return the crowns, strongest first, that no stronger one has within its reach.

    Parameters
    ----------
    crowns : Circles
    share : float
        Of the larger of two radii: nearer than that, two answers are one crown.
    least_px : float
        The reach of the smallest crowns.
    """
    # Equal ones by place, so that the order of the windows does not matter.
    crowns = crowns.take(np.lexsort((crowns.x_px, crowns.y_px, -crowns.strength)))
    if len(crowns) < 2:
        return crowns
    points = np.column_stack([crowns.x_px, crowns.y_px])
    farthest = max(share * float(crowns.radius_px.max()), least_px)
    pairs = np.sort(cKDTree(points).query_pairs(farthest, output_type="ndarray"), axis=1)
    apart = np.hypot(*(points[pairs[:, 0]] - points[pairs[:, 1]]).T)
    larger = crowns.radius_px[pairs].max(axis=1)
    pairs = pairs[apart < np.maximum(share * larger, least_px)]
    keep = np.ones(len(crowns), dtype=bool)
    # In the order of the stronger ones: a crown that is dropped drops nobody.
    for stronger, weaker in pairs[np.argsort(pairs[:, 0], kind="stable")].tolist():
        if keep[stronger]:
            keep[weaker] = False
    return crowns.take(keep)
