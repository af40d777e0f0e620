"""Train the network that says which ground belongs to the field around the points.

    python tools/train_outlines.py [--without 0] [--folds 3] [--steps 2000]

Needs the dependency group `train` (PyTorch), which the package itself does not: OpenCV runs
the network. The sites of one fold are left out; `learned/outline.json` says which were learned
from, so that figures can be taken of the others.

The file that is shipped was trained with ``--steps 5500`` by PyTorch 2.15 (45 minutes of one
core) on 354 outlines, when the last tenth of `field_labels_further.csv` was still to be drawn:
learning again sees some more. What gained nothing: 2 500 of 4 000 steps on the 165 outlines there
were before, where it was broken off; a picture seen in four or eight turns; the mean with the
network that was shipped before.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import shapely
import torch
from numpy.typing import NDArray
from outline_cases import Case, fold_of, labelled, simulated
from scipy import ndimage
from torch import Tensor, nn
from torch.nn import functional

from geofield.field.network import ANSWER_PX, BANDS, POINTS, SIDE_PX, normalised, points_maps

FloatArray = NDArray[np.float32]
LEARNED = Path(__file__).resolve().parent.parent / "src/geofield/learned"
SEED = 3
BATCH, RATE, DECAY = 8, 2.5e-3, 2e-2
#: Channels at each depth; so many of the upper ones compare with the points.
WIDTHS, COMPARED = (32, 48, 72, 96), 2
#: Share of real pictures; of batches that also see corrective points; of those without near
#: infrared and without colour.
REAL, CORRECTED, NO_NIR, GREY = 0.85, 0.4, 0.33, 0.2
#: Simulated pictures are reduced to this side, pixels; their number; the seed of the first.
SIMULATED_PX, SIMULATED, SIMULATION_SEED = 320, 72, 52_000
#: What a site counts by its table: outlines nobody would see are drawn less exactly, and the last
#: table has much that is small and in towns.
WEIGHT = {"truth": 1.2, "own": 1.2, "hard": 0.8, "more": 1.0, "further": 0.7}


class Block(nn.Module):
    """Two convolutions, normalised."""

    def __init__(self, taken: int, given: int) -> None:
        super().__init__()
        self.layers = nn.Sequential(
            nn.Conv2d(taken, given, 3, padding=1, bias=False),
            nn.BatchNorm2d(given),
            nn.ReLU(),
            nn.Conv2d(given, given, 3, padding=1, bias=False),
            nn.BatchNorm2d(given),
            nn.ReLU(),
        )

    def forward(self, x: Tensor) -> Tensor:
        """Apply."""
        return self.layers(x)


class OutlineNet(nn.Module):
    """A U-Net that is told the points, and compares every place with them.

    At two depths the features are compared with their mean at the points that belong: how
    unlike a place is from the ground that was pointed at.
    """

    def __init__(self, bands: int, points: int) -> None:
        super().__init__()
        self.stem = nn.Sequential(
            nn.Conv2d(bands, 12, 3, stride=2, padding=1, bias=False),
            nn.BatchNorm2d(12),
            nn.ReLU(),
            nn.Conv2d(12, 24, 3, stride=2, padding=1, bias=False),
            nn.BatchNorm2d(24),
            nn.ReLU(),
        )
        taken = 24 + 2 * bands + points
        self.down = nn.ModuleList()
        for at, width in enumerate(WIDTHS):
            self.down.append(Block(taken, width))
            taken = 2 * width if at < COMPARED else width
        self.up = nn.ModuleList()
        for at in reversed(range(len(WIDTHS) - 1)):
            skip = 2 * WIDTHS[at] if at < COMPARED else WIDTHS[at]
            self.up.append(Block(WIDTHS[at + 1] + skip, WIDTHS[at]))
        self.out = nn.Conv2d(WIDTHS[0], 1, 1)
        self.drop = nn.Dropout2d(0.1)

    def forward(self, bands: Tensor, points: Tensor) -> Tensor:
        """Log odds of belonging, at a quarter of the resolution."""
        quarter = functional.avg_pool2d(bands, 4)
        at_points = points[:, :1]
        x = torch.cat([self.stem(bands), quarter, unlike(quarter, at_points), points], 1)
        kept = []
        for at, block in enumerate(self.down):
            if at:
                x = functional.max_pool2d(x, 2)
                at_points = functional.avg_pool2d(at_points, 2)
            x = block(x)
            if at < COMPARED:
                x = torch.cat([x, unlike(x, at_points)], 1)
            kept.append(x)
        x = self.drop(kept.pop())
        for block, skip in zip(self.up, reversed(kept), strict=True):
            x = functional.interpolate(x, scale_factor=2.0, mode="nearest")
            x = block(torch.cat([x, skip], 1))
        return self.out(x)


def unlike(x: Tensor, at_points: Tensor) -> Tensor:
    """How far features are from their mean at the points."""
    share = at_points / at_points.sum((2, 3), keepdim=True)
    return torch.abs(x - (x * share).sum((2, 3), keepdim=True))


# ---------------------------------------------------------------- pictures, disturbed


@dataclass
class Picture:
    """A picture with a field in it.

    Attributes
    ----------
    mark, site : str
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


def turned(
    picture: Picture, rng: np.random.Generator
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8]]:
    """Bands (rows, columns, 4), mask and valid pixels of a picture turned, mirrored, scaled."""
    bands = np.ascontiguousarray(np.moveaxis(picture.bands, 0, -1))
    at = 1 if len(picture.masks) > 1 and rng.random() < 0.25 else 0
    mask = picture.masks[at]
    rows, columns = mask.shape
    whole = rng.random()
    scale = SIDE_PX / max(rows, columns)
    if whole > 0.3:
        scale *= math.exp(rng.uniform(math.log(0.62), math.log(2.0)))
    angle = 90.0 * int(rng.integers(4))
    if rng.random() < 0.5:
        angle += rng.normal(0, 18)
    theta = math.radians(angle)
    matrix = scale * np.array(
        [[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]]
    )
    if rng.random() < 0.5:
        matrix = matrix @ np.diag([-1.0, 1.0])
    if rng.random() < 0.3:
        matrix = matrix @ np.diag(np.exp(rng.normal(0, 0.1, 2)))
    # A place in the field comes somewhere into the picture.
    if scale * max(rows, columns) > 1.02 * SIDE_PX:
        y, x = np.nonzero(mask)
        k = int(rng.integers(len(y)))
        pin = np.array([x[k], y[k]], float)
        target = rng.uniform(0.2, 0.8, 2) * SIDE_PX
        # The picture still covers most of the window.
        middle = np.array([columns, rows]) / 2
        room = max(0.0, (scale * max(rows, columns) - SIDE_PX) / 2) / scale
        offset = np.linalg.inv(matrix) @ (np.array([SIDE_PX, SIDE_PX]) / 2 - target) + pin - middle
        offset = np.clip(offset, -room, room)
        shift = np.array([SIDE_PX, SIDE_PX]) / 2 - matrix @ (middle + offset)
    else:
        slack = (SIDE_PX - scale * max(rows, columns)) / 2
        shift = np.array([SIDE_PX, SIDE_PX]) / 2 - matrix @ (np.array([columns, rows]) / 2)
        shift = shift + rng.uniform(-1, 1, 2) * max(slack, 0)
    full = np.column_stack([matrix, shift])
    size = (SIDE_PX, SIDE_PX)
    warped, cut = (
        cv2.warpAffine(each, full, size, flags=cv2.INTER_LINEAR) for each in (bands, mask)
    )
    valid = cv2.warpAffine(np.full((rows, columns), 255, np.uint8), full, size)
    return warped.astype(np.uint8), cut.astype(np.uint8), valid.astype(np.uint8)


def disturbed(bands: NDArray[np.uint8], rng: np.random.Generator) -> FloatArray:
    """Another camera, light, haze and file, (rows, columns, 4)."""
    levels: Any = np.repeat(np.arange(256, dtype=np.float32)[:, None], 4, axis=1)
    if rng.random() < 0.8:
        levels = 255 * (levels / 255) ** np.float32(math.exp(rng.normal(0, 0.22)))
        levels *= np.exp(rng.normal(0, 0.07, 4)).astype(np.float32)
    if rng.random() < 0.3:
        # Grounds of colours that no picture here has: what counts is where they change.
        levels *= np.exp(rng.normal(0, 0.25, 4)).astype(np.float32)
    if rng.random() < 0.15:
        bands = bands[..., [*rng.permutation(3), 3]]
    if rng.random() < 0.35:
        haze = np.float32(rng.uniform(0.1, 0.55))
        colour = np.float32(rng.uniform(120, 235)) + rng.normal(0, 12, 4).astype(np.float32)
        levels = levels * (1 - haze) + haze * colour
    if rng.random() < 0.35:
        levels = (levels - 110) * np.float32(rng.uniform(0.45, 1.4)) + 110
    f: Any = cv2.LUT(bands, levels.astype(np.float32).reshape(1, 256, 4))
    if rng.random() < 0.3:
        f = cv2.GaussianBlur(f, (0, 0), rng.uniform(0.5, 1.3))
    if rng.random() < 0.25:
        # Uneven light.
        few = rng.normal(1, 0.1, (3, 3)).astype(np.float32)
        low = cv2.resize(few, (SIDE_PX, SIDE_PX), interpolation=cv2.INTER_LINEAR)
        f *= low[..., None]
    if rng.random() < 0.35:
        noise: Any = np.empty(f.shape, np.float32)
        cv2.randn(noise, (0, 0, 0, 0), (float(rng.uniform(0.5, 4)),) * 4)  # type: ignore[call-overload]
        f += noise
    if rng.random() < 0.4:
        quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(25, 92))]
        u = cv2.convertScaleAbs(np.maximum(f, 0))
        rgb = cv2.imdecode(cv2.imencode(".jpg", u[..., :3], quality)[1], cv2.IMREAD_COLOR)
        nir = cv2.imdecode(cv2.imencode(".jpg", u[..., 3], quality)[1], cv2.IMREAD_GRAYSCALE)
        f = np.dstack([np.asarray(rgb), np.asarray(nir)]).astype(np.float32)
    return np.clip(f, 0, 255)


def place(mask: NDArray[np.bool_], rng: np.random.Generator) -> tuple[float, float] | None:
    """A place in a mask, mostly not beside its border."""
    if not mask.any():
        return None
    depth = cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)[
        1:-1, 1:-1
    ]
    y, x = np.nonzero(depth >= min(5.0, 0.5 * float(depth.max())))
    k = int(rng.integers(len(y)))
    return x[k] + 0.5, y[k] + 0.5


def sample(
    picture: Picture, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, list, list]:
    """Bands, points, target (half resolution), what counts; the points that belong and do not."""
    while True:
        bands, mask, valid = turned(picture, rng)
        inside = mask > 127
        if inside.sum() >= 500 and (valid > 127).mean() > 0.35:
            break
    values = disturbed(bands, rng)
    dice = rng.random()
    has_nir = dice >= NO_NIR + GREY
    if dice < GREY:
        luma = values[..., :3] @ np.array([0.298, 0.587, 0.114], np.float32)
        values[..., 0] = values[..., 1] = values[..., 2] = luma
    seed = place(inside, rng)
    assert seed is not None
    ok = valid > 127
    stack = np.moveaxis(values, -1, 0)
    x = normalised(stack[:3], stack[3] if has_nir else None, ok)
    points = points_maps([seed], [])
    target: Any = cv2.resize(
        (inside & ok).astype(np.float32), (ANSWER_PX,) * 2, interpolation=cv2.INTER_AREA
    )
    counts: Any = cv2.resize(ok.astype(np.float32), (ANSWER_PX,) * 2, interpolation=cv2.INTER_AREA)
    return x, points, target, counts, [seed], []


def correction(
    odds: FloatArray, target: FloatArray, rng: np.random.Generator
) -> tuple[bool, tuple[float, float]] | None:
    """Whether it belongs, and the middle of the largest wrong piece, full resolution."""
    wrong = (odds > 0) != (target > 0.5)
    labels, count = ndimage.label(wrong)
    if not count:
        return None
    depth = cv2.distanceTransform(np.pad(wrong, 1).astype(np.uint8), cv2.DIST_L2, 3)[1:-1, 1:-1]
    sizes = np.bincount(labels.ravel())[1:]
    largest = 1 + int(np.argmax(sizes))
    own = np.where(labels == largest, depth, 0)
    if own.max() < 1.5:
        return None
    y, x = np.unravel_index(
        int(np.argmax(own + rng.random(own.shape) * 0.3 * own.max())), own.shape
    )
    if labels[y, x] != largest:
        y, x = np.unravel_index(int(np.argmax(own)), own.shape)
    return bool(target[y, x] > 0.5), (4.0 * x + 2.0, 4.0 * y + 2.0)


def loss_of(odds: Tensor, target: Tensor, counts: Tensor) -> Tensor:
    """Cross entropy and the overlap that is missing."""
    odds = odds[:, 0]
    entropy = functional.binary_cross_entropy_with_logits(
        odds, target, weight=counts, reduction="none"
    )
    p = torch.sigmoid(odds) * counts
    t = target * counts
    common = (p * t).sum((1, 2))
    either = (p + t - p * t).sum((1, 2))
    return entropy.mean() + 0.5 * (1 - (common + 1) / (either + 1)).mean()


def predict(net: nn.Module, pictures: list[Picture], mode: str = "nir") -> list[float]:
    """Overlaps at odds of one, of the piece at the point."""
    found = []
    net.eval()
    with torch.no_grad():
        for one in pictures:
            side = max(one.bands.shape[1:])
            stack = np.stack(
                [cv2.resize(b, (SIDE_PX, SIDE_PX), interpolation=cv2.INTER_AREA) for b in one.bands]
            ).astype(np.float32)
            if mode == "grey":
                stack[:3] = np.tensordot([0.298, 0.587, 0.114], stack[:3], 1)
            seed = tuple(v * SIDE_PX / side for v in one.seed_px)
            ok = np.ones((SIDE_PX, SIDE_PX), bool)
            x = normalised(stack[:3], stack[3] if mode == "nir" else None, ok)
            points = points_maps([seed], [])
            odds = net(torch.from_numpy(x)[None], torch.from_numpy(points)[None])[0, 0].numpy()
            mask = odds > 0
            labels, _ = ndimage.label(mask)
            n = labels[int(seed[1] / 4), int(seed[0] / 4)]
            mask = ndimage.binary_fill_holes(labels == n) if n else mask
            truth = cv2.resize(one.masks[0], (ANSWER_PX,) * 2, interpolation=cv2.INTER_AREA) > 127
            found.append(float((mask & truth).sum() / max((mask | truth).sum(), 1)))
    net.train()
    return found


def report(net: nn.Module, judged: list[Picture]) -> str:
    """Mean overlaps by table."""
    parts = []
    for mode in ("nir", "rgb", "grey"):
        got = np.array(predict(net, judged, mode))
        marks = np.array([one.mark for one in judged])
        by = " ".join(f"{m} {got[marks == m].mean():.3f}" for m in dict.fromkeys(marks.tolist()))
        parts.append(f"{mode} {got.mean():.3f} med {np.median(got):.3f} ({by})")
    return "; ".join(parts)


def train(options: argparse.Namespace) -> None:
    """Train and write the network."""
    torch.set_num_threads(1)
    torch.manual_seed(SEED)
    rng = np.random.default_rng(SEED)
    real = [picture_of(one) for one in labelled()]
    judged = [
        one
        for one in real
        if options.without is not None and fold_of(one.site, options.folds) == options.without
    ]
    known = [one for one in real if not any(one is other for other in judged)]
    made = [picture_of(one, SIMULATED_PX) for one in simulated(SIMULATED, SIMULATION_SEED)]
    sites = [one.site for one in known]
    weight = np.array([WEIGHT[one.mark] / sites.count(one.site) ** 0.7 for one in known])
    weight /= weight.sum()
    print(f"{len(known)} real, {len(made)} simulated, {len(judged)} left out", flush=True)
    x, points, *_ = sample(known[0], rng)
    net = OutlineNet(len(x), len(points)).to(memory_format=torch.channels_last)
    print(sum(p.numel() for p in net.parameters()), "weights")
    optimiser = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=DECAY)
    average = torch.optim.swa_utils.AveragedModel(
        net, multi_avg_fn=torch.optim.swa_utils.get_ema_multi_avg_fn(0.997), use_buffers=True
    )
    start, step, shown, running = time.time(), 0, time.time(), 0.0
    while True:
        done = step / options.steps
        if done >= 1:
            break
        for group in optimiser.param_groups:
            group["lr"] = (
                RATE * min(1.0, step / 100 + 0.01) * (0.5 + 0.5 * math.cos(math.pi * done)) + 1e-5
            )
        batch: list[Any] = [
            sample(
                known[int(rng.choice(len(known), p=weight))]
                if rng.random() < REAL
                else made[int(rng.integers(len(made)))],
                rng,
            )
            for _ in range(BATCH)
        ]
        x = torch.from_numpy(np.stack([b[0] for b in batch])).contiguous(
            memory_format=torch.channels_last
        )
        points = np.stack([b[1] for b in batch])
        target = torch.from_numpy(np.stack([b[2] for b in batch]))
        counts = torch.from_numpy(np.stack([b[3] for b in batch]))
        if rng.random() < CORRECTED and step > 200:
            for _ in range(int(rng.integers(1, 3))):
                net.eval()
                with torch.no_grad(), torch.autocast("cpu", torch.bfloat16):
                    odds = net(x, torch.from_numpy(points))[:, 0].float().numpy()
                net.train()
                for k, b in enumerate(batch):
                    fix = correction(odds[k], b[2], rng)
                    if fix is not None:
                        b[4 if fix[0] else 5].append(fix[1])
                        points[k] = points_maps(b[4], b[5])
        optimiser.zero_grad()
        with torch.autocast("cpu", torch.bfloat16):
            odds_now = net(x, torch.from_numpy(points))
        loss = loss_of(odds_now.float(), target, counts)
        loss.backward()
        nn.utils.clip_grad_norm_(net.parameters(), 1.0)
        optimiser.step()
        average.update_parameters(net)
        step += 1
        now = float(loss.detach())
        running = 0.98 * running + 0.02 * now if step > 1 else now
        if time.time() - shown > options.every:
            shown = time.time()
            text = report(average.module, judged) if judged else ""
            print(f"{shown - start:.0f} s, step {step}, loss {running:.3f} {text}", flush=True)
    if judged:
        print("final", report(average.module, judged), flush=True)
    write(average.module.to(memory_format=torch.contiguous_format), known, step)
    print(json.dumps({"steps": step, "seconds": round(time.time() - start)}))


class Whole(nn.Module):
    """The network with one input, as it is run."""

    def __init__(self, net: OutlineNet) -> None:
        super().__init__()
        self.net = net

    def forward(self, x: Tensor) -> Tensor:
        """Log odds of belonging."""
        points = functional.avg_pool2d(x[:, len(BANDS) :], SIDE_PX // ANSWER_PX)
        return self.net(x[:, : len(BANDS)], points)


def write(net: OutlineNet, known: list[Picture], steps: int) -> None:
    """Write the network and what it was trained on."""
    shown = torch.zeros(1, len(BANDS) + len(POINTS), SIDE_PX, SIDE_PX)
    shown[:, len(BANDS) :] = 1.0
    file = str(LEARNED / "outline.onnx")
    torch.onnx.export(Whole(net).eval(), (shown,), file, opset_version=17, dynamo=False)
    facts = {
        "inputs": [*BANDS, *POINTS],
        "outputs": ["log_odds"],
        "learned_by": "tools/train_outlines.py",
        "seed": SEED,
        "steps": steps,
        "sites": sorted({one.site for one in known}),
    }
    text = json.dumps(facts, indent=1).replace(",\n  ", ", ")
    (LEARNED / "outline.json").write_text(text + "\n", encoding="utf-8")


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--without", type=int, default=0, help="leave out this fold's sites")
    parser.add_argument("--folds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--every", type=float, default=240.0, help="seconds between reports")
    train(parser.parse_args())


if __name__ == "__main__":
    main()
