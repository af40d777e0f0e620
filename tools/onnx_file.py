"""The file of a trained network as OpenCV reads it best: small, and each convolution in one piece.

OpenCV (tried from 4.10 to 5.0) computes a convolution together with its own margin and a rectifier
without an upper end; for a `Pad` or a `Clip` between two of them it turns all features into
another order in memory and back.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import ModelProto, NodeProto, TensorProto, helper, numpy_helper
from onnx.reference import ReferenceEvaluator

#: Fewer weights stay as they are.
LEAST = 256


def finish(file: Path) -> None:
    """Give an exported ONNX file its last form. What the network computes stays as it is."""
    model = onnx.load(file)
    take_margins(model)
    drop_unused(model)
    store_in_half(model)
    onnx.checker.check_model(model)
    onnx.save(model, file)


def take_margins(model: ModelProto) -> None:
    """Make the zeros that are laid around a convolution's input a margin of its own."""
    made_by = {name: node for node in model.graph.node for name in node.output}
    for node in model.graph.node:
        before = made_by.get(node.input[0]) if node.op_type == "Conv" else None
        if before is None or before.op_type != "Pad":
            continue
        top, left = (around := constant(model, before.input[1]))[2:4]
        bottom, right = around[-2:]
        margin = next(one for one in node.attribute if one.name == "pads")
        wider = [int(a + b) for a, b in zip(margin.ints, (top, left, bottom, right), strict=True)]
        margin.CopyFrom(helper.make_attribute("pads", wider))
        node.input[0] = before.input[0]


def constant(model: ModelProto, name: str) -> NDArray[np.int64]:
    """The value of a tensor that no input of the network changes."""
    value = helper.make_tensor_value_info(name, TensorProto.INT64, None)
    graph = helper.make_graph(needed(model, {name}), name, [], [value], model.graph.initializer)
    alone = helper.make_model(graph, opset_imports=model.opset_import)
    return np.asarray(ReferenceEvaluator(alone).run(None, {})[0])


def needed(model: ModelProto, names: set[str]) -> list[NodeProto]:
    """The nodes that these tensors are computed by, in their order."""
    names, nodes = set(names), []
    for node in reversed(model.graph.node):
        if names.intersection(node.output):
            names.update(node.input)
            nodes.append(node)
    return nodes[::-1]


def drop_unused(model: ModelProto) -> None:
    """Take out what no output is computed by."""
    nodes = needed(model, {one.name for one in model.graph.output})
    del model.graph.node[:]
    model.graph.node.extend(nodes)


def store_in_half(model: ModelProto) -> None:
    """Store the weights in 16 bits, each cast to 32 before it is used: OpenCV casts as it loads.

    The loss is a thousandth of a weight at most.
    """
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
