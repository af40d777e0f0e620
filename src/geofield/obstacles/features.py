"""What is measured at a candidate: the columns of the verifier's table.

Every feature has a name that says what it is, so that the fitted table can be read:

- ``<map>@s``: a map smoothed by a Gaussian of s pixels, at the centre;
- ``<map>~s``: the same minus the next coarser one: does the centre stand out at this size;
- ``crown_*``: shape of what is green or dark around the centre;
- ``support_*``: perimeter support of the evidence transform;
- those of `geofield.obstacles.rings`.

None speaks of the picture as a whole: the verifier must not learn to know scenes.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from geofield.obstacles.channels import (
    Channels,
    Variant,
    gaussian,
    sample_gaussians,
    shrink,
)
from geofield.obstacles.evidence import Support

SIGMAS_PX = (0.8, 1.5, 2.5, 4.0, 7.0, 12.0)
RAW_SIGMAS_PX = (0.8, 2.5, 7.0)
_FINE = ("luma", "ndvi", "nir", "exg")
_SMOOTHED: dict[Variant, tuple[str, ...]] = {
    "nir": ("luma", "texture", "exg", "rg", "gb", "ndvi", "nir"),
    "rgb": ("luma", "texture", "exg", "rg", "gb"),
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

    def take(self, index: NDArray[np.intp] | NDArray[np.bool_]) -> FeatureTable:
        """Return chosen rows."""
        rows = np.flatnonzero(index) if index.dtype == bool else index.astype(np.intp)
        return FeatureTable(self.names, np.take(self.values.T, rows, axis=1).T)

    def beside(self, other: FeatureTable) -> FeatureTable:
        """Return the columns of two tables of the same candidates."""
        return FeatureTable(
            self.names + other.names, np.concatenate([self.values.T, other.values.T]).T
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
    return feature_table(columns, x_px.size)


def _pixels(
    found: Channels, x_px: NDArray[np.float64], y_px: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    rows = np.clip(np.rint(y_px), 0, found.dark.shape[0] - 1).astype(np.intp)
    cols = np.clip(np.rint(x_px), 0, found.dark.shape[1] - 1).astype(np.intp)
    return rows, cols


def feature_table(columns: dict[str, NDArray[np.floating]], count: int) -> FeatureTable:
    """Return columns as a table, rounded."""
    names = tuple(columns)
    # Every column in one piece of memory: candidates are always asked feature by feature.
    values = np.empty((len(names), count), dtype=np.float32)
    for i, name in enumerate(names):
        values[i] = columns[name]
    # Three decimals: rounding differences between machines stay below the thresholds.
    return FeatureTable(names, np.round(values, 3, out=values).T)


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
        distance = cv2.distanceTransform(mask.view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        depth = 2 * np.minimum(distance, 1e4, dtype=np.float32)
        top = cv2.dilate(depth, np.ones((5, 5), np.uint8))
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
