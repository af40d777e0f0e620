"""What is measured at a candidate: the columns of the verifier's table.

Every feature has a name that says what it is, so that the fitted table can be read:

- ``<map>@s``: a map smoothed by a Gaussian of s pixels, at the centre;
- ``<map>~s``: the same minus the next coarser one: does the centre stand out at this size;
- ``<map>ring_r_mean|std|low|high``: of sixteen samples on a ring of r pixels, minus the centre;
- ``<map>tilt_r``: how much one side of that ring differs from the other;
- ``crown_*``: shape of what is green or dark around the centre;
- ``extent_*``: how far the crown reaches in sixteen directions;
- ``support_*``: perimeter support of the evidence transform.

None speaks of the picture as a whole: the verifier must not learn to know scenes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from geofield.obstacles.channels import (
    Channels,
    Variant,
    box_mean,
    gaussian,
    sample_gaussians,
    shrink,
)
from geofield.obstacles.evidence import Support

SIGMAS_PX = (0.8, 1.5, 2.5, 4.0, 7.0, 12.0)
RAW_SIGMAS_PX = (0.8, 2.5, 7.0)
_FINE = ("luma", "ndvi", "nir", "exg")
RINGS_PX = (1.5, 3.0, 4.5, 6.0, 8.0, 10.5, 14.0, 19.0)
DIRECTIONS = 16
_CROWN_FALL = {"ndvi": 14.0, "exg": 5.0, "luma": 13.0}
"""How far a map falls (luma: rises) from the centre to what is no crown any more."""
_SMOOTHED: dict[Variant, tuple[str, ...]] = {
    "nir": ("luma", "texture", "exg", "rg", "gb", "ndvi", "nir"),
    "rgb": ("luma", "texture", "exg", "rg", "gb"),
    "grey": ("luma", "texture"),
}
_RINGED: dict[Variant, tuple[str, ...]] = {
    "nir": ("luma", "ndvi", "nir"),
    "rgb": ("luma", "exg", "gb"),
    "grey": ("luma", "texture"),
}


@dataclass(frozen=True, slots=True)
class FeatureTable:
    """Features of candidates.

    Attributes
    ----------
    names : tuple of str
    values : float32 array, shape (candidates, names)
    """

    names: tuple[str, ...]
    values: NDArray[np.float32]

    def take(self, index: NDArray[np.generic]) -> FeatureTable:
        """Return chosen rows."""
        return FeatureTable(self.names, self.values[index])

    def beside(self, other: FeatureTable) -> FeatureTable:
        """Return the columns of two tables of the same candidates."""
        return FeatureTable(
            self.names + other.names, np.concatenate([self.values, other.values], axis=1)
        )


def centre_features(
    found: Channels,
    support: Support,
    dark_support: Support | None,
    x_px: NDArray[np.float64],
    y_px: NDArray[np.float64],
) -> FeatureTable:
    """Measure the cheap part: maps at the centre and perimeter support.

    Parameters
    ----------
    found : Channels
    support : Support
        Of ``found.evidence``.
    dark_support : Support or None
        Of ``found.dark``, where it is not the evidence itself.
    x_px, y_px : float64 arrays, shape (n,)
        Candidate centres, pixel-index coordinates of the working grid.
    """
    columns: dict[str, NDArray[np.floating]] = {}
    rows, cols = _pixels(found, x_px, y_px)
    maps = {name: found.maps[name] for name in _SMOOTHED[found.variant]}
    maps["dark"] = found.dark
    if found.index is not None:
        maps["green"] = found.green
    for name, image in maps.items():
        before: NDArray[np.float32] | None = None
        # The finest width costs most and tells least where the map is noisy.
        sigmas = SIGMAS_PX if name in _FINE else SIGMAS_PX[1:]
        values = sample_gaussians(image, sigmas, rows, cols)
        for sigma, value in zip(sigmas, values, strict=True):
            if sigma in RAW_SIGMAS_PX:
                columns[f"{name}@{sigma:g}"] = value
            if before is not None:
                columns[f"{name}~{sigma:g}"] = before - value
            before = value
    _crown_mask(columns, found, rows, cols)
    _support(columns, support, x_px, y_px)
    if dark_support is not None:
        votes = dark_support.at(x_px, y_px)
        columns["dark_support_best"] = votes.max(axis=1)
        columns["dark_support_radius"] = dark_support.radii_px[votes.argmax(axis=1)]
    return _table(columns, x_px.size)


def ring_features(
    found: Channels, x_px: NDArray[np.float64], y_px: NDArray[np.float64]
) -> FeatureTable:
    """Measure the dear part: rings around the centre, and how far the crown reaches."""
    columns: dict[str, NDArray[np.floating]] = {}
    _rings(columns, found, x_px, y_px)
    return _table(columns, x_px.size)


def _pixels(
    found: Channels, x_px: NDArray[np.float64], y_px: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    rows = np.clip(np.rint(y_px), 0, found.dark.shape[0] - 1).astype(np.intp)
    cols = np.clip(np.rint(x_px), 0, found.dark.shape[1] - 1).astype(np.intp)
    return rows, cols


def _table(columns: dict[str, NDArray[np.floating]], count: int) -> FeatureTable:
    names = tuple(columns)
    values = np.empty((count, len(names)), dtype=np.float32)
    for i, name in enumerate(names):
        values[:, i] = columns[name]
    # Three decimals: rounding differences between machines stay below the thresholds.
    return FeatureTable(names, np.round(values, 3))


def _crown_mask(
    columns: dict[str, NDArray[np.floating]],
    found: Channels,
    rows: NDArray[np.intp],
    cols: NDArray[np.intp],
) -> None:
    """Shape of what is green (or dark) around the centre."""
    # Half the resolution: depths and areas need no finer one.
    image = gaussian(shrink(found.evidence, 2), 0.6)
    rows, cols = rows // 2, cols // 2
    for level in (0.5, 1.5):
        mask = image > level
        depth = 2 * ndimage.distance_transform_edt(mask).astype(np.float32)
        top = ndimage.maximum_filter(depth, 5)
        columns[f"crown_depth_{level:g}"] = depth[rows, cols]
        columns[f"crown_depth_share_{level:g}"] = depth[rows, cols] / np.maximum(top[rows, cols], 1)
        labels, count = ndimage.label(mask)
        area = 4 * np.bincount(labels.ravel(), minlength=count + 1).astype(np.float32)
        area[0] = 0
        columns[f"crown_area_{level:g}"] = np.log1p(area[labels[rows, cols]])


def _support(
    columns: dict[str, NDArray[np.floating]],
    support: Support,
    x_px: NDArray[np.float64],
    y_px: NDArray[np.float64],
) -> None:
    values = support.at(x_px, y_px)
    third = max(values.shape[1] // 3, 1)
    for name, part in (
        ("small", values[:, :third]),
        ("middle", values[:, third : 2 * third]),
        ("large", values[:, 2 * third :]),
        ("best", values),
    ):
        columns[f"support_{name}"] = part.max(axis=1) if part.shape[1] else np.zeros(x_px.size)
    columns["support_radius"] = support.radii_px[values.argmax(axis=1)]


def _rings(
    columns: dict[str, NDArray[np.floating]],
    found: Channels,
    x_px: NDArray[np.float64],
    y_px: NDArray[np.float64],
) -> None:
    angle = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    rings = np.asarray(RINGS_PX)
    dx = np.rint(rings[:, None] * np.cos(angle)).astype(np.intp)
    dy = np.rint(rings[:, None] * np.sin(angle)).astype(np.intp)
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
        mean = ring.mean(axis=1)
        std = np.sqrt(np.maximum((ring * ring).mean(axis=1) - mean * mean, 0))
        low, high = ring.min(axis=1), ring.max(axis=1)
        tilt = np.hypot(_along(ring, np.cos(angle)), _along(ring, np.sin(angle))) / DIRECTIONS
        for i, r in enumerate(RINGS_PX):
            columns[f"{name}ring_{r:g}_mean"] = mean[i]
            columns[f"{name}ring_{r:g}_std"] = std[i]
            columns[f"{name}ring_{r:g}_low"] = low[i]
            columns[f"{name}ring_{r:g}_high"] = high[i]
            if i >= 1:
                columns[f"{name}tilt_{r:g}"] = tilt[i]
        if name in ("ndvi", "exg") or (found.variant == "grey" and name == "luma"):
            # How far the crown reaches in each direction: its radius, and whether it is round.
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
