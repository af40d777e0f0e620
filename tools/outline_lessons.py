"""Lessons that outlines are learned from: drawn by processes, kept and turned on the device."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator, Sequence
from typing import Any

import cv2
import numpy as np
import torch
from numpy.typing import NDArray
from outline_pictures import Picture, kinds
from outline_samples import correction, lesson
from torch import Tensor
from torch.nn import functional
from torch.utils.data import DataLoader, IterableDataset

from geofield.field.network import ANSWER_PX, BANDS, SIDE_PX, points_maps

#: Share of real pictures, and of fields that are laid onto other ground.
REAL, LAID = 0.85, 0.35
#: What a site counts by its table: outlines nobody would see are drawn less exactly, and the last
#: table has much that is small and in towns.
WEIGHT = {"truth": 1.2, "own": 1.2, "hard": 0.8, "more": 1.0, "further": 0.7}
#: Lessons that a process hands over at once; lessons that are kept, each drawn about once or twice.
HANDED, KEPT = 16, 1536
#: How often lessons are asked again with a further point, at most, and how likely each time.
MOST_FURTHER, FURTHER = 4, 0.45


class Lessons(IterableDataset):
    """Draws lessons without end, each process its own."""

    def __init__(self, pictures: Sequence[Picture], seed: int) -> None:
        self.drawn, self.made, self.grounds = kinds(pictures)
        self.seed = seed
        sites = [one.site for one in self.drawn]
        weight = np.array([WEIGHT[one.mark] / sites.count(one.site) ** 0.7 for one in self.drawn])
        self.weight = weight / weight.sum()

    def __iter__(self) -> Iterator[dict[str, Tensor]]:
        info = torch.utils.data.get_worker_info()
        cv2.setNumThreads(1)
        rng = np.random.default_rng([self.seed, info.id if info else 0])
        while True:
            some = [self.draw(rng) for _ in range(HANDED)]
            yield {key: torch.from_numpy(np.stack([one[key] for one in some])) for key in some[0]}

    def draw(self, rng: np.random.Generator) -> dict[str, NDArray[Any]]:
        """One lesson."""
        if rng.random() < REAL:
            picture = self.drawn[int(rng.choice(len(self.drawn), p=self.weight))]
        else:
            picture = self.made[int(rng.integers(len(self.made)))]
        laid = rng.random() < LAID
        return lesson(
            picture, rng, self.grounds[int(rng.integers(len(self.grounds)))] if laid else None
        )


class Kept:
    """The latest lessons on the device, drawn at random, turned and mirrored."""

    def __init__(self, lessons: Lessons, workers: int, device: str) -> None:
        self.device, self.at, self.full = device, 0, 0
        self.rows = {
            "bands": self.empty(len(BANDS), SIDE_PX, of=torch.float16),
            "target": self.empty(1, ANSWER_PX, of=torch.float32),
            "counts": self.empty(1, ANSWER_PX, of=torch.float32),
        }
        ahead = 4 if workers else None
        source = iter(DataLoader(lessons, None, num_workers=workers, prefetch_factor=ahead))
        self.ready: queue.Queue[dict[str, Tensor]] = queue.Queue(maxsize=8)
        threading.Thread(target=self.fetch, args=(source,), daemon=True).start()

    def empty(self, layers: int, side: int, of: torch.dtype) -> Tensor:
        return torch.zeros((KEPT, layers, side, side), dtype=of, device=self.device)

    def fetch(self, source: Iterator[dict[str, Tensor]]) -> None:
        for some in source:
            self.ready.put(some)

    def take_in(self, least: int) -> None:
        """Take in what was drawn meanwhile, and wait until there are enough."""
        missing = -(-(least - self.full) // HANDED)
        for _ in range(max(missing, self.ready.qsize())):
            some = self.ready.get(timeout=120)
            where = (torch.arange(HANDED) + self.at) % KEPT
            for key, rows in self.rows.items():
                rows[where.to(self.device)] = (
                    some[key].view(HANDED, *rows.shape[1:]).to(self.device)
                )
            self.at, self.full = (self.at + HANDED) % KEPT, min(KEPT, self.full + HANDED)

    def draw(self, count: int) -> Asked:
        """Lessons, an eighth of them each way round."""
        pick = torch.randperm(self.full)[:count].to(self.device)
        turned = (torch.cat(list(eight_ways(rows[pick]))) for rows in self.rows.values())
        return Asked(*turned)


def eight_ways(some: Tensor) -> Iterator[Tensor]:
    """Eighths of some pictures, each turned or mirrored in another way."""
    for k, one in enumerate(some.chunk(8)):
        turned = torch.rot90(one, k % 4, (-2, -1))
        yield turned.flip(-1) if k >= 4 else turned


class Asked:
    """Lessons with their points: one in each field, then further ones where an answer errs.

    Attributes
    ----------
    bands, target, counts : Tensor
    include, exclude : list of lists of (float, float)
        The points of each lesson, pixels of `SIDE_PX`.
    odds : Tensor
        What the network answered last.
    further : int
        How often points were added.
    """

    def __init__(self, bands: Tensor, target: Tensor, counts: Tensor) -> None:
        self.bands = bands.float().contiguous(memory_format=torch.channels_last)
        self.target, self.counts = target[:, 0], counts[:, 0]
        self.include = [[(x, y)] for x, y in places(self.target).tolist()]
        self.exclude: list[list[tuple[float, float]]] = [[] for _ in self.include]
        self.odds, self.further = torch.zeros_like(self.target), 0

    def correct(self, rng: np.random.Generator) -> None:
        """Add a point to each lesson, in the largest wrong piece of its answer."""
        answers, truths = self.odds.cpu().numpy(), self.target.cpu().numpy()
        for k, (answer, truth) in enumerate(zip(answers, truths, strict=True)):
            if found := correction(answer, truth, rng):
                belongs, place = found
                (self.include if belongs else self.exclude)[k].append(place)
        self.further += 1

    @property
    def maps(self) -> Tensor:
        """The points as the network takes them."""
        each = [points_maps(*one) for one in zip(self.include, self.exclude, strict=True)]
        return torch.from_numpy(np.stack(each)).to(self.bands.device)


def places(target: Tensor) -> Tensor:
    """A place in each field, mostly not beside its border, pixels of `SIDE_PX`."""
    inside = (target > 0.5).float()[:, None]
    deep = -functional.max_pool2d(-functional.pad(inside, (1, 1, 1, 1)), 3, 1)
    chance = torch.where(deep.amax((1, 2, 3), keepdim=True) > 0, deep, inside + 1e-6).flatten(1)
    at = torch.multinomial(chance, 1)[:, 0]
    cell = SIDE_PX / ANSWER_PX
    corner = torch.stack([at % ANSWER_PX, at // ANSWER_PX], 1) * cell
    return corner + torch.rand(len(at), 2, device=target.device) * cell
