"""Searches that the ranking learns from: all outlines of each, with their overlap with the truth.

Every field is searched with the network and the ranking that were learned without its site, as it
is and as another picture, every other one again with points that correct it.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from multiprocessing import Pool

import numpy as np
import shapely
from outline_cases import (
    Case,
    fold_of,
    labelled,
    learned_without,
    middle_of_error,
    other,
    reseeded,
    simulated,
)

from geofield.field.search import search_field

#: Simulated pictures; points that correct what was found before.
SIMULATED, CORRECTIONS = 20, 3
#: Other pictures of the fields.
OTHERS = ("colour", "grey", "JPEG 40", "colour", "grey", "haze", "contrast")


@dataclass
class Searched:
    """The outlines of one search, with their overlaps with the truth."""

    name: str
    mark: str
    site: str
    names: tuple[str, ...]
    figures: np.ndarray
    polygons: list[shapely.Polygon]
    overlap: np.ndarray
    corrections: int
    #: The outlines of the ground that is taken, once that is known.
    ground: np.ndarray = field(default_factory=lambda: np.empty(0, int))

    @property
    def fold(self) -> int:
        return fold_of(self.site)


def searched(case: Case) -> list[Searched]:
    """The search of a case, of every other one again with points where the one taken errs."""
    learned = learned_without(case.site)
    search = search_field(case.scene, case.x_px, case.y_px, learned=learned)
    truth = shapely.transform(case.truth, lambda c: c / search.factor)
    found = []
    include: tuple[tuple[float, float], ...] = ()
    exclude: tuple[tuple[float, float], ...] = ()
    for turn in range(1 + CORRECTIONS):
        candidates, taken = search.answer(include, exclude)
        if taken is None:
            break
        polygons = [one.polygon for one in candidates]
        common = shapely.area(shapely.intersection(polygons, truth))
        either = shapely.area(polygons) + truth.area - common
        names = tuple(candidates[0].figures)
        values = np.array([[one.figures[name] for name in names] for one in candidates])
        name = f"{case.name} {turn}"
        mark = case.mark if turn == 0 else f"{case.mark} clicked {turn}"
        overlap = common / either
        found.append(Searched(name, mark, case.site, names, values, polygons, overlap, turn))
        wrong = middle_of_error(taken.candidate.polygon, truth, search.frame.shape)
        if wrong is None or zlib.crc32(case.name.encode()) % 2:
            break
        if wrong[0]:
            include = (*include, wrong[1])
        else:
            exclude = (*exclude, wrong[1])
    return found


def cases() -> Iterator[Case]:
    """What is learned from: each field as it is and as another picture; simulated ones."""
    for case in labelled():
        yield case
        pick = zlib.crc32(case.name.encode())
        yield other(reseeded(case), OTHERS[pick % len(OTHERS)])
    yield from simulated(SIMULATED)


def all_searched(processes: int) -> Iterator[Searched]:
    """The searches of every case."""
    some = list(cases())
    with Pool(processes) as pool:
        for number, found in enumerate(pool.imap(searched, some, chunksize=4), 1):
            yield from found
            if number % 50 == 0:
                print(f"{number} of {len(some)}", flush=True)
