"""Obstacles that are not round: ponds, huts, rocks, clumps, rows of bushes.

What differs clearly from the field around it, has a sharp border, lies inside the field and
is not explained by the trees that were found (with their shadows) becomes one polygon. Soil
patches differ too, but softly; tramlines differ, but are narrow: both are left out.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage
from skimage.filters import apply_hysteresis_threshold

from geofield.model.circles import Circles
from geofield.obstacles.channels import Channels, Image, enlarge, shrink

MIN_AREA_M2 = 25.0
MIN_WIDTH_M = 2.4
MAX_FIELD_SHARE = 0.1
BORDER_M = 3.0
Z_THRESHOLD = 5.0
RIM_Z = 3.5
SHARP_Z_PER_PX = 1.0
SOFT_Z_PER_PX = 0.5
STRONG_Z = 6.5
_SHADOW_REACH = 2.2
_COARSE = 4
_DEEP = 3.0
_EXPLAINED = 0.7
_MIN_SPREAD = {"luma": 7.0, "ndvi": 7.0, "exg": 4.0, "rg": 4.0, "gb": 4.0}


def difference_from_field(found: Channels, region: NDArray[np.bool_]) -> Image:
    """Return how far each pixel differs from the field, in robust standard deviations.

    The largest over brightness and colour; the field's median and deviation are taken over
    the region alone.
    """
    worst = np.zeros(region.shape, dtype=np.float32)
    inside = region[::2, ::2]
    if not inside.any():
        return worst
    for name, least in _MIN_SPREAD.items():
        image = found.maps.get(name)
        if image is None:
            continue
        smooth = ndimage.uniform_filter(image, 3, mode="nearest")
        local = _local_background(smooth, region)
        rest = smooth - local
        values = np.abs(rest[::2, ::2][inside])
        spread = max(1.4826 * float(np.median(values)), least)
        np.maximum(worst, np.abs(rest) / np.float32(spread), out=worst)
    return worst


def footprints(
    found: Channels,
    region: NDArray[np.bool_],
    trees: Circles,
    pixel_m: float,
) -> list[shapely.Polygon]:
    """Return the outlines of what is in the field and is neither field nor one of the trees.

    Parameters
    ----------
    found : Channels
    region : bool array (rows, cols)
        The field, holes included.
    trees : Circles
        Pixel-index coordinates.
    pixel_m : float
        Metres per pixel.

    Returns
    -------
    list of Polygon
        Pixel coordinates with the origin at the corner of the top-left pixel.
    """
    if not region.any():
        return []
    score = difference_from_field(found, region)
    margin = max(round(BORDER_M / pixel_m), 1)
    distance = ndimage.distance_transform_edt(np.pad(region, 1))[1:-1, 1:-1]
    # A clear core, and as much around it as still differs: crowns fade towards their rims.
    mask = apply_hysteresis_threshold(score, RIM_Z, Z_THRESHOLD) & region
    known = _tree_discs(trees, region.shape)
    width = max(MIN_WIDTH_M / pixel_m, 2.0)
    mask = _opened(mask, width / 2)
    labels, count = ndimage.label(mask, structure=np.ones((3, 3), dtype=bool))
    if count == 0:
        return []
    gy, gx = np.gradient(score)
    slope = np.hypot(gx, gy)
    field_area = float(region.sum())
    out: list[shapely.Polygon] = []
    for number, where in enumerate(ndimage.find_objects(labels), start=1):
        part = np.pad(labels[where] == number, 2)
        area = int(part.sum())
        if area * pixel_m**2 < MIN_AREA_M2 or area > MAX_FIELD_SHARE * field_area:
            continue
        core = part[2:-2, 2:-2]
        # A tree and its shadow are one blob; a clump with one tree known in it is more.
        if float(known[where][core].mean()) >= _EXPLAINED:
            continue
        # What lies along the field's border is its border; what reaches far in is in the way.
        depth = distance[where][core]
        if float(depth.min()) <= margin and float(depth.max()) <= _DEEP * margin:
            continue
        # Shadows and blurred crowns have soft rims, but then their insides differ strongly.
        rim = core & ~ndimage.binary_erosion(core)
        strong = float(np.percentile(score[where][core], 90)) >= STRONG_Z
        least = SOFT_Z_PER_PX if strong else SHARP_Z_PER_PX
        if float(np.median(slope[where][rim])) < least:
            continue
        polygon = _outline(part, where[1].start - 2, where[0].start - 2)
        if polygon is not None:
            out.append(polygon)
    return out


def _local_background(image: Image, region: NDArray[np.bool_]) -> Image:
    """Return a wide mean over the region alone, so that the neighbours do not count."""
    weight = shrink(region.astype(np.float32), _COARSE)
    total = shrink(np.where(region, image, np.float32(0)), _COARSE)
    sigma = 60.0 / _COARSE
    weight = ndimage.gaussian_filter(weight, sigma, mode="constant")
    total = ndimage.gaussian_filter(total, sigma, mode="constant")
    overall = float(image[region].mean())
    mean = np.where(weight > 1e-3, total / np.maximum(weight, 1e-3), overall)
    return enlarge(mean.astype(np.float32), _COARSE, image.shape)


def _tree_discs(trees: Circles, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    mask = np.zeros(shape, dtype=bool)
    for x, y, radius in zip(trees.x_px, trees.y_px, trees.radius_px, strict=True):
        reach = _SHADOW_REACH * float(radius) + 1
        r0, r1 = max(int(y - reach), 0), min(int(y + reach) + 2, shape[0])
        c0, c1 = max(int(x - reach), 0), min(int(x + reach) + 2, shape[1])
        yy, xx = np.ogrid[r0:r1, c0:c1]
        mask[r0:r1, c0:c1] |= (xx - x) ** 2 + (yy - y) ** 2 <= reach**2
    return mask


def _opened(mask: NDArray[np.bool_], radius_px: float) -> NDArray[np.bool_]:
    """Remove what is narrower than twice the radius."""
    inner = ndimage.distance_transform_edt(np.pad(mask, 1))[1:-1, 1:-1] >= radius_px
    if not inner.any():
        return np.zeros_like(mask)
    near = ndimage.distance_transform_edt(~inner) <= radius_px
    return np.asarray(mask & near, dtype=bool)


def _outline(part: NDArray[np.bool_], col: int, row: int) -> shapely.Polygon | None:
    """Return the outline of one region of pixels, holes filled, its stairs smoothed away."""
    from rasterio.features import shapes

    filled = ndimage.binary_fill_holes(part).astype(np.uint8)
    rings = [
        shapely.Polygon(shape["coordinates"][0])
        for shape, value in shapes(filled, mask=filled.astype(bool), connectivity=8)
        if value
    ]
    if not rings:
        return None
    largest = max(rings, key=lambda ring: ring.area)
    simple = largest.buffer(0).simplify(0.75)
    if simple.is_empty or not isinstance(simple, shapely.Polygon):
        simple = largest
    return shapely.transform(simple, lambda c: c + np.array([col, row]))
