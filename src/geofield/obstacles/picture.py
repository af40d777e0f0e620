"""The picture that obstacles are looked for in: read in parts, on the working grid, normalised."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from geofield.grid import Grid
from geofield.model.field import Field
from geofield.model.scene import Scene
from geofield.model.upright import Turn
from geofield.raster import Image, gaps_filled, pixel_centres, resample

WORKING_RESOLUTION_M = 23 / 64
"""Ground size of a pixel of the working grid, 0.36 m: three fifths of the pictures' that the
network learned from, for it sees more of what is enlarged; in parts of `WHOLE_PX`, so that the
rounding of `working_factor` brings no picture farther from it than `_AS_IT_IS`."""
WHOLE_PX = 64
"""Windows start at multiples of so many working pixels."""
_AS_IT_IS = (0.87, 1.15)
"""Between these factors a picture is used as it is."""
_OVERVIEW_PX = 1024
LEAST_CONTRAST = 24.0
"""Grey levels between the dark and the bright end, below which noise would be blown up."""


@runtime_checkable
class PictureReader(Protocol):
    """A picture that is read window by window, for instance `geofield.imagery.SceneReader`."""

    @property
    def grid(self) -> Grid:
        """Of the whole picture."""

    def read(
        self,
        window: tuple[int, int, int, int] | None = None,
        *,
        shape_px: tuple[int, int] | None = None,
        scaling: tuple[float, float] | None = None,
        nir_scaling: tuple[float, float] | None = None,
    ) -> Scene:
        """Read a window (column, row, width, height)."""


Picture = Scene | PictureReader


def turned(picture: Picture, turn: Turn) -> Picture:
    """Return a picture turned, a reader as one whose windows are."""
    if not turn:
        return picture
    return turn.scene(picture) if isinstance(picture, Scene) else _Turned(picture, turn)


@dataclass(frozen=True, slots=True)
class _Turned:
    """A reader whose windows are read turned."""

    reader: PictureReader
    turn: Turn

    @property
    def grid(self) -> Grid:
        """Of the whole picture, turned."""
        return self.turn.grid(self.reader.grid)

    def read(
        self,
        window: tuple[int, int, int, int] | None = None,
        *,
        shape_px: tuple[int, int] | None = None,
        **scalings: tuple[float, float] | None,
    ) -> Scene:
        """Read a window (column, row, width, height) of the turned picture."""
        if window is not None:
            window = self.turn.window_back(window)
        if shape_px is not None and self.turn.exchanged:
            shape_px = shape_px[1], shape_px[0]
        return self.turn.scene(self.reader.read(window, shape_px=shape_px, **scalings))


@dataclass(frozen=True, slots=True)
class Tone:
    """What is known of a picture as a whole, so that all its parts are seen alike.

    Attributes
    ----------
    bands : {"nir", "rgb", "grey"}
        What the network may look at; three equal bands are grey.
    low, high : float
        The dark and the bright end of the visible bands: grey levels.
    scaling, nir_scaling : (float, float) or None
        Of a reader's values.
    """

    bands: str
    low: float
    high: float
    scaling: tuple[float, float] | None
    nir_scaling: tuple[float, float] | None

    @property
    def is_flat(self) -> bool:
        """Whether there is too little contrast to stretch, but not nothing at all."""
        return 1 < self.high - self.low < LEAST_CONTRAST

    def normalised(self, image: Image) -> Image:
        """Bring a band to about -1..1, by the gain and offset common to all bands."""
        gain = 2 / max(self.high - self.low, LEAST_CONTRAST)
        stretched = (image - np.float32(self.low)) * np.float32(gain) - 1
        return np.asarray(np.clip(stretched, -3, 3), dtype=np.float32)


def tone_of(picture: Picture) -> Tone:
    """Look at a small version of a picture."""
    scene = picture
    if not isinstance(scene, Scene):
        rows, cols = scene.grid.shape
        smaller = max(max(rows, cols) / _OVERVIEW_PX, 1.0)
        scene = scene.read(shape_px=(max(int(rows / smaller), 1), max(int(cols / smaller), 1)))
    step = max(max(scene.grid.shape) // _OVERVIEW_PX, 1)
    valid = scene.valid[::step, ::step]
    bands = "grey"
    visible: list[NDArray[Any]] = [scene.grey]
    if any(not np.array_equal(scene.rgb_bands[0], other) for other in scene.rgb_bands[1:]):
        bands, visible = "rgb" if scene.nir is None else "nir", scene.rgb_bands
    shown = np.concatenate([band[::step, ::step][valid] for band in visible])
    low, high = np.percentile(shown, [2, 98]) if valid.any() else (0, 255)
    return Tone(bands, float(low), float(high), scene.scaling, scene.nir_scaling)


def part_of(picture: Picture, window: tuple[int, int, int, int], tone: Tone) -> Scene:
    """Return a window (column, row, width, height) of a picture."""
    if isinstance(picture, Scene):
        return picture.crop(*window)
    return picture.read(window, scaling=tone.scaling, nir_scaling=tone.nir_scaling)


def search_region(scene: Scene, field: Field | None) -> NDArray[np.bool_]:
    """Return the pixels (rows, cols) of the field, its holes filled, or of the picture."""
    if field is None:
        return scene.valid
    return field.mask(scene.grid, holes=False) & scene.valid


def working_factor(resolution_m: float) -> float:
    """Return the scene's pixels per working pixel, 1 where the picture is near enough.

    So many that `WHOLE_PX` working pixels are whole pixels of the picture: a window that starts
    at a multiple of them shows what the whole picture shows.
    """
    factor = WORKING_RESOLUTION_M / resolution_m
    if _AS_IT_IS[0] <= factor <= _AS_IT_IS[1]:
        return 1.0
    return max(round(factor * WHOLE_PX), 1) / WHOLE_PX


def working_bands(scene: Scene, tone: Tone, factor: float) -> dict[str, Image | float]:
    """Bring a scene to the working grid: red, green, blue, nir, has_nir.

    Missing pixels are filled with the nearest, so that their border is no edge.
    """
    scene = replace(scene, bands=gaps_filled(scene.bands, scene.valid))

    def band(values: NDArray[np.generic]) -> Image:
        return tone.normalised(resample(values.astype(np.float32), factor))

    grey = tone.bands == "grey"
    red, green, blue = [band(scene.grey)] * 3 if grey else map(band, scene.rgb_bands)
    visible: dict[str, Image | float] = {"red": red, "green": green, "blue": blue}
    if tone.bands == "nir" and scene.nir is not None:
        return visible | {"nir": band(scene.nir), "has_nir": 1.0}
    return visible | {"nir": 0.0, "has_nir": 0.0}


def on_working_grid(
    mask: NDArray[np.bool_], shape: tuple[int, ...], factor: float
) -> NDArray[np.bool_]:
    """Return a mask at the centres of the working pixels."""
    if factor == 1.0:
        return mask
    rows, cols = (
        pixel_centres(n, factor, size).astype(np.intp)
        for n, size in zip(shape, mask.shape, strict=True)
    )
    return mask[rows][:, cols]
