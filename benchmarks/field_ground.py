"""The network that judges the ground, learned: part of `field_choice.py`.

Learned by scikit-learn (dependency group `bench`), used without it.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from field_examples import Examples
from geofield.field import ground
from geofield.field.looks import LOOKS

#: Units, pull towards zero, rounds, how many networks are averaged.
UNITS, PULL, EPOCHS, NETWORKS = 16, 1.0, 12, 2
#: Most superpixels of one case.
SUPERPIXELS = 1000
TABLE = Path(ground.__file__).parent / "tables" / "ground.json"


def learn(known: Sequence[Examples], shares: np.ndarray) -> ground.Network:
    """A network that knows from a superpixel's looks whether it belongs to the field.

    `shares` are what the cases count.
    """
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.neural_network import MLPClassifier

    rng = np.random.default_rng(0)
    looks, belongs, weight = [], [], []
    for one, share in zip(known, shares / shares.mean(), strict=True):
        at = rng.permutation(np.flatnonzero(one.clear))[:SUPERPIXELS]
        looks.append(one.looks[at])
        belongs.append(one.belongs[at])
        weight.append(np.full(len(at), share))
    every = np.concatenate(looks).astype(float)
    usual, spread = every.mean(axis=0), every.std(axis=0) + 1e-6
    standard = ground.standardised(every, usual, spread)
    # It stops early on purpose.
    warnings.filterwarnings("ignore", category=ConvergenceWarning)
    nets = [
        MLPClassifier(
            (UNITS,),
            alpha=PULL,
            max_iter=EPOCHS,
            learning_rate_init=3e-3,
            batch_size=1024,
            random_state=seed,
        ).fit(standard, np.concatenate(belongs), sample_weight=np.concatenate(weight))
        for seed in range(NETWORKS)
    ]
    # Several networks side by side are one, whose answer is the mean of theirs.
    return ground.Network(
        usual,
        spread,
        np.hstack([net.coefs_[0] for net in nets]),
        np.concatenate([net.intercepts_[0] for net in nets]),
        np.concatenate([net.coefs_[1][:, 0] for net in nets]) / NETWORKS,
        float(np.mean([net.intercepts_[1][0] for net in nets])),
    )


def write(network: ground.Network) -> None:
    """Write `tables/ground.json`."""
    table = {
        "learned_by": "benchmarks/field_choice.py",
        "bias": round(network.bias, 5),
        "hidden_bias": network.hidden_bias.round(5).tolist(),
        "outward": network.outward.round(5).tolist(),
        "looks": [
            {
                "name": name,
                "usual": round(float(usual), 5),
                "spread": round(float(spread), 5),
                "hidden": hidden.round(5).tolist(),
            }
            for name, usual, spread, hidden in zip(
                LOOKS, network.usual, network.spread, network.hidden, strict=True
            )
        ],
    }
    lines = json.dumps(table).replace('{"name"', '\n{"name"')
    TABLE.write_text(lines + "\n", encoding="utf-8")
