"""Rings around a candidate, laid out from its shade to its sunny side.

- ``<map>ring_r_mean|std|low|high``: of sixteen samples on a ring of r pixels, minus the centre;
- ``<map>ring_r_shade|half_shade|side|half_sun|sun``: the same in sectors, from where shade
  falls to where the sun comes from, both flanks together;
- ``<map>tilt_r``: how much one side of that ring differs from the other;
- ``extent_*``: how far the crown reaches in sixteen directions.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from geofield.obstacles.channels import Channels, Variant, box_mean
from geofield.obstacles.features import FeatureTable, feature_table

RINGS_PX = (1.5, 3.0, 4.5, 6.0, 8.0, 10.5, 14.0, 19.0)
DIRECTIONS = 16
SECTORS: dict[str, tuple[int, ...]] = {
    "shade": (15, 0, 1),
    "half_shade": (2, 3, 13, 14),
    "side": (4, 12),
    "half_sun": (5, 6, 10, 11),
    "sun": (7, 8, 9),
}
"""Directions of a ring, counted from where shade falls."""

_CROWN_FALL = {"ndvi": 14.0, "exg": 5.0, "luma": 13.0}
"""How far a map falls (luma: rises) from the centre to what is no crown any more."""
_RINGED: dict[Variant, tuple[str, ...]] = {
    "nir": ("luma", "ndvi", "nir"),
    "rgb": ("luma", "exg", "gb"),
    "grey": ("luma", "texture"),
}


def ring_features(
    found: Channels, x_px: NDArray[np.float64], y_px: NDArray[np.float64], shade_rad: float
) -> FeatureTable:
    """Measure rings around the centre, and how far the crown reaches.

    Parameters
    ----------
    found : Channels
    x_px, y_px : float64 arrays, shape (n,)
        Candidate centres, pixel-index coordinates of the working grid.
    shade_rad : float
        Where shade falls, radians from right to down.
    """
    columns: dict[str, NDArray[np.floating]] = {}
    angle = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    rings = np.asarray(RINGS_PX)
    # Rounded first, so that a cosine's last digit never moves a sample.
    dx = np.rint(np.round(rings[:, None] * np.cos(angle + shade_rad), 6)).astype(np.intp)
    dy = np.rint(np.round(rings[:, None] * np.sin(angle + shade_rad), 6)).astype(np.intp)
    reach = int(rings[-1]) + 2
    rows = np.rint(y_px).astype(np.intp) + reach
    cols = np.rint(x_px).astype(np.intp) + reach
    for name in _RINGED[found.variant]:
        smooth = box_mean(found.maps[name], 3)
        padded = np.pad(smooth, reach, mode="edge")
        width = padded.shape[1]
        # Candidates last: sums over directions then run along whole rows of memory.
        flat = (dy * width + dx)[..., None] + (rows * width + cols)
        ring = padded.ravel()[flat]
        ring -= padded[rows, cols]
        _statistics(columns, name, ring, angle)
        if name in ("ndvi", "exg") or (found.variant == "grey" and name == "luma"):
            _extent(columns, name, ring)
    return feature_table(columns, x_px.size)


def _statistics(
    columns: dict[str, NDArray[np.floating]],
    name: str,
    ring: NDArray[np.float32],
    angle: NDArray[np.float64],
) -> None:
    """Describe the rings of one map, an array (rings, directions, candidates)."""
    mean = ring.mean(axis=1)
    std = np.sqrt(np.maximum((ring * ring).mean(axis=1) - mean * mean, 0))
    low, high = ring.min(axis=1), ring.max(axis=1)
    tilt = np.hypot(_along(ring, np.cos(angle)), _along(ring, np.sin(angle))) / DIRECTIONS
    sectors = {key: ring[:, list(part)].mean(axis=1) for key, part in SECTORS.items()}
    for i, r in enumerate(RINGS_PX):
        columns[f"{name}ring_{r:g}_mean"] = mean[i]
        columns[f"{name}ring_{r:g}_std"] = std[i]
        columns[f"{name}ring_{r:g}_low"] = low[i]
        columns[f"{name}ring_{r:g}_high"] = high[i]
        for key, sector in sectors.items():
            columns[f"{name}ring_{r:g}_{key}"] = sector[i]
        if i >= 1:
            columns[f"{name}tilt_{r:g}"] = tilt[i]


def _extent(columns: dict[str, NDArray[np.floating]], name: str, ring: NDArray[np.float32]) -> None:
    """How far the crown reaches in each direction: its radius, and whether it is round."""
    rings = np.asarray(RINGS_PX)
    sign = -1.0 if name == "luma" else 1.0
    fall = -sign * ring > _CROWN_FALL[name]
    extent = np.where(fall.any(axis=0), rings[fall.argmax(axis=0)], 1.3 * rings[-1])
    extent = np.ascontiguousarray(extent.T)
    columns["extent_mean"] = extent.mean(axis=1)
    columns["extent_std"] = extent.std(axis=1)
    columns["extent_low"] = extent.min(axis=1)
    across = extent[:, : DIRECTIONS // 2] + extent[:, DIRECTIONS // 2 :]
    columns["extent_across_low"] = across.min(axis=1)
    columns["extent_across_ratio"] = across.min(axis=1) / across.max(axis=1)


def _along(ring: NDArray[np.float32], wave: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the sum over the directions (second axis), each weighted by a wave."""
    return np.asarray(np.einsum("rdn,d->rn", ring, wave.astype(np.float32)), dtype=np.float32)
