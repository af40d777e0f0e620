"""Circular Hough transforms with one accumulator: PhaseCode and TwoStage.

PhaseCode (T. J. Atherton, D. J. Kerbyson, "Size invariant circle detection", Image and
Vision Computing 17, 1999) writes the radius of every vote into its phase, so that one
complex picture holds centres and radii. TwoStage finds the centres from plain votes and then
measures each radius on a histogram of the distances of the edge pixels around it.
"""

from __future__ import annotations

from typing import Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from geofield.errors import ObstacleError, refuse_unknown
from geofield.model.circles import Circles, checked_range
from geofield.study.accumulator import (
    RADIUS_STEP_PX,
    EdgePixels,
    Polarity,
    accumulate,
    evenly,
    smooth,
    voting_pixels,
)
from geofield.study.peaks import plateau_labels

CircleMethod = Literal["phase_code", "two_stage"]
CIRCLE_METHODS: tuple[CircleMethod, ...] = get_args(CircleMethod)
DEFAULT_SENSITIVITY = 0.85


def find_circles(
    image: NDArray[np.generic],
    radius_px: tuple[float, float],
    *,
    polarity: Polarity = "bright",
    sensitivity: float = DEFAULT_SENSITIVITY,
    edge_threshold: float | None = None,
    method: CircleMethod = "phase_code",
) -> Circles:
    """Find circles in a grey or logical picture.

    Parameters
    ----------
    image : array, shape (rows, cols)
        Integers are scaled to 0..1.
    radius_px : (low, high)
        Radii in pixels. The transform is at its best with ``low > 5`` and ``high < 3 low``,
        which the study's own 4 to 18 are not.
    polarity : {"bright", "dark"}
        Of the circles against what is around them.
    sensitivity : float
        0..1; larger finds weaker circles.
    edge_threshold : float, optional
        Share of the largest gradient above which pixels vote; default Otsu's.
    method : {"phase_code", "two_stage"}

    Returns
    -------
    Circles
        Strongest first, none when no peak stands out.

    Raises
    ------
    ObstacleError
        For an impossible range, sensitivity, threshold, polarity or method.
    """
    radii = evenly(*checked_range(radius_px), RADIUS_STEP_PX)
    if not 0 <= sensitivity <= 1:
        raise ObstacleError(f"The sensitivity {sensitivity:g} is outside 0 to 1.")
    refuse_unknown(ObstacleError, "circle method", method, CIRCLE_METHODS)
    edges = voting_pixels(image, edge_threshold)
    if len(edges) == 0:
        return Circles()
    weight = 1.0 / radii
    if method == "phase_code":
        span = float(np.log(radii[-1]) - np.log(radii[0])) or 1.0
        phase = 2 * np.pi * (np.log(radii) - np.log(radii[0])) / span
        weights = [weight * np.cos(phase), weight * np.sin(phase)]
        votes = accumulate(edges, radii, polarity, weights)
        height = np.sqrt(votes[0] * votes[0] + votes[1] * votes[1])
    else:
        votes = []
        (height,) = accumulate(edges, radii, polarity, [weight])
    height = smooth(height, 9, 2.0, "constant")
    x, y, strength = _centres(height, (1.0 - sensitivity) * 2 * np.pi)
    if x.size == 0:
        return Circles()
    if not votes:
        radius = _radii_by_histogram(edges, x, y, radii)
    else:
        rows = np.clip(np.floor(y + 0.5).astype(np.intp), 0, edges.shape[0] - 1)
        cols = np.clip(np.floor(x + 0.5).astype(np.intp), 0, edges.shape[1] - 1)
        theta = np.mod(np.arctan2(votes[1][rows, cols], votes[0][rows, cols]), 2 * np.pi)
        radius = np.exp(theta / (2 * np.pi) * np.log(radii[-1] / radii[0]) + np.log(radii[0]))
    order = np.argsort(-strength, kind="stable")
    # The transform counts from the centre of the top-left pixel, all values from its corner.
    return Circles(x + 0.5, y + 0.5, radius, strength).take(order)


def _centres(
    height: NDArray[np.float64], h: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the centroid of each plateau (it is flat, so no weights), and the height there."""
    labels, count = plateau_labels(height, h)
    if count == 0:
        none = np.empty(0)
        return none, none, none
    at = np.flatnonzero(labels)
    rows, cols = np.divmod(at, labels.shape[1])
    label = labels.ravel()[at] - 1
    total = np.bincount(label, minlength=count)
    x = np.bincount(label, weights=cols, minlength=count) / total
    y = np.bincount(label, weights=rows, minlength=count) / total
    strength = height[np.floor(y + 0.5).astype(np.intp), np.floor(x + 0.5).astype(np.intp)]
    return x, y, strength


def _radii_by_histogram(
    edges: EdgePixels,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    radii: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the radius at which the ring around each centre holds most edge pixels.

    A large ring holds more pixels by chance, so counts are divided by the circumference.
    """
    out = np.empty(x.size)
    bins = np.append(radii - 0.25, radii[-1] + 0.25)
    for i in range(x.size):
        distance = np.hypot(edges.x_px - x[i], edges.y_px - y[i])
        counts, _ = np.histogram(distance, bins=bins)
        out[i] = radii[int(np.argmax(counts / (2 * np.pi * radii)))]
    return cast("NDArray[np.float64]", out)
