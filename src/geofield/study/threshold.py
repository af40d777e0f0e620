"""The study's segmentation: threshold, box sum, connected components, reconstruction.

METHOD.md, section 2, names the steps. It loses a field whose grey level equals that of its
surroundings; it is kept because people compare with it, and because its numbered regions
let a person choose by hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from geofield.errors import FieldError
from geofield.model.scene import Scene
from geofield.model.segmentation import Segmentation

BoolArray = NDArray[np.bool_]

#: Side of the median filter and of the box sum, pixels.
_WINDOW_PX = 3
#: Pixels around the seed that count as the seed: a GPS point is not a pixel.
_SEED_REACH_PX = 2


@dataclass(frozen=True, eq=False)
class StudyPictures:
    """What the study's method sees on its way, each (rows, columns).

    Attributes
    ----------
    grey : float32 array
        Brightness 0..255 after the 3x3 median filter.
    threshold : float
        Otsu's threshold of it.
    binary : bool array
        Brighter than the threshold, smoothed by the 3x3 box sum.
    regions : int32 array
        8-connected regions of the bright and of the dark class together, numbered from 1 by
        falling pixel count; 0 where the picture has no data.
    counts : int array
        Pixels per region; `counts[0]` belongs to region 1.
    """

    grey: NDArray[np.float32]
    threshold: float
    binary: BoolArray
    regions: NDArray[np.int32]
    counts: NDArray[np.int64]

    def region_at(self, x_px: float, y_px: float) -> int:
        """The number of the largest region at a pixel position; 0 where there is no data."""
        rows, columns = self.regions.shape
        x, y = min(int(x_px), columns - 1), min(int(y_px), rows - 1)
        if self.regions[y, x] == 0:
            return 0
        near = self.regions[
            max(y - _SEED_REACH_PX, 0) : y + _SEED_REACH_PX + 1,
            max(x - _SEED_REACH_PX, 0) : x + _SEED_REACH_PX + 1,
        ]
        # Numbers fall with size, so that the smallest number is the largest region.
        return int(near[near > 0].min())

    def reconstruction(self, numbers: tuple[int, ...]) -> NDArray[np.float32]:
        """The grey picture of some regions, blank outside, small dark specks filtered away.

        Morphological reconstruction by erosion (Vincent 1993) from the regions' filled
        outline: dark spots that do not reach the outline are raised to their rim.
        """
        from skimage.morphology import reconstruction

        mask = self.mask(numbers)
        inside = ndimage.binary_fill_holes(mask)
        grey = np.where(inside, self.grey, 0).astype(np.float32)
        seed = np.where(mask, grey, 255).astype(np.float32)
        seed[~inside] = 0
        return np.asarray(reconstruction(seed, grey, method="erosion"), np.float32)

    def mask(self, numbers: tuple[int, ...]) -> BoolArray:
        """The pixels of some regions.

        Raises
        ------
        FieldError
            When a number does not exist.
        """
        for number in numbers:
            if not 1 <= number <= len(self.counts):
                raise FieldError(
                    f"There is no region {number}; the picture has {len(self.counts)}.",
                    hint="`geofield field --list` shows all of them.",
                )
        return np.isin(self.regions, numbers)


def study_pictures(grey: NDArray[np.float32], valid: BoolArray | None = None) -> StudyPictures:
    """Run the study's segmentation.

    Parameters
    ----------
    grey : float32 array (rows, columns)
        Brightness, 0..255.
    valid : bool array (rows, columns), optional
        False where there is no data.

    Notes
    -----
    The study numbers the bright regions only and so cannot choose a dark field. Here both
    classes are numbered: regions of either class never join, and the seed decides.
    The box sum becomes binary again by majority, which treats both classes alike.
    """
    from skimage.filters import threshold_otsu

    if valid is None:
        valid = np.ones(grey.shape, bool)
    if not valid.any():
        raise FieldError("The picture has no data at all.")
    smooth = ndimage.median_filter(grey.astype(np.float32), _WINDOW_PX, mode="nearest")
    values = smooth[valid]
    threshold = float(threshold_otsu(values)) if np.ptp(values) > 0 else float(values[0])
    bright = (smooth > threshold) & valid
    total = ndimage.uniform_filter(bright.astype(np.float32), _WINDOW_PX, mode="nearest")
    binary = (total > 0.5) & valid
    regions, counts = _number(binary, valid)
    return StudyPictures(smooth, threshold, binary, regions, counts)


def segment(scene: Scene, x_px: float, y_px: float, regions: Sequence[int] = ()) -> Segmentation:
    """The region at a point, or the numbered regions that a person chose, joined."""
    from skimage.morphology import closing, disk

    pictures = study_pictures(scene.grey, scene.valid)
    mask = pictures.mask(tuple(regions) or (pictures.region_at(x_px, y_px),))
    if len(regions) > 1:
        # The seam between neighbouring regions is a few pixels wide.
        mask = np.asarray(closing(mask, disk(3)), bool)
    notes = tuple(
        f"region {number} does not touch the others and is left out"
        for number in _apart(mask, pictures.regions, regions)
    )
    return Segmentation(mask, notes, (("threshold", pictures.threshold),))


def _apart(mask: BoolArray, numbered: NDArray[np.int32], chosen: Sequence[int]) -> list[int]:
    """Of several chosen regions those beside the largest part of a mask: an outline is one part."""
    parts, count = ndimage.label(mask)
    if len(chosen) < 2 or count < 2:
        return []
    largest = 1 + int(np.argmax(np.bincount(parts.ravel())[1:]))
    within = set(np.unique(numbered[parts == largest]).tolist())
    return sorted(set(chosen) - within)


def _number(binary: BoolArray, valid: BoolArray) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Regions of both classes, numbered by falling size."""
    eight = np.ones((3, 3), bool)
    bright, bright_count = ndimage.label(binary, eight)
    dark, _ = ndimage.label(~binary & valid, eight)
    labels = np.where(dark > 0, dark + bright_count, bright)
    counts = np.bincount(labels.ravel())
    counts[0] = 0
    order = np.argsort(-counts, kind="stable")
    order = order[counts[order] > 0]
    number = np.zeros(len(counts), np.int32)
    number[order] = np.arange(1, len(order) + 1)
    return number[labels], counts[order].astype(np.int64)
