"""Pictures, points and true outlines that the choice of outlines is learned from.

Real fields: those of `field_truth.csv` beside the project, 35 more with a plain border
(`field_labels.csv` here) and 57 vacant lots, meadows and deserts, on many of which nobody
would see one (`field_labels_hard.csv`), all drawn by eye. Simulated fields: other seeds than
those of `field.py`.
"""

from __future__ import annotations

import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
import shapely
from rasterio.features import rasterize

from common import DATA, digitised
from geofield.model import Scene
from geofield.simulate import SimulationSettings, simulate_field, simulate_fields

HERE = Path(__file__).parent
#: Outlines drawn by eye: mark, table, folder of the pictures where the table does not say it.
TABLES = (
    ("truth", DATA / "trees" / "field_truth.csv", "trees"),
    ("own", HERE / "field_labels.csv", None),
    ("hard", HERE / "field_labels_hard.csv", None),
)
SIMULATION_SEED = 11
#: Simulated small fields full of trees, which tear outlines.
CROWDED_SEED, CROWDED_PX, CROWNS = 9000, 480, (10, 60)


@dataclass
class Case:
    """A picture, a seed and the truth."""

    name: str
    site: str
    scene: Scene
    x_px: float
    y_px: float
    truth: shapely.Polygon

    @property
    def mark(self) -> str:
        """The kind of case, and its bands where some are left out."""
        bands = next((end for end in (" rgb", " grey") if self.name.endswith(end)), "")
        return self.name.partition(" ")[0] + bands


class Sited(Protocol):
    """A case of a site."""

    name: str
    site: str


def simulated_one(one: Sited) -> bool:
    """Whether the picture is a simulation."""
    return one.site.startswith("simulated")


def weights(known: Sequence[Sited], of_simulated: float, of_truth: float = 1.0) -> np.ndarray:
    """What each counts: a site by the root of its pictures, as its years are much alike.

    `of_truth` is what fields of `field_truth.csv` count, of which alone it is known how exactly
    they were drawn.
    """
    often = Counter(one.site for one in known)

    def kind(one: Sited) -> float:
        if simulated_one(one):
            return of_simulated
        return of_truth if one.name.startswith("truth") else 1.0

    return np.array([kind(one) / often[one.site] ** 0.5 for one in known])


def folds(known: Sequence[Sited], count: int, seed: int) -> np.ndarray:
    """The sites dealt into folds: the fold of each."""
    sites = sorted({one.site for one in known})
    order = np.random.default_rng(seed).permutation(len(sites))
    fold = {site: int(at) % count for site, at in zip(sites, order, strict=True)}
    return np.array([fold[one.site] for one in known])


def cases(fields: int) -> Iterator[Case]:
    """All cases: two seeds each, real ones also without near infrared and colour."""
    for case in labelled():
        for one in (case, reseeded(case)):
            yield one
            yield replace(one, name=f"{one.name} rgb", scene=colours(one.scene))
        yield replace(case, name=f"{case.name} grey", scene=grey(case.scene))
    for index, case in enumerate(simulated(fields)):
        yield case
        other = reseeded(case)
        yield replace(other, scene=colours(other.scene)) if index % 2 else other


def labelled() -> Iterator[Case]:
    for mark, table, folder in TABLES:
        for image, scene, x, y, truth in digitised(table, folder):
            place, _, number = image.rpartition("_")
            site = f"{place.rpartition('_')[0]} {number}"
            yield Case(f"{mark} {image} ({x:.0f}, {y:.0f})", site, scene, x, y, truth)


def simulated(count: int) -> Iterator[Case]:
    rng = np.random.default_rng(CROWDED_SEED)
    crowded = (
        simulate_field(
            CROWDED_SEED + index,
            SimulationSettings(
                width_px=CROWDED_PX,
                height_px=CROWDED_PX,
                obstacles=int(rng.integers(*CROWNS)),
                equal_brightness=index % 3 == 0,
            ),
        )
        for index in range(count)
    )
    plain = simulate_fields(count, SIMULATION_SEED)
    for kind, fields in (("plain", plain), ("crowded", crowded)):
        for index, one in enumerate(fields):
            x, y = one.scene.grid.from_lonlat(one.lon, one.lat)
            truth = one.field.polygon_px(one.scene.grid)
            site = f"simulated {index % 4}"
            yield Case(f"{kind} {index}", site, one.scene, x, y, truth)


def reseeded(case: Case) -> Case:
    """The case with another point in its field."""
    rng = np.random.default_rng(zlib.crc32(case.name.encode()))
    row, column = np.nonzero(rasterize([(case.truth.buffer(-5), 1)], case.scene.grid.shape))
    at = int(rng.integers(len(row)))
    return replace(case, name=f"{case.name} moved", x_px=column[at] + 0.5, y_px=row[at] + 0.5)


def colours(scene: Scene) -> Scene:
    """The scene without its near infrared."""
    return replace(scene, bands=scene.bands[:3], roles=scene.roles[:3])


def grey(scene: Scene) -> Scene:
    """The scene without its colours."""
    band = np.clip(np.rint(scene.grey), 0, 255).astype(np.uint8)
    return replace(scene, bands=band[None], roles=("grey",))
