"""Tiles from bytes to pixels, with every check that keeps broken ones out."""

from __future__ import annotations

import io
import warnings

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from geofield.errors import ImageryError
from geofield.imagery.client import BrokenBodyError

#: Red, green, blue (rows, columns, 3) and whether each pixel is there (None: all are).
Pixels = tuple[NDArray[np.uint8], NDArray[np.bool_] | None]

#: Side of the smallest tile that a source can have, pixels.
_LEAST_PX = 64
#: A small file that says it is a picture of gigabytes.
_BOMBS = (Image.DecompressionBombWarning, Image.DecompressionBombError)


def decode_tile(body: bytes, kind: str, size_px: tuple[int, int]) -> Pixels:
    """The pixels of a PNG, JPEG or WebP tile of a size (width, height); `kind` is for the message.

    Raises
    ------
    BrokenBodyError
        Not a picture, or one that ends too early.
    ImageryError
        The tile is sound, but not of the size that the source is said to have.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            image: Image.Image = Image.open(io.BytesIO(body))
            if image.size != size_px:
                tile = image.width == image.height and image.width >= _LEAST_PX
                raise ImageryError(
                    f"The source sends tiles of {image.width} x {image.height} px, not "
                    f"{size_px[0]} x {size_px[1]} px.",
                    hint="Name it in the settings file, as [fetch.sources.NAME], with "
                    f"tile_px = {image.width}."
                    if tile
                    else None,
                )
            image.load()
    except UnidentifiedImageError:
        said = kind.partition(";")[0].strip() or "no type"
        raise BrokenBodyError(f"not a picture ({said})") from None
    except (OSError, SyntaxError, ValueError, *_BOMBS):
        raise BrokenBodyError("broken picture") from None
    if image.mode in ("RGBA", "LA", "PA") or "transparency" in image.info:
        rgba = np.asarray(image.convert("RGBA"))
        valid = rgba[..., 3] >= 128
        return np.ascontiguousarray(rgba[..., :3]), None if valid.all() else valid
    if image.mode.startswith("I;16"):
        image = image.point(lambda value: value / 257).convert("L")
    return np.asarray(image.convert("RGB")), None
