"""Weights of a network in 16 bits: half the file, and the network computes in 32 as before."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

#: Smaller ones stay as they are.
LEAST = 256


def store_in_half(file: Path) -> None:
    """Store the weights of an ONNX file in 16 bits, each cast to 32 before it is used.

    The loss is a thousandth of a weight at most. OpenCV casts when it loads the file (tried from
    4.10 to 5.0).
    """
    model = onnx.load(file)
    stored, casts = [], []
    for weights in model.graph.initializer:
        values = numpy_helper.to_array(weights)
        if values.dtype != np.float32 or values.size < LEAST:
            stored.append(weights)
            continue
        half = f"{weights.name}_half"
        stored.append(numpy_helper.from_array(values.astype(np.float16), half))
        casts.append(helper.make_node("Cast", [half], [weights.name], to=TensorProto.FLOAT))
    nodes = [*casts, *model.graph.node]
    for part, whole in ((model.graph.initializer, stored), (model.graph.node, nodes)):
        del part[:]
        part.extend(whole)
    onnx.checker.check_model(model)
    onnx.save(model, file)
