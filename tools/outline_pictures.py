"""The pictures that the outline network is trained on: fields drawn by eye, and simulated ones.

Pictures of one site, and of its other years, always go into the same fold, whatever else the
tables hold: a figure of a left-out fold is one of sites that nothing was learned from.
"""

from __future__ import annotations

import csv
import json
import os
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from geofield.simulate import SimulationSettings, simulate_field

ROOT = Path(__file__).resolve().parent.parent
DATA = Path(os.environ.get("GEOFIELD_SHARED", ROOT.parent / "shared")) / "data"
#: Outlines drawn by eye: mark, table, folder of the pictures where the table does not say it.
TABLES = (
    ("truth", DATA / "trees" / "field_truth.csv", "trees"),
    ("own", ROOT / "benchmarks" / "field_labels.csv", None),
    ("hard", ROOT / "benchmarks" / "field_labels_hard.csv", None),
    ("more", ROOT / "benchmarks" / "field_labels_more.csv", None),
)
#: Simulated pictures are reduced to this side, pixels; their number; the seed of the first.
SIMULATED_PX, SIMULATED, SIMULATION_SEED = 320, 72, 52_000


@dataclass
class Picture:
    """A picture with a field in it.

    Attributes
    ----------
    mark, site : str
        Which table, and where; years of one place are one site.
    bands : uint8 array (4, rows, columns)
        Red, green, blue, near infrared.
    masks : list of uint8 array (rows, columns)
        The field as drawn, 255 inside; the second is the other outline of a doubtful one.
    seed_px : (float, float)
    """

    mark: str
    site: str
    bands: NDArray[np.uint8]
    masks: list[NDArray[np.uint8]]
    seed_px: tuple[float, float]


def site_of(image: str) -> str:
    """The place of a picture, ``riverside_2016_89`` without its year."""
    place, _, number = image.rpartition("_")
    return f"{place.rpartition('_')[0]} {number}"


def fold_of(site: str, count: int) -> int:
    """The fold of a site: it stays when tables grow."""
    return zlib.crc32(site.encode()) % count


def drawn(polygon: Sequence[Sequence[float]], shape: tuple[int, int]) -> NDArray[np.uint8]:
    """A polygon, pixel coordinates, as a mask."""
    mask = np.zeros(shape, np.uint8)
    points = np.rint((np.array(polygon, float) - 0.5) * 16).astype(np.int32)
    cv2.fillPoly(mask, [points], 255, shift=4)
    return mask


def labelled() -> Iterator[Picture]:
    """Every field drawn by eye."""
    import rasterio

    for mark, table, folder in TABLES:
        if not table.is_file():
            continue
        with table.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            path = DATA / (folder or row["folder"]) / f"{row['image']}.tif"
            with rasterio.open(path) as source:
                bands = source.read()
            outlines = [row["polygon_px"]]
            if row.get("polygon_alt_px", ""):
                outlines.append(row["polygon_alt_px"])
            masks = [drawn(json.loads(one), bands.shape[1:]) for one in outlines]
            seed = float(row["seed_x_px"]), float(row["seed_y_px"])
            yield Picture(mark, site_of(row["image"]), bands, masks, seed)


def simulated(count: int = SIMULATED) -> Iterator[Picture]:
    """Simulated fields, plain and crowded ones by turns."""
    rng = np.random.default_rng(SIMULATION_SEED)
    for index in range(count):
        side = 640 if index % 2 else 480
        crowns = int(rng.integers(3, 26)) if index % 2 else int(rng.integers(10, 61))
        settings = SimulationSettings(
            width_px=side, height_px=side, obstacles=crowns, equal_brightness=index % 3 == 0
        )
        one = simulate_field(SIMULATION_SEED + index, settings)
        scale = SIMULATED_PX / side
        size = (SIMULATED_PX, SIMULATED_PX)
        bands = [cv2.resize(band, size, interpolation=cv2.INTER_AREA) for band in one.scene.bands]
        outline = np.array(one.field.polygon_px(one.scene.grid).exterior.coords) * scale
        x, y = one.scene.grid.from_lonlat(one.lon, one.lat)
        mask = drawn(outline.tolist(), size)
        seed = float(x) * scale, float(y) * scale
        yield Picture("simulated", f"simulated {index}", np.stack(bands), [mask], seed)
