"""What the crown network should say of a sample, and where that counts, per cell.

Coordinates are pixels from the corner of the top-left pixel.
"""

from __future__ import annotations

import numpy as np

CELL_PX = 2
SPREAD_CELLS = 1.5
"""Of the slope around a centre: how much less wrong an answer beside it is."""
NEAR_CELLS = 2.3
"""Offsets and radius are asked for this near to a centre."""


def targets(
    trees: np.ndarray, valid: np.ndarray, other: np.ndarray, known: np.ndarray
) -> dict[str, np.ndarray]:
    """Return where centres are, the way to them, radii, cover, and what else stands there.

    Parameters
    ----------
    trees : float array (n, 3)
        x, y and radius (or NaN), pixels.
    valid, other, known : array (rows, cols)
        Of the sample's pixels: which are picture, what stands there, where all is known.
    """
    side = len(valid) // CELL_PX
    heat = np.zeros((side, side), np.float32)
    around = np.zeros((3, side, side), np.float32)
    counts = np.zeros((2, side, side), np.float32)
    cover = np.zeros((side, side), np.float32)
    unknown = np.zeros((side, side), np.uint8)
    best = np.full((side, side), np.inf, np.float32)
    for x, y, radius in trees:
        measured = bool(np.isfinite(radius))
        r = (radius if measured else 5.0) / CELL_PX
        where, d2, du, dv = _around(x / CELL_PX, y / CELL_PX, max(r, 4), side)
        if not d2.size:
            continue
        np.maximum(heat[where], np.exp(-d2 / (2 * SPREAD_CELLS**2)), out=heat[where])
        (cover if measured else unknown)[where][d2 <= r * r] = 1
        near = (d2 <= NEAR_CELLS**2) & (d2 < best[where])
        best[where][near] = d2[near]
        for k, value in enumerate((du, dv)):
            around[k][where][near] = np.broadcast_to(value, d2.shape)[near]
        around[2][where][near] = np.log(max(r * CELL_PX, 1.0))
        counts[0][where][near] = 1
        counts[1][where][near] = float(measured)
        col, row = int(x // CELL_PX), int(y // CELL_PX)
        if 0 <= col < side and 0 <= row < side:
            heat[row, col] = 1
    seen = np.minimum.reduce(_quarters(valid)).astype(np.float32)
    # Real land holds unlabelled things: only where it is calm, or painted on, all is known.
    other_counts = seen * known[CELL_PX // 2 :: CELL_PX, CELL_PX // 2 :: CELL_PX]
    return {
        "heat": heat,
        "around": around,
        "around_counts": counts * seen,
        "cover": cover,
        "cover_counts": seen * (1 - unknown * (1 - cover)),
        "other": np.maximum.reduce(_quarters(other)),
        "other_counts": other_counts,
        "seen": seen,
    }


def _around(
    u: float, v: float, reach: float, side: int
) -> tuple[tuple[slice, slice], np.ndarray, np.ndarray, np.ndarray]:
    """Return the cells around a place, squared distances to it, and the way there, in cells."""
    whole = int(reach) + 2
    col, row = int(np.floor(u)), int(np.floor(v))
    c0, c1 = min(max(col - whole, 0), side), max(min(col + whole + 1, side), 0)
    r0, r1 = min(max(row - whole, 0), side), max(min(row + whole + 1, side), 0)
    du = np.float32(u) - (np.arange(c0, c1, dtype=np.float32) + np.float32(0.5))
    dv = np.float32(v) - (np.arange(r0, r1, dtype=np.float32) + np.float32(0.5))[:, None]
    return np.s_[r0:r1, c0:c1], du**2 + dv**2, du, dv


def _quarters(pixels: np.ndarray) -> list[np.ndarray]:
    return [pixels[i::CELL_PX, j::CELL_PX] for i in range(CELL_PX) for j in range(CELL_PX)]
