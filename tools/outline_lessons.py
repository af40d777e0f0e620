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
from outline_cases import fold_of
from outline_pictures import Picture, kinds
from outline_samples import correction, lesson
from torch import Tensor
from torch.nn import functional
from torch.utils.data import DataLoader, IterableDataset

from geofield.field.network import ANSWER_PX, SIDE_PX

#: Share of real pictures, and of fields that are laid onto other ground.
REAL, LAID = 0.85, 0.35
#: What a site counts by its table: outlines nobody would see are drawn less exactly, and the last
#: table has much that is small and in towns.
WEIGHT = {"truth": 1.2, "own": 1.2, "hard": 0.8, "more": 1.0, "further": 0.7}
#: Lessons that a process hands over at once; lessons that are kept, each drawn about twice.
HANDED, KEPT = 16, 1536
#: Most points of a kind, and further points one after another for the same lessons.
MOST_POINTS, MOST_FURTHER, FURTHER = 8, 4, 0.45
#: Width of a point's bell and of its surroundings, as `geofield.field.network` has them.
BELL, WIDE = 1.4, 10.0


class Lessons(IterableDataset):
    """Draws lessons without end, each process its own, none of a site that is left out."""

    def __init__(self, pictures: Sequence[Picture], without: int | None, seed: int) -> None:
        drawn, made, grounds = kinds(pictures)
        self.drawn, self.grounds = (
            [one for one in some if fold_of(one.site) != without] for some in (drawn, grounds)
        )
        self.made, self.seed = made, seed
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
        cells = (ANSWER_PX, ANSWER_PX)
        self.rows = {
            "values": self.empty(4, SIDE_PX, SIDE_PX, of=torch.uint8),
            "valid": self.empty(SIDE_PX, SIDE_PX, of=torch.bool),
            "has_nir": self.empty(of=torch.bool),
            "target": self.empty(*cells, of=torch.float32),
            "counts": self.empty(*cells, of=torch.float32),
        }
        ahead = 4 if workers else None
        # Before the device is asked for: processes that start later may not share it.
        source = iter(DataLoader(lessons, None, num_workers=workers, prefetch_factor=ahead))
        self.ready: queue.Queue[dict[str, Tensor]] = queue.Queue(maxsize=8)
        threading.Thread(target=self.fetch, args=(source,), daemon=True).start()

    def empty(self, *shape: int, of: torch.dtype) -> Tensor:
        return torch.zeros((KEPT, *shape), dtype=of, device=self.device)

    def fetch(self, source: Iterator[dict[str, Tensor]]) -> None:
        for some in source:
            self.ready.put(some)

    def take_in(self, least: int) -> None:
        """Take in what was drawn meanwhile, and wait until there are enough."""
        while self.full < least or not self.ready.empty():
            some = self.ready.get(timeout=120)
            where = (torch.arange(HANDED) + self.at) % KEPT
            for key, rows in self.rows.items():
                rows[where.to(self.device)] = some[key].to(self.device)
            self.at, self.full = (self.at + HANDED) % KEPT, min(KEPT, self.full + HANDED)

    def draw(self, count: int) -> dict[str, Tensor]:
        """Lessons, an eighth of them each way round."""
        pick = torch.randperm(self.full)[:count].to(self.device)
        parts = {key: list(rows[pick].chunk(8)) for key, rows in self.rows.items()}
        for key in ("values", "valid", "target", "counts"):
            for k, one in enumerate(parts[key]):
                turned = torch.rot90(one, k % 4, (-2, -1))
                parts[key][k] = turned.flip(-1) if k >= 4 else turned
        return {key: torch.cat(some) for key, some in parts.items()}


class Points:
    """The points of some lessons: one in each field, then further ones where an answer errs."""

    def __init__(self, target: Tensor) -> None:
        self.truth, self.device = target.cpu().numpy(), target.device
        self.at_px = np.zeros((len(target), 2, MOST_POINTS, 2), np.float32)
        self.count = np.zeros((len(target), 2), np.int64)
        self.at_px[:, 0, 0], self.count[:, 0] = places(target).cpu().numpy(), 1
        self.further = 0

    def correct(self, odds: Tensor, rng: np.random.Generator) -> None:
        """Add a point to each lesson, in its largest wrong piece."""
        answers = odds.float().cpu().numpy()
        for k, answer in enumerate(answers):
            found = correction(answer, self.truth[k], rng)
            kind = 0 if found is None or found[0] else 1
            if found is not None and self.count[k, kind] < MOST_POINTS:
                self.at_px[k, kind, self.count[k, kind]] = found[1]
                self.count[k, kind] += 1
        self.further += 1

    @property
    def maps(self) -> Tensor:
        """As the network takes them."""
        at, count = (torch.from_numpy(one).to(self.device) for one in (self.at_px, self.count))
        return maps(at, count)


def places(target: Tensor) -> Tensor:
    """A place in each field, mostly not beside its border, pixels of `SIDE_PX`."""
    inside = (target > 0.5).float()[:, None]
    deep = -functional.max_pool2d(-functional.pad(inside, (1, 1, 1, 1)), 3, 1)
    chance = torch.where(deep.amax((1, 2, 3), keepdim=True) > 0, deep, inside + 1e-6).flatten(1)
    at = torch.multinomial(chance, 1)[:, 0]
    cell = SIDE_PX / ANSWER_PX
    corner = torch.stack([at % ANSWER_PX, at // ANSWER_PX], 1) * cell
    return corner + torch.rand(len(at), 2, device=target.device) * cell


def maps(at_px: Tensor, count: Tensor) -> Tensor:
    """As `geofield.field.network.points_maps`, of a batch.

    Parameters
    ----------
    at_px : Tensor (n, 2, most, 2)
        Points that belong and that do not, pixels of `SIDE_PX`.
    count : Tensor (n, 2)
    """
    grid = torch.arange(ANSWER_PX, device=at_px.device) + 0.5
    x, y = (at_px * (ANSWER_PX / SIDE_PX)).unbind(-1)
    away = (grid - x[..., None, None]) ** 2 + (grid[:, None] - y[..., None, None]) ** 2
    there = torch.arange(at_px.shape[2], device=at_px.device) < count[..., None]
    away = torch.where(there[..., None, None], away, torch.full_like(away, 1e6)).amin(2)
    bells = torch.stack([torch.exp(-away / (2 * BELL**2)), torch.exp(-away.sqrt() / WIDE)], 2)
    return bells.flatten(1, 2)


def normalised(values: Tensor, valid: Tensor, has_nir: Tensor) -> Tensor:
    """As `geofield.field.network.normalised`, of a batch."""
    v, ok = values.float(), valid[:, None].float()
    count = ok.sum((2, 3), keepdim=True).clamp(min=1)

    def spread(band: Tensor) -> tuple[Tensor, Tensor]:
        mean = (band * ok).sum((2, 3), keepdim=True) / count
        square = ((band - mean).square() * ok).sum((2, 3), keepdim=True) / count
        return mean, square.sqrt() + 6.0

    weight = torch.tensor([0.298, 0.587, 0.114], device=v.device).view(1, 3, 1, 1)
    luma = (v[:, :3] * weight).sum(1, keepdim=True)
    middle, contrast = spread(luma)
    red, near = v[:, :1], v[:, 3:]
    mean, own = spread(near)
    has = has_nir.view(-1, 1, 1, 1).float()
    green = 3.0 * (near - red) / (near + red + 20.0)
    layers = [(v[:, :3] - middle) / contrast, has * (near - mean) / own, has * green]
    return torch.cat([*layers, torch.ones_like(luma)], 1).clamp(-4, 4) * ok
