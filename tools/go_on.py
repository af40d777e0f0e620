"""Go on from a network that was written: its weights, from the ONNX file back into PyTorch.

What is written has each batch norm folded into its convolution. Taken back, a norm gets the mean
and the spread that its convolution has on samples, so that the network answers as before and can
learn on.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import onnx
import torch
from numpy.typing import NDArray
from onnx import ModelProto, numpy_helper
from torch import Tensor, nn


def take_over(net: nn.Module, file: Path, samples: Iterable[Tensor]) -> None:
    """Give a network the weights of an ONNX file that was written of one like it.

    A file without the last convolutions will do: they stay as they begin.

    Parameters
    ----------
    net : nn.Module
    file : Path
    samples : iterable of Tensor
        Batches, the first of which also tells the order of the convolutions.

    Raises
    ------
    ValueError
        If the file holds other convolutions.
    """
    batches = iter(samples)
    first = next(batches)
    net.eval()
    ordered = convolutions(net, first)
    norms = normed(net)
    written = weights(onnx.load(file))
    shapes = [torch.Size(w.shape) for w, _ in written]
    if [one.weight.shape for one in ordered[: len(shapes)]] != shapes:
        raise ValueError(f"{file.name} holds other convolutions")
    with torch.no_grad():
        for conv, (weight, bias) in zip(ordered, written, strict=False):
            conv.weight.copy_(torch.tensor(weight))
            norm = norms.get(conv)
            if norm is not None:
                norm.weight.fill_(1.0)
                norm.bias.copy_(torch.tensor(bias))
                norm.running_mean.zero_()
                norm.running_var.fill_(1.0 - norm.eps)
            elif conv.bias is not None:
                conv.bias.copy_(torch.tensor(bias))
        set_spread(net, norms, [first, *batches])


def convolutions(net: nn.Module, batch: Tensor) -> list[nn.Conv2d]:
    """Convolutions in the order in which they are computed."""
    order: list[nn.Conv2d] = []
    found = [one for one in net.modules() if isinstance(one, nn.Conv2d)]
    hooks = [one.register_forward_hook(lambda conv, *_: order.append(conv)) for one in found]
    with torch.no_grad():
        net(batch)
    for hook in hooks:
        hook.remove()
    return order


def normed(net: nn.Module) -> dict[nn.Module, nn.BatchNorm2d]:
    """The norm that follows each convolution without a bias of its own."""
    found: dict[nn.Module, nn.BatchNorm2d] = {}
    last: nn.Module | None = None
    for one in net.modules():
        if isinstance(one, nn.BatchNorm2d) and last is not None:
            found[last] = one
        last = one if isinstance(one, nn.Conv2d) else None
    return found


def weights(model: ModelProto) -> list[tuple[NDArray[np.float32], NDArray[np.float32]]]:
    """Weights and biases (zero where there are none) of the convolutions, as they are computed."""
    known = {one.name: numpy_helper.to_array(one) for one in model.graph.initializer}
    found = []
    for node in model.graph.node:
        if node.op_type == "Cast" and node.input[0] in known:
            known[node.output[0]] = known[node.input[0]].astype(np.float32)
        if node.op_type == "Conv":
            weight = np.array(known[node.input[1]])
            bias = known[node.input[2]] if len(node.input) > 2 else np.zeros(len(weight))
            found.append((weight, np.array(bias, np.float32)))
    return found


def set_spread(
    net: nn.Module, norms: dict[nn.Module, nn.BatchNorm2d], batches: list[Tensor]
) -> None:
    """Give norms the statistics of their convolutions; what they answer stays as it is."""
    sums: dict[nn.Module, list[Tensor]] = {}

    def measure(conv: nn.Module, _: object, out: Tensor) -> None:
        wide = out.double()
        sums.setdefault(conv, []).append(
            torch.stack([wide.mean((0, 2, 3)), (wide * wide).mean((0, 2, 3))])
        )

    hooks = [one.register_forward_hook(measure) for one in norms]
    for batch in batches:
        net(batch)
    for hook in hooks:
        hook.remove()
    for conv, some in sums.items():
        norm = norms[conv]
        mean, square = torch.stack(some).mean(0)
        spread = (square - mean**2).clamp(min=1e-6)
        norm.running_mean.copy_(mean)
        norm.running_var.copy_(spread)
        norm.weight.copy_((spread + norm.eps).sqrt())
        norm.bias.add_(mean)
