"""Write the mean of networks that went on from one another, weight by weight.

    python tools/mean_network.py OUT NETWORK NETWORK ... [--shares S S ...]

Needs ONNX (dependency group `train`). Runs of one training err in different places; the mean of
their weights errs less than each. All must have the same layers in the same order.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import onnx
from onnx import numpy_helper


def mean_of(networks: list[onnx.ModelProto], shares: list[float] | None) -> onnx.ModelProto:
    """Return the first network with the mean of the weights of all, by their shares."""
    named = [{each.name: each for each in one.graph.initializer} for one in networks]
    if any(list(one) != list(named[0]) for one in named):
        raise ValueError("These networks do not have the same layers.")
    for name, first in named[0].items():
        weights = [numpy_helper.to_array(one[name]) for one in named]
        if weights[0].dtype.kind == "f":
            mean = np.average(np.stack(weights).astype(float), axis=0, weights=shares)
            first.CopyFrom(numpy_helper.from_array(mean.astype(weights[0].dtype), name))
    return networks[0]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("networks", type=Path, nargs="+")
    parser.add_argument("--shares", type=float, nargs="+", help="one for each; equal by default")
    given = parser.parse_args()
    onnx.save(mean_of([onnx.load(path) for path in given.networks], given.shares), given.out)


if __name__ == "__main__":
    main()
