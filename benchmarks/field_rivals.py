"""Other ways to the ground at points: scikit-image's random walker and felzenszwalb."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import shapely

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tools"))
from outline_cases import Case

Point = tuple[float, float]


def random_walker(case: Case) -> Callable[[list[Point], list[Point]], shapely.Polygon]:
    """Discs at the points, the picture's frame as what does not belong."""
    from skimage.segmentation import random_walker as walk

    picture = case.scene.rgb.astype(float)

    def run(include: list[Point], exclude: list[Point]) -> shapely.Polygon:
        markers = np.zeros(picture.shape[:2], int)
        if not exclude:
            markers[[0, -1], :] = markers[:, [0, -1]] = 2
        row, column = np.indices(markers.shape)
        for number, points in ((2, exclude), (1, include)):
            for x, y in points:
                markers[np.hypot(row + 0.5 - y, column + 0.5 - x) < 6] = number
        labels = walk(picture, markers, beta=800, mode="cg_j", tol=1e-3, channel_axis=-1)
        return polygon_of(labels == 1)

    return run


def felzenszwalb(case: Case) -> Callable[[list[Point], list[Point]], shapely.Polygon]:
    """The pieces at the points that belong, without those at the others; the seed's stays."""
    from skimage.segmentation import felzenszwalb as segment

    labels = segment(case.scene.rgb, scale=600, sigma=1.0, min_size=400)

    def run(include: list[Point], exclude: list[Point]) -> shapely.Polygon:
        wanted = {labels[int(y), int(x)] for x, y in include}
        seed = labels[int(case.y_px), int(case.x_px)]
        wanted -= {labels[int(y), int(x)] for x, y in exclude} - {seed}
        return polygon_of(np.isin(labels, list(wanted)))

    return run


def polygon_of(mask: np.ndarray) -> Any:
    from rasterio.features import shapes

    parts = [shapely.geometry.shape(one) for one, _ in shapes(mask.astype(np.uint8), mask=mask)]
    return shapely.union_all([shapely.make_valid(one) for one in parts])
