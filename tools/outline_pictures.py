"""The pictures that outlines are learned from, gathered into one file.

    python tools/outline_pictures.py pictures.npz

Fields drawn by eye, simulated ones, and all chips of the tree labels as other ground that fields
are laid onto. Training reads this file and no geodata. Pictures are kept as JPEG of a high quality:
half of the lessons are JPEG of a lower one.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray
from outline_cases import DATA, Case, labelled, rows, simulated, site_of

from geofield.imagery import read_scene

#: JPEG of pictures with fields, and of other ground.
QUALITY, GROUND_QUALITY = 95, 93
#: Simulated pictures are reduced to this side, pixels; their number; the seed of the first.
SIMULATED_PX, SIMULATED, SIMULATION_SEED = 320, 72, 52_000
GROUND, SIMULATION = "ground", "simulated"


@dataclass
class Picture:
    """A picture with a field in it.

    Attributes
    ----------
    mark, site : str
    bands : uint8 array (4, rows, columns)
        Red, green, blue, near infrared.
    masks : list of uint8 array (rows, columns)
        The field as drawn, 255 inside; the second is the other outline of a doubtful one. Of other
        ground, all of it.
    seed_px : (float, float)
    """

    mark: str
    site: str
    bands: NDArray[np.uint8]
    masks: list[NDArray[np.uint8]]
    seed_px: tuple[float, float]


def fields() -> Iterator[Picture]:
    """The fields drawn by eye, then the simulated ones."""
    for case in labelled():
        yield picture_of(case)
    for case in simulated(SIMULATED, SIMULATION_SEED):
        yield picture_of(case, SIMULATED_PX)


def picture_of(case: Case, side_px: int | None = None) -> Picture:
    """A case in a size that is trained on."""
    bands = np.asarray(case.scene.bands, np.uint8)
    scale = 1.0 if side_px is None else side_px / max(bands.shape)
    if side_px is not None:
        size = (side_px, side_px)
        bands = np.stack([cv2.resize(one, size, interpolation=cv2.INTER_AREA) for one in bands])
    masks = []
    for outline in (case.truth, case.doubtful):
        if outline is not None:
            mask = np.zeros(bands.shape[1:], np.uint8)
            for part in shapely.get_parts(outline):
                points = shapely.get_coordinates(part.exterior) * scale
                # OpenCV counts from pixel centres, in sixteenths.
                cv2.fillPoly(mask, [np.rint((points - 0.5) * 16).astype(np.int32)], 255, shift=4)
            masks.append(mask)
    return Picture(case.mark, case.site, bands, masks, (case.x_px * scale, case.y_px * scale))


def grounds() -> Iterator[Picture]:
    """Chips without outlines."""
    drawn = {row["image"] for _, _, row in rows()}
    for file in sorted((DATA / "trees_train").glob("*.tif")):
        if file.stem not in drawn:
            bands = np.asarray(read_scene(file).bands, np.uint8)
            yield Picture(GROUND, site_of(file.stem), bands, [], (0.0, 0.0))


def write(file: Path, pictures: Iterable[Picture]) -> int:
    """Write pictures; their number."""
    facts: list[tuple[str, str, int, float, float]] = []
    coded: list[NDArray[np.uint8]] = []
    for one in pictures:
        quality = GROUND_QUALITY if one.mark == GROUND else QUALITY
        coded += [jpeg(one.bands[2::-1], quality), jpeg(one.bands[3:], quality)]
        coded += [cv2.imencode(".png", mask)[1].ravel() for mask in one.masks]
        facts.append((one.mark, one.site, len(one.masks), *one.seed_px))
    marks, sites, counts, x, y = zip(*facts, strict=True)
    np.savez(
        file,
        marks=np.array(marks),
        sites=np.array(sites),
        counts=np.array(counts),
        seeds_px=np.column_stack([x, y]),
        lengths=np.array([len(one) for one in coded]),
        coded=np.concatenate(coded),
    )
    return len(facts)


def jpeg(bands: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    """One or three bands (blue first) as a file, each band in full resolution."""
    wanted = [cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_SAMPLING_FACTOR, 0x111111]
    picture = np.ascontiguousarray(np.moveaxis(bands, 0, -1))
    return np.asarray(cv2.imencode(".jpg", picture, wanted)[1], np.uint8).ravel()


def read(file: Path) -> list[Picture]:
    """Pictures as they were written."""
    with np.load(file) as data:
        ends = np.cumsum(data["lengths"])
        files = iter(np.split(data["coded"], ends[:-1]))
        found = []
        rows = (data[name].tolist() for name in ("marks", "sites", "counts", "seeds_px"))
        for mark, site, count, (x, y) in zip(*rows, strict=True):
            colour: Any = cv2.imdecode(next(files), cv2.IMREAD_COLOR)
            bands = [*np.moveaxis(colour[..., ::-1], -1, 0), plain(next(files))]
            stack = np.stack(bands).astype(np.uint8)
            masks = [plain(next(files)) for _ in range(count)]
            whole = [np.full(stack.shape[1:], 255, np.uint8)]
            found.append(Picture(mark, site, stack, masks or whole, (x, y)))
    return found


def plain(file: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A picture of one band."""
    return np.asarray(cv2.imdecode(file, cv2.IMREAD_GRAYSCALE), np.uint8)


def kinds(pictures: Sequence[Picture]) -> tuple[list[Picture], list[Picture], list[Picture]]:
    """Fields drawn by eye, simulated ones, and all that may be other ground."""
    made = [one for one in pictures if one.mark == SIMULATION]
    drawn = [one for one in pictures if one.mark not in (SIMULATION, GROUND)]
    return drawn, made, [one for one in pictures if one.mark != SIMULATION]


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    given = parser.parse_args()
    print(f"{write(given.file, [*fields(), *grounds()])} pictures")


if __name__ == "__main__":
    main()
