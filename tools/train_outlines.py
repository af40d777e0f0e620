"""Train the network that says which ground belongs to the field around the points.

    python tools/outline_pictures.py pictures.npz
    python tools/train_outlines.py pictures.npz [--without K] [--seconds 450] [--workers 2]

Needs the dependency group `train` (PyTorch) and the weights of `tiny_vit`, which the package itself
does not: OpenCV runs the network. What is shipped (`learned/outline.onnx`) learns from all fields
drawn by eye. With ``--without K`` the sites of fold K are left out, as fields and as other ground,
and `left_out/outline_K.onnx` is written: figures of the method are taken with these three, each on
its own fold, and the ranking is learned behind them. The ``.json`` beside a network says which
sites it was learned from.

The learning rate falls to nothing by the clock. All four learned side by side on one accelerator
(NVIDIA H200, 450 seconds, 1 500 to 1 730 steps of 64 out of 62 000 to 106 000 lessons; PyTorch
2.11). Alone, looking once, at odds of one, they answer for the fields of their own folds (four
bands, colour, grey):

| fold | fields | these | with the encoder of ImageNet before, 2 500 to 2 800 steps of 8 |
| --- | --- | --- | --- |
| 0 | 190 | .812 / .801 / .762 | .750 / .736 / .704 |
| 1 | 199 | .810 / .805 / .797 | .757 / .759 / .749 |
| 2 | 163 | .830 / .828 / .810 | |

After half of the time they gave .797 to .834 in four bands. With 240 steps of 32, an encoder that
saw the picture in 448 px gave the same as in 256 (.659 and .664; .33 s of one core for .10), and
one that learned thrice as fast .659.

What gained nothing: learning on from these weights for 505 seconds (H100, 2 100 steps of 64) with
answers of 128 px for 64 and two further answers, of which only the better one is taught: looking
once .808, .813 and .836, looking twice .825 for .825 (552 fields), the best of the three .826 where
the first has .816 (184 fields); the mean with what it began from, .820 for .819. Of what is missing
two fifths lie within 4 px of the border as it was drawn (overlap without those .893).

What gained nothing either: its second part taught on by clicks, with the ground that each of them
corrects as a fifth map (1 680 steps of 16). Alone it has .005 more from the third correction on; in
the whole search .908, .918 and .926 with three to five points became .900, .912 and .916, and 4.21
points until .93 became 4.15 (175 fields of folds 1 and 2, ranking as it is).

What gained nothing with the encoder before, whose networks stood at .75 for want of more lessons:
a picture seen in four or eight turns; the mean with an earlier network; deeper blocks that did not
learn slower; a first answer as an input of a second one; outlines of 78 or 124 more fields, learned
on; MobileSAM's own masks as soft answers. Its masks beside our answer in the whole search gave .785
for .769 (fold 1) at .8 s more for a field; its encoder, trained on here, gives more.
"""

from __future__ import annotations

import argparse
import copy
import json
import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from learned_with import LEARNED, LEFT_OUT, learned_with
from numpy.typing import NDArray
from onnx_file import finish
from outline_cases import FOLDS, TABLES, fold_of
from outline_lessons import FURTHER, MOST_FURTHER, Asked, Kept, Lessons
from outline_network import FEATURES, OutlineNet, Step
from outline_pictures import SIMULATION, Picture, kinds, read
from tiny_vit import pretrained
from torch import Tensor, nn
from torch.nn import functional

from geofield.field.morphology import filled, part_at
from geofield.field.network import ANSWER_PX, BANDS, POINTS, SIDE_PX, normalised, points_maps

SEED = 3
BATCH, RATE, DECAY, AVERAGE = 64, 2e-3, 2e-2, 0.998
#: How much slower what MobileSAM taught is changed.
KNOWN_RATE = 0.15
#: Steps in which the rate rises, and before which there are no further points.
RISING, ALONE = 200, 100


def loss_of(odds: Tensor, target: Tensor, counts: Tensor) -> Tensor:
    """Cross entropy and the overlap that is missing."""
    entropy = functional.binary_cross_entropy_with_logits(
        odds, target, weight=counts, reduction="none"
    )
    p = torch.sigmoid(odds) * counts
    t = target * counts
    common = (p * t).sum((1, 2))
    either = (p + t - p * t).sum((1, 2))
    return entropy.mean() + 0.5 * (1 - (common + 1) / (either + 1)).mean()


class Learner:
    """A network that learns from lessons, and the mean of its weights over some hundred steps."""

    def __init__(self, kept: Kept, device: str) -> None:
        self.kept, self.device, self.rng = kept, device, np.random.default_rng(SEED)
        net = OutlineNet(len(BANDS), len(POINTS))
        net.encoder.take(torch.load(pretrained(), map_location="cpu", weights_only=True))
        self.net = net.to(device, memory_format=torch.channels_last)
        self.average = copy.deepcopy(self.net).eval().requires_grad_(False)
        self.optimiser = optimiser_of(self.net)
        both = zip(self.average.state_dict().values(), self.net.state_dict().values(), strict=True)
        pairs = [(mean, now.detach()) for mean, now in both if mean.dtype.is_floating_point]
        self.mean, self.now = [mean for mean, _ in pairs], [now for _, now in pairs]
        self.step, self.loss = 0, torch.zeros((), device=device)
        self.asked: Asked | None = None

    def choose(self) -> Asked:
        """Other lessons, or the same again with a further point where the answer errs most."""
        again = self.step > ALONE and self.rng.random() < FURTHER
        if again and self.asked and self.asked.further < MOST_FURTHER:
            self.asked.correct(self.rng)
            return self.asked
        self.kept.take_in(2 * BATCH)
        return self.kept.draw(BATCH)

    def learn(self, done: float) -> None:
        """One step, at a share of the time."""
        self.asked = asked = self.choose()
        rate = RATE * min(1.0, self.step / RISING + 0.01) * 0.5 * (1 + math.cos(math.pi * done))
        for group in self.optimiser.param_groups:
            group["lr"] = group["share"] * (rate + 1e-6)
        self.net.train()
        with torch.autocast(self.device, torch.bfloat16):
            odds = self.net(asked.bands, asked.maps)[:, 0].float()
        loss = loss_of(odds, asked.target, asked.counts)
        self.optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self.net.parameters(), 1.0)
        self.optimiser.step()
        self.step += 1
        share = 1 - min(AVERAGE, self.step / (self.step + 10))
        torch._foreach_lerp_(self.mean, self.now, share)
        asked.odds = odds.detach()
        self.loss += (loss.detach() - self.loss) * max(0.02, 1 / self.step)


def optimiser_of(net: nn.Module) -> torch.optim.Optimizer:
    """AdamW, slower for what was known; what shifts and biases is not pulled to zero."""
    groups: dict[tuple[float, float], list[nn.Parameter]] = {}
    for name, p in net.named_parameters():
        plain = p.ndim < 2 or name.endswith(("attention_biases", "where"))
        share = KNOWN_RATE if name.startswith("encoder.") else 1.0
        groups.setdefault((share, 0.0 if plain else DECAY), []).append(p)
    return torch.optim.AdamW(
        [
            {"params": some, "share": share, "weight_decay": decay}
            for (share, decay), some in groups.items()
        ],
        lr=RATE,
    )


def report(net: nn.Module, judged: Sequence[Picture], device: str) -> str:
    """Mean and median overlaps of the ground with odds above one at the point, looking once."""
    points = np.stack([points_maps([at_px(one)], []) for one in judged])
    parts = []
    for mode in ("nir", "rgb", "grey"):
        bands = np.stack([shown(one, mode) for one in judged])
        batches = zip(
            torch.from_numpy(bands).split(BATCH), torch.from_numpy(points).split(BATCH), strict=True
        )
        with torch.no_grad():
            odds = [net(b.to(device), p.to(device))[:, 0].cpu().numpy() for b, p in batches]
        pairs = zip(np.concatenate(odds), judged, strict=True)
        got = [overlap(answer > 0, one) for answer, one in pairs]
        parts.append(f"{mode} {np.mean(got):.3f} med {np.median(got):.3f}")
    return "; ".join(parts)


def at_px(one: Picture) -> tuple[float, float]:
    """The point of a picture, pixels of `SIDE_PX`."""
    scale = SIDE_PX / max(one.bands.shape)
    return one.seed_px[0] * scale, one.seed_px[1] * scale


def shown(one: Picture, mode: str) -> NDArray[np.float32]:
    """A picture as the network takes it."""
    size = (SIDE_PX, SIDE_PX)
    bands = [cv2.resize(band, size, interpolation=cv2.INTER_AREA) for band in one.bands]
    stack = np.stack(bands).astype(np.float32)
    if mode == "grey":
        stack[:3] = np.tensordot([0.298, 0.587, 0.114], stack[:3], 1)
    return normalised(stack[:3], stack[3] if mode == "nir" else None, np.ones(size, np.bool_))


def overlap(mask: NDArray[np.bool_], one: Picture) -> float:
    """Of the part of an answer at the point with the field as drawn."""
    own = filled(part_at(mask, *(np.array(at_px(one)) * ANSWER_PX / SIDE_PX)))
    truth = cv2.resize(one.masks[0], (ANSWER_PX,) * 2, interpolation=cv2.INTER_AREA) > 127
    return float((own & truth).sum() / max((own | truth).sum(), 1))


def train(options: argparse.Namespace) -> None:
    """Train and write the network."""
    torch.manual_seed(SEED)
    device, left_out = options.device, options.without
    pictures = read(options.pictures)
    taught = [one for one in pictures if one.mark == SIMULATION or fold_of(one.site) != left_out]
    judged = [one for one in kinds(pictures)[0] if fold_of(one.site) == left_out]
    lessons = Lessons(taught, SEED)
    print(f"{len(lessons.drawn)} fields, {len(lessons.grounds)} grounds, {len(judged)} judge")
    learner = Learner(Kept(lessons, options.workers, device), device)
    start = shown = time.time()
    while (now := time.time()) < start + options.seconds:
        learner.learn((now - start) / options.seconds)
        if now > shown + options.every:
            shown = now
            told = report(learner.average, judged, device) if judged else ""
            loss = float(learner.loss)
            print(f"{now - start:.0f} s, step {learner.step}, loss {loss:.3f} {told}", flush=True)
    if judged:
        print("final", report(learner.average, judged, device), flush=True)
    write(learner, lessons, options)
    print(json.dumps({"steps": learner.step, "seconds": round(time.time() - start)}))


def write(learner: Learner, lessons: Lessons, options: argparse.Namespace) -> None:
    """Write the network and what it was trained on."""
    net = learner.average.to("cpu", memory_format=torch.contiguous_format)
    file = options.out or (
        LEARNED / "outline.onnx"
        if options.without is None
        else LEFT_OUT / f"outline_{options.without}.onnx"
    )
    facts = {
        "inputs": [*BANDS, *POINTS],
        "outputs": ["log_odds"],
        "steps": write_steps(net, file),
        "learned_by": "tools/train_outlines.py",
        "learned_with": learned_with(
            [*(table for _, table, _ in TABLES), pretrained()],
            ["torch"],
            seed=SEED,
            # By the clock: learning again gives a network like it, not the same file.
            steps=learner.step,
            seconds=options.seconds,
            device=torch.cuda.get_device_name() if options.device == "cuda" else "cpu",
            without=[options.without, FOLDS],
        ),
        "sites": sorted({one.site for one in lessons.drawn}),
    }
    text = json.dumps(facts, indent=1).replace(",\n  ", ", ")
    file.with_suffix(".json").write_text(text + "\n", encoding="utf-8")


def write_steps(net: OutlineNet, file: Path) -> list[dict[str, Any]]:
    """Write what sees the picture, and beside it what is asked about points; what each takes."""
    bands = torch.zeros(1, len(BANDS), SIDE_PX, SIDE_PX)
    points = torch.ones(1, len(POINTS), ANSWER_PX, ANSWER_PX)
    with torch.no_grad():
        seen = net.picture(bands)
    asked = dict(zip(FEATURES, seen, strict=True), points=points)
    steps = (
        ("", Step(net, "picture").eval(), {"bands": bands}, FEATURES),
        ("_points", Step(net, "odds").eval(), asked, ("log_odds",)),
    )
    told = []
    for suffix, step, given, gives in steps:
        part = file.with_stem(file.stem + suffix)
        torch.onnx.export(
            step,
            tuple(given.values()),
            str(part),
            input_names=list(given),
            output_names=list(gives),
            opset_version=17,
            dynamo=False,
        )
        finish(part)
        told.append({"suffix": suffix, "takes": list(given), "gives": list(gives)})
    return told


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pictures", type=Path, help="as outline_pictures.py writes them")
    parser.add_argument("--without", type=int, choices=range(FOLDS), help="leave out this fold")
    parser.add_argument("--seconds", type=float, default=450.0)
    parser.add_argument("--every", type=float, default=75.0, help="seconds between reports")
    parser.add_argument("--workers", type=int, default=2, help="processes that draw lessons")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the network elsewhere")
    train(parser.parse_args())


if __name__ == "__main__":
    main()
