"""The labelled pictures that the verifier of the obstacle detector is fitted on.

200 chips beside the project (aerial imagery of the US National Agriculture Imagery Program,
cut and labelled by J. Ventura et al., "Urban Tree Detection Data", CC BY 4.0), disturbed
copies of them, and simulated fields.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import rasterio
from scipy import ndimage

from geofield.simulate import CLIMATES, SimulationSettings, simulate_field

HERE = Path(__file__).resolve().parent
COPIES = 2
SIMULATED = 48
REAL, COPY, FIELD = 0, 1, 2


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture with its trees.

    Attributes
    ----------
    site : int
        Pictures of one site are held out together.
    kind : int
        A chip, a disturbed copy of one, or a simulated field.
    bands : uint8 array (4, rows, cols)
    trees : float array (n, 2)
        Pixel-index coordinates.
    region : bool array, or None
        Where candidates count.
    """

    site: int
    kind: int
    bands: np.ndarray
    trees: np.ndarray
    region: np.ndarray | None = None


def pictures(seed: int) -> Iterator[Picture]:
    """Yield all pictures, the chips first."""
    sites = list(chips())
    yield from sites
    rng = np.random.default_rng(seed)
    for _ in range(COPIES):
        for picture in sites:
            yield disturbed(picture, rng)
    for number in range(SIMULATED):
        yield simulated(number)


def chips() -> Iterator[Picture]:
    """Yield the labelled chips."""
    shared = Path(os.environ.get("GEOFIELD_SHARED", HERE.parent.parent / "shared"))
    folder = shared / "data" / "trees_train"
    labels = pd.read_csv(folder / "trees.csv")
    for site, path in enumerate(sorted(folder.glob("*.tif"))):
        with rasterio.open(path) as data:
            bands = data.read()
        rows = labels[labels.image == path.stem]
        yield Picture(site, REAL, bands, rows[["x_px", "y_px"]].to_numpy(float))


def disturbed(picture: Picture, rng: np.random.Generator) -> Picture:
    """Another camera, light, scale and bearing: what the verifier must not depend on."""
    zoom = float(np.exp(rng.uniform(np.log(0.75), np.log(1.33))))
    f = picture.bands.astype(np.float64)
    f = np.stack([ndimage.zoom(b, zoom, order=1, mode="nearest", grid_mode=True) for b in f])
    scale = np.array(f.shape[:0:-1]) / picture.bands.shape[:0:-1]
    trees = (picture.trees + 0.5) * scale - 0.5
    if rng.random() < 0.5:
        f = ndimage.gaussian_filter(f, (0, *[rng.uniform(0.2, 0.8)] * 2))
    f = 255 * (np.clip(f, 0, 255) / 255) ** np.exp(rng.normal(0, 0.2))
    gain, common = np.exp(rng.normal(0, 0.06, len(f))), np.exp(rng.normal(0, 0.12))
    f = f * (gain * common)[:, None, None] + rng.normal(0, 6) + rng.normal(0, 2.0, f.shape)
    bands = np.clip(np.rint(f), 0, 255).astype(np.uint8)
    for _ in range(int(rng.integers(4))):
        last_col = bands.shape[2] - 1
        bands = np.rot90(bands, 1, (1, 2))
        trees = np.column_stack([trees[:, 1], last_col - trees[:, 0]])
    if rng.random() < 0.5:
        trees = np.column_stack([bands.shape[2] - 1 - trees[:, 0], trees[:, 1]])
        bands = bands[:, :, ::-1]
    return Picture(picture.site, COPY, np.ascontiguousarray(bands), trees)


def simulated(number: int) -> Picture:
    """Return a simulated field: four climates, several sizes and scales, some without trees."""
    settings = replace(
        SimulationSettings(width_px=400, height_px=400, equal_brightness=number % 3 == 0),
        obstacles=0 if number % 5 == 0 else None,
        climate=CLIMATES[number % 4],
        radius_m=((2.0, 7.0), (1.6, 4.0), (3.0, 9.0))[(number // 4) % 3],
        resolution_m=(0.6, 0.5, 0.7)[(number // 3) % 3],
    )
    field = simulate_field(910_000 + number, settings)
    trees = field.obstacles[["x_px", "y_px"]].to_numpy(float) - 0.5
    return Picture(number, FIELD, field.scene.bands, trees, field.field.mask(field.scene.grid))
