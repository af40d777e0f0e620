"""Pictures as they come back from JPEG files, as tiles of most sources do."""

from __future__ import annotations

import cv2
import numpy as np


def through_jpeg(bands: np.ndarray, quality: int) -> np.ndarray:
    """Bands through JPEG: colours together, further bands each by itself.

    Parameters
    ----------
    bands : uint8 array (rows, columns, bands)
        Red, green and blue first where there are three or more; grey otherwise.
    quality : int
    """
    settings = [cv2.IMWRITE_JPEG_QUALITY, quality]

    def back(band: np.ndarray) -> np.ndarray:
        file = cv2.imencode(".jpg", np.ascontiguousarray(band), settings)[1]
        return np.asarray(cv2.imdecode(file, cv2.IMREAD_UNCHANGED))

    colours = 3 if bands.shape[2] >= 3 else 0
    # OpenCV's order is blue, green, red.
    layers = [back(bands[..., 2::-1])[..., ::-1]] if colours else []
    return np.dstack([*layers, *(back(band) for band in np.moveaxis(bands[..., colours:], -1, 0))])
