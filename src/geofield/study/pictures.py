"""Pictures of the study's segmentation: grey, binary, numbered regions, reconstruction."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image, ImageDraw
from scipy import ndimage

if TYPE_CHECKING:
    from geofield.study.threshold import StudyPictures

#: Turning the hue by the golden angle keeps neighbours in the list apart.
_GOLDEN = 0.381966


def draw_study(
    study: StudyPictures, chosen: Sequence[int], shown: Sequence[int]
) -> dict[str, Image.Image]:
    """The pictures by name.

    Parameters
    ----------
    study : StudyPictures
    chosen : sequence of int
        Regions of the field: what the reconstruction shows.
    shown : sequence of int
        Regions that get a colour and a number.
    """
    kept = tuple(number for number in chosen if number > 0)
    reconstruction = study.reconstruction(kept) if kept else np.zeros(study.grey.shape, np.float32)
    return {
        "grey": _plain(study.grey),
        "binary": _plain(study.binary * 255.0),
        "regions": _numbered(study, shown),
        "reconstruction": _plain(reconstruction),
    }


def _plain(values: np.ndarray) -> Image.Image:
    return Image.fromarray(np.clip(np.rint(values), 0, 255).astype(np.uint8))


def _numbered(study: StudyPictures, shown: Sequence[int]) -> Image.Image:
    colours = np.zeros((len(study.counts) + 1, 3), np.uint8)
    for place, number in enumerate(shown):
        colour = colorsys.hsv_to_rgb((place * _GOLDEN) % 1.0, 0.55, 0.95)
        colours[number] = [round(255 * part) for part in colour]
    image = Image.fromarray(colours[study.regions])
    draw = ImageDraw.Draw(image)
    boxes = ndimage.find_objects(study.regions)
    for number in shown:
        rows, columns = boxes[number - 1]
        # The deepest point of a region is surely in it; its centroid may not be.
        part = np.pad(study.regions[rows, columns] == number, 1)
        depth = ndimage.distance_transform_edt(part)
        y, x = np.unravel_index(int(np.argmax(depth)), depth.shape)
        draw.text(
            (columns.start + int(x) - 1, rows.start + int(y) - 1),
            str(number),
            fill=(0, 0, 0),
            anchor="mm",
        )
    return image
