"""Crowns by a network: where their centres are, how large they are, how sure that is.

The network looks at the normalised bands on the working grid and answers for cells of two by
two pixels: is a crown's centre here, where in the cell, how large is the crown, is the cell
under a crown, does something else stand here. One crown is one answer: weaker ones within
reach of a stronger one are the same crown seen twice.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from geofield.learned import network
from geofield.model.circles import Circles
from geofield.raster import Image, is_peak

NETWORK = "crowns"
CELL_PX = 2
ALIGN_PX = 16
"""The network halves the picture four times."""
OVERLAP_PX = 112
"""No answer depends on a pixel farther away than this."""
LEAST = 0.1
"""Weaker answers of the network are no candidates."""


def answers(bands: dict[str, Image | float]) -> dict[str, Image]:
    """Run the network on bands of the working grid; return its output by name, per cell.

    Probabilities are 0 to 1, offsets in cells, the radius in pixels.
    """
    net = network(NETWORK)
    batch = net.stacked(**bands)
    rows, cols = batch.shape[2:]
    fill = ((0, 0), (0, 0), (0, -rows % ALIGN_PX), (0, -cols % ALIGN_PX))
    batch = np.pad(batch, fill, mode="edge")
    # A second look at the picture turned by half: what both see alike is more to be trusted.
    out = net(batch)[0]
    again = net(batch[:, :, ::-1, ::-1])[0][:, ::-1, ::-1].copy()
    for name in ("dx", "dy"):
        again[net.outputs.index(name)] *= -1
    out = (out + again) / 2
    out = out[:, : -(-rows // CELL_PX), : -(-cols // CELL_PX)]
    named = dict(zip(net.outputs, out, strict=True))
    for name in ("centre", "cover", "other"):
        named[name] = 1 / (1 + np.exp(-np.clip(named[name], -30, 30)))
    named["radius"] = np.exp(np.clip(named.pop("log_radius"), 0, 4))
    return named


def centres(named: dict[str, Image]) -> Circles:
    """Return the peaks of the answers, pixels of the working grid; the strength is the answer."""
    p = named["centre"]
    at = np.nonzero(is_peak(p) & (p >= LEAST))
    row, col, dx, dy, radius, strength = (
        np.asarray(v, dtype=np.float64)
        for v in (*at, named["dx"][at], named["dy"][at], named["radius"][at], p[at])
    )
    x = (col + 0.5 + np.clip(dx, -1, 1)) * CELL_PX
    y = (row + 0.5 + np.clip(dy, -1, 1)) * CELL_PX
    return Circles(x, y, radius, strength)


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
