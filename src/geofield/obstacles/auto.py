"""The default detector: evidence transform, many candidates, a fitted verifier."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geofield.obstacles.candidates import candidate_centres
from geofield.obstacles.channels import Channels, Image, channels
from geofield.obstacles.evidence import Support, perimeter_support
from geofield.obstacles.features import FeatureTable, centre_features, ring_features
from geofield.obstacles.fit import fit_circles
from geofield.obstacles.verifier import FloatArray, Verifier, strongest

WORKING_RESOLUTION_M = 0.6
"""Ground size of a pixel of the working grid: what the verifier was fitted at."""

WORKING_RADIUS_PX = (2.5, 15.0)
"""Radii of the perimeter support, working pixels: 1.5 to 9 m."""

WINDOW_PX = 75.0
DARK_RADII = 6


@dataclass(frozen=True, slots=True)
class Measured:
    """Candidates of a picture with all that is measured of them (working grid)."""

    found: Channels
    support: Support
    x_px: FloatArray
    y_px: FloatArray
    table: FeatureTable


@dataclass(frozen=True, slots=True)
class Trees:
    """Detected trees, pixel-index coordinates of the working grid."""

    x_px: FloatArray
    y_px: FloatArray
    radius_px: FloatArray
    confidence: FloatArray
    reach_px: FloatArray

    def __len__(self) -> int:
        return int(self.x_px.size)


def picture_channels(
    luma: Image, rgb: tuple[Image, Image, Image] | None, nir: Image | None
) -> Channels:
    """Return the channels of a picture on the working grid."""
    return channels(luma, rgb, nir, window_px=WINDOW_PX)


def measure(
    found: Channels,
    verifier: Verifier | None,
    region: NDArray[np.bool_] | None = None,
) -> Measured:
    """Find candidates and measure them.

    Parameters
    ----------
    found : Channels
    verifier : Verifier or None
        Its gate spares the full measurement of what is clearly nothing; None for no gate.
    region : bool array (rows, cols), optional
        Candidates elsewhere are dropped.
    """
    support = perimeter_support(found.evidence, WORKING_RADIUS_PX)
    # On ground as green as the crowns the index is blind: darkness has a say of its own.
    dark_support = None
    if found.variant != "grey":
        dark_support = perimeter_support(found.dark, WORKING_RADIUS_PX, DARK_RADII)
    x, y = candidate_centres(found, support, dark_support)
    if region is not None:
        rows, cols = np.rint(y).astype(np.intp), np.rint(x).astype(np.intp)
        inside = region[
            np.clip(rows, 0, region.shape[0] - 1), np.clip(cols, 0, region.shape[1] - 1)
        ]
        x, y = x[inside], y[inside]
    table = centre_features(found, support, dark_support, x, y)
    if verifier is not None:
        keep = verifier.gate.passes(table)
        x, y, table = x[keep], y[keep], table.take(keep)
    table = table.beside(ring_features(found, x, y))
    return Measured(found, support, x, y, table)


def decide(measured: Measured, verifier: Verifier, min_confidence: float) -> Trees:
    """Return the candidates that the verifier believes in, each tree once."""
    score = verifier.score.evaluate(measured.table)
    confidence = verifier.confidence(score)
    chosen = np.flatnonzero(confidence >= min_confidence)
    x, y = measured.x_px[chosen], measured.y_px[chosen]
    reach = verifier.reach_px(measured.table.take(chosen))
    keep = strongest(x, y, score[chosen], reach)
    x, y, confidence = x[keep], y[keep], confidence[chosen][keep]
    x, y, radius = fit_circles(measured.found, x, y, WORKING_RADIUS_PX[1])
    return Trees(x, y, radius, confidence, reach[keep])
