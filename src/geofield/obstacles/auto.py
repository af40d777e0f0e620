"""The default detector: evidence transform, many candidates, a fitted verifier."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geofield.obstacles.candidates import candidate_centres
from geofield.obstacles.channels import Channels, Image, channels
from geofield.obstacles.context import context_features
from geofield.obstacles.evidence import Support, perimeter_support
from geofield.obstacles.features import FeatureTable, centre_features
from geofield.obstacles.fit import fit_circles
from geofield.obstacles.rings import ring_features
from geofield.obstacles.shade import shade_direction, shade_votes
from geofield.obstacles.verifier import FloatArray, Verifier, strongest

WORKING_RESOLUTION_M = 0.6
"""Ground size of a pixel of the working grid: what the verifier was fitted at."""

WORKING_RADIUS_PX = (2.5, 15.0)
"""Radii of the perimeter support, working pixels: 1.5 to 9 m."""

WINDOW_PX = 75.0
DARK_RADII = 6
LEAST_SCORE = -3.0
"""Candidates below this score are not decided on."""


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


def cheap_measures(found: Channels, region: NDArray[np.bool_] | None = None) -> Measured:
    """Find candidates, those of a region if there is one, and measure the cheap part of them."""
    support = perimeter_support(found.evidence, WORKING_RADIUS_PX)
    # On ground as green as the crowns the index is blind: darkness has a say of its own.
    dark_support = None
    if found.variant != "grey":
        dark_support = perimeter_support(found.dark, WORKING_RADIUS_PX, DARK_RADII)
    x, y = candidate_centres(found, support, dark_support)
    if region is not None:
        within = _lies_in(region, x, y)
        x, y = x[within], y[within]
    table = centre_features(found, support, dark_support, x, y)
    return Measured(found, support, x, y, table)


def _lies_in(region: NDArray[np.bool_], x: FloatArray, y: FloatArray) -> NDArray[np.bool_]:
    rows = np.clip(np.rint(y), 0, region.shape[0] - 1).astype(np.intp)
    cols = np.clip(np.rint(x), 0, region.shape[1] - 1).astype(np.intp)
    return region[rows, cols]


def shade_of(cheap: Measured, looks: FloatArray) -> complex:
    """Return the candidates' votes on where shade falls, given what the gate says of them."""
    crown = 1 / (1 + np.exp(-np.clip(looks, -30, 30)))
    return shade_votes(cheap.found, cheap.x_px, cheap.y_px, crown**4)


def measure(
    found: Channels,
    verifier: Verifier,
    region: NDArray[np.bool_] | None = None,
    shade: complex | None = None,
) -> Measured:
    """Find candidates and measure them.

    Parameters
    ----------
    found : Channels
    verifier : Verifier
        Its gate spares the full measurement of what is clearly nothing.
    region : bool array (rows, cols), optional
        Candidates elsewhere are dropped, but vote on where shade falls.
    shade : complex, optional
        The votes on it, where they were gathered before.
    """
    # Unknown shade is voted on by all candidates, wherever they lie.
    cheap = cheap_measures(found, None if shade is None else region)
    looks = verifier.gate.evaluate(cheap.table)
    keep = verifier.gate.passes(looks)
    x, y = cheap.x_px, cheap.y_px
    if shade is None:
        shade = shade_of(cheap, looks)
        if region is not None:
            keep &= _lies_in(region, x, y)
    x, y = x[keep], y[keep]
    rings = ring_features(found, x, y, shade_direction(shade))
    return Measured(found, cheap.support, x, y, cheap.table.take(keep).beside(rings))


def detections(
    measured: Measured, score: FloatArray, spacing: FloatArray, verifier: Verifier
) -> tuple[NDArray[np.intp], FeatureTable]:
    """Return the candidates that no better one suppresses, and all that is known of each."""
    chosen = np.flatnonzero(score >= LEAST_SCORE)
    x, y = measured.x_px, measured.y_px
    reach = verifier.reach_px(spacing)
    chosen = chosen[strongest(x[chosen], y[chosen], score[chosen], reach[chosen])]
    around = context_features(x, y, score, chosen, reach[chosen])
    return chosen, around.beside(measured.table.take(chosen))


def decide(measured: Measured, verifier: Verifier, min_confidence: float) -> Trees:
    """Return the candidates that the verifier believes in, each tree once."""
    score = verifier.score.evaluate(measured.table)
    hopeful = np.flatnonzero(score >= LEAST_SCORE)
    spacing = np.zeros(score.size)
    spacing[hopeful] = verifier.spacing.evaluate(measured.table.take(hopeful))
    chosen, table = detections(measured, score, spacing, verifier)
    confidence = verifier.confidence(verifier.decision.evaluate(table))
    keep = confidence >= min_confidence
    chosen, confidence = chosen[keep], confidence[keep]
    reach = verifier.reach_px(spacing[chosen])
    x, y = measured.x_px[chosen], measured.y_px[chosen]
    x, y, radius = fit_circles(measured.found, x, y, WORKING_RADIUS_PX[1])
    return Trees(x, y, radius, confidence, reach)
