"""Evidence: colour, vegetation and brightness as channels in which a field is even.

Brightness alone loses a field that is as bright as its surroundings. Here the channels are
scaled by how much they vary *within* a surface near the seed (whitening), so that a channel
counts as much as it can tell surfaces apart: rows and soil patches are mostly brightness,
so brightness counts less and hue and near infrared count more.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtr, chdtri

from geofield.model import Scene
from geofield.raster import block_mean, smoothed

FloatArray = NDArray[np.float32]

#: Smoothing of the channels, pixels (standard deviation).
_SMOOTH_PX = 1.0
#: Distance at which two pixels are compared to learn how a surface varies, pixels.
_LAG_PX = 6
#: Half the side of the square around the seed in which that is learned, pixels.
_REACH_PX = 40
#: Share of the comparisons taken to lie within one surface.
_WITHIN = 0.7
#: Variance of quantisation and sensor noise, grey levels squared: no channel is better.
_FLOOR = 0.3


def channels(scene: Scene, factor: int = 1) -> FloatArray:
    """The picture as channels (channels, rows, columns), reduced by a whole factor.

    Brightness, red against green, yellow against blue and, where there is near infrared,
    the vegetation index, each spread over about the range of brightness.
    """
    red, green, blue = (block_mean(band, factor) for band in scene.rgb_bands)
    layers = [0.298 * red + 0.587 * green + 0.114 * blue]
    if scene.is_colour:
        layers += [red - green, 0.5 * (red + green) - blue]
    if scene.nir is not None:
        nir = block_mean(scene.nir, factor)
        layers.append(100.0 * (nir - red) / (nir + red + 20.0))
    return np.stack(layers).astype(np.float32)


def whiten(
    stack: FloatArray, seed_px: tuple[float, float], inside: NDArray[np.bool_] | None = None
) -> FloatArray:
    """Channels in units of their variation within the surface around the seed.

    Parameters
    ----------
    stack : float32 array (channels, rows, columns)
    seed_px : (float, float)
        Pixel coordinates in `stack`.
    inside : bool array (rows, columns), optional
        The pixels that show ground; all of them when not given.

    Notes
    -----
    The covariance of differences between pixels a few steps apart is trimmed to the most
    usual ones, so that borders and trees near the seed do not count.
    """
    smooth = np.stack([smoothed(layer, _SMOOTH_PX, truncate=4.0) for layer in stack])
    count = len(smooth)
    x, y = int(seed_px[0]), int(seed_px[1])
    window = (
        slice(max(y - _REACH_PX, 0), y + _REACH_PX),
        slice(max(x - _REACH_PX, 0), x + _REACH_PX),
    )
    near = smooth[:, *window]
    difference = np.concatenate(
        [
            (near[:, :, _LAG_PX:] - near[:, :, :-_LAG_PX]).reshape(count, -1),
            (near[:, _LAG_PX:] - near[:, :-_LAG_PX]).reshape(count, -1),
        ],
        axis=1,
    ).astype(np.float64)
    if inside is not None:
        known = inside[window]
        both = known[:, _LAG_PX:] & known[:, :-_LAG_PX], known[_LAG_PX:] & known[:-_LAG_PX]
        difference = difference[:, np.concatenate([one.ravel() for one in both])]
    floor = _FLOOR * np.eye(count)
    if difference.shape[1] < 10 * count:
        covariance = floor
    else:
        covariance = _trimmed_covariance(difference) / 2 + floor
    values, vectors = np.linalg.eigh(covariance)
    matrix = (vectors / np.sqrt(values)) @ vectors.T
    return np.asarray(np.einsum("ij,jrc->irc", matrix.astype(np.float32), smooth))


def _trimmed_covariance(difference: NDArray[np.float64]) -> NDArray[np.float64]:
    count = len(difference)
    covariance = difference @ difference.T / difference.shape[1]
    for _ in range(5):
        inverse = np.linalg.inv(covariance + 1e-3 * np.eye(count))
        distance = np.einsum("in,ij,jn->n", difference, inverse, difference)
        kept = difference[:, distance <= np.quantile(distance, _WITHIN)]
        covariance = kept @ kept.T / kept.shape[1]
    # Trimming a normal distribution shrinks its covariance by a known factor.
    # (Chi squared; scipy.stats would cost a second of imports.)
    quantile = chdtri(count, 1.0 - _WITHIN)
    return np.asarray(covariance * _WITHIN / chdtr(count + 2, quantile))
