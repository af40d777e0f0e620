"""Small pictures enlarged: a field of few pixels is found where there are more of them.

Superpixels, sides and tolerances are so many pixels wide, whatever a pixel is on the ground. In a
picture of 128 pixels of 1.2 m, or 51 of 3 m, they are too wide for a field.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geofield.model import Scene
from geofield.raster import resample

#: A picture should have about so many pixels along its longer side.
ENOUGH_PX = 256
#: Pixels are cut into so many along a side at most: what is smaller shows too little.
MOST = 8


def magnified(scene: Scene) -> Scene:
    """The same ground in about 256 pixels, when the picture has but two thirds of them or fewer.

    Interpolated between pixels (bilinear); a pixel without data stays one, cut into several.
    """
    times = min(round(ENOUGH_PX / max(scene.grid.shape)), MOST)
    if times < 2:
        return scene
    bands = [resample(band.astype(np.float32), 1 / times) for band in scene.bands]
    return replace(
        scene,
        grid=scene.grid.resized(times * scene.grid.width_px, times * scene.grid.height_px),
        bands=np.rint(bands).astype(np.uint8),
        valid=scene.valid.repeat(times, axis=0).repeat(times, axis=1),
    )
