"""Pictures of 0.1 m, labelled crown by crown: what the crown network learns of drones' pictures.

    pip download --no-deps deepforest==2.1.0
    python tools/fine_pictures.py deepforest-2.1.0-py3-none-any.whl

They lie in that package (B. G. Weinstein et al., MIT License; imagery of the US National Ecological
Observatory Network). Two show conifers of Yellowstone, with long shadows on grass, one pines on
sand in Florida, one a burnt wood of California. All four are learned from (`crown_pictures`,
``--fine``); what a network finds on one that it has not seen, a training ``--without`` it tells.
Run alone, this prints what detection finds on each.
"""

from __future__ import annotations

import argparse
import io
import warnings
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import cv2
import numpy as np
import shapely
from affine import Affine
from PIL import Image
from pyproj import CRS

import geofield as gf
from geofield.errors import ObstacleWarning
from geofield.evaluation import match_points

NAMES = (
    "2019_YELL_2_528000_4978000_image_crop2",
    "2019_YELL_2_541000_4977000_image_crop",
    "OSBS_029",
    "SOAP_061",
)
TAKEN_M, RESOLUTION_M = 0.1, 0.3
"""Pixels as they were taken, and as they are learned from: hardly finer than the working grid."""
SIDE_PX, STEP = 256, 0.75
NEAR_M = 2.5


def labelled(wheel: Path, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return a picture (rows, cols, 3) and its trees: x, y, radius, pixels of 0.1 m."""
    with zipfile.ZipFile(wheel) as package:
        picture = Image.open(io.BytesIO(package.read(f"deepforest/data/{name}.png")))
        said = ET.fromstring(package.read(f"deepforest/data/{name}.xml"))
    corners = ("xmin", "ymin", "xmax", "ymax")
    boxes = [[float(box.findtext(side, "nan")) for side in corners] for box in said.iter("bndbox")]
    x0, y0, x1, y1 = np.array(boxes).T
    trees = np.column_stack([(x0 + x1) / 2, (y0 + y1) / 2, (x1 - x0 + y1 - y0) / 4])
    return np.asarray(picture.convert("RGB")), trees


def lessons(
    wheel: Path, without: list[str]
) -> tuple[list[str], list[np.ndarray], list[np.ndarray], list[np.ndarray]]:
    """Return names, bands (4, rows, cols), valid pixels and trees of square parts.

    Parts of a picture overlap; one that ends before they do is mirrored there. Near infrared, which
    these pictures have not, is an even grey, and nobody is shown it.
    """
    names, bands, valid, trees = [], [], [], []
    scale = TAKEN_M / RESOLUTION_M
    for name in NAMES:
        if name in without:
            continue
        picture, crowns = labelled(wheel, name)
        picture = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        rows, cols = picture.shape[:2]
        for row in starts(rows):
            for col in starts(cols):
                part = picture[row : row + SIDE_PX, col : col + SIDE_PX]
                lacking = [(0, SIDE_PX - n) for n in part.shape[:2]]
                shown = np.pad(np.ones(part.shape[:2], bool), lacking)
                part = np.pad(part, [*lacking, (0, 0)], mode="symmetric")
                here = crowns * scale - [col, row, 0]
                inside = ((here[:, :2] > -8) & (here[:, :2] < SIDE_PX + 8)).all(axis=1)
                names.append(f"fine_{name}_{row}_{col}")
                grey = np.full((1, SIDE_PX, SIDE_PX), 128, np.uint8)
                bands.append(np.concatenate([part.transpose(2, 0, 1), grey]))
                valid.append(shown)
                trees.append(here[inside])
    return names, bands, valid, trees


def starts(length_px: int) -> list[int]:
    """Return where parts begin along a side, so that they overlap by a quarter or more."""
    beyond = max(length_px - SIDE_PX, 0)
    count = int(np.ceil(beyond / (SIDE_PX * STEP))) + 1
    return [int(at) for at in np.linspace(0, beyond, count)]


def found(wheel: Path, name: str) -> str:
    """Return what detection with its defaults finds on a picture, in words."""
    picture, trees = labelled(wheel, name)
    rows, cols = picture.shape[:2]
    transform = Affine(TAKEN_M, 0, 500_000, 0, -TAKEN_M, 4_978_000)
    grid = gf.Grid(cols, rows, transform, CRS.from_epsg(32612))
    bands = np.ascontiguousarray(picture.transpose(2, 0, 1))
    scene = gf.Scene(grid, bands, ("red", "green", "blue"), np.ones(grid.shape, bool))
    obstacles = gf.detect_obstacles(scene)
    driven_around = obstacles[obstacles.status == "detected"]
    xy = driven_around[["x_px", "y_px"]].to_numpy(float) * TAKEN_M
    hits = len(match_points(xy, trees[:, :2] * TAKEN_M, NEAR_M).truth_index)
    there = shapely.union_all(list(driven_around.geometry))
    places = shapely.points(np.column_stack(transform * trees[:, :2].T))
    return (
        f"{len(trees)} trees, {len(xy)} detected: precision {hits / max(len(xy), 1):.2f}, "
        f"recall {hits / len(trees):.2f}, F1 {2 * hits / (len(xy) + len(trees)):.3f}; "
        f"{1 - shapely.contains(there, places).mean():.0%} of the centres are driven over"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("wheel", type=Path)
    given = parser.parse_args()
    warnings.simplefilter("ignore", ObstacleWarning)
    for name in NAMES:
        print(f"{name}: {found(given.wheel, name)}", flush=True)


if __name__ == "__main__":
    main()
