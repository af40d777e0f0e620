"""The labelled pictures that the crown network is trained on, gathered into one file.

    python tools/crown_pictures.py pictures.npz --fine deepforest-2.1.0-py3-none-any.whl

826 chips beside the project (aerial imagery of the US National Agriculture Imagery Program,
cut and labelled by J. Ventura et al., "Urban Tree Detection Data", CC BY 4.0), simulated fields
and, where they are at hand, the pictures of `fine_pictures`. Labels are points; radii are the
simulated ones, or fitted to the picture around each label. A fixed sixth of the sites, all years
of a site together, is marked as left out: nothing is fitted on it.
"""

from __future__ import annotations

import argparse
import os
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import rasterio
from crown_radii import fit_circles
from fine_pictures import NAMES, lessons

from geofield.simulate import CLIMATES, SimulatedField, SimulationSettings, simulate_field

SIMULATED = 160
SIDE_PX = 256
LEFT_OUT_SHARE = 6


def site_of(chip: str) -> str:
    """Return the name of a chip without its year."""
    *city, _, number = chip.split("_")
    return "_".join([*city, number])


def left_out(chips: list[str]) -> np.ndarray:
    """Return which chips belong to sites that judge: every sixth of each city, by checksum."""
    sites = sorted({site_of(chip) for chip in chips}, key=lambda s: zlib.crc32(s.encode()))
    seen: dict[str, int] = {}
    judges = set()
    for site in sites:
        city = site.rsplit("_", 1)[0]
        if seen.setdefault(city, 0) % LEFT_OUT_SHARE == 0:
            judges.add(site)
        seen[city] += 1
    return np.array([site_of(chip) in judges for chip in chips])


def fitted_radii(bands: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """Return a radius in pixels for every label, from the picture around it."""
    x, y, radius = fit_circles(bands, xy[:, 0], xy[:, 1], 15.0)
    moved = np.hypot(x - xy[:, 0], y - xy[:, 1])
    # A circle that ran away from its label is no measure of its crown.
    return np.where(moved < 0.7 * radius + 1.5, radius, np.nan)


def chips(folder: Path) -> tuple[list[str], list[np.ndarray], list[np.ndarray]]:
    """Return names, bands and trees (x, y in pixels from the corner, radius or NaN)."""
    labels = pd.read_csv(folder / "trees.csv")
    names, bands, trees = [], [], []
    for path in sorted(folder.glob("*.tif")):
        with rasterio.open(path) as data:
            picture = data.read()
        # Labels count pixels from their centres.
        xy = labels.loc[labels.image == path.stem, ["x_px", "y_px"]].to_numpy(float) + 0.5
        radius = fitted_radii(picture, xy)
        names.append(path.stem)
        bands.append(picture)
        trees.append(np.column_stack([xy, radius]))
    return names, bands, trees


def simulated(number: int) -> SimulatedField:
    """Return a field: four climates, sizes, scales, some bare."""
    settings = replace(
        SimulationSettings(width_px=SIDE_PX, height_px=SIDE_PX, equal_brightness=number % 3 == 0),
        obstacles=0 if number % 5 == 0 else None,
        climate=CLIMATES[number % 4],
        radius_m=((2.0, 7.0), (1.2, 4.0), (3.0, 9.0))[(number // 4) % 3],
        resolution_m=(0.6, 0.5, 0.7)[(number // 3) % 3],
    )
    return simulate_field(910_000 + number, settings)


def trees_of(field: SimulatedField) -> np.ndarray:
    """Return x, y and radius of a field's trees, pixels."""
    return field.obstacles[["x_px", "y_px", "radius_px"]].to_numpy(float)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--fine", type=Path, help="the package with pictures of 0.1 m")
    parser.add_argument("--without", nargs="+", choices=NAMES, default=[], help="of those")
    given = parser.parse_args()
    beside = Path(__file__).resolve().parent.parent.parent / "shared"
    folder = Path(os.environ.get("GEOFIELD_SHARED", beside)) / "data" / "trees_train"
    names, bands, trees = chips(folder)
    judges = left_out(names)
    regions = [np.ones((SIDE_PX, SIDE_PX), bool)] * len(names)
    for seed in range(SIMULATED):
        field = simulated(seed)
        names.append(f"simulated_{seed}")
        bands.append(field.scene.bands)
        trees.append(trees_of(field))
        regions.append(field.field.mask(field.scene.grid))
    if given.fine:
        more_names, more_bands, shown, more_trees = lessons(given.fine, given.without)
        names, bands, trees = names + more_names, bands + more_bands, trees + more_trees
        regions += shown
    number = np.repeat(np.arange(len(names)), [len(t) for t in trees])
    np.savez_compressed(
        given.file,
        names=np.array(names),
        left_out=np.pad(judges, (0, len(names) - len(judges))),
        bands=np.stack(bands).astype(np.uint8),
        regions=np.packbits(np.stack(regions), axis=-1),
        trees=np.column_stack([number, np.concatenate(trees)]),
    )
    print(f"{len(names)} pictures, {judges.sum()} chips left out")


if __name__ == "__main__":
    main()
