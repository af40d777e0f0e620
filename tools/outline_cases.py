"""Pictures, points and true outlines that outlines are learned from and judged by.

Fields drawn by eye, and simulated ones; each also as the pictures that users bring: colour or
grey only, JPEG, haze, little contrast, a point elsewhere in the field. Pictures of one site, and of
its other years, always go into the same fold, whatever else the tables hold. Of each fold there are
a network and a ranking that were learned without its sites (`learned_without`): figures are taken
with these, so that every field can be judged and every field can be learned from.
"""

from __future__ import annotations

import csv
import json
import os
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import shapely
from learned_with import LEFT_OUT
from lossy import through_jpeg
from numpy.typing import NDArray
from rasterio.features import rasterize

from geofield.field.learned import Learned
from geofield.field.ranking import trained
from geofield.imagery import read_scene
from geofield.learned import network
from geofield.model import Scene
from geofield.simulate import SimulationSettings, simulate_field

ROOT = Path(__file__).resolve().parent.parent
DATA = Path(os.environ.get("GEOFIELD_SHARED", ROOT.parent / "shared")) / "data"
#: Outlines drawn by eye: mark, table, folder of the pictures where the table does not say it.
TABLES = (
    ("truth", DATA / "trees" / "field_truth.csv", "trees"),
    ("own", ROOT / "benchmarks" / "field_labels.csv", None),
    ("hard", ROOT / "benchmarks" / "field_labels_hard.csv", None),
    ("more", ROOT / "benchmarks" / "field_labels_more.csv", None),
    ("further", ROOT / "benchmarks" / "field_labels_further.csv", None),
)
#: Sites are left out in so many folds, of the network and of the ranking alike.
FOLDS = 3


@dataclass
class Case:
    """A picture, a seed and the truth, pixel coordinates.

    Attributes
    ----------
    name, mark, site : str
        Which table, and where; years of one place are one site.
    scene : Scene
    x_px, y_px : float
    truth : Polygon
    doubtful : Polygon or None
        The other outline of a field that two were drawn of.
    drawn : str
        How sure the drawing was, plain, fair or doubtful; empty where that was not noted.
    """

    name: str
    mark: str
    site: str
    scene: Scene
    x_px: float
    y_px: float
    truth: shapely.Polygon
    doubtful: shapely.Polygon | None = None
    drawn: str = ""


def site_of(image: str) -> str:
    """The place of a picture, ``riverside_2016_89`` without its year."""
    place, _, number = image.rpartition("_")
    return f"{place.rpartition('_')[0]} {number}"


def fold_of(site: str) -> int:
    """The fold of a site: it stays when tables grow."""
    return zlib.crc32(site.encode()) % FOLDS


def learned_without(site: str) -> Learned:
    """The network and the ranking of a site's fold, which were learned without it."""
    return left_out(fold_of(site))


@cache
def left_out(fold: int) -> Learned:
    """The network and the ranking that were learned without the sites of a fold.

    Raises
    ------
    FileNotFoundError
        When one was not learned yet.
    ValueError
        When the network was learned from sites of the fold, whatever it is called.
    """
    net, table = f"outline_{fold}", f"outline_ranking_{fold}"
    for file, tool in (
        (f"{net}.onnx", f"train_outlines.py --without {fold}"),
        (f"{net}_points.onnx", f"train_outlines.py --without {fold}"),
        (f"{net}.json", f"train_outlines.py --without {fold}"),
        (f"{table}.json", "train_ranking.py"),
    ):
        if not (LEFT_OUT / file).is_file():
            raise FileNotFoundError(f"There is no {LEFT_OUT / file}: learn it with tools/{tool}.")
    found = Learned(network(net, LEFT_OUT), trained(table, LEFT_OUT))
    known = [site for site in found.network.facts["sites"] if fold_of(site) == fold]
    if known:
        raise ValueError(f"{net}.onnx was learned from sites of fold {fold}: {', '.join(known)}.")
    return found


def rows() -> Iterator[tuple[str, str | None, dict[str, str]]]:
    """The rows of all tables, each with its table's mark and folder."""
    for mark, table, folder in TABLES:
        if table.is_file():
            with table.open(newline="", encoding="utf-8") as file:
                for row in csv.DictReader(file):
                    yield mark, folder, row


def sites() -> set[str]:
    """The sites of all fields drawn by eye."""
    return {site_of(row["image"]) for _, _, row in rows()}


def labelled() -> Iterator[Case]:
    """The fields drawn by eye."""
    for mark, folder, row in rows():
        scene = read_scene(DATA / (folder or row["folder"]) / f"{row['image']}.tif")
        x, y = float(row["seed_x_px"]), float(row["seed_y_px"])
        other_px = row.get("polygon_alt_px")
        yield Case(
            f"{mark} {row['image']} ({x:.0f}, {y:.0f})",
            mark,
            site_of(row["image"]),
            scene,
            x,
            y,
            polygon(row["polygon_px"]),
            polygon(other_px) if other_px else None,
            row.get("certainty", ""),
        )


def polygon(text: str) -> Any:
    """The outline of a row."""
    return shapely.make_valid(shapely.Polygon(json.loads(text)))


def simulated(count: int, seed: int = 61_000) -> Iterator[Case]:
    """Simulated fields, plain and crowded by turns."""
    rng = np.random.default_rng(seed)
    for index in range(count):
        side = 640 if index % 2 else 480
        crowns = int(rng.integers(3, 26)) if index % 2 else int(rng.integers(10, 61))
        settings = SimulationSettings(
            width_px=side, height_px=side, obstacles=crowns, equal_brightness=index % 3 == 0
        )
        one = simulate_field(seed + index, settings)
        x, y = one.scene.grid.from_lonlat(one.lon, one.lat)
        truth = one.field.polygon_px(one.scene.grid)
        site = f"simulated {index}"
        yield Case(site, "simulated", site, one.scene, float(x), float(y), truth)


def reseeded(case: Case, number: int = 0) -> Case:
    """The case with another point in its field."""
    rng = np.random.default_rng([zlib.crc32(case.name.encode()), number])
    inner = case.truth.buffer(-5)
    area = inner if not inner.is_empty else case.truth
    row, column = np.nonzero(rasterize([(area, 1)], case.scene.grid.shape))
    at = int(rng.integers(len(row)))
    return replace(
        case, name=f"{case.name} moved {number}", x_px=column[at] + 0.5, y_px=row[at] + 0.5
    )


def other(case: Case, kind: str) -> Case:
    """The case as another picture."""
    scene = case.scene
    bands = scene.bands.astype(np.float32)
    if kind == "colour":
        scene = replace(scene, bands=scene.bands[:3], roles=scene.roles[:3])
    elif kind == "grey":
        grey = np.clip(np.rint(scene.grey), 0, 255).astype(np.uint8)
        scene = replace(scene, bands=grey[None], roles=("grey",))
    elif kind.startswith("JPEG"):
        stored = through_jpeg(np.moveaxis(scene.bands, 0, -1), int(kind.split()[1]))
        scene = replace(scene, bands=np.ascontiguousarray(np.moveaxis(stored, -1, 0)))
    elif kind == "haze":
        scene = replace(scene, bands=np.rint(0.65 * bands + 0.35 * 205).astype(np.uint8))
    elif kind == "contrast":
        scene = replace(scene, bands=np.clip(np.rint(0.7 * bands + 20), 0, 255).astype(np.uint8))
    else:
        raise ValueError(kind)
    return replace(case, name=f"{case.name} {kind}", mark=f"{case.mark} {kind}", scene=scene)


def middle_of_error(
    found: shapely.Polygon, truth: shapely.Polygon, shape: tuple[int, int]
) -> tuple[bool, tuple[float, float]] | None:
    """Whether it belongs, and the middle of the largest wrong piece; None where there is none."""
    drawn, true = (
        np.zeros(shape, np.uint8) if one.is_empty else rasterize([(one, 1)], shape, dtype=np.uint8)
        for one in (found, truth)
    )
    depth = depth_in_error(drawn != true)
    if depth is None:
        return None
    y, x = np.unravel_index(int(np.argmax(depth)), depth.shape)
    return bool(true[y, x]), (float(x) + 0.5, float(y) + 0.5)


def depth_in_error(wrong: NDArray[np.bool_]) -> NDArray[np.float32] | None:
    """How deep each pixel lies in the largest wrong piece; None where nothing is wrong."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(wrong.view(np.uint8), connectivity=4)
    if len(stats) == 1:
        return None
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    own = np.pad(labels == largest, 1).astype(np.uint8)
    return np.asarray(cv2.distanceTransform(own, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1])
