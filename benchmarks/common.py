"""What all benchmarks share: the machine's facts and the page they are written to."""

from __future__ import annotations

import csv
import json
import os
import platform
from collections.abc import Iterable, Iterator
from importlib import metadata
from pathlib import Path

import numpy as np
import shapely
from rasterio.features import rasterize
from scipy import ndimage

from geofield.imagery import read_scene
from geofield.model import Scene

#: Pictures and outlines beside the project.
DATA = Path(os.environ.get("GEOFIELD_SHARED", Path(__file__).parents[2] / "shared")) / "data"
RESULTS = Path(__file__).resolve().parent / "results"


def machine(*libraries: str) -> list[str]:
    """Lines on the machine and the versions that the figures depend on."""
    cpu = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        models = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        cpu = models[0].split(":", 1)[1].strip() if models else cpu
    names = ("numpy", "scipy", "scikit-image", "shapely", "rasterio", *libraries)
    found = ", ".join(f"{name} {metadata.version(name)}" for name in dict.fromkeys(names))
    return [
        f"Machine: {cpu}, {os.cpu_count()} cores, {platform.system()}; "
        f"Python {platform.python_version()}.",
        f"Libraries: {found}.",
    ]


def write_page(name: str, title: str, lines: Iterable[str]) -> None:
    """Print a page and keep it as ``results/NAME.md``."""
    text = "\n".join([f"# {title}", "", *lines, ""])
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / f"{name}.md").write_text(text, encoding="utf-8")
    print(text)


def overlap(found: shapely.Polygon, truth: shapely.Polygon) -> float:
    """Intersection over union."""
    return found.intersection(truth).area / found.union(truth).area


def overlap_mask(mask: np.ndarray, truth: shapely.Polygon) -> float:
    """The same of a mask, its holes filled."""
    true = rasterize([(truth, 1)], mask.shape).astype(bool)
    mask = ndimage.binary_fill_holes(mask)
    return float((mask & true).sum() / max((mask | true).sum(), 1))


def digitised(
    table: Path, folder: str | None = None
) -> Iterator[tuple[str, Scene, float, float, shapely.Polygon]]:
    """Image, scene, point and outline, pixel coordinates, of a table of outlines drawn by eye.

    None where the pictures are missing. `folder` is the pictures' when the table has no such
    column.
    """
    if not (DATA / "trees").is_dir():
        return
    with table.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            scene = read_scene(DATA / (folder or row["folder"]) / f"{row['image']}.tif")
            x, y = float(row["seed_x_px"]), float(row["seed_y_px"])
            yield row["image"], scene, x, y, shapely.Polygon(json.loads(row["polygon_px"]))
