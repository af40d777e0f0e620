"""Looks: what each superpixel shows, asked from the seed.

Does it look like the ground there, what lies on the straight line between, how hard is the
easiest way, and how late does it join the seed's region? All figures are shares or logarithms
in units of the surface's own variation, but for a few of the plain channels.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from geofield.field.evidence import gradient
from geofield.field.regions import Partition
from geofield.field.surface import Surface

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

#: Ground this near the seed is the seed's own, pixels.
_OWN_PX = 12.0
#: The smallest region around the seed of this share of the picture is its surroundings.
_PATCH_SHARE = 0.02
#: Places looked at on a straight line; the few strongest may be noise.
_PLACES, _NOISE = 96, 2
#: What the raw channels are divided by: about one for what an eye would call different.
_RAW_STEP = 30.0
_RAW = ("brightness", "red_green", "yellow_blue", "vegetation")
#: Which of them a picture of so many channels has.
_PRESENT = {1: (0,), 2: (0, 3), 3: (0, 1, 2), 4: (0, 1, 2, 3)}

LOOKS = (
    "unlike_seed",
    "unlike_patch",
    "smooth_unlike_patch",
    "neighbours_unlike_patch",
    "rough",
    "rougher_than_seed",
    *_RAW,
    *(f"{name}_above_seed" for name in _RAW),
    "borders_around",
    "painted_over",
    "has_vegetation",
    "has_colour",
    "distance",
    "distance_from_frame",
    "joined_height",
    "joined_share",
    "joined_height_above_inside",
    "second_height",
    "second_share",
    "second_height_above_inside",
    "way_cost",
    "way_cost_above_distance",
    "sight_border_most",
    "sight_border_mean",
    "sight_unlike_most",
    "sight_unlike_mean",
    "sight_unlike_80",
    "sight_rough_most",
    "sight_rough_92",
    "sight_vegetation_least",
    "sight_vegetation_most",
    "sight_brightness_least",
    "sight_brightness_most",
)
"""Names of what is asked of a superpixel, in the order of `looks`."""


def looks(
    surface: Surface, second: Partition, raw: NDArray[np.float32], seed_px: tuple[float, float]
) -> FloatArray:
    """What each superpixel shows, (superpixels, looks) in the order of `LOOKS`.

    Parameters
    ----------
    surface : Surface
    second : Partition
        Of another look at the same picture.
    raw : float32 array (channels, rows, columns)
        Not whitened, see `channels`.
    seed_px : (float, float)
        Open ground, pixel coordinates.
    """
    rows, columns = surface.centres
    labels = surface.parted.labels
    seed = (int(seed_px[1]), int(seed_px[0]))
    away = np.hypot(columns - seed_px[0], rows - seed_px[1])
    own = away <= max(_OWN_PX, float(np.sort(away)[min(8, len(away) - 1)]))
    strength = surface.parted.pairs[3]
    longest = max(labels.shape)
    edge = np.minimum(
        np.minimum(columns, labels.shape[1] - columns), np.minimum(rows, labels.shape[0] - rows)
    )
    second_at = second.labels[rows, columns]
    cost = _way_cost(surface.parted, int(labels[seed]))
    plain = _plain(raw)
    patch = _patch(surface, int(labels[seed]))
    unlike = _unlike(surface, patch)
    return np.column_stack(
        [
            _appearance(surface, plain, own, patch, unlike),
            _log(_mean_around(surface, strength, strength)),
            surface.things[rows, columns],
            np.full(len(rows), float(3 in _PRESENT[len(raw)])),
            np.full(len(rows), float(1 in _PRESENT[len(raw)])),
            away / longest,
            edge / longest,
            _joining(surface.parted, int(labels[seed])),
            _joining(second, int(second.labels[seed]))[second_at],
            cost,
            cost - np.log(away / 5 + 1),
            _sight(surface, plain, own, unlike, seed_px),
        ]
    )


def _plain(raw: NDArray[np.float32]) -> NDArray[np.float32]:
    """The raw channels smoothed, last, those that are missing zero; no data is bounded."""
    import cv2

    layers = np.zeros((len(_RAW), *raw.shape[1:]), np.float32)
    for at, layer in zip(_PRESENT[len(raw)], raw, strict=True):
        layers[at] = cv2.GaussianBlur(np.clip(layer, -300, 300), (0, 0), 1.0)
    return np.ascontiguousarray(np.moveaxis(layers / np.float32(_RAW_STEP), 0, -1))


def _patch(surface: Surface, leaf: int) -> FloatArray:
    """Usual channels of the seed's surroundings."""
    tree = surface.parted.tree
    least = _PATCH_SHARE * surface.parted.labels.size
    chain = tree.chain(leaf)
    region = next((one for one in chain if tree.size_px[one] >= least), chain[-1])
    return np.asarray(np.median(surface.means[:, tree.leaves(region)], axis=1))


def _appearance(
    surface: Surface,
    plain: NDArray[np.float32],
    own: BoolArray,
    patch: FloatArray,
    smooth_unlike: NDArray[np.float32],
) -> FloatArray:
    """How superpixels look, and how unlike the seed's ground."""
    rows, columns = surface.centres
    means = surface.means
    here = np.median(means[:, own], axis=1)
    unlike = _log(_length(means - here[:, None]))
    unlike_patch = _log(_length(means - patch[:, None]))
    first, other, _, _ = surface.parted.pairs
    rough = _log(surface.layers[rows, columns, -1])
    raw = plain[rows, columns]
    return np.column_stack(
        [
            unlike,
            unlike_patch,
            _log(smooth_unlike[rows, columns]),
            _mean_around(surface, unlike_patch[other], unlike_patch[first]),
            rough,
            rough - np.median(rough[own]),
            raw,
            raw - np.median(raw[own], axis=0),
        ]
    )


def _mean_around(surface: Surface, to_first: FloatArray, to_second: FloatArray) -> FloatArray:
    """Means over the neighbours of each superpixel, of what each pair tells its two."""
    first, second, _, _ = surface.parted.pairs
    count = len(surface.centres[0])
    total = np.bincount(first, to_first, count) + np.bincount(second, to_second, count)
    touching = np.bincount(first, None, count) + np.bincount(second, None, count)
    return np.asarray(total / np.maximum(touching, 1))


def _joining(parted: Partition, leaf: int) -> FloatArray:
    """Of each superpixel: at which height, to what share of the picture, against what inside."""
    tree = parted.tree
    first, second, _, strength = parted.pairs
    joined = np.zeros(tree.leaf_count, bool)
    joined[leaf] = True
    height, share, above = (
        np.zeros(tree.leaf_count),
        np.ones(tree.leaf_count),
        np.zeros(tree.leaf_count),
    )
    share[leaf] = tree.size_px[leaf]
    chain = tree.chain(leaf)
    highest, inside = 0.0, 1.0
    for region, following in pairwise(chain):
        leaves = tree.leaves(tree.beside(region))
        highest = max(highest, float(tree.height[following]))
        if tree.size_px[region] > 200:
            within = np.sort(strength[joined[first] & joined[second]])
            inside = float(within[int(0.8 * len(within))]) if len(within) > 5 else inside
        height[leaves], share[leaves], above[leaves] = highest, tree.size_px[region], inside
        joined[leaves] = True
    tall = _log(height)
    return np.column_stack([tall, np.log(share / parted.labels.size + 0.001), tall - _log(above)])


def _way_cost(parted: Partition, leaf: int) -> FloatArray:
    """Logarithm of the cost of the easiest way from the seed: the sum of squared borders."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    first, second, _, strength = parted.pairs
    count = parted.tree.leaf_count
    toll = np.maximum(strength, 0.3) ** 2 + 0.5
    ways = coo_array((toll, (first, second)), shape=(count, count)).tocsr()
    cost = dijkstra(ways, directed=False, indices=leaf)
    return np.asarray(np.log1p(np.minimum(cost, 1e5)))


def _sight(
    surface: Surface,
    plain: NDArray[np.float32],
    own: BoolArray,
    smooth_unlike: NDArray[np.float32],
    seed_px: tuple[float, float],
) -> FloatArray:
    """What lies on the straight line from the seed to each superpixel."""
    import cv2

    rows, columns = surface.centres
    along = np.linspace(0, 1, _PLACES)[:, None]
    x, y = (
        (start + (end - start) * along - 0.5).astype(np.float32)
        for start, end in zip(seed_px, (columns, rows), strict=True)
    )
    seen = np.stack(
        [
            gradient(surface.stack, 1.5),
            smooth_unlike,
            surface.layers[..., -1],
            plain[..., 3],
        ],
        axis=-1,
    )
    found = cv2.remap(seen, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    light = cv2.remap(plain[..., 0].copy(), x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    border, unlike, rough = (np.sort(found[..., at], axis=0) for at in range(3))
    green = found[..., 3]
    usual = plain[rows[own], columns[own]].mean(axis=0)
    most = -1 - _NOISE
    return np.column_stack(
        [
            np.log(border[most] + 0.1),
            np.log(border.mean(axis=0) + 0.1),
            _log(unlike[most]),
            _log(unlike.mean(axis=0)),
            _log(unlike[int(0.8 * _PLACES)]),
            _log(rough[-1]),
            _log(rough[int(0.92 * _PLACES)]),
            green.min(axis=0) - usual[3],
            green.max(axis=0) - usual[3],
            light.min(axis=0) - usual[0],
            light.max(axis=0) - usual[0],
        ]
    )


def _unlike(surface: Surface, patch: FloatArray) -> NDArray[np.float32]:
    """How unlike the seed's surroundings each pixel is, smoothed."""
    import cv2

    smooth = cv2.GaussianBlur(surface.layers[..., :-1], (0, 0), 2.0).reshape(*surface.shape, -1)
    return np.asarray(np.linalg.norm(smooth - patch.astype(np.float32), axis=-1), np.float32)


def _length(values: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(values, axis=0))


def _log(values: NDArray[np.floating]) -> FloatArray:
    return np.log(np.asarray(values, float) + 0.3)
